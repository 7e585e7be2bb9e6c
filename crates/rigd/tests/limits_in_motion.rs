//! What the supervisor watches while the rig turns, from both sides, in virtual time: just within its limit the job goes on to its
//! end, just over it the rig is stopped in order, and the log says which limit it was.

mod support;

use std::time::Duration;

use rigd::run::limits::Limit;
use rigd::run::run_job::Policy;
use rigd::run::stop_reason::StopReason;
use support::bench::{Bench, in_virtual_time};
use tokio::time::sleep;

/// 10 N·m at 30 rpm for `revolutions`; `fault` is done to the rig once it is at speed. Why it ended, and the bench.
fn disturbed(
    edit: impl FnOnce(&mut Bench),
    revolutions: f64,
    fault: impl AsyncFnOnce(Bench) + 'static,
) -> (Option<StopReason>, Bench) {
    in_virtual_time(async {
        let mut bench = Bench::new(21);
        edit(&mut bench);
        let hands = {
            let bench = bench.clone();
            tokio::task::spawn_local(async move {
                bench.at_speed(2.0).await;
                fault(bench).await;
            })
        };
        let outcome = bench.run(bench.job(revolutions), Policy::default()).await;
        hands.abort();
        assert!(outcome.troubles.is_empty(), "{:?}", outcome.troubles);
        assert!(bench.speed_rpm() < 0.1, "at rest, whatever happened");
        (outcome.stop_reason, bench)
    })
}

/// Stopped by the limit of this key, which the log names.
fn assert_over(key: &str, (reason, bench): (Option<StopReason>, Bench)) {
    assert!(matches!(&reason, Some(StopReason::Limit(exceeded)) if exceeded.limit.key() == key), "{key}: {reason:?}");
    bench.event("halt", key);
}

fn assert_within(what: &str, (reason, _): (Option<StopReason>, Bench)) {
    assert!(reason.is_none(), "{what}: {reason:?}");
}

#[test]
fn load() {
    // 10 N·m and a tenth; the source puts out 0.482 A and then 4 % more (10.6 N·m), or 20 % more (13 N·m).
    let limit = |bench: &mut Bench| bench.profile.limits.load_nm = 10.0;
    let fault = |factor| async move |bench: Bench| bench.world.borrow_mut().run_brake_away(factor);
    assert_within("4 % more", disturbed(limit, 4.0, fault(1.04)));
    assert_over("limits.load_nm, and a tenth", disturbed(limit, 4.0, fault(1.2)));
}

#[test]
fn brake_heat() {
    // 31.4 W of 32 W; half as much current again makes 55 W of it, and 1920 J are over after 83 s.
    let limit = |bench: &mut Bench| bench.profile.limits.slip_power_w = 32.0;
    let fault = |seconds| {
        async move |bench: Bench| {
            bench.world.borrow_mut().run_brake_away(1.5);
            sleep(Duration::from_secs(seconds)).await;
            bench.world.borrow_mut().run_brake_away(1.0);
        }
    };
    assert_within("70 s of it", disturbed(limit, 60.0, fault(70)));
    assert_over(Limit::BrakeHeat.key(), disturbed(limit, 60.0, fault(100)));
}

#[test]
fn brake_temperature() {
    // The brake stands at 22 °C and warms by a degree or two; its limit is 80 °C.
    let fault = |by_c| async move |bench: Bench| bench.world.borrow_mut().heat_brake_by(by_c);
    assert_within("75 °C", disturbed(|_| {}, 4.0, fault(53.0)));
    assert_over(Limit::BrakeTemperature.key(), disturbed(|_| {}, 4.0, fault(60.0)));
}

#[test]
fn encoder_silence() {
    let fault = |milliseconds| {
        async move |bench: Bench| {
            bench.world.borrow_mut().silence_counter(true);
            sleep(Duration::from_millis(milliseconds)).await;
            bench.world.borrow_mut().silence_counter(false);
        }
    };
    // The limit is 500 ms; what was sent meanwhile is lost, counted, and ends nothing.
    let (reason, bench) = disturbed(|_| {}, 4.0, fault(400));
    assert!(reason.is_none(), "400 ms: {reason:?}");
    assert!(bench.replayed().1.losses > 0, "and the loss is in the log");
    let (reason, bench) = disturbed(|_| {}, 4.0, fault(700));
    assert!(matches!(&reason, Some(StopReason::EncodersSilent { limit_ms: 500.0, .. })), "{reason:?}");
    bench.event("halt", "limits.encoder_silence_ms");
}
