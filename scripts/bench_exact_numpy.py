#!/usr/bin/env python3
"""Exact tooth contact: the package against a vectorised NumPy of the same equations, for results and for speed.

    python scripts/bench_exact_numpy.py [--angles 4096] [--repeat 20] [--least-ratio R]

Both give exact TE of both senses at every angle, all tooth pairs in contact considered, with eccentricities alone (rigid
displacements) and with a pitch error on every tooth. NumPy solves the supports' equations of docs/theory/exact-contact.md
by Newton with analytic derivatives on whole arrays, one entry an angle, sense and tooth pair; which pairs are in contact it is
told. The package finds them, solves the same equations at Chebyshev nodes and carries them between the nodes. "On one core"
is CPU seconds of 4096 angles a call, which the package does not share over threads; "on all cores" is time by the clock of
256 times as many angles in one call. Needs gearmodel, NumPy and SciPy (for the elliptic integral and its incomplete sister,
the arc length).

It fails when results differ by more than 1e-9 rad, or when the package is not R times as fast in the case with pitch errors
(default: no limit, since machines differ).
"""

from __future__ import annotations

import argparse
import os
import sys
import time

# One core for both: the comparison is of code, not of machines.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np
from scipy.special import ellipe, ellipeinc

import gearmodel as gm

MODULE_MM, TEETH, K, ALPHA = 3.0, 47, 0.3287, np.radians(20.0)
E1_MM, PHI1, E2_MM, PHI2 = 0.05, 0.3, 0.03, 1.1


class NumpyContact:
    """The contact equations of an elliptic pair on arrays."""

    def __init__(self, k: float = K) -> None:
        self.k = k
        self.semi_major_mm = np.pi * MODULE_MM * TEETH / (4.0 * ellipe(k * k))
        self.centre_mm = 2.0 * self.semi_major_mm
        self.p_mm = self.semi_major_mm * (1.0 - k * k)
        self.pitch_mm = np.pi * MODULE_MM
        root = np.sqrt((1.0 + k) / (1.0 - k))
        self.k_anomaly = (root - 1.0) / (root + 1.0)

    def roll(self, theta):
        """r1, r2, i21, mu, dmu/dtheta, f, arc length at rolling positions."""
        k = self.k
        sin, cos = np.sin(theta), np.cos(theta)
        base = 1.0 - k * cos
        r1 = self.p_mm / base
        r2 = self.centre_mm - r1
        mu = np.arctan2(-k * sin, base)
        # d/dtheta arg(1 - k exp(i theta))
        mu_slope = (k * k - k * cos) / (base * base + k * k * sin * sin)
        f = theta - 2.0 * mu
        # Arc from the far vertex by the eccentric anomaly E: ds = A sqrt(1 - k^2 cos^2 E) dE,
        # tan(E/2) = sqrt((1 + k)/(1 - k)) tan(theta/2), unwrapped like f.
        anomaly = theta + 2.0 * np.arctan2(self.k_anomaly * sin, 1.0 - self.k_anomaly * cos)
        arc = self.semi_major_mm * (ellipeinc(anomaly - 0.5 * np.pi, k * k) + ellipe(k * k))
        return r1, r2, r1 / r2, mu, mu_slope, f, arc

    def te(self, theta1, sign, tooth, lead_mm, rounds: int = 20):
        """psi2 - f of every entry: theta1, sign (+1 ccw, -1 cw), tooth and lead are arrays of one shape."""
        sin_a, cos_a = np.sin(ALPHA), np.cos(ALPHA)
        offset = (tooth + np.where(sign > 0, 0.0, 0.5)) * self.pitch_mm
        beta0 = sign * (0.5 * np.pi - ALPHA)
        theta_a, theta_b = theta1.copy(), theta1.copy()
        e1x, e1y = E1_MM * np.cos(theta1 + PHI1), E1_MM * np.sin(theta1 + PHI1)
        psi2 = None
        for _ in range(rounds):
            r1, _, _, mu, mu_slope, _, arc = self.roll(theta_a)
            beta = beta0 + mu
            sin, cos = np.sin(beta), np.cos(beta)
            tan_mu = np.tan(mu)
            chi_a, chi_a_slope = beta - theta_a, mu_slope - 1.0
            h_a, t_a = r1 * cos + sign * (arc - offset) * cos_a, -r1 * sin
            t_a_slope = -r1 * (tan_mu * sin + cos * mu_slope)
            s1, r2, ratio, mu, mu_slope, f, arc = self.roll(theta_b)
            beta = beta0 + mu
            sin, cos = np.sin(beta), np.cos(beta)
            tan_mu = np.tan(mu)
            chi_b, chi_b_slope = beta + f, mu_slope + ratio
            h_b, t_b = -r2 * cos + sign * (arc - offset) * cos_a, r2 * sin
            t_b_slope = -s1 * tan_mu * sin + r2 * cos * mu_slope
            normal = chi_a + theta1
            psi2 = chi_b - normal
            sin_v, cos_v = np.sin(psi2 + PHI2), np.cos(psi2 + PHI2)
            wx, wy = e1x - E2_MM * cos_v - self.centre_mm, e1y + E2_MM * sin_v
            nx, ny = np.cos(normal), np.sin(normal)
            w_normal, w_across = wx * nx + wy * ny, wy * nx - wx * ny
            gap = h_a - h_b + w_normal + sign * lead_mm
            slip = t_a - t_b + w_across
            # dW/dpsi2 = e2 (sin v, cos v); dpsi2 = chi_b' dtheta_b - chi_a' dtheta_a; dn = chi_a' n_perp dtheta_a
            vx, vy = E2_MM * sin_v, E2_MM * cos_v
            v_normal, v_across = vx * nx + vy * ny, vy * nx - vx * ny
            gap_a = chi_a_slope * (t_a + w_across - v_normal)
            gap_b = chi_b_slope * (v_normal - t_b)
            slip_a = t_a_slope - chi_a_slope * (w_normal + v_across)
            slip_b = chi_b_slope * v_across - t_b_slope
            determinant = gap_a * slip_b - gap_b * slip_a
            step_a = (gap_b * slip - slip_b * gap) / determinant
            step_b = (slip_a * gap - gap_a * slip) / determinant
            theta_a += step_a
            theta_b += step_b
            if max(np.abs(step_a).max(), np.abs(step_b).max()) < 1e-7:
                # Newton's last step leaves its square: psi2 to first order in it is exact.
                psi2 = psi2 + chi_b_slope * step_b - chi_a_slope * step_a
                break
        return psi2 - self.roll(theta1)[5]


def in_contact(solver: NumpyContact, theta, sign, tooth):
    """Whether the nominal contact of each entry is within the addendum of both pitch curves (by sampling them)."""
    r1, r2, _, mu, _, f, arc = solver.roll(theta)
    offset = arc - (tooth + np.where(sign > 0, 0.0, 0.5)) * solver.pitch_mm
    beta = sign * (0.5 * np.pi - ALPHA) + mu
    # Q = P + (+- d cos alpha) n
    x = r1 + sign * offset * np.cos(ALPHA) * np.cos(beta)
    y = sign * offset * np.cos(ALPHA) * np.sin(beta)
    nearest = np.full((2, len(theta)), np.inf)
    for step in np.linspace(-0.35, 0.35, 701):
        s1, s2, _, _, _, g, _ = solver.roll(theta + step)
        nearest[0] = np.minimum(nearest[0], np.hypot(x - s1 * np.cos(step), y + s1 * np.sin(step)))
        turn = np.pi + g - f
        nearest[1] = np.minimum(nearest[1], np.hypot(x - solver.centre_mm - s2 * np.cos(turn), y - s2 * np.sin(turn)))
    # Outside of one pitch curve the contact is inside of the other: towards the tip of gear 1 for offsets along the sense.
    return np.where(sign * offset > 0, nearest[0], nearest[1]) <= MODULE_MM


def least_seconds(call, repeat: int, clock=time.process_time) -> float:
    """Least time of a call (what else runs on the machine only adds), each measurement over some 20 ms of calls."""
    start = time.perf_counter()
    call()
    count = max(1, int(0.02 / (time.perf_counter() - start)))
    spans = []
    for _ in range(repeat):
        start = clock()
        for _ in range(count):
            call()
        spans.append((clock() - start) / count)
    return min(spans)


def compare(name: str, solver, entries, contact, leads, options) -> tuple[float, float]:
    """Prints one case; the largest difference (rad) and the ratio of speeds on one core."""
    theta1 = 2.0 * np.pi * np.arange(options.angles) / options.angles
    pair = gm.GearPair.elliptical(module_mm=MODULE_MM, teeth=TEETH, eccentricity=K)
    errors = gm.Errors(e1_mm=E1_MM, phi1_rad=PHI1, e2_mm=E2_MM, phi2_rad=PHI2)
    teeth = gm.ToothErrors(driver_ccw_mm=leads, driver_cw_mm=leads) if leads.any() else None

    def ours(angles=theta1):
        return [
            pair.transmission_error(angles, errors, direction=sense, method="exact", tooth_errors=teeth)
            for sense in ("ccw", "cw")
        ]

    theta, sign, tooth = entries
    lead = leads[tooth.astype(int) % TEETH]
    te = solver.te(theta, sign, tooth, lead)
    # Results: at each angle the package's TE is that of one of the pairs NumPy solved.
    worst = 0.0
    for sense, curve in zip((1.0, -1.0), ours(), strict=True):
        for index in range(0, options.angles, max(1, options.angles // 256)):
            mine = te[(sign == sense) & (theta == theta1[index])]
            worst = max(worst, float(np.abs(mine - curve[index]).min()))

    pairs = int(contact.sum())
    few = (theta[contact], sign[contact], tooth[contact], lead[contact])
    seconds_theirs = least_seconds(lambda: solver.te(*few), options.repeat)
    seconds_ours = least_seconds(ours, options.repeat)
    many = 256
    dense = 2.0 * np.pi * np.arange(options.angles * many) / (options.angles * many)
    seconds_dense = least_seconds(lambda: ours(dense), options.repeat, time.perf_counter) / many
    print(f"{name}: {options.angles} angles x 2 senses, {pairs} tooth pairs in contact")
    for who, seconds in [
        ("NumPy, one core", seconds_theirs),
        ("package, one core", seconds_ours),
        (f"package, {many}x the angles, {os.cpu_count()} cores", seconds_dense),
    ]:
        print(
            f"  {who:34s} {seconds * 1e3:9.3f} ms  {2 * options.angles / seconds / 1e6:8.3f} M angles/s  "
            f"{pairs / seconds / 1e6:8.3f} M tooth pairs/s  ratio {seconds_theirs / seconds:7.1f}"
        )
    print(f"  largest difference of TE: {worst:.1e} rad")
    return worst, seconds_theirs / seconds_ours


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--angles", type=int, default=4096)
    arguments.add_argument("--repeat", type=int, default=20)
    arguments.add_argument("--least-ratio", type=float, default=0.0)
    options = arguments.parse_args()

    theta1 = 2.0 * np.pi * np.arange(options.angles) / options.angles
    solver = NumpyContact()
    # Every pair that the rack offset lets touch, of which those in contact are picked.
    arc = solver.roll(theta1)[6]
    reach_mm = 1.05 * MODULE_MM / (np.sin(ALPHA) * np.cos(ALPHA))
    found = {"theta1": [], "sign": [], "tooth": []}
    for sign in (1.0, -1.0):
        half = 0.0 if sign > 0 else 0.5
        low = np.ceil((arc - reach_mm) / solver.pitch_mm - half)
        high = np.floor((arc + reach_mm) / solver.pitch_mm - half)
        for step in range(int((high - low).max()) + 1):
            inside = low + step <= high
            found["theta1"].append(theta1[inside])
            found["sign"].append(np.full(inside.sum(), sign))
            found["tooth"].append((low + step)[inside])
    entries = tuple(np.concatenate(found[name]) for name in ("theta1", "sign", "tooth"))
    contact = in_contact(solver, *entries)

    worst, _ = compare("rigid displacements", solver, entries, contact, np.zeros(TEETH), options)
    leads = 0.0005 * (np.arange(TEETH) ** 2 % 13)
    worst_uneven, ratio = compare("a pitch error on every tooth", solver, entries, contact, leads, options)
    if max(worst, worst_uneven) > 1e-9 or ratio < options.least_ratio:
        print(f"not met: difference <= 1e-9 rad and ratio >= {options.least_ratio:g}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
