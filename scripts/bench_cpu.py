"""Measures the daemon's own processor time in real time at 10 kS/s: python scripts/bench_cpu.py [RIGD]

Starts `rigd sim` as a process of its own and `rigd run --profile` against its ports, and reads what the run alone used
(wait4: user and system time of that process; the simulated rig is no child of it). Prints the share of one core; the goal is
10 % at most.
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).parents[1]
GOAL = 0.10


def main():
    """Measures one run and prints the figure; exit code 1 when the run failed or the goal is missed."""
    rigd = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "target/release/rigd")
    with tempfile.TemporaryDirectory() as directory:
        rig = subprocess.Popen([rigd, "sim", "--pty-dir", f"{directory}/ports"], stdout=subprocess.PIPE, text=True)
        try:
            if not any(line == "ready\n" for line in rig.stdout):
                sys.exit("bench_cpu: the simulated rig did not start")
            command = [rigd, "run", "--load", "10Nm", "--rpm", "5", "--revs", "1", "--json", "--quiet"]
            command += ["--profile", f"{directory}/ports/profile.toml", "--out", f"{directory}/runs"]
            begun = time.monotonic()
            run = subprocess.Popen(command, stdout=subprocess.DEVNULL)
            _, status, usage = os.wait4(run.pid, 0)
            seconds = time.monotonic() - begun
            run.returncode = os.waitstatus_to_exitcode(status)
        finally:
            rig.terminate()
            rig.wait()
    if run.returncode != 0:
        sys.exit(f"bench_cpu: the run ended with exit code {run.returncode}")
    used = usage.ru_utime + usage.ru_stime
    share = used / seconds
    print(f"daemon: {used:.2f} s of processor time ({usage.ru_utime:.2f} user, {usage.ru_stime:.2f} system) "
          f"in {seconds:.1f} s = {100 * share:.2f} % of a core, {usage.ru_maxrss / 1024:.0f} MiB; goal {100 * GOAL:.0f} %")  # fmt: skip
    sys.exit(share > GOAL)


if __name__ == "__main__":
    main()
