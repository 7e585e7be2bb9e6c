"""Figures of measured and predicted curves, with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._extras import require

if TYPE_CHECKING:
    from . import Analysis, Diagnosis, MeasuredBacklash, SweepTable

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


# Shared with the HTML report: orange is the gap, blue what is left, grey the floor; told apart by colour-blind eyes too.
BEFORE, AFTER, FLOOR = "#d9730d", "#1f6fb8", "#8a939c"
MOST_RUNS = 12


def _statement(item: str | dict[str, Any]) -> str:
    return item if isinstance(item, str) else " or ".join(item["members"])


def _gap_bars(axes: Any, gap: dict[str, Any]) -> None:
    names = ["nominal model", "with the causes found", "not repeatable"]
    values = [URAD * gap[key] for key in ("before_rad", "after_rad", "floor_rad")]
    bars = axes.barh(names, values, color=[BEFORE, AFTER, FLOOR])
    axes.bar_label(bars, fmt="%.1f", padding=3)
    axes.axvline(values[-1], color="0.2", linestyle="--", linewidth=1)
    axes.invert_yaxis()
    closed = gap["closed"]
    of = "nothing to reduce" if closed is None else f"{100 * closed:.1f} % of the reducible gap closed"
    axes.set(xlabel="gap, rms / µrad", title=of)
    axes.margins(x=0.15)


def _probabilities(axes: Any, fields: dict[str, Any], most: int = 8) -> None:
    # A group is one statement; its members are not shown beside it.
    rows = [(" or\n".join(g["members"]), g["probability"]) for g in fields["groups"]]
    inside = {name for g in fields["groups"] for name in g["members"]}
    rows += [(e["name"], e["probability"]) for e in fields["effects"] if e["name"] not in inside]
    rows.append(("outside the library", fields["unknown"]["probability"]))
    rows = sorted(rows, key=lambda row: -row[1])[:most]
    axes.barh([name for name, _ in rows], [p for _, p in rows], color=AFTER)
    axes.axvline(0.5, color="0.2", linestyle="--", linewidth=1)
    axes.invert_yaxis()
    axes.tick_params(axis="y", labelsize=7)
    axes.set(xlim=(0, 1), xlabel="probability")


def _slices(axes: Any, slices: list[dict[str, Any]], xlabel: str) -> None:
    places = np.arange(len(slices))
    axes.bar(places, [URAD * s["rad"] for s in slices], color=BEFORE)
    floor = [URAD * s["floor_rad"] for s in slices]
    axes.step(np.r_[-0.5, places + 0.5], [floor[0], *floor], where="pre", color="0.2", linestyle="--", linewidth=1, label="floor")
    names = [f"{s['at']:.3g}" if isinstance(s["at"], (int, float)) else str(s["at"]) for s in slices]
    axes.set_xticks(places, names)
    axes.set(xlabel=xlabel, ylabel="gap / µrad")
    axes.legend(fontsize=8)


def diagnosis(d: Diagnosis) -> Any:
    """The gap, the probabilities, where it lies, and the residual of each run before and after."""
    figure_module = require("matplotlib.figure", extra="plot", purpose="plot()")
    fields = d.to_dict()
    curves = d.curves
    shown = curves[:MOST_RUNS]
    rows = -(-len(shown) // 3)
    figure = figure_module.Figure(figsize=(12.0, 6.4 + 2.0 * rows), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(6.0, max(2.0 * rows, 0.1)))
    (gap, probability), (orders, loads) = upper.subplots(2, 2)
    _gap_bars(gap, fields["gap"])
    _probabilities(probability, fields)
    _slices(orders, fields["where"]["input_order"], "periods a turn of the driver (amplitude)")
    _slices(loads, fields["where"]["load"], "load / N·m (rms)")
    statements = [_statement(item) for item in fields["verdict"]]
    figure.suptitle("; ".join(statements) if statements else "no cause to name")
    if shown:
        panels = lower.subplots(rows, 3, sharex=True, sharey=True, squeeze=False).ravel()
        # One scale for all runs; a step in a single place does not flatten the rest.
        sizes = URAD * np.abs(np.concatenate([c[key] for c in shown for key in ("before_rad", "after_rad")]))
        usual, largest = float(np.quantile(sizes, 0.98)), float(sizes.max())
        top = 1.1 * (usual if largest > 2.5 * usual > 0 else max(largest, 1e-3))
        for axes, curve in zip(panels, shown, strict=False):
            # Where bins are missing the line stops.
            breaks = np.flatnonzero(np.diff(curve["theta1_rad"]) > 0.35) + 1
            degrees = np.insert(np.degrees(curve["theta1_rad"]), breaks, np.nan)
            for key, colour, label in (("before_rad", BEFORE, "before"), ("after_rad", AFTER, "after")):
                axes.plot(degrees, np.insert(URAD * curve[key], breaks, np.nan), color=colour, linewidth=1, label=label)
            axes.set_title(curve["label"], fontsize=9)
            axes.set(xlim=(0, 360), xticks=range(0, 361, 90), ylim=(-top, top))
            axes.grid(alpha=0.3)
        for axes in panels[len(shown) :]:
            axes.set_visible(False)
        panels[0].legend(fontsize=8)
        rest = f", the first {MOST_RUNS} of {len(curves)} runs" if len(curves) > MOST_RUNS else ""
        lower.supxlabel(f"{DEGREES}{rest}")
        lower.supylabel("residual / µrad")
    return figure
