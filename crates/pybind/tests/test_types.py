"""The stubs say what the package does."""

import subprocess
import sys

import pytest


def test_stubs_match_the_module(tmp_path):
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy.stubtest", "gearmodel"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_types_of_results(tmp_path):
    pytest.importorskip("mypy")
    script = tmp_path / "use.py"
    script.write_text(
        "import numpy as np\n"
        "from typing import assert_type\n"
        "from numpy.typing import NDArray\n"
        "import gearmodel as gm\n"
        "pair = gm.GearPair.circular(module_mm=3, teeth=(47, 31))\n"
        "assert_type(pair.theta2(1.0), float)\n"
        "assert_type(pair.theta2([1.0, 2.0]), NDArray[np.float64])\n"
        "assert_type(pair.transmission_error(np.zeros(3), direction='cw'), NDArray[np.float64])\n"
        "assert_type(gm.read_log('x').runs[0].theta1_rad, NDArray[np.float64])\n"
    )
    command = [sys.executable, "-m", "mypy", "--strict", "--python-version", "3.11", str(script)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
