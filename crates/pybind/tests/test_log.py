"""Logs that the daemon wrote; RIGD names its binary."""

import json
import os
import subprocess

import numpy as np
import pytest

import gearmodel as gm

RIGD = os.environ.get("RIGD")


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    if RIGD is None:
        pytest.skip("RIGD does not name the rigd binary")
    out = tmp_path_factory.mktemp("runs")
    command = [RIGD, "run", "--load", "10Nm", "--rpm", "5", "--time-scale", "max", "--json", "--seed", "7", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), next(out.glob("*.mcap"))


@pytest.fixture(scope="session")
def log(recorded):
    return gm.read_log(recorded[1])


def test_runs(recorded, log):
    summary, path = recorded
    assert log.path == path and log.complete and log.losses == summary["losses"] == 0
    assert sum(len(run) for run in log.runs) == summary["samples"]
    assert [run.direction for run in log.runs] == ["ccw", "cw"]
    for run in log.runs:
        assert (run.load_nm, run.speed_rpm) == (10.0, 5.0)
        assert run.revolutions == pytest.approx(3, abs=0.01)
        assert run.input_lines and run.output_lines
        assert np.all(np.diff(run.time_s) > 0)


def test_metadata_events_and_pair(log):
    assert log.metadata["rig.run"]["backend"] == "sim"
    assert int(log.metadata["rig.encoders"]["input_lines"]) == log.runs[0].input_lines
    assert log.pair.kind == "elliptical" and log.pair.errors.e1_mm == 0.05
    assert log.events and all(event.time_ns > 0 and event.message for event in log.events)


def test_te_is_that_of_the_samples(log):
    te = log.te
    assert set(te.direction) == {"ccw", "cw"}
    np.testing.assert_allclose(te.te_rad, te.theta2_rad - log.pair.theta2(te.theta1_rad), atol=1e-9)
    assert len(log.backlash) == 720
    run = log.runs[0]
    seen = np.isin(te.theta1_rad[te.direction == "ccw"], run.theta1_rad)
    assert seen.all()


def test_figures_are_those_of_the_daemon(recorded, log):
    summary, _ = recorded
    for run in log.runs:
        a = gm.analyse(run, log.pair)
        assert a.f_i_total == pytest.approx(summary["te"][run.direction]["pp_rad"], rel=1e-12)
        assert a.mean_rad == pytest.approx(summary["te"][run.direction]["mean_rad"], abs=1e-15)
        assert a.cumulative_offset == pytest.approx(summary["te"][run.direction]["offset_per_rev_rad"], abs=1e-15)
    b = gm.backlash_from(*log.runs, log.pair)
    assert b.mean_rad == pytest.approx(summary["backlash"]["mean_rad"], abs=1e-15)
    assert b.low[0] < b.backlash[0] < b.high[0]


def test_a_log_that_was_cut_off_gives_what_is_whole(recorded, log, tmp_path):
    data = recorded[1].read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) // 2])
    with pytest.warns(UserWarning, match=r"cut\.mcap: cut off at byte"):
        part = gm.read_log(cut)
    assert not part.complete and "cut off" in part.completeness
    run = part.runs[0]
    np.testing.assert_array_equal(run.theta1_rad, log.runs[0].theta1_rad[: len(run)])


def test_files_that_are_no_logs(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.mcap"):
        gm.read_log(tmp_path / "none.mcap")
    foreign = tmp_path / "foreign.mcap"
    foreign.write_bytes(b"not a log at all, but long enough to look at")
    with pytest.raises(gm.LogError, match=r"foreign\.mcap is not an MCAP file"):
        gm.read_log(foreign)
