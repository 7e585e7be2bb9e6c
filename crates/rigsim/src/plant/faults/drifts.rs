//! What changes while the rig runs: a housing that warms up, teeth that wear.

use super::fault::Fault;
use super::parameters::Parameters;
use super::signature::{Accumulation, Signature};

/// The housing warms up after the start and moves the gears apart as 1 − exp(−t/τ), by 20 µm with a time constant of 60 s.
pub const THERMAL_DRIFT: Fault = Fault {
    name: "thermal_drift",
    summary: "centre distance grows 20 µm within minutes",
    usual: |_| Parameters::of(&[("da_mm", 0.02), ("tau_s", 60.0)]),
    vary: |_, usual, rng| usual.with("tau_s", rng.spread(60.0, 600.0)),
    amounts: &[("da_mm", 1.0)],
    develops: true,
    signature: Some(Signature { accumulation: Some(Accumulation::PerTime), ..Signature::OPEN }),
    same_trace_as: None,
    apply: |spec, parameters| {
        spec.housing.growth_mm = parameters.number("da_mm");
        spec.housing.time_constant_s = parameters.number("tau_s");
    },
};

/// The teeth wear: the backlash grows by 0.05 µm per driver revolution and N·m.
pub const WEAR_DRIFT: Fault = Fault {
    name: "wear_drift",
    summary: "teeth wear by 0.05 µm per revolution and N·m",
    usual: |_| Parameters::of(&[("dj_mm_per_rev_nm", 5e-5)]),
    vary: |_, usual, _| usual,
    amounts: &[("dj_mm_per_rev_nm", 1.0)],
    develops: true,
    signature: Some(Signature { accumulation: Some(Accumulation::PerRevolution), ..Signature::OPEN }),
    same_trace_as: None,
    apply: |spec, parameters| spec.teeth.wear_mm_per_rev_nm += parameters.number("dj_mm_per_rev_nm"),
};
