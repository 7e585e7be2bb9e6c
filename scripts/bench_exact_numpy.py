#!/usr/bin/env python3
"""Exact tooth contact: the package against a vectorised NumPy of the same equations, for results and for speed.

    python scripts/bench_exact_numpy.py [--angles 4096] [--repeat 5] [--least-ratio R]

Both solve, at every angle, sense and tooth pair in contact, the supports' equations of docs/theory/exact-contact.md by
Newton with analytic derivatives. The NumPy version works on whole arrays: one entry an angle, sense and tooth pair. It is
given the tooth pairs in contact and starts from the nominal position; times are CPU seconds of one core. Needs gearmodel, NumPy and SciPy
(for the elliptic integral and its incomplete sister, the arc length).

It fails when results differ by more than 1e-9 rad, or when the package is not R times as fast (default: no limit, since
machines differ).
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


def median_seconds(call, repeat: int) -> float:
    """CPU time, all threads: what other processes do does not matter."""
    call()
    spans = []
    for _ in range(repeat):
        start = time.process_time()
        call()
        spans.append(time.process_time() - start)
    return float(np.median(spans))


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--angles", type=int, default=4096)
    arguments.add_argument("--repeat", type=int, default=5)
    arguments.add_argument("--least-ratio", type=float, default=0.0)
    options = arguments.parse_args()

    theta1 = 2.0 * np.pi * np.arange(options.angles) / options.angles
    pair = gm.GearPair.elliptical(module_mm=MODULE_MM, teeth=TEETH, eccentricity=K)
    leads = 0.0005 * (np.arange(TEETH) ** 2 % 13)
    errors = gm.Errors(e1_mm=E1_MM, phi1_rad=PHI1, e2_mm=E2_MM, phi2_rad=PHI2)
    teeth = gm.ToothErrors(driver_ccw_mm=leads, driver_cw_mm=leads)
    ours = lambda: [  # noqa: E731
        pair.transmission_error(theta1, errors, direction=sense, method="exact", tooth_errors=teeth)
        for sense in ("ccw", "cw")
    ]

    solver = NumpyContact()
    # Every pair that the rack offset lets touch: three candidates an angle and sense, as a fixed shape suits NumPy.
    _, _, _, _, _, _, arc = solver.roll(theta1)
    reach_mm = 1.05 * MODULE_MM / (np.sin(ALPHA) * np.cos(ALPHA))
    entries = {"theta1": [], "sign": [], "tooth": []}
    for sign in (1.0, -1.0):
        half = 0.0 if sign > 0 else 0.5
        low = np.ceil((arc - reach_mm) / solver.pitch_mm - half)
        high = np.floor((arc + reach_mm) / solver.pitch_mm - half)
        for step in range(int((high - low).max()) + 1):
            inside = low + step <= high
            entries["theta1"].append(theta1[inside])
            entries["sign"].append(np.full(inside.sum(), sign))
            entries["tooth"].append((low + step)[inside])
    theta, sign, tooth = (np.concatenate(entries[name]) for name in ("theta1", "sign", "tooth"))
    lead = leads[tooth.astype(int) % TEETH]
    theirs = lambda: solver.te(theta, sign, tooth, lead)  # noqa: E731
    te = theirs()

    # Results: at each angle the package's TE is that of one of the pairs NumPy solved.
    te_ours = ours()
    worst = 0.0
    for sense, curve in zip((1.0, -1.0), te_ours, strict=True):
        for index in range(0, options.angles, max(1, options.angles // 64)):
            mine = te[(sign == sense) & (theta == theta1[index])]
            worst = max(worst, float(np.abs(mine - curve[index]).min()))

    seconds_ours, seconds_theirs = median_seconds(ours, options.repeat), median_seconds(theirs, options.repeat)
    rate_ours = 2 * options.angles / seconds_ours
    rate_theirs = 2 * options.angles / seconds_theirs
    print(f"{options.angles} angles x 2 senses, a pitch error on every tooth, one core")
    print(f"  package : {seconds_ours * 1e3:9.2f} ms  {rate_ours / 1e6:7.3f} M angles/s")
    print(f"  NumPy   : {seconds_theirs * 1e3:9.2f} ms  {rate_theirs / 1e6:7.3f} M angles/s  "
          f"({len(theta)} tooth pairs, {len(theta) / seconds_theirs / 1e6:.3f} M pairs/s)")
    print(f"  ratio   : {seconds_theirs / seconds_ours:9.1f}")
    print(f"  largest difference of TE: {worst:.1e} rad")
    if worst > 1e-9 or seconds_theirs < options.least_ratio * seconds_ours:
        print(f"not met: difference <= 1e-9 rad and ratio >= {options.least_ratio:g}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
