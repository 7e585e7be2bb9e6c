"""The rig's logs as the public Python packages `mcap` and `mcap-protobuf-support` read them, and how a seed repeats them."""

import collections
import json
import math
import os
import pathlib
import subprocess
import sys

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

ROOT = pathlib.Path(__file__).parents[1]
RIGD = os.environ.get("RIGD", str(ROOT / "target/release/rigd"))
MESSAGES = {
    "/rig/angles": "rig.AngleBatch",
    "/rig/state": "rig.RigState",
    "/rig/te": "rig.TransmissionError",
    "/rig/backlash": "rig.Backlash",
    "/rig/events": "foxglove.Log",
}
RECORD, CCW, CW = 4, 1, 2  # rig.Phase, rig.Direction


def run(out, *arguments):
    """Runs the simulated rig faster than real time; returns its summary and its log."""
    command = [RIGD, "run", "--load", "10Nm", "--rpm", "5", "--revs", "1", "--json", "--out", str(out), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    return summary, pathlib.Path(summary["log"][0])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A summary and its log."""
    return run(tmp_path_factory.mktemp("runs"), "--seed", "11")


def payloads(log):
    """The bytes of every message, a list a topic."""
    found = collections.defaultdict(list)
    with log.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            found[channel.topic].append(message.data)
    return found


def test_schemas_describe_every_message(recorded):
    summary, log = recorded
    samples, senses = 0, set()
    seen = collections.Counter()
    with log.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        recording = False
        for schema, channel, _, message in reader.iter_decoded_messages():
            assert schema.name == MESSAGES[channel.topic]
            assert schema.encoding == channel.message_encoding == "protobuf"
            seen[channel.topic] += 1
            if channel.topic == "/rig/state":
                recording = message.phase == RECORD
            elif channel.topic == "/rig/angles" and recording:
                samples += len(message.input_delta)
            elif channel.topic == "/rig/te":
                senses.add(message.direction)
                assert math.isfinite(message.te_rad) and abs(message.te_rad - message.model_te_rad) < 1e-3
    assert seen.keys() == MESSAGES.keys()
    assert senses == {CCW, CW}
    # The samples between the states of a run; a state stands at the sample where a run begins or ends.
    assert samples == summary["samples"]
    assert seen["/rig/te"] == 2 * 720 and seen["/rig/backlash"] == 720


def test_metadata_and_attachments(recorded):
    _, log = recorded
    with log.open("rb") as file:
        reader = make_reader(file)
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attached = {record.name for record in reader.iter_attachments()}
    assert metadata["rig.run"]["backend"] == "sim"
    assert int(metadata["rig.encoders"]["input_counts_per_rev"]) > 0
    assert {"pair.toml", "rig.toml"} <= attached


def test_te_recomputed_by_an_independent_script(recorded):
    _, log = recorded
    command = [sys.executable, str(ROOT / "scripts/check_log.py"), "--recompute", str(log)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "1440 TE messages recomputed" in done.stdout, done.stdout


def test_one_seed_gives_the_same_bytes(recorded, tmp_path):
    summary, log = recorded
    again, log_again = run(tmp_path, "--seed", "11")
    assert again["te_hash"] == summary["te_hash"]
    assert payloads(log_again) == payloads(log)
    other, _ = run(tmp_path, "--seed", "12")
    assert other["te_hash"] != summary["te_hash"]
