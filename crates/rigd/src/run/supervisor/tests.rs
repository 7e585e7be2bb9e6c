//! The machine as a whole: every state × event, and every sequence of events of any length, by walking the finite graph of the
//! machine together with a monitor that remembers what matters.

use std::collections::{HashSet, VecDeque};

use super::{Action, Event, State, table};

/// What an observer of events and actions knows of the rig, believing the worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
struct Monitor {
    /// A reason to stop came and the rig was not off since.
    stop_pending: bool,
    /// The servo may have a speed set-point other than 0 and torque.
    driven: bool,
    /// The servo's link is lost, so that no action reaches it.
    servo_gone: bool,
    /// The shafts may turn.
    may_turn: bool,
    servo_off_asked: bool,
    brake_zero_asked: bool,
}

/// Applies an event and checks what must hold on every single step.
fn step(state: State, mut monitor: Monitor, event: Event) -> (State, Monitor) {
    let (next, actions) = state.on(event);
    let context = format!("{state:?} × {event:?} → {next:?} {actions:?}, {monitor:?}");
    if event.is_stop() {
        monitor.stop_pending = true;
    }
    match event {
        Event::ServoLost => monitor.servo_gone = true,
        Event::ServoBack => monitor.servo_gone = false,
        Event::Still if matches!(state, State::Ramping | State::Holding) => monitor.may_turn = false,
        Event::Motion if next == State::Turning => (monitor.driven, monitor.may_turn) = (true, true),
        _ => {}
    }
    for action in actions {
        match action {
            Action::ZeroSpeed => monitor.driven &= monitor.servo_gone,
            Action::ServoOff => {
                monitor.driven &= monitor.servo_gone;
                monitor.servo_off_asked = true;
            }
            Action::BrakeToZero => {
                monitor.brake_zero_asked = true;
                // The load goes only once the shafts stand, torque is off, or nothing else is left.
                let excused = matches!(event, Event::HeatSpent | Event::BrakeLost | Event::Hurry);
                assert!(!monitor.may_turn || monitor.servo_off_asked || excused, "load taken off: {}", context);
            }
            Action::HoldLoad | Action::CallPerson => {}
        }
    }
    if next == State::Watched {
        (monitor.servo_off_asked, monitor.brake_zero_asked) = (false, false);
    }
    // A stop is final until everything was switched off.
    if monitor.stop_pending {
        let harmless = next.is_stopping() || next == State::Off;
        assert!(harmless, "a stop was forgotten: {}", context);
        let driven = monitor.driven && !monitor.servo_gone;
        assert!(!driven, "the shaft is driven after a stop: {}", context);
    }
    if next == State::Off && state != State::Off {
        assert!(monitor.servo_off_asked && monitor.brake_zero_asked, "off without switching off: {}", context);
        monitor = Monitor { servo_off_asked: true, brake_zero_asked: true, ..Monitor::default() };
    }
    (next, monitor)
}

/// Everything that any sequence of events can reach.
fn reachable() -> HashSet<(State, Monitor)> {
    let mut seen = HashSet::from([(State::Off, Monitor::default())]);
    let mut queue: VecDeque<_> = seen.iter().copied().collect();
    while let Some((state, monitor)) = queue.pop_front() {
        for event in Event::ALL {
            let next = step(state, monitor, event);
            if seen.insert(next) {
                queue.push_back(next);
            }
        }
    }
    seen
}

#[test]
fn no_sequence_of_any_length_leaves_the_shaft_driven_after_a_stop() {
    let seen = reachable();
    for state in State::ALL {
        assert!(seen.iter().any(|(reached, _)| *reached == state), "{state:?} is never reached");
    }
    println!("{} pairs of state and memory reached", seen.len());
}

#[test]
fn the_monitor_can_fail() {
    // The same walk on a machine that starts again in the middle of a stop, or forgets to take the speed away, is caught.
    let forgets = std::panic::catch_unwind(|| {
        let monitor = Monitor { driven: true, may_turn: true, ..Monitor::default() };
        // A stop that was already under way when the motion came: the machine must not have let it.
        step(State::Standing, Monitor { stop_pending: true, ..monitor }, Event::Motion)
    });
    assert!(forgets.is_err());
    let drops_load = std::panic::catch_unwind(|| {
        step(State::Standing, Monitor { may_turn: true, ..Monitor::default() }, Event::Finished)
    });
    assert!(drops_load.is_err());
}

#[test]
fn every_stop_ends_in_off_whatever_the_devices_answer() {
    // What the executor feeds in each stopping state; the longest chain is short, but for a servo that comes and goes.
    let answers = |state| -> &'static [Event] {
        match state {
            State::Ramping => &[Event::Still, Event::NoStandstill, Event::Hurry, Event::ServoLost],
            State::Holding => &[Event::Still, Event::HeatSpent, Event::Hurry, Event::BrakeLost],
            State::Releasing => &[Event::BrakeAtZero, Event::BrakeUnanswered],
            State::Disabling => &[Event::ServoIsOff, Event::ServoUnanswered],
            _ => &[],
        }
    };
    fn longest(state: State, answers: &dyn Fn(State) -> &'static [Event], depth: u32) -> u32 {
        assert!(depth < 6, "{state:?} does not come to an end");
        if state == State::Off {
            return depth;
        }
        answers(state).iter().map(|event| longest(state.on(*event).0, answers, depth + 1)).max().expect("an answer")
    }
    for state in State::ALL {
        for stop in Event::ALL.into_iter().filter(|event| event.is_stop()) {
            let (first, _) = state.on(stop);
            assert!(first.is_stopping(), "{state:?} × {stop:?}");
            assert!(longest(first, &answers, 0) <= 4);
        }
    }
}

#[test]
fn only_the_three_steps_of_starting_lead_to_motion() {
    for state in State::ALL {
        for event in Event::ALL {
            let (next, actions) = state.on(event);
            match next {
                State::Watched => assert!((state, event) == (State::Off, Event::WatchdogKnown) || state == next),
                State::Standing => assert!((state, event) == (State::Watched, Event::ServoOn) || state == next),
                State::Turning => assert!((state, event) == (State::Standing, Event::Motion) || state == next),
                _ => {}
            }
            // While it starts and runs nothing is switched off behind the sequence's back.
            if !event.is_stop() && !state.is_stopping() {
                assert!(actions.is_empty(), "{state:?} × {event:?}: {actions:?}");
            }
        }
    }
}

#[test]
fn every_state_and_event_is_as_the_document_says() {
    let document = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/safety.md"));
    let written = document
        .split_once("<!-- supervisor table -->\n")
        .and_then(|(_, rest)| rest.split_once("<!-- end of table -->"))
        .map(|(table, _)| table);
    assert_eq!(written, Some(table().as_str()), "docs/safety.md is not the machine; `table()` gives:\n{}", table());
}
