//! A log that is sound as a file and whose messages, metadata and times are anything: what lies behind checksums and compression, which
//! mutations of a file seldom get past. Reading, streaming, auditing, following and grouping give errors or results, never a panic.
#![no_main]

use std::collections::BTreeMap;
use std::io::Cursor;
use std::ops::ControlFlow;

use libfuzzer_sys::fuzz_target;
use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};
use riglog::{EncoderMetadata, Follower, LogParts, PartMetadata, RunStream, RunVisitor, SampleBlock, Topic, audit, info, read_runs};

struct Count(u64);

impl RunVisitor for Count {
    fn samples(&mut self, _: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
        self.0 += block.time_ns.len() as u64;
        ControlFlow::Continue(())
    }
}

/// A log whose records `data` chooses: kind, length, times, content.
fn log(mut data: &[u8]) -> Option<Vec<u8>> {
    let options = WriteOptions::new().compression(None).library("fuzzed");
    let mut writer = options.create(Cursor::new(Vec::new())).ok()?;
    let mut channels = Vec::new();
    for topic in Topic::ALL {
        let schema = writer.add_schema(topic.schema(), "protobuf", topic.descriptors()).ok()?;
        channels.push(writer.add_channel(schema, topic.name(), "protobuf", &BTreeMap::new()).ok()?);
    }
    while let [kind, sequence, a, b, c, d, length, rest @ ..] = data {
        let (content, rest) = rest.split_at(usize::from(*length).min(rest.len()));
        data = rest;
        // Mostly times that go on; now and then the ends of the range.
        let time = |n: u8, m: u8| match n {
            255 => u64::MAX - u64::from(m),
            n => u64::from(n) * 1_000_000_000 + u64::from(m) * 1_000_000,
        };
        match usize::from(kind % 8) {
            topic @ 0..=4 => {
                let header = MessageHeader {
                    channel_id: channels[topic],
                    sequence: u32::from(*sequence),
                    log_time: time(*a, *b),
                    publish_time: time(*c, *d),
                };
                writer.write_to_known_channel(&header, content).ok()?;
            }
            5 => {
                let number = |n: usize| content.get(n..n + 8).map_or(1, |b| i64::from_le_bytes(b.try_into().unwrap_or([0; 8])));
                let keys = [
                    "input_counts_per_rev", "output_counts_per_rev", "input_lines", "output_lines", "input_index_counts",
                    "output_index_counts", "input_sign", "output_sign",
                ];
                let metadata = keys.iter().enumerate().map(|(n, key)| ((*key).to_owned(), number(8 * n).to_string())).collect();
                writer.write_metadata(&Metadata { name: EncoderMetadata::NAME.into(), metadata }).ok()?;
            }
            6 => {
                let text = String::from_utf8_lossy(content).into_owned();
                let metadata = [("log_id", "x".to_owned()), ("part", sequence.to_string()), ("first_sample", text)];
                let metadata = metadata.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
                writer.write_metadata(&Metadata { name: PartMetadata::NAME.into(), metadata }).ok()?;
            }
            _ => writer.flush().ok()?,
        }
    }
    writer.finish().ok()?;
    Some(writer.into_inner().into_inner())
}

fuzz_target!(|data: &[u8]| {
    let Some(bytes) = log(data) else { return };
    // A directory, for what a recovery sets aside goes with it.
    let directory = tempfile::tempdir().expect("a directory");
    let path = &directory.path().join("log.mcap");
    std::fs::write(path, &bytes).expect("room");
    if let Ok(stream) = RunStream::open_parts(LogParts::alone(path)) {
        let mut count = Count(0);
        if let Ok(totals) = stream.stream(&mut count) {
            assert_eq!(totals.samples(), count.0);
        }
    }
    let _ = info(path).map_err(|error| error.to_string());
    let _ = read_runs(path).map_err(|error| error.to_string());
    if let Ok(audited) = audit(&LogParts::alone(path)) {
        audited.findings.iter().for_each(|finding| drop(finding.what.clone()));
    }
    let mut records = 0;
    if let Ok(mut follower) = Follower::open(path) {
        let _ = follower.poll(|_| records += 1);
    }
});
