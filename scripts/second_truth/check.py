"""Compare every effect's trace with the first-order formulas of the theory (written out again here), signs included."""
import numpy as np
import truth as T

w = T.make_world(5)
a = T.ALPHA
bad = 0
for name in T.LIBRARY:
    rng = np.random.default_rng(3)
    p, rms = T.sized(w, name, 30e-6, rng)
    pairs = T.readings(w, {})
    with_ = T.readings(w, {name: p})
    got, want = [], []
    for i, (run, (t1, t2), (u1, u2)) in enumerate(zip(w.runs, pairs, with_)):
        s = run.sign
        got.append((u2 - T.BASE.f(u1)) - (t2 - T.BASE.f(t1)))
        k, A2 = 0.3287, 144.999717319
        r1 = A2 / 2 * (1 - k * k) / (1 - k * np.cos(t1)); r2 = A2 - r1; i21 = r1 / r2
        mu = np.arctan2(-k * np.sin(t1), 1 - k * np.cos(t1)); th2 = t1 - 2 * mu
        arm = r2 * np.cos(a - s * mu); T_ = run.load
        ph = p.get("phase_rad", 0)
        cin, cout, cm = (w.compliance[f"{n}"] for n in ("shaft_compliance_input_rad_per_nm", "shaft_compliance_output_rad_per_nm", "mesh_compliance_mm2_rad_per_nm"))
        chain = cout + cin * i21**2 + cm / arm**2
        rev = run.rev_before + np.abs(t1 - run.start) / T.TAU
        one = np.ones_like(t1)
        u = T.pitches(t1) - (0 if s > 0 else 0.5)
        if name == "gear1_eccentricity":
            g = np.hypot(p["dx_mm"], p["dy_mm"]); f1 = np.arctan2(p["dy_mm"], p["dx_mm"])
            x = g * np.sin(t1 + f1 + (a - mu)) / arm if s > 0 else g * np.sin(t1 + f1 - (a + mu)) / arm
        elif name == "gear2_eccentricity":
            g = np.hypot(p["dx_mm"], p["dy_mm"]); f1 = np.arctan2(p["dy_mm"], p["dx_mm"])
            x = g * np.sin(th2 + f1 - (a - mu)) / arm if s > 0 else g * np.sin(th2 + f1 + (a + mu)) / arm
        elif name == "centre_distance_error": x = -s * p["da_mm"] * np.tan(a - s * mu) / r2
        elif name == "backlash_error": x = -s * p["dj_mm"] / 2 * np.cos(a) / arm
        elif name == "pitch_curve_error":
            x = 2 * np.sin(t1) / (1 - 2 * k * np.cos(t1) + k * k) * p["dk"]
        elif name == "phasing_error": x = i21 * p["delta_rad"]
        elif name == "encoder1_eccentricity": x = -i21 * p["eps"] * np.sin(t1 - ph)
        elif name == "encoder2_eccentricity": x = p["eps"] * np.sin(th2 - ph)
        elif name == "encoder1_ellipticity": x = -i21 * p["eps"] * np.sin(2 * t1 - ph)
        elif name == "encoder2_ellipticity": x = p["eps"] * np.sin(2 * th2 - ph)
        elif name == "encoder1_interpolation": x = -i21 * (p["a_rad"] * np.sin(p["lines"] * t1 - ph) + p["a_rad"] * p["_second"] * np.sin(2 * p["lines"] * t1 - p["_phase2"]))
        elif name == "encoder2_interpolation": x = p["a_rad"] * np.sin(p["lines"] * t2 - ph) + p["a_rad"] * p["_second"] * np.sin(2 * p["lines"] * t2 - p["_phase2"])
        elif name == "coupling_misalignment_input": x = i21 * p["beta_rad"]**2 / 4 * np.sin(2 * t1 - ph)
        elif name == "coupling_misalignment_output": x = p["beta_rad"]**2 / 4 * np.sin(2 * th2 - ph)
        elif name == "time_skew": x = p["dt_s"] * s * i21 * run.omega
        elif name == "count_loss": x = -p["counts"] * T.TAU / w.counts[1] * np.searchsorted(np.sort(p["_at"]), rev)
        elif name == "shaft_compliance_input": x = -s * T_ * p["c_rad_per_nm"] * i21**2
        elif name == "shaft_compliance_output": x = -s * T_ * p["c_rad_per_nm"] * one
        elif name == "mesh_compliance": x = -s * T_ * p["c_mm2_rad_per_nm"] / arm**2
        elif name == "bearing_compliance": x = -s * T_ * 1000 * p["c_mm_per_n"] / arm**2
        elif name == "bearing_clearance": x = -s * p["c_mm"] / arm
        elif name == "friction_windup": x = -s * p["torque_nm"] * chain
        elif name == "brake_torque_ripple": x = -s * T_ * p["rho"] * np.sin(p["n"] * th2 - ph) * chain
        elif name == "thermal_drift":
            x = -s * p["da_mm"] * (1 - np.exp(-(run.t - w.runs[0].t[0]) / p["tau_s"])) * np.tan(a - s * mu) / r2
        elif name == "wear_drift":
            x = -s * p["dj_mm_per_rev_nm"] * (run.wear_before + (rev - run.rev_before) * T_) / 2 * np.cos(a) / arm
        elif name == "profile_error": x = sum(p[f"a{n}_mm"] * np.cos(T.TAU * n * u - p[f"ph{n}_rad"]) for n in (1, 2, 3)) / arm
        elif name == "tooth_damage":
            d = (u - p["tooth"] + 23.5) % 47 - 23.5
            x = -s * p["depth_mm"] * np.where(abs(d) < p["width"], np.cos(np.pi * d / 2 / p["width"])**2, 0) / arm * (p["flank"] == run.direction)
        elif name == "slip":  # mean lag, growing with revolutions
            before = sum((-r.sign) * max(0, r.load - p["t0_nm"]) * p["k_rad_per_rev_nm"] * (w.runs[j + 1].rev_before - r.rev_before) for j, r in enumerate(w.runs[:i]))
            x = before - s * max(0, T_ - p["t0_nm"]) * p["k_rad_per_rev_nm"] * (rev - run.rev_before)
        elif name == "mesh_stiffness_variation": x = None
        else: x = None
        want.append(x)
    got = np.concatenate(got)
    if want[0] is None:
        print(f"{name:30s} rms {np.std(got)*1e6:7.2f}  (no closed form; min {got.min()*1e6:.0f} max {got.max()*1e6:.0f} mean {got.mean()*1e6:.2f})")
        continue
    want = np.concatenate(want)
    g, v = got - got.mean(), want - want.mean()
    rel = np.std(g - v) / np.std(v)
    flag = "" if rel < 0.03 or (name == "slip" and rel < 0.1) else "   <-- LOOK"
    bad += bool(flag)
    print(f"{name:30s} rms {np.std(got)*1e6:7.2f}  relative difference {rel:.4f}  correlation {np.corrcoef(g, v)[0,1]:.5f}{flag}")
raise SystemExit(bad)
