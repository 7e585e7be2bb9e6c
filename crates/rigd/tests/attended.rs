//! What a job survives, in virtual time and by the plant's own truth: replugs, emergency stop, heat, pause, a frozen or panicking
//! driver, a drive without a watchdog, a servo that is lost for good.

mod support;

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use async_trait::async_trait;
use gearmodel::measure::RunFigures;
use rigd::analysis::Analysis;
use rigd::device::bus::BusStatistics;
use rigd::device::{DeviceError, DeviceKind, Identity, Servo, ServoStatus};
use rigd::run::acquire::Acquisition;
use rigd::run::connected_rig::ConnectedRig;
use rigd::run::dialer::Dialer;
use rigd::run::observer::NoObserver;
use rigd::run::progress::Progress;
use rigd::run::run_job::{Policy, Suspend, run_job};
use rigd::run::session;
use rigd::run::stop_reason::StopReason;
use rigd::run::supervisor::State;
use rigd::simulated;
use riglog::pair;
use riglog::{LogReader, Record};
use support::bench::{Bench, in_virtual_time};
use tokio::time::{Instant, sleep};

const WAITS: Policy = Policy { reconnect_s: 60.0, suspend: None };

fn residual_urad(analysis: &Analysis, run: usize) -> f64 {
    RunFigures::of(&analysis.runs()[run].te, analysis.model(), None).residual_rms_rad * 1e6
}

/// Pulls a plug while the rig records, puts it in again after `out_s`, and checks what must be so for every device.
fn replugged(part: DeviceKind, restart: bool, seed: u64) -> Bench {
    in_virtual_time(async {
        let bench = Bench::new(seed);
        let (pulled, put_in) = (Rc::new(RefCell::new(0)), Rc::new(RefCell::new(0)));
        let hands = {
            let (bench, pulled, put_in) = (bench.clone(), Rc::clone(&pulled), Rc::clone(&put_in));
            tokio::task::spawn_local(async move {
                bench.at_speed(3.0).await;
                *pulled.borrow_mut() = bench.clock.now_ns();
                bench.world.borrow_mut().unplug(part);
                sleep(Duration::from_secs_f64(7.3)).await;
                assert!(bench.speed_rpm() < 0.1, "{part} is out and the shaft stands");
                if restart {
                    bench.world.borrow_mut().restart_counter();
                }
                *put_in.borrow_mut() = bench.clock.now_ns();
                bench.world.borrow_mut().replug(part);
            })
        };
        let outcome = bench.run(bench.job(3.0), WAITS).await;
        hands.await.expect("the hands were quick enough");
        assert!(outcome.stop_reason.is_none(), "{part}: {:?}", outcome.stop_reason);
        assert!(bench.speed_rpm() < 0.1);

        let (lost_ns, said) = bench.event("gap", part.name());
        let (back_ns, _) = bench.event("reconnect", part.name());
        let took_s = (back_ns - *put_in.borrow()) as f64 * 1e-9;
        println!("{part} (restart {restart}): back {took_s:.2} s after the replug; {said}");
        assert!(took_s <= 2.0, "{part}: {took_s} s");
        assert!(lost_ns > *pulled.borrow());
        bench.event("index check", "input encoder");

        // The interrupted run and the one that was done again; TE of both against the same zero.
        let (analysis, found) = bench.replayed();
        assert_eq!(analysis.runs().len(), 2);
        let again = &analysis.runs()[1];
        assert_eq!((again.te.revolutions(), again.losses), (3, 0));
        let (before, after) = (residual_urad(&analysis, 0), residual_urad(&analysis, 1));
        println!("  residual {before:.2} µrad before, {after:.2} µrad after, {} samples lost", found.losses);
        assert!(after < 10.0, "TE goes on as it was: {after} µrad");
        assert_eq!(found.losses, outcome.lost);
        if part == DeviceKind::Counter {
            assert!(outcome.lost > 0);
        } else {
            assert_eq!(outcome.lost, 0, "the encoders went on");
        }
        bench
    })
}

#[test]
fn a_servo_or_brake_that_is_unplugged_and_comes_back() {
    replugged(DeviceKind::Servo, false, 1);
    replugged(DeviceKind::Brake, false, 2);
}

#[test]
fn a_counter_that_comes_back_leaves_a_marked_gap_and_nothing_in_it() {
    for (restart, seed) in [(false, 3), (true, 4)] {
        let bench = replugged(DeviceKind::Counter, restart, seed);
        // The gap is in the numbers and in the times alike, and no sample or TE point lies in it.
        let (mut gaps, mut end) = (Vec::new(), None);
        let mut points = Vec::new();
        for record in LogReader::open(bench.log()).expect("a log") {
            match record.expect("a record") {
                Record::Angles { batch, .. } => {
                    let count = batch.input_delta.len() as u64;
                    if let Some((number, time_ns)) = end.filter(|(number, _)| *number != batch.first_sample) {
                        gaps.push((batch.first_sample - number, time_ns, batch.t0_ns));
                    }
                    let end_ns = batch.t0_ns + count * u64::from(batch.dt_ns);
                    assert!(end.is_none_or(|(_, time_ns)| batch.t0_ns >= time_ns), "time goes on");
                    end = Some((batch.first_sample + count, end_ns));
                }
                Record::Te { publish_time_ns, .. } => points.push(publish_time_ns),
                _ => {}
            }
        }
        assert_eq!(gaps.len(), 1, "{gaps:?}");
        let (missing, from_ns, to_ns) = gaps[0];
        let by_time = (to_ns - from_ns) as f64 * 1e-9 * bench.rate_hz;
        println!("restart {restart}: {missing} samples missing, {by_time:.1} by time");
        assert!((missing as f64 - by_time).abs() <= 0.5);
        assert!(by_time > 7.3 * bench.rate_hz);
        assert!(points.iter().all(|point| !(from_ns..to_ns).contains(point)), "a TE point in the gap");
        if restart {
            bench.event("index check", "moved");
        }
    }
}

#[test]
fn a_device_that_stays_away_ends_the_run_with_its_name() {
    in_virtual_time(async {
        let bench = Bench::new(5);
        let hands = bench.clone();
        tokio::task::spawn_local(async move {
            hands.at_speed(2.0).await;
            hands.world.borrow_mut().unplug(DeviceKind::Brake);
        });
        let outcome = bench.run(bench.job(20.0), Policy { reconnect_s: 10.0, suspend: None }).await;
        let said = outcome.stop_reason.expect("a halt").to_string();
        assert!(said.contains("brake did not come back within 10 s"), "{said}");
        assert!(bench.speed_rpm() < 0.1);
    });
}

const SUSPENDS: Suspend = Suspend { cool_to_c: 60.0, go_on_when_released: false, patience_s: 600.0 };

#[test]
fn the_emergency_stop_suspends_and_its_release_alone_starts_nothing() {
    in_virtual_time(async {
        let bench = Bench::new(6);
        let hands = {
            let bench = bench.clone();
            tokio::task::spawn_local(async move {
                bench.at_speed(2.0).await;
                bench.world.borrow_mut().press_emergency_stop(true);
                sleep(Duration::from_secs(5)).await;
                assert!(bench.speed_rpm() < 0.1, "pressed");
                bench.world.borrow_mut().press_emergency_stop(false);
                for _ in 0..40 {
                    sleep(Duration::from_millis(100)).await;
                    assert!(bench.speed_rpm() < 0.1, "released, and nobody said go");
                }
                bench.stop.toggle_pause();
            })
        };
        let outcome = bench.run(bench.job(2.0), Policy { reconnect_s: 0.0, suspend: Some(SUSPENDS) }).await;
        hands.await.expect("nothing moved");
        assert!(outcome.stop_reason.is_none(), "{:?}", outcome.stop_reason);
        bench.event("halt", "emergency stop");
        bench.event("resume", "waits for the operator");
        assert_eq!(bench.replayed().0.runs().last().expect("a run").te.revolutions(), 2);
    });
}

#[test]
fn the_emergency_stop_ends_a_run_that_is_not_to_be_suspended() {
    in_virtual_time(async {
        let bench = Bench::new(7);
        let hands = bench.clone();
        tokio::task::spawn_local(async move {
            hands.at_speed(2.0).await;
            hands.world.borrow_mut().press_emergency_stop(true);
        });
        let outcome = bench.run(bench.job(20.0), Policy::default()).await;
        assert!(
            matches!(outcome.stop_reason, Some(StopReason::EmergencyStop { alarm: 0x13 })),
            "{:?}",
            outcome.stop_reason
        );
        assert!(bench.speed_rpm() < 0.1);
    });
}

#[test]
fn a_brake_that_gets_too_warm_is_let_cool() {
    in_virtual_time(async {
        let bench = Bench::new(8);
        let hands = {
            let bench = bench.clone();
            tokio::task::spawn_local(async move {
                bench.at_speed(2.0).await;
                bench.world.borrow_mut().heat_brake_by(70.0);
                sleep(Duration::from_secs(30)).await;
                assert!(bench.speed_rpm() < 0.1, "it stands while it is too warm");
                bench.world.borrow_mut().heat_brake_by(0.0);
            })
        };
        let outcome = bench.run(bench.job(3.0), Policy { reconnect_s: 0.0, suspend: Some(SUSPENDS) }).await;
        hands.await.expect("it stood");
        assert!(outcome.stop_reason.is_none(), "{:?}", outcome.stop_reason);
        let (from, _) = bench.event("halt", "limits.brake_temperature_c");
        let (to, _) = bench.event("resume", "goes on");
        assert!(to - from > 25_000_000_000);
    });
}

#[test]
fn a_pause_comes_at_the_end_of_a_revolution_and_nothing_is_lost() {
    in_virtual_time(async {
        let bench = Bench::new(9);
        let hands = {
            let bench = bench.clone();
            tokio::task::spawn_local(async move {
                // At 30 rpm somewhere in the second revolution.
                bench.at_speed(5.0).await;
                bench.stop.toggle_pause();
                sleep(Duration::from_secs(6)).await;
                assert!(bench.speed_rpm() < 0.1, "paused");
                bench.stop.toggle_pause();
            })
        };
        let outcome = bench.run(bench.job(4.0), Policy::default()).await;
        hands.await.expect("it stood");
        assert!(outcome.stop_reason.is_none(), "{:?}", outcome.stop_reason);
        let (analysis, found) = bench.replayed();
        let revolutions: Vec<_> = analysis.runs().iter().map(|run| run.te.revolutions()).collect();
        println!("recorded in parts of {revolutions:?} revolutions");
        assert_eq!((revolutions.len(), revolutions.iter().sum::<usize>()), (2, 4), "{revolutions:?}");
        assert!(revolutions.iter().all(|part| *part >= 1));
        assert_eq!(found.losses, 0);
    });
}

#[test]
fn a_drive_without_a_watchdog_is_refused_unless_that_is_accepted() {
    in_virtual_time(async {
        let bench = Bench::new(10);
        bench.world.borrow_mut().take_watchdog_away();
        let mut fastest = 0.0_f64;
        let outcome = {
            let run = bench.run(bench.job(1.0), Policy::default());
            tokio::pin!(run);
            loop {
                tokio::select! {
                    outcome = &mut run => break outcome,
                    () = sleep(Duration::from_millis(20)) => fastest = fastest.max(bench.speed_rpm()),
                }
            }
        };
        let said = outcome.stop_reason.expect("refused").to_string();
        assert!(said.contains("P3-04") && said.contains("watchdog"), "{said}");
        assert!(fastest < 0.05, "never enabled: {fastest} rpm");
    });
    in_virtual_time(async {
        let bench = Bench::new(10);
        bench.world.borrow_mut().take_watchdog_away();
        let mut job = bench.job(1.0);
        job.accept_no_watchdog = true;
        let outcome = bench.run(job, Policy::default()).await;
        assert!(outcome.stop_reason.is_none(), "{:?}", outcome.stop_reason);
        bench.event("lease", "ACCEPTED WITHOUT A WATCHDOG");
    });
}

#[test]
fn a_servo_lost_for_good_is_held_by_the_brake_until_its_heat_is_spent() {
    in_virtual_time(async {
        let mut bench = Bench::new(11);
        // 10 N·m at 30 rpm are 31.4 W of 32 W; a source that puts out a fifth more makes 41 W of it, and the account of 1920 J is full
        // after some four minutes.
        bench.profile.limits.slip_power_w = 32.0;
        bench.world.borrow_mut().take_watchdog_away();
        let mut job = bench.job(1000.0);
        job.accept_no_watchdog = true;
        let held_s = {
            let bench = bench.clone();
            tokio::task::spawn_local(async move {
                bench.at_speed(2.0).await;
                bench.world.borrow_mut().run_brake_away(1.2);
                bench.world.borrow_mut().unplug(DeviceKind::Servo);
                let unplugged = Instant::now();
                // Without a watchdog the motor drives on: the load must stay on it.
                while bench.brake_torque_nm() > 5.0 {
                    assert!(bench.speed_rpm() > 10.0);
                    sleep(Duration::from_millis(200)).await;
                    assert!(unplugged.elapsed() < Duration::from_secs(900), "held beyond its heat");
                }
                unplugged.elapsed().as_secs_f64()
            })
        };
        let outcome = bench.run(job, Policy::default()).await;
        let held_s = held_s.await.expect("it held");
        println!("held for {held_s:.0} s");
        assert!((200.0..280.0).contains(&held_s), "{held_s}");
        let said = outcome.troubles.join("\n");
        assert!(said.contains("press the emergency stop") && said.contains("no more heat"), "{said}");
    });
}

#[test]
fn a_servo_without_watchdog_that_comes_back_while_the_brake_holds_is_stopped_at_once() {
    in_virtual_time(async {
        let bench = Bench::new(12);
        bench.world.borrow_mut().take_watchdog_away();
        let mut job = bench.job(100.0);
        job.accept_no_watchdog = true;
        let hands = {
            let bench = bench.clone();
            tokio::task::spawn_local(async move {
                bench.at_speed(2.0).await;
                bench.world.borrow_mut().unplug(DeviceKind::Servo);
                sleep(Duration::from_secs(20)).await;
                assert!(bench.speed_rpm() > 10.0 && bench.brake_torque_nm() > 5.0, "turns on under load");
                bench.world.borrow_mut().replug(DeviceKind::Servo);
                sleep(Duration::from_secs_f64(0.5 + 0.6 + 2.0)).await;
                assert!(bench.speed_rpm() < 0.1, "stopped by its ramp");
            })
        };
        let outcome = bench.run(job, Policy::default()).await;
        hands.await.expect("as expected");
        assert!(matches!(outcome.stop_reason, Some(StopReason::Device(_))), "{:?}", outcome.stop_reason);
    });
}

/// What a broken driver does at its `at`th status.
#[derive(Clone, Copy, PartialEq)]
enum Defect {
    Panic,
    Freeze(Duration),
}

/// A servo driver with a defect, around a sound one.
struct Defective {
    servo: Box<dyn Servo>,
    defect: Defect,
    at: u32,
    asked: u32,
}

#[async_trait(?Send)]
impl Servo for Defective {
    async fn identify(&mut self) -> Result<Identity, DeviceError> {
        self.servo.identify().await
    }
    async fn prepare(&mut self, accel_ms: f64, decel_ms: f64, lease: Duration) -> Result<(), DeviceError> {
        self.servo.prepare(accel_ms, decel_ms, lease).await
    }
    async fn max_motor_rpm(&mut self) -> Result<f64, DeviceError> {
        self.servo.max_motor_rpm().await
    }
    async fn set_enabled(&mut self, enabled: bool) -> Result<(), DeviceError> {
        self.servo.set_enabled(enabled).await
    }
    async fn set_motor_rpm(&mut self, rpm: f64) -> Result<(), DeviceError> {
        self.servo.set_motor_rpm(rpm).await
    }
    async fn status(&mut self) -> Result<ServoStatus, DeviceError> {
        self.asked += 1;
        if self.asked == self.at {
            match self.defect {
                Defect::Panic => panic!("a defect of the driver"),
                Defect::Freeze(time) => sleep(time).await,
            }
        }
        self.servo.status().await
    }
    fn statistics(&self) -> BusStatistics {
        self.servo.statistics()
    }
}

/// A run with a defective servo driver: why it ended, and the plant at the end.
fn with_defect(defect: Defect, seed: u64) -> (Option<StopReason>, Vec<String>, f64) {
    in_virtual_time(async {
        let bench = Bench::new(seed);
        let (_, model) = pair::load(None).expect("the built-in pair");
        let recorder = bench.recorder();
        let acquisition = Rc::new(RefCell::new(Acquisition::new(recorder, bench.clock, Analysis::new(model))));
        let links = simulated::links_to(&bench.world);
        let dialer = Dialer::new(bench.profile.clone(), links.again.clone());
        let mut devices = session::connect(&dialer, links).await.expect("the devices");
        // Some 6 s into the run, at speed.
        devices.servo = Box::new(Defective { servo: devices.servo, defect, at: 60, asked: 0 });
        let (stop, progress) = (bench.stop.clone(), Progress::new(1.0, true));
        let mut rig =
            ConnectedRig::new(bench.profile.clone(), devices, dialer, acquisition, bench.clock, stop, progress);
        let turned = {
            let bench = bench.clone();
            tokio::task::spawn_local(async move { bench.at_speed(0.0).await })
        };
        let (halt, troubles) = run_job(&mut rig, &mut bench.job(20.0), Policy::default(), &mut NoObserver).await;
        turned.await.expect("it turned");
        assert_eq!(rig.state(), State::Off);
        let speed_rpm = bench.speed_rpm();
        session::leave(rig, (None, Vec::new())).await;
        (halt, troubles, speed_rpm)
    })
}

#[test]
fn a_panic_switches_off_in_order() {
    let (halt, troubles, speed_rpm) = with_defect(Defect::Panic, 13);
    assert!(matches!(&halt, Some(StopReason::Panic { what }) if what == "a defect of the driver"), "{halt:?}");
    assert!(troubles.is_empty(), "{troubles:?}");
    assert!(speed_rpm < 0.1, "{speed_rpm}");
}

#[test]
fn the_lease_from_both_sides() {
    // 1 s of lease, polls of 100 ms: half a second of silence is no reason to stop, more than a second is.
    let (halt, ..) = with_defect(Defect::Freeze(Duration::from_millis(500)), 14);
    assert!(halt.is_none(), "{halt:?}");
    let (halt, _, speed_rpm) = with_defect(Defect::Freeze(Duration::from_millis(2500)), 14);
    // Whoever notices first: the lease here, or the alarm of the drive's own watchdog.
    let said = halt.expect("a halt").to_string();
    assert!(said.contains("lease") || said.contains("0x0020"), "{said}");
    assert!(speed_rpm < 0.1);
}
