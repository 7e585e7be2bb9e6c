//! Bytes of counter box protocol version 1, as shipped.
//!
//! If a test in this module fails, do not change the test: boxes in the field speak these bytes. Change the code, or
//! give the new format a new version with a module of its own. The examples are those of `docs/wire/counter-box.md`.

#![allow(clippy::unwrap_used)]

use wire::counter_box::{
    Ack, AckStatus, BoxStatus, Command, Encoder, Frame, Identity, PROTOCOL_VERSION, SampleFlags, Samples, StreamDecoder,
};

#[track_caller]
fn frozen(frame: &Frame, hex: &str) {
    let expected: Vec<u8> = hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
    let mut bytes = Vec::new();
    Encoder::new().frame(frame, &mut bytes).unwrap();
    let printed: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    assert_eq!(bytes, expected, "encoder gives {}", printed.join(" "));
    let mut frames = Vec::new();
    StreamDecoder::new().feed(&expected, &mut frames);
    assert_eq!(frames, std::slice::from_ref(frame), "decoder");
}

#[test]
fn version() {
    assert_eq!(PROTOCOL_VERSION, 1);
}

#[test]
fn identify() {
    frozen(&Frame::Command(Command::Identify { request_id: 1 }), "03 01 01 05 64 82 98 E7 00");
}

#[test]
fn start() {
    let command = Command::Start { request_id: 2, sample_period_ns: 100_000, samples_per_frame: 100 };
    frozen(&Frame::Command(command), "03 02 02 04 A0 86 01 02 64 05 4F A6 4D 14 00");
}

#[test]
fn stop() {
    frozen(&Frame::Command(Command::Stop { request_id: 0x1234 }), "08 03 34 12 F4 E5 94 B5 00");
}

#[test]
fn ack_done() {
    frozen(&Frame::Ack(Ack { request_id: 2, status: AckStatus::Done }), "03 82 02 01 05 C2 75 90 65 00");
}

#[test]
fn ack_refused() {
    frozen(&Frame::Ack(Ack { request_id: 3, status: AckStatus::BadPeriod }), "03 82 03 06 01 63 2F 55 13 00");
}

#[test]
fn identity() {
    let identity = Identity {
        request_id: 1,
        protocol_version: 1,
        input_counts_per_rev: 3_600_000,
        output_counts_per_rev: 3_600_000,
        input_lines: 9000,
        output_lines: 9000,
        max_sample_rate_hz: 100_000,
        status: BoxStatus(BoxStatus::RUNNING),
        serial: "CB-0001".to_owned(),
        firmware: "1.0.0".to_owned(),
    };
    frozen(
        &Frame::Identity(identity),
        "03 81 01 02 01 04 80 EE 36 01 01 01 01 04 80 EE 36 01 01 01 01 03 28 23 \
         01 03 28 23 01 04 A0 86 01 02 01 13 07 43 42 2D 30 30 30 31 05 31 2E 30 \
         2E 30 CB AB B3 56 00",
    );
}

#[test]
fn samples() {
    let samples = Samples {
        sequence: 7,
        device_time_ns: 1_000_000_000,
        dt_ns: 100_000,
        first_sample: 700,
        flags: SampleFlags(SampleFlags::INPUT_INDEX | SampleFlags::OVERFLOW),
        input_index_counts: 123_456,
        output_index_counts: -1,
        input_base: 200_000,
        output_base: -5,
        input_delta: vec![0, 30, 31, 64],
        output_delta: vec![0, -1, 0, -8192],
    };
    frozen(
        &Frame::Samples(samples),
        "03 83 07 01 01 01 04 CA 9A 3B 01 01 01 04 A0 86 01 03 BC 02 01 01 01 01 \
         01 02 05 04 40 E2 01 01 01 01 01 0C FF FF FF FF FF FF FF FF 40 0D 03 01 \
         01 01 01 0A FB FF FF FF FF FF FF FF 04 01 05 3C 3E 80 01 02 01 07 FF 7F \
         42 A1 C9 1E 00",
    );
}
