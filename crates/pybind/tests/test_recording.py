"""Recordings: what is taken, what is refused and how it is named."""

import copy
import pickle

import numpy as np
import pytest

import gearmodel as gm

TIME = np.arange(0.0, 10.0, 0.01)


def record(**change):
    columns = {
        "time_s": TIME,
        "theta1_rad": TIME,
        "theta2_rad": TIME + 0.1,
        "load_nm": 10.0,
        "speed_rpm": 5.0,
        "direction": "ccw",
    }
    return gm.Recording(**(columns | change))


def with_value(values, index, value):
    changed = np.array(values)
    changed[index] = value
    return changed


def test_columns_come_back():
    rec = record(input_lines=18000)
    for name in ("time_s", "theta1_rad", "theta2_rad"):
        assert getattr(rec, name).dtype == np.float64 and getattr(rec, name).shape == TIME.shape
    np.testing.assert_array_equal(rec.theta2_rad, TIME + 0.1)
    assert (rec.load_nm, rec.speed_rpm, rec.direction) == (10.0, 5.0, "ccw")
    assert (rec.input_lines, rec.output_lines) == (18000, None)
    assert len(rec) == len(TIME) and rec.duration_s == pytest.approx(9.99)
    assert rec.revolutions == pytest.approx(9.99 / (2 * np.pi))


def test_positional_arguments_are_those_of_the_contract():
    rec = gm.Recording(TIME, TIME, TIME, 1, 2, "ccw")
    assert (rec.load_nm, rec.speed_rpm) == (1.0, 2.0)


def test_any_array_like_is_taken_and_the_callers_stays_writeable():
    own = TIME.copy()
    rec = record(theta1_rad=own)
    assert own.flags.writeable and not rec.theta1_rad.flags.writeable
    assert np.shares_memory(own, rec.theta1_rad)
    table = np.stack([TIME, TIME], axis=1)
    np.testing.assert_array_equal(record(theta1_rad=table[:, 0]).theta1_rad, TIME)
    np.testing.assert_array_equal(record(theta1_rad=list(range(1000))).theta1_rad, np.arange(1000.0))
    np.testing.assert_array_equal(record(load_nm=np.full(1000, 3)).load_nm, np.full(1000, 3.0))


def test_gaps_are_nan_or_masked():
    gap = with_value(TIME, 7, np.nan)
    assert np.isnan(record(theta1_rad=gap).theta1_rad[7])
    masked = np.ma.masked_array(TIME, TIME == TIME[7])
    assert np.isnan(record(theta2_rad=masked).theta2_rad[7])


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"time_s": with_value(TIME, 3, np.nan)}, r"time_s\[3\] is NaN"),
        ({"time_s": with_value(TIME, 3, np.inf)}, r"time_s\[3\] is inf"),
        ({"time_s": with_value(TIME, 3, TIME[2])}, r"time_s\[3\] = 0\.02 s does not follow time_s\[2\]"),
        ({"time_s": TIME[::-1]}, r"time_s\[1\]"),
        ({"theta1_rad": with_value(TIME, 999, -np.inf)}, r"theta1_rad\[999\] is -inf"),
        ({"theta1_rad": TIME[:-1]}, "theta1_rad has 999 values, time_s has 1000"),
        ({"theta2_rad": np.tile(TIME, 2)}, "theta2_rad has 2000 values"),
        ({"load_nm": np.zeros(3)}, "load_nm has 3 values"),
        ({"load_nm": np.nan}, "load_nm is NaN"),
        ({"speed_rpm": with_value(TIME, 5, np.nan)}, r"speed_rpm\[5\] is NaN"),
        ({"theta1_rad": TIME.reshape(10, 100)}, "theta1_rad has 2 dimensions"),
        ({"time_s": 1.0}, "time_s has 0 dimensions"),
        ({"time_s": [], "theta1_rad": [], "theta2_rad": []}, "time_s is empty.*at least 1"),
        ({"theta1_rad": np.full(1000, np.nan)}, "theta1_rad holds no number"),
        ({"direction": "left"}, 'direction is "left"'),
        ({"direction": "cw"}, 'theta1_rad moves by 9.99.*"cw"'),
        ({"theta2_rad": -TIME}, 'theta2_rad moves by -9.99.*"ccw"'),
        ({"input_lines": 0}, "input_lines is 0"),
    ],
)
def test_what_is_refused_is_named(change, text):
    with pytest.raises(ValueError, match=text):
        record(**change)


@pytest.mark.parametrize("field", ["time_s", "theta1_rad", "theta2_rad", "load_nm", "speed_rpm"])
def test_columns_of_a_wrong_type_are_named(field):
    with pytest.raises(TypeError, match=field):
        record(**{field: ["a"] * 1000})


@pytest.mark.parametrize("change", [{}, {"load_nm": TIME, "direction": "auto", "output_lines": 5}])
def test_copies_are_equal(change):
    rec = record(**change)
    for twin in (pickle.loads(pickle.dumps(rec)), copy.deepcopy(rec)):
        assert repr(twin) == repr(rec) and twin.output_lines == rec.output_lines
        np.testing.assert_array_equal(twin.theta1_rad, rec.theta1_rad)
        np.testing.assert_array_equal(twin.load_nm, rec.load_nm)


def test_a_recording_that_reverses_is_split_where_it_does():
    rng = np.random.default_rng(1)
    theta = 2.0 * np.sin(TIME) + 1e-4 * rng.standard_normal(TIME.size)
    rec = record(theta1_rad=theta, theta2_rad=theta, direction="auto", load_nm=TIME, input_lines=9)
    parts = rec.split()
    assert [part.direction for part in parts] == ["ccw", "cw", "ccw", "cw"]
    turns = [part.time_s[0] for part in parts[1:]]
    np.testing.assert_allclose(turns, [np.pi / 2, 3 * np.pi / 2, 5 * np.pi / 2], atol=0.03)
    assert sum(len(part) for part in parts) == len(rec)
    np.testing.assert_array_equal(np.concatenate([part.load_nm for part in parts]), TIME)
    assert all(part.input_lines == 9 for part in parts)
    assert np.shares_memory(parts[1].theta1_rad, rec.theta1_rad)


def test_one_sense_is_not_split():
    assert [part.direction for part in record(direction="auto").split()] == ["ccw"]
    down = record(theta1_rad=-TIME, theta2_rad=-TIME, direction="auto")
    assert [part.direction for part in down.split()] == ["cw"]
    stated = record()
    assert stated.split() == [stated]
    assert record(theta1_rad=0 * TIME, theta2_rad=0 * TIME, direction="auto").split() == []
