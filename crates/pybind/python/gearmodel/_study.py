"""Tables that sweeps and tolerance studies give."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._extras import require

_Array = NDArray[np.float64]


class SweepTable:
    """A figure over a grid of parameters. Made by ``sweep``.

    Attributes:
        of: the figure's name; its values are in rad.
        axes: name of each parameter to its values, shape (m,), in the unit of the name.
        values: the figure, rad, an axis a parameter in the order of ``axes``; NaN where no pair exists.
        faults: (index in values, reason) of the cells without a value.
    """

    of: str
    axes: dict[str, _Array]
    values: _Array
    faults: list[tuple[tuple[int, ...], str]]

    def __init__(self, of: str, axes: Mapping[str, _Array], values: _Array, faults: Sequence[tuple[int, str]]) -> None:
        self.of = of
        self.axes = dict(axes)
        self.values = values
        self.faults = [(tuple(int(i) for i in np.unravel_index(cell, values.shape)), text) for cell, text in faults]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.values, dtype=dtype) if copy else np.asarray(self.values, dtype=dtype)

    def __repr__(self) -> str:
        axes = ", ".join(f"{name}[{len(values)}]" for name, values in self.axes.items())
        return f"SweepTable({self.of} over {axes}; {len(self.faults)} faults)"

    def records(self) -> np.recarray[Any, Any]:
        """A row a cell: the parameters and the figure, as a record array."""
        grids = np.meshgrid(*self.axes.values(), indexing="ij")
        columns = [*(grid.ravel() for grid in grids), self.values.ravel()]
        dtype = np.dtype([(name, np.float64) for name in (*self.axes, f"{self.of}_rad")])
        records: np.recarray[Any, Any] = np.rec.fromarrays(columns, dtype=dtype)
        return records

    def to_pandas(self) -> Any:
        """A row a cell, as a pandas DataFrame."""
        pandas = require("pandas", extra="tables", purpose="SweepTable.to_pandas()")
        return pandas.DataFrame.from_records(self.records())

    def to_xarray(self) -> Any:
        """An xarray DataArray with labelled axes."""
        xarray = require("xarray", extra="tables", purpose="SweepTable.to_xarray()")
        attrs = {"units": "rad"}
        return xarray.DataArray(self.values, coords=self.axes, dims=list(self.axes), name=self.of, attrs=attrs)

    def plot(self) -> Any:
        """The figure over the first parameter, a line for each value of the others; a matplotlib Figure."""
        from . import _plot

        return _plot.sweep(self)


class ToleranceFigure:
    """A figure of each pair of a tolerance study.

    Attributes:
        name: with its unit.
        values_rad: one value a pair, in the order of the draws, shape (n,).
        mean_rad, std_rad: over the pairs.
        shares: first-order share of each parameter in the variance, 0 to 1; what is missing to 1 is interaction.
    """

    name: str
    values_rad: _Array
    mean_rad: float
    std_rad: float
    shares: dict[str, float]

    def __init__(self, name: str, values_rad: _Array, mean_rad: float, std_rad: float, shares: dict[str, float]) -> None:
        self.name = name
        self.values_rad = values_rad
        self.mean_rad = mean_rad
        self.std_rad = std_rad
        self.shares = shares

    def quantile_rad(self, probability: ArrayLike) -> Any:
        """The value below which a share of the pairs stays, rad: a float, or an array in the shape of the probabilities."""
        found = np.quantile(self.values_rad, np.asarray(probability, dtype=np.float64))
        return float(found) if np.ndim(probability) == 0 else found

    def __repr__(self) -> str:
        median, most = 1e6 * self.quantile_rad([0.5, 0.95])
        return f"ToleranceFigure({self.name}: median {median:.2f} urad, 95 % below {most:.2f} urad)"


class Tolerance:
    """Figures of drawn pairs by name. Made by ``GearPair.tolerance``."""

    figures: dict[str, ToleranceFigure]

    def __init__(self, tables: Sequence[tuple[str, _Array, float, float, dict[str, float]]]) -> None:
        self.figures = {table[0]: ToleranceFigure(*table) for table in tables}

    def __getitem__(self, name: str) -> ToleranceFigure:
        try:
            return self.figures[name]
        except KeyError:
            raise KeyError(f"{name}: the figures are {', '.join(self.figures)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self.figures)

    def __len__(self) -> int:
        return len(self.figures)

    def quantile_rad(self, name: str, probability: ArrayLike) -> Any:
        """Quantile of a figure, rad."""
        return self[name].quantile_rad(probability)

    def to_pandas(self, probabilities: Sequence[float] = (0.05, 0.5, 0.95, 0.99)) -> Any:
        """A row a figure with mean, standard deviation and quantiles, rad, as a pandas DataFrame."""
        pandas = require("pandas", extra="tables", purpose="Tolerance.to_pandas()")
        rows = {
            name: {"mean": figure.mean_rad, "std": figure.std_rad}
            | {f"q{100 * p:g}": figure.quantile_rad(p) for p in probabilities}
            for name, figure in self.figures.items()
        }
        return pandas.DataFrame.from_dict(rows, orient="index")

    def __repr__(self) -> str:
        pairs = len(next(iter(self.figures.values())).values_rad)
        return f"Tolerance({pairs} pairs)\n  " + "\n  ".join(repr(figure) for figure in self.figures.values())
