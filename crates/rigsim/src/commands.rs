//! Hands on the simulated rig: commands from standard input press its emergency stop, heat its brake, and so on.

use std::cell::RefCell;
use std::io::BufRead as _;
use std::rc::Rc;

use tokio::sync::mpsc::unbounded_channel;

use super::simulated_rig::SimulatedRig;

/// A thing to do to the rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Press the emergency stop, or release it.
    EmergencyStop(bool),
    /// Make the brake's sensor show so much more, °C.
    Heat(f64),
    /// Make the brake's source put out so many times what it is set to.
    Overcurrent(f64),
    /// Make the drive one without a watchdog.
    NoWatchdog,
    /// Cut the counter box's power for an instant.
    RestartCounter,
    /// Cut the power of a QSB reader for an instant: 0 input, 1 output.
    RestartReader(usize),
}

impl Command {
    /// Reads a line; `None` for none of these.
    #[must_use]
    pub fn parse(line: &str) -> Option<Self> {
        match line.split_whitespace().collect::<Vec<_>>()[..] {
            ["estop", "press"] => Some(Self::EmergencyStop(true)),
            ["estop", "release"] => Some(Self::EmergencyStop(false)),
            ["heat", celsius] => celsius.parse().ok().filter(|value: &f64| value.is_finite()).map(Self::Heat),
            ["overcurrent", factor] => {
                factor.parse().ok().filter(|value: &f64| (0.0..=10.0).contains(value)).map(Self::Overcurrent)
            }
            ["no-watchdog"] => Some(Self::NoWatchdog),
            ["counter", "restart"] => Some(Self::RestartCounter),
            ["reader", "input", "restart"] => Some(Self::RestartReader(0)),
            ["reader", "output", "restart"] => Some(Self::RestartReader(1)),
            _ => None,
        }
    }

    /// Does it.
    pub fn perform(self, rig: &mut SimulatedRig) {
        match self {
            Self::EmergencyStop(pressed) => rig.press_emergency_stop(pressed),
            Self::Heat(by_c) => rig.heat_brake_by(by_c),
            Self::Overcurrent(factor) => rig.run_brake_away(factor),
            Self::NoWatchdog => rig.take_watchdog_away(),
            Self::RestartCounter => rig.restart_counter(),
            Self::RestartReader(which) => rig.restart_reader(which),
        }
    }
}

/// Listens to standard input from now on; needs a local task set.
pub fn listen(rig: &Rc<RefCell<SimulatedRig>>) {
    let (sender, mut lines) = unbounded_channel();
    // A thread, for reading a terminal cannot be waited for; it ends with the input or with the process.
    std::thread::spawn(move || {
        let _ = std::io::stdin().lock().lines().map_while(Result::ok).try_for_each(|line| sender.send(line));
    });
    let rig = Rc::clone(rig);
    tokio::task::spawn_local(async move {
        while let Some(line) = lines.recv().await {
            match Command::parse(&line) {
                Some(command) => command.perform(&mut rig.borrow_mut()),
                None => eprintln!(
                    "'{line}' is no command; there are: estop press|release, heat CELSIUS, overcurrent FACTOR, no-watchdog, counter restart, reader input|output restart"
                ),
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines() {
        assert_eq!(Command::parse(" estop  press "), Some(Command::EmergencyStop(true)));
        assert_eq!(Command::parse("heat 80.5"), Some(Command::Heat(80.5)));
        assert_eq!(Command::parse("overcurrent 2"), Some(Command::Overcurrent(2.0)));
        for wrong in ["", "estop", "heat much", "heat NaN", "overcurrent", "overcurrent -1", "counter"] {
            assert_eq!(Command::parse(wrong), None, "{wrong}");
        }
    }
}
