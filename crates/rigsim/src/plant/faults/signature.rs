//! What a fault does to the measured transmission error in truth, from theory and in words of the rig: the oracle of whoever
//! judges a diagnosis. A field is open where theory is not clear or a word would be a matter of taste.

/// What the error repeats with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    /// Turns of the driver.
    Input,
    /// Turns of the driven shaft.
    Output,
    /// Teeth that pass.
    Mesh,
    /// Lines of an encoder's disc that pass.
    EncoderLine,
}

/// How the error of one sense is related to that of the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// The same in both.
    Even,
    /// Of opposite sign.
    Odd,
    /// In one of them alone: the other runs on other flanks.
    OneFlank,
}

/// Whether the error grows as the rig runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accumulation {
    /// Every revolution is like the one before.
    None,
    /// With revolutions.
    PerRevolution,
    /// With time.
    PerTime,
}

/// What a fault does to the measured transmission error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signature {
    /// What it repeats with.
    pub carrier: Option<Carrier>,
    /// How the senses are related.
    pub parity: Option<Parity>,
    /// It grows with this power of the load.
    pub load_exponent: Option<f64>,
    /// It grows with this power of the speed.
    pub speed_exponent: Option<f64>,
    /// Whether it grows as the rig runs.
    pub accumulation: Option<Accumulation>,
}

impl Signature {
    /// Nothing is clear.
    pub const OPEN: Self =
        Self { carrier: None, parity: None, load_exponent: None, speed_exponent: None, accumulation: None };

    /// The same at every load and speed, and in every revolution.
    pub const STEADY: Self = Self {
        load_exponent: Some(0.0),
        speed_exponent: Some(0.0),
        accumulation: Some(Accumulation::None),
        ..Self::OPEN
    };

    /// [`Self::STEADY`], alike in both senses.
    pub const STEADY_EVEN: Self = Self { parity: Some(Parity::Even), ..Self::STEADY };

    /// [`Self::STEADY`], of opposite sign in the two senses.
    pub const STEADY_ODD: Self = Self { parity: Some(Parity::Odd), ..Self::STEADY };

    /// Wound up by the load: proportional to it, and against the sense.
    pub const WINDUP: Self = Self { load_exponent: Some(1.0), ..Self::STEADY_ODD };

    /// The same, repeating with `carrier`.
    #[must_use]
    pub const fn over(self, carrier: Carrier) -> Self {
        Self { carrier: Some(carrier), ..self }
    }
}
