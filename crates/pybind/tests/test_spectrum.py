"""Order spectra, long and short waves, averages and the floor's interval, of signals whose orders are known."""

import math
import pickle

import numpy as np
import pytest

import gearmodel as gm

TURNS = 4
SAMPLES = 120_000


def record(pair, te, *, noise_rad=0.0, seed=0, turns=TURNS, direction="ccw"):
    travelled = np.linspace(0, 2 * np.pi * turns, SAMPLES)
    theta1 = travelled if direction == "ccw" else -travelled
    noise = noise_rad * np.random.default_rng(seed).standard_normal(SAMPLES)
    return gm.Recording(travelled / 0.5, theta1, pair.theta2(theta1) + te(theta1) + noise, 10.0, 4.77, direction)


def tooth_phase(pair, theta1):
    return 2 * np.pi * pair.teeth[0] * pair.arc_length_mm(theta1) / pair.perimeter_mm


@pytest.mark.parametrize(("axis", "order"), [("input", 3), ("output", 2), ("mesh", 1)])
def test_a_wave_of_one_axis_is_one_order_there_and_many_elsewhere(pair, axis, order):
    angle = {"input": lambda t: t, "output": pair.theta2, "mesh": lambda t: tooth_phase(pair, t)}[axis]
    a = gm.analyse(record(pair, lambda t: 5e-5 * np.cos(order * angle(t) - 0.4)), pair, bins=2880)
    for name in ("input", "output", "mesh"):
        spectrum = getattr(a.spectrum, name)
        assert spectrum.axis == name
        assert spectrum.orders.shape == spectrum.amplitude_rad.shape == spectrum.phase_rad.shape
        loud = spectrum.amplitude_rad > 2.5e-7
        assert (loud.sum() == 1) == (name == axis), name
    line = getattr(a.spectrum, axis).strongest(1)[0]
    assert line.order == pytest.approx(order)
    # Bins of 0.125 deg take up to sin(x)/x from a wave of the mesh, locally order 64: 0.1 %.
    assert line.amplitude_rad == pytest.approx(5e-5, rel=2e-3) and line.phase_rad == pytest.approx(0.4, abs=1e-3)
    own = getattr(a.spectrum, axis)
    power = np.sum(own.amplitude_rad**2) / 2
    assert own.rms_rad**2 - own.mean_rad**2 == pytest.approx(power, rel=1e-3)


def test_the_spectrum_by_itself_is_that_of_the_input_shaft(pair):
    a = gm.analyse(record(pair, lambda t: 5e-5 * np.cos(3 * t - 0.4)), pair, highest_order=60)
    assert len(a.spectrum) == 60 and a.spectrum.orders.tolist() == list(range(1, 61))
    assert a.spectrum[2].amplitude_rad == a.spectrum.input.amplitude_rad[2]
    assert [row.order for row in a.spectrum][:2] == [1, 2]
    assert "strongest in urad 3: 50.0" in repr(a.spectrum) and "mesh" in repr(a.spectrum)


def test_other_axes_need_a_whole_turn_and_teeth(pair):
    whole = record(pair, lambda t: 0 * t)
    half = gm.Recording(whole.time_s[:15000], whole.theta1_rad[:15000], whole.theta2_rad[:15000], 1, 1, "ccw")
    a = gm.analyse(half, pair, highest_order=4)
    assert np.isnan(a.spectrum.mean_rad)
    for axis in ("output", "mesh"):
        with pytest.raises(ValueError, match=rf"no {axis} spectrum: 360 of 720 bins hold no finite value"):
            getattr(a.spectrum, axis)
    with pytest.raises(ValueError, match="360 of 720 bins"):
        a.waves(0.3)
    bare = gm.GearPair.constant(ratio=2.0)
    b = gm.analyse(record(bare, lambda t: 1e-4 * np.cos(2 * t)), bare)
    with pytest.raises(ValueError, match="no mesh spectrum.*no teeth"):
        _ = b.spectrum.mesh
    # Twice a turn of the driver is four times a turn of the driven shaft.
    assert b.spectrum.output.strongest(1)[0].order == pytest.approx(4.0)


def test_long_and_short_waves(pair):
    te = lambda t: 0.3 + 1e-3 * np.cos(t + 0.2) + 1e-4 * np.sin(tooth_phase(pair, t))  # noqa: E731
    a = gm.analyse(record(pair, te), pair)
    split = a.waves(cut_off_order=0.3)
    np.testing.assert_allclose(split.long.curve + split.short.curve, a.mean_curve, atol=1e-15)
    assert split.long.f_i_total == pytest.approx(2e-3, rel=0.02)
    assert split.short.f_i_total == pytest.approx(2e-4, rel=0.1)
    assert split.short.f_i_tooth == pytest.approx(2e-4, rel=0.1) and split.long.f_i_tooth < split.long.f_i_total / 5
    assert split.short.fluctuation_rms_rad == pytest.approx(1e-4 / math.sqrt(2), rel=0.1)
    assert (split.axis, split.cut_off_order) == ("mesh", 0.3)
    assert split.transmission(0.3) == pytest.approx(0.5) and isinstance(split.transmission(0.3), float)
    np.testing.assert_allclose(split.transmission([0.0, 0.6]), [1.0, 1 / 16])
    # At the cut-off half of a wave goes to either part, on the input shaft's axis too.
    wave = gm.analyse(record(pair, lambda t: 1e-3 * np.cos(5 * t)), pair).waves(5.0, axis="input")
    assert wave.long.f_i_total == pytest.approx(wave.short.f_i_total, rel=1e-2)
    for cut_off, axis, text in [(0.0, "mesh", "cut-off order of 0"), (1e3, "mesh", "1000"), (1.0, "shaft", 'axis "shaft"')]:
        with pytest.raises(ValueError, match=text):
            a.waves(cut_off, axis)


def test_averages_keep_what_turns_with_their_shaft():
    pair = gm.GearPair.constant(ratio=3.0)
    rec = record(pair, lambda t: 3e-5 * np.cos(t) + 7e-5 * np.sin(t / 3), turns=12)
    a = gm.analyse(rec, pair)
    driver, driven = a.synchronous_average(), a.synchronous_average("output")
    np.testing.assert_array_equal(driver.te, a.mean_curve)
    assert (driver.revolutions, driven.revolutions) == (a.revolutions, driver.revolutions // 3)
    theta, te, revolutions, shaft = a.synchronous_average("output", bins=360)
    assert theta.shape == te.shape == (360,) and revolutions >= 3 and shaft == "output"
    np.testing.assert_allclose(te, 3e-5 * np.cos(3 * theta) + 7e-5 * np.sin(theta), atol=1e-6)
    with pytest.raises(ValueError, match='shaft "mesh"'):
        a.synchronous_average("mesh")
    with pytest.raises(ValueError, match="7 bins"):
        a.synchronous_average(bins=7)


def test_the_floor_is_a_float_with_an_interval_that_holds_the_truth(pair):
    held, trials = 0, 40
    for seed in range(trials):
        a = gm.analyse(record(pair, np.sin, noise_rad=1e-5, seed=seed), pair, bins=90)
        # Samples a bin and revolution scatter independently.
        truth = 1e-5 / math.sqrt(SAMPLES / TURNS / 90 * a.revolutions)
        held += a.floor.low_rad <= truth <= a.floor.high_rad
    assert held >= 0.9 * trials
    assert isinstance(a.floor, float) and a.floor.low_rad < a.floor < a.floor.high_rad
    assert (a.floor.confidence, a.floor.revolutions) == (0.9, a.revolutions)
    twin = pickle.loads(pickle.dumps(a.floor))
    assert twin == a.floor and twin.high_rad == a.floor.high_rad
    one = gm.analyse(record(pair, np.sin, turns=1), pair)
    assert math.isnan(one.floor) and math.isnan(one.floor.low_rad)


def test_spectra_as_tables(pair):
    pytest.importorskip("pandas")
    frame = gm.analyse(record(pair, np.sin), pair).spectrum.mesh.to_pandas()
    assert list(frame.columns) == ["order", "amplitude_rad", "phase_rad"]
