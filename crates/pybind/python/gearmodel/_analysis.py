"""What an analysis says beyond curves: the floor with its interval, order spectra, long and short waves, averages."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._extras import require

_Array = NDArray[np.float64]


class Floor(float):
    """Repeatability of a mean curve, rad RMS: a float, with the interval that holds the true one.

    The scatter between the revolutions at a bin, each less its own mean, over the square root of their number. Everything
    is NaN with less than two revolutions.

    Attributes:
        low_rad, high_rad: ends of the two-sided interval, rad RMS.
        confidence: of the interval, 0 to 1.
        degrees_of_freedom: independent witnesses behind it (Satterthwaite, from the measured covariance of the bins).
        revolutions: whole revolutions.
    """

    low_rad: float
    high_rad: float
    confidence: float
    degrees_of_freedom: float
    revolutions: int

    def __new__(
        cls, rms_rad: float, low_rad: float, high_rad: float, confidence: float, degrees_of_freedom: float, revolutions: int
    ) -> Floor:
        self = super().__new__(cls, rms_rad)
        self.low_rad = low_rad
        self.high_rad = high_rad
        self.confidence = confidence
        self.degrees_of_freedom = degrees_of_freedom
        self.revolutions = revolutions
        return self

    def __getnewargs__(self) -> tuple[Any, ...]:  # type: ignore[override]
        return (float(self), self.low_rad, self.high_rad, self.confidence, self.degrees_of_freedom, self.revolutions)

    def __repr__(self) -> str:
        interval = f"{100 * self.confidence:g} % in [{self.low_rad:.3g}, {self.high_rad:.3g}]"
        return f"Floor({float(self):.3g} rad rms, {interval})"


class OrderSpectrum:
    """Orders of a mean curve over an axis: amplitude cos(order xi - phase), xi the angle of the shaft, or 2 pi a tooth.

    ``spectrum[i]`` are rows of :meth:`records`.

    Attributes:
        axis: "input" (order 1 is once a turn of the driver), "output" (of the driven shaft) or "mesh" (once a tooth).
        orders: shape (n,); whole numbers over the input shaft.
        amplitude_rad: peak amplitudes, rad, shape (n,).
        phase_rad: rad, in [-pi, pi], shape (n,).
        mean_rad: mean over the axis, rad; NaN where the curve has gaps.
        rms_rad: root of the mean square over the axis, rad, mean included (mean^2 + sum amplitude^2/2 with all orders).
    """

    axis: Literal["input", "output", "mesh"]
    orders: _Array
    amplitude_rad: _Array
    phase_rad: _Array
    mean_rad: float
    rms_rad: float

    def __init__(
        self,
        axis: Literal["input", "output", "mesh"],
        orders: _Array,
        amplitude_rad: _Array,
        phase_rad: _Array,
        mean_rad: float,
        rms_rad: float,
    ) -> None:
        self.axis = axis
        self.orders = orders
        self.amplitude_rad = amplitude_rad
        self.phase_rad = phase_rad
        self.mean_rad = mean_rad
        self.rms_rad = rms_rad

    @property
    def order(self) -> _Array:
        """``orders``, by the name of the records' field."""
        return self.orders

    def __len__(self) -> int:
        return len(self.orders)

    def __getitem__(self, index: Any) -> Any:
        return self.records()[index]

    def records(self) -> np.recarray[Any, Any]:
        """A row an order: record array with the fields order, amplitude_rad and phase_rad."""
        names = ["order", "amplitude_rad", "phase_rad"]
        dtype = np.dtype([(name, np.float64) for name in names])
        records: np.recarray[Any, Any] = np.rec.fromarrays([self.orders, self.amplitude_rad, self.phase_rad], dtype=dtype)
        return records

    def strongest(self, n: int = 5) -> np.recarray[Any, Any]:
        """The records of the n largest amplitudes, largest first."""
        largest = np.argsort(-self.amplitude_rad, kind="stable")[: max(n, 0)]
        return self.records()[largest].view(np.recarray)

    def to_pandas(self) -> Any:
        """A row an order, as a pandas DataFrame."""
        pandas = require("pandas", extra="tables", purpose="OrderSpectrum.to_pandas()")
        return pandas.DataFrame.from_records(self.records())

    def __repr__(self) -> str:
        if len(self) == 0:
            return f"OrderSpectrum({self.axis}, no orders)"
        lines = ", ".join(f"{line.order:.4g}: {1e6 * line.amplitude_rad:.2f}" for line in self.strongest(3))
        return f"OrderSpectrum({self.axis}, {len(self)} orders to {self.orders[-1]:.4g}; strongest in urad {lines})"


class Spectra(OrderSpectrum):
    """Order spectra of a mean curve over both shafts and the mesh; by itself it is that of the input shaft.

    Attributes:
        input: over the driver's angle.
    """

    input: OrderSpectrum

    def __init__(self, found: dict[str, tuple[Any, ...] | str]) -> None:
        self._found: dict[str, OrderSpectrum | str] = {
            axis: reason if isinstance(reason, str) else OrderSpectrum(axis, *reason)  # type: ignore[arg-type]
            for axis, reason in found.items()
        }
        self.input = self._of("input")
        own = self.input
        super().__init__("input", own.orders, own.amplitude_rad, own.phase_rad, own.mean_rad, own.rms_rad)

    def _of(self, axis: str) -> OrderSpectrum:
        found = self._found[axis]
        if isinstance(found, str):
            raise ValueError(f"there is no {axis} spectrum: {found}")
        return found

    @property
    def output(self) -> OrderSpectrum:
        """Over the driven shaft's angle. ValueError where the curve has gaps."""
        return self._of("output")

    @property
    def mesh(self) -> OrderSpectrum:
        """Over the tooth phase, order 1 once a tooth. ValueError where the curve has gaps, and for a pair without teeth."""
        return self._of("mesh")

    def __iter__(self) -> Any:
        return iter(self.records())

    def __repr__(self) -> str:
        return "Spectra(\n  " + "\n  ".join(f"{axis}: {it}" for axis, it in self._found.items()) + ")"


class Waves(NamedTuple):
    """One part of a curve that a filter parted. F'is- and f'is-like figures; no conformance is claimed."""

    curve: _Array
    """rad at the centres of the bins of theta1, shape (bins,)."""
    f_i_total: float
    """Peak-to-peak over the turn, rad."""
    f_i_tooth: float
    """Largest peak-to-peak within one pitch of arc length, rad; NaN without teeth."""
    fluctuation_rms_rad: float
    """RMS about the part's mean, rad."""


class WaveSplit:
    """Long and short waves of a mean curve, parted by a Gaussian filter in orders; long + short is the curve.

    Attributes:
        axis: over which orders are counted.
        cut_off_order: the order at which half the amplitude passes to the long waves.
        long, short: the parts, :class:`Waves`; the long waves hold the mean.
    """

    axis: Literal["input", "output", "mesh"]
    cut_off_order: float
    long: Waves
    short: Waves

    def __init__(
        self,
        axis: Literal["input", "output", "mesh"],
        cut_off_order: float,
        long: tuple[Any, ...],
        short: tuple[Any, ...],
    ) -> None:
        self.axis = axis
        self.cut_off_order = cut_off_order
        self.long = Waves(*long)
        self.short = Waves(*short)

    def transmission(self, order: Any) -> Any:
        """Share of an amplitude at an order that passes to the long waves, exp(-ln 2 (order/cut-off)^2) (ISO 16610-21).

        A float, or an array in the shape of the orders.
        """
        share = np.exp(-np.log(2.0) * np.square(np.asarray(order, dtype=np.float64) / self.cut_off_order))
        return float(share) if np.ndim(order) == 0 else share

    def __repr__(self) -> str:
        parts = [f"{name} {1e6 * part.f_i_total:.2f}" for name, part in (("long", self.long), ("short", self.short))]
        return f"WaveSplit({self.axis} order {self.cut_off_order:g}; peak-to-peak in urad {', '.join(parts)})"


class SynchronousAverage(NamedTuple):
    """Mean TE over the angle of one shaft: what turns with the shaft stays, the rest averages out."""

    theta: _Array
    """Centres of the bins of the shaft's angle, rad, in [0, 2 pi), shape (bins,)."""
    te: _Array
    """Mean of its whole revolutions, rad, shape (bins,); NaN where no sample fell."""
    revolutions: int
    """Whole revolutions of the shaft; 0 for a recording of less than one, which gives what there is."""
    shaft: Literal["input", "output"]
    """The shaft."""
