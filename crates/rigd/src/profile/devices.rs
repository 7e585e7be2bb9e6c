//! What a profile says of each device: its driver, its line, and what the driver has to know of it.

use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::device::bus::LateReplyWindow;

/// The servo drive and its line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoProfile {
    /// Driver's name, see `device::drivers::SERVOS`.
    pub driver: String,
    /// Register map, with driver `map`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<PathBuf>,
    /// Path, `tcp://host:port`, or `sim`.
    pub port: String,
    /// Line speed, bit/s.
    pub baud: u32,
    /// Character format, for instance `8N2`.
    pub format: String,
    /// Modbus unit.
    pub unit: u8,
    /// Motor turns a turn of the driver gear.
    pub reduction: f64,
    /// +1, or −1 when a positive motor speed turns the driver clockwise.
    pub sense: i8,
    /// Ramp from 0 to 3000 rpm of the motor, ms.
    pub accel_ms: f64,
    /// Ramp from 3000 rpm of the motor to 0, ms.
    pub decel_ms: f64,
    /// A late answer of its line may come until so long after its request, ms; more where a gateway holds answers back.
    #[serde(default = "late_ms")]
    pub late_ms: f64,
    /// An answer may come once more until so long after it was taken, ms.
    #[serde(default = "repeated_ms")]
    pub repeated_ms: f64,
}

impl ServoProfile {
    /// How long answers may come after they were due.
    #[must_use]
    pub fn late_replies(&self) -> LateReplyWindow {
        late_replies(self.late_ms, self.repeated_ms)
    }
}

/// The brake, its driver and its calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrakeProfile {
    /// Driver's name, see `device::drivers::BRAKES`.
    pub driver: String,
    /// Register map, with driver `map`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<PathBuf>,
    /// Path, `tcp://host:port`, or `sim`.
    pub port: String,
    /// Line speed, bit/s.
    pub baud: u32,
    /// Character format.
    pub format: String,
    /// Modbus unit.
    pub unit: u8,
    /// Voltage limit of the coil's source, V.
    pub voltage_v: f64,
    /// Largest coil current, A.
    pub current_limit_a: f64,
    /// Brake turns a turn of the driven gear.
    pub step_up: f64,
    /// Rising branch: [coil current A, brake torque N·m], both increasing.
    pub rising: Vec<[f64; 2]>,
    /// Falling branch, likewise.
    pub falling: Vec<[f64; 2]>,
    /// A late answer of its line may come until so long after its request, ms; more where a gateway holds answers back.
    #[serde(default = "late_ms")]
    pub late_ms: f64,
    /// An answer may come once more until so long after it was taken, ms.
    #[serde(default = "repeated_ms")]
    pub repeated_ms: f64,
}

impl BrakeProfile {
    /// How long answers may come after they were due.
    #[must_use]
    pub fn late_replies(&self) -> LateReplyWindow {
        late_replies(self.late_ms, self.repeated_ms)
    }

    /// Coil current that loads the driven gear with `load_nm`, by the rising branch; `None` beyond its end.
    ///
    /// The brake turns `step_up` times as fast as the driven gear, so its torque is the load divided by it.
    #[must_use]
    pub fn current_a(&self, load_nm: f64) -> Option<f64> {
        let torque = load_nm / self.step_up;
        let (first, last) = (self.rising.first()?, self.rising.last()?);
        if torque <= first[1] {
            // Less than the drag cannot be had; no current is the closest.
            return Some(first[0]);
        }
        if torque > last[1] {
            return None;
        }
        let above = self.rising.iter().position(|point| point[1] >= torque)?;
        let (low, high) = (self.rising[above - 1], self.rising[above]);
        let current = low[0] + (torque - low[1]) / (high[1] - low[1]) * (high[0] - low[0]);
        (current <= self.current_limit_a).then_some(current)
    }

    /// As [`BrakeProfile::current_a`], where the coil has `from_a` now: down from a larger current, the torque lies on the falling branch.
    #[must_use]
    pub fn current_from_a(&self, load_nm: f64, from_a: f64) -> Option<f64> {
        let up = self.current_a(load_nm)?;
        let falling = Self { rising: self.falling.clone(), ..self.clone() };
        let down = falling.current_a(load_nm).filter(|down| *down < from_a && up < from_a);
        Some(down.unwrap_or(up))
    }

    /// Load at the driven gear for a coil current on the rising branch.
    #[must_use]
    pub fn load_nm(&self, current_a: f64) -> f64 {
        let above = self.rising.iter().position(|point| point[0] >= current_a).unwrap_or(self.rising.len() - 1).max(1);
        let (low, high) = (self.rising[above - 1], self.rising[above]);
        let torque = low[1] + (current_a - low[0]) / (high[0] - low[0]) * (high[1] - low[1]);
        torque.max(self.rising[0][1]) * self.step_up
    }

    /// The least load that the brake can set: its drag.
    #[must_use]
    pub fn drag_nm(&self) -> f64 {
        self.rising[0][1] * self.step_up
    }
}

fn late_ms() -> f64 {
    LateReplyWindow::default().late.as_secs_f64() * 1e3
}

fn repeated_ms() -> f64 {
    LateReplyWindow::default().repeated.as_secs_f64() * 1e3
}

fn late_replies(late_ms: f64, repeated_ms: f64) -> LateReplyWindow {
    let time = |ms: f64| Duration::try_from_secs_f64(ms * 1e-3).unwrap_or_default();
    LateReplyWindow { late: time(late_ms), repeated: time(repeated_ms) }
}

/// The counter box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CounterProfile {
    /// Driver's name, see `device::drivers::COUNTERS`.
    pub driver: String,
    /// Path, `tcp://host:port`, or `sim`.
    pub port: String,
    /// Line speed, bit/s.
    pub baud: u32,
    /// Character format.
    pub format: String,
    /// Unused by the counter box, which is alone on its line.
    #[serde(default)]
    pub unit: u8,
    /// +1, or −1 when the input counts fall while the pair turns in its ccw sense.
    pub input_sign: i8,
    /// +1 or −1, likewise for the driven gear.
    pub output_sign: i8,
    /// How far the input encoder's disc is turned on its shaft against its usual place, in the angle's positive sense, deg: for its
    /// calibration, where it is re-mounted. The angles stay those of the gears.
    #[serde(default)]
    pub input_mounted_deg: f64,
    /// Likewise the output encoder's.
    #[serde(default)]
    pub output_mounted_deg: f64,
    /// Two readers, with driver `qsb`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub qsb: Option<QsbProfile>,
}

/// Two readers, one a serial line; `counter.port` is the input's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QsbProfile {
    /// Port of the output's reader.
    pub output_port: String,
    /// Cycles a revolution of input and output encoder.
    pub lines: [u32; 2],
    /// Counts a cycle: 1, 2 or 4.
    pub quadrature: u8,
    /// A line every so many 1/512 s.
    #[serde(default = "interval_ticks")]
    pub interval_ticks: u16,
    /// By how much the shortest ways of the two readers' lines to the host may differ, ms: a USB frame.
    #[serde(default = "transit_difference_ms")]
    pub transit_difference_ms: f64,
    /// Counts of both readers where both angles are zero, since the readers were switched on. Left out, a run's zero is where it begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero_counts: Option<[i64; 2]>,
}

fn interval_ticks() -> u16 {
    1
}

fn transit_difference_ms() -> f64 {
    1.0
}

impl QsbProfile {
    /// Counts a revolution of both encoders.
    #[must_use]
    pub fn counts_per_rev(&self) -> [u64; 2] {
        self.lines.map(|lines| u64::from(lines) * u64::from(self.quadrature))
    }

    /// Lines a second.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        512.0 / f64::from(self.interval_ticks.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Profile;

    #[test]
    fn brake_curve_inverts() {
        let brake = Profile::simulated().brake;
        for load in [0.5, 5.0, 10.0, 20.0] {
            let current = brake.current_a(load).expect("within the curve");
            assert!((brake.load_nm(current) - load).abs() < 1e-12);
        }
        assert_eq!(brake.current_a(0.0), Some(0.0));
        assert_eq!(brake.current_a(1e3), None);
    }
}
