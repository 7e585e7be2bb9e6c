//! SIGKILL at any instant: what is left is a clean prefix, at most 250 ms short; the next run finalises it; the simulated rig
//! goes with the run; and a servo that lost its master comes to a standstill by its own watchdog.

mod support;

use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use rand::{Rng as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use rigd::device::DeviceKind;
use rigd::device::drivers::COUNTERS;
use rigd::link::Address;
use rigd::profile::Profile;
use riglog::proto::Phase;
use riglog::{LogReader, Record};
use support::{Run, Sim, children, lives, python_counts, rigd, wait_for};

/// Where the run is killed: a phase, and how long after it shows in the log, ms.
#[derive(Debug, Clone, Copy)]
struct Instance {
    phase: Phase,
    after_ms: u64,
}

const fn at(phase: Phase, after_ms: u64) -> Instance {
    Instance { phase, after_ms }
}

/// Five at a time, the quick ones together.
const INSTANTS: [[Instance; 5]; 4] = [
    // While connecting, before any sample.
    [at(Phase::Idle, 0), at(Phase::Idle, 90), at(Phase::Idle, 230), at(Phase::Idle, 520), at(Phase::Homing, 0)],
    [
        at(Phase::Homing, 130),
        at(Phase::Homing, 410),
        at(Phase::Homing, 890),
        at(Phase::Homing, 1340),
        at(Phase::Approach, 0),
    ],
    [
        at(Phase::Approach, 1210),
        at(Phase::Settle, 70),
        at(Phase::Settle, 760),
        at(Phase::Record, 0),
        at(Phase::Record, 60),
    ],
    [
        at(Phase::Record, 170),
        at(Phase::Record, 330),
        at(Phase::Record, 520),
        at(Phase::Record, 1010),
        at(Phase::Record, 1650),
    ],
];

/// What a kill left.
struct Left {
    instant: Instance,
    run: Run,
    log: PathBuf,
    messages: u64,
    short_ms: Option<f64>,
}

fn kill_at(instant: Instance, revolutions: &str, seed: u64) -> Left {
    assert!(seed < 10_000, "{instant:?}: the run ends by itself again and again");
    let number = seed.to_string();
    let mut run = Run::start(&["--time-scale", "1", "--direction", "ccw", "--revs", revolutions, "--seed", &number]);
    if instant.phase == Phase::Idle {
        wait_for("the log", 30.0, || run.log());
    } else {
        run.await_phase(|phase, _| phase == instant.phase);
    }
    std::thread::sleep(Duration::from_millis(instant.after_ms));
    let simulators = children(run.process.pid());
    let said = std::fs::read_to_string(run.home().join("stderr")).unwrap_or_default();
    if simulators.is_empty() && run.process.ended() {
        // Real time on a computer with no time to spare: the rig did not answer, and the run ended by itself, in order.
        println!("{instant:?}: once more, for the run had ended before: {said}");
        return kill_at(instant, revolutions, seed + 1000);
    }
    assert_eq!(simulators.len(), 1, "the simulated rig is a process of its own; {instant:?}: {said}");
    let killed = SystemTime::now();
    run.process.signal(nix::sys::signal::Signal::SIGKILL);
    run.process.wait(5.0);
    wait_for("the end of the simulated rig", 5.0, || (!lives(simulators[0])).then_some(()));

    let log = run.log().expect("a log");
    let mut messages = 0;
    let mut last_sample_ns = None;
    let mut next: Option<u64> = None;
    let mut told = String::new();
    for record in LogReader::open(&log).expect("a readable log") {
        match record.expect("whole records") {
            Record::Angles { log_time_ns, batch, .. } => {
                // On a crowded computer the line itself may lose samples; the log then says so before it goes on.
                let first = batch.first_sample;
                let gap = next.filter(|next| *next != first).map(|next| format!("samples {next} to {} ", first - 1));
                assert!(gap.is_none_or(|gap| told.contains(&gap)), "a gap before sample {first} that nobody told");
                next = Some(batch.first_sample + batch.input_delta.len() as u64);
                last_sample_ns = Some(log_time_ns);
                messages += 1;
            }
            Record::Event { event, .. } => {
                told.push_str(&event.message);
                messages += 1;
            }
            Record::State { .. } | Record::Te { .. } | Record::Backlash { .. } => messages += 1,
            _ => {}
        }
    }
    let killed_ns = killed.duration_since(UNIX_EPOCH).expect("after 1970").as_nanos() as f64;
    let short_ms = last_sample_ns.map(|last: u64| (killed_ns - last as f64) * 1e-6);
    Left { instant, run, log, messages, short_ms }
}

/// Kills runs, a few at a time, and gives what they left.
fn kill_all(rounds: &[&[Instance]], revolutions: &'static str) -> Vec<Left> {
    let mut all = Vec::new();
    for instants in rounds {
        let first = all.len();
        let threads: Vec<_> = instants
            .iter()
            .enumerate()
            .map(|(n, instant)| {
                let instant = *instant;
                std::thread::spawn(move || kill_at(instant, revolutions, (first + n) as u64))
            })
            .collect();
        all.extend(threads.into_iter().map(|thread| thread.join().expect("the case holds")));
    }
    all
}

#[test]
fn a_run_killed_at_20_instants_leaves_a_clean_prefix_that_the_next_run_finalises() {
    check(&kill_all(&INSTANTS.each_ref().map(|round| round.as_slice()), "2"));
}

/// `just kill-200`: at random instants of the first 18 s, from connecting through homing into the recording.
#[test]
#[ignore = "takes minutes; `just kill-200`"]
fn a_run_killed_at_200_random_instants() {
    let seed = std::env::var("RIG_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut instants: Vec<_> = (0..200).map(|_| at(Phase::Idle, random.next_u64() % 18_000)).collect();
    // Those of one round last alike.
    instants.sort_by_key(|instant| instant.after_ms);
    let all = kill_all(&instants.chunks(4).collect::<Vec<_>>(), "20");
    let worst_ms = all.iter().filter_map(|left| left.short_ms).fold(0.0, f64::max);
    let recording = all.iter().filter(|left| left.messages > 0).count();
    check(&all);
    println!(
        "seed {seed}: {} kills, {recording} of them with messages in the log; the worst lost {worst_ms:.0} ms; every log opened, \
         every next run went on and finalised it",
        all.len()
    );
}

/// What must be so after every kill, and once the next run has been there.
fn check(all: &[Left]) {
    let logs: Vec<_> = all.iter().map(|left| left.log.clone()).collect();
    let by_python = python_counts("stream", &logs);
    for (n, left) in all.iter().enumerate() {
        println!("{:?}: {} messages, last sample {:?} ms before the kill", left.instant, left.messages, left.short_ms);
        // Samples flow from before the homing on.
        assert!(left.short_ms.is_some() || left.instant.phase == Phase::Idle, "{:?}: no samples", left.instant);
        assert!(left.short_ms.is_none_or(|short| short <= 250.0), "{:?}: {:?} ms short", left.instant, left.short_ms);
        if let Some(counts) = &by_python {
            assert_eq!(counts[n], left.messages, "{:?}", left.instant);
        }
    }

    for left in all {
        let next = rigd(left.run.home())
            .args("run --load 5Nm --rpm 30 --revs 1 --direction ccw --rate 1kHz --json --out".split(' '))
            .arg(&left.run.out)
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&next.stderr);
        assert_eq!(next.status.code(), Some(0), "{said}");
        assert!(
            said.contains("recovered") && said.contains(&format!("{} messages kept", left.messages)),
            "{:?}: {said}",
            left.instant
        );
        assert!(riglog::info(&left.log).expect("a readable log").completeness.is_complete(), "{:?}", left.instant);
    }
    if let Some(counts) = python_counts("whole", &logs) {
        assert_eq!(counts, all.iter().map(|left| left.messages).collect::<Vec<_>>());
    }
}

/// Watches the shafts by the encoders alone, for any word to the servo would feed its watchdog; returns when they stood still.
fn standstill_by_encoders(profile: &Profile, seconds: f64) -> Instant {
    let counter = &profile.counter;
    let address = Address {
        device: DeviceKind::Counter,
        port: counter.port.clone(),
        baud: counter.baud,
        format: counter.format.clone(),
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async {
        let link = address.open().await.expect("the counter's port opens again");
        let mut device = COUNTERS[0].1(link, address, counter);
        device.identify().await.expect("it answers");
        device.start(1000.0).await.expect("it starts");
        let begun = Instant::now();
        let (mut turned, mut still_since) = (false, None);
        while begun.elapsed().as_secs_f64() < seconds {
            let batch = device.next().await.expect("samples");
            let moved = batch.input_delta.iter().map(|delta| i64::from(*delta)).sum::<i64>().abs();
            // 10 ms at 0.1 rpm are 120 of 7 200 000 counts a revolution.
            if moved > 120 {
                (turned, still_since) = (true, None);
            } else {
                let since = *still_since.get_or_insert_with(Instant::now);
                if since.elapsed() > Duration::from_millis(300) {
                    assert!(turned, "the shaft turned on after the kill, so that the watchdog had something to stop");
                    return since;
                }
            }
        }
        panic!("the shaft still turns {seconds} s after the kill");
    })
}

#[test]
fn a_servo_whose_master_was_killed_stops_within_lease_and_ramp() {
    let sim = Sim::start(3);
    let path = sim.profile(|_| {});
    let profile = Profile::load(&path).expect("a profile");
    let mut run = Run::with_profile(&path, &["--revs", "20", "--direction", "ccw"]);
    run.await_phase(|phase, _| phase == Phase::Record);
    let killed = Instant::now();
    run.process.signal(nix::sys::signal::Signal::SIGKILL);
    run.process.wait(5.0);
    let stood = standstill_by_encoders(&profile, 10.0).duration_since(killed).as_secs_f64();
    // The drive's watchdog counts whole seconds; its ramp is given for 3000 rpm of the motor; the coupling rings out a little.
    let ramp_s = 30.0 * profile.servo.reduction / 3000.0 * profile.servo.decel_ms * 1e-3;
    let limit_s = profile.sequence.lease_s.ceil() + ramp_s + 0.5;
    println!(
        "standstill {stood:.2} s after the kill, limit {limit_s:.2} s (lease {} s, ramp {ramp_s} s)",
        profile.sequence.lease_s
    );
    assert!(stood <= limit_s, "{stood} s");

    let state = sim.servo().state();
    assert!(state.motor_rpm.abs() < 1.0 && !state.on, "{state:?}");
    assert_eq!(state.alarm, wire::asda_b2::ALARM_COMMUNICATION_TIMEOUT, "the watchdog did it");

    // And the rig is as good as before: the next run clears the watchdog's alarm and measures.
    let again = Run::with_profile(&path, &["--revs", "1", "--direction", "ccw"]).wait(60.0);
    assert_eq!(again.code, Some(0), "{}", again.stderr);
}
