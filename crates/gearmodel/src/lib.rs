//! Transmission error and backlash of circular and non-circular gear pairs.
//!
//! The crate holds the physics and the analysis of measurements: no input or output, no async; long sums share the cores (rayon).
//! Angles are in rad, lengths in mm, torque in N·m unless a name says otherwise.
//!
//! Conventions, used by every function, log and plot:
//!
//! - The centre line lies along +x, the driver at the origin, the driven gear at (a, 0). The driver turns
//!   counter-clockwise, the driven shaft clockwise, and its angle θ2 counts positive in its own sense of motion, so that
//!   the transmission function θ2 = f(θ1) increases.
//! - TE = θ2 measured − f(θ1 measured), positive when the driven gear is ahead.
//! - [`Direction`] names the driver's sense of rotation and with it the active flank. TE of both senses is counted in the
//!   same positive sense of θ2, so that backlash = TE_cw − TE_ccw at equal θ1.
//!
//! Reading order, which is the order of the layers: no module uses one that stands after it.
//!
//! | layer | modules |
//! |---|---|
//! | names and plain data | [`Direction`], [`Gear`], the specs ([`ToothSpec`] …), what a file states of an effect ([`effect::Stated`]) |
//! | what can be wrong with numbers | [`GeometryError`], [`Errors`] |
//! | the pair | [`pitch_curve`] → [`GearPair`], free curves → flanks → tips → tooth check → [`Outline`] |
//! | the errors of a pair | [`increment`] (first order), [`contact`] (exact), [`loaded`], [`phase`] |
//! | what stands between model and rig | [`effect`]: the rig → what an effect is → the effects → their list → documented ones |
//! | the nominal model | [`NominalModel`] → [`sensitivity`], [`tolerance`]; [`PairFile`] → [`sweep`] |
//! | the measurement | [`measure`] → [`recording`], [`calibration`] |
//!
//! What is inferred from measurements stands in the crate `diagnosis`. The theory stands in [`theory`], page by page.

pub mod calibration;
pub mod contact;
mod direction;
pub mod effect;
mod errors;
mod flank;
mod free;
mod gear;
mod geometry_error;
pub mod increment;
pub mod loaded;
pub mod measure;
mod model;
mod outline;
mod pair;
mod pair_file;
pub mod phase;
pub mod pitch_curve;
pub mod recording;
pub mod sensitivity;
mod spec;
mod stated;
pub mod sweep;
#[cfg(doc)]
pub mod theory;
mod tip;
mod tip_reach;
pub mod tolerance;
mod tooth_check;

pub use direction::{Direction, ParseDirectionError};
pub use errors::Errors;
pub use gear::Gear;
pub use geometry_error::GeometryError;
pub use model::NominalModel;
pub use outline::Outline;
pub use pair::{GearPair, MeshPoint, RollPoint};
pub use pair_file::{PairFile, PairFileError, PairSpec};
pub use spec::{CircularSpec, CurveSpec, EllipticalSpec, ToothSpec};
