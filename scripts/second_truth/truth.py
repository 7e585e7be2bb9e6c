"""Simulated campaigns of the gear rig with known effects: an independent truth for testing a gap diagnosis.

Everything is computed in the time domain and exactly where a library is first order: tooth contact by Newton on the
supports' equations, discs and couplings by atan2, slip and lost counts as events, the resonance as an oscillator.
Imports numpy and scipy alone, never gearmodel.

    case = make_case(seed, "null" | "single:NAME:URAD" | "single" | "pair" | "triple" | "outside[:NAME[:URAD]]" | "mixed"
                     | "names:NAME:URAD,NAME:URAD,..." )          # names of OUTSIDE kinds may stand in the list
    case.recordings   keyword arguments of gm.Recording (without input_lines/output_lines where the case has none)
    case.pair_kwargs  {"elliptical": {...}, "errors": {...}} for gm.GearPair.elliptical(...).with_errors(gm.Errors(...))
    case.truth        [{"name", "parameters", "rms_rad"}], library effects; case.outside the same for unmodelled ones

Conventions (where the contract leaves a choice): every disc, coupling and interpolation error adds a sin(n theta - phase)
to what stands behind it; coupling amplitude eps = tan^2(beta/2); lost counts are SUBTRACTED from the output's reading
(counts may be negative); gear 1 stands delta ahead of its encoder's reading (phasing_error); compliance effects are the excess over the
documented value; brake torque is T (1 + rho sin(n theta2 - phase)).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter
from scipy.special import ellipe, ellipeinc

TAU = 2.0 * np.pi
MODULE_MM, TEETH, K, ALPHA = 3.0, 47, 0.3287, np.radians(20.0)
E1_MM, PHI1, E2_MM, PHI2 = 0.05, 0.3, 0.03, 1.1
PITCH_MM = np.pi * MODULE_MM
GRID = 1024

LIBRARY = (
    "gear1_eccentricity gear2_eccentricity centre_distance_error backlash_error pitch_curve_error phasing_error "
    "pitch_errors profile_error tooth_damage encoder1_eccentricity encoder2_eccentricity encoder1_ellipticity "
    "encoder2_ellipticity encoder1_interpolation encoder2_interpolation coupling_misalignment_input "
    "coupling_misalignment_output time_skew count_loss shaft_compliance_input shaft_compliance_output mesh_compliance "
    "bearing_compliance mesh_stiffness_variation bearing_clearance friction_windup slip brake_torque_ripple "
    "torsional_resonance thermal_drift wear_drift"
).split()

OUTSIDE = (
    "order3_input order3_output order5_sqrt_load tone knocks subsynchronous one_direction_hysteresis growing_order2 "
    "step_and_back random_walk order7_speed half_mesh_order load_creep"
).split()

# Sets that one campaign cannot tell apart by physics: a group is right when all its members are of one set.
TIED = (
    {"encoder1_eccentricity", "encoder2_eccentricity", "phasing_error", "pitch_curve_error"},
    {"backlash_error", "bearing_clearance"},
    {"mesh_compliance", "bearing_compliance"},
    {"encoder1_ellipticity", "coupling_misalignment_input"},
    {"encoder2_ellipticity", "coupling_misalignment_output"},
)

PLAN = ((0.5, 5.0), (5.0, 5.0), (10.0, 5.0), (15.0, 5.0), (10.0, 2.5), (10.0, 10.0))
REVOLUTIONS = 4.0


# ------------------------------------------------------------------------------------------------ geometry


class Ellipse:
    """Rolling elliptic pair that turns about foci, r1 = p/(1 - k cos theta)."""

    def __init__(self, k: float = K) -> None:
        self.k = k
        self.half_mm = np.pi * MODULE_MM * TEETH / (4.0 * ellipe(k * k))
        self.centre_mm = 2.0 * self.half_mm
        self.p_mm = self.half_mm * (1.0 - k * k)
        root = np.sqrt((1.0 + k) / (1.0 - k))
        self.anomaly_k = (root - 1.0) / (root + 1.0)

    def r1(self, theta):
        return self.p_mm / (1.0 - self.k * np.cos(theta))

    def ratio(self, theta):
        r1 = self.r1(theta)
        return r1 / (self.centre_mm - r1)

    def mu(self, theta):
        return np.arctan2(-self.k * np.sin(theta), 1.0 - self.k * np.cos(theta))

    def f(self, theta):
        return theta - 2.0 * self.mu(theta)

    def arm(self, theta, sign):
        """Driven base arm r2 cos(alpha -+ mu), mm."""
        return (self.centre_mm - self.r1(theta)) * np.cos(ALPHA - sign * self.mu(theta))

    def arc(self, theta):
        q = self.anomaly_k
        anomaly = theta + 2.0 * np.arctan2(q * np.sin(theta), 1.0 - q * np.cos(theta))
        return self.half_mm * (ellipeinc(anomaly - 0.5 * np.pi, self.k**2) + ellipe(self.k**2))


def exact_te(shape: Ellipse, theta, sign, e1, e2, da_mm=0.0):
    """psi2 - f(theta) by Newton: tooth contact of displaced gears; e1, e2 are (x, y) vectors, sign +1 ccw, -1 cw.

    The pair nearest its pitch point is solved: with rigid displacements all pairs in contact agree."""
    sin_a, cos_a = np.sin(ALPHA), np.cos(ALPHA)
    half = 0.0 if sign > 0 else 0.5
    offset = (np.round(shape.arc(theta) / PITCH_MM - half) + half) * PITCH_MM
    beta0 = sign * (0.5 * np.pi - ALPHA)
    z1 = complex(*e1) * np.exp(1j * theta)
    size2, phase2 = np.hypot(*e2), np.arctan2(e2[1], e2[0])
    a = theta.copy()
    b = theta.copy()
    for _ in range(25):
        # Support (distance along the normal) and place along the flank, of gear 1's flank in its own rolling position ...
        mu = shape.mu(a)
        r1 = shape.r1(a)
        den = 1.0 - shape.k * np.cos(a)
        mu_a = (shape.k**2 - shape.k * np.cos(a)) / (den**2 + (shape.k * np.sin(a)) ** 2)
        beta = beta0 + mu
        chi_a, chi_as = beta - a, mu_a - 1.0
        h_a = r1 * np.cos(beta) + sign * (shape.arc(a) - offset) * cos_a
        t_a = -r1 * np.sin(beta)
        t_as = -r1 * (np.tan(mu) * np.sin(beta) + np.cos(beta) * mu_a)
        # ... and of gear 2's in its own.
        mu = shape.mu(b)
        r1 = shape.r1(b)
        r2 = shape.centre_mm - r1
        den = 1.0 - shape.k * np.cos(b)
        mu_b = (shape.k**2 - shape.k * np.cos(b)) / (den**2 + (shape.k * np.sin(b)) ** 2)
        beta = beta0 + mu
        chi_b, chi_bs = beta + shape.f(b), mu_b + r1 / r2
        h_b = -r2 * np.cos(beta) + sign * (shape.arc(b) - offset) * cos_a
        t_b = r2 * np.sin(beta)
        t_bs = -r1 * np.tan(mu) * np.sin(beta) + r2 * np.cos(beta) * mu_b
        normal = chi_a + theta
        psi2 = chi_b - normal
        v = psi2 + phase2
        wx = z1.real - size2 * np.cos(v) - (shape.centre_mm + da_mm)
        wy = z1.imag + size2 * np.sin(v)
        nx, ny = np.cos(normal), np.sin(normal)
        wn, wt = wx * nx + wy * ny, wy * nx - wx * ny
        vx, vy = size2 * np.sin(v), size2 * np.cos(v)
        vn, vt = vx * nx + vy * ny, vy * nx - vx * ny
        gap, slide = h_a - h_b + wn, t_a - t_b + wt
        gap_a, gap_b = chi_as * (t_a + wt - vn), chi_bs * (vn - t_b)
        sl_a, sl_b = t_as - chi_as * (wn + vt), chi_bs * vt - t_bs
        det = gap_a * sl_b - gap_b * sl_a
        da_, db_ = (gap_b * slide - sl_b * gap) / det, (sl_a * gap - gap_a * slide) / det
        a += da_
        b += db_
        if max(np.abs(da_).max(), np.abs(db_).max()) < 1e-8:
            psi2 = psi2 + chi_bs * db_ - chi_as * da_
            break
    return psi2 - shape.f(theta)


class Table:
    """A periodic function of an angle by 4-point Lagrange interpolation."""

    def __init__(self, values) -> None:
        self.v = np.asarray(values)

    def __call__(self, theta):
        n = len(self.v)
        x = np.asarray(theta) * (n / TAU)
        j = np.floor(x).astype(np.int64)
        s = x - j
        p = [self.v[(j + d) % n] for d in (-1, 0, 1, 2)]
        return (
            p[0] * (-s * (s - 1) * (s - 2) / 6)
            + p[1] * ((s + 1) * (s - 1) * (s - 2) / 2)
            + p[2] * (-(s + 1) * s * (s - 2) / 2)
            + p[3] * ((s + 1) * s * (s - 1) / 6)
        )


GRID_THETA = TAU * np.arange(GRID) / GRID
BASE = Ellipse()
_ARC_REST = Table(BASE.arc(GRID_THETA) - GRID_THETA * (TEETH * PITCH_MM / TAU))


def pitches(theta):
    """Arc length in pitches since theta = 0."""
    return np.asarray(theta) * (TEETH / TAU) + _ARC_REST(theta) / PITCH_MM


_TABLES: dict = {}


def te_table(sign, k, e1, e2, da):
    key = (sign, k, tuple(e1), tuple(e2), da)
    if key not in _TABLES:
        if len(_TABLES) > 200:
            _TABLES.clear()
        _TABLES[key] = Table(exact_te(Ellipse(k), GRID_THETA, sign, e1, e2, da))
    return _TABLES[key]


def reach_pitches(theta):
    """Half length of the contact zone in pitches of rolling, from the tips: x sin a + (x cos a)^2/(2 rho) = m."""
    rho = BASE.p_mm / np.cos(BASE.mu(theta)) ** 3
    sa, ca = np.sin(ALPHA), np.cos(ALPHA)
    x = (np.sqrt(sa * sa + 2.0 * MODULE_MM * ca * ca / rho) - sa) * rho / (ca * ca)
    return x / ca / PITCH_MM


REACH = Table(reach_pitches(GRID_THETA))
SINGLE_DUTY = float(np.average(2.0 - 2.0 * reach_pitches(GRID_THETA), weights=BASE.r1(GRID_THETA) / np.cos(BASE.mu(GRID_THETA))))


def distorted(theta, eps, w):
    """Exact reading of a disc displaced (w once a turn) or squeezed (twice), and Cardan's formula with eps = tan^2(beta/2)."""
    return theta + np.arctan2(eps * np.sin(w), 1.0 - eps * np.cos(w))


# ------------------------------------------------------------------------------------------------ the campaign


@dataclass
class Run:
    direction: str
    sign: float
    load: float
    speed: float
    t0: float  # clock time of the first sample
    t: np.ndarray  # clock times
    start: float
    omega: float
    ripple: tuple
    rev_before: float  # driver revolutions turned before
    wear_before: float  # revolutions x load before
    scatter: np.ndarray  # (revolutions + 1, orders) complex
    offset: float

    def turned(self, t):
        """Driver angle turned since the run's start, rad: constant speed with a 0.3 % ripple."""
        x = t - self.t0
        y = x.copy()
        for a, w, p in self.ripple:
            y += a / w * (np.sin(w * x + p) - np.sin(p))
        return self.omega * y


@dataclass
class World:
    seed: int
    rng_noise: np.random.Generator
    runs: list
    rate: float
    begin: float
    end: float
    lines: tuple
    counts: tuple
    give_lines: bool
    white: float
    compliance: dict
    total_rev: float = 0.0


def make_world(seed: int) -> World:
    rng = np.random.default_rng([seed, 1])
    ccw_first = [("ccw", load, speed) for load, speed in PLAN] + [("cw", load, speed) for load, speed in PLAN]
    alternate = [(d, load, speed) for load, speed in PLAN for d in ("ccw", "cw")]
    order = ccw_first if rng.random() < 0.3 else alternate
    moving = sum(REVOLUTIONS * 60.0 / speed for _, _, speed in order)
    rate = float(np.exp(rng.uniform(np.log(5.5e4), np.log(2.2e5))) / moving)
    white = rng.uniform(5e-6, 15e-6)
    rev_sigma, run_sigma = rng.uniform(2.5e-6, 13e-6), rng.uniform(0.3e-6, 3e-6)
    offset_sigma = rng.uniform(0.3e-6, 4e-6)
    orders = np.arange(7)
    shape = 1.0 / (1.0 + orders) ** rng.uniform(0.6, 1.6)
    shape /= np.sqrt(np.sum(shape**2))
    t = rng.uniform(0.0, 60.0)
    begin = t
    here = rng.uniform(-0.4, 0.4)
    runs, revs, wear = [], 0.0, 0.0
    for direction, load, speed in order:
        sign = 1.0 if direction == "ccw" else -1.0
        omega = TAU * speed / 60.0
        length = REVOLUTIONS * 60.0 / speed + rng.uniform(0.1, 0.5)
        n = int(length * rate)
        freqs = rng.uniform(0.05, 1.2, 4)
        ripple = tuple((0.003 * np.sqrt(2.0 / 4), TAU * f, rng.uniform(0, TAU)) for f in freqs)
        full = int(np.ceil(REVOLUTIONS)) + 2
        draw = lambda s, m: s * shape * (rng.normal(size=(m, 7)) + 1j * rng.normal(size=(m, 7)))  # noqa: E731
        scatter = draw(rev_sigma, full) + draw(run_sigma, 1)
        start = here
        run = Run(direction, sign, load, speed, t, t + (np.arange(n) + rng.uniform(0, 1)) / rate, start, omega, ripple, revs,
                  wear, scatter, rng.normal() * offset_sigma)
        turned = float(run.turned(run.t[-1:])[0])
        # The next run starts near where this one stopped; ccw-first campaigns drive on.
        here = start + sign * turned + rng.uniform(-0.3, 0.3)
        revs += turned / TAU
        wear += turned / TAU * load
        t = run.t[-1] + rng.uniform(3.0, 15.0)
        runs.append(run)
    lines = [int(rng.choice([18000, 9000, 5000, 3600, 2500, 1024])) for _ in range(2)]
    counts = [int(v * rng.choice([400, 400, 1000, 200])) for v in lines]
    counts = [max(c, 720_000) for c in counts]
    counts = [int(np.ceil(c / v) * v) for c, v in zip(counts, lines)]
    documented = rng.random() < 0.85
    compliance = {
        "shaft_compliance_output_rad_per_nm": documented * float(rng.uniform(0.8e-5, 3e-5)),
        "shaft_compliance_input_rad_per_nm": documented * float(rng.uniform(0.3e-5, 1.5e-5)),
        "mesh_compliance_mm2_rad_per_nm": documented * float(rng.uniform(0.005, 0.03)),
    }
    return World(seed, np.random.default_rng([seed, 9]), runs, rate, begin, t, tuple(lines), tuple(counts),
                 rng.random() < 0.85, white, compliance, revs)


# ------------------------------------------------------------------------------------------------ effects


def draw_effect(name: str, world: World, rng) -> dict:
    """Shape parameters and a starting size; keys with a leading underscore belong to the generator."""
    phase = float(rng.uniform(0, TAU))
    sense = float(rng.choice([-1.0, 1.0]))
    if name in ("gear1_eccentricity", "gear2_eccentricity"):
        return {"dx_mm": 0.004 * np.cos(phase), "dy_mm": 0.004 * np.sin(phase)}
    if name == "centre_distance_error":
        return {"da_mm": 0.01 * sense}
    if name == "backlash_error":
        return {"dj_mm": 0.004 * (1.0 if rng.random() < 0.7 else -1.0)}
    if name == "pitch_curve_error":
        return {"dk": 1e-5 * sense}
    if name == "phasing_error":
        return {"delta_rad": 5e-5 * sense}
    if name == "pitch_errors":
        common, ccw, cw = rng.normal(size=(3, TEETH))
        mix = rng.uniform(0.0, 1.0)
        ccw, cw = mix * common + (1 - mix) * ccw, mix * common + (1 - mix) * cw
        return {"ccw_mm": 0.002 * (ccw - ccw.mean()), "cw_mm": 0.002 * (cw - cw.mean())}
    if name == "profile_error":
        out = {}
        for n, size in zip((1, 2, 3), (1.0, rng.uniform(0, 0.5), rng.uniform(0, 0.3))):
            out[f"a{n}_mm"], out[f"ph{n}_rad"] = 0.002 * size, float(rng.uniform(0, TAU))
        return out
    if name == "tooth_damage":
        return {"tooth": int(rng.integers(TEETH)), "depth_mm": 0.02, "width": float(rng.uniform(0.3, 0.9)),
                "flank": str(rng.choice(["ccw", "cw"]))}
    if name in ("encoder1_eccentricity", "encoder2_eccentricity", "encoder1_ellipticity", "encoder2_ellipticity"):
        return {"eps": 3e-5, "phase_rad": phase}
    if name in ("encoder1_interpolation", "encoder2_interpolation"):
        return {"a_rad": 1e-5, "lines": world.lines[0 if "1" in name else 1], "phase_rad": phase,
                "_second": float(rng.uniform(0, 0.35)), "_phase2": float(rng.uniform(0, TAU))}
    if name in ("coupling_misalignment_input", "coupling_misalignment_output"):
        return {"beta_rad": 0.01, "phase_rad": phase}
    if name == "time_skew":
        return {"dt_s": 5e-5 * sense}
    if name == "count_loss":
        n = int(rng.integers(4, 30))
        return {"counts": int(sense), "steps": n, "per_rev": n / world.total_rev,
                "_at": rng.uniform(0, world.total_rev, n)}
    if name in ("shaft_compliance_input", "shaft_compliance_output"):
        return {"c_rad_per_nm": 1e-6}
    if name == "mesh_compliance":
        return {"c_mm2_rad_per_nm": 0.01}
    if name == "bearing_compliance":
        return {"c_mm_per_n": 1e-5}
    if name == "mesh_stiffness_variation":
        return {"c_mm2_rad_per_nm": 0.01, "duty": SINGLE_DUTY}
    if name == "bearing_clearance":
        return {"c_mm": 0.003}
    if name == "friction_windup":
        return {"torque_nm": 0.3}
    if name == "slip":
        per_rev = rng.uniform(15, 50)
        gaps = rng.gamma(10.0, 0.1 / per_rev, int(world.total_rev * per_rev * 1.5))
        at = np.cumsum(gaps)
        return {"k_rad_per_rev_nm": 1e-6, "t0_nm": float(rng.uniform(0.5, 8.0)),
                "_at": at[at < world.total_rev], "_per_rev": per_rev}
    if name == "brake_torque_ripple":
        return {"rho": 0.02, "n": int(rng.integers(1, 9)), "phase_rad": phase}
    if name == "torsional_resonance":
        return {"f_hz": float(rng.uniform(3.0, 11.0)), "zeta": float(rng.uniform(0.02, 0.08)), "_a_rad": 3e-6,
                "_phase": phase}
    if name == "thermal_drift":
        return {"da_mm": 0.01 * sense, "tau_s": float(rng.uniform(60.0, 350.0))}
    if name == "wear_drift":
        return {"dj_mm_per_rev_nm": 1e-5}
    # Outside the library.
    if name == "tone":
        return {"_a": 1e-5, "f_hz": float(np.exp(rng.uniform(np.log(0.35), np.log(min(20.0, 0.4 * world.rate))))), "_p": phase}
    if name == "knocks":
        n = int(world.total_rev * rng.uniform(0.7, 2.5))
        return {"_a": 1e-5, "_at": np.sort(rng.uniform(world.begin, world.end, 2 * n)),
                "_size": rng.lognormal(0, 0.4, 2 * n) * rng.choice([-1, 1], 2 * n), "_tau": float(rng.uniform(0.08, 0.4)),
                "_f": float(rng.uniform(1.5, 8.0))}
    if name == "subsynchronous":
        return {"_a": 1e-5, "order": float(rng.choice([0.38, 0.43, 0.47, 0.61])), "_p": phase}
    if name == "step_and_back":
        a, b = np.sort(rng.uniform(0.1, 0.9, 2))
        b = max(b, a + 0.15)
        return {"_a": 1e-5 * sense, "_from": world.begin + a * (world.end - world.begin),
                "_to": world.begin + b * (world.end - world.begin)}
    if name == "random_walk":
        n = 4000
        walk = np.cumsum(rng.normal(size=n))
        return {"_a": 1e-5, "_walk": walk / np.std(walk)}
    if name == "load_creep":
        return {"_a": 1e-5 * sense, "_tau": float(rng.uniform(4.0, 12.0))}
    if name == "one_direction_hysteresis":
        return {"_a": 1e-5, "_p": phase, "_sign": sense}
    if name in OUTSIDE:
        return {"_a": 1e-5, "_p": phase}
    raise ValueError(f"unknown effect {name!r}")


AMPLITUDES = {
    "gear1_eccentricity": ("dx_mm", "dy_mm"), "gear2_eccentricity": ("dx_mm", "dy_mm"), "centre_distance_error": ("da_mm",),
    "backlash_error": ("dj_mm",), "pitch_curve_error": ("dk",), "phasing_error": ("delta_rad",),
    "pitch_errors": ("ccw_mm", "cw_mm"), "profile_error": ("a1_mm", "a2_mm", "a3_mm"), "tooth_damage": ("depth_mm",),
    "encoder1_eccentricity": ("eps",), "encoder2_eccentricity": ("eps",), "encoder1_ellipticity": ("eps",),
    "encoder2_ellipticity": ("eps",), "encoder1_interpolation": ("a_rad",), "encoder2_interpolation": ("a_rad",),
    "time_skew": ("dt_s",), "shaft_compliance_input": ("c_rad_per_nm",), "shaft_compliance_output": ("c_rad_per_nm",),
    "mesh_compliance": ("c_mm2_rad_per_nm",), "bearing_compliance": ("c_mm_per_n",),
    "mesh_stiffness_variation": ("c_mm2_rad_per_nm",), "bearing_clearance": ("c_mm",), "friction_windup": ("torque_nm",),
    "slip": ("k_rad_per_rev_nm",), "brake_torque_ripple": ("rho",), "torsional_resonance": ("_a_rad",),
    "thermal_drift": ("da_mm",), "wear_drift": ("dj_mm_per_rev_nm",),
}


def scaled(name: str, p: dict, factor: float) -> dict:
    p = dict(p)
    if name.startswith("coupling"):
        p["beta_rad"] *= np.sqrt(factor)
    elif name == "count_loss":
        p["counts"] = int(np.sign(p["counts"]) * max(1, round(abs(p["counts"]) * factor)))
    else:
        for key in AMPLITUDES.get(name, ("_a",)):
            p[key] = p[key] * factor
    return p


def outside_trace(name, p, run, world, theta1, theta2, t):
    a = p["_a"]
    if name == "order3_input":
        return a * np.sin(3 * theta1 + p["_p"])
    if name == "order3_output":
        return a * np.sin(3 * theta2 + p["_p"])
    if name == "order5_sqrt_load":
        return a * np.sqrt(run.load / 10.0) * run.sign * np.sin(5 * theta2 + p["_p"])
    if name == "tone":
        return a * np.sin(TAU * p["f_hz"] * t + p["_p"])
    if name == "knocks":
        out = np.zeros_like(t)
        for at, size in zip(p["_at"], p["_size"]):
            lo, hi = np.searchsorted(t, [at, at + 8 * p["_tau"]])
            x = t[lo:hi] - at
            out[lo:hi] += size * np.exp(-x / p["_tau"]) * np.cos(TAU * p["_f"] * x)
        return a * out
    if name == "subsynchronous":
        return a * np.sin(p["order"] * theta1 + p["_p"])
    if name == "one_direction_hysteresis":
        return a * (run.sign == p["_sign"]) * np.tanh(3 * np.sin(2 * theta1 + p["_p"]))
    if name == "growing_order2":
        return a * (t - world.begin) / (world.end - world.begin) * np.sin(2 * theta2 + p["_p"])
    if name == "step_and_back":
        return a * ((t > p["_from"]) & (t < p["_to"]))
    if name == "random_walk":
        return a * np.interp(t, np.linspace(world.begin, world.end, len(p["_walk"])), p["_walk"])
    if name == "order7_speed":
        return a * (run.speed / 5.0) ** 2 * np.sin(7 * theta1 + p["_p"])
    if name == "half_mesh_order":
        return a * np.sin(np.pi * pitches(theta1) + p["_p"])
    if name == "load_creep":
        return a * run.sign * run.load / 10.0 * np.exp(-(t - run.t0) / p["_tau"])
    raise ValueError(name)


def resonance(p, run, gear1_at, t):
    """x'' + 2 zeta w x' + w^2 x = w^2 e + 2 zeta w e': e a wave of mesh order 1, from 8 s before the run on; 500 Hz trapezoid."""
    h = 1.0 / 500.0
    grid = np.arange(run.t0 - 8.0, t[-1] + 3 * h, h)
    w, z = TAU * p["f_hz"], p["zeta"]
    half = 0.0 if run.sign > 0 else 0.5
    e = p["_a_rad"] * np.cos(TAU * (pitches(gear1_at(grid)) - half) - p["_phase"])
    # Bilinear transform warped to be exact at the resonance.
    c = w / np.tan(0.5 * w * h)
    b = np.array([2 * z * w * c + w * w, 2 * w * w, w * w - 2 * z * w * c])
    a = np.array([c * c + 2 * z * w * c + w * w, 2 * w * w - 2 * c * c, c * c - 2 * z * w * c + w * w])
    return np.interp(t, grid, lfilter(b / a[0], a / a[0], e))


def events(turned_rev, at, size):
    """Sum of the sizes of events that lie at or before a place."""
    return np.concatenate([[0.0], np.cumsum(size)])[np.searchsorted(at, turned_rev, side="right")]


def readings(world: World, effects: dict, scatter: bool = False):
    """(theta1, theta2) as both encoders show them, run by run, without white noise and counting."""
    out = []
    get = effects.get
    e1 = np.array([E1_MM * np.cos(PHI1), E1_MM * np.sin(PHI1)])
    e2 = np.array([E2_MM * np.cos(PHI2), E2_MM * np.sin(PHI2)])
    if p := get("gear1_eccentricity"):
        e1 = e1 + (p["dx_mm"], p["dy_mm"])
    if p := get("gear2_eccentricity"):
        e2 = e2 + (p["dx_mm"], p["dy_mm"])
    da = get("centre_distance_error", {}).get("da_mm", 0.0)
    k = K + get("pitch_curve_error", {}).get("dk", 0.0)
    shape = Ellipse(k)
    c_out = world.compliance["shaft_compliance_output_rad_per_nm"]
    c_in = world.compliance["shaft_compliance_input_rad_per_nm"]
    c_mesh = world.compliance["mesh_compliance_mm2_rad_per_nm"]
    c_out += get("shaft_compliance_output", {}).get("c_rad_per_nm", 0.0)
    c_in += get("shaft_compliance_input", {}).get("c_rad_per_nm", 0.0)
    c_mesh += get("mesh_compliance", {}).get("c_mm2_rad_per_nm", 0.0)
    c_mesh += 1000.0 * get("bearing_compliance", {}).get("c_mm_per_n", 0.0)
    drag = get("friction_windup", {}).get("torque_nm", 0.0)
    dt = get("time_skew", {}).get("dt_s", 0.0)

    if p := get("slip"):
        run_of = np.searchsorted([r.rev_before for r in world.runs], p["_at"], side="right") - 1
        slip_size = np.array([world.runs[i].sign * max(0.0, world.runs[i].load - p["t0_nm"]) for i in run_of])
        slip_size = slip_size * p["k_rad_per_rev_nm"] / p["_per_rev"]
    for run in world.runs:
        sign = run.sign
        theta1 = run.start + sign * run.turned(run.t)
        t = run.t + dt
        turned = run.turned(t)
        shaft = run.start + sign * turned
        revs = run.rev_before + turned / TAU

        def gear1_at(when):
            g = run.start + sign * run.turned(when)
            if p := get("coupling_misalignment_input"):
                g = distorted(g, np.tan(0.5 * p["beta_rad"]) ** 2, 2 * g - p["phase_rad"])
            return g + get("phasing_error", {}).get("delta_rad", 0.0)

        g = gear1_at(t)
        torque = np.full_like(t, run.load)
        if p := get("brake_torque_ripple"):
            torque = torque * (1.0 + p["rho"] * np.sin(p["n"] * BASE.f(g) - p["phase_rad"]))
        torque = torque + drag
        ratio = BASE.ratio(g)
        g = g - sign * c_in * torque * ratio
        arm = BASE.arm(g, sign)
        te = te_table(sign, k, e1, e2, da)(g)
        if p := get("thermal_drift"):
            w = 1.0 - np.exp(-(t - world.runs[0].t[0]) / p["tau_s"])
            hot = te_table(sign, k, e1, e2, da + p["da_mm"])(g)
            te = te + w * (hot - te)
        theta2 = shape.f(g) + te
        # Leads along the common normal, mm, + = driven gear ahead.
        lead = np.zeros_like(t)
        thinning = get("backlash_error", {}).get("dj_mm", 0.0)
        if p := get("wear_drift"):
            thinning = thinning + p["dj_mm_per_rev_nm"] * (run.wear_before + turned / TAU * run.load)
        lead -= sign * 0.5 * thinning * np.cos(ALPHA)
        lead -= sign * get("bearing_clearance", {}).get("c_mm", 0.0)
        phase = pitches(g) - (0.0 if sign > 0 else 0.5)
        if p := get("profile_error"):
            for n in (1, 2, 3):
                lead += p[f"a{n}_mm"] * np.sin(TAU * n * phase - p[f"ph{n}_rad"])
        if p := get("pitch_errors"):
            table = p["ccw_mm"] if sign > 0 else p["cw_mm"]
            near = np.floor(phase).astype(np.int64)
            reach = REACH(g)
            best = np.full_like(t, -np.inf)
            for j in (near - 1, near, near + 1, near + 2):
                touching = np.abs(phase - j) <= reach
                best = np.where(touching, np.maximum(best, sign * table[j % TEETH]), best)
            lead += sign * best
        if p := get("tooth_damage"):
            if p["flank"] == run.direction:
                u = (phase - p["tooth"] + 0.5 * TEETH) % TEETH - 0.5 * TEETH
                lead -= sign * p["depth_mm"] * np.where(np.abs(u) < p["width"], np.cos(0.5 * np.pi * u / p["width"]) ** 2, 0.0)
        theta2 = theta2 + lead / arm
        compliance = np.full_like(t, c_mesh)
        if p := get("mesh_stiffness_variation"):
            # One pair carries while the next ones are past the tips: softer. Zero mean over a pitch.
            u = (phase + 0.5) % 1.0 - 0.5
            alone = np.abs(u) < 1.0 - REACH(g)
            compliance = compliance + p["c_mm2_rad_per_nm"] * (alone - 2.0 * (1.0 - REACH(g)))
        theta2 = theta2 - sign * torque * (c_out + compliance / arm**2)
        if get("torsional_resonance"):
            theta2 = theta2 + resonance(get("torsional_resonance"), run, gear1_at, t)
        for name in OUTSIDE:
            if p := get(name):
                theta2 = theta2 + outside_trace(name, p, run, world, shaft, theta2, t)
        if p := get("coupling_misalignment_output"):
            theta2 = distorted(theta2, np.tan(0.5 * p["beta_rad"]) ** 2, 2 * theta2 - p["phase_rad"])
        if p := get("slip"):
            theta2 = theta2 - events(revs, p["_at"], slip_size)
        if scatter:
            # Coefficients per revolution, passed on smoothly over a tenth of a turn.
            at = turned / TAU
            which = np.clip(np.floor(at).astype(int), 0, len(run.scatter) - 2)
            x = np.clip((at - which - 0.9) / 0.1, 0.0, 1.0)
            blend = x * x * (3 - 2 * x)
            rise = np.zeros_like(t)
            for n in range(run.scatter.shape[1]):
                c = run.scatter[which, n] * (1 - blend) + run.scatter[which + 1, n] * blend
                rise += (c * np.exp(-1j * n * shaft)).real
            theta2 = theta2 + rise + run.offset
        for enc in (1, 2):
            theta = theta1 if enc == 1 else theta2
            read = theta
            if p := get(f"encoder{enc}_eccentricity"):
                read = distorted(read, p["eps"], theta - p["phase_rad"])
            if p := get(f"encoder{enc}_ellipticity"):
                read = distorted(read, p["eps"], 2 * theta - p["phase_rad"])
            if p := get(f"encoder{enc}_interpolation"):
                w = p["lines"] * theta
                read = read + p["a_rad"] * (np.sin(w - p["phase_rad"]) + p["_second"] * np.sin(2 * w - p["_phase2"]))
            if enc == 1:
                theta1 = read
            else:
                theta2 = read
        if p := get("count_loss"):
            at = np.sort(p["_at"])
            theta2 = theta2 - TAU / world.counts[1] * p["counts"] * np.searchsorted(at, revs, side="right")
        out.append((theta1, theta2))
    return out


def te_of(pairs):
    return np.concatenate([b - BASE.f(a) for a, b in pairs])


def trace(world, name, p, others=None):
    """What one effect adds to TE, all runs one after the other, rad."""
    others = others or {}
    return te_of(readings(world, {**others, name: p})) - te_of(readings(world, others))


def sized(world: World, name: str, rms_rad: float, rng) -> tuple:
    """An effect drawn and scaled to an RMS of its trace without its mean."""
    p = draw_effect(name, world, rng)
    if name.endswith("_interpolation"):
        # A reading must rise with the angle: the slope a L stays under 0.6. Coarser discs for larger errors.
        enc = 0 if "1" in name else 1
        slope_limit = 0.6 / (rms_rad * 1.45 * (1.9 if enc == 0 else 1.0))
        if world.lines[enc] > slope_limit:
            fits = [v for v in (18000, 9000, 5000, 3600, 2500, 2048, 1024) if v <= slope_limit] or [1024]
            lines = list(world.lines)
            counts = list(world.counts)
            lines[enc] = fits[0]
            counts[enc] = int(np.ceil(max(720_000, fits[0] * 400) / fits[0]) * fits[0])
            world.lines, world.counts = tuple(lines), tuple(counts)
            p["lines"] = fits[0]
    if name == "count_loss":
        unit = trace(world, name, p)
        while np.std(unit) > 1.3 * rms_rad and p["steps"] > 1:
            keep = max(1, int(p["steps"] * 0.7))
            p["_at"] = p["_at"][:keep]
            p["steps"], p["per_rev"] = keep, keep / world.total_rev
            unit = trace(world, name, p)
        p = scaled(name, p, rms_rad / np.std(unit))
        return p, float(np.std(trace(world, name, p)))
    for _ in range(3):
        now = float(np.std(trace(world, name, p)))
        if abs(now / rms_rad - 1.0) < 1e-3:
            break
        p = scaled(name, p, rms_rad / now)
    return p, float(np.std(trace(world, name, p)))


@dataclass
class Case:
    seed: int
    kind: str
    recordings: list
    pair_kwargs: dict
    truth: list
    outside: list
    floor_rad: float
    parts: dict = field(default_factory=dict)

    @property
    def names(self):
        return [e["name"] for e in self.truth]

    @property
    def size_urad(self):
        return min((1e6 * e["rms_rad"] for e in self.truth + self.outside), default=0.0)


def _tied(a, b):
    return a == b or any(a in s and b in s for s in TIED)


def choose(kind: str, rng) -> list:
    """[(name, rms_rad)] of a kind."""
    head, _, rest = kind.partition(":")
    urad = lambda lo, hi: float(np.exp(rng.uniform(np.log(lo), np.log(hi)))) * 1e-6  # noqa: E731
    if head == "null":
        return []
    if head == "names":
        return [(n, float(s) * 1e-6) for n, s in (item.split(":") for item in rest.split(","))]
    if head in ("single", "outside"):
        name, _, size = rest.partition(":")
        pool = LIBRARY if head == "single" else OUTSIDE
        name = name or str(rng.choice(pool))
        if name not in pool:
            raise ValueError(f"{name!r} is none of {pool}")
        if size:
            return [(name, float(size) * 1e-6)]
        return [(name, float(rng.choice([3, 10, 30, 100])) * 1e-6 if head == "single" else urad(15, 100))]
    if head in ("pair", "triple"):
        picked = []
        while len(picked) < (2 if head == "pair" else 3):
            name = str(rng.choice(LIBRARY))
            if not any(_tied(name, other) for other in picked):
                picked.append(name)
        return [(n, urad(15, 100)) for n in picked]
    if head == "mixed":
        return [(str(rng.choice(LIBRARY)), urad(20, 100)), (str(rng.choice(OUTSIDE)), urad(20, 100))]
    raise ValueError(f"unknown kind {kind!r}: null, single, pair, triple, outside, mixed or names")


NEEDS_COMPLIANCE = {"friction_windup", "brake_torque_ripple"}


def make_case(seed: int, kind: str = "null") -> Case:
    """One campaign; the same seed and kind give the same samples."""
    world = make_world(seed)
    rng = np.random.default_rng([seed, 2])
    wanted = choose(kind, rng)
    if NEEDS_COMPLIANCE & {n for n, _ in wanted} and not world.compliance["shaft_compliance_output_rad_per_nm"]:
        world.compliance = {"shaft_compliance_output_rad_per_nm": 2e-5, "shaft_compliance_input_rad_per_nm": 0.8e-5,
                            "mesh_compliance_mm2_rad_per_nm": 0.012}
    effects, sizes = {}, {}
    for name, rms in wanted:
        effects[name], sizes[name] = sized(world, name, rms, rng)
    clean = readings(world, effects)
    dirty = readings(world, effects, scatter=True)
    noise = world.rng_noise
    records, error = [], []
    # The counters' zeros: arbitrary, but within a fraction of a turn (the index has been found), and one zero a campaign.
    zero2 = noise.normal() * 2e-4
    for run, (_, _), (a, b) in zip(world.runs, clean, dirty):
        n = len(a)
        step1, step2 = TAU / world.counts[0], TAU / world.counts[1]
        a = np.round((a + 0.4 * world.white * noise.normal(size=n)) / step1) * step1
        b = np.round((b + zero2 + 0.8 * world.white * noise.normal(size=n)) / step2) * step2
        record = {"time_s": run.t.copy(), "theta1_rad": a, "theta2_rad": b, "load_nm": run.load, "speed_rpm": run.speed,
                  "direction": run.direction, "input_lines": world.lines[0], "output_lines": world.lines[1]}
        if not world.give_lines:
            record["input_lines"] = record["output_lines"] = None
        records.append(record)
    measured = np.concatenate([r["theta2_rad"] - BASE.f(r["theta1_rad"]) for r in records])
    error = measured - te_of(clean)
    entry = lambda n: {"name": n, "parameters": {k: (v.tolist() if isinstance(v, np.ndarray) else v)  # noqa: E731
                                                  for k, v in effects[n].items() if not k.startswith("_")},
                       "rms_rad": sizes[n]}
    return Case(
        seed=seed, kind=kind, recordings=records,
        pair_kwargs={
            "elliptical": {"module_mm": MODULE_MM, "teeth": TEETH, "eccentricity": K, "pressure_angle_deg": 20.0},
            "errors": {"e1_mm": E1_MM, "phi1_rad": PHI1, "e2_mm": E2_MM, "phi2_rad": PHI2, **world.compliance},
        },
        truth=[entry(n) for n in effects if n in LIBRARY], outside=[entry(n) for n in effects if n in OUTSIDE],
        floor_rad=float(np.std(error)),
        parts={"samples": len(measured), "white_rad": world.white, "rate_hz": world.rate, "counts": world.counts,
               "lines": world.lines},
    )


if __name__ == "__main__":
    import argparse
    import time

    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--kind", default="pair")
    options = arguments.parse_args()
    began = time.perf_counter()
    case = make_case(options.seed, options.kind)
    print(f"{case.kind}: {case.parts}, floor {case.floor_rad * 1e6:.1f} urad, {time.perf_counter() - began:.2f} s")
    for item in case.truth + case.outside:
        print(f"  {item['name']} {item['rms_rad'] * 1e6:.1f} urad {item['parameters']}")
