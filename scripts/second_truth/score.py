"""Score gm.diagnose on simulated campaigns whose effects are known: a truth of its own in NumPy, which shares no line with the
library or with the simulated rig.

    python scripts/second_truth/score.py --cases 300 --seed 1 --jobs 2 [--kinds null,single:slip:30,pair] [--json out.json] [--dump FILE]

Without --kinds: a mix of nulls, every effect at 3/10/30/100 urad, pairs, triples, outside the library, mixed, in the
proportions of `rigd blindtest`, interleaved so that any number of cases is balanced. --kinds is walked round.
Every case has its own seed (printed): rerun one with --cases 1 --seed SEED --kinds KIND --dump FILE --exact-seed.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
import traceback
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

import numpy as np

import truth as T

SIZES = (3, 10, 30, 100)
WEIGHTS = {"null": 60, "single": 4 * len(T.LIBRARY), "pair": 45, "triple": 32, "outside": 39, "mixed": 32}


def plan(n: int, rng) -> list:
    """Kinds of n cases: always the one that lags its share most; singles and outsides walk all names (and sizes)."""
    outside = [f"outside:{name}" for name in T.OUTSIDE]
    # Names in random order; sizes take turns, shifted from round to round, so that every stretch holds all sizes.
    names = [T.LIBRARY[i] for i in rng.permutation(len(T.LIBRARY))]
    singles = [f"single:{name}:{SIZES[(i + turn) % 4]}" for turn in range(4) for i, name in enumerate(names)]
    outside = [outside[i] for i in rng.permutation(len(outside))]
    total, done, kinds = sum(WEIGHTS.values()), dict.fromkeys(WEIGHTS, 0), []
    for i in range(n):
        head = max(WEIGHTS, key=lambda k: (i + 1) * WEIGHTS[k] / total - done[k])
        pool = {"single": singles, "outside": outside}.get(head)
        kinds.append(pool[done[head] % len(pool)] if pool else head)
        done[head] += 1
    return kinds


def members(item):
    return list(item["members"]) if isinstance(item, dict) else [item]


def right(item, name) -> bool:
    """A verdict's item names this truth: itself, or a group that holds it and nothing that physics does not tie to it."""
    if isinstance(item, str):
        return item == name
    return name in item["members"] and all(T._tied(name, other) for other in item["members"])


def exact(verdict, names, unknown: bool) -> bool:
    items = [i for i in verdict if i != "unknown"]
    if ("unknown" in verdict) != unknown or len(items) != len(names):
        return False
    rest = list(names)
    for item in items:
        hit = next((n for n in rest if right(item, n)), None)
        if hit is None:
            return False
        rest.remove(hit)
    return True


def parameter_rows(case, report) -> list:
    """(effect, parameter, truth, value, std, inside) of every true effect that the report believes in."""
    rows = []
    found = {e["name"]: e for e in report["effects"]}
    grouped = [set(members(g)) for g in report.get("groups", []) if g.get("probability", 1.0) > 0.5]
    grouped += [set(members(i)) for i in report["verdict"] if isinstance(i, dict)]
    for item in case.truth:
        effect = found.get(item["name"])
        if effect is None or not (effect["probability"] > 0.5 or item["name"] in report["verdict"]
                                  or any(item["name"] in g for g in grouped)):
            continue
        for key, value in item["parameters"].items():
            got = effect["parameters"].get(key)
            if got is None or got.get("std") is None or isinstance(value, (list, str)):
                continue
            if not isinstance(got["value"], (int, float)):
                continue
            miss = got["value"] - value
            if key == "counts":
                miss = abs(got["value"]) - abs(value)  # whose sign "lost" has is a convention
            if key.endswith("phase_rad") or key.startswith("ph"):
                miss = (miss + np.pi) % (2 * np.pi) - np.pi
            half = 1.645 * got["std"]
            rows.append([item["name"], key, value, got["value"], got["std"], bool(abs(miss) <= half + 1e-12 * abs(value))])
    return rows


def run_case(job):
    seed, kind, threads, dump = job
    os.environ.setdefault("RAYON_NUM_THREADS", str(threads))
    row = {"seed": seed, "kind": kind, "error": None}
    try:
        case = T.make_case(seed, kind)
    except Exception:  # noqa: BLE001
        return {**row, "error": "GENERATOR: " + traceback.format_exc(limit=3), "seconds": 0.0, "names": [], "outside": [],
                "exact": False, "verdict": [], "size": 0.0, "generator": True}
    row |= {"names": case.names, "outside": [e["name"] for e in case.outside], "size": case.size_urad,
            "sizes": {e["name"]: round(1e6 * e["rms_rad"], 2) for e in case.truth + case.outside},
            "floor_urad": case.floor_rad * 1e6, "samples": case.parts["samples"]}
    try:
        import gearmodel as gm

        pair = gm.GearPair.elliptical(**case.pair_kwargs["elliptical"]).with_errors(gm.Errors(**case.pair_kwargs["errors"]))
        recordings = [gm.Recording(**r) for r in case.recordings]
        began = time.perf_counter()
        report = gm.diagnose(recordings, pair)
        report = report.to_dict()
        row["seconds"] = time.perf_counter() - began
    except BaseException as error:  # noqa: BLE001  (a Rust panic is a BaseException)
        if isinstance(error, (KeyboardInterrupt, SystemExit)):
            raise
        return row | {"error": f"{type(error).__name__}: {error}"[:600], "exact": False, "verdict": [], "seconds": 0.0}
    if dump:
        with open(dump, "w", encoding="utf-8") as out:
            json.dump({"case": {"seed": seed, "kind": kind, "truth": case.truth, "outside": case.outside, "parts": case.parts,
                                "floor_rad": case.floor_rad, "pair_kwargs": case.pair_kwargs}, "report": report}, out, indent=1)
    try:
        return row | judge(case, report)
    except Exception:  # noqa: BLE001
        return row | {"error": "REPORT: " + traceback.format_exc(limit=2), "exact": False, "verdict": report.get("verdict", [])}


def judge(case, report) -> dict:
    verdict = report["verdict"]
    unknown = bool(case.outside)
    probability = {e["name"]: float(e["probability"]) for e in report["effects"]}
    groups = [g for g in report.get("groups", []) if g.get("probability") is not None]

    def on_truth(name):
        best = probability.get(name, 0.0)
        for g in groups:
            if right({"members": g["members"]}, name):
                best = max(best, float(g["probability"]))
        return best

    # Calibration: a group counts as one statement, its members then no longer.
    statements, inside = [], set()
    for g in groups:
        statements.append((float(g["probability"]), any(n in case.names for n in g["members"]), "|".join(g["members"])))
        inside |= set(g["members"])
    statements += [(p, n in case.names, n) for n, p in probability.items() if n not in inside]
    gap = report.get("gap", {})
    p_unknown = report.get("unknown", {}).get("probability", 0.0) if isinstance(report.get("unknown"), dict) else 0.0
    return {
        "verdict": verdict, "exact": exact(verdict, case.names, unknown),
        "false": [i for i in verdict if i != "unknown" and not any(right(i, n) for n in case.names)],
        "missed": [n for n in case.names if not any(right(i, n) for i in verdict if i != "unknown")],
        "flagged": "unknown" in verdict, "p_unknown": p_unknown, "p_truth": [on_truth(n) for n in case.names],
        "statements": [(p, bool(hit), name) for p, hit, name in statements if p > 0.02 or hit],
        "parameters": parameter_rows(case, report), "closed": gap.get("closed"), "before": gap.get("before_rad"),
        "after": gap.get("after_rad"), "floor": gap.get("floor_rad"), "signature": report.get("where", {}).get("signature"),
        "top": sorted(((round(p, 3), n) for n, p in probability.items()), reverse=True)[:4],
    }


def share(rows, key="exact"):
    return f"{sum(bool(r.get(key)) for r in rows):4d}/{len(rows):<4d} {100 * np.mean([bool(r.get(key)) for r in rows]):5.1f} %" if rows else "   –"


def size_class(row):
    return min(SIZES, key=lambda s: abs(np.log(max(row["size"], 0.1) / s)))


def table(rows) -> dict:
    kind = lambda head: [r for r in rows if r["kind"].split(":")[0] == head]  # noqa: E731
    print(f"\n{'measure':34s}{'cases':>18s}   to reach")
    single = kind("single")
    for size, goal in ((100, "98 %"), (30, "98 %"), (10, "92 %"), (3, "75 %")):
        print(f"{f'single, {size} urad, exact':34s}{share([r for r in single if size_class(r) == size]):>18s}   {goal}")
    for head, goal in (("pair", "95 %"), ("triple", "90 %"), ("names", "")):
        if kind(head):
            print(f"{f'{head}, exact set':34s}{share(kind(head)):>18s}   {goal}")
    nulls = kind("null")
    for r in nulls:
        r["_false"], r["_unknown"] = bool(r.get("false")), bool(r.get("flagged"))
    print(f"{'null: a false name':34s}{share(nulls, '_false'):>18s}   <= 3 %")
    print(f"{'null: falsely unknown':34s}{share(nulls, '_unknown'):>18s}")
    print(f"{'outside: flagged':34s}{share(kind('outside'), 'flagged'):>18s}   97 %")
    print(f"{'outside: exact':34s}{share(kind('outside')):>18s}   92 %")
    print(f"{'mixed: flagged':34s}{share(kind('mixed'), 'flagged'):>18s}")
    print(f"{'mixed: exact':34s}{share(kind('mixed')):>18s}   85 %")
    library = [r for r in rows if r["names"] and not r["outside"] and r["kind"] != "null"]
    falsely = [r for r in library if r.get("flagged")]
    print(f"{'library only: falsely unknown':34s}{f'{len(falsely):4d}/{len(library):<4d}':>11s}")
    mean = lambda values: float(np.mean(values)) if len(values) else float("nan")  # noqa: E731
    p_truth = [p for r in rows for p in r.get("p_truth", [])]
    p_large = [p for r in rows if r["size"] >= 9 for p in r.get("p_truth", [])]
    statements = [s for r in rows for s in r.get("statements", [])]
    p = np.array([s[0] for s in statements])
    hit = np.array([s[1] for s in statements], dtype=float)
    used = p > 0.02 if len(p) else np.zeros(0, bool)
    ece = brier = float("nan")
    bins = []
    if used.any():
        which = np.minimum((p[used] * 10).astype(int), 9)
        for b in range(10):
            m = which == b
            if m.any():
                bins.append((b, int(m.sum()), mean(p[used][m]), mean(hit[used][m])))
        ece = sum(n * abs(c - a) for _, n, c, a in bins) / used.sum()
        brier = mean((p - hit) ** 2)
    print(f"{'mean probability on the truth':34s}{mean(p_truth):18.3f}   0.95    (10 urad and more: {mean(p_large):.3f})")
    print(f"{'ECE / Brier':34s}{f'{ece:.3f} / {brier:.3f}':>18s}   0.05    of {int(used.sum())} statements")
    for b, n, c, a in bins:
        print(f"    said {b / 10:.1f}..{(b + 1) / 10:.1f}: {n:5d} statements, mean {c:.3f}, true {a:.3f}")
    closed = [r["closed"] for r in rows if r.get("closed") is not None and r["size"] >= 9 and not r["outside"]]
    print(f"{'gap closed, library, >= 10 urad':34s}{mean(closed):18.3f}   0.97    median {np.median(closed) if closed else np.nan:.3f}")
    rows_p = [q for r in rows if r["size"] >= 9 and not r["outside"] for q in r.get("parameters", [])]
    print(f"{'parameters in 90 % interval':34s}{100 * mean([q[-1] for q in rows_p]):16.1f} %   85–95 %  of {len(rows_p)}")
    by = {}
    for q in rows_p:
        by.setdefault((q[0], q[1]), []).append(q)
    bad = {k: v for k, v in by.items() if np.mean([q[-1] for q in v]) < 0.75}
    for (name, key), v in sorted(bad.items()):
        q = v[0]
        print(f"    low: {name}.{key} {sum(x[-1] for x in v)}/{len(v)}; first: truth {q[2]:.6g}, value {q[3]:.6g} +- {q[4]:.2g}")
    seconds = [r["seconds"] for r in rows if r.get("seconds")]
    print(f"{'seconds a case, mean / max':34s}{f'{mean(seconds):.2f} / {max(seconds, default=np.nan):.2f}':>18s}")
    print(f"{'errors':34s}{sum(bool(r.get('error')) for r in rows):18d}")
    by_name = {}
    for r in single:
        by_name.setdefault(r["kind"].split(":")[1], []).append(r)
    if by_name:
        print("\nsingle effects, right/all at 100, 30, 10, 3 urad (- none)")
        for name in T.LIBRARY:
            if name in by_name:
                cells = []
                for size in (100, 30, 10, 3):
                    v = [r for r in by_name[name] if size_class(r) == size]
                    cells.append(f"{sum(r['exact'] for r in v)}/{len(v)}" if v else "-")
                print(f"  {name:30s}" + "".join(f"{c:>8s}" for c in cells))
    return {"ece": ece, "brier": brier, "p_truth": mean(p_truth), "closed": mean(closed)}


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--cases", type=int, default=60)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--jobs", type=int, default=2)
    arguments.add_argument("--kinds", help="comma-separated kinds, walked round; ';' separates them when a names: list is among them")
    arguments.add_argument("--json", default="score.json")
    arguments.add_argument("--dump", help="write truth and full report of the last case here")
    arguments.add_argument("--exact-seed", action="store_true", help="use --seed itself as the case's seed (then seed+1, ...)")
    arguments.add_argument("--quiet", action="store_true", help="no line a case")
    options = arguments.parse_args()
    rng = np.random.default_rng(options.seed)
    if options.kinds:
        kinds = options.kinds.split(";" if ";" in options.kinds or "names:" in options.kinds else ",")
        if kinds == ["all"]:
            kinds = [f"single:{n}:{s}" for n in T.LIBRARY for s in SIZES]
        kinds = [kinds[i % len(kinds)] for i in range(options.cases)]
    else:
        kinds = plan(options.cases, rng)
    first = options.seed if options.exact_seed else 1_000_000 * options.seed
    threads = max(1, (os.cpu_count() or 1) // options.jobs)
    jobs = [(first + i, kind, threads, options.dump) for i, kind in enumerate(kinds)]
    rows, began = [], time.perf_counter()

    def note(row):
        rows.append(row)
        if not options.quiet:
            mark = "ok " if row["exact"] else "ERR" if row["error"] else "BAD"
            print(f"{mark} {row['seed']} {row['kind']:44s} {row['seconds'] if 'seconds' in row else 0:6.2f} s "
                  f"{'' if row['exact'] else row['error'] or row['verdict']}", flush=True)

    if options.jobs > 1 and len(jobs) > 1:
        with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
            pending = {pool.submit(run_case, job): job for job in jobs}
            for future in as_completed(pending):
                try:
                    note(future.result())
                except Exception as error:  # noqa: BLE001  (a worker died)
                    seed, kind, *_ = pending[future]
                    note({"seed": seed, "kind": kind, "error": f"worker: {error}", "exact": False, "verdict": [], "names": [],
                          "outside": [], "size": 0.0, "seconds": 0.0})
    else:
        for job in jobs:
            note(run_case(job))
    rows.sort(key=lambda r: r["seed"])
    summary = table(rows)
    failures = [r for r in rows if not r["exact"]]
    print(f"\n{len(failures)} failures of {len(rows)} in {time.perf_counter() - began:.0f} s")
    for r in failures:
        print(f"  seed {r['seed']} {r['kind']}: truth {r.get('sizes', {})} floor {r.get('floor_urad', 0):.1f}"
              f" -> {r['error'] if r['error'] else r['verdict']}"
              + ("" if r["error"] else f"  p_truth {[round(p, 3) for p in r.get('p_truth', [])]} unknown {r['p_unknown']:.3f} top {r.get('top')}"))
    with open(options.json, "w", encoding="utf-8") as out:
        json.dump({"summary": summary, "rows": [{k: v for k, v in r.items() if not k.startswith('_')} for r in rows]}, out, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
