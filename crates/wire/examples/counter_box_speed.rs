//! Speed of the counter box codec, both ways, in batches of 100 samples.
//!
//! `cargo run --release -p wire --example counter_box_speed`

use std::hint::black_box;
use std::time::Instant;

use wire::counter_box::{Encoder, Frame, SampleFlags, Samples, StreamDecoder};

const BATCH: usize = 100;
const BATCHES: usize = 2000;
const ROUNDS: usize = 15;
/// A tenth of a million samples a second is what the fastest box sends; the goal leaves room for 300 of them.
const GOAL_PER_S: f64 = 30e6;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for (title, spread) in
        [("10 kS/s, 5 rpm, 3.6 M counts/rev: one byte a delta", 5), ("fast: two bytes a delta", 4000)]
    {
        let batches = batches(spread);
        let samples = (BATCH * BATCHES) as f64;
        let mut encoder = Encoder::new();
        let mut stream = Vec::new();
        let encode_s = best(|| {
            stream.clear();
            for batch in &batches {
                if encoder.samples(black_box(batch), &mut stream).is_err() {
                    return;
                }
            }
        });
        let mut frames = Vec::new();
        let decode_s = best(|| {
            frames.clear();
            let mut decoder = StreamDecoder::new();
            // As a port delivers it: in pieces that end anywhere.
            for piece in black_box(&stream).chunks(4096) {
                decoder.feed(piece, &mut frames);
            }
        });
        let same =
            frames.iter().zip(&batches).all(|(frame, batch)| matches!(frame, Frame::Samples(found) if found == batch));
        if frames.len() != batches.len() || !same {
            return Err("the decoded batches differ from the encoded ones".into());
        }
        println!("{title}: {:.2} bytes a sample", stream.len() as f64 / samples);
        for (way, seconds) in [("encode", encode_s), ("decode", decode_s)] {
            let rate = samples / seconds;
            println!("  {way} {:6.1} M samples/s, {:.1} times the goal", rate / 1e6, rate / GOAL_PER_S);
        }
    }
    Ok(())
}

/// Best of several rounds, s: the machine is shared.
fn best(mut work: impl FnMut()) -> f64 {
    (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

/// Batches with deltas around 30 counts or, with a wide spread, beyond one byte. A plain LCG: no dependency, same
/// numbers everywhere.
fn batches(spread: i32) -> Vec<Samples> {
    let mut state = 1u32;
    let mut delta = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        30 + (state >> 16) as i32 % spread
    };
    let mut column = || (0..BATCH).map(|n| if n == 0 { 0 } else { delta() }).collect::<Vec<i32>>();
    (0..BATCHES)
        .map(|n| Samples {
            sequence: n as u32,
            device_time_ns: n as u64 * 10_000_000,
            dt_ns: 100_000,
            first_sample: (n * BATCH) as u64,
            flags: SampleFlags(0),
            input_base: n as i64 * 3000,
            output_base: n as i64 * 2900,
            input_delta: column(),
            output_delta: column(),
            ..Samples::default()
        })
        .collect()
}
