//! Measures the log: `cargo run --release -p riglog --example throughput [SAMPLES] [SAMPLES_A_SECOND] [LEVEL...]`.
//!
//! Writes counts as the simulated rig has them, 100 samples a message, and reads them back as records and as angles.

use std::{env, error::Error, hint::black_box, ops::ControlFlow, path::Path, time::Instant};

use riglog::{
    BatchBuilder, EncoderMetadata, LogReader, LogWriter, Record, RunStream, RunVisitor, SampleBlock, WriterOptions,
    proto::{AngleBatch, Direction, Phase, RigState, Timestamp},
};

const START_NS: u64 = 1_790_000_000_000_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let mut numbers = env::args().skip(1);
    let samples: u64 = numbers.next().map_or(Ok(10_000_000), |n| n.parse())?;
    let rate_hz: u64 = numbers.next().map_or(Ok(10_000), |n| n.parse())?;
    let mut levels: Vec<i32> = numbers.map(|n| n.parse()).collect::<Result<_, _>>()?;
    if levels.is_empty() {
        levels.push(WriterOptions::new("").compression_level);
    }
    let batches = batches(samples, 1_000_000_000 / rate_hz);
    let directory = env::temp_dir().join(format!("riglog-throughput-{}", std::process::id()));
    std::fs::create_dir_all(&directory)?;
    for level in levels {
        let path = directory.join(format!("level{level}.mcap"));
        let started = Instant::now();
        let bytes = write(&path, &batches, level)?;
        let speed = samples as f64 / started.elapsed().as_secs_f64() / 1e6;
        println!("level {level:2}: write {speed:6.1} M samples/s, {:.2} B a sample", bytes as f64 / samples as f64);
        let (read, angles) = (read(&path)?, stream(&path)?);
        println!("          read {read:6.1} M samples/s as batches, {angles:.1} M samples/s as angles of runs");
    }
    std::fs::remove_dir_all(directory)?;
    Ok(())
}

/// Input deltas of 60 ± 4 counts; the ratio of an elliptic pair swings the output deltas over 30..120.
fn batches(samples: u64, dt_ns: u64) -> Vec<AngleBatch> {
    let mut builder = BatchBuilder::new(100);
    let (mut input, mut output, mut noise) = (0i64, 0i64, 0x2545_F491_4F6C_DD1Du64);
    let mut out = Vec::new();
    for n in 0..samples {
        noise ^= noise << 13;
        noise ^= noise >> 7;
        noise ^= noise << 17;
        let ratio = (1.0 - 0.3287f64.powi(2)) / (1.0 + 0.3287f64.powi(2) - 2.0 * 0.3287 * (n as f64 * 5.24e-5).cos());
        input += 60 + (noise % 9) as i64 - 4;
        output += (60.0 * ratio) as i64 + (noise >> 32) as i64 % 9 - 4;
        out.extend(builder.push(n, START_NS + n * dt_ns, input, output));
    }
    out.extend(builder.take());
    out
}

fn write(path: &Path, batches: &[AngleBatch], level: i32) -> Result<u64, Box<dyn Error>> {
    let options = WriterOptions { compression_level: level, ..WriterOptions::new("throughput") };
    let mut log = LogWriter::create(path, options)?;
    log.encoders(&EncoderMetadata {
        input_counts_per_rev: 7_200_000,
        output_counts_per_rev: 7_200_000,
        input_lines: 18_000,
        output_lines: 18_000,
        input_index_counts: 0,
        output_index_counts: 0,
        input_sign: 1,
        output_sign: 1,
    })?;
    let state = RigState {
        timestamp: Some(Timestamp::from_ns(START_NS)),
        phase: Phase::Record.into(),
        direction: Direction::Ccw.into(),
        ..Default::default()
    };
    log.state(START_NS, START_NS, &state)?;
    for batch in batches {
        log.angles(batch.t0_ns, batch.t0_ns, batch)?;
    }
    Ok(log.finish()?.bytes)
}

fn read(path: &Path) -> Result<f64, Box<dyn Error>> {
    let (started, mut samples, mut sum) = (Instant::now(), 0, 0i64);
    for record in LogReader::open(path)? {
        if let Record::Angles { batch, .. } = record? {
            samples += batch.len();
            sum = batch.samples()?.fold(sum, |sum, (_, input, output)| sum ^ input ^ output);
        }
    }
    black_box(sum);
    Ok(samples as f64 / started.elapsed().as_secs_f64() / 1e6)
}

fn stream(path: &Path) -> Result<f64, Box<dyn Error>> {
    struct Sum(f64);
    impl RunVisitor for Sum {
        fn samples(&mut self, _: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
            self.0 += block.theta2_rad.iter().zip(block.theta1_rad).map(|(b, a)| b - a).sum::<f64>();
            ControlFlow::Continue(())
        }
    }
    let (started, mut sum) = (Instant::now(), Sum(0.0));
    let totals = RunStream::open(path)?.stream(&mut sum)?;
    black_box(sum.0);
    Ok(totals.samples() as f64 / started.elapsed().as_secs_f64() / 1e6)
}
