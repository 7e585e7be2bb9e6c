//! The counter box's stream and whatever a line may carry. Splitting must not change the frames, each must survive a round trip, and
//! a good frame after the damage must be found.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wire::counter_box::{Command, Encoder, Frame, StreamDecoder};

fn decoded(bytes: &[u8], piece: usize) -> (Vec<Frame>, StreamDecoder) {
    let (mut decoder, mut frames) = (StreamDecoder::new(), Vec::new());
    for part in bytes.chunks(piece.max(1)) {
        decoder.feed(part, &mut frames);
    }
    (frames, decoder)
}

fuzz_target!(|data: &[u8]| {
    let [piece, bytes @ ..] = data else { return };
    let (whole, mut decoder) = decoded(bytes, usize::MAX);
    let (split, other) = decoded(bytes, usize::from(*piece));
    assert_eq!(whole, split);
    assert_eq!(decoder.stats(), other.stats());
    let mut encoder = Encoder::new();
    for frame in &whole {
        let mut again = Vec::new();
        if encoder.frame(frame, &mut again).is_ok() {
            let (frames, _) = decoded(&again, usize::MAX);
            assert_eq!(frames, std::slice::from_ref(frame));
        }
        if let Frame::Samples(samples) = frame {
            let _ = samples.input_counts().count() + samples.output_counts().count();
        }
    }
    let good = Frame::Command(Command::Stop { request_id: 7 });
    let (mut tail, mut frames) = (vec![0], Vec::new());
    encoder.frame(&good, &mut tail).expect("a command encodes");
    decoder.feed(&tail, &mut frames);
    assert_eq!(frames.last(), Some(&good));
});
