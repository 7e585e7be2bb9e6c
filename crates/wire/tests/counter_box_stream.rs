//! The counter box's stream over a bad line: split, damaged, lost and arbitrary bytes.

#![allow(clippy::unwrap_used)]

use proptest::prelude::*;
use wire::counter_box::{
    Ack, AckStatus, BoxStatus, Command, Encoder, Frame, Identity, SampleFlags, Samples, StreamDecoder,
};

fn samples() -> impl Strategy<Value = Samples> {
    let delta = prop_oneof![5 => -60..60i32, 1 => any::<i32>()];
    (
        any::<(u32, u64, u32, u64, u16)>(),
        any::<(i64, i64, i64, i64)>(),
        prop::collection::vec((delta.clone(), delta), 0..130),
    )
        .prop_map(|(head, counts, deltas)| {
            let column =
                |pick: fn(&(i32, i32)) -> i32| std::iter::once(0).chain(deltas.iter().map(pick)).collect::<Vec<i32>>();
            Samples {
                sequence: head.0,
                device_time_ns: head.1,
                dt_ns: head.2,
                first_sample: head.3,
                flags: SampleFlags(head.4),
                input_index_counts: counts.0,
                output_index_counts: counts.1,
                input_base: counts.2,
                output_base: counts.3,
                input_delta: column(|pair| pair.0),
                output_delta: column(|pair| pair.1),
            }
        })
}

fn frame() -> impl Strategy<Value = Frame> {
    prop_oneof![
        4 => samples().prop_map(Frame::Samples),
        1 => any::<u16>().prop_map(|request_id| Frame::Command(Command::Identify { request_id })),
        1 => any::<(u16, u32, u16)>().prop_map(|(request_id, sample_period_ns, samples_per_frame)| {
            Frame::Command(Command::Start { request_id, sample_period_ns, samples_per_frame })
        }),
        1 => any::<u16>().prop_map(|request_id| Frame::Command(Command::Stop { request_id })),
        1 => any::<(u16, u8)>().prop_map(|(request_id, code)| {
            Frame::Ack(Ack { request_id, status: AckStatus::from_code(code) })
        }),
        1 => (any::<(u16, u16, u64, u64, u32, u32)>(), any::<(u32, u16)>(), "\\PC{0,16}", "[ -~]{0,64}").prop_map(
            |(head, tail, serial, firmware)| Frame::Identity(Identity {
                request_id: head.0,
                protocol_version: head.1,
                input_counts_per_rev: head.2,
                output_counts_per_rev: head.3,
                input_lines: head.4,
                output_lines: head.5,
                max_sample_rate_hz: tail.0,
                status: BoxStatus(tail.1),
                serial,
                firmware,
            })
        ),
    ]
}

fn encoded(frames: &[Frame]) -> Vec<Vec<u8>> {
    let mut encoder = Encoder::new();
    frames
        .iter()
        .map(|frame| {
            let mut bytes = Vec::new();
            encoder.frame(frame, &mut bytes).unwrap();
            bytes
        })
        .collect()
}

fn decoded(bytes: &[u8]) -> (Vec<Frame>, StreamDecoder) {
    let mut decoder = StreamDecoder::new();
    let mut frames = Vec::new();
    decoder.feed(bytes, &mut frames);
    (frames, decoder)
}

fn batch(sequence: u32, first_sample: u64, len: usize) -> Frame {
    Frame::Samples(Samples {
        sequence,
        first_sample,
        dt_ns: 100_000,
        input_delta: vec![0; len],
        output_delta: vec![0; len],
        ..Samples::default()
    })
}

#[test]
fn a_lost_frame_is_counted_in_samples() {
    let stream = encoded(&[batch(0, 0, 100), batch(1, 100, 100), batch(2, 200, 50)]);
    let (frames, decoder) = decoded(&[stream[0].clone(), stream[2].clone()].concat());
    assert_eq!(frames.len(), 2);
    assert_eq!((decoder.stats().samples_lost, decoder.stats().sequence_gaps), (100, 1));
}

#[test]
fn an_overflow_in_the_box_jumps_samples_but_not_frames() {
    let (_, decoder) = decoded(&encoded(&[batch(0, 0, 100), batch(1, 700, 100)]).concat());
    assert_eq!((decoder.stats().samples_lost, decoder.stats().sequence_gaps), (600, 0));
}

#[test]
fn a_restart_is_not_a_loss() {
    let stream = encoded(&[batch(7, 700, 100), batch(0, 0, 100), batch(1, 100, 100)]).concat();
    let (frames, decoder) = decoded(&stream);
    assert_eq!(frames.len(), 3);
    assert_eq!((decoder.stats().samples_lost, decoder.stats().sequence_gaps), (0, 0));
}

#[test]
fn a_stream_without_delimiters_stays_bounded() {
    let mut decoder = StreamDecoder::new();
    let mut frames = Vec::new();
    for _ in 0..1000 {
        decoder.feed(&[0x55; 4096], &mut frames);
    }
    let good = encoded(&[batch(0, 0, 3)]).concat();
    decoder.feed(&[0], &mut frames);
    decoder.feed(&good, &mut frames);
    assert_eq!(frames, [batch(0, 0, 3)]);
    assert_eq!(decoder.stats().malformed, 1);
    assert_eq!(decoder.stats().bytes_skipped, 1000 * 4096);
}

proptest! {
    #[test]
    fn any_split_gives_the_same_frames(
        frames in prop::collection::vec(frame(), 1..6),
        pieces in prop::collection::vec(1..200usize, 1..8),
    ) {
        let bytes = encoded(&frames).concat();
        let mut decoder = StreamDecoder::new();
        let mut found = Vec::new();
        let mut rest = bytes.as_slice();
        for &len in pieces.iter().cycle() {
            let (head, tail) = rest.split_at(len.min(rest.len()));
            decoder.feed(head, &mut found);
            rest = tail;
            if rest.is_empty() {
                break;
            }
        }
        prop_assert_eq!(&found, &frames);
        prop_assert_eq!(decoder.stats().frames, frames.len() as u64);
        prop_assert_eq!((decoder.stats().crc_errors, decoder.stats().malformed), (0, 0));
    }

    #[test]
    fn a_damaged_byte_costs_its_frame_and_never_changes_one(
        frames in prop::collection::vec(frame(), 3..=3),
        at in any::<prop::sample::Index>(),
        flip in 1..=255u8,
    ) {
        let mut stream = encoded(&frames);
        let at = at.index(stream[1].len());
        stream[1][at] ^= flip;
        let (found, decoder) = decoded(&stream.concat());
        // The frame before survives. The one after too, unless the damage ate the delimiter between them.
        prop_assert_eq!(&found[0], &frames[0]);
        let survivors: &[Frame] = if at + 1 == stream[1].len() { &frames[..1] } else { &[frames[0].clone(), frames[2].clone()] };
        prop_assert_eq!(&found, survivors);
        prop_assert!(decoder.stats().crc_errors + decoder.stats().malformed >= 1);
    }

    #[test]
    fn arbitrary_bytes_never_panic_and_the_decoder_recovers(
        noise in prop::collection::vec(prop_oneof![3 => any::<u8>(), 1 => Just(0)], 0..2000),
        good in frame(),
    ) {
        let mut bytes = noise;
        bytes.push(0);
        bytes.extend(encoded(std::slice::from_ref(&good)).concat());
        let (found, _) = decoded(&bytes);
        prop_assert_eq!(found.last(), Some(&good));
    }
}
