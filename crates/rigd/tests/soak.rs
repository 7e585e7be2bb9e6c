//! Hours of a campaign with random faults, in virtual time: no leak, no loss unmarked, every run finished. `just soak` runs eight hours;
//! `cargo test` a slice of a few minutes.

mod support;

use std::cell::RefCell;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

use rand::{Rng as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use rigd::campaign::estimate::estimate;
use rigd::campaign::journal::Journal;
use rigd::campaign::observer::CampaignObserver;
use rigd::campaign::plan::CampaignPlan;
use rigd::campaign::schedule::Schedule;
use rigd::device::DeviceKind;
use rigd::run::job::Job;
use rigd::run::progress::Progress;
use rigd::run::run_job::Policy;
use rigd::run::session::{self, JobSpec, LogHead, SessionContext};
use rigd::simulated;
use riglog::pair;
use riglog::{LogReader, Record};
use support::bench::{Bench, events, in_virtual_time};
use tokio::time::sleep;

/// What was done to the rig, and how often.
#[derive(Debug, Default)]
struct Done {
    unplugged: [u32; 3],
    restarted: u32,
    pressed: u32,
    heated: u32,
    paused: u32,
}

impl Done {
    fn all(&self) -> u32 {
        self.unplugged.iter().sum::<u32>() + self.restarted + self.pressed + self.heated + self.paused
    }
}

/// Does something to the rig every now and then, for ever.
async fn disturb(bench: Bench, done: Rc<RefCell<Done>>, seed: u64) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut within = move |low_s: u64, high_s: u64| {
        Duration::from_millis(low_s * 1000 + random.next_u64() % ((high_s - low_s) * 1000))
    };
    loop {
        sleep(within(40, 240)).await;
        let what = within(0, 8).as_secs();
        match what {
            0..=3 => {
                let part = DeviceKind::ALL[what as usize % 3];
                done.borrow_mut().unplugged[part as usize] += 1;
                bench.world.borrow_mut().unplug(part);
                sleep(within(0, 20)).await;
                bench.world.borrow_mut().replug(part);
            }
            4 => {
                done.borrow_mut().restarted += 1;
                bench.world.borrow_mut().unplug(DeviceKind::Counter);
                bench.world.borrow_mut().restart_counter();
                sleep(within(1, 5)).await;
                bench.world.borrow_mut().replug(DeviceKind::Counter);
            }
            5 => {
                done.borrow_mut().pressed += 1;
                bench.world.borrow_mut().press_emergency_stop(true);
                sleep(within(1, 30)).await;
                bench.world.borrow_mut().press_emergency_stop(false);
            }
            6 => {
                done.borrow_mut().heated += 1;
                bench.world.borrow_mut().heat_brake_by(70.0);
                sleep(within(5, 60)).await;
                bench.world.borrow_mut().heat_brake_by(0.0);
            }
            _ => {
                done.borrow_mut().paused += 1;
                bench.stop.pause();
                // An operator's pause lasts in real time; long enough that it is due.
                sleep(within(6, 8)).await;
                bench.stop.go_on();
            }
        }
    }
}

/// Resident memory of this process, MiB.
fn resident_mib() -> f64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = text.split_whitespace().nth(1).and_then(|pages| pages.parse().ok()).unwrap_or(0.0);
    pages * 4096.0 / 1_048_576.0
}

/// Batches of all logs by their numbers: every gap, within a log or between two, is told by an event with the same numbers. The
/// samples, and those that are missing.
fn marked(logs: &[PathBuf]) -> (u64, u64) {
    let (mut batches, mut told) = (Vec::new(), HashSet::new());
    for log in logs {
        for record in LogReader::open(log).expect("a readable log").flatten() {
            if let Record::Angles { batch, .. } = record {
                batches.push((batch.first_sample, batch.input_delta.len() as u64));
            }
        }
        told.extend(events(log).into_iter().filter(|(_, name, _)| name == "loss").map(|(_, _, text)| text));
    }
    batches.sort_unstable();
    let (mut next, mut missing, mut samples) = (0, 0, 0);
    for (first, count) in batches {
        assert!(first >= next, "sample {first} was written twice");
        if first > next {
            let lost = first - next;
            let said = format!("samples {next} to {} never arrived ({lost} lost)", first - 1);
            assert!(told.contains(&said), "not told: {said}");
            missing += lost;
        }
        samples += count;
        next = first + count;
    }
    (samples, missing)
}

/// A campaign of so many hours with faults.
fn soak(hours: f64, seed: u64) {
    in_virtual_time(async {
        let bench = Bench::new(seed);
        let directory = bench.directory.path().to_owned();
        // Twelve runs take about 250 s of the rig's time with their share of faults.
        let repeats = (hours * 3600.0 / 250.0).ceil();
        let text = format!(
            "rate_hz = {:?}\norder = \"random\"\nrepeats = {repeats}\nreconnect_s = 120.0\n\
             [suspend]\ncool_to_c = 60.0\npatience_min = 30.0\nafter_emergency_stop = \"release\"\n\
             [reference]\ndirection = \"both\"\nload_nm = 5.0\nspeed_rpm = 30.0\nrevolutions = 2\n\
             [[matrix]]\ndirections = [\"both\"]\nloads_nm = [5.0, 10.0]\nspeeds_rpm = [15.0, 30.0, 50.0]\nrevolutions = 6\n",
            bench.rate_hz
        );
        let plan = CampaignPlan::parse(&text, Path::new("soak.toml")).expect("a plan");
        plan.check(&bench.profile, Path::new("soak.toml")).expect("within limits");
        let schedule = Schedule::of(&plan);
        let runs = schedule.runs.clone();
        let indices = schedule.from(0);
        let found = estimate(&runs, plan.settle(), &bench.profile);
        let journal = Journal::open(&directory, &schedule.fingerprint).expect("a journal");
        let (pair_toml, model) = pair::load(None).expect("the built-in pair");
        let head = LogHead { pair_toml, ..LogHead::default() };
        let mut observer = CampaignObserver::new(
            (&directory, journal),
            bench.profile.clone(),
            head,
            bench.clock,
            (schedule, indices, found.clone()),
            true,
        );
        let recorder = observer.begin().expect("a log");
        let done = Rc::new(RefCell::new(Done::default()));
        let hands = tokio::task::spawn_local(disturb(bench.clone(), Rc::clone(&done), seed));
        let memory = Rc::new(RefCell::new(Vec::new()));
        let watch = {
            let memory = Rc::clone(&memory);
            let period = Duration::from_secs_f64(hours * 3600.0 / 16.0);
            tokio::task::spawn_local(async move {
                loop {
                    sleep(period).await;
                    memory.borrow_mut().push(resident_mib());
                }
            })
        };
        let policy = Policy { reconnect_s: plan.reconnect_s, suspend: plan.suspend() };
        let job = Job::new(runs.clone(), plan.rate_hz, 0);
        let context = SessionContext {
            profile: bench.profile.clone(),
            model,
            recorder,
            progress: Progress::new(job.revolutions(), true),
            links: simulated::links_to(&bench.world),
            clock: bench.clock,
            stop: bench.stop.clone(),
        };
        let began = bench.clock.now_ns();
        let outcome = session::execute_job(context, JobSpec { job, policy }, &mut observer).await;
        let took_h = (bench.clock.now_ns() - began) as f64 / 3.6e12;
        hands.abort();
        watch.abort();
        observer.conclude(outcome.finalised, outcome.stop_reason.as_ref()).expect("the journal");

        assert!(outcome.stop_reason.is_none(), "{:?}", outcome.stop_reason);
        let finished = observer.all_finished();
        assert_eq!(finished.len(), runs.len(), "every run finished");
        let mut logs = Vec::new();
        for place in [directory.clone(), directory.join("unfinished")] {
            let entries = std::fs::read_dir(place).into_iter().flatten().flatten().map(|entry| entry.path());
            logs.extend(entries.filter(|path| path.extension().is_some_and(|extension| extension == "mcap")));
        }
        for log in &logs {
            assert!(riglog::info(log).expect("a log").completeness.is_complete(), "{}", log.display());
        }
        let (samples, missing) = marked(&logs);
        assert_eq!(missing, outcome.lost, "no loss but what the acquisition counted");
        // A finished run has every sample of its own, whatever was lost on the way to it.
        for run in finished {
            let expected = run.revolutions * 60.0 / run.speed_rpm * bench.rate_hz;
            let recorded =
                riglog::info(directory.join(&run.log)).expect("a log").runs.iter().map(|run| run.samples).sum::<u64>();
            assert!((recorded as f64 / expected - 1.0).abs() < 0.02, "{}: {recorded} samples, not {expected}", run.log);
        }
        let memory = memory.borrow();
        println!(
            "{took_h:.2} simulated hours, {} faults {:?}, {} interruptions, {} of {} runs finished, {} logs, {samples} samples, \
             {missing} missing and all of them told, resident {:?} MiB",
            done.borrow().all(),
            done.borrow(),
            observer.interruptions.len(),
            finished.len(),
            runs.len(),
            logs.len(),
            memory.iter().map(|mib| mib.round()).collect::<Vec<_>>()
        );
        // Flat: the second half needs no more than the first, but for a little.
        if memory.len() >= 8 {
            let (early, late) = memory.split_at(memory.len() / 2);
            let most = |part: &[f64]| part.iter().copied().fold(0.0, f64::max);
            assert!(most(late) < most(early) * 1.1 + 4.0, "memory grows: {memory:?} MiB");
        }
    });
}

#[test]
fn ten_minutes_with_faults() {
    soak(1.0 / 6.0, 1);
}

/// `just soak`.
#[test]
#[ignore = "takes minutes; `just soak`"]
fn hours_with_faults() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<f64>().ok());
    soak(number("RIG_HOURS").unwrap_or(8.0), number("RIG_SEED").unwrap_or(1.0) as u64);
}
