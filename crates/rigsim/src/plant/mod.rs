//! The simulated rig's mechanics in the time domain: the truth against which measurement and diagnosis are checked.
//!
//! Servo with reduction, input shaft, two gears with backlash in exact tooth contact, output shaft, powder brake, two
//! encoders. It shares no formula with the gear model: contact of the flanks is solved exactly ([`Flank`], displaced
//! rack-generated teeth), encoder discs and couplings read what their geometry says, and loads wind up real springs.
//!
//! | part | file |
//! |---|---|
//! | pitch curves, tooth contact, its table over the angle, elastic mesh | `geometry`, `flank`, `table`, `mesh` |
//! | errors, damage, wear and stiffness of single teeth | `teeth` |
//! | five inertias and the integrator | `chain` |
//! | servo drive | `servo` |
//! | powder brake, its hysteresis, its stick-slip | `brake`, `hysteresis`, `stick_slip` |
//! | encoders, counters, skew between them, a soft coupling | `encoder`, `skew`, `resonance` |
//! | displacements of a reading that no known effect makes | `reading_error` |
//! | bearings' run-out, slipping clamp, lost counts | `run_out`, `slippage` |
//! | faults that the nominal model does not know | [`faults`] |
//! | everything put together and advanced sample by sample | `assembly` |
//!
//! Same specification, seed and sequence of calls give the same samples, bit for bit.

mod assembly;
mod brake;
mod chain;
mod encoder;
mod error;
pub mod faults;
mod flank;
mod geometry;
mod hysteresis;
mod mesh;
mod reading_error;
mod resonance;
mod run_out;
mod servo;
mod skew;
mod slippage;
mod spec;
mod stick_slip;
mod table;
mod teeth;
#[cfg(test)]
mod tests;

pub use assembly::{Plant, Sample, Truth};
pub use brake::{BrakeCurvePoint, BrakeSpec, STICK_SLIP_LIMIT_RPM};
pub use encoder::{CountLossSpec, EncoderSpec, EncodersSpec};
pub use error::PlantError;
pub use faults::{FAULTS, UNMODELLED_FAULTS};
pub use flank::Flank;
pub use geometry::GearSpec;
pub use mesh::{BearingSpec, DEFAULT_MESH_COMPLIANCE_MM2_RAD_PER_NM, HousingSpec, MeshSpec};
pub use reading_error::{Abscissa, ReadingError, Weight};
pub use resonance::SoftCouplingSpec;
pub use run_out::NoiseSpec;
pub use servo::DriveSpec;
pub use slippage::ClampSpec;
pub use spec::{
    DEFAULT_SHAFT_COMPLIANCE_INPUT_RAD_PER_NM, DEFAULT_SHAFT_COMPLIANCE_OUTPUT_RAD_PER_NM, PlantSpec, ShaftSpec,
};
pub use teeth::{DamageSpec, ProfileOrder, ToothSpec};
