"""Single teeth, displaced axes, elastic teeth and derivatives."""

import copy
import pickle

import numpy as np
import pytest

import gearmodel as gm

TURN = np.linspace(0, 2 * np.pi, 400)


def test_a_lead_moves_the_driven_gear_ahead_in_both_senses():
    pair = gm.GearPair.circular(module_mm=3, teeth=40)
    teeth = gm.ToothErrors(driver_ccw_mm=np.full(40, 0.01), driver_cw_mm=np.full(40, 0.01))
    expected = 0.01 / (60 * np.cos(np.radians(20)))
    for method in ("exact", "common_normal"):
        for direction in ("ccw", "cw"):
            te = pair.transmission_error(TURN, direction=direction, method=method, tooth_errors=teeth)
            np.testing.assert_allclose(te, expected, rtol=1e-6)
        np.testing.assert_allclose(pair.backlash(TURN, method=method, tooth_errors=teeth), 0, atol=1e-9)


def test_the_most_advanced_pair_carries(pair):
    leads = 1e-3 * np.random.default_rng(3).standard_normal(47)
    teeth = gm.ToothErrors(driver_ccw_mm=leads)
    exact, first = (
        pair.transmission_error(TURN, method=method, tooth_errors=teeth) for method in ("exact", "common_normal")
    )
    np.testing.assert_allclose(first, exact, atol=0.05 * np.ptp(exact))
    arm = pair.radius(TURN, gear=2) * np.cos(pair.pressure_angle_rad - pair.inclination(TURN))
    assert np.all(exact * arm <= leads.max() + 1e-9) and np.all(exact * arm >= leads.min() - 1e-9)


def test_a_damaged_tooth_lags_where_it_alone_carries():
    pair = gm.GearPair.circular(module_mm=3, teeth=40)
    te = pair.transmission_error(TURN, method="exact", tooth_errors=gm.ToothErrors(damage=[gm.ToothDamage(5, 0.02, 1.0)]))
    assert te.max() <= 1e-12 and te.min() < -1e-5
    assert np.mean(te < -1e-9) < 2 / 40
    assert TURN[np.argmin(te)] == pytest.approx(5 * 2 * np.pi / 40, abs=0.1)


def test_a_grown_centre_distance(pair):
    da = 0.02
    for direction, sign in (("ccw", -1), ("cw", 1)):
        te = pair.transmission_error(TURN, direction=direction, displacement_mm=(-da, 0.0))
        expected = sign * da * np.tan(pair.pressure_angle_rad + sign * pair.inclination(TURN)) / pair.radius(TURN, gear=2)
        np.testing.assert_allclose(te, expected, atol=1e-12)
        exact = pair.transmission_error(TURN, direction=direction, method="exact", displacement_mm=(-da, 0.0))
        np.testing.assert_allclose(exact, expected, atol=0.01 * np.abs(expected).max())


def test_what_does_not_fit_is_refused(pair):
    for teeth in (gm.ToothErrors(driver_cw_mm=[0.1]), gm.ToothErrors(damage=[gm.ToothDamage(47, 0.1, 1)])):
        with pytest.raises(gm.GeometryError, match="47"):
            pair.transmission_error(0.0, method="exact", tooth_errors=teeth)
    with pytest.raises(ValueError, match="published.*eccentricities alone"):
        pair.backlash(0.0, method="published", tooth_errors=gm.ToothErrors())
    with pytest.raises(ValueError, match="driver_ccw_mm has 2 dimensions"):
        gm.ToothErrors(driver_ccw_mm=[[0.1]])
    with pytest.raises(ValueError, match="left"):
        gm.ToothDamage(0, 0.1, 1.0, "left")
    with pytest.raises(ValueError, match="tooth -1"):
        gm.ToothDamage(-1, 0.1, 1.0)


def test_copies_are_equal():
    teeth = gm.ToothErrors(
        driver_ccw_mm=[0.1, 0.2], profile_cw=gm.Profile(waves=[(1e-3, 0.5)]), damage=[gm.ToothDamage(1, 0.1, 0.5, "cw")]
    )
    assert pickle.loads(pickle.dumps(teeth)) == copy.deepcopy(teeth) == teeth
    assert eval(repr(teeth), vars(gm)) == teeth
    assert repr(gm.ToothErrors()) == "ToothErrors()"


def test_load_lags_and_does_not_accumulate(pair, errors):
    loaded = pair.loaded(errors, bearing_clearance_mm=0.002)
    rigid = pair.transmission_error(TURN, errors, method="exact")
    np.testing.assert_allclose(loaded.transmission_error(TURN, 0.0), rigid, atol=1e-12)
    light, heavy = (loaded.transmission_error(TURN, load) for load in (5.0, 15.0))
    assert np.all(heavy < light) and np.all(light < rigid)
    np.testing.assert_allclose(loaded.transmission_error(TURN + 6 * np.pi, 15.0), heavy, atol=1e-10)
    assert np.all(loaded.backlash(TURN, 15.0) > loaded.backlash(TURN, 5.0))
    assert type(loaded.backlash(0.0, 5.0)) is float
    for wrong in (-1.0, np.nan):
        with pytest.raises(ValueError, match="load"):
            loaded.transmission_error(0.0, wrong)


def test_mesh_shares_the_load(pair):
    mesh = pair.loaded().mesh(TURN, load_nm=10.0, direction="cw")
    arm = pair.radius(TURN, gear=2) * np.cos(pair.pressure_angle_rad + pair.inclination(TURN))
    np.testing.assert_allclose(mesh.force_n, 1e4 / arm, rtol=1e-12)
    assert set(mesh.pairs) <= {1, 2, 3} and np.all(mesh.largest_share <= 1)
    np.testing.assert_allclose(mesh.largest_share[mesh.pairs == 1], 1.0)
    assert np.all(mesh.tooth_deflection_mm > 0)


PARAMETERS = ["e1_mm", "phi1_rad", "e2_mm", "phi2_rad", "shaft_compliance_output_rad_per_nm", "mesh_compliance_mm2_rad_per_nm"]


@pytest.mark.parametrize("name", PARAMETERS)
def test_derivatives_by_the_errors(pair, errors, name):
    errors = errors.replace(shaft_compliance_output_rad_per_nm=1e-5, mesh_compliance_mm2_rad_per_nm=1e-3)
    step = 1e-4 * max(errors.to_dict()[name], 1e-3)
    up, down = (errors.replace(**{name: errors.to_dict()[name] + h}) for h in (step, -step))
    for direction in ("ccw", "cw"):
        te = [pair.transmission_error(TURN, e, direction=direction, load_nm=7.0) for e in (up, down)]
        exact = pair.te_derivative(TURN, name, errors, direction=direction, load_nm=7.0)
        np.testing.assert_allclose(exact, (te[0] - te[1]) / (2 * step), rtol=1e-6, atol=1e-6 * np.abs(exact).max())


def test_parameters_are_named(pair):
    with pytest.raises(ValueError, match='"e3_mm" is unknown.*e1_mm'):
        pair.te_derivative(0.0, "e3_mm")
    with pytest.raises(ValueError, match="eccentricity.*circular"):
        gm.GearPair.circular(module_mm=3, teeth=40).te_derivative(0.0, "eccentricity")
