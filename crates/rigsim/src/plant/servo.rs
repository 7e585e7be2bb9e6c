//! The servo drive: ramp generator, speed loop with torque limit, velocity ripple; referred to the driver shaft.

use super::error::{PlantError, in_range};
use super::table::floor;
use std::f64::consts::TAU;

/// rad/s in one revolution a minute.
pub(super) const RAD_PER_S_PER_RPM: f64 = TAU / 60.0;
/// The drive quotes its ramps for this change of speed, rpm.
const RAMP_SPEED_RPM: f64 = 3000.0;
/// Reversal of the motor's dry friction is spread over this speed of the driver shaft, rad/s.
const FRICTION_CREEP_RAD_PER_S: f64 = 1e-3;
/// Points of the ripple's table over one motor turn.
const RIPPLE_POINTS: usize = 256;

/// Motor, reduction and speed loop.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveSpec {
    /// Motor turns per driver turn.
    pub reduction: f64,
    /// Inertia of motor, reduction and input shaft at the driver shaft, kg·m².
    pub inertia_kg_m2: f64,
    /// Rated torque of the motor, N·m.
    pub rated_torque_nm: f64,
    /// Highest speed of the motor, rpm; the drive follows no reference beyond it.
    pub max_speed_rpm: f64,
    /// Torque limit of the drive in parts of the rated torque.
    pub torque_limit_ratio: f64,
    /// Bandwidth of the speed loop, Hz.
    pub bandwidth_hz: f64,
    /// Inertia for which the speed loop is tuned, at the driver shaft, kg·m².
    pub tuned_inertia_kg_m2: f64,
    /// Dry friction of motor and reduction at the driver shaft, N·m.
    pub friction_nm: f64,
    /// Viscous friction at the driver shaft, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// Velocity ripple: order of the motor turn and amplitude in parts of the speed.
    pub ripple: Vec<(u32, f64)>,
}

impl Default for DriveSpec {
    fn default() -> Self {
        Self {
            reduction: 20.0,
            inertia_kg_m2: 0.05,
            rated_torque_nm: 2.39,
            max_speed_rpm: 5000.0,
            torque_limit_ratio: 3.0,
            bandwidth_hz: 40.0,
            tuned_inertia_kg_m2: 0.08,
            friction_nm: 0.8,
            viscous_nm_s_per_rad: 0.05,
            ripple: vec![(1, 2e-3), (2, 1e-3), (6, 5e-4)],
        }
    }
}

impl DriveSpec {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        in_range("drive.reduction", self.reduction, "", (0.1, 1000.0), "motor turns per driver turn")?;
        in_range("drive.inertia_kg_m2", self.inertia_kg_m2, "kg·m²", (1e-4, 100.0), "at the driver shaft")?;
        in_range("drive.rated_torque_nm", self.rated_torque_nm, "N·m", (1e-3, 1e4), "at the motor shaft")?;
        in_range("drive.max_speed_rpm", self.max_speed_rpm, "rpm", (1.0, 20_000.0), "of the motor")?;
        in_range("drive.torque_limit_ratio", self.torque_limit_ratio, "", (0.01, 10.0), "3 means 300 % of rated")?;
        in_range(
            "drive.bandwidth_hz",
            self.bandwidth_hz,
            "Hz",
            (0.1, 400.0),
            "keep the loop well under the step rate",
        )?;
        let tuned = self.tuned_inertia_kg_m2;
        in_range("drive.tuned_inertia_kg_m2", tuned, "kg·m²", (1e-4, 100.0), "near the inertia of the whole rig")?;
        in_range("drive.friction_nm", self.friction_nm, "N·m", (0.0, 1e3), "at the driver shaft")?;
        in_range(
            "drive.viscous_nm_s_per_rad",
            self.viscous_nm_s_per_rad,
            "N·m·s/rad",
            (0.0, 1e3),
            "at the driver shaft",
        )?;
        for &(order, amplitude) in &self.ripple {
            in_range("drive.ripple order", f64::from(order), "", (1.0, 64.0), "orders of the motor turn")?;
            in_range("drive.ripple amplitude", amplitude, "", (0.0, 0.2), "in parts of the speed")?;
        }
        Ok(())
    }
}

/// The running drive.
#[derive(Debug, Clone)]
pub(super) struct Servo {
    max_speed_rpm: f64,
    rated_torque_nm: f64,
    torque_limit_nm: f64,
    proportional_nm_s_per_rad: f64,
    integral_nm_per_rad: f64,
    friction_nm: f64,
    viscous_nm_s_per_rad: f64,
    /// Relative velocity error over the motor turn; the last point repeats the first.
    ripple: Vec<f64>,
    motor_turns_per_rad: f64,
    rad_per_s_per_motor_rpm: f64,
    enabled: bool,
    reference_rpm: f64,
    ramped_rpm: f64,
    accel_ms: f64,
    decel_ms: f64,
    integral_nm: f64,
    torque_nm: f64,
    speed_rad_per_s: f64,
    filtered_speed_rad_per_s: f64,
    filtered_torque_nm: f64,
    step: StepConstants,
}

#[derive(Debug, Clone, Copy, Default)]
struct StepConstants {
    dt_s: f64,
    smoothing: f64,
    accel_rpm: f64,
    decel_rpm: f64,
}

impl Servo {
    pub fn new(spec: &DriveSpec) -> Self {
        let corner = TAU * spec.bandwidth_hz;
        let proportional = spec.tuned_inertia_kg_m2 * corner;
        let ripple = (0..=RIPPLE_POINTS)
            .map(|n| {
                let turn = TAU * (n % RIPPLE_POINTS) as f64 / RIPPLE_POINTS as f64;
                spec.ripple.iter().map(|&(order, size)| size * (f64::from(order) * turn).cos()).sum()
            })
            .collect();
        Self {
            max_speed_rpm: spec.max_speed_rpm,
            rated_torque_nm: spec.rated_torque_nm * spec.reduction,
            torque_limit_nm: spec.rated_torque_nm * spec.reduction * spec.torque_limit_ratio,
            proportional_nm_s_per_rad: proportional,
            // Reset time of four time constants of the loop: stiff against the load, 14 % overshoot.
            integral_nm_per_rad: proportional * corner / 4.0,
            friction_nm: spec.friction_nm,
            viscous_nm_s_per_rad: spec.viscous_nm_s_per_rad,
            ripple,
            motor_turns_per_rad: spec.reduction / TAU,
            rad_per_s_per_motor_rpm: RAD_PER_S_PER_RPM / spec.reduction,
            enabled: false,
            reference_rpm: 0.0,
            ramped_rpm: 0.0,
            accel_ms: 200.0,
            decel_ms: 200.0,
            integral_nm: 0.0,
            torque_nm: 0.0,
            speed_rad_per_s: 0.0,
            filtered_speed_rad_per_s: 0.0,
            filtered_torque_nm: 0.0,
            step: StepConstants::default(),
        }
    }

    pub fn set_step(&mut self, dt_s: f64) {
        /// Time constant of the speed and torque that the drive reports, s.
        const REPORT_S: f64 = 5e-3;
        self.step.dt_s = dt_s;
        self.step.smoothing = 1.0 - (-dt_s / REPORT_S).exp();
        self.set_ramp_ms(self.accel_ms, self.decel_ms);
    }

    pub fn set_enabled(&mut self, enabled: bool) {
        if enabled && !self.enabled {
            // Catch the shaft as it turns.
            self.ramped_rpm = self.speed_rpm();
        }
        if !enabled {
            self.integral_nm = 0.0;
            self.ramped_rpm = 0.0;
        }
        self.enabled = enabled;
    }

    pub fn set_speed_reference_rpm(&mut self, motor_rpm: f64) {
        if motor_rpm.is_finite() {
            self.reference_rpm = motor_rpm.clamp(-self.max_speed_rpm, self.max_speed_rpm);
        }
    }

    pub fn set_ramp_ms(&mut self, accel_ms: f64, decel_ms: f64) {
        // A ramp under 1 ms is a step to any machine; NaN falls back to it too.
        self.accel_ms = accel_ms.max(1.0);
        self.decel_ms = decel_ms.max(1.0);
        let per_step = 1000.0 * self.step.dt_s * RAMP_SPEED_RPM;
        self.step.accel_rpm = per_step / self.accel_ms;
        self.step.decel_rpm = per_step / self.decel_ms;
    }

    pub fn enabled(&self) -> bool {
        self.enabled
    }

    pub fn speed_rpm(&self) -> f64 {
        self.filtered_speed_rad_per_s / self.rad_per_s_per_motor_rpm
    }

    pub fn torque_percent(&self) -> f64 {
        100.0 * self.filtered_torque_nm / self.rated_torque_nm
    }

    pub fn reference_speed_after_ramp_rpm(&self) -> f64 {
        self.ramped_rpm
    }

    /// Torque on the driver shaft for the next step, N·m.
    #[inline]
    pub fn torque_nm(&mut self, angle_rad: f64, speed_rad_per_s: f64) -> f64 {
        self.speed_rad_per_s = speed_rad_per_s;
        if self.enabled {
            self.ramp();
            let reference = self.ramped_rpm * self.rad_per_s_per_motor_rpm;
            // The drive's own encoder reads a speed that is wrong once and twice a motor turn; the loop turns it into
            // ripple.
            let measured = speed_rad_per_s * (1.0 + self.ripple_at(angle_rad));
            let error = reference - measured;
            let wanted = self.proportional_nm_s_per_rad * error + self.integral_nm;
            self.torque_nm = wanted.clamp(-self.torque_limit_nm, self.torque_limit_nm);
            // Integrate unless that would drive a saturated output further.
            if (wanted - self.torque_nm) * error <= 0.0 {
                self.integral_nm += self.integral_nm_per_rad * error * self.step.dt_s;
            }
        } else {
            self.torque_nm = 0.0;
        }
        self.filtered_speed_rad_per_s += self.step.smoothing * (speed_rad_per_s - self.filtered_speed_rad_per_s);
        self.filtered_torque_nm += self.step.smoothing * (self.torque_nm - self.filtered_torque_nm);
        self.torque_nm
    }

    /// Friction of motor and reduction: (explicit torque, N·m; coefficient to be taken implicitly, N·m·s/rad).
    #[inline]
    pub fn friction(&self) -> (f64, f64) {
        if self.speed_rad_per_s.abs() > FRICTION_CREEP_RAD_PER_S {
            (self.friction_nm.copysign(self.speed_rad_per_s), self.viscous_nm_s_per_rad)
        } else {
            (0.0, self.viscous_nm_s_per_rad + self.friction_nm / FRICTION_CREEP_RAD_PER_S)
        }
    }

    fn ramp(&mut self) {
        let gap = self.reference_rpm - self.ramped_rpm;
        if gap == 0.0 {
            return;
        }
        // Moving away from zero accelerates, towards zero decelerates.
        let slowing = self.ramped_rpm != 0.0 && gap.signum() != self.ramped_rpm.signum();
        if slowing {
            let limit = self.step.decel_rpm.min(self.ramped_rpm.abs());
            self.ramped_rpm += gap.clamp(-limit, limit);
        } else {
            self.ramped_rpm += gap.clamp(-self.step.accel_rpm, self.step.accel_rpm);
        }
    }

    #[inline]
    fn ripple_at(&self, angle_rad: f64) -> f64 {
        let turns = angle_rad * self.motor_turns_per_rad;
        let place = (turns - floor(turns)) * RIPPLE_POINTS as f64;
        let index = (place as usize).min(RIPPLE_POINTS - 1);
        let (from, to) = (self.ripple[index], self.ripple[index + 1]);
        from + (place - index as f64) * (to - from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn servo(dt_s: f64) -> Servo {
        let mut servo = Servo::new(&DriveSpec { ripple: Vec::new(), ..DriveSpec::default() });
        servo.set_step(dt_s);
        servo
    }

    /// Runs the drive on a single inertia against a load.
    fn run(servo: &mut Servo, speed: &mut f64, load_nm: f64, seconds: f64) {
        let dt = servo.step.dt_s;
        for _ in 0..(seconds / dt) as usize {
            let torque = servo.torque_nm(0.0, *speed);
            *speed += dt * (torque - load_nm) / 0.08;
        }
    }

    #[test]
    fn the_ramp_takes_its_time_for_3000_rpm() {
        let mut servo = servo(1e-4);
        servo.set_ramp_ms(1000.0, 500.0);
        servo.set_enabled(true);
        servo.set_speed_reference_rpm(3000.0);
        let mut speed = 0.0;
        run(&mut servo, &mut speed, 0.0, 0.5);
        assert!((servo.reference_speed_after_ramp_rpm() - 1500.0).abs() < 1.0);
        run(&mut servo, &mut speed, 0.0, 0.7);
        assert_eq!(servo.reference_speed_after_ramp_rpm(), 3000.0);
        servo.set_speed_reference_rpm(0.0);
        run(&mut servo, &mut speed, 0.0, 0.25);
        assert!((servo.reference_speed_after_ramp_rpm() - 1500.0).abs() < 1.0);
    }

    #[test]
    fn a_reversal_decelerates_to_zero_and_accelerates_from_there() {
        let mut servo = servo(1e-3);
        servo.set_ramp_ms(2000.0, 1000.0);
        servo.set_enabled(true);
        servo.ramped_rpm = 300.0;
        servo.set_speed_reference_rpm(-300.0);
        for _ in 0..100 {
            servo.torque_nm(0.0, 0.0);
        }
        assert!(servo.ramped_rpm.abs() < 1e-9);
        for _ in 0..200 {
            servo.torque_nm(0.0, 0.0);
        }
        assert!((servo.ramped_rpm + 300.0).abs() < 1e-9);
    }

    #[test]
    fn the_loop_holds_its_speed_against_a_load() {
        let mut servo = servo(1e-4);
        servo.set_enabled(true);
        servo.set_speed_reference_rpm(100.0);
        let mut speed = 0.0;
        run(&mut servo, &mut speed, 20.0, 1.0);
        assert!((servo.speed_rpm() - 100.0).abs() < 1e-3);
        assert!((servo.torque_percent() - 100.0 * 20.0 / 47.8).abs() < 0.1);
    }

    #[test]
    fn the_torque_is_limited_and_the_loop_recovers() {
        let mut servo = servo(1e-4);
        servo.set_enabled(true);
        servo.set_speed_reference_rpm(100.0);
        let mut speed = 0.0;
        run(&mut servo, &mut speed, 200.0, 0.2);
        assert!((servo.torque_nm - servo.torque_limit_nm).abs() < 1e-9);
        speed = 0.0;
        run(&mut servo, &mut speed, 20.0, 1.0);
        assert!((servo.speed_rpm() - 100.0).abs() < 0.1);
    }

    #[test]
    fn no_reference_exceeds_the_motor() {
        let mut servo = servo(1e-4);
        servo.set_speed_reference_rpm(1e9);
        assert_eq!(servo.reference_rpm, 5000.0);
        servo.set_speed_reference_rpm(f64::NAN);
        assert_eq!(servo.reference_rpm, 5000.0);
    }

    #[test]
    fn disabled_it_gives_no_torque() {
        let mut servo = servo(1e-4);
        servo.set_speed_reference_rpm(100.0);
        assert_eq!(servo.torque_nm(0.0, 1.0), 0.0);
        assert_eq!(servo.friction().0, 0.8);
    }

    #[test]
    fn the_ripple_repeats_with_the_motor_turn() {
        let servo = Servo::new(&DriveSpec::default());
        let turn = TAU / 20.0;
        assert!((servo.ripple_at(0.0) - 3.5e-3).abs() < 1e-12);
        assert!((servo.ripple_at(0.1) - servo.ripple_at(0.1 - 7.0 * turn)).abs() < 1e-12);
    }
}
