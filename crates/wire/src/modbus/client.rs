//! The client's side: exactly one answer to exactly one request, checked in every field that it has.

use super::pdu::{ExceptionCode, Request, Response};
use super::response_error::ResponseError;
use super::{function, split_crc, words};
use crate::Hex;

/// Collects and checks the answer to one request. Make a new one for each request.
///
/// The length of the answer follows from the request, so nothing is guessed from gaps: a USB adapter may deliver the
/// bytes in any pieces. The checks run in the order CRC, unit, function, echo, so that damage is called damage.
#[derive(Debug, Clone)]
pub struct ClientDecoder {
    unit: u8,
    request: Request,
    buffer: Vec<u8>,
    answered: bool,
}

impl ClientDecoder {
    /// For the answer of `unit` to `request`.
    pub fn new(unit: u8, request: &Request) -> Self {
        let buffer = Vec::with_capacity(request.response_len());
        Self { unit, request: request.clone(), buffer, answered: false }
    }

    /// Bytes that have arrived so far.
    pub fn received(&self) -> &[u8] {
        &self.buffer
    }

    /// Takes bytes as they arrive. `None` means that the answer is not complete yet.
    ///
    /// # Errors
    /// [`ResponseError`] when the bytes are not the answer to the request. The decoder is of no further use then.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<Option<Response>, ResponseError> {
        self.buffer.extend_from_slice(bytes);
        if self.answered && bytes.is_empty() {
            return Ok(None);
        }
        let Some(expected) = self.expected_len()? else {
            return Ok(None);
        };
        if self.buffer.len() > expected {
            return Err(ResponseError::TooLong {
                request: self.request.clone(),
                found: self.buffer.len(),
                expected,
                bytes: self.hex(),
            });
        }
        if self.buffer.len() < expected {
            return Ok(None);
        }
        let response = self.check()?;
        self.answered = true;
        Ok(Some(response))
    }

    fn hex(&self) -> Hex {
        Hex::from(self.buffer.as_slice())
    }

    /// Length of the frame as soon as its head tells; `None` while the head is incomplete.
    fn expected_len(&self) -> Result<Option<usize>, ResponseError> {
        let Some(&found) = self.buffer.get(1) else {
            return Ok(None);
        };
        let expected = self.request.function();
        if found == expected | function::EXCEPTION_BIT {
            return Ok(Some(5));
        }
        if found != expected {
            return Err(ResponseError::WrongFunction {
                request: self.request.clone(),
                found,
                expected,
                bytes: self.hex(),
            });
        }
        if let Request::ReadHolding { count, .. } = self.request {
            let Some(&found) = self.buffer.get(2) else {
                return Ok(None);
            };
            let expected = u8::try_from(2 * u32::from(count)).unwrap_or(u8::MAX);
            if found != expected {
                return Err(ResponseError::WrongByteCount {
                    request: self.request.clone(),
                    found,
                    expected,
                    bytes: self.hex(),
                });
            }
        }
        Ok(Some(self.request.response_len()))
    }

    /// Checks a frame of the right length.
    fn check(&self) -> Result<Response, ResponseError> {
        let request = || self.request.clone();
        let Some((body, found, expected)) = split_crc(&self.buffer) else {
            // Not reachable: every expected length is at least 5.
            return Err(ResponseError::TooLong { request: request(), found: 0, expected: 0, bytes: self.hex() });
        };
        if found != expected {
            return Err(ResponseError::CrcMismatch { request: request(), found, expected, bytes: self.hex() });
        }
        if body[0] != self.unit {
            return Err(ResponseError::WrongUnit {
                request: request(),
                found: body[0],
                expected: self.unit,
                bytes: self.hex(),
            });
        }
        if body[1] & function::EXCEPTION_BIT != 0 {
            return Ok(Response::Exception(ExceptionCode::from_code(body[2])));
        }
        let (expected_address, expected_value, response) = match &self.request {
            Request::ReadHolding { .. } => return Ok(Response::Registers(words(&body[3..]))),
            Request::WriteSingle { address, value } => {
                (*address, *value, Response::WroteSingle { address: *address, value: *value })
            }
            Request::WriteMultiple { address, .. } => {
                let count = self.request.count();
                (*address, count, Response::WroteMultiple { address: *address, count })
            }
        };
        let found_address = u16::from_be_bytes([body[2], body[3]]);
        let found_value = u16::from_be_bytes([body[4], body[5]]);
        if (found_address, found_value) != (expected_address, expected_value) {
            return Err(ResponseError::WrongEcho {
                request: request(),
                found_address,
                expected_address,
                found_value,
                expected_value,
                bytes: self.hex(),
            });
        }
        Ok(response)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modbus::encode_response;

    const READ: Request = Request::ReadHolding { address: 0x0058, count: 2 };

    fn answer(unit: u8, function: u8, response: &Response) -> Vec<u8> {
        encode_response(unit, function, response).unwrap()
    }

    #[test]
    fn good_answers() {
        let mut decoder = ClientDecoder::new(1, &READ);
        let registers = Response::Registers(vec![0x00B1, 0x1F40]);
        let bytes = answer(1, 3, &registers);
        assert_eq!(decoder.feed(&bytes[..4]), Ok(None));
        assert_eq!(decoder.feed(&bytes[4..]), Ok(Some(registers)));
        assert_eq!(decoder.feed(&[]), Ok(None));
    }

    #[test]
    fn exception_is_a_good_answer() {
        let exception = Response::Exception(ExceptionCode::ServerDeviceBusy);
        let bytes = answer(1, 3, &exception);
        assert_eq!(ClientDecoder::new(1, &READ).feed(&bytes), Ok(Some(exception)));
    }

    #[test]
    fn wrong_unit_function_count_echo_and_length() {
        let good = answer(1, 3, &Response::Registers(vec![1, 2]));
        let feed = |request: &Request, bytes: &[u8]| ClientDecoder::new(1, request).feed(bytes);
        let other_unit = answer(2, 3, &Response::Registers(vec![1, 2]));
        assert!(matches!(feed(&READ, &other_unit), Err(ResponseError::WrongUnit { found: 2, expected: 1, .. })));
        assert!(matches!(feed(&READ, &[1, 4, 4]), Err(ResponseError::WrongFunction { found: 4, .. })));
        let longer = answer(1, 3, &Response::Registers(vec![1, 2, 3]));
        assert!(matches!(feed(&READ, &longer), Err(ResponseError::WrongByteCount { found: 6, expected: 4, .. })));
        let twice = [good.clone(), good].concat();
        assert!(matches!(feed(&READ, &twice), Err(ResponseError::TooLong { found: 18, expected: 9, .. })));

        let write = Request::WriteSingle { address: 0x0112, value: 5 };
        let echo = answer(1, 6, &Response::WroteSingle { address: 0x0112, value: 6 });
        assert!(matches!(feed(&write, &echo), Err(ResponseError::WrongEcho { found_value: 6, .. })));
        let write = Request::WriteMultiple { address: 0x0112, values: vec![5, 6] };
        let echo = answer(1, 16, &Response::WroteMultiple { address: 0x0114, count: 2 });
        assert!(matches!(feed(&write, &echo), Err(ResponseError::WrongEcho { found_address: 0x0114, .. })));
    }

    #[test]
    fn the_echo_of_a_read_request_is_no_answer() {
        let echo = crate::modbus::encode_request(1, &READ).unwrap();
        assert!(matches!(
            ClientDecoder::new(1, &READ).feed(&echo),
            Err(ResponseError::WrongByteCount { found: 0, expected: 4, .. })
        ));
    }

    #[test]
    fn bytes_after_the_answer_are_an_error_that_shows_them() {
        let mut decoder = ClientDecoder::new(1, &READ);
        decoder.feed(&answer(1, 3, &Response::Registers(vec![1, 2]))).unwrap();
        let error = decoder.feed(&[0xAA]).unwrap_err().to_string();
        assert!(error.contains("10 bytes instead of 9") && error.ends_with("ask again"), "{error}");
        assert!(error.contains("01 03 04 00 01 00 02"), "{error}");
    }
}
