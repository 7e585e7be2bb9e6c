//! The devices of a rig, as profiles, errors, the daemon and the simulated rig tell them apart.

/// The three devices of a rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DeviceKind {
    /// The servo drive.
    Servo,
    /// The brake's driver.
    Brake,
    /// The reader of the encoders.
    Counter,
}

impl DeviceKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Servo, Self::Brake, Self::Counter];

    /// As profiles, messages and errors call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Servo => "servo",
            Self::Brake => "brake",
            Self::Counter => "counter",
        }
    }
}

impl std::fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
