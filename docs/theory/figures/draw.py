#!/usr/bin/env python3
"""Draws the pictures of the theory pages with the package itself: python docs/theory/figures/draw.py [NAME ...]

Needs gearmodel and matplotlib. Every picture is a function; the file is named after it.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams.update(
    {
        "svg.fonttype": "none",
        "svg.hashsalt": "theory",
        "font.size": 9,
        "axes.grid": True,
        "grid.alpha": 0.3,
        "lines.linewidth": 1.2,
        "path.simplify_threshold": 0.3,
    }
)
import matplotlib.pyplot as plt
import numpy as np

import gearmodel as gm

HERE = Path(__file__).parent
K = 0.3287
ERRORS = gm.Errors(e1_mm=0.05, phi1_rad=0.3, e2_mm=0.03, phi2_rad=1.1)
THETA = np.linspace(0.0, 2.0 * np.pi, 361)
DEG = np.degrees(THETA)
BLUE, RED, GREEN, GREY = "#1f5fa8", "#c0392b", "#2d8a4e", "#777777"
SIGN = {"ccw": 1.0, "cw": -1.0}


def elliptic(k: float = K) -> gm.GearPair:
    return gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=k)


def arm(pair: gm.GearPair, theta, sense: str):
    """Driven base arm r2 cos(alpha -+ mu), mm."""
    return pair.radius(theta, gear=2) * np.cos(pair.pressure_angle_rad - SIGN[sense] * pair.inclination(theta))


def turned(points, angle: float):
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(points) @ np.array([[cos, sin], [-sin, cos]])


def pitch_curves_at(pair: gm.GearPair, theta1: float):
    """Both pitch curves in the fixed frame at a driver angle, mm."""
    s = np.linspace(0.0, 2.0 * np.pi, 181)
    r1, r2 = pair.radius(s, gear=1), pair.radius(s, gear=2)
    one = np.column_stack([r1 * np.cos(theta1 - s), r1 * np.sin(theta1 - s)])
    two_angle = np.pi + pair.theta2(s) - pair.theta2(theta1)
    two = np.column_stack([pair.centre_distance_mm + r2 * np.cos(two_angle), r2 * np.sin(two_angle)])
    return one, two


def bare(axis):
    axis.set_aspect("equal")
    axis.axis("off")


def arrow(axis, start, end, colour, text=None, offset=(2, 2)):
    axis.annotate("", xy=end, xytext=start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.4})
    if text:
        axis.text(end[0] + offset[0], end[1] + offset[1], text, color=colour)


def angle_axis(axis, ylabel: str):
    axis.set_xlabel("θ1, deg")
    axis.set_ylabel(ylabel)
    axis.set_xticks(range(0, 361, 90))


def pitch_curves():
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.4), width_ratios=(1.5, 1, 1))
    pair, theta1 = elliptic(), 0.9
    for curve, colour in zip(pitch_curves_at(pair, theta1), (BLUE, RED), strict=True):
        left.plot(*curve.T, color=colour)
    a, r1, mu = pair.centre_distance_mm, pair.radius(theta1), pair.inclination(theta1)
    left.plot([0, a], [0, 0], "k-.", lw=0.8)
    left.plot([0, a], [0, 0], "k+", ms=9)
    reach = 60 * np.array([-np.sin(mu), np.cos(mu)])
    left.plot([r1 - reach[0], r1 + reach[0]], [-reach[1], reach[1]], color=GREY, lw=0.9)
    left.plot([r1, r1], [-60, 60], color=GREY, lw=0.6, ls=":")
    left.text(r1 + reach[0] + 2, reach[1], "tangent, leans by μ", color=GREY)
    left.text(r1 + 2, -9, "P")
    left.text(r1 / 2, 3, "r1")
    left.text((a + r1) / 2, 3, "r2")
    bare(left)
    for k in (0.2, K, 0.4, 0.6):
        middle.plot(DEG, elliptic(k).ratio(THETA), label=f"k = {k}")
        right.plot(DEG, np.degrees(elliptic(k).inclination(THETA)))
    angle_axis(middle, "ratio i21")
    angle_axis(right, "μ, deg")
    middle.legend()
    return figure


def closure():
    figure, axis = plt.subplots(figsize=(6, 2.9))
    theta = np.linspace(0.0, 6.0 * np.pi, 1081)
    pair = elliptic()
    r1 = pair.radius(theta)
    ratio = r1 / (150.0 - r1)
    wrong = np.concatenate([[0.0], np.cumsum(0.5 * (ratio[1:] + ratio[:-1]) * np.diff(theta))])
    axis.plot(np.degrees(theta) / 360, np.degrees(wrong - pair.theta2(theta)), color=RED, label="f taken with a = 150 mm")
    axis.plot(np.degrees(theta) / 360, 0 * theta, color=BLUE, label="a = 145.0 mm")
    axis.set_xlabel("revolutions of the driver")
    axis.set_ylabel("θ2 − f(145.0 mm), deg")
    axis.legend()
    return figure


def conventions():
    figure, axis = plt.subplots(figsize=(7, 3.8))
    pair = elliptic()
    theta1 = 0.7
    for curve, colour in zip(pitch_curves_at(pair, theta1), (BLUE, RED), strict=True):
        axis.plot(*curve.T, color=colour, lw=0.9)
    a, r1, mu, alpha = pair.centre_distance_mm, pair.radius(theta1), pair.inclination(theta1), pair.pressure_angle_rad
    axis.plot([-30, a + 60], [0, 0], "k-.", lw=0.6)
    arrow(axis, (0, 0), (28 * np.cos(1.0), 28 * np.sin(1.0)), BLUE, "e1 at θ1 + φ1 (ccw)", (-22, 4))
    v = 0.8
    arrow(axis, (a, 0), (a + 28 * np.cos(v), -28 * np.sin(v)), RED, "e2 at θ2 + φ2 (cw)", (2, -7))
    for centre, colour, sweep in ((0, BLUE, (2.2, 3.9)), (a, RED, (1.0, -0.4))):
        s = np.linspace(*sweep, 40)
        axis.plot(centre + 40 * np.cos(s), 40 * np.sin(s), color=colour, lw=1)
        arrow(axis, (centre + 40 * np.cos(s[-2]), 40 * np.sin(s[-2])), (centre + 40 * np.cos(s[-1]), 40 * np.sin(s[-1])), colour)
    axis.text(-60, -24, "θ1 +", color=BLUE)
    axis.text(a + 43, 22, "θ2 +", color=RED)
    normals = {
        "n ccw": (np.sin(alpha - mu), np.cos(alpha - mu)),
        "n cw": (np.sin(alpha + mu), -np.cos(alpha + mu)),
    }
    for text, (x, y) in normals.items():
        arrow(axis, (r1, 0), (r1 + 45 * x, 45 * y), GREEN, text)
    axis.text(2, -8, "O1")
    axis.text(a - 12, -8, "O2")
    axis.text(a / 2 - 20, -92, "+x along the centre line", color=GREY)
    bare(axis)
    return figure


def common_normal():
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8), width_ratios=(1, 1.1))
    pair, theta1 = elliptic(), 1.5
    for curve, colour in zip(pitch_curves_at(pair, theta1), (BLUE, RED), strict=True):
        left.plot(*curve.T, color=colour, lw=0.8)
    a, r1, mu, alpha = pair.centre_distance_mm, pair.radius(theta1), pair.inclination(theta1), pair.pressure_angle_rad
    left.plot([0, a], [0, 0], "k+-.", lw=0.6, ms=8)
    t = np.array([-np.sin(mu), np.cos(mu)])
    left.plot(*np.array([[r1, 0] - 70 * t, [r1, 0] + 70 * t]).T, color=GREY, lw=0.8)
    n = np.array([np.sin(alpha - mu), np.cos(alpha - mu)])
    left.plot(*np.array([[r1, 0] - 75 * n, [r1, 0] + 75 * n]).T, color=GREEN)
    left.text(r1 + 75 * n[0] + 2, 75 * n[1] - 6, "normal, α − μ", color=GREEN)
    left.text(r1 - 20 + 70 * t[0], 70 * t[1] + 3, "tangent, μ", color=GREY)
    foot = np.array([r1, 0]) + n * ((np.array([a, 0]) - [r1, 0]) @ n)
    left.plot([a, foot[0]], [0, foot[1]], "k")
    left.text(0.45 * (a + foot[0]), 0.6 * foot[1] + 4, "r2 cos(α − μ)")
    bare(left)
    for sense, colour in (("ccw", BLUE), ("cw", RED)):
        first = pair.transmission_error(THETA, ERRORS, direction=sense)
        exact = pair.transmission_error(THETA, ERRORS, direction=sense, method="exact")
        right.plot(DEG, 1e3 * exact, color=colour, label=f"TE {sense}, exact")
        right.plot(DEG, 1e6 * (exact - first), color=colour, ls=":", label=f"(exact − common normal) × 1000, {sense}")
    angle_axis(right, "mrad")
    right.legend(fontsize=7)
    return figure


def published_2_alpha():
    figure, axis = plt.subplots(figsize=(6.4, 3))
    pair = elliptic()
    alpha = pair.pressure_angle_rad - pair.inclination(THETA)
    u, v = THETA + ERRORS.phi1_rad, pair.theta2(THETA) + ERRORS.phi2_rad
    wrong = (ERRORS.e1_mm * np.sin(u - alpha) + ERRORS.e2_mm * np.sin(v - alpha)) / arm(pair, THETA, "ccw")
    constant = pair.pressure_angle_rad
    flat = (ERRORS.e1_mm * np.sin(u + constant) + ERRORS.e2_mm * np.sin(v - constant)) / (
        pair.radius(THETA, gear=2) * np.cos(constant)
    )
    axis.plot(DEG, 1e3 * pair.transmission_error(THETA, ERRORS, method="exact"), color=BLUE, label="exact contact")
    axis.plot(DEG, 1e3 * wrong, color=RED, label="−α at the driver, as printed")
    axis.plot(DEG, 1e3 * flat, color=GREEN, ls="--", label="right sign, α constant")
    angle_axis(axis, "TE ccw, mrad")
    axis.legend(fontsize=8)
    return figure


def published_3_radius():
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3))
    pair = elliptic()
    left.plot(DEG, arm(pair, THETA, "ccw"), color=BLUE, label="r2 cos(α − μ), ccw")
    left.plot(DEG, arm(pair, THETA, "cw"), color=GREEN, label="r2 cos(α + μ), cw")
    left.plot(DEG, pair.radius(THETA) * np.cos(pair.pressure_angle_rad), color=RED, label="r1 cos α, as printed")
    angle_axis(left, "arm, mm")
    right.plot(DEG, 1e3 * pair.backlash(THETA, ERRORS, method="exact"), color=BLUE, label="exact contact")
    right.plot(DEG, 1e3 * pair.backlash(THETA, ERRORS, method="published"), color=RED, label="printed b_v")
    angle_axis(right, "b_v, mrad")
    for axis in (left, right):
        axis.legend(fontsize=8)
    return figure


def published_4_start():
    figure, axis = plt.subplots(figsize=(6.4, 3))
    pair = elliptic()
    printed = pair.transmission_error(THETA, ERRORS, direction="cw", method="published")
    alpha = pair.pressure_angle_rad
    start = ERRORS.e1_mm * np.sin(ERRORS.phi1_rad - alpha) + ERRORS.e2_mm * np.sin(ERRORS.phi2_rad - alpha)
    meant = printed + 2.0 * start / (pair.radius(THETA) * np.cos(alpha))
    axis.plot(DEG, 1e3 * printed, color=RED, label="as printed: not 0 at θ1 = 0")
    axis.plot(DEG, 1e3 * meant, color=GREEN, label="with the document's own ΔL10⁻")
    axis.plot(
        DEG,
        1e3 * pair.transmission_error(THETA, ERRORS, direction="cw", method="exact", relative_to_start=True),
        color=BLUE,
        label="exact contact, from its start",
    )
    axis.axhline(0, color="k", lw=0.5)
    angle_axis(axis, "TE cw, mrad")
    axis.legend(fontsize=8)
    return figure


def exact_contact():
    figure, axis = plt.subplots(figsize=(6, 4.6))
    pair, theta1 = elliptic(), 0.62
    a = pair.centre_distance_mm
    one = turned(np.asarray(pair.outline(gear=1, points_per_tooth=60)), theta1)
    two = turned(np.asarray(pair.outline(gear=2, points_per_tooth=60)), -pair.theta2(theta1)) + [a, 0]
    r1, mu, alpha = pair.radius(theta1), pair.inclination(theta1), pair.pressure_angle_rad
    near = lambda points: points[np.hypot(points[:, 0] - r1, points[:, 1]) < 22]  # noqa: E731
    for points, colour in ((one, BLUE), (two, RED)):
        inside = near(points)
        order = np.argsort(np.argmax(np.all(points[None] == inside[:, None], axis=2), axis=1))
        inside = inside[order]
        breaks = np.flatnonzero(np.hypot(*np.diff(inside, axis=0).T) > 2.0) + 1
        for part in np.split(inside, breaks):
            axis.plot(*part.T, color=colour)
    n = np.array([np.sin(alpha - mu), np.cos(alpha - mu)])
    axis.plot(*np.array([[r1, 0] - 17 * n, [r1, 0] + 17 * n]).T, color=GREEN, lw=0.9)
    pitch = np.pi * pair.module_mm
    s = pair.arc_length_mm(theta1)
    # Tips in the rack's offset: where the flank reaches one addendum along the line of action.
    for tooth in range(int(s / pitch) - 1, int(s / pitch) + 3):
        d = s - tooth * pitch
        q = np.array([r1, 0]) + d * np.cos(alpha) * n
        if abs(d) * np.sin(alpha) * np.cos(alpha) < 0.97 * pair.module_mm:
            axis.plot(*q, "o", color="k", ms=5)
            axis.annotate("touches", q, textcoords="offset points", xytext=(14, 4))
    axis.plot(r1, 0, "k+", ms=10)
    axis.text(r1 + 0.7, -2.2, "P")
    axis.text(*([r1, 0] + 14.5 * n + [0.6, 0]), "common normal of both pairs", color=GREEN)
    bare(axis)
    return figure


def circular_limit():
    figure, axis = plt.subplots(figsize=(6.4, 3.6))
    r1, r2, a, alpha = 45.0, 60.0, 105.0, np.radians(20)
    c1, c2 = np.array([3.0, 5.0]), np.array([a + 5.0, -4.0])
    b1, b2 = r1 * np.cos(alpha), r2 * np.cos(alpha)
    s = np.linspace(0, 2 * np.pi, 121)
    for centre, radius, colour in ((c1, b1, BLUE), (c2, b2, RED)):
        axis.plot(centre[0] + radius * np.cos(s), centre[1] + radius * np.sin(s), color=colour, lw=0.9)
        axis.plot(*centre, "o", color=colour, ms=4)
    axis.plot([0, a], [0, 0], "k+-.", lw=0.5, ms=9)
    axis.plot(*np.array([c1, c2]).T, color=GREY, lw=0.8)
    gamma = np.arctan2(*(c2 - c1)[::-1])
    work = np.arccos((b1 + b2) / np.hypot(*(c2 - c1)))
    for sign, text in ((1, "ccw"), (-1, "cw")):
        angle = gamma - sign * work
        one = c1 + b1 * np.array([np.cos(angle), np.sin(angle)])
        two = c2 - b2 * np.array([np.cos(angle), np.sin(angle)])
        axis.plot(*np.array([one, two]).T, color=GREEN)
        axis.text(*(0.25 * one + 0.75 * two + [1, 5 * sign - 3]), text, color=GREEN)
    axis.text(*(c1 + [-6, 4]), "C1", color=BLUE)
    axis.text(*(c2 + [3, -9]), "C2", color=RED)
    axis.text(-14, -8, "shaft 1")
    axis.text(a - 8, 4, "shaft 2")
    bare(axis)
    return figure


def tooth_errors():
    figure, axis = plt.subplots(figsize=(7.5, 3.2))
    pair = elliptic()
    leads = 0.004 * np.random.default_rng(4).standard_normal(47)
    theta = np.linspace(0.0, 0.66, 1200)
    teeth = gm.ToothErrors(driver_ccw_mm=leads)
    running = pair.transmission_error(theta, gm.Errors(), method="exact", tooth_errors=teeth)
    for tooth in range(0, 8):
        line = leads[tooth] / arm(pair, theta, "ccw")
        phase = pair.arc_length_mm(theta) / (np.pi * pair.module_mm) - tooth
        axis.plot(np.degrees(theta), np.where(np.abs(phase) < 0.8, 1e6 * line, np.nan), color=GREY, lw=0.8)
        at = np.interp(tooth, pair.arc_length_mm(theta) / (np.pi * pair.module_mm), np.degrees(theta))
        if tooth < 7:
            axis.text(at, 1e6 * leads[tooth] / 47.5 + 4, f"tooth {tooth}", color=GREY, fontsize=7, ha="center")
    axis.plot(np.degrees(theta), 1e6 * running, color=BLUE, lw=1.8, label="running pair, exact contact")
    axis.set_xlabel("θ1, deg")
    axis.set_ylabel("TE ccw, µrad")
    axis.legend(fontsize=8)
    return figure


def load():
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.2))
    pair = elliptic()
    for text, shape, colour in (
        ("driven shaft: 1", np.ones_like(THETA), GREY),
        ("driving shaft: i21²", pair.ratio(THETA) ** 2, RED),
        ("mesh and bearings: 1/arm², ccw", 1 / arm(pair, THETA, "ccw") ** 2, BLUE),
        ("the same, cw", 1 / arm(pair, THETA, "cw") ** 2, GREEN),
    ):
        left.plot(DEG, shape / shape.mean(), color=colour, label=text)
    angle_axis(left, "wind-up over its mean")
    left.legend(fontsize=7)
    teeth = gm.ToothErrors(driver_ccw_mm=0.0006 * np.random.default_rng(4).standard_normal(47))
    loaded = pair.loaded(errors=gm.Errors(), tooth_errors=teeth)
    theta = np.linspace(0.0, 0.8, 700)
    for load_nm, colour in ((0.0, GREY), (5.0, BLUE), (15.0, GREEN), (60.0, RED)):
        right.plot(np.degrees(theta), 1e6 * loaded.transmission_error(theta, load_nm), color=colour, label=f"{load_nm:.0f} N·m")
    right.set_xlabel("θ1, deg")
    right.set_ylabel("TE ccw, µrad")
    right.legend(fontsize=7)
    return figure


def phases():
    figure, axis = plt.subplots(figsize=(5.6, 4.6))
    pair = elliptic()
    theta = THETA[:-1:3]
    unit = [gm.Errors(e1_mm=0.05), gm.Errors(e1_mm=0.05, phi1_rad=np.pi / 2), gm.Errors(e2_mm=0.05),
            gm.Errors(e2_mm=0.05, phi2_rad=np.pi / 2)]
    basis = np.array([pair.backlash(theta, errors) for errors in unit])
    grid = np.linspace(-np.pi, np.pi, 61)
    one, two = np.meshgrid(grid, grid, indexing="ij")
    weights = np.stack([np.cos(one), np.sin(one), np.cos(two), np.sin(two)], axis=-1)
    size = np.degrees(np.ptp(weights @ basis, axis=-1))
    picture = axis.contourf(np.degrees(grid), np.degrees(grid), size.T, levels=12, cmap="viridis")
    figure.colorbar(picture, label="b_v peak-to-peak, deg")
    alpha = 20.0
    for n1 in (0, -180):
        axis.plot(180 - alpha + n1, alpha, "rs", ms=8, mec="w")
        axis.plot(180 - alpha + n1, alpha - 180, "rs", ms=8, mec="w")
    axis.plot([], [], "rs", mec="w", label="printed")
    axis.plot([0, 180, -180, 180, -180], [0, 180, -180, -180, 180], "w*", ms=12, mec="k", label="true minimum", clip_on=False)
    axis.set_xlabel("φ1, deg")
    axis.set_ylabel("φ2, deg")
    axis.legend(loc="upper center", fontsize=8, ncols=2)
    axis.grid(False)
    return figure


def measured_figures():
    figure, axis = plt.subplots(figsize=(7.5, 3.4))
    pair = elliptic()
    rng = np.random.default_rng(3)
    grid = (np.arange(720) + 0.5) * np.pi / 360
    predicted = pair.transmission_error(grid, ERRORS)
    mesh = 8e-5 * np.cos(2 * np.pi * pair.arc_length_mm(grid) / (np.pi * pair.module_mm))
    measured = predicted + mesh + 1.2e-5 * rng.standard_normal(720) + 2e-4 * np.sin(pair.theta2(grid) - 2)
    degrees = np.degrees(grid)
    axis.plot(degrees, 1e3 * predicted, color=GREY, label="predicted")
    axis.fill_between(degrees, 1e3 * (measured - 5e-5), 1e3 * (measured + 5e-5), color=BLUE, alpha=0.25, lw=0, label="floor (drawn large)")
    axis.plot(degrees, 1e3 * measured, color=BLUE, lw=0.8, label="mean curve")
    low, high = 1e3 * measured.min(), 1e3 * measured.max()
    axis.annotate("", xy=(352, low), xytext=(352, high), arrowprops={"arrowstyle": "<->"})
    axis.text(300, 0.5 * (low + high), "F_is-like\ntotal")
    s = pair.arc_length_mm(grid)
    begin = 150
    end = np.searchsorted(s, s[begin] + np.pi * pair.module_mm)
    axis.axvspan(degrees[begin], degrees[end], color=GREEN, alpha=0.25)
    axis.text(degrees[end] + 3, high - 0.25, "one pitch of arc length:\nf_is-like, tooth to tooth", color=GREEN)
    angle_axis(axis, "TE ccw, mrad")
    axis.legend(fontsize=7, loc="lower left")
    return figure


def inseparable():
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3))
    pair = elliptic()
    root = (1 - K * K) / (1 + K * K)
    size, psi = 1e-4, 0.7
    theta2 = pair.theta2(THETA)
    one = -pair.ratio(THETA) * size * np.sin(THETA - psi)
    two = -size * np.cos(psi) * np.sin(theta2) + size * np.sin(psi) / root * np.cos(theta2)
    left.plot(DEG, 1e6 * one, color=BLUE, lw=3, alpha=0.4, label="input encoder eccentric by 100 µrad")
    left.plot(DEG, 1e6 * two, color=RED, lw=1, label="an eccentric output encoder")
    left.plot(DEG, 1e6 * (one - two), color="k", ls=":", label="difference: a constant, the free zero")
    angle_axis(left, "trace in TE, µrad")
    left.legend(fontsize=7)
    gear1 = pair.transmission_error(THETA, gm.Errors(e1_mm=0.01, phi1_rad=0.4))
    alpha = pair.pressure_angle_rad
    imitation = gm.Errors(e2_mm=0.01, phi2_rad=0.4 + 2 * alpha)
    right.plot(DEG, 1e6 * gear1, color=BLUE, lw=3, alpha=0.4, label="e1 = 10 µm, φ1 = 0.4, ccw")
    right.plot(DEG, 1e6 * pair.transmission_error(THETA, imitation), color=RED, lw=1, label="e2 = 10 µm, φ2 = φ1 + 2α, ccw")
    right.plot(DEG, 1e6 * pair.transmission_error(THETA, gm.Errors(e1_mm=0.01, phi1_rad=0.4), direction="cw"),
               color=BLUE, ls="--", label="the first in cw")
    right.plot(DEG, 1e6 * pair.transmission_error(THETA, imitation, direction="cw"), color=RED, ls="--", label="the second in cw")
    angle_axis(right, "TE, µrad")
    right.legend(fontsize=7)
    # The page's identities, to rounding.
    assert np.ptp(one - two) < 1e-18 and np.abs(gear1 - pair.transmission_error(THETA, imitation)).max() < 1e-16
    return figure


PICTURES = (pitch_curves, closure, conventions, common_normal, published_2_alpha, published_3_radius, published_4_start,
            exact_contact, circular_limit, tooth_errors, load, phases, measured_figures, inseparable)


def main() -> None:
    wanted = set(sys.argv[1:])
    for picture in PICTURES:
        name = picture.__name__.replace("_", "-")
        if wanted and name not in wanted:
            continue
        figure = picture()
        figure.tight_layout()
        path = HERE / f"{name}.svg"
        figure.savefig(path, metadata={"Date": None, "Creator": None})
        plt.close(figure)
        # Two decimals of a point are enough for a page, and halve the file.
        text = re.sub(r"(\d+\.\d\d)\d+", r"\1", path.read_text())
        path.write_text("\n".join(line.rstrip() for line in text.splitlines()) + "\n")
        print(f"{path.name}: {path.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    main()
