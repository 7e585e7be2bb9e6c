//! What is written is what is read, by this crate and by the public `mcap` crate.

// A test ends at the first surprise.
#![allow(clippy::unwrap_used)]

mod common;

use std::{collections::BTreeMap, io::Cursor, path::Path};

use common::{SMALL, messages, read, write};
use gearmodel::Direction;
use prost::Message;
use riglog::{
    Completeness, LogError, LogReader, LogWriter, Record, info,
    proto::{self, AngleBatch, Phase, RigState, Timestamp},
    read_runs, recover,
};

#[test]
fn everything_comes_back() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let statistics = write(&path, &SMALL).unwrap();
    let (records, completeness) = read(&path);
    assert_eq!(completeness, Completeness::Complete);
    assert_eq!(messages(&records), statistics.messages);
    assert_eq!(statistics.bytes, std::fs::metadata(&path).unwrap().len());
    assert!(records.contains(&Record::Run(common::run_metadata())));
    assert!(records.contains(&Record::Encoders(common::encoders())));
    assert!(records.contains(&Record::Sealed("0123456789abcdef".into())));
    let attachment = records.iter().find_map(|record| match record {
        Record::Attachment { name, data, .. } if name == "pair.toml" => Some(data.clone()),
        _ => None,
    });
    assert_eq!(attachment.as_deref(), Some(common::PAIR_TOML.as_bytes()));
    let mut samples = 0;
    for record in &records {
        if let Record::Angles { batch, publish_time_ns, .. } = record {
            assert_eq!(batch.first_sample, samples);
            assert_eq!(*publish_time_ns, batch.t0_ns);
            samples += batch.samples().unwrap().count() as u64;
        }
    }
    assert_eq!(samples, statistics.samples);
}

#[test]
fn runs_are_told_by_time_direction_and_load() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    write(&path, &SMALL).unwrap();
    let runs = read_runs(&path).unwrap();
    let seen: Vec<_> = runs.iter().map(|run| (run.direction, run.load_nm, run.samples, run.losses)).collect();
    use Direction::{Ccw, Cw};
    assert_eq!(seen, [(Ccw, 5.0, 1500, 0), (Cw, 5.0, 1500, 0), (Ccw, 10.0, 1500, 0), (Cw, 10.0, 1500, 0)]);
    for run in &runs {
        assert_eq!(run.theta1_rad.len(), 1500);
        let sense = run.direction.sign();
        assert!(run.theta1_rad.windows(2).all(|pair| (pair[1] - pair[0]) * sense > 0.0));
        assert!((run.revolutions - 1.25 * 1499.0 / 1500.0).abs() < 1e-5);
        let te_rad: Vec<_> = run.theta1_rad.iter().zip(&run.theta2_rad).map(|(t1, t2)| t2 - common::f(*t1)).collect();
        let peak = te_rad.iter().fold(0.0f64, |peak, te| peak.max(te.abs()));
        assert!((3.9e-4..4.2e-4).contains(&peak), "{peak}");
    }
    // The first run begins after homing and settling, 2 x 120 samples of 1 ms.
    assert!((runs[0].time_s[0] - 0.240).abs() < 1e-12);
    assert!((runs[0].time_s[1] - 0.241).abs() < 1e-12);
}

#[test]
fn lost_samples_are_counted_to_their_run() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    write(&path, &common::Plan { lose: 17, ..SMALL }).unwrap();
    let info = info(&path).unwrap();
    assert_eq!(info.runs.iter().map(|run| run.losses).collect::<Vec<_>>(), [17, 0, 0, 0]);
    assert_eq!((info.losses, info.losses_in_file), (17, 17));
}

#[test]
fn info_says_what_is_in_the_log() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let statistics = write(&path, &SMALL).unwrap();
    let info = info(&path).unwrap();
    assert_eq!(info.library, "riglog tests");
    assert_eq!(info.bytes, statistics.bytes);
    assert_eq!(info.samples, 6000);
    assert_eq!(info.samples_in_file, statistics.samples);
    assert_eq!(info.metadata["rig.run"]["backend"], "sim");
    assert_eq!(info.encoders, Some(common::encoders()));
    assert_eq!(info.attachments[0].bytes, common::PAIR_TOML.len() as u64);
    assert_eq!(info.channels.iter().map(|channel| channel.messages).sum::<u64>(), statistics.messages);
    assert!((info.duration_s - 6.7).abs() < 0.2, "{}", info.duration_s);
    assert!(info.completeness.is_complete());
}

/// A log with one run of two batches, the second at `second_ns`.
fn two_batches(path: &Path, second_ns: u64) {
    let mut log = LogWriter::create(path, common::options()).unwrap();
    let state = |phase: Phase, at_ns| RigState {
        timestamp: Some(Timestamp::from_ns(at_ns)),
        phase: phase.into(),
        direction: proto::Direction::Ccw.into(),
        ..Default::default()
    };
    let batch = |first_sample, t0_ns| AngleBatch {
        first_sample,
        t0_ns,
        dt_ns: 10,
        input_delta: vec![0, 1],
        output_delta: vec![0, 1],
        ..Default::default()
    };
    log.angles(1, 1000, &batch(0, 1000)).unwrap();
    log.angles(2, second_ns, &batch(2, second_ns)).unwrap();
    // The states stand behind the samples that they are about.
    log.state(3, 1010, &state(Phase::Record, 1010)).unwrap();
    log.state(4, 1030, &state(Phase::Stopping, 1030)).unwrap();
    log.finish().unwrap();
}

#[test]
fn without_encoders_runs_are_counted_but_give_no_angles() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    two_batches(&path, 1020);
    let info = info(&path).unwrap();
    assert_eq!((info.runs.len(), info.runs[0].samples, info.runs[0].revolutions), (1, 2, None));
    let text = read_runs(&path).unwrap_err().to_string();
    assert!(text.contains("rig.encoders") && text.contains("a.mcap"), "{text}");
}

#[test]
fn time_that_runs_backwards_is_an_error_with_both_times() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    two_batches(&path, 990);
    let text = info(&path).unwrap_err().to_string();
    assert!(text.contains("1010 ns") && text.contains("990 ns") && text.contains("sample 2"), "{text}");
}

#[test]
fn an_existing_file_and_one_that_is_being_written_are_left_alone() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let log = LogWriter::create(&path, common::options()).unwrap();
    assert!(matches!(LogWriter::create(&path, common::options()), Err(LogError::Exists { .. })));
    assert!(matches!(recover(&path), Err(LogError::Locked { .. })));
    // Header, schemas and channels are there from the first moment on.
    let (records, completeness) = read(&path);
    assert!(records.is_empty() && matches!(completeness, Completeness::Truncated { .. }));
    log.finish().unwrap();
    assert!(recover(&path).unwrap().already_complete);
}

#[test]
fn other_files_are_refused_by_what_they_are() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("x");
    for (content, said) in [(&b""[..], "0 bytes"), (b"time_s,theta1_rad\n", "time_s,t")] {
        std::fs::write(&path, content).unwrap();
        let text = LogReader::open(&path).err().unwrap().to_string();
        assert!(text.contains(said) && text.contains("not an MCAP file"), "{text}");
    }
    let text = LogReader::open(directory.path()).err().unwrap().to_string();
    assert!(text.contains("directory"), "{text}");
    let mut foreign = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    let channel = foreign.add_channel(0, "/imu", "json", &BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    foreign.write_to_known_channel(&header, b"{}").unwrap();
    foreign.finish().unwrap();
    std::fs::write(&path, foreign.into_inner().into_inner()).unwrap();
    let text = LogReader::open(&path).err().unwrap().to_string();
    assert!(text.contains("no rig channels") && text.contains("/imu"), "{text}");
}

#[test]
fn the_public_reader_sees_the_same_messages_and_summary() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let statistics = write(&path, &SMALL).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let stats = summary.stats.clone().unwrap();
    assert_eq!(stats.message_count, statistics.messages);
    assert_eq!(u64::from(stats.chunk_count), statistics.chunks);
    assert_eq!((stats.attachment_count, stats.metadata_count, stats.channel_count), (1, 3, 5));
    let (mut samples, mut count, mut bounds) = (0, 0, (u64::MAX, 0));
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        count += 1;
        bounds = (bounds.0.min(message.log_time), bounds.1.max(message.log_time));
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!(schema.encoding, "protobuf");
        if message.channel.topic == "/rig/angles" {
            samples += AngleBatch::decode(&message.data[..]).unwrap().len() as u64;
        }
    }
    assert_eq!((count, samples), (statistics.messages, statistics.samples));
    assert_eq!(bounds, (stats.message_start_time, stats.message_end_time));
    // Random access by chunk and message indexes gives the same messages again.
    let mut indexed = 0;
    for chunk in &summary.chunk_indexes {
        assert!(chunk.message_start_time > 0, "no empty chunk that would date the log to 1970");
        let mut of_chunk = 0;
        for (channel, entries) in summary.read_message_indexes(&bytes, chunk).unwrap() {
            for entry in entries {
                let message = summary.seek_message(&bytes, chunk, &entry).unwrap();
                assert_eq!((message.channel.id, message.log_time), (channel.id, entry.log_time));
                of_chunk += 1;
            }
        }
        indexed += of_chunk;
    }
    assert_eq!(indexed, statistics.messages);
    let attachment = mcap::read::attachment(&bytes, &summary.attachment_indexes[0]).unwrap();
    assert_eq!(attachment.data, common::PAIR_TOML.as_bytes());
}

#[test]
fn logs_of_another_writer_are_read_chunked_or_not_and_however_compressed() {
    let (zstd, lz4) = (Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4));
    for (use_chunks, compression) in [(true, zstd), (true, lz4), (true, None), (false, None)] {
        let options = mcap::WriteOptions::new().use_chunks(use_chunks).compression(compression);
        let mut out = options.create(Cursor::new(Vec::new())).unwrap();
        let topic = riglog::Topic::Angles;
        let schema = out.add_schema(topic.schema(), "protobuf", topic.descriptors()).unwrap();
        let channel = out.add_channel(schema, topic.name(), "protobuf", &BTreeMap::new()).unwrap();
        let other = out.add_channel(0, "/camera", "json", &BTreeMap::new()).unwrap();
        for sequence in 0..50u32 {
            let batch = AngleBatch {
                first_sample: u64::from(sequence) * 2,
                input_delta: vec![0, 1],
                output_delta: vec![0, 2],
                ..Default::default()
            };
            let header = mcap::records::MessageHeader { channel_id: channel, sequence, log_time: 9, publish_time: 8 };
            out.write_to_known_channel(&header, &batch.encode_to_vec()).unwrap();
            let header = mcap::records::MessageHeader { channel_id: other, ..header };
            out.write_to_known_channel(&header, b"{}").unwrap();
        }
        out.finish().unwrap();
        let bytes = out.into_inner().into_inner();
        let length = bytes.len() as u64;
        let mut reader = LogReader::over(Cursor::new(bytes), length, "foreign").unwrap();
        let records: Vec<_> = reader.by_ref().collect::<Result<_, _>>().unwrap();
        assert_eq!(records.len(), 100);
        assert!(matches!(&records[98], Record::Angles { batch, publish_time_ns: 8, .. } if batch.first_sample == 98));
        assert_eq!(records[99], Record::Unknown { topic: "/camera".into() });
        assert_eq!(reader.completeness(), Some(&Completeness::Complete), "{use_chunks} {compression:?}");
    }
}
