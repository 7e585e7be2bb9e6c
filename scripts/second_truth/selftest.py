"""The generator: reproducible, clean, the sizes asked for, and scatter that is not white."""
import sys, numpy as np, truth as T
kinds = ["null", "pair", "triple", "mixed", "outside"] + [f"single:{n}:{s}" for n in T.LIBRARY for s in (3, 30, 100)] + [f"outside:{n}:40" for n in T.OUTSIDE]
bad = 0
for i, kind in enumerate(kinds):
    c = T.make_case(100 + i, kind)
    for r in c.recordings:
        t, a, b = r["time_s"], r["theta1_rad"], r["theta2_rad"]
        s = 1 if r["direction"] == "ccw" else -1
        ok = np.isfinite(a).all() and np.isfinite(b).all() and (np.diff(t) > 0).all() and s * (a[-1] - a[0]) > 8 * np.pi and s * (b[-1] - b[0]) > 24.5
        bad += not ok
        if not ok: print("BAD recording", kind, r["direction"], (a[-1]-a[0])/np.pi, (b[-1]-b[0]))
    te = np.concatenate([r["theta2_rad"] - T.BASE.f(r["theta1_rad"]) for r in c.recordings])
    if not 5e4 <= len(te) <= 3e5: print("samples", len(te)); bad += 1
    for e in c.truth + c.outside:
        want = float(kind.split(":")[2]) if kind.count(":") == 2 else None
        if want and abs(e["rms_rad"] * 1e6 / want - 1) > 0.01:
            print("size", kind, round(e["rms_rad"] * 1e6, 2), e["parameters"])
x, y = T.make_case(7, "pair"), T.make_case(7, "pair")
bad += not all(np.array_equal(p["theta2_rad"], q["theta2_rad"]) for p, q in zip(x.recordings, y.recordings))
fl = [T.make_case(s, "null").floor_rad * 1e6 for s in range(30)]
print("floors", np.round(np.quantile(fl, [0, .1, .5, .9, 1]), 1), "bad", bad)
sys.exit(bool(bad))
