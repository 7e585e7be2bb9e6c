#!/usr/bin/env python3
"""Designs a new non-circular pair: from a wanted speed variation to outlines for the machine.

    python examples/design_pair.py [--out DIR] [--ratio-max 2.0] [--module 2] [--teeth 48] [--backlash 0.08]

A packaging drive wants its driven shaft to run up to `--ratio-max` times the driver's speed once a turn. The script chooses k
of an elliptic pair, checks that a rack can cut the teeth, compares with a two-lobed pair and with a drive whose i21 is a
pure cosine (which cannot reach 2), sizes the designed backlash so that it stays positive under the tolerated errors, states TE per unit of each
error, and writes pair.toml and the outlines (DXF, SVG). Exits with 1 when a design rule is not met.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

import gearmodel as gm

THETA1 = 2.0 * np.pi * np.arange(720) / 720
TOLERATED = gm.Errors(e1_mm=0.02, e2_mm=0.02)


def elliptic(k: float, options: argparse.Namespace, backlash_mm: float = 0.0) -> gm.GearPair:
    return gm.GearPair.elliptical(
        module_mm=options.module, teeth=options.teeth, eccentricity=k, backlash_mm=backlash_mm, face_width_mm=20.0
    )


def eccentricity_for(ratio_max: float) -> float:
    """i21 max = (1 + k)/(1 - k)."""
    return (ratio_max - 1.0) / (ratio_max + 1.0)


def report(name: str, make) -> gm.GearPair | None:
    """One line a candidate: ratio, lean, whether a rack can cut it."""
    try:
        pair = make()
        ratio = pair.ratio(THETA1)
        lean = np.degrees(np.abs(pair.inclination(THETA1)).max())
        pair.check_teeth()
        contact = min(pair.contact_ratio("ccw").min(), pair.contact_ratio("cw").min())
        print(f"{name:24s} a = {pair.centre_distance_mm:8.4f} mm, i21 {ratio.min():.3f} to {ratio.max():.3f},"
              f" lean {lean:4.1f} deg, contact ratio from {contact:.2f}")
        return pair
    except gm.GeometryError as error:
        print(f"{name:24s} refused: {error}")
        return None


def least_backlash(pair: gm.GearPair) -> float:
    """Smallest backlash over the turn and all mountings of the tolerated eccentricities, rad.

    b_v is a sum of two vectors' traces, so its worst at an angle is the sum of both amplitudes.
    """
    quarter = 0.5 * np.pi
    amplitude = np.zeros_like(THETA1)
    for gear, size in ((1, TOLERATED.e1_mm), (2, TOLERATED.e2_mm)):
        waves = [
            pair.backlash(THETA1, gm.Errors(**{f"e{gear}_mm": size, f"phi{gear}_rad": phase}))
            - pair.backlash(THETA1, gm.Errors())
            for phase in (0.0, quarter)
        ]
        amplitude += np.hypot(*waves)
    return float((pair.backlash(THETA1, gm.Errors()) - amplitude).min())


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--out", type=Path, help="directory of the drawings; default: a new temporary one")
    arguments.add_argument("--ratio-max", type=float, default=2.0)
    arguments.add_argument("--module", type=float, default=2.0)
    arguments.add_argument("--teeth", type=int, default=48)
    arguments.add_argument("--backlash", type=float, default=0.08, help="designed, along the pitch curve, mm")
    options = arguments.parse_args()

    k = eccentricity_for(options.ratio_max)
    print(f"wanted: i21 up to {options.ratio_max}; elliptic k = {k:.4f}")
    common = {"module_mm": options.module, "teeth": options.teeth}
    report("elliptic", lambda: elliptic(k, options))
    report("two lobes", lambda: gm.GearPair.lobed(**common, eccentricity=k, lobes=(2, 2)))
    report("i21 = 1 + s cos theta1", lambda: gm.GearPair.transmission(**common, cosines=[options.ratio_max - 1.0]))

    pair = elliptic(k, options, options.backlash)
    pair.check_teeth()
    play = pair.backlash(THETA1, gm.Errors(), method="exact")
    least = least_backlash(pair)
    print(f"\ndesigned backlash {options.backlash} mm: {np.degrees(play.min()) * 60:.2f} to {np.degrees(play.max()) * 60:.2f}"
          f" arcmin at the driven shaft")
    print(f"least backlash with e1 = e2 = {TOLERATED.e1_mm} mm in any mounting: {np.degrees(least) * 60:+.2f} arcmin")

    print("\nTE per unit of error, peak-to-peak over the turn:")
    for name, unit, scale in (("e1_mm", "um", 1e-3), ("e2_mm", "um", 1e-3), ("centre_distance_error_mm", "um", 1e-3)):
        row = [np.ptp(pair.te_derivative(THETA1, name, gm.Errors(), sense)) * scale * 1e6 for sense in ("ccw", "cw")]
        print(f"  {name:28s} {row[0]:7.2f} urad/{unit} ccw {row[1]:7.2f} cw")

    best = pair.optimal_phases(TOLERATED, objective="te_both")
    print(f"\nmounting with the least TE of both senses: phi1 = {np.degrees(best.phi1_rad):.1f} deg,"
          f" phi2 = {np.degrees(best.phi2_rad):.1f} deg, {best.value_rad * 1e6:.0f} urad peak-to-peak")
    mounted = TOLERATED.replace(phi1_rad=best.phi1_rad, phi2_rad=best.phi2_rad)
    # The designed backlash has a trace of its own; the objective is that of the eccentricities alone.
    exact = max(
        np.ptp(
            pair.transmission_error(THETA1, mounted, direction=sense, method="exact")
            - pair.transmission_error(THETA1, gm.Errors(), direction=sense, method="exact")
        )
        for sense in ("ccw", "cw")
    )
    print(f"exact contact there: {exact * 1e6:.0f} urad")

    out = options.out or Path(tempfile.mkdtemp(prefix="design-pair-"))
    out.mkdir(parents=True, exist_ok=True)
    pair.to_toml(out / "pair.toml")
    for gear in (1, 2):
        outline = pair.outline(gear=gear, points_per_tooth=80)
        outline.to_dxf(out / f"gear{gear}.dxf")
        outline.to_svg(out / f"gear{gear}.svg")
    for path in sorted(out.iterdir()):
        print(path)

    met = {
        "ratio as wanted": abs(pair.ratio(THETA1).max() / options.ratio_max - 1.0) < 1e-9,
        "backlash stays positive": least > 0.0,
        "exact contact agrees with the prediction": abs(exact / best.value_rad - 1.0) < 0.01,
        "pair.toml gives the same pair": gm.GearPair.from_toml(out / "pair.toml") == pair,
    }
    failed = [rule for rule, kept in met.items() if not kept]
    if failed:
        print("not met: " + "; ".join(failed), file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
