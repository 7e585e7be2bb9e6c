"""Gear pairs and errors as Python objects: shapes, scalars, exceptions, copies."""

import copy
import pickle

import numpy as np
import pytest

import gearmodel as gm

ANGLE_METHODS = ["theta2", "theta1", "ratio", "radius", "inclination", "arc_length_mm", "transmission_error", "backlash"]


@pytest.mark.parametrize("name", ANGLE_METHODS)
@pytest.mark.parametrize("shape", [(), (0,), (1,), (5,), (2, 3), (2, 0, 4), (2, 3, 4)])
def test_arrays_keep_their_shape(pair, errors, name, shape):
    method = getattr(pair.with_errors(errors), name)
    theta = np.linspace(-7, 7, int(np.prod(shape))).reshape(shape)
    values = method(theta)
    assert isinstance(values, np.ndarray) and values.shape == shape and values.dtype == np.float64
    for index in np.ndindex(shape):
        assert values[index] == method(float(theta[index]))


@pytest.mark.parametrize("scalar", [1, 1.0, np.float32(1), np.float64(1), np.int16(1), True])
def test_scalars_give_floats(pair, scalar):
    assert type(pair.theta2(scalar)) is float
    assert pair.theta2(scalar) == pair.theta2([1.0])[0]


def test_any_layout_is_taken(pair):
    theta = np.arange(24.0).reshape(4, 6)
    expected = pair.theta2(theta)
    for given in [np.asfortranarray(theta), theta.tolist(), theta.astype(int), theta.astype(np.float32), theta.astype(">f8")]:
        np.testing.assert_array_equal(pair.theta2(given), expected)
    np.testing.assert_array_equal(pair.theta2(theta[::-1, ::2]), expected[::-1, ::2])
    np.testing.assert_array_equal(pair.theta2(theta.T), expected.T)
    masked = pair.theta2(np.ma.masked_array(theta, theta > 5))
    np.testing.assert_array_equal(np.isnan(masked), theta > 5)


def test_long_arrays_over_all_cores_equal_short_ones(pair, errors):
    theta = np.linspace(0, 50, 100_003)
    for method in ("common_normal", "exact"):
        whole = pair.transmission_error(theta, errors, method=method)
        # Exact contact is carried between nodes that depend on which angles are asked for.
        apart = 1e-12 if method == "exact" else 0.0
        for part in (slice(None, 1000), slice(-1000, None)):
            alone = pair.transmission_error(theta[part], errors, method=method)
            np.testing.assert_allclose(whole[part], alone, rtol=0, atol=apart)


def test_a_gap_stays_a_gap(pair, errors):
    for method in ("common_normal", "exact", "published"):
        te = pair.transmission_error([0.0, np.nan, 1.0], errors, method=method)
        np.testing.assert_array_equal(np.isnan(te), [False, True, False])


@pytest.mark.parametrize("given", ["x", ["x"], 1j, [1j], None, [None], np.array("2020", "M8"), {}, object()])
def test_what_is_no_number_is_a_type_error(pair, given):
    with pytest.raises(TypeError, match="theta1"):
        pair.theta2(given)


def test_ragged_lists_are_named(pair):
    with pytest.raises(ValueError, match="theta1 is no array"):
        pair.theta2([[1], [2, 3]])


def test_kinematics(pair):
    theta1 = np.linspace(-20, 20, 4001)
    theta2 = pair.theta2(theta1)
    np.testing.assert_allclose(pair.theta1(theta2), theta1, atol=1e-12)
    np.testing.assert_allclose(np.gradient(theta2, theta1)[1:-1], pair.ratio(theta1)[1:-1], atol=2e-4)
    r1, r2 = pair.radius(theta1), pair.radius(theta1, gear=2)
    np.testing.assert_allclose(r1 + r2, pair.centre_distance_mm, rtol=1e-14)
    np.testing.assert_allclose(r1 / r2, pair.ratio(theta1), rtol=1e-13)
    np.testing.assert_allclose(np.tan(pair.inclination(theta1[1:-1])), (np.gradient(r1, theta1) / r1)[1:-1], atol=1e-4)
    np.testing.assert_allclose(pair.theta2(theta1 + 2 * np.pi), theta2 + 2 * np.pi, atol=1e-12)
    assert pair.perimeter_mm == pytest.approx(np.pi * 3 * 47, rel=1e-12)
    assert pair.arc_length_mm(2 * np.pi) == pytest.approx(pair.perimeter_mm, rel=1e-12)
    assert pair.centre_distance_mm == pytest.approx(144.999717319, abs=1e-8)
    assert pair.semi_major_mm == pytest.approx(72.499858659, abs=1e-8)
    assert pair.closure == pytest.approx(1.0, abs=1e-14)


def test_te_conventions(errors):
    pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287, backlash_mm=0.1)
    theta1 = np.linspace(0, 2 * np.pi, 200)
    for method in ("common_normal", "exact"):
        ccw, cw = (pair.transmission_error(theta1, errors, direction=d, method=method) for d in ("ccw", "cw"))
        np.testing.assert_allclose(pair.backlash(theta1, errors, method=method), cw - ccw, atol=1e-15)
        relative = pair.transmission_error(theta1, errors, method=method, relative_to_start=True)
        np.testing.assert_allclose(relative, ccw - ccw[0], atol=1e-15)
        assert pair.transmission_error(0.0, errors, method=method, relative_to_start=True) == 0.0
    published = pair.transmission_error(theta1, errors, method="published")
    also = pair.transmission_error(theta1, errors, method="published", relative_to_start=True)
    np.testing.assert_array_equal(published, also)


def test_own_errors_and_given_ones(pair, errors):
    documented = pair.with_errors(errors)
    assert pair.errors == gm.Errors() and documented.errors == errors
    assert documented.transmission_error(1.0) == pair.transmission_error(1.0, errors)
    assert documented.transmission_error(1.0, gm.Errors()) == 0.0


def test_load_winds_up_the_compliances(pair):
    soft = gm.Errors(shaft_compliance_output_rad_per_nm=1e-5)
    assert pair.transmission_error(0.3, soft, load_nm=10.0) == pytest.approx(-1e-4, rel=1e-12)
    assert pair.transmission_error(0.3, soft, load_nm=10.0, direction="cw") == pytest.approx(1e-4, rel=1e-12)
    assert pair.transmission_error(0.3, soft, load_nm=10.0, method="exact") == pytest.approx(-1e-4, rel=1e-9)
    assert pair.backlash(0.3, soft, load_nm=10.0) == pytest.approx(2e-4, rel=1e-12)
    with pytest.raises(ValueError, match="published.*know no load"):
        pair.transmission_error(0.0, load_nm=1.0, method="published")
    with pytest.raises(ValueError, match="load_nm is NaN"):
        pair.transmission_error(0.0, load_nm=float("nan"))


def test_constant_ratio_drive():
    drive = gm.GearPair.constant(ratio=81.0)
    assert drive.ratio() == 1 / 81
    assert drive.theta2(81.0) == pytest.approx(1.0, rel=1e-15)
    assert drive.kind == "constant" and drive.teeth == (0, 0)
    with pytest.raises(gm.GeometryError, match="no known teeth"):
        drive.transmission_error(0.0, method="exact")


def test_a_pair_that_does_not_close_names_the_distance_that_does():
    with pytest.raises(ValueError, match=r"0\.928484.*144\.9997") as raised:
        gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287, centre_distance_mm=150)
    assert raised.type is gm.GeometryError
    drawn = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287, centre_distance_mm=145)
    assert drawn.centre_distance_mm == pytest.approx(144.9997, abs=1e-4)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"module_mm": 0.0}, "module_mm"),
        ({"module_mm": float("nan")}, "module_mm"),
        ({"eccentricity": 1.0}, "eccentricity"),
        ({"eccentricity": -0.1}, "eccentricity"),
        ({"pressure_angle_deg": 0.35}, "pressure_angle_deg"),
        ({"teeth": 2}, "2 teeth"),
        ({"teeth": -47}, "-47 teeth"),
        ({"teeth": 46.5}, "46.5 teeth"),
        ({"teeth": 10**30}, "teeth"),
        ({"teeth": (47, 31)}, "needs 47 teeth"),
        ({"centre_distance_mm": 50.0}, "144.99"),
        ({"backlash_mm": -0.1}, "backlash_mm"),
        ({"addendum": float("inf")}, "addendum"),
    ],
)
def test_invalid_pairs_are_geometry_errors(change, text):
    arguments = {"module_mm": 3.0, "teeth": 47, "eccentricity": 0.3287} | change
    with pytest.raises(gm.GeometryError, match=text):
        gm.GearPair.elliptical(**arguments)


@pytest.mark.parametrize("teeth", ["47", (47,), (1, 2, 3), None, {}])
def test_teeth_of_a_wrong_type(teeth):
    with pytest.raises(TypeError, match="teeth"):
        gm.GearPair.circular(module_mm=3, teeth=teeth)


def test_unknown_words_are_named(pair):
    with pytest.raises(ValueError, match="direction.*left"):
        pair.transmission_error(0.0, direction="left")
    with pytest.raises(ValueError, match="method.*best"):
        pair.transmission_error(0.0, method="best")
    with pytest.raises(ValueError, match="gear 3"):
        pair.radius(0.0, gear=3)
    with pytest.raises(gm.GeometryError, match="e1_mm"):
        gm.Errors(e1_mm=-1.0)
    with pytest.raises(TypeError, match="e3_mm"):
        gm.Errors(e3_mm=1.0)


PAIRS = [
    gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287, centre_distance_mm=145, backlash_mm=1e-7),
    gm.GearPair.circular(module_mm=2.5, teeth=(20, 31), addendum=0.9).with_errors(gm.Errors(e1_mm=0.1, phi2_rad=-1 / 3)),
    gm.GearPair.constant(ratio=81.0),
]


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair.kind)
def test_copies_are_equal(pair, tmp_path):
    assert pickle.loads(pickle.dumps(pair)) == pair
    assert copy.deepcopy(pair) == pair
    assert gm.GearPair.from_toml(pair.to_toml()) == pair
    file = tmp_path / "pair.toml"
    pair.to_toml(file)
    assert gm.GearPair.from_toml(file) == gm.GearPair.from_toml(str(file)) == pair
    assert eval(repr(pair), vars(gm)) == pair
    assert pair != gm.GearPair.constant(ratio=2.0)


def test_errors_copy_and_change(errors):
    assert pickle.loads(pickle.dumps(errors)) == errors
    assert eval(repr(errors), vars(gm)) == errors
    assert gm.Errors(**errors.to_dict()) == errors
    assert errors.replace(e1_mm=0.1).to_dict() == errors.to_dict() | {"e1_mm": 0.1}
    with pytest.raises(AttributeError):
        errors.e1_mm = 1.0


def test_pair_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FileNotFoundError, match="missing.toml"):
        gm.GearPair.from_toml(tmp_path / "missing.toml")
    with pytest.raises(OSError):
        gm.GearPair.from_toml(tmp_path)
    with pytest.raises(gm.GeometryError, match="line 2.*excentricity"):
        gm.GearPair.from_toml('kind = "elliptical"\nexcentricity = 0.3\n')


def test_exceptions_travel_between_processes():
    error = pickle.loads(pickle.dumps(gm.GeometryError("centre distance")))
    assert type(error) is gm.GeometryError and isinstance(error, ValueError) and str(error) == "centre distance"


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda pair: pair.tolerance(sigma={"e1_mm": 0.1}, n=-1), "n"),
        (lambda pair: pair.tolerance(sigma={"e1_mm": 0.1}, n=10, seed=-1), "seed"),
        (lambda pair: pair.tolerance(sigma={"e1_mm": 0.1}, n=10, angles=-1), "angles"),
        (lambda pair: gm.sweep(pair, over={"e1_mm": [0.1]}, angles=-1), "angles"),
        (lambda pair: pair.flank(n=-1), "n"),
        (lambda pair: pair.outline(points_per_tooth=-1), "points_per_tooth"),
        (lambda pair: gm.analyse(gm.Recording([0], [0], [0], 0, 0, "ccw"), pair, bins=-1), "bins"),
        (lambda pair: gm.analyse(gm.Recording([0], [0], [0], 0, 0, "ccw"), pair, highest_order=-1), "highest_order"),
    ],
)
def test_negative_counts_are_named(pair, call, field):
    with pytest.raises(ValueError, match=rf"^{field} (is|=) -1"):
        call(pair)


def test_an_axis_of_a_sweep_is_named(pair):
    with pytest.raises(ValueError, match="e1_mm has 0 dimensions"):
        gm.sweep(pair, over={"e1_mm": 0.1})
    assert pair.tolerance(sigma={"e1_mm": 0.1}, n=10, seed=2**64 - 1)["te_ccw_pp_rad"].std_rad > 0
