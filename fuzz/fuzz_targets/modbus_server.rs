//! A Modbus server and whatever a line may carry. Splitting the bytes otherwise must not change the requests, and each must encode.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wire::modbus::{Incoming, ServerDecoder, ServerFrame, encode_request};

fn served(bytes: &[u8], piece: usize) -> (Vec<ServerFrame>, ServerDecoder) {
    let (mut decoder, mut frames) = (ServerDecoder::new(), Vec::new());
    for part in bytes.chunks(piece.max(1)) {
        decoder.feed(part, &mut frames);
    }
    frames.extend(decoder.idle());
    (frames, decoder)
}

fuzz_target!(|data: &[u8]| {
    let [piece, bytes @ ..] = data else { return };
    let (whole, mut decoder) = served(bytes, usize::MAX);
    let (split, _) = served(bytes, usize::from(*piece));
    assert_eq!(whole, split);
    for frame in &whole {
        if let Incoming::Request(request) = &frame.incoming {
            // Counts are the device's to judge, so that not all of them encode; none may panic.
            let _ = encode_request(frame.unit, request);
        }
    }
    // After a silence a good request is understood, whatever came before.
    let good = [0x01, 0x03, 0x02, 0x00, 0x00, 0x02, 0xC5, 0xB3];
    let mut frames = Vec::new();
    decoder.feed(&good, &mut frames);
    assert_eq!(frames.len(), 1);
});
