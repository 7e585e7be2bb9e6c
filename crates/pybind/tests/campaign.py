"""A small campaign made with NumPy: an elliptic pair, runs at several loads and speeds, and effects by first-order formulas.

Written out here, not taken from the package, so that the diagnosis is checked against something else than itself. Formulas:
docs/theory; dir is +1 for ccw, -1 for cw; angles in rad, torque in N m.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import gearmodel as gm

Array = NDArray[np.float64]
K = 0.3287
TEETH = 47
MODULE_MM = 3.0
SEMI_MAJOR_MM = 72.499859
PLAN = (("ccw", 0.5, 5.0), ("cw", 0.5, 5.0), ("ccw", 10.0, 5.0), ("cw", 10.0, 5.0), ("ccw", 10.0, 10.0), ("cw", 10.0, 10.0))


@dataclass
class Samples:
    """What an effect may look at."""

    time_s: Array
    theta1: Array
    theta2: Array
    ratio: Array
    arm_mm: Array  # r2 cos(alpha -+ mu) of the driving flank
    sign: float
    load_nm: float
    speed_rad_per_s: float
    revolutions: Array  # since the campaign's start


Effect = Callable[[Samples], Array]


def pair() -> gm.GearPair:
    return gm.GearPair.elliptical(module_mm=MODULE_MM, teeth=TEETH, eccentricity=K, pressure_angle_deg=20)


def driven(theta1: Array) -> Array:
    """theta2 of the elliptic pair: theta1 + the periodic part of 2 atan(c tan(theta1 / 2))."""
    # mu = atan(r1'/r1) and theta2 = theta1 - 2 mu, with r1 = p / (1 - k cos theta1).
    return theta1 - 2 * inclination(theta1)


def inclination(theta1: Array) -> Array:
    return np.arctan2(-K * np.sin(theta1), 1 - K * np.cos(theta1))


def output_encoder(eps: float, phase: float) -> Effect:
    """Eccentric disc: reading = theta + eps sin(theta - phase)."""
    return lambda s: eps * np.sin(s.theta2 - phase)


def output_windup(c_rad_per_nm: float) -> Effect:
    return lambda s: -s.sign * s.load_nm * c_rad_per_nm * np.ones_like(s.theta1)


def input_windup(c_rad_per_nm: float) -> Effect:
    return lambda s: -s.sign * s.load_nm * c_rad_per_nm * s.ratio**2


def backlash(dj_mm: float) -> Effect:
    """Teeth thinned by dj along the pitch curve: odd in the sense."""
    return lambda s: -s.sign * dj_mm / 2 * np.cos(np.radians(20)) / s.arm_mm


def time_skew(dt_s: float) -> Effect:
    """theta2 read dt later than theta1."""
    return lambda s: s.sign * s.speed_rad_per_s * s.ratio * dt_s


def slip(k_rad_per_rev_nm: float) -> Effect:
    """A lag for every revolution under load; of one run only, as one run holds it."""
    return lambda s: -s.sign * k_rad_per_rev_nm * s.load_nm * (s.revolutions - s.revolutions[0])


def recordings(
    effects: Sequence[Effect] = (),
    *,
    plan: Sequence[tuple[str, float, float]] = PLAN,
    revolutions: float = 4.0,
    rate_hz: float = 100.0,
    noise_rad: float = 5e-6,
    zero_rad: float = 0.0,
    seed: int = 2,
) -> list[dict[str, object]]:
    """Keyword arguments of ``gm.Recording``, one dict a run."""
    rng = np.random.default_rng(seed)
    runs: list[dict[str, object]] = []
    start, before = 0.0, 0.0
    for direction, load_nm, speed_rpm in plan:
        sign = 1.0 if direction == "ccw" else -1.0
        speed = 2 * np.pi * speed_rpm / 60
        time = np.arange(0.0, revolutions * 60 / speed_rpm, 1 / rate_hz)
        theta1 = sign * speed * time + 0.3
        mu = inclination(theta1)
        r1 = SEMI_MAJOR_MM * (1 - K * K) / (1 - K * np.cos(theta1))
        r2 = 2 * SEMI_MAJOR_MM - r1
        s = Samples(
            time + start,
            theta1,
            driven(theta1),
            r1 / r2,
            r2 * np.cos(np.radians(20) - sign * mu),
            sign,
            load_nm,
            speed,
            before + speed * time / (2 * np.pi),
        )
        reading = s.theta2 + zero_rad + noise_rad * rng.standard_normal(time.size)
        # What differs from turn to turn, as on a rig: not white over the samples, and without memory.
        turn = np.floor(speed * time / (2 * np.pi)).astype(int)
        once, zero = 0.4 * noise_rad * rng.standard_normal((2, int(revolutions) + 2))
        reading += zero[turn] + once[turn] * np.sin(theta1)
        for effect in effects:
            reading = reading + effect(s)
        runs.append(
            {
                "time_s": s.time_s,
                "theta1_rad": theta1,
                "theta2_rad": reading,
                "load_nm": load_nm,
                "speed_rpm": speed_rpm,
                "direction": direction,
            }
        )
        start += float(time[-1]) + 20.0
        before += revolutions
    return runs


def made(runs: Sequence[dict[str, object]]) -> list[gm.Recording]:
    return [gm.Recording(**run) for run in runs]  # type: ignore[arg-type]


def names(verdict: Sequence[object]) -> list[frozenset[str]]:
    """The verdict without the order of its items."""
    items = [frozenset(v["members"]) if isinstance(v, dict) else frozenset([str(v)]) for v in verdict]
    return sorted(items, key=sorted)


def holds(verdict: Sequence[object], effect: str) -> bool:
    return any(effect in item for item in names(verdict))
