"""Time and memory of a diagnosis, from arrays and from logs: .venv/bin/python scripts/bench_diagnose.py

Campaigns of 12 runs, four loads and three speeds in both senses. From arrays: 3e5 samples, made by the tests' NumPy campaign, with nothing
to find and with three effects; `gearmodel.diagnose` alone is timed, best of five. From logs of the simulated rig, as `rigd diagnose` reads
them: 1e7 samples with an eccentric output disc, and 3e5 with pitch errors, the slowest that there is; the whole process is timed, best of
three, with its largest resident set. Needs `./test` to have been run once (it makes .venv and target/release/rigd).
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import gearmodel as gm

ROOT = pathlib.Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "crates/pybind/tests"))
import campaign as c  # noqa: E402

RIGD = ROOT / "target/release/rigd"
LOADED = ((0.5, 5.0), (5.0, 5.0), (10.0, 5.0), (15.0, 5.0), (10.0, 2.5), (10.0, 10.0))
PLAN = [(sense, load, rpm) for load, rpm in LOADED for sense in ("ccw", "cw")]
ASKED_ARRAYS_S, ASKED_LOGS_S, ASKED_MB = 1.0, 5.0, 300.0


def from_arrays(name, effects):
    """Prints the best of five."""
    runs = c.recordings(effects, plan=PLAN, rate_hz=480.0)
    samples = sum(len(run["time_s"]) for run in runs)
    recordings = c.made(runs)
    pair = c.pair()
    times = []
    for _ in range(5):
        begun = time.perf_counter()
        found = gm.diagnose(recordings, pair)
        times.append(time.perf_counter() - begun)
    named = ", ".join(v if isinstance(v, str) else " or ".join(v["members"]) for v in found.verdict) or "nothing"
    print(f"arrays {samples:9} samples, {name}: {min(times):5.2f} s (asked: {ASKED_ARRAYS_S:.0f} s); named: {named}")


def from_logs(effect, rate):
    """Prints the best of three."""
    with tempfile.TemporaryDirectory() as directory:
        logs = []
        for loads, rpm in (("0.5Nm,5Nm,10Nm,15Nm", "5"), ("10Nm", "2.5"), ("10Nm", "10")):
            command = [RIGD, "run", "--load", loads, "--rpm", rpm, "--revs", "4", "--rate", rate, "--quiet", "--json"]
            command += ["--undocumented", effect, "--out", directory]
            logs += json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)["log"]
        samples = sum(
            json.loads(subprocess.run([RIGD, "info", log, "--json"], stdout=subprocess.PIPE, check=True).stdout)["samples_in_file"]
            for log in logs
        )
        times, sizes = [], []
        for _ in range(3):
            begun = time.perf_counter()
            process = subprocess.Popen([RIGD, "diagnose", *logs, "--json"], stdout=subprocess.DEVNULL)
            _, status, usage = os.wait4(process.pid, 0)
            times.append(time.perf_counter() - begun)
            sizes.append(usage.ru_maxrss / 1024)
            process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode not in (0, 1):
                sys.exit(f"bench_diagnose: rigd diagnose ended with exit code {process.returncode}")
        print(f"logs   {samples:9} samples in {len(logs)} files, {effect}: {min(times):5.2f} s (asked: {ASKED_LOGS_S:.0f} s), "
              f"{max(sizes):4.0f} MB (asked: {ASKED_MB:.0f} MB)")


if __name__ == "__main__":
    from_arrays("nothing to find", ())
    from_arrays("three effects", (c.output_encoder(6e-5, 0.7), c.output_windup(1.2e-5), c.backlash(0.012)))
    from_logs("encoder2_eccentricity", "14kHz")
    from_logs("pitch_errors", "400Hz")
