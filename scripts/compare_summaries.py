"""Compares the summaries of a run and of its replay: equal samples, losses and hash, or exit code 1."""

import json
import sys
from pathlib import Path


def main(run_path: str, replay_path: str) -> int:
    run, replay = (json.loads(Path(path).read_text()) for path in (run_path, replay_path))
    different = [key for key in ("samples", "losses", "te_hash", "te", "backlash") if run[key] != replay[key]]
    for key in different:
        print(f"{key}: run {run[key]} but replay {replay[key]}")
    if run["losses"] != 0:
        different.append("losses")
        print(f"losses: {run['losses']}, expected 0")
    print("replay differs" if different else f"replay equals the run: {run['samples']} samples, {run['te_hash']}")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
