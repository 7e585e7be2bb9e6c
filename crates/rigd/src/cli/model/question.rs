//! What `te` and `backlash` are asked: a pair, methods, a load, and angles.

use super::curve::Sampling;
use super::error::ModelError;
use super::method::Method;
use super::output::Output;
use super::source::{Loaded, Source};
use crate::quantity::TORQUE;

/// Arguments that both commands share.
#[derive(Debug, clap::Args)]
pub struct Question {
    #[command(flatten)]
    source: Source,
    /// How; several separated by commas stand side by side
    #[arg(long, value_enum, value_delimiter = ',', default_value = "common_normal")]
    pub method: Vec<Method>,
    /// Torque on the driven shaft, as `10Nm`, against the sense of rotation: winds up the documented compliances
    #[arg(long, default_value = "0Nm")]
    load: String,
    /// Angles
    #[command(flatten)]
    pub sampling: Sampling,
    /// Where the answer goes
    #[command(flatten)]
    pub output: Output,
}

/// A question with its words turned into numbers.
pub struct Asked {
    /// The pair.
    pub pair: Loaded,
    /// Load on the driven shaft, N·m.
    pub load_nm: f64,
    /// Driver angles, rad.
    pub theta1_rad: Vec<f64>,
}

impl Question {
    /// Reads everything that can be wrong, before anything is computed.
    ///
    /// # Errors
    /// [`ModelError`] says what is asked for in vain.
    pub fn ask(&self) -> Result<Asked, ModelError> {
        self.output.check(&[])?;
        let load_nm = TORQUE.parse(&self.load)?;
        let theta1_rad = self.sampling.angles_rad()?;
        Ok(Asked { pair: self.source.load()?, load_nm, theta1_rad })
    }
}
