//! What an effect is called by those who work at the rig.

/// Plain words for an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Words {
    /// What it is, in a few words.
    pub plain_name: &'static str,
    /// What to do about it on the rig.
    pub remedy: &'static str,
    /// What it and the effect that differs from it in the shaft alone are called together.
    pub family: Option<&'static str>,
}

/// What leaves one and the same trace, so that no run can tell it from another of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SharedTrace {
    /// Play of teeth or bearings: the same on every pair.
    Play,
    /// Once a turn of either encoder, of the clocking and of k: the same on an elliptic pair.
    TurnOfAnEllipse,
}

impl Words {
    /// Words of an effect without such a sibling.
    #[must_use]
    pub const fn new(plain_name: &'static str, remedy: &'static str) -> Self {
        Self { plain_name, remedy, family: None }
    }

    /// The same for one of two that differ in the shaft alone.
    #[must_use]
    pub const fn of_family(mut self, family: &'static str) -> Self {
        self.family = Some(family);
        self
    }
}
