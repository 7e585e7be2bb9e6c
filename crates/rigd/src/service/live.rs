//! What the rig is doing, read from the log while it is written. The recorder does not know of it and can never be held up by it.

use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use riglog::proto::{RigState, TransmissionError};
use riglog::{Follower, Following, Record, RunMetadata, part_path};
use serde_json::{Value, json};

use crate::run::space::free_bytes;

/// How often the log is looked at, and the directory.
const POLL: Duration = Duration::from_millis(100);
const LOOK: Duration = Duration::from_secs(1);
/// TE points that are kept: some fourteen revolutions.
const POINTS: usize = 10_000;
/// Points of one answer.
const ANSWER: usize = 4_000;
const EVENTS: usize = 50;

/// What a page shows.
#[derive(Default)]
pub struct Live {
    log: Option<PathBuf>,
    run: Option<RunMetadata>,
    state: Option<RigState>,
    latest: Option<TransmissionError>,
    /// TE points with their running number.
    points: VecDeque<(u64, TransmissionError)>,
    next_point: u64,
    events: VecDeque<(u64, i32, String, String)>,
    samples: u64,
    ended: bool,
    changed: Option<Instant>,
    trouble: Option<String>,
    free_bytes: Option<u64>,
}

impl Live {
    fn take(&mut self, record: Record) {
        self.changed = Some(Instant::now());
        match record {
            Record::Run(run) => self.run = Some(run),
            Record::State { state, .. } => self.state = Some(state),
            Record::Angles { batch, .. } => self.samples += batch.len() as u64,
            Record::Te { te, .. } => {
                if self.points.len() >= POINTS {
                    self.points.pop_front();
                }
                self.points.push_back((self.next_point, te));
                self.next_point += 1;
                self.latest = Some(te);
            }
            Record::Event { log_time_ns, event, .. } => {
                if self.events.len() >= EVENTS {
                    self.events.pop_front();
                }
                self.events.push_back((log_time_ns, event.level, event.name, event.message));
            }
            _ => {}
        }
    }

    /// Another log: what was shown of the one before is gone, but point numbers go on, so that pages notice.
    fn begin(&mut self, log: &Path) {
        *self = Self {
            log: Some(log.to_owned()),
            next_point: self.next_point,
            free_bytes: self.free_bytes,
            ..Self::default()
        };
    }

    /// `rigd.status/1`.
    #[must_use]
    pub fn status(&self) -> Value {
        let name = self.log.as_ref().and_then(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned());
        json!({
            "schema": "rigd.status/1",
            "log": name,
            "ended": self.ended,
            "age_s": self.changed.map(|changed| changed.elapsed().as_secs_f64()),
            "trouble": self.trouble,
            "free_mb": self.free_bytes.map(|bytes| bytes as f64 * 1e-6),
            "samples": self.samples,
            "run": self.run.as_ref().map(RunMetadata::to_map),
            "state": self.state.as_ref().map(|state| json!({
                "phase": state.phase().as_str_name(),
                "direction": state.direction().sense().map(|sense| sense.as_str()),
                "speed_setpoint_rpm": state.speed_setpoint_rpm,
                "speed_rpm": state.speed_rpm,
                "load_setpoint_nm": state.load_setpoint_nm,
                "load_nm": state.load_nm,
                "brake_current_a": state.brake_current_a,
                "brake_temperature_c": state.brake_temperature_c,
                "servo_alarm": state.servo_alarm,
                "samples": state.samples,
                "samples_lost": state.samples_lost,
            })),
            "te": self.latest.as_ref().map(|te| json!({
                "theta1_rad": te.theta1_rad,
                "te_rad": te.te_rad,
                "model_te_rad": te.model_te_rad,
                "revolution": te.revolution,
            })),
            "events": self.events.iter().rev().take(20).map(|(at_ns, level, name, message)| json!({
                "time_unix_ns": at_ns, "level": level, "name": name, "message": message,
            })).collect::<Vec<_>>(),
        })
    }

    /// `rigd.te/1`: points from number `since` on, at most `ANSWER`, the newest where there are more.
    #[must_use]
    pub fn points(&self, since: u64) -> Value {
        let from = since.max(self.next_point.saturating_sub(ANSWER as u64));
        let points: Vec<Value> = self
            .points
            .iter()
            .filter(|(number, _)| *number >= from)
            .map(|(_, te)| {
                let sense = te.direction().sense().map_or(0.0, |sense| sense.sign());
                json!([te.theta1_rad.rem_euclid(TAU), te.te_rad, te.model_te_rad, sense, te.revolution, te.load_nm])
            })
            .collect();
        json!({
            "schema": "rigd.te/1",
            "columns": ["theta1_rad", "te_rad", "model_te_rad", "sense", "revolution", "load_nm"],
            "log": self.log.as_ref().and_then(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned()),
            "first": from,
            "next": self.next_point,
            "points": points,
        })
    }
}

/// The live values, shared with the thread that reads them.
#[derive(Clone, Default)]
pub struct Shared(Arc<Mutex<Live>>);

impl Shared {
    /// The values as they are now.
    pub fn lock(&self) -> MutexGuard<'_, Live> {
        // Left half changed, a value is old at worst.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Follows the newest log in `directory` for as long as someone holds the values.
///
/// # Errors
/// The operating system refuses a thread.
pub fn follow(directory: &Path) -> std::io::Result<Shared> {
    let shared = Shared::default();
    let theirs = Arc::downgrade(&shared.0);
    let directory = directory.to_owned();
    std::thread::Builder::new().name("live".into()).spawn(move || {
        let mut followed: Option<(PathBuf, Follower)> = None;
        let mut looked: Option<Instant> = None;
        while let Some(values) = theirs.upgrade() {
            let shared = Shared(values);
            if looked.is_none_or(|looked| looked.elapsed() >= LOOK) {
                looked = Some(Instant::now());
                look(&directory, &shared, &mut followed);
            }
            if let Some((_, follower)) = &mut followed {
                step(follower, &shared);
            }
            drop(shared);
            std::thread::sleep(POLL);
        }
    })?;
    Ok(shared)
}

/// Turns to the newest log.
fn look(directory: &Path, shared: &Shared, followed: &mut Option<(PathBuf, Follower)>) {
    shared.lock().free_bytes = free_bytes(directory);
    let Some(newest) = newest_log(directory) else { return };
    if followed.as_ref().is_some_and(|(path, _)| *path == newest) {
        return;
    }
    // A file without its first bytes yet is tried again.
    if let Ok(follower) = Follower::open(&newest) {
        shared.lock().begin(&newest);
        *followed = Some((newest, follower));
    }
}

fn step(follower: &mut Follower, shared: &Shared) {
    // Gathered first: whoever asks meanwhile does not wait for the disk.
    let mut records = Vec::new();
    let outcome = follower.poll(|record| records.push(record));
    let mut live = shared.lock();
    records.into_iter().for_each(|record| live.take(record));
    match outcome {
        Ok(following) => {
            live.ended = following == Following::Ended;
            live.trouble = None;
        }
        Err(error) => live.trouble = Some(error.to_string()),
    }
}

/// The log that was written last, in the directory or in one of a campaign in it; the first part of one that is split.
fn newest_log(directory: &Path) -> Option<PathBuf> {
    let inside =
        |directory: &Path| std::fs::read_dir(directory).into_iter().flatten().flatten().map(|entry| entry.path());
    let newest = inside(directory)
        .flat_map(|path| if path.is_dir() { inside(&path).collect() } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
        .filter_map(|path| Some((std::fs::metadata(&path).ok()?.modified().unwrap_or(SystemTime::UNIX_EPOCH), path)))
        .max()?
        .1;
    let first = part_path(&newest, 1);
    Some(if first.exists() { first } else { newest })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_numbered_bounded_and_given_once() {
        let mut live = Live::default();
        for n in 0..POINTS + 5 {
            let te = TransmissionError { te_rad: n as f64, theta1_rad: -0.5, ..TransmissionError::default() };
            live.take(Record::Te { log_time_ns: 0, publish_time_ns: 0, te });
        }
        let count = |value: &Value| value["points"].as_array().map_or(0, Vec::len);
        let first = live.points(0);
        assert_eq!(count(&first), ANSWER, "a page that comes late gets the newest");
        let next = first["next"].as_u64().unwrap();
        assert_eq!(next, POINTS as u64 + 5);
        assert_eq!(count(&live.points(next)), 0);
        assert_eq!(count(&live.points(next - 3)), 3);
        assert_eq!(count(&live.points(u64::MAX)), 0);
        let theta1 = first["points"][0][0].as_f64().unwrap();
        assert!((theta1 - (TAU - 0.5)).abs() < 1e-12);
        live.begin(Path::new("b.mcap"));
        assert_eq!((count(&live.points(0)), live.points(0)["next"].as_u64()), (0, Some(next)));
    }
}
