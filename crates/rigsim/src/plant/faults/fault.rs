//! What a fault is: its name, its size, how it is drawn, and how it enters the plant.

use super::fault_rng::FaultRng;
use super::parameters::Parameters;
use super::signature::Signature;
use crate::plant::spec::PlantSpec;

/// A fault that the plant can have.
#[derive(Debug, Clone, Copy)]
pub struct Fault {
    /// The name under which the diagnosis knows it.
    pub name: &'static str,
    /// A line with its usual size.
    pub summary: &'static str,
    /// Its parameters at the usual size on a plant.
    pub usual: fn(&PlantSpec) -> Parameters,
    /// The usual parameters with all but the size at random: phases, places, signs.
    pub vary: fn(&PlantSpec, Parameters, &mut FaultRng) -> Parameters,
    /// The parameters that carry its size, and the power of the size with which each goes.
    pub amounts: &'static [(&'static str, f64)],
    /// Whether what it adds changes from revolution to revolution.
    pub develops: bool,
    /// What it does in truth, where theory is clear about it.
    pub signature: Option<Signature>,
    /// The fault whose trace on the built-in pair it leaves as well, so that no analysis can tell the two apart.
    pub same_trace_as: Option<&'static str>,
    /// Puts it into a plant.
    pub apply: fn(&mut PlantSpec, &Parameters),
}

impl Fault {
    /// Puts the fault into a plant at its usual size.
    pub fn apply_usual(&self, spec: &mut PlantSpec) {
        let parameters = (self.usual)(spec);
        (self.apply)(spec, &parameters);
    }

    /// Whether no analysis can tell it from the other, or it is the other.
    #[must_use]
    pub fn is_confusable_with(&self, other: &Self) -> bool {
        self.same_trace_as.unwrap_or(self.name) == other.same_trace_as.unwrap_or(other.name)
    }

    /// Its parameters at the usual size, phases and places at random.
    pub fn draw(&self, spec: &PlantSpec, rng: &mut FaultRng) -> Parameters {
        (self.vary)(spec, (self.usual)(spec), rng)
    }
}

/// Varies nothing but the phase: for faults whose only other parameter is their size.
pub fn any_phase(_: &PlantSpec, usual: Parameters, rng: &mut FaultRng) -> Parameters {
    usual.with("phase_rad", rng.angle())
}
