"""The model against the reference tables, to the tolerances that they state."""

import numpy as np
import pytest
from conftest import ROOT

import gearmodel as gm

TOLERANCE_RAD = {"exact": 1e-8, "common_normal": 1e-10, "published": 1e-10}


@pytest.mark.parametrize(("name", "k"), [("te_circular_k0.csv", 1e-12), ("te_elliptic_k0.3287.csv", 0.3287)])
def test_reference_table(name, k, errors):
    with (ROOT / "fixtures" / "reference" / name).open() as file:
        rows = [line for line in file if not line.startswith("#")]
    table = np.genfromtxt(rows, delimiter=",", names=True)
    pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=k)
    theta1 = table["theta1_rad"]
    np.testing.assert_allclose(pair.theta2(theta1), table["theta2_nominal_rad"], rtol=0, atol=1e-10)
    for method, tolerance in TOLERANCE_RAD.items():
        for direction in ("ccw", "cw"):
            te = pair.transmission_error(theta1, errors, direction=direction, method=method)
            np.testing.assert_allclose(te, table[f"te_{direction}_{method}"], rtol=0, atol=tolerance, err_msg=method)
    variation = table["backlash_variation_common_normal"]
    np.testing.assert_allclose(pair.backlash(theta1, errors), variation, rtol=0, atol=1e-10)


def test_circular_is_elliptical_without_eccentricity(errors):
    theta1 = np.linspace(-10, 10, 501)
    round_pair = gm.GearPair.circular(module_mm=3, teeth=47)
    limit = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0)
    np.testing.assert_allclose(round_pair.theta2(theta1), theta1, atol=1e-14)
    for method in TOLERANCE_RAD:
        np.testing.assert_allclose(
            round_pair.transmission_error(theta1, errors, method=method),
            limit.transmission_error(theta1, errors, method=method),
            atol=1e-12,
        )
