//! Whether a reported signature is the one that the fault leaves in truth, where theory is clear about it: the fault says what it
//! does, this file says it in the diagnosis' words.

use rigsim::plant::faults::{Accumulation, Carrier, Parity, find};
use serde_json::Value;

/// Exponents are right within this.
const EXPONENT_TOLERANCE: f64 = 0.3;

fn carrier_word(carrier: Carrier) -> &'static str {
    match carrier {
        Carrier::Input => "input",
        Carrier::Output => "output",
        Carrier::Mesh => "mesh",
        Carrier::EncoderLine => "encoder line",
    }
}

fn parity_word(parity: Parity) -> &'static str {
    match parity {
        Parity::Even => "even",
        Parity::Odd => "odd",
        Parity::OneFlank => "one flank",
    }
}

fn accumulation_word(accumulation: Accumulation) -> &'static str {
    match accumulation {
        Accumulation::None => "no",
        Accumulation::PerRevolution => "per revolution",
        Accumulation::PerTime => "per time",
    }
}

/// Whether a reported signature is right in all that theory says about the fault `name`; `None` where it says nothing.
#[must_use]
pub fn right(name: &str, reported: &Value) -> Option<bool> {
    let truth = find(name)?.signature?;
    let word = |field: &str, expected: Option<&str>| expected.is_none_or(|word| reported[field].as_str() == Some(word));
    let number = |field: &str, expected: Option<f64>| {
        expected
            .is_none_or(|value| reported[field].as_f64().is_some_and(|said| (said - value).abs() <= EXPONENT_TOLERANCE))
    };
    Some(
        word("carrier", truth.carrier.map(carrier_word))
            && word("parity", truth.parity.map(parity_word))
            && word("accumulates", truth.accumulation.map(accumulation_word))
            && number("load_exponent", truth.load_exponent)
            && number("speed_exponent", truth.speed_exponent),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn wrong_words_are_wrong() {
        let said = json!({"carrier": "input", "parity": "odd", "load_exponent": 0.1, "speed_exponent": 0.9, "accumulates": "no"});
        assert_eq!(right("time_skew", &said), Some(true));
        assert_eq!(right("backlash_error", &said), Some(false));
        assert_eq!(right("pitch_errors", &said), None);
        assert_eq!(right("slip", &json!({})), Some(false));
    }
}
