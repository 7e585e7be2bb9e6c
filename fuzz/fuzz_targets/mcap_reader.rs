//! Any bytes as a log: reading, surveying, streaming and recovering give errors, never a panic; what is recovered is whole and holds
//! as many messages as were readable.
#![no_main]

use std::io::Cursor;
use std::ops::ControlFlow;

use libfuzzer_sys::fuzz_target;
use riglog::{LogReader, RunStream, RunVisitor, SampleBlock, recover};

struct Count(u64);

impl RunVisitor for Count {
    fn samples(&mut self, _: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
        self.0 += block.time_ns.len() as u64;
        ControlFlow::Continue(())
    }
}

fn read(bytes: &[u8]) {
    let Ok(mut reader) = LogReader::over(Cursor::new(bytes), bytes.len() as u64, "fuzzed") else { return };
    while let Some(record) = reader.next() {
        if let Err(error) = record {
            let _ = error.to_string();
        }
    }
    assert!(reader.completeness().is_some());
}

fuzz_target!(|data: &[u8]| {
    read(data);
    // Mutations seldom keep the magic: with it, the records behind are reached.
    if !data.starts_with(&MAGIC) {
        read(&[&MAGIC[..], data].concat());
    }
    // A directory, for what the recovery sets aside goes with it.
    let directory = tempfile::tempdir().expect("a directory");
    let path = &directory.path().join("log.mcap");
    std::fs::write(path, data).expect("room");
    if let Ok(stream) = RunStream::open(path) {
        let mut count = Count(0);
        if let Ok(totals) = stream.stream(&mut count) {
            assert_eq!(totals.samples(), count.0);
        }
    }
    let before = riglog::info(path);
    if let (Ok(done), Ok(before)) = (recover(path), before) {
        let after = riglog::info(path).expect("what was recovered is readable");
        let sum = |info: &riglog::LogInfo| info.channels.iter().map(|channel| channel.messages).sum::<u64>();
        if !done.already_complete {
            assert!(after.completeness.is_complete(), "{:?}", after.completeness);
            assert_eq!(sum(&before), sum(&after));
        }
    }
});

const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];
