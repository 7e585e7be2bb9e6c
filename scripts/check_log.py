#!/usr/bin/env python3
"""Check a rig log with the public Python packages `mcap` and `mcap-protobuf-support` alone.

    python scripts/check_log.py LOG... [--recompute] [--truncated]

Reads each log with every reader of the package (make_reader, NonSeekingReader, StreamReader) and holds header,
channels, schemas, metadata, checksums, sequence numbers and counts against what a rig log must have.

--recompute  takes counts, `rig.encoders` and `pair.toml` from the log, computes theta1, theta2 and
             TE = theta2 - f(theta1) with NumPy, and compares every /rig/te message (1e-9 rad, the right raw sample).
--truncated  the log has no end (a killed writer's): only StreamReader must read it.

Exit code 0: every check holds. 1: the reasons stand on stderr.
"""

import argparse
import collections
import pathlib
import sys
import tomllib

from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Attachment, Channel, Chunk, DataEnd, Header, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_protobuf.decoder import DecoderFactory

SCHEMAS = {
    "/rig/angles": "rig.AngleBatch",
    "/rig/state": "rig.RigState",
    "/rig/te": "rig.TransmissionError",
    "/rig/backlash": "rig.Backlash",
    "/rig/events": "foxglove.Log",
}
RUN_KEYS = {
    "run_id", "started", "software", "host", "backend", "operator", "note",
    "direction", "load_nm", "speed_rpm", "revolutions",
}  # fmt: skip
ENCODER_KEYS = {
    "input_counts_per_rev", "output_counts_per_rev", "input_lines", "output_lines",
    "input_index_counts", "output_index_counts", "input_sign", "output_sign",
}  # fmt: skip
RECORD, CCW = 4, 1  # rig.Phase, rig.Direction
BINS = 720  # of theta1 a turn: 0.5 degrees
TOLERANCE_RAD = 1e-9
MAX_REASONS = 20


class Check:
    """Gathers the reasons why a log is not as it must be."""

    def __init__(self, path):
        self.path = path
        self.reasons = []

    def that(self, holds, reason):
        """Note `reason` unless the statement holds."""
        if not holds:
            self.reasons.append(reason)
        return bool(holds)


def stream_records(path, truncated):
    """Records of the file by StreamReader, which checks the checksum of the data, with the records of each chunk."""
    size = path.stat().st_size
    with path.open("rb") as file:
        reader = StreamReader(file, skip_magic=False, emit_chunks=True, validate_crcs=True)
        try:
            for record in reader.records:
                inner = breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
                yield record, inner
        except Exception:
            # In a killed writer's log the last record may be cut: then the reader has run into the end of the file.
            if not (truncated and file.tell() == size):
                raise


def check_structure(check, path, truncated):
    """Order, checksums and sequences of the records; returns the messages by topic, metadata and attachments."""
    channels, schemas, metadata, attachments = {}, {}, collections.defaultdict(list), {}
    messages = collections.defaultdict(list)
    sequences = {}
    chunk_spans = []
    first = True
    for record, inner in stream_records(path, truncated):
        if first:
            check.that(isinstance(record, Header), f"the first record is {type(record).__name__}, not a header")
            check.that(record.profile == "", f"profile is {record.profile!r}, not empty")
            check.that(record.library != "", "library is empty")
            first = False
        if isinstance(record, Chunk):
            check.that(record.compression == "zstd", f"chunk compression is {record.compression!r}, not zstd")
            check.that(record.uncompressed_crc != 0, "a chunk has no checksum")
            times = [m.log_time for m in inner if isinstance(m, Message)]
            check.that(times, "a chunk holds no message")
            if times:
                bounds = (record.message_start_time, record.message_end_time)
                check.that(bounds == (min(times), max(times)), f"chunk bounds are {bounds}, not those of its messages")
                chunk_spans.append((bounds[1] - bounds[0], record.uncompressed_size))
        if isinstance(record, DataEnd):
            check.that(record.data_section_crc != 0, "the data has no checksum")
        for item in inner:
            if isinstance(item, Schema):
                known = schemas.setdefault(item.id, item)
                check.that(known.data == item.data, f"schema {item.id} is given twice and differs")
            elif isinstance(item, Channel):
                channels[item.id] = item
            elif isinstance(item, Metadata):
                metadata[item.name].append(item.metadata)
            elif isinstance(item, Attachment):
                attachments[item.name] = item.data
            elif isinstance(item, Message):
                if not check.that(item.channel_id in channels, f"a message on unknown channel {item.channel_id}"):
                    continue
                expected = sequences.get(item.channel_id, item.sequence)
                topic = channels[item.channel_id].topic
                check.that(item.sequence == expected, f"{topic}: sequence {item.sequence} follows {expected - 1}")
                sequences[item.channel_id] = item.sequence + 1
                messages[topic].append(item)
    topics = {channel.topic: channel for channel in channels.values()}
    for topic, name in SCHEMAS.items():
        if not check.that(topic in topics, f"channel {topic} is missing"):
            continue
        channel = topics[topic]
        schema = schemas.get(channel.schema_id)
        check.that(channel.message_encoding == "protobuf", f"{topic}: encoding is {channel.message_encoding!r}")
        check.that(schema and (schema.name, schema.encoding) == (name, "protobuf"), f"{topic}: schema is not {name}")
    for span_ns, size in chunk_spans:
        check.that(span_ns <= 250_000_000, f"a chunk spans {span_ns / 1e6:.0f} ms of log time")
        check.that(size <= 2 << 20, f"a chunk holds {size} bytes")
    decoders = {}
    decoded = collections.defaultdict(list)
    factory = DecoderFactory()
    for topic, items in messages.items():
        channel = topics[topic]
        schema = schemas[channel.schema_id]
        decoder = decoders.setdefault(topic, factory.decoder_for(channel.message_encoding, schema))
        decoded[topic] = [(item, decoder(item.data)) for item in items]
    return decoded, metadata, attachments


def check_readers(check, path, decoded):
    """The summary, and the same number of messages by every reader of the package."""
    count = {topic: len(items) for topic, items in decoded.items()}
    total = sum(count.values())
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        if not check.that(summary and summary.statistics, "there is no summary with statistics"):
            return
        stated = {
            summary.channels[channel].topic: messages
            for channel, messages in summary.statistics.channel_message_counts.items()
        }
        stated = {topic: messages for topic, messages in stated.items() if messages}
        check.that(stated == count, f"statistics count {stated}, the file holds {count}")
        check.that(summary.statistics.message_count == total, "statistics count another number of messages")
        check.that(len(summary.chunk_indexes) == summary.statistics.chunk_count, "chunk indexes are missing")
        times = [item.log_time for items in decoded.values() for item, _ in items]
        bounds = (summary.statistics.message_start_time, summary.statistics.message_end_time)
        if times:
            check.that(bounds == (min(times), max(times)), f"statistics say {bounds}, not the messages' log times")
        check.that(sum(1 for _ in reader.iter_messages()) == total, "make_reader: another number of messages")
        attached = [item.name for item in reader.iter_attachments()]
        check.that(len(attached) == summary.statistics.attachment_count, "make_reader: attachments are missing")
        named = [item.name for item in reader.iter_metadata()]
        check.that(len(named) == summary.statistics.metadata_count, "make_reader: metadata records are missing")
    with path.open("rb") as file:
        reader = NonSeekingReader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        decodes = sum(1 for _ in reader.iter_decoded_messages())
        check.that(decodes == total, "NonSeekingReader: another number of messages")


def check_content(check, decoded, metadata, attachments):
    """What a rig log says about itself, and that its batches hang together."""
    if check.that(len(metadata["rig.run"]) == 1, f"{len(metadata['rig.run'])} metadata records rig.run, expected 1"):
        missing = RUN_KEYS - metadata["rig.run"][0].keys()
        check.that(not missing, f"rig.run lacks {sorted(missing)}")
    recording = any(state.phase == RECORD for _, state in decoded["/rig/state"])
    if recording:
        check.that(metadata["rig.encoders"], "runs were recorded, but there is no rig.encoders")
        check.that("pair.toml" in attachments, "runs were recorded, but there is no pair.toml")
    for encoders in metadata["rig.encoders"]:
        missing = ENCODER_KEYS - encoders.keys()
        check.that(not missing, f"rig.encoders lacks {sorted(missing)}")
    expected, losses, samples = None, 0, 0
    for message, batch in decoded["/rig/angles"]:
        lengths = (len(batch.input_delta), len(batch.output_delta))
        check.that(lengths[0] == lengths[1] > 0, f"batch of sample {batch.first_sample}: {lengths} deltas")
        check.that(batch.input_delta[:1] == [0] and batch.output_delta[:1] == [0], "a batch's first delta is not 0")
        check.that(message.publish_time == batch.t0_ns, f"batch of sample {batch.first_sample}: publish_time is not t0")
        if expected is not None:
            check.that(batch.first_sample >= expected, f"sample {batch.first_sample} comes after {expected - 1}")
            losses += max(0, batch.first_sample - expected)
        expected = batch.first_sample + lengths[0]
        samples += lengths[0]
    return samples, losses


def time_ns(stamp):
    """Nanoseconds of a google.protobuf.Timestamp."""
    return stamp.seconds * 1_000_000_000 + stamp.nanos


def transmission(pair):
    """f(theta1) of the pair, theory: tan(theta2/2) = ((1+k)/(1-k)) tan(theta1/2), unwrapped."""
    import numpy as np

    kind = pair.get("kind")
    if kind == "circular":
        z1, z2 = pair["teeth"]
        return lambda theta1: theta1 * (z1 / z2)
    if kind == "constant":
        return lambda theta1: theta1 * pair["ratio"]
    if kind == "elliptical":
        k = pair["eccentricity"]
        return lambda theta1: theta1 + 2.0 * np.arctan(k * np.sin(theta1) / (1.0 - k * np.cos(theta1)))
    return None


def recompute(check, decoded, metadata, attachments):
    """TE from the counts, held against every message of /rig/te."""
    import numpy as np

    if not check.that(metadata["rig.encoders"] and "pair.toml" in attachments, "nothing to recompute TE from"):
        return 0
    pair = tomllib.loads(attachments["pair.toml"].decode())
    f = transmission(pair)
    if not check.that(f is not None, f"pair.toml: kind {pair.get('kind')!r} is none that this script computes"):
        return 0
    encoders = {key: int(float(value)) for key, value in metadata["rig.encoders"][-1].items()}

    def angle(counts, shaft):
        from_index = (counts - encoders[f"{shaft}_index_counts"]).astype(float)
        return encoders[f"{shaft}_sign"] * 2.0 * np.pi * from_index / encoders[f"{shaft}_counts_per_rev"]

    times, inputs, outputs = [], [], []
    for _, batch in decoded["/rig/angles"]:
        times.append(np.uint64(batch.t0_ns) + np.arange(len(batch.input_delta), dtype=np.uint64) * np.uint64(batch.dt_ns))
        inputs.append(batch.input_base + np.cumsum(np.array(batch.input_delta, dtype=np.int64)))
        outputs.append(batch.output_base + np.cumsum(np.array(batch.output_delta, dtype=np.int64)))
    if not check.that(times, "there are no angles"):
        return 0
    times = np.concatenate(times)
    theta1 = angle(np.concatenate(inputs), "input")
    theta2 = angle(np.concatenate(outputs), "output")
    te = theta2 - f(theta1)

    # A run: RECORD at one direction, load and speed; a sample belongs to it iff start <= t < end.
    runs, open_key = [], None
    for _, state in sorted(decoded["/rig/state"], key=lambda item: time_ns(item[1].timestamp)):
        at = time_ns(state.timestamp)
        key = (state.direction, state.load_setpoint_nm, state.speed_setpoint_rpm) if state.phase == RECORD else None
        if key != open_key:
            if open_key is not None:
                runs[-1][2] = at
            if key is not None:
                runs.append([key, at, None])
            open_key = key
    points = [(time_ns(message.timestamp), message) for _, message in decoded["/rig/te"]]
    compared = 0
    for (direction, load_nm, speed_rpm), start, end in runs:
        first = int(np.searchsorted(times, np.uint64(start)))
        last = int(np.searchsorted(times, np.uint64(end))) if end is not None else len(times)
        name = f"run {'ccw' if direction == CCW else 'cw'} {load_nm} N.m {speed_rpm} rpm"
        if not check.that(last > first, f"{name}: holds no samples"):
            continue
        sense = 1 if direction == CCW else -1
        of_run = [m for at, m in points if at >= start and (end is None or at < end)]
        bins = theta1[first:last] * (BINS / (2.0 * np.pi))
        # A sample within the tolerance of an edge may count to either side of it.
        slack = TOLERANCE_RAD * BINS / (2.0 * np.pi)
        low, high = np.floor(bins - slack).astype(np.int64), np.floor(bins + slack).astype(np.int64)
        exact = np.floor(bins).astype(np.int64)
        travelled = (exact - exact[0]) * sense
        reached = np.maximum.accumulate(travelled)
        opens = np.flatnonzero(np.diff(reached, prepend=reached[0] - 1) > 0)
        if end is None:
            # Cut off in this run: what was still to be written, samples or their TE, is in no chunk.
            after = [m for m in of_run if time_ns(m.timestamp) > int(times[-1])]
            of_run = [m for m in of_run if time_ns(m.timestamp) <= int(times[-1])]
            compared += len(after)
        off = abs(len(opens) - len(of_run))
        holds = off <= np.count_nonzero(low != high) or (end is None and len(of_run) < len(opens))
        check.that(holds, f"{name}: {len(of_run)} TE messages, the samples open {len(opens)} bins")
        seen = set()
        for message in of_run:
            at = time_ns(message.timestamp)
            index = int(np.searchsorted(times, np.uint64(at)))
            where = f"{name}: TE at {at} ns"
            if not check.that(index < last and times[index] == at, f"{where} is at no raw sample"):
                continue
            n = index - first
            for field, raw in (("theta1_rad", theta1), ("theta2_rad", theta2), ("te_rad", te)):
                value = getattr(message, field)
                off = abs(value - raw[index])
                check.that(off <= TOLERANCE_RAD, f"{where}: {field} {value!r} is {off:.3e} rad from the counts")
            check.that(message.direction == direction, f"{where}: direction {message.direction}")
            # The sample is in a bin that no sample of the run before it had reached.
            reach = np.max(travelled[:n], initial=-1)
            best = max((low[n] - exact[0]) * sense, (high[n] - exact[0]) * sense)
            check.that(best > reach, f"{where} is not the first raw sample past its bin's edge")
            edge = int(exact[n])
            check.that(edge not in seen or low[n] != high[n], f"{where}: a second message of its bin")
            seen.add(edge)
            compared += 1
    check.that(compared == len(points), f"{len(points) - compared} TE messages lie in no run")
    return compared


def check_log(path, arguments):
    """All checks of one log; prints a line and returns whether they hold."""
    check = Check(path)
    text = ""
    try:
        decoded, metadata, attachments = check_structure(check, path, arguments.truncated)
        if not arguments.truncated:
            check_readers(check, path, decoded)
        samples, losses = check_content(check, decoded, metadata, attachments)
        text = f"{sum(map(len, decoded.values()))} messages, {samples} samples, {losses} lost"
        if arguments.recompute:
            text += f", {recompute(check, decoded, metadata, attachments)} TE messages recomputed"
    except Exception as error:  # whatever a reader throws is a reason why the log does not read
        check.reasons.append(f"{type(error).__name__}: {error}")
    for reason in check.reasons[:MAX_REASONS]:
        print(f"{path}: {reason}", file=sys.stderr)
    if len(check.reasons) > MAX_REASONS:
        print(f"{path}: and {len(check.reasons) - MAX_REASONS} more", file=sys.stderr)
    if not check.reasons:
        print(f"{path}: good, {text}")
    return not check.reasons


def main():
    """Check every log given; exit 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", nargs="+", type=pathlib.Path)
    parser.add_argument("--recompute", action="store_true", help="compute TE from the counts and compare")
    parser.add_argument("--truncated", action="store_true", help="the log has no end")
    arguments = parser.parse_args()
    results = [check_log(path, arguments) for path in arguments.log]
    sys.exit(0 if all(results) else 1)


if __name__ == "__main__":
    main()
