//! θ2 was read dt later than θ1, and by then has moved on: TE = dt·dθ2/dt = dt·i·dθ1/dt.

use super::{Carrier, Effect, Estimate, NominalRig, OperatingPoint, Parameter, Parity, Shape, Signature, Words};

/// θ2 was read dt later than θ1, and by then has moved on.
pub(super) struct TimeSkew;

impl Effect for TimeSkew {
    fn name(&self) -> &'static str {
        "time_skew"
    }

    fn component(&self) -> &'static str {
        "acquisition"
    }

    fn words(&self) -> Words {
        Words::new("time skew between the channels", "latch both encoders with one strobe, or correct the delay")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::Odd).with_speed(Some(1.0))
    }

    fn applies(&self, _rig: &NominalRig) -> bool {
        true
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = at.ratio * at.speed_rad_per_s;
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("dt_s", found.beta[0], found.std(0), "s")]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["dt_s"]
    }
}
