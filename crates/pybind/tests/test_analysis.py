"""Measured figures of recordings whose TE is known."""

import numpy as np
import pytest

import gearmodel as gm

REVOLUTIONS = 4
SAMPLES = 40_000


def run(pair, direction, te, noise_rad=0.0, offset_rad_per_rev=0.0, seed=0):
    """A recording of some revolutions with a TE that is a function of theta1."""
    travelled = np.linspace(0, 2 * np.pi * REVOLUTIONS, SAMPLES)
    theta1 = travelled if direction == "ccw" else 1.0 - travelled
    noise = noise_rad * np.random.default_rng(seed).standard_normal(SAMPLES)
    theta2 = pair.theta2(theta1) + te(theta1) + offset_rad_per_rev * travelled / (2 * np.pi) + noise
    return gm.Recording(travelled / 0.5, theta1, theta2, 10.0, 4.77, direction)


@pytest.mark.parametrize("direction", ["ccw", "cw"])
def test_the_model_is_found_again(pair, errors, direction):
    pair = pair.with_errors(errors)
    rec = run(pair, direction, lambda theta: pair.transmission_error(theta, direction=direction))
    a = gm.analyse(rec, pair)
    assert a.te.shape == (REVOLUTIONS if direction == "cw" else a.revolutions, 720)
    assert a.theta1.shape == a.mean_curve.shape == a.predicted.shape == (720,)
    # A bin's mean of a curve stands above or below its centre by curvature width^2/24: some 1e-8 rad here.
    np.testing.assert_allclose(a.mean_curve, a.predicted, atol=2e-8)
    np.testing.assert_allclose(a.predicted, pair.transmission_error(a.theta1, direction=direction), atol=1e-15)
    assert a.f_i_total == pytest.approx(np.ptp(a.predicted), rel=1e-4)
    assert 0 < a.f_i_tooth < a.f_i_total
    assert a.residual_rms_rad < 2e-8 and a.floor < 1e-8 and abs(a.cumulative_offset) < 1e-9
    assert (a.direction, a.load_nm, a.gaps, a.coverage) == (direction, 10.0, 0, 1.0)


def test_spectrum_and_floor(pair):
    te = lambda theta: 5e-5 * np.cos(3 * theta - 0.4)  # noqa: E731
    a = gm.analyse(run(pair, "ccw", te, noise_rad=1e-6), pair, highest_order=60)
    assert a.spectrum.order.tolist() == list(range(1, 61))
    third = a.spectrum[2]
    assert third.amplitude_rad == pytest.approx(5e-5, rel=1e-3) and third.phase_rad == pytest.approx(0.4, abs=1e-3)
    # 10 000 samples a revolution on 720 bins, then the mean of the whole revolutions.
    assert a.floor == pytest.approx(1e-6 / np.sqrt(10_000 / 720 * a.revolutions), rel=0.1)


@pytest.mark.parametrize("direction", ["ccw", "cw"])
def test_an_offset_that_accumulates(pair, direction):
    a = gm.analyse(run(pair, direction, lambda theta: 0 * theta, 1e-6, offset_rad_per_rev=2e-5), pair)
    assert a.cumulative_offset == pytest.approx(2e-5, rel=1e-2)


def test_gaps_are_skipped(pair):
    rec = run(pair, "ccw", np.sin)
    theta1 = np.array(rec.theta1_rad)
    theta1[100:200] = np.nan
    a = gm.analyse(gm.Recording(rec.time_s, theta1, rec.theta2_rad, 1.0, 0.0, "auto"), pair)
    assert a.gaps == 100 and a.samples == SAMPLES - 100


def test_less_than_a_revolution(pair):
    rec = run(pair, "ccw", lambda theta: 0 * theta)
    a = gm.analyse(gm.Recording(rec.time_s[:5000], rec.theta1_rad[:5000], rec.theta2_rad[:5000], 1.0, 0.0, "ccw"), pair)
    assert a.revolutions == 0 and a.te.shape == (1, 720)
    assert a.coverage == pytest.approx(0.5, abs=0.01)
    assert np.isnan(a.floor) and np.isnan(a.cumulative_offset)


def test_a_recording_that_reverses_is_refused(pair):
    t = np.linspace(0, 10, 1000)
    rec = gm.Recording(t, np.sin(t), pair.theta2(np.sin(t)), 0.0, 0.0, "auto")
    with pytest.raises(ValueError, match=r"reverses 3 times.*split"):
        gm.analyse(rec, pair)
    assert [gm.analyse(part, pair).direction for part in rec.split()] == ["ccw", "cw", "ccw", "cw"]
    still = gm.Recording(t, 0 * t, 0 * t, 0.0, 0.0, "auto")
    with pytest.raises(ValueError, match="state"):
        gm.analyse(still, pair)


def test_bins_and_orders_are_checked(pair):
    rec = run(pair, "ccw", np.sin)
    with pytest.raises(ValueError, match="3 bins"):
        gm.analyse(rec, pair, bins=3)
    with pytest.raises(ValueError, match="highest_order = 360"):
        gm.analyse(rec, pair, highest_order=360)
    assert len(gm.analyse(rec, pair, bins=90).spectrum) == 44


def test_backlash_and_its_interval(errors):
    pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287, backlash_mm=0.1).with_errors(errors)
    inside, widths = [], []
    for seed in range(12):
        ccw, cw = (
            run(pair, d, lambda theta, d=d: pair.transmission_error(theta, direction=d), 2e-5, seed=2 * seed + (d == "cw"))
            for d in ("ccw", "cw")
        )
        b = gm.backlash_from(ccw, cw, pair)
        np.testing.assert_allclose(b.predicted, pair.backlash(b.theta1), atol=1e-15)
        inside.append(np.mean((b.low <= b.predicted) & (b.predicted <= b.high)))
        widths.append(np.mean(b.high - b.low))
    assert 0.85 < np.mean(inside) < 0.98
    assert b.min_rad <= b.mean_rad <= b.max_rad
    with pytest.raises(ValueError, match="ccw was recorded cw"):
        gm.backlash_from(cw, ccw, pair)


def test_one_revolution_has_no_interval(pair):
    half = [run(pair, d, lambda theta: 0 * theta) for d in ("ccw", "cw")]
    cut = [
        gm.Recording(r.time_s[:11000], r.theta1_rad[:11000], r.theta2_rad[:11000], 1.0, 0.0, r.direction) for r in half
    ]
    assert np.isnan(gm.backlash_from(*cut, pair).low).all()


def test_plots(pair):
    pytest.importorskip("matplotlib")
    ccw, cw = (run(pair, d, np.sin) for d in ("ccw", "cw"))
    for figure, axes in ((gm.analyse(ccw, pair).plot(), 2), (gm.backlash_from(ccw, cw, pair).plot(), 1)):
        assert len(figure.axes) == axes
        figure.canvas.draw()


def test_a_missing_package_is_asked_for_by_name(pair, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match=r"plot\(\) needs matplotlib: pip install"):
        gm.analyse(run(pair, "ccw", np.sin), pair).plot()
