//! Encoders that a profile may name and that cannot measure transmission error, with the reason in figures.

/// The transmission error that shall be told apart, rad: two arc seconds, a tenth of what good gears have.
pub const TE_ASKED_RAD: f64 = 10e-6;

/// Speed at which the source document measures, rpm.
const MEASURING_RPM: f64 = 5.0;

/// An encoder that is polled over a bus.
struct Polled {
    driver: &'static str,
    title: &'static str,
    /// Counts a revolution at its finest.
    counts_per_rev: f64,
    /// Time that an answer's age is uncertain by, s.
    age_s: f64,
}

/// Absolute encoders with an RS-485 Modbus port: 10 to 15 bits a turn as sold; an answer takes milliseconds at their baud rates.
const POLLED: [Polled; 1] =
    [Polled { driver: "briter-rs485", title: "Briter-like RS-485 encoders", counts_per_rev: 32_768.0, age_s: 1e-3 }];

/// Why an encoder is refused; `None` for one that is not known to be unfit.
#[must_use]
pub fn reason(driver: &str) -> Option<String> {
    let polled = POLLED.iter().find(|polled| polled.driver == driver)?;
    let step_rad = std::f64::consts::TAU / polled.counts_per_rev;
    // Both shafts are asked one after the other: dθ = ω·dt.
    let skew_rad = MEASURING_RPM * std::f64::consts::TAU / 60.0 * polled.age_s;
    Some(format!(
        "is refused for TE: {} have at most {} counts a turn, a step of {:.0} µrad where TE is asked to {:.0} µrad, and are polled one after the other ({:.0} µrad at {MEASURING_RPM} rpm for each ms of unknown age); use encoders whose counts are latched together (counter-box)",
        polled.title,
        polled.counts_per_rev,
        step_rad * 1e6,
        TE_ASKED_RAD * 1e6,
        skew_rad * 1e6,
    ))
}

/// Whether counters of these counts a revolution tell `te_rad` apart: a step of each adds to TE = θ2 − f(θ1).
///
/// # Errors
/// The step of both together, rad, when it is larger.
pub fn check_resolution(counts_per_rev: [u64; 2], te_rad: f64) -> Result<f64, f64> {
    let step_rad: f64 = counts_per_rev.iter().map(|counts| std::f64::consts::TAU / (*counts as f64)).sum();
    if step_rad <= te_rad { Ok(step_rad) } else { Err(step_rad) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_has_the_figures() {
        let said = reason("briter-rs485").expect("refused");
        assert!(said.contains("192 µrad") && said.contains("10 µrad") && said.contains("524 µrad"), "{said}");
        assert_eq!(reason("counter-box"), None);
    }

    #[test]
    fn resolution_from_both_sides() {
        // Two encoders of 2π/5e-6 counts have steps of 5 µrad each.
        let counts = (std::f64::consts::TAU / 5e-6) as u64;
        assert!(check_resolution([counts + 1; 2], 10e-6).is_ok());
        assert!(check_resolution([counts - 1; 2], 10e-6).is_err());
    }
}
