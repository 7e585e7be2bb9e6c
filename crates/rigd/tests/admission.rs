//! No way into a run goes around the profile's limits: what a command or a plan might let through is refused again while the motor is off.

mod support;

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use gearmodel::Direction;
use rigd::run::brake_sweep::{self, SweepPlan, Swept};
use rigd::run::connected_rig::ConnectedRig;
use rigd::run::run_job::Policy;
use rigd::run::session;
use rigd::run::set_up::{Jog, hold_brake, jog};
use rigd::run::stop_reason::StopReason;
use support::bench::{Bench, in_virtual_time};

/// A rig with limits changed by `edit`.
fn bench(edit: impl FnOnce(&mut Bench)) -> Bench {
    let mut bench = Bench::new(31);
    edit(&mut bench);
    bench
}

/// A job of 10 N·m at 30 rpm, 31.416 W.
fn job(edit: impl FnOnce(&mut Bench)) -> Option<StopReason> {
    in_virtual_time(async {
        let bench = bench(edit);
        let began_rad = driver_rad(&bench);
        let outcome = bench.run(bench.job(1.0), Policy::default()).await;
        off(&bench, began_rad, outcome.stop_reason)
    })
}

/// Anything else on the rig.
fn work(
    edit: impl FnOnce(&mut Bench),
    body: impl AsyncFnOnce(&mut ConnectedRig) -> Result<(), StopReason>,
) -> Option<StopReason> {
    in_virtual_time(async {
        let bench = bench(edit);
        let began_rad = driver_rad(&bench);
        let outcome = session::with_rig(bench.context(0.0), async |rig| session::once(rig, body).await).await;
        off(&bench, began_rad, outcome.stop_reason)
    })
}

/// Where the driver stands, rad.
fn driver_rad(bench: &Bench) -> f64 {
    bench.world.borrow_mut().truth().angles_rad[0]
}

/// At rest, and where it was refused without ever having moved.
fn off(bench: &Bench, began_rad: f64, reason: Option<StopReason>) -> Option<StopReason> {
    assert!(bench.speed_rpm() < 0.1, "off: {reason:?}");
    let turned_rad = (driver_rad(bench) - began_rad).abs();
    assert!(reason.is_none() || turned_rad < 0.01, "it turned by {turned_rad} rad");
    reason
}

/// Admitted at the limit, refused a hair beyond it.
fn both_sides(key: &str, within: Option<StopReason>, beyond: Option<StopReason>) {
    if let Some(reason) = within {
        panic!("{key}, within: {reason}");
    }
    let Some(StopReason::Refused(refusal)) = beyond else { panic!("{key}: {beyond:?}") };
    assert!(refusal.to_string().contains(key), "{key}: {refusal}");
}

#[test]
fn a_job_is_admitted_by_the_session() {
    let load = |limit: f64| job(|bench| bench.profile.limits.load_nm = limit);
    both_sides("limits.load_nm", load(10.0), load(9.99));
    let speed = |limit: f64| job(|bench| bench.profile.limits.speed_rpm = limit);
    both_sides("limits.speed_rpm", speed(30.0), speed(29.99));
    let heat = |limit: f64| job(|bench| bench.profile.limits.slip_power_w = limit);
    both_sides("limits.slip_power_w", heat(31.42), heat(31.41));
    let coil = |load_nm: f64| {
        job(move |bench| bench.profile.brake.current_limit_a = bench.profile.brake.current_a(load_nm).expect("within"))
    };
    both_sides("brake.current_limit_a", coil(10.0), coil(9.99));
}

#[test]
fn turning_and_holding_for_set_up_are_admitted_too() {
    let turn = |limit: f64| {
        let plan = Jog {
            direction: Direction::Ccw,
            speed_rpm: 5.0,
            turns: Some(0.1),
            seconds: 10.0,
            accept_no_watchdog: false,
        };
        let from_rad = Cell::new(0.0);
        work(
            |bench| bench.profile.limits.speed_rpm = limit,
            async |rig: &mut ConnectedRig| jog(rig, plan, &from_rad).await,
        )
    };
    both_sides("limits.speed_rpm", turn(5.0), turn(4.99));
    let hold = |limit: f64| {
        work(
            |bench| bench.profile.limits.load_nm = limit,
            async |rig: &mut ConnectedRig| hold_brake(rig, 10.0, 1.0).await,
        )
    };
    both_sides("limits.load_nm", hold(10.0), hold(9.99));
}

#[test]
fn the_brakes_calibration_is_admitted_too() {
    let sweep = |edit: fn(&mut Bench)| {
        let plan = SweepPlan {
            currents_a: vec![0.1],
            speed_rpm: 25.0,
            turns: 1,
            repeats: 1,
            rated_torque_nm: 2.39,
            rate_hz: 2000.0,
        };
        let swept = Rc::new(RefCell::new(Swept::default()));
        work(edit, async |rig: &mut ConnectedRig| brake_sweep::execute(rig, &plan, &swept).await)
    };
    both_sides(
        "limits.speed_rpm",
        sweep(|bench| bench.profile.limits.speed_rpm = 25.0),
        sweep(|bench| bench.profile.limits.speed_rpm = 24.99),
    );
    // 20 N·m at 25 rpm are 52.36 W.
    both_sides(
        "limits.slip_power_w",
        sweep(|bench| bench.profile.limits.slip_power_w = 52.37),
        sweep(|bench| bench.profile.limits.slip_power_w = 52.35),
    );
}
