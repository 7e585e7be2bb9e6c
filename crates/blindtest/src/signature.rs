//! The signature that a single effect must leave, where theory is clear about it: what it runs over, how it changes with the sense,
//! with load and speed, and whether it accumulates.

use serde_json::Value;

/// Exponents are right within this.
const EXPONENT_TOLERANCE: f64 = 0.3;

/// What theory says; `None` where a word would be a matter of taste.
struct Row {
    name: &'static str,
    carrier: Option<&'static str>,
    parity: Option<&'static str>,
    load: Option<f64>,
    speed: Option<f64>,
    accumulates: Option<&'static str>,
}

const fn row(
    name: &'static str,
    carrier: Option<&'static str>,
    parity: Option<&'static str>,
    load: Option<f64>,
    speed: Option<f64>,
    accumulates: Option<&'static str>,
) -> Row {
    Row { name, carrier, parity, load, speed, accumulates }
}

const NO: Option<&str> = Some("no");
const EVEN: Option<&str> = Some("even");
const ODD: Option<&str> = Some("odd");
const ZERO: Option<f64> = Some(0.0);
const ONE: Option<f64> = Some(1.0);

const ROWS: &[Row] = &[
    row("gear1_eccentricity", None, None, ZERO, ZERO, NO),
    row("gear2_eccentricity", None, None, ZERO, ZERO, NO),
    row("centre_distance_error", None, None, ZERO, ZERO, NO),
    row("backlash_error", None, ODD, ZERO, ZERO, NO),
    row("bearing_clearance", None, ODD, ZERO, ZERO, NO),
    row("friction_windup", None, ODD, ZERO, ZERO, NO),
    row("pitch_curve_error", None, EVEN, ZERO, ZERO, NO),
    row("phasing_error", None, EVEN, ZERO, ZERO, NO),
    row("encoder1_eccentricity", None, EVEN, ZERO, ZERO, NO),
    row("encoder2_eccentricity", None, EVEN, ZERO, ZERO, NO),
    row("encoder1_ellipticity", Some("input"), EVEN, ZERO, ZERO, NO),
    row("encoder2_ellipticity", Some("output"), EVEN, ZERO, ZERO, NO),
    row("coupling_misalignment_input", Some("input"), EVEN, ZERO, ZERO, NO),
    row("coupling_misalignment_output", Some("output"), EVEN, ZERO, ZERO, NO),
    row("encoder1_interpolation", Some("encoder line"), None, None, None, NO),
    row("encoder2_interpolation", Some("encoder line"), None, None, None, NO),
    row("profile_error", Some("mesh"), EVEN, ZERO, ZERO, NO),
    row("mesh_stiffness_variation", Some("mesh"), None, ONE, ZERO, NO),
    row("tooth_damage", None, Some("one flank"), ZERO, ZERO, NO),
    row("time_skew", None, ODD, ZERO, ONE, NO),
    row("shaft_compliance_input", None, ODD, ONE, ZERO, NO),
    row("shaft_compliance_output", None, ODD, ONE, ZERO, NO),
    row("mesh_compliance", None, ODD, ONE, ZERO, NO),
    row("bearing_compliance", None, ODD, ONE, ZERO, NO),
    row("brake_torque_ripple", Some("output"), ODD, ONE, ZERO, NO),
    row("torsional_resonance", None, EVEN, ZERO, Some(2.0), NO),
    row("slip", None, None, None, None, Some("per revolution")),
    row("wear_drift", None, None, None, None, Some("per revolution")),
    row("thermal_drift", None, None, None, None, Some("per time")),
];

/// Whether a reported signature is right in all that theory says about `name`; `None` where it says nothing.
#[must_use]
pub fn right(name: &str, signature: &Value) -> Option<bool> {
    let row = ROWS.iter().find(|row| row.name == name)?;
    let word =
        |field: &str, expected: Option<&str>| expected.is_none_or(|word| signature[field].as_str() == Some(word));
    let number = |field: &str, expected: Option<f64>| {
        expected.is_none_or(|value| {
            signature[field].as_f64().is_some_and(|said| (said - value).abs() <= EXPONENT_TOLERANCE)
        })
    };
    Some(
        word("carrier", row.carrier)
            && word("parity", row.parity)
            && word("accumulates", row.accumulates)
            && number("load_exponent", row.load)
            && number("speed_exponent", row.speed),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigsim::plant::FAULTS;
    use serde_json::json;

    #[test]
    fn every_row_is_an_effect_and_wrong_words_are_wrong() {
        assert!(ROWS.iter().all(|row| FAULTS.iter().any(|effect| effect.name == row.name)));
        let said = json!({"carrier": "input", "parity": "odd", "load_exponent": 0.1, "speed_exponent": 0.9, "accumulates": "no"});
        assert_eq!(right("time_skew", &said), Some(true));
        assert_eq!(right("backlash_error", &said), Some(false));
        assert_eq!(right("pitch_errors", &said), None);
        assert_eq!(right("slip", &json!({})), Some(false));
    }
}
