"""Effects under [documented] of a pair file, and calibrated models."""

import numpy as np
import pytest

import gearmodel as gm

PAIR = 'kind = "elliptical"\nmodule_mm = 3.0\nteeth = [47, 47]\neccentricity = 0.3287\n'
THETA1 = np.linspace(0, 2 * np.pi, 181)


def te(pair, **conditions):
    return pair.transmission_error(THETA1, **conditions)


def test_a_documented_skew_shows_with_speed():
    pair = gm.GearPair.from_toml(PAIR + "[documented.time_skew]\ndt_s = 5e-5\n")
    plain = gm.GearPair.from_toml(PAIR)
    assert pair.effects == ["time_skew"] and plain.effects == []
    assert np.array_equal(te(pair), te(plain))
    # dt * d theta2/dt
    expected = 5e-5 * pair.ratio(THETA1) * 12 * 2 * np.pi / 60
    assert np.allclose(te(pair, speed_rpm=12) - te(plain), expected, atol=1e-15)
    assert np.allclose(te(pair, speed_rpm=12, direction="cw") - te(plain, direction="cw"), -expected, atol=1e-15)
    assert gm.GearPair.from_toml(pair.to_toml()) == pair


def test_what_slips_grows_with_revolutions():
    pair = gm.GearPair.from_toml(PAIR + "[documented.slip]\nk_rad_per_rev_nm = 1e-6\nt0_nm = 2.0\n")
    plain = gm.GearPair.from_toml(PAIR)
    added = te(pair, load_nm=5, revolutions=10) - te(plain, load_nm=5)
    assert np.allclose(added, -1e-6 * 3 * 10, atol=1e-15)


def test_changes_of_errors_are_added_to_them():
    pair = gm.GearPair.from_toml(PAIR + "[documented]\ne2_mm = 0.03\n[documented.gear2_eccentricity]\ndx_mm = 0.0\ndy_mm = 0.04\n")
    assert pair.effects == [] and pair.errors.e2_mm == pytest.approx(0.05)
    assert pair.with_errors(gm.Errors()).errors == gm.Errors()


def test_refused_by_name():
    with pytest.raises(gm.GeometryError, match="no parameter `dt`: it has `dt_s`"):
        gm.GearPair.from_toml(PAIR + "[documented.time_skew]\ndt = 5e-5\n")
    pair = gm.GearPair.from_toml(PAIR)
    with pytest.raises(ValueError, match="speed_rpm is NaN"):
        te(pair, speed_rpm=float("nan"))


def test_a_diagnosis_gives_a_pair_that_explains_the_recordings():
    pair = gm.GearPair.from_toml(PAIR)
    rng = np.random.default_rng(1)

    def run(sign, start_s):
        time_s = start_s + np.arange(0, 40, 0.01)
        theta1 = sign * 2 * np.pi * 6 / 60 * (time_s - start_s)
        theta2 = pair.theta2(theta1)
        theta2 = theta2 + 6e-5 * np.sin(theta2 - 0.5) + 5e-6 * rng.standard_normal(time_s.size)
        return gm.Recording(time_s, theta1, theta2, 2.0, 6.0, "ccw" if sign > 0 else "cw")

    recordings = [run(1, 0.0), run(-1, 60.0)]
    found = gm.diagnose(recordings, pair)
    calibrated = found.model.pair
    assert calibrated.effects and gm.GearPair.from_toml(found.model.to_toml()) == calibrated
    added = te(calibrated) - te(pair)
    expected = 6e-5 * np.sin(pair.theta2(THETA1) - 0.5)
    difference = added - expected
    assert np.std(difference) < 2e-6
    again = gm.diagnose(recordings, calibrated)
    assert again.gap.before_rad < 0.2 * found.gap.before_rad
