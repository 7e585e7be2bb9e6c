"""What the data can tell at all: z of a 3 urad effect by a matched filter under the scatter, and the angles between effects."""
import numpy as np, truth as T
names = T.LIBRARY
z = {n: [] for n in names}
for s in range(8):
    w = T.make_world(s); 
    if not w.compliance["shaft_compliance_output_rad_per_nm"]: continue
    noise = [w.white * .9 * np.random.default_rng(s).normal(size=sum(len(r.t) for r in w.runs))]
    base = T.te_of(T.readings(w, {})); e = T.te_of(T.readings(w, {}, scatter=True)) - base + noise[0]; e -= e.mean()
    for n in names:
        p, rms = T.sized(w, n, 3e-6, np.random.default_rng([s, 4]))
        x = T.te_of(T.readings(w, {n: p})) - base; x -= x.mean()
        z[n].append((x @ e) / (x @ x))
print("estimate error of a 3 urad effect in its own size, rms over worlds (1/z), matched filter, shape known")
for n in names: print(f"  {n:30s} {np.sqrt(np.mean(np.square(z[n]))):.3f}")
w = T.make_world(5); base = T.te_of(T.readings(w, {}))[::20]
def tr(n, p): 
    x = (T.te_of(T.readings(w, {n: p})))[::20] - base
    return x - x.mean()
B = {}
for n in names:
    if n in ("pitch_errors", "tooth_damage", "profile_error", "count_loss") or "interpol" in n: continue
    p, _ = T.sized(w, n, 3e-5, np.random.default_rng(6)); cols = [tr(n, p)]
    if "phase_rad" in p: cols.append(tr(n, {**p, "phase_rad": p["phase_rad"] + np.pi / 2}))
    if "dx_mm" in p: cols.append(tr(n, {"dx_mm": -p["dy_mm"], "dy_mm": p["dx_mm"]}))
    B[n] = np.linalg.qr(np.array(cols).T)[0]
rows = []
ks = list(B)
for i, a in enumerate(ks):
    for b in ks[i + 1:]:
        sv = np.linalg.svd(B[a].T @ B[b], compute_uv=False)
        ang = np.degrees(np.arccos(np.clip(sv, 0, 1)))
        if ang[0] < 20: rows.append((ang[0], ang[-1], a, b))
print("angles under 20 deg (smallest, largest; one zero removed, white metric)")
for r in sorted(rows): print(f"  {r[0]:6.2f} {r[1]:6.2f}  {r[2]} - {r[3]}")
