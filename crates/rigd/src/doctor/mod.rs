//! What is wrong with a rig before it runs: ports, identities, latencies, watchdog, encoders, and one slow turn with consent.
//!
//! Nothing moves without consent. Every finding says what to do.

mod port;
mod turn;

use std::time::Duration;

use serde::Serialize;
use tokio::time::{Instant, timeout};

use crate::device::bus::BusStatistics;
use crate::device::refused::{TE_ASKED_RAD, check_resolution};
use crate::device::{Brake, BrakeStatus, Counter, DeviceError, DeviceKind, Servo, Zero, drivers};
use crate::link::{Address, Link};
use crate::profile::Profile;
use crate::run::session::Links;
use crate::run::stop::StopRequests;

/// How grave a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// As it should be.
    Good,
    /// It will run; know this.
    Warning,
    /// It will not run, or must not.
    Fault,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// How grave.
    pub grade: Grade,
    /// What was looked at.
    pub subject: String,
    /// What was found, with figures.
    pub found: String,
    /// What to do; empty when nothing.
    pub advice: String,
}

/// What was found so far.
#[derive(Debug, Default)]
pub struct Report {
    /// In the order in which it was looked at.
    pub findings: Vec<Finding>,
}

impl Report {
    fn add(&mut self, grade: Grade, subject: impl Into<String>, found: impl Into<String>, advice: impl Into<String>) {
        self.findings.push(Finding { grade, subject: subject.into(), found: found.into(), advice: advice.into() });
    }

    fn good(&mut self, subject: impl Into<String>, found: impl Into<String>) {
        self.add(Grade::Good, subject, found, "");
    }

    /// How many there are of a grade.
    #[must_use]
    pub fn count(&self, grade: Grade) -> usize {
        self.findings.iter().filter(|finding| finding.grade == grade).count()
    }
}

/// Status requests whose times are looked at.
const REQUESTS: u32 = 20;
/// Sampling while the encoders are looked at, Hz.
const RATE_HZ: f64 = 1000.0;
/// How long the encoders are looked at, s.
const LOOK_S: f64 = 0.5;

/// What the operator consents to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Consent {
    /// One slow turn.
    pub turn: bool,
    /// A drive that has no watchdog of its own.
    pub no_watchdog: bool,
}

/// Looks at a rig.
pub async fn examine(profile: &Profile, links: Links, consent: Consent, stop: &StopRequests) -> Report {
    let mut report = Report::default();
    let (servo, brake, counter) = (&profile.servo, &profile.brake, &profile.counter);
    let at =
        |device, port: &str, baud, format: &str| Address { device, port: port.into(), baud, format: format.into() };
    let addresses = [
        at(DeviceKind::Servo, &servo.port, servo.baud, &servo.format),
        at(DeviceKind::Brake, &brake.port, brake.baud, &brake.format),
        at(DeviceKind::Counter, &counter.port, counter.baud, &counter.format),
    ];
    for address in &addresses {
        port::examine(&mut report, address);
    }
    if let Some(qsb) = &counter.qsb {
        port::examine(&mut report, &at(DeviceKind::Counter, &qsb.output_port, counter.baud, &counter.format));
    }
    let [at_servo, at_brake, at_counter] = addresses;
    let mut servo = match (
        connect(&mut report, links.servo, &at_servo).await,
        drivers::find(drivers::SERVOS, DeviceKind::Servo, &servo.driver),
    ) {
        (Some(link), Ok(open)) => Some(open(link, at_servo, servo)),
        _ => None,
    };
    let mut brake = match (
        connect(&mut report, links.brake, &at_brake).await,
        drivers::find(drivers::BRAKES, DeviceKind::Brake, &brake.driver),
    ) {
        (Some(link), Ok(open)) => Some(open(link, at_brake, brake)),
        _ => None,
    };
    let mut counter = match (
        connect(&mut report, links.counter, &at_counter).await,
        drivers::find(drivers::COUNTERS, DeviceKind::Counter, &counter.driver),
    ) {
        (Some(link), Ok(open)) => Some(open(link, at_counter, counter)),
        _ => None,
    };
    let mut fit = true;
    if let Some(servo) = &mut servo {
        fit &= examine_servo(&mut report, servo.as_mut(), profile, consent.no_watchdog).await;
    }
    if let Some(brake) = &mut brake {
        fit &= examine_brake(&mut report, brake.as_mut(), profile).await;
    }
    let mut counts_per_rev = None;
    if let Some(counter) = &mut counter {
        counts_per_rev = examine_counter(&mut report, counter.as_mut()).await;
    }
    match (consent.turn, servo, brake, counter, counts_per_rev) {
        (true, Some(mut servo), Some(mut brake), Some(mut counter), Some(counts)) if fit => {
            let devices = turn::Devices { servo: servo.as_mut(), brake: brake.as_mut(), counter: counter.as_mut() };
            turn::examine(&mut report, profile, devices, counts, consent.no_watchdog, stop).await;
        }
        (true, ..) => report.add(
            Grade::Fault,
            "turn",
            "not tried: a device is missing or unfit",
            "mend the faults above, then ask again",
        ),
        (false, ..) => report.add(
            Grade::Warning,
            "turn",
            "not tried: encoder senses and indices are unproven",
            "clear the rig and give consent with --turn",
        ),
    }
    report
}

async fn connect(report: &mut Report, link: Option<Link>, address: &Address) -> Option<Link> {
    if link.is_some() {
        return link;
    }
    match address.open().await {
        Ok(link) => Some(link),
        Err(error) => {
            report.add(Grade::Fault, address.device.name(), error.to_string(), "see the finding on its port above");
            None
        }
    }
}

/// Identity, latency, speed limit, and the watchdog as it reads back. The motor stays off.
async fn examine_servo(
    report: &mut Report,
    servo: &mut dyn Servo,
    profile: &Profile,
    accept_no_watchdog: bool,
) -> bool {
    match servo.identify().await {
        Ok(identity) => report.good("servo", identity.text),
        Err(error) => {
            report.add(
                Grade::Fault,
                "servo",
                error.to_string(),
                "check power, cable, line settings and the driver's name",
            );
            return false;
        }
    }
    let begun = Instant::now();
    let mut slowest = Duration::ZERO;
    for _ in 0..REQUESTS {
        let asked = Instant::now();
        match servo.status().await {
            Ok(status) if status.alarm != 0 => {
                report.add(
                    Grade::Fault,
                    "servo alarm",
                    format!("code {:#06x}", status.alarm),
                    "look it up in the drive's manual, remove the cause, reset the drive",
                );
                return false;
            }
            Ok(_) => {}
            Err(error) => {
                report.add(Grade::Fault, "servo status", error.to_string(), "check cable, shield and termination");
                return false;
            }
        }
        slowest = slowest.max(asked.elapsed());
    }
    latency(report, "servo", begun.elapsed(), slowest, profile, &servo.statistics());
    let mut fit = true;
    match servo.max_motor_rpm().await {
        Ok(allowed) => {
            let wanted = profile.limits.speed_rpm * profile.servo.reduction;
            if wanted > allowed {
                report.add(
                    Grade::Warning,
                    "servo speed",
                    format!("the drive allows {allowed} rpm of the motor, limits.speed_rpm needs {wanted}"),
                    "lower limits.speed_rpm, or raise the drive's own limit",
                );
            } else {
                report.good("servo speed", format!("the drive allows {allowed} rpm of the motor, {wanted} are needed"));
            }
        }
        Err(error) => report.add(Grade::Warning, "servo speed", error.to_string(), "check the map's max_speed"),
    }
    let lease = Duration::from_secs_f64(profile.sequence.lease_s);
    match servo.prepare(profile.servo.accel_ms, profile.servo.decel_ms, lease).await {
        Ok(()) => report.good(
            "servo watchdog",
            format!(
                "armed for {} s (in the steps that the drive counts) and read back; the motor is off",
                lease.as_secs_f64()
            ),
        ),
        Err(error @ DeviceError::NoWatchdog { .. }) if accept_no_watchdog => report.add(
            Grade::Warning,
            "servo watchdog",
            format!("ACCEPTED WITHOUT A WATCHDOG by --accept-no-watchdog: {error}"),
            "stay at the emergency stop while it turns: nothing else ends the motion when this program dies",
        ),
        Err(error) => {
            fit = false;
            report.add(
                Grade::Fault,
                "servo watchdog",
                error.to_string(),
                "a drive that has none turns on when this program dies: take one that has, or fit a hard-wired speed watch; --accept-no-watchdog turns it all the same",
            );
        }
    }
    // Frees the motor and disarms the watchdog, which would raise an alarm when the line falls silent.
    if let Err(error) = servo.set_enabled(false).await {
        fit = false;
        report.add(Grade::Fault, "servo off", error.to_string(), "switch the drive off by hand and look at its panel");
    }
    fit
}

async fn examine_brake(report: &mut Report, brake: &mut dyn Brake, profile: &Profile) -> bool {
    match brake.identify().await {
        Ok(identity) => report.good("brake", identity.text),
        Err(error) => {
            report.add(
                Grade::Fault,
                "brake",
                error.to_string(),
                "check power, cable, line settings and the driver's name",
            );
            return false;
        }
    }
    let begun = Instant::now();
    let mut slowest = Duration::ZERO;
    let mut last = BrakeStatus::default();
    for _ in 0..REQUESTS / 4 {
        let asked = Instant::now();
        match brake.status().await {
            Ok(status) => last = status,
            Err(error) => {
                report.add(Grade::Fault, "brake status", error.to_string(), "check cable, shield and termination");
                return false;
            }
        }
        slowest = slowest.max(asked.elapsed());
    }
    latency(report, "brake", begun.elapsed() * 4, slowest, profile, &brake.statistics());
    let mut fit = true;
    if last.tripped {
        fit = false;
        report.add(
            Grade::Fault,
            "brake protection",
            "has tripped",
            "check the coil and its cable, then reset it at the panel",
        );
    }
    let limit = profile.limits.brake_temperature_c;
    if last.temperature_c > limit {
        fit = false;
        report.add(
            Grade::Fault,
            "brake temperature",
            format!("{} °C, limit {limit} °C", last.temperature_c),
            "let it cool",
        );
    } else {
        report.good("brake temperature", format!("{} °C, limit {limit} °C", last.temperature_c));
    }
    if profile.brake.current_limit_a > brake.max_current_a() {
        report.add(
            Grade::Warning,
            "brake current",
            format!(
                "brake.current_limit_a = {} is beyond the source's {} A",
                profile.brake.current_limit_a,
                brake.max_current_a()
            ),
            "lower it, or take a larger source",
        );
    }
    fit
}

/// Mean and slowest time of a poll against the polling period.
fn latency(
    report: &mut Report,
    device: &str,
    total: Duration,
    slowest: Duration,
    profile: &Profile,
    line: &BusStatistics,
) {
    let mean_ms = total.as_secs_f64() * 1e3 / f64::from(REQUESTS);
    let slowest_ms = slowest.as_secs_f64() * 1e3;
    let found = format!("{mean_ms:.1} ms a poll, slowest {slowest_ms:.1} ms; {line}");
    if mean_ms * 2.0 > profile.sequence.lease_s * 1e3 {
        report.add(
            Grade::Fault,
            format!("{device} latency"),
            found,
            "a lease must hold two polls: raise sequence.lease_s or the line's speed",
        );
    } else if line.timeouts + line.damaged > 0 {
        report.add(
            Grade::Warning,
            format!("{device} latency"),
            found,
            "check cable, shield, termination and earth; the line should lose nothing",
        );
    } else {
        report.good(format!("{device} latency"), found);
    }
}

/// Identity, resolution, and half a second of samples. Gives the counts a revolution.
async fn examine_counter(report: &mut Report, counter: &mut dyn Counter) -> Option<[u64; 2]> {
    let identity = match counter.identify().await {
        Ok(identity) => identity,
        Err(error) => {
            report.add(
                Grade::Fault,
                "counter",
                error.to_string(),
                "check power, cable, line settings and the driver's name",
            );
            return None;
        }
    };
    report.good("counter", identity.text.clone());
    if identity.zero != Zero::Index {
        report.add(
            Grade::Warning,
            "encoder zero",
            match identity.zero {
                Zero::Counts(counts) => format!("no index: both angles are zero at counts {counts:?}, by the profile, as long as no reader was switched off"),
                Zero::Begin | Zero::Index => "no index: both angles are zero where the run begins".into(),
            },
            "put the pair at its zero before a run, or give counter.qsb.zero_counts; TE of non-circular gears is wrong with a wrong zero",
        );
    }
    match check_resolution(identity.counts_per_rev, TE_ASKED_RAD) {
        Ok(step) => report.good(
            "encoder resolution",
            format!("a count of each is {:.2} µrad, TE is asked to {:.0} µrad", step * 1e6, TE_ASKED_RAD * 1e6),
        ),
        Err(step) => report.add(
            Grade::Fault,
            "encoder resolution",
            format!(
                "a count of each is {:.1} µrad together, TE is asked to {:.0} µrad",
                step * 1e6,
                TE_ASKED_RAD * 1e6
            ),
            "take encoders with more lines or a higher interpolation",
        ),
    }
    if let Err(error) = counter.start(RATE_HZ).await {
        report.add(Grade::Fault, "counter stream", error.to_string(), "check the line's speed");
        return None;
    }
    let (mut samples, mut lost, mut expected) = (0_u64, 0_u64, None);
    let end = Instant::now() + Duration::from_secs_f64(LOOK_S);
    while let Ok(batch) = timeout(end.saturating_duration_since(Instant::now()), counter.next()).await {
        match batch {
            Ok(batch) => {
                lost += expected.map_or(0, |first: u64| batch.first_sample.saturating_sub(first));
                expected = Some(batch.first_sample + batch.len() as u64);
                samples += batch.len() as u64;
            }
            Err(error) => {
                report.add(Grade::Fault, "counter stream", error.to_string(), "check cable and plug");
                return None;
            }
        }
    }
    if let Err(error) = counter.stop().await {
        report.add(Grade::Warning, "counter stop", error.to_string(), "switch the box off and on");
    }
    let found = format!(
        "{samples} samples in {LOOK_S} s at {} Hz, {lost} lost",
        if identity.own_rate { identity.max_rate_hz } else { RATE_HZ }
    );
    if samples == 0 || lost > 0 {
        report.add(
            Grade::Fault,
            "counter stream",
            found,
            "check the line's speed and the USB hub; no sample may be lost",
        );
    } else {
        report.good("counter stream", found);
    }
    Some(identity.counts_per_rev)
}
