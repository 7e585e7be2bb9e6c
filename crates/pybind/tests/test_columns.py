"""Recordings from CSV and Parquet tables."""

import sys

import numpy as np
import pytest

import gearmodel as gm

TIME = np.arange(50) / 10
HEADER = "time_s,theta1_rad,theta2_rad,load_nm,speed_rpm,direction"


def write(path, header=HEADER, rows=None, delimiter=","):
    rows = rows or [f"{t!r},{t!r},{t + 1!r},10.0,5,ccw" for t in TIME.tolist()]
    path.write_text("\n".join(["# from a bench", header, *rows]).replace(",", delimiter) + "\n")
    return path


@pytest.mark.parametrize("delimiter", [",", ";", "\t", ", "])
def test_csv(tmp_path, delimiter):
    rec = gm.Recording.from_csv(write(tmp_path / "a.csv", delimiter=delimiter), input_lines=100)
    np.testing.assert_array_equal(rec.theta2_rad, TIME + 1)
    assert (rec.load_nm, rec.speed_rpm, rec.direction, rec.input_lines) == (10.0, 5.0, "ccw", 100)


def test_what_the_caller_states_comes_first(tmp_path):
    path = write(tmp_path / "a.csv")
    rec = gm.Recording.from_csv(str(path), load_nm=3, speed_rpm=TIME, direction="auto")
    assert (rec.load_nm, rec.direction) == (3.0, "auto")
    np.testing.assert_array_equal(rec.speed_rpm, TIME)


def test_columns_in_any_order_with_gaps_and_others_between(tmp_path):
    rows = ["x,1.5,0,7", "y,,1,8", "z, ,2,9", "u,3,3,9"]
    path = write(tmp_path / "a.csv", "note,theta2_rad,time_s,theta1_rad", rows)
    rec = gm.Recording.from_csv(path, load_nm=1.0)
    np.testing.assert_array_equal(rec.theta2_rad, [1.5, np.nan, np.nan, 3])
    np.testing.assert_array_equal(rec.theta1_rad, [7, 8, 9, 9])
    assert (rec.direction, rec.speed_rpm) == ("auto", 0.0)


def test_conditions_that_change(tmp_path):
    rows = ["0,0,0,1,5,ccw", "1,1,1,2,5,ccw", "2,0,0,2,5,cw"]
    rec = gm.Recording.from_csv(write(tmp_path / "a.csv", rows=rows))
    np.testing.assert_array_equal(rec.load_nm, [1, 2, 2])
    assert rec.direction == "auto" and [part.direction for part in rec.split()] == ["ccw", "cw"]


@pytest.mark.parametrize(
    ("header", "rows", "text"),
    [
        ("time_s,theta1_rad", ["0,0"], r"a\.csv has no column theta2_rad.*found time_s, theta1_rad"),
        ("time_s,theta1_rad,theta2_rad", ["0,0,0"], "no column load_nm: give load_nm"),
        (HEADER, ["0,0,0,1,5,ccw", "1,zero,0,1,5,ccw"], "sample 1: theta1_rad is 'zero'"),
        (HEADER, ["0,0,0,1,5,up"], "direction is 'up'"),
        (HEADER, ["0,0,0,1,5,ccw", "0,0,0,1,5,ccw"], r"time_s\[1\]"),
    ],
)
def test_what_is_refused_is_named(tmp_path, header, rows, text):
    with pytest.raises(ValueError, match=text):
        gm.Recording.from_csv(write(tmp_path / "a.csv", header, rows))


def test_empty_and_missing_files(tmp_path):
    (tmp_path / "a.csv").write_text("# nothing\n")
    with pytest.raises(ValueError, match=r"a\.csv is empty"):
        gm.Recording.from_csv(tmp_path / "a.csv")
    with pytest.raises(FileNotFoundError):
        gm.Recording.from_csv(tmp_path / "b.csv")


def test_parquet(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    theta = [None, *TIME[1:].tolist()]
    table = {"time_s": TIME, "theta1_rad": theta, "theta2_rad": TIME, "load_nm": [2] * 50, "direction": ["ccw"] * 50}
    parquet.write_table(pyarrow.table(table), tmp_path / "a.parquet")
    rec = gm.Recording.from_parquet(tmp_path / "a.parquet")
    assert np.isnan(rec.theta1_rad[0]) and (rec.load_nm, rec.direction) == (2.0, "ccw")
    with pytest.raises(ValueError, match="no column theta1_rad"):
        parquet.write_table(pyarrow.table({"time_s": TIME}), tmp_path / "b.parquet")
        gm.Recording.from_parquet(tmp_path / "b.parquet")


def test_parquet_asks_for_its_package_by_name(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(ImportError, match=r"from_parquet\(\) needs pyarrow: pip install pyarrow"):
        gm.Recording.from_parquet(tmp_path / "a.parquet")
