//! A Modbus client and whatever a line may answer, in whatever pieces. What it takes as an answer must encode to the bytes it took.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wire::modbus::{ClientDecoder, Request, encode_request, encode_response};

fuzz_target!(|data: &[u8]| {
    let [unit, kind, a, b, c, d, piece, answer @ ..] = data else { return };
    let (address, value) = (u16::from_be_bytes([*a, *b]), u16::from_be_bytes([*c, *d]));
    let request = match kind % 3 {
        0 => Request::ReadHolding { address, count: value % 130 },
        1 => Request::WriteSingle { address, value },
        _ => Request::WriteMultiple { address, values: vec![value; usize::from(*d % 130)] },
    };
    if encode_request(*unit, &request).is_err() {
        return;
    }
    let mut decoder = ClientDecoder::new(*unit, &request);
    for part in answer.chunks(usize::from(*piece).max(1)) {
        match decoder.feed(part) {
            Ok(None) => {}
            Ok(Some(response)) => {
                let bytes = encode_response(*unit, request.function(), &response).expect("what was decoded can be encoded");
                assert_eq!(bytes, decoder.received(), "{request:?} {response:?}");
                return;
            }
            Err(error) => {
                let _ = error.to_string();
                return;
            }
        }
    }
});
