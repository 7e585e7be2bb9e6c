//! One slow turn without load: do the encoders count, in the sense that the profile says, and do both show their index.

use std::time::Duration;

use tokio::time::{Instant, timeout};
use wire::{SampleFlags, Samples};

use super::{Grade, RATE_HZ, Report};
use crate::device::{Brake, Counter, DeviceError, Servo};
use crate::profile::Profile;
use crate::run::stop::StopRequests;

/// Speed of the turn, rpm of the driver: slow enough to jump clear, and never over the profile's limit.
const TURN_RPM: f64 = 3.0;
/// Turns of the driver: with closures of one, each index passes for certain.
const TURNS: f64 = 1.3;
/// Counts of the input that may be off a whole number of turns' worth of motor, as a share.
const TOLERANCE: f64 = 0.1;
/// Slower than this is standstill, turns a second of the input.
const STANDSTILL: f64 = 2e-4;

/// What the encoders showed.
#[derive(Default)]
struct Seen {
    first: Option<[i64; 2]>,
    last: [i64; 2],
    index: [bool; 2],
    /// Input counts and time of the latest batches, for the speed.
    batch: Option<(i64, Instant)>,
    turns_a_second: f64,
}

impl Seen {
    fn take(&mut self, batch: &Samples, counts_per_rev: u64) {
        let last = [batch.input_counts().last(), batch.output_counts().last()];
        let [Some(input), Some(output)] = last else { return };
        self.first.get_or_insert([batch.input_base, batch.output_base]);
        self.last = [input, output];
        self.index[0] |= batch.flags.has(SampleFlags::INPUT_INDEX);
        self.index[1] |= batch.flags.has(SampleFlags::OUTPUT_INDEX);
        let now = Instant::now();
        if let Some((before, then)) = self.batch
            && now > then
        {
            self.turns_a_second = (input - before) as f64 / counts_per_rev as f64 / (now - then).as_secs_f64();
        }
        self.batch = Some((input, now));
    }

    fn turned(&self, counts_per_rev: [u64; 2]) -> [f64; 2] {
        let first = self.first.unwrap_or_default();
        [0, 1].map(|n| (self.last[n] - first[n]) as f64 / counts_per_rev[n] as f64)
    }
}

/// The whole rig takes part.
pub struct Devices<'a> {
    /// The servo drive.
    pub servo: &'a mut dyn Servo,
    /// The brake's driver.
    pub brake: &'a mut dyn Brake,
    /// The reader of the encoders.
    pub counter: &'a mut dyn Counter,
}

/// Turns the driver slowly and looks at both encoders. The motor is off afterwards, whatever happened.
pub async fn examine(
    report: &mut Report,
    profile: &Profile,
    mut devices: Devices<'_>,
    counts_per_rev: [u64; 2],
    accept_no_watchdog: bool,
    stop: &StopRequests,
) {
    let mut seen = Seen::default();
    let speed_rpm = TURN_RPM.min(profile.limits.speed_rpm);
    let armed = begin(profile, &mut devices, accept_no_watchdog).await;
    let outcome = match armed {
        Ok(()) => turn(profile, &mut devices, counts_per_rev, stop, speed_rpm, &mut seen).await,
        Err(error) => Err(error),
    };
    let off = switch_off(profile, &mut devices, counts_per_rev, speed_rpm, &mut seen).await;
    if let Err(error) = outcome {
        report.add(Grade::Fault, "turn", error.to_string(), "remove the cause, then ask again");
    }
    if stop.any() {
        report.add(Grade::Fault, "turn", "stopped by the operator", "ask again when the rig is clear");
    }
    match off {
        Ok(true) => report.good("standstill", "confirmed by the encoders; the motor is off"),
        Ok(false) => report.add(
            Grade::Fault,
            "standstill",
            "not confirmed by the encoders",
            "do not touch the rig: switch the drive off by hand and look at the encoder's cable",
        ),
        Err(error) => report.add(Grade::Fault, "servo off", error.to_string(), "switch the drive off by hand"),
    }
    judge(report, profile, &seen, counts_per_rev);
}

/// Starts the encoders and arms the drive's watchdog, or accepts that it has none.
async fn begin(profile: &Profile, devices: &mut Devices<'_>, accept_no_watchdog: bool) -> Result<(), DeviceError> {
    devices.counter.start(RATE_HZ).await?;
    devices.brake.release().await?;
    let lease = Duration::from_secs_f64(profile.sequence.lease_s);
    match devices.servo.prepare(profile.servo.accel_ms, profile.servo.decel_ms, lease).await {
        Err(DeviceError::NoWatchdog { .. }) if accept_no_watchdog => Ok(()),
        armed => armed,
    }
}

async fn turn(
    profile: &Profile,
    devices: &mut Devices<'_>,
    counts_per_rev: [u64; 2],
    stop: &StopRequests,
    speed_rpm: f64,
    seen: &mut Seen,
) -> Result<(), DeviceError> {
    let servo = &mut *devices.servo;
    servo.set_motor_rpm(0.0).await?;
    servo.set_enabled(true).await?;
    servo.set_motor_rpm(speed_rpm * profile.servo.reduction * f64::from(profile.servo.sense)).await?;
    let end = Instant::now() + Duration::from_secs_f64(TURNS * 60.0 / speed_rpm + profile.servo.accel_ms * 1e-3);
    while Instant::now() < end && !stop.any() {
        watch(profile, devices, counts_per_rev[0], seen).await?;
        if seen.turned(counts_per_rev)[0].abs() >= TURNS {
            break;
        }
    }
    Ok(())
}

/// One poll: renews the lease and takes what the encoders sent.
async fn watch(
    profile: &Profile,
    devices: &mut Devices<'_>,
    counts_per_rev: u64,
    seen: &mut Seen,
) -> Result<(), DeviceError> {
    let status = devices.servo.status().await?;
    if status.alarm != 0 {
        return Err(DeviceError::Alarm {
            port: profile.servo.port.clone(),
            alarm: format!("code {:#06x}", status.alarm),
        });
    }
    let until = Instant::now() + profile.poll_period();
    while let Ok(batch) = timeout(until.saturating_duration_since(Instant::now()), devices.counter.next()).await {
        seen.take(&batch?, counts_per_rev);
    }
    Ok(())
}

/// Speed 0, standstill by the encoders, motor off. Every step is tried whatever became of the one before.
async fn switch_off(
    profile: &Profile,
    devices: &mut Devices<'_>,
    counts_per_rev: [u64; 2],
    speed_rpm: f64,
    seen: &mut Seen,
) -> Result<bool, DeviceError> {
    let stopped = devices.servo.set_motor_rpm(0.0).await;
    let ramp_s = 2.0 + profile.servo.decel_ms * 1e-3 * speed_rpm * profile.servo.reduction / 3000.0;
    let end = Instant::now() + Duration::from_secs_f64(ramp_s);
    let mut still = false;
    while !still && Instant::now() < end {
        if watch(profile, devices, counts_per_rev[0], seen).await.is_err() {
            break;
        }
        still = seen.turns_a_second.abs() < STANDSTILL;
    }
    let off = devices.servo.set_enabled(false).await;
    let released = devices.brake.release().await;
    if let Err(error) = devices.counter.stop().await {
        tracing::warn!("{error}");
    }
    stopped.and(off).and(released).map(|()| still)
}

fn judge(report: &mut Report, profile: &Profile, seen: &Seen, counts_per_rev: [u64; 2]) {
    let turned = seen.turned(counts_per_rev);
    let signs = [profile.counter.input_sign, profile.counter.output_sign];
    for (n, (name, key)) in [("input", "counter.input_sign"), ("output", "counter.output_sign")].into_iter().enumerate()
    {
        let ccw = turned[n] * f64::from(signs[n]);
        let subject = format!("{name} encoder");
        if turned[n].abs() < TOLERANCE {
            report.add(
                Grade::Fault,
                subject,
                format!("turned {:.3} turns only", turned[n]),
                "check its coupling, supply and cable",
            );
        } else if ccw < 0.0 {
            report.add(
                Grade::Fault,
                subject,
                format!("counts fall while the pair turns ccw ({:.3} turns)", turned[n]),
                format!("set {key} = {} (or servo.sense the other way, if the pair turned cw)", -signs[n]),
            );
        } else {
            report.good(subject, format!("turned {ccw:.3} turns in its ccw sense"));
        }
        if profile.counter.qsb.is_some() {
            // Said with the counter: its readers have none.
            continue;
        }
        if seen.index[n] {
            report.good(format!("{name} index"), "seen");
        } else {
            report.add(
                Grade::Fault,
                format!("{name} index"),
                format!("not seen in {:.2} turns", turned[n].abs()),
                "check its index line",
            );
        }
    }
    if turned[0].abs() < TURNS * (1.0 - TOLERANCE) {
        report.add(
            Grade::Warning,
            "reduction",
            format!(
                "the driver turned {:.3} turns where the motor's speed and servo.reduction = {} give {TURNS}",
                turned[0].abs(),
                profile.servo.reduction
            ),
            "check servo.reduction and the ramps",
        );
    }
}
