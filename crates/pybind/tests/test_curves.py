"""Free pitch curves, flanks, outlines and phases."""

import pickle

import numpy as np
import pytest

import gearmodel as gm

ANGLE = np.linspace(0, 2 * np.pi, 360, endpoint=False)


def free_pairs():
    return [
        gm.GearPair.lobed(module_mm=2, teeth=(40, 60), eccentricity=0.1, lobes=(2, 3)),
        gm.GearPair.fourier(module_mm=2, teeth=40, cosines=[0.1, 0.02], sines=(0.0, 0.01)),
        gm.GearPair.sampled(module_mm=3, teeth=47, theta1_rad=ANGLE, radius=2 + 0.2 * np.cos(ANGLE)),
        gm.GearPair.transmission(module_mm=2, teeth=40, sines=np.array([0.2]), backlash_mm=0.05),
    ]


@pytest.mark.parametrize("pair", free_pairs(), ids=lambda pair: pair.kind)
def test_free_curves_close_and_copy(pair, errors):
    turn = 2 * np.pi
    assert pair.theta2(turn * 2) - pair.theta2(turn) == pytest.approx(turn * pair.closure, abs=1e-9)
    assert pair.closure == pytest.approx(pair.teeth[0] / pair.teeth[1], abs=1e-9)
    assert pair.perimeter_mm == pytest.approx(np.pi * pair.module_mm * pair.teeth[0], rel=1e-9)
    r1, r2 = pair.radius(ANGLE), pair.radius(ANGLE, gear=2)
    np.testing.assert_allclose(r1 + r2, pair.centre_distance_mm, rtol=1e-12)
    assert pickle.loads(pickle.dumps(pair)) == pair
    assert eval(repr(pair), vars(gm)) == pair
    exact, first = (pair.transmission_error(ANGLE, errors, method=method) for method in ("exact", "common_normal"))
    np.testing.assert_allclose(first, exact, atol=5e-3 * np.ptp(exact))


def test_a_sampled_ellipse_is_the_ellipse(pair):
    radius = 1 / (1 - 0.3287 * np.cos(ANGLE))
    sampled = gm.GearPair.sampled(module_mm=3, teeth=47, theta1_rad=ANGLE, radius=radius)
    np.testing.assert_allclose(sampled.theta2(ANGLE), pair.theta2(ANGLE), atol=1e-7)
    assert sampled.centre_distance_mm == pytest.approx(pair.centre_distance_mm, abs=1e-5)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: gm.GearPair.fourier(module_mm=2, teeth=40, cosines=[1.0, 0.9]), "positive"),
        (lambda: gm.GearPair.fourier(module_mm=2, teeth=(40, 60), cosines=[0.1]), "harmonic 1"),
        (lambda: gm.GearPair.sampled(module_mm=2, teeth=40, theta1_rad=[0, 1], radius=[1, 1]), "theta1_rad"),
        (lambda: gm.GearPair.sampled(module_mm=2, teeth=40, theta1_rad=[0, 1, 3, 2], radius=[1, 1, 1, 1]), "3"),
        (lambda: gm.GearPair.lobed(module_mm=2, teeth=40, eccentricity=0.1, lobes=(2, 3)), "needs 60 teeth"),
    ],
)
def test_curves_that_cannot_run(make, text):
    with pytest.raises(gm.GeometryError, match=text):
        make()


def test_curves_are_lists():
    with pytest.raises(ValueError, match="cosines has 2 dimensions"):
        gm.GearPair.fourier(module_mm=2, teeth=40, cosines=[[0.1]])
    with pytest.raises(TypeError, match="radius"):
        gm.GearPair.sampled(module_mm=2, teeth=40, theta1_rad=[0, 1, 2, 3], radius="abcd")


def test_flanks_lie_on_outlines(pair):
    outline = pair.outline(gear=1, points_per_tooth=400)
    flank = pair.flank(gear=1, tooth=3, side="ccw", n=9)
    assert flank.shape == (9, 2) and flank.dtype == np.float64
    nearest = [np.min(np.hypot(*(np.asarray(outline) - point).T)) for point in flank]
    assert max(nearest) < 0.05  # half the distance of its points
    reach = np.hypot(*flank.T)
    assert np.all(np.diff(reach) > 0)


def test_outline(pair, tmp_path):
    outline = pair.outline(gear=2, points_per_tooth=30)
    assert isinstance(outline, np.ndarray) and outline.shape == (47 * 30 + 1, 2)
    np.testing.assert_array_equal(outline[0], outline[-1])
    pitch_area = np.pi * pair.semi_major_mm**2 * np.sqrt(1 - 0.3287**2)
    assert outline.area_mm2 == pytest.approx(pitch_area, rel=0.02)
    for suffix, mark in (("dxf", "VERTEX"), ("svg", " L")):
        ours, direct = tmp_path / f"a.{suffix}", tmp_path / f"b.{suffix}"
        getattr(outline, f"to_{suffix}")(ours)
        getattr(pair, f"to_{suffix}")(str(direct), gear=2, points_per_tooth=30)
        assert ours.read_text() == direct.read_text()
        assert ours.read_text().count(mark) >= 47 * 30 - 1
    with pytest.raises(FileNotFoundError):
        pair.to_dxf(tmp_path / "none" / "a.dxf")
    assert type(outline + 0.0) is gm.Outline and pickle.loads(pickle.dumps(outline)).shape == outline.shape


def test_teeth_that_cannot_be_cut():
    pair = gm.GearPair.elliptical(module_mm=3, teeth=17, eccentricity=0.7)
    for refused in (pair.check_teeth, pair.outline, pair.flank):
        with pytest.raises(gm.GeometryError, match="theta1 = "):
            refused()
    with pytest.raises(gm.GeometryError, match="47"):
        gm.GearPair.circular(module_mm=3, teeth=47).flank(tooth=47)
    with pytest.raises(ValueError, match="tooth -1"):
        gm.GearPair.circular(module_mm=3, teeth=47).flank(tooth=-1)
    with pytest.raises(gm.GeometryError, match="teeth"):
        gm.GearPair.constant(ratio=3).outline()


def test_contact_ratio_of_standard_gears():
    # Involute theory: (sqrt(ra1^2 - rb1^2) + sqrt(ra2^2 - rb2^2) - a sin alpha)/(pi m cos alpha)
    alpha = np.radians(20)
    r, base = 3 * 40 / 2, 3 * 40 / 2 * np.cos(alpha)
    expected = (2 * np.sqrt((r + 3) ** 2 - base**2) - 2 * r * np.sin(alpha)) / (np.pi * 3 * np.cos(alpha))
    for direction in ("ccw", "cw"):
        np.testing.assert_allclose(gm.GearPair.circular(module_mm=3, teeth=40).contact_ratio(direction), expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("k", "even", "odd", "best"), [(0.2, 0.1150, 0.0429, 0.0124), (0.3287, 0.1221, 0.0506, 0.0222), (0.6, 0.1607, 0.0916, 0.0596)]
)
def test_phases_against_the_printed_prescription(k, even, odd, best):
    pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=k)
    phases = pair.optimal_phases(gm.Errors(e1_mm=0.05, e2_mm=0.05))
    found = np.degrees([phases.value_rad, *(value.value_rad for value in phases.published)])
    np.testing.assert_allclose(found, [best, even, odd], atol=6e-5)
    errors = gm.Errors(e1_mm=0.05, e2_mm=0.05, phi1_rad=phases.phi1_rad, phi2_rad=phases.phi2_rad)
    assert np.ptp(pair.backlash(np.linspace(0, 2 * np.pi, 721), errors)) == pytest.approx(phases.value_rad, rel=1e-4)


def test_less_freedom_is_never_better(pair, errors):
    for objective in ("backlash", "te_ccw", "te_cw", "te_both"):
        values = [
            pair.optimal_phases(errors, objective, *freedom).value_rad
            for freedom in (("hub", "hub"), ("fixed", "hub"), ("fixed", 47), ("fixed", "fixed"))
        ]
        assert values == sorted(values)
    for wrong in ({"objective": "noise"}, {"driver": "free"}, {"driven": 0}, {"driven": 1.5}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            pair.optimal_phases(errors, **wrong)
