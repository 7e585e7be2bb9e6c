"""Figures of measured and predicted curves, with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._extras import require

if TYPE_CHECKING:
    from . import Analysis, MeasuredBacklash, SweepTable

URAD = 1e6
DEGREES = "driver angle θ1 / °"


def _figure(rows: int) -> tuple[Any, Any]:
    # Figure, not pyplot: no window system is started and nothing global changes.
    figure_module = require("matplotlib.figure", extra="plot", purpose="plot()")
    figure = figure_module.Figure(figsize=(8.0, 3.2 * rows), layout="constrained")
    return figure, figure.subplots(rows, 1)


def _over_turn(axes: Any, ylabel: str) -> None:
    axes.set(xlabel=DEGREES, ylabel=ylabel, xlim=(0, 360), xticks=range(0, 361, 45))
    axes.grid(alpha=0.3)


def analysis(a: Analysis) -> Any:
    """TE over theta1, revolution by revolution, mean and prediction; below, the orders."""
    figure, (curve, orders) = _figure(2)
    degrees = np.degrees(a.theta1)
    for revolution in a.te:
        curve.plot(degrees, URAD * revolution, color="0.8", linewidth=0.8)
    curve.plot(degrees, URAD * a.mean_curve, label="measured, mean")
    curve.plot(degrees, URAD * (a.predicted + a.zero_rad), "--", label="predicted, zero moved")
    _over_turn(curve, "TE / µrad")
    curve.set_title(f"{a.direction}, {a.load_nm:g} N·m, {a.speed_rpm:g} rpm")
    curve.legend()
    orders.stem(a.spectrum.orders, URAD * a.spectrum.amplitude_rad, markerfmt=" ", basefmt=" ")
    orders.axhline(URAD * a.floor, color="0.5", linestyle=":", label="floor, rms")
    orders.set(xlabel="periods a turn of the driver", ylabel="amplitude / µrad", yscale="log")
    orders.legend()
    return figure


def backlash(b: MeasuredBacklash) -> Any:
    """Backlash over theta1 with its interval, and the prediction."""
    figure, axes = _figure(1)
    degrees = np.degrees(b.theta1)
    axes.fill_between(degrees, URAD * b.low, URAD * b.high, color="0.85", label="90 % interval")
    axes.plot(degrees, URAD * b.backlash, label="measured")
    axes.plot(degrees, URAD * b.predicted, "--", label="predicted")
    _over_turn(axes, "backlash / µrad")
    axes.legend()
    return figure


def sweep(table: SweepTable) -> Any:
    """A figure over the first parameter, a line for each combination of the others."""
    figure, axes = _figure(1)
    (name, first), *others = table.axes.items()
    lines = table.values.reshape(len(first), -1)
    grids = [grid.ravel() for grid in np.meshgrid(*(values for _, values in others), indexing="ij")]
    for n in range(lines.shape[1]):
        at = [f"{other} = {grid[n]:g}" for (other, _), grid in zip(others, grids, strict=True)]
        axes.plot(first, URAD * lines[:, n], label=", ".join(at))
    axes.set(xlabel=name, ylabel=f"{table.of} / µrad")
    axes.grid(alpha=0.3)
    if others and lines.shape[1] <= 12:
        axes.legend()
    return figure
