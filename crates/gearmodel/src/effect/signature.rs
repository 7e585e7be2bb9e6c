//! How an effect shows: the row that a person reads on a residual before knowing its cause.

use serde::Serialize;

/// What the trace repeats with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Carrier {
    /// Angle of the driver.
    Input,
    /// Angle of the driven shaft.
    Output,
    /// Tooth mesh.
    Mesh,
    /// Line period of an encoder.
    #[serde(rename = "encoder line")]
    EncoderLine,
    /// Time.
    Time,
    /// Nothing.
    None,
}

/// How the trace of one sense stands to that of the other at equal θ1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Parity {
    /// The same in both senses.
    Even,
    /// Opposite.
    Odd,
    /// Both parts.
    Mixed,
    /// In one sense only.
    #[serde(rename = "one flank")]
    OneFlank,
}

/// Whether the trace grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Accumulates {
    /// With every revolution.
    #[serde(rename = "per revolution")]
    PerRevolution,
    /// With time.
    #[serde(rename = "per time")]
    PerTime,
    /// Not at all.
    No,
}

/// The signature row of an effect or of a residual.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Signature {
    /// What it repeats with.
    pub carrier: Carrier,
    /// How it behaves when the sense turns.
    pub parity: Parity,
    /// p in trace ∝ load^p; `None` where the data cannot tell.
    pub load_exponent: Option<f64>,
    /// p in trace ∝ speed^p; `None` where the data cannot tell.
    pub speed_exponent: Option<f64>,
    /// Whether it grows.
    pub accumulates: Accumulates,
    /// Sector of the driver's turn, deg from and to, where the trace is local.
    pub sector_deg: Option<[f64; 2]>,
}

impl Signature {
    /// A trace that is the same at every load and speed and every time.
    #[must_use]
    pub const fn steady(carrier: Carrier, parity: Parity) -> Self {
        Self {
            carrier,
            parity,
            load_exponent: Some(0.0),
            speed_exponent: Some(0.0),
            accumulates: Accumulates::No,
            sector_deg: None,
        }
    }

    /// The same, growing as load^`exponent`.
    #[must_use]
    pub const fn with_load(mut self, exponent: f64) -> Self {
        self.load_exponent = Some(exponent);
        self
    }

    /// The same, growing as speed^`exponent`.
    #[must_use]
    pub const fn with_speed(mut self, exponent: Option<f64>) -> Self {
        self.speed_exponent = exponent;
        self
    }

    /// The same, accumulating.
    #[must_use]
    pub const fn accumulating(mut self, accumulates: Accumulates) -> Self {
        self.accumulates = accumulates;
        self
    }
}
