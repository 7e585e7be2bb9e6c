#!/usr/bin/env bash
# pyuff 2.5.8: an evenly spaced data set 58 states its start and its step in a text line of six significant figures, in binary
# files as well. 100 s at 3 kHz come back 0.1 ms longer or shorter (52 µrad of a shaft at 5 rpm), and a start in
# seconds since 1970 is off by up to 5000 s. Rates such as 10 kHz hide it: their step has one figure.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet pyuff==2.5.8 numpy==2.4.6
cd "$dir"
"$dir/venv/bin/python" - <<'PY'
import os
import numpy as np, pyuff

def back(time_s, binary):
    """The time axis after a file."""
    if os.path.exists("x.uff"):
        os.remove("x.uff")
    entry = dict(type=58, func_type=1, rsp_node=1, rsp_dir=1, ref_node=1, ref_dir=1, rsp_ent_name="a", ref_ent_name="b", id1="x",
                 abscissa_spacing=1, orddenom_spec_data_type=0, binary=binary, x=time_s, data=np.zeros(time_s.size))
    pyuff.UFF("x.uff").write_sets([entry], "add")
    return pyuff.UFF("x.uff").read_sets(0)["x"]

for binary in (0, 1):
    for hz, off_s in ((3000, 1.0e-4), (7000, 4.29e-5), (10000, 0.0)):
        time_s = np.arange(300_000) / hz
        worst = np.abs(back(time_s, binary) - time_s).max()
        print(f"binary={binary} {hz} Hz, 300 000 samples: the axis is off by {worst:.3g} s at its end")
        assert abs(worst - off_s) < 0.01e-4, worst
    start_s = 1_764_451_200.0
    off_s = np.abs(back(start_s + np.arange(1000) / 10_000, binary) - start_s).min()
    print(f"binary={binary} start {start_s:.0f} s: off by {off_s:.0f} s")
    assert abs(off_s - 1200) < 1, off_s
PY
echo "pyuff 2.5.8 still keeps six figures"
