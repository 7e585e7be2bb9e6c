"""Whatever numbers a pair is asked for with: it is refused by name, or everything about it is finite."""

import random

import numpy as np
import pytest

import gearmodel as gm

ODD = [0, -1, 1e-9, 0.5, 0.99, 1, 3, 20, 90, 1e9, 1e300, float("nan"), float("inf"), -float("inf")]
TEETH = [0, 1, 5, 12, 17, 20, 47, 60, 100, 10_001, -3, 2**80, 20.5]
SIZES = ["pressure_angle_deg", "backlash_mm", "centre_distance_mm", "addendum", "dedendum_clearance", "face_width_mm"]
TURN = np.linspace(-1, 7, 25)


def drawing(kind, pick):
    def number():
        return pick.choice(ODD) if pick.random() < 0.3 else pick.uniform(0, 2)

    if kind == "constant":
        return {"ratio": number()}
    teeth = (pick.choice(TEETH), pick.choice(TEETH)) if pick.random() < 0.3 else pick.choice(TEETH)
    given = {"module_mm": pick.choice([3.0, number()]), "teeth": teeth}
    given |= {name: number() for name in SIZES if pick.random() < 0.15}
    if kind in ("elliptical", "lobed"):
        given["eccentricity"] = pick.choice([pick.random(), number()])
    if kind == "lobed":
        given["lobes"] = (pick.randint(-1, 4), pick.choice([1, 2, 3, 0.5]))
    if kind in ("fourier", "transmission"):
        given["cosines"] = [0.2 * number() for _ in range(pick.randint(0, 4))]
    if kind == "sampled":
        count = pick.randint(0, 12)
        given["theta1_rad"] = sorted(pick.uniform(0, 6.28) for _ in range(count))
        given["radius"] = [pick.choice([number(), 1 + 0.1 * pick.random()]) for _ in range(count)]
    return given


@pytest.mark.parametrize("kind", ["elliptical", "circular", "lobed", "fourier", "sampled", "transmission", "constant"])
def test_refused_or_finite(kind):
    pick = random.Random(kind)
    made = 0
    for _ in range(300):
        try:
            pair = getattr(gm.GearPair, kind)(**drawing(kind, pick))
        except gm.GeometryError:
            continue
        made += 1
        errors = gm.Errors(e1_mm=1e-3, phi1_rad=1.0, e2_mm=1e-3)
        for method in (pair.theta2, pair.ratio, pair.radius, pair.inclination, pair.arc_length_mm):
            assert np.all(np.isfinite(method(TURN))), pair
        for method in ("common_normal", "published"):
            assert np.all(np.isfinite(pair.transmission_error(TURN, errors, method=method))), pair
        try:
            assert np.all(np.isfinite(pair.transmission_error(TURN, errors, method="exact"))), pair
            assert np.all(np.isfinite(pair.outline(points_per_tooth=12))), pair
        except gm.GeometryError:
            pass
    assert made > 0
