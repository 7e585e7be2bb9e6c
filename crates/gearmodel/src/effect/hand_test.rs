//! Tests by hand: they tell apart what one set-up cannot.

/// A test that needs hands on the rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandTest {
    /// The output encoder turned by half a turn on its shaft.
    TurnOutputEncoder,
    /// The same of the input encoder.
    TurnInputEncoder,
    /// The driven shaft pressed sideways in its bearings.
    PressDrivenShaft,
    /// The driven shaft watched under the highest load.
    WatchDrivenShaft,
    /// The input coupling swapped or realigned.
    SwapInputCoupling,
    /// The output coupling swapped or realigned.
    SwapOutputCoupling,
    /// The seals taken off.
    FreeSeals,
    /// Gear 2 re-indexed by a quarter of its teeth.
    ReindexGear2,
}

impl HandTest {
    /// In the order in which they are tried.
    pub const ALL: [Self; 8] = [
        Self::TurnOutputEncoder,
        Self::TurnInputEncoder,
        Self::PressDrivenShaft,
        Self::WatchDrivenShaft,
        Self::SwapInputCoupling,
        Self::SwapOutputCoupling,
        Self::FreeSeals,
        Self::ReindexGear2,
    ];

    /// What to do, and what it shows.
    #[must_use]
    pub fn action(self) -> &'static str {
        match self {
            Self::TurnOutputEncoder => {
                "turn the output encoder by 180 deg on its shaft and repeat one run: the trace turns its sign if \
                 that encoder is the cause, and stays if it is the input encoder, the clocking or the pitch \
                 curve"
            }
            Self::TurnInputEncoder => {
                "turn the input encoder by 180 deg on its shaft and repeat one run: an eccentric disc turns the \
                 sign of its trace, clocking and pitch curve do not"
            }
            Self::PressDrivenShaft => {
                "press the driven shaft sideways in its bearings with an indicator on it: play shows there, thin \
                 teeth do not; or preload the bearings and repeat one run in both senses"
            }
            Self::WatchDrivenShaft => {
                "put an indicator on the driven shaft beside the gear and repeat the highest load: bearings that \
                 give way move the shaft, teeth do not"
            }
            Self::SwapInputCoupling => {
                "swap the input coupling for the output one, or realign it, and repeat one run: order 2 follows \
                 the coupling or stays"
            }
            Self::SwapOutputCoupling => {
                "swap the output coupling for the input one, or realign it, and repeat one run: order 2 follows \
                 the coupling or stays"
            }
            Self::FreeSeals => {
                "take the seals off and repeat one run in both senses: drag goes with them, backlash stays"
            }
            Self::ReindexGear2 => {
                "re-index gear 2 by a quarter of its teeth and repeat one run in both senses: what belongs to \
                 gear 1 stays where it is against the driver's angle, what belongs to gear 2 moves"
            }
        }
    }
}
