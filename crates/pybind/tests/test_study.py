"""Sweeps and tolerance studies."""

import sys

import numpy as np
import pytest

import gearmodel as gm

TURN = np.linspace(0, 2 * np.pi, 720, endpoint=False)


def test_a_sweep_is_the_model_at_every_cell(errors):
    pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.1)
    over = {"eccentricity": [0.2, 0.4], "pressure_angle_deg": [14.5, 20, 25], "e1_mm": np.linspace(0, 0.1, 3)}
    table = gm.sweep(pair, over=over, of="te_pp", errors=errors, direction="cw")
    assert table.values.shape == (2, 3, 3) and list(table.axes) == list(over) and not table.faults
    for (i, k), (j, alpha), (m, e1) in (
        (a, b, c) for a in enumerate(over["eccentricity"]) for b in enumerate(over["pressure_angle_deg"]) for c in enumerate(over["e1_mm"])
    ):
        one = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=k, pressure_angle_deg=alpha)
        te = one.transmission_error(TURN, errors.replace(e1_mm=e1), direction="cw")
        assert table.values[i, j, m] == pytest.approx(np.ptp(te), rel=1e-10)
    rows = table.records()
    assert rows.dtype.names == ("eccentricity", "pressure_angle_deg", "e1_mm", "te_pp_rad") and len(rows) == 18
    assert np.asarray(table).shape == (2, 3, 3) and "te_pp over eccentricity[2]" in repr(table)


def test_cells_without_a_pair_say_why(pair):
    table = gm.sweep(pair, over={"eccentricity": [0.3, 1.2]}, of="backlash_pp")
    assert np.isfinite(table.values[0]) and np.isnan(table.values[1])
    ((index, reason),) = table.faults
    assert index == (1,) and "eccentricity" in reason


def test_what_a_sweep_refuses(pair):
    for change, text in (
        ({"over": {"e3_mm": [1.0]}}, "e3_mm"),
        ({"over": {"e1_mm": []}}, "axis"),
        ({"of": "noise"}, "noise"),
        ({"method": "published"}, "published"),
        ({"pair": gm.GearPair.constant(ratio=3), "over": {"module_mm": [1.0]}}, "constant"),
        ({"pair": gm.GearPair.fourier(module_mm=3, teeth=40, cosines=[0.1]), "over": {"eccentricity": [0.1]}}, "fourier"),
    ):
        with pytest.raises(ValueError, match=text):
            gm.sweep(**({"pair": pair, "over": {"e1_mm": [0.1]}} | change))


@pytest.mark.parametrize("method", ["common_normal", "exact"])
def test_every_kind_of_pair_sweeps_what_it_has(errors, method):
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)

    def fourier(scale):
        return gm.GearPair.fourier(module_mm=3, teeth=40, cosines=[0.1 * scale, 0.02 * scale])

    def lobed(k):
        return gm.GearPair.lobed(module_mm=3, teeth=(40, 60), eccentricity=k, lobes=(2, 3))

    def sampled(module):
        return gm.GearPair.sampled(module_mm=module, teeth=40, theta1_rad=angle, radius=1 + 0.1 * np.cos(angle))

    def circular(module):
        return gm.GearPair.circular(module_mm=module, teeth=(40, 60))

    for make, name, values, at in (
        (fourier, "harmonic_scale", [0.5, 0.9], 1.0),
        (lobed, "eccentricity", [0.02, 0.08], 0.05),
        (sampled, "module_mm", [2.0, 3.0], 3.0),
        (circular, "module_mm", [2.0, 3.0], 3.0),
    ):
        table = gm.sweep(make(at), over={name: values, "e2_mm": [0.01, 0.03]}, errors=errors, method=method, angles=90)
        theta = 2 * np.pi * np.arange(90) / 90
        for row, value in zip(table.values, values):
            alone = make(value).transmission_error(theta, errors.replace(e2_mm=0.03), method=method)
            assert abs(row[1] - np.ptp(alone)) < 1e-12


def test_progress_and_its_exceptions(pair):
    heard = []
    gm.sweep(pair, over={"e1_mm": np.linspace(0, 0.1, 500)}, angles=16, progress=lambda done, total: heard.append((done, total)))
    assert (500, 500) in heard and len(heard) < 300

    def stop(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        pair.tolerance(sigma={"e1_mm": 0.1}, n=5000, angles=16, progress=stop)


SCATTER = {"sigma": {"e1_mm": 0.02, "backlash_mm": 0.01}, "uniform": {"phi1_rad": np.pi}}


def test_tolerance(pair, errors):
    t = pair.tolerance(errors, n=4000, seed=3, **SCATTER)
    assert set(t) == {"te_ccw_pp_rad", "te_cw_pp_rad", "backlash_min_rad", "backlash_mean_rad", "backlash_pp_rad"}
    figure = t["te_ccw_pp_rad"]
    assert figure.values_rad.shape == (4000,) and figure.std_rad == pytest.approx(figure.values_rad.std(ddof=1))
    assert figure.quantile_rad(0.5) == t.quantile_rad("te_ccw_pp_rad", 0.5) == pytest.approx(np.median(figure.values_rad))
    assert set(figure.shares) == {"e1_mm", "backlash_mm", "phi1_rad"}
    shares = t["backlash_mean_rad"].shares
    assert max(shares, key=shares.__getitem__) == "backlash_mm" and 0.5 < sum(shares.values()) < 1.05
    np.testing.assert_array_equal(pair.tolerance(errors, n=4000, seed=3, **SCATTER)["te_cw_pp_rad"].values_rad, t["te_cw_pp_rad"].values_rad)
    assert not np.array_equal(pair.tolerance(errors, n=4000, seed=4, **SCATTER)["te_cw_pp_rad"].values_rad, t["te_cw_pp_rad"].values_rad)
    assert repr(t).startswith("Tolerance(4000 pairs)")
    with pytest.raises(KeyError, match="the figures are te_ccw_pp_rad"):
        t["te"]


def test_what_a_tolerance_study_refuses(pair):
    for change, text in (
        ({"sigma": {"eccentricity": 0.1}}, "design"),
        ({"sigma": {"e1_mm": 0.1}, "uniform": {"e1_mm": 0.1}}, "twice"),
        ({"sigma": {"e1_mm": -0.1}}, "scatter"),
        ({"sigma": {"e1_mm": 0.1}, "n": 1}, "pairs"),
        ({"sigma": {"e9_mm": 0.1}}, "e9_mm"),
    ):
        with pytest.raises(ValueError, match=text):
            pair.tolerance(**change)


def test_labelled_tables(pair):
    pandas, xarray = pytest.importorskip("pandas"), pytest.importorskip("xarray")
    table = gm.sweep(pair, over={"e1_mm": [0.0, 0.1], "e2_mm": [0.0, 0.2]})
    assert isinstance(table.to_pandas(), pandas.DataFrame) and len(table.to_pandas()) == 4
    labelled = table.to_xarray()
    assert isinstance(labelled, xarray.DataArray) and float(labelled.sel(e1_mm=0.1, e2_mm=0.0)) == table.values[1, 0]
    assert pair.tolerance(sigma={"e1_mm": 0.1}, n=100).to_pandas().shape == (5, 6)


def test_plot(pair):
    pytest.importorskip("matplotlib")
    gm.sweep(pair, over={"e1_mm": [0.0, 0.1], "e2_mm": [0.0, 0.2]}).plot().canvas.draw()
    gm.sweep(pair, over={"e1_mm": [0.0, 0.1]}).plot().canvas.draw()


def test_missing_packages_are_asked_for_by_name(pair, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="needs pandas: pip install pandas"):
        gm.sweep(pair, over={"e1_mm": [0.1]}).to_pandas()
