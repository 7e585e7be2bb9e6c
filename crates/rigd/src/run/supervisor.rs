//! The safety supervisor: what may turn, and in which order everything is switched off. Pure: state × event → state + actions.
//!
//! Whoever drives the rig tells it events and performs its actions (`stopping.rs`). The order of a stop: ramp to 0 under load →
//! standstill, confirmed by the encoders → brake to 0 → servo off. [`table`] writes the whole machine down; docs/safety.md holds it.

use std::fmt::Write as _;

/// What the rig is allowed to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum State {
    /// Servo off, brake at zero: the only state in which a session may end.
    #[default]
    Off,
    /// The drive's watchdog was read back, or its lack accepted: the servo may be switched on.
    Watched,
    /// Servo on; no speed was commanded since.
    Standing,
    /// A speed was commanded: the shafts may turn.
    Turning,
    /// Speed 0 was commanded under load; standstill is awaited from the encoders.
    Ramping,
    /// The servo cannot be reached and the shafts may turn: the brake holds its load within its heat account.
    Holding,
    /// The brake is being set to zero.
    Releasing,
    /// The servo is being switched off.
    Disabling,
}

/// What happens to the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Event {
    /// The drive's watchdog was read back, or its lack accepted by the operator.
    WatchdogKnown,
    /// The servo said that it is on.
    ServoOn,
    /// A speed is about to be commanded.
    Motion,
    /// All runs are recorded, or a pause is due.
    Finished,
    /// Ctrl-C, SIGTERM, SIGHUP or `rigd stop`.
    OperatorStop,
    /// A limit of the profile was exceeded.
    Limit,
    /// The emergency stop was pressed: the drive has taken the torque away by itself.
    EmergencyStop,
    /// No command reached the servo for longer than the lease.
    LeaseExpired,
    /// The servo does not answer.
    ServoLost,
    /// The brake's driver does not answer, or has switched itself off.
    BrakeLost,
    /// The encoders are silent.
    EncodersLost,
    /// Anything else that ends a run: an alarm of the drive, the log, a defect of this program.
    Fault,
    /// The operator asked for the stop again: skip the ramp.
    Hurry,
    /// The encoders say that the shafts stand still.
    Still,
    /// Standstill was not confirmed in time.
    NoStandstill,
    /// The brake has no room for more heat.
    HeatSpent,
    /// The servo answers again.
    ServoBack,
    /// The brake confirmed zero current.
    BrakeAtZero,
    /// It did not.
    BrakeUnanswered,
    /// The servo confirmed that it is off.
    ServoIsOff,
    /// It did not.
    ServoUnanswered,
}

/// What has to be done about it, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Action {
    /// Command speed 0; the load stays.
    ZeroSpeed,
    /// Leave the brake's load as it is and watch its heat.
    HoldLoad,
    /// Brake to zero current, output off.
    BrakeToZero,
    /// Servo off.
    ServoOff,
    /// Say that the emergency stop has to be pressed and the drive switched off by hand.
    CallPerson,
}

impl State {
    /// Every state.
    pub const ALL: [Self; 8] = [
        Self::Off,
        Self::Watched,
        Self::Standing,
        Self::Turning,
        Self::Ramping,
        Self::Holding,
        Self::Releasing,
        Self::Disabling,
    ];

    /// A stop is under way.
    #[must_use]
    pub fn is_stopping(self) -> bool {
        matches!(self, Self::Ramping | Self::Holding | Self::Releasing | Self::Disabling)
    }

    /// The next state, and what to do on the way. An event that means nothing in a state changes nothing.
    #[must_use]
    pub fn on(self, event: Event) -> (Self, &'static [Action]) {
        use Action::{BrakeToZero, CallPerson, HoldLoad, ServoOff, ZeroSpeed};
        match (self, event) {
            (Self::Off, Event::WatchdogKnown) => (Self::Watched, &[]),
            (Self::Watched, Event::ServoOn) => (Self::Standing, &[]),
            (Self::Standing, Event::Motion) => (Self::Turning, &[]),

            // Nothing was ever asked to turn; everything is switched off all the same, whatever it is believed to be.
            (Self::Off | Self::Watched, stop) if stop.is_stop() => (Self::Releasing, &[BrakeToZero]),
            (Self::Standing, stop) if stop.is_stop() => (Self::Releasing, &[ZeroSpeed, BrakeToZero]),

            // Requests may still arrive where answers do not. Its own watchdog is what stops it, within lease and ramp.
            (Self::Turning | Self::Ramping, Event::ServoLost) => (Self::Holding, &[ZeroSpeed, HoldLoad]),
            (Self::Turning, stop) if stop.is_stop() => (Self::Ramping, &[ZeroSpeed]),

            (Self::Ramping | Self::Holding, Event::Still) => (Self::Releasing, &[BrakeToZero]),
            // Torque off first, so that the load brakes what still turns.
            (Self::Ramping, Event::NoStandstill | Event::Hurry) => (Self::Releasing, &[ServoOff, BrakeToZero]),

            (Self::Holding, Event::ServoBack) => (Self::Ramping, &[ZeroSpeed]),
            (Self::Holding, Event::NoStandstill) => (Self::Holding, &[CallPerson]),
            (Self::Holding, Event::HeatSpent) => (Self::Releasing, &[CallPerson, BrakeToZero]),
            (Self::Holding, Event::BrakeLost | Event::Hurry) => (Self::Releasing, &[CallPerson, BrakeToZero]),

            (Self::Releasing, Event::BrakeAtZero | Event::BrakeUnanswered) => (Self::Disabling, &[ServoOff]),
            (Self::Disabling, Event::ServoIsOff | Event::ServoUnanswered) => (Self::Off, &[]),
            // Whatever it was told last, it is not to act on it.
            (Self::Releasing, Event::ServoBack) => (Self::Releasing, &[ServoOff]),
            (Self::Disabling, Event::ServoBack) => (Self::Disabling, &[ServoOff]),
            (state, _) => (state, &[]),
        }
    }
}

impl Event {
    /// Every event.
    pub const ALL: [Self; 21] = [
        Self::WatchdogKnown,
        Self::ServoOn,
        Self::Motion,
        Self::Finished,
        Self::OperatorStop,
        Self::Limit,
        Self::EmergencyStop,
        Self::LeaseExpired,
        Self::ServoLost,
        Self::BrakeLost,
        Self::EncodersLost,
        Self::Fault,
        Self::Hurry,
        Self::Still,
        Self::NoStandstill,
        Self::HeatSpent,
        Self::ServoBack,
        Self::BrakeAtZero,
        Self::BrakeUnanswered,
        Self::ServoIsOff,
        Self::ServoUnanswered,
    ];

    /// A reason to stop.
    #[must_use]
    pub fn is_stop(self) -> bool {
        matches!(
            self,
            Self::Finished
                | Self::OperatorStop
                | Self::Limit
                | Self::EmergencyStop
                | Self::LeaseExpired
                | Self::ServoLost
                | Self::BrakeLost
                | Self::EncodersLost
                | Self::Fault
        )
    }
}

/// Every state against every event, as a Markdown table; `·` changes nothing.
#[must_use]
pub fn table() -> String {
    let mut text = String::from("| event |");
    // Writing to a String cannot fail.
    for state in State::ALL {
        let _ = write!(text, " {state:?} |");
    }
    text.push_str("\n|---|");
    text.push_str(&"---|".repeat(State::ALL.len()));
    for event in Event::ALL {
        let _ = write!(text, "\n| {event:?}{} |", if event.is_stop() { " (stop)" } else { "" });
        for state in State::ALL {
            let (next, actions) = state.on(event);
            if (next, actions.is_empty()) == (state, true) {
                text.push_str(" · |");
            } else {
                let names: Vec<_> = actions.iter().map(|action| format!("{action:?}")).collect();
                let colon = if names.is_empty() { "" } else { ": " };
                let _ = write!(text, " **{next:?}**{colon}{} |", names.join(", "));
            }
        }
    }
    text.push('\n');
    text
}

#[cfg(test)]
mod tests;
