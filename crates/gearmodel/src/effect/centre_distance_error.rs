//! Centre distance grown by Δa against the documented one: gear 1 moves by (−Δa, 0) against gear 2,
//! TE = −dir·Δa tan(α ∓ μ)/r2.

use super::{Carrier, Effect, Estimate, NominalRig, OperatingPoint, Parameter, Parity, Shape, Signature, Words};

/// Centre distance grown by Δa against the documented one.
pub(super) struct CentreDistanceError;

impl Effect for CentreDistanceError {
    fn name(&self) -> &'static str {
        "centre_distance_error"
    }

    fn component(&self) -> &'static str {
        "housing"
    }

    fn words(&self) -> Words {
        Words::new("centre distance off its nominal value", "measure the centre distance and re-shim the housing")
    }

    fn signature(&self) -> Signature {
        Signature::steady(Carrier::Input, Parity::Mixed)
    }

    /// Where μ = 0 everywhere the two flanks lean alike, and nothing is left in common to both senses.
    fn signature_of(&self, rig: &NominalRig, _shape: &Shape) -> Signature {
        if rig.ratio_orders().is_empty() {
            Signature { parity: Parity::Odd, ..self.signature() }
        } else {
            self.signature()
        }
    }

    fn row(&self, _rig: &NominalRig, _shape: &Shape, at: &OperatingPoint, row: &mut [f64]) {
        row[0] = -at.sense * at.pressure_rad.tan() / at.r2_mm;
    }

    fn parameters(&self, _rig: &NominalRig, _shape: &Shape, found: &Estimate) -> Vec<Parameter> {
        vec![Parameter::number("da_mm", found.beta[0], found.std(0), "mm")]
    }

    fn parameter_names(&self) -> &'static [&'static str] {
        &["da_mm"]
    }
}
