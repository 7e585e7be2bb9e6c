"""Recordings from tables: CSV with numpy, Parquet with pyarrow.

The columns have the names of the arguments of ``Recording``: time_s, theta1_rad, theta2_rad, and where they are there
load_nm, speed_rpm, direction. Others are not looked at.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._extras import require

if TYPE_CHECKING:
    from . import Recording

ANGLES = ("time_s", "theta1_rad", "theta2_rad")
CONDITIONS = ("load_nm", "speed_rpm")
_Path = str | os.PathLike[str]


def from_csv(path: _Path, **given: Any) -> Recording:
    """A recording from a CSV table whose first line, comments aside, names its columns."""
    with open(path, encoding="utf-8-sig") as file:
        skipped = 0
        for line in file:
            skipped += 1
            if line.strip() and not line.startswith("#"):
                break
        else:
            raise ValueError(f"{os.fspath(path)} is empty: a table needs a line of column names and a line a sample")
    delimiter = next((mark for mark in ",;\t" if mark in line), ",")
    names = [name.strip().strip('"') for name in line.split(delimiter)]

    def numbers(columns: list[str]) -> dict[str, NDArray[np.float64]]:
        usecols = [names.index(name) for name in columns]
        shape: dict[str, Any] = {"delimiter": delimiter, "comments": "#", "usecols": usecols, "encoding": "utf-8-sig"}
        try:
            table = np.loadtxt(path, skiprows=skipped, ndmin=2, **shape)
        except ValueError:
            # An empty field is a gap, which only the slower reader understands.
            table = _with_gaps(path, skipped, columns, shape)
        return dict(zip(columns, table.T, strict=True))

    def texts(column: str) -> NDArray[np.str_]:
        usecols = names.index(column)
        return np.loadtxt(path, dtype=str, skiprows=skipped, ndmin=1, delimiter=delimiter, comments="#", usecols=usecols)

    return _recording(path, names, numbers, texts, given)


def _with_gaps(path: _Path, skipped: int, columns: list[str], shape: dict[str, Any]) -> NDArray[np.float64]:
    table = np.genfromtxt(path, skip_header=skipped, dtype=str, **shape).reshape(-1, len(columns))
    table = np.char.strip(table)
    table[table == ""] = "nan"
    try:
        return table.astype(np.float64)
    except ValueError:
        for row, fields in enumerate(table):
            for name, field in zip(columns, fields, strict=True):
                try:
                    float(field)
                except ValueError:
                    text = f"{os.fspath(path)}, sample {row}: {name} is {str(field)!r}: a number is needed, or nothing for a gap"
                    raise ValueError(text) from None
        raise


def from_parquet(path: _Path, **given: Any) -> Recording:
    """A recording from the columns of a Parquet file; null is a gap."""
    parquet = require("pyarrow.parquet", extra="tables", purpose="Recording.from_parquet()")
    names = parquet.read_schema(path).names

    def numbers(columns: list[str]) -> dict[str, NDArray[np.float64]]:
        table = parquet.read_table(path, columns=columns)
        return {name: table.column(name).to_numpy() for name in columns}

    def texts(column: str) -> NDArray[np.str_]:
        return np.asarray(parquet.read_table(path, columns=[column]).column(column).to_pylist(), dtype=str)

    return _recording(path, names, numbers, texts, given)


def _recording(
    path: _Path,
    names: Collection[str],
    numbers: Callable[[list[str]], dict[str, NDArray[np.float64]]],
    texts: Callable[[str], NDArray[np.str_]],
    given: dict[str, Any],
) -> Recording:
    from . import Recording

    missing = [name for name in ANGLES if name not in names]
    if missing:
        raise ValueError(
            f"{os.fspath(path)} has no column {', '.join(missing)}: columns time_s, theta1_rad, theta2_rad are needed; "
            f"found {', '.join(names)}"
        )
    wanted = [*ANGLES, *(name for name in CONDITIONS if name in names and given[name] is None)]
    columns = numbers(wanted)
    direction = given["direction"]
    if direction is None:
        direction = _direction(path, texts("direction")) if "direction" in names else "auto"
    return Recording(
        columns["time_s"],
        columns["theta1_rad"],
        columns["theta2_rad"],
        load_nm=_condition(path, "load_nm", given["load_nm"], columns),
        speed_rpm=_condition(path, "speed_rpm", given["speed_rpm"], columns),
        direction=direction,
        input_lines=given["input_lines"],
        output_lines=given["output_lines"],
    )


def _condition(path: _Path, name: str, given: Any, columns: dict[str, NDArray[np.float64]]) -> ArrayLike:
    if given is not None:
        return given  # type: ignore[no-any-return]
    if name not in columns:
        if name == "speed_rpm":
            return 0.0  # not known: taken from the motion
        raise ValueError(f"{os.fspath(path)} has no column {name}: give {name}=...")
    values = columns[name]
    # A set-point that does not change is one number: recordings of equal set-points are compared.
    return float(values[0]) if len(values) and np.all(values == values[0]) else values


def _direction(path: _Path, values: NDArray[np.str_]) -> Literal["ccw", "cw", "auto"]:
    found = sorted({str(value).strip() for value in np.unique(values)})
    unknown = [value for value in found if value not in ("ccw", "cw", "auto")]
    if unknown:
        raise ValueError(f"{os.fspath(path)}: direction is {unknown[0]!r}: ccw, cw or auto is needed")
    if found == ["ccw"]:
        return "ccw"
    # Both senses in one table: the motion shows where they change.
    return "cw" if found == ["cw"] else "auto"
