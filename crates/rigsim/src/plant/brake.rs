//! The magnetic powder brake: coil, hysteresis, torque build-up, drag, heat, stick-slip. Friction itself is solved in
//! the chain.

use super::error::{PlantError, in_range};
use super::hysteresis::{Branches, Hysteresis};
use super::servo::RAD_PER_S_PER_RPM;
use super::stick_slip::StickSlip;
use rand_pcg::Pcg64Mcg;

/// Makers recommend at least this slip; below it the torque becomes irregular, rpm.
pub const STICK_SLIP_LIMIT_RPM: f64 = 10.0;
/// Temperatures are advanced at this interval, s.
const THERMAL_STEP_S: f64 = 10e-3;

/// The brake and its coupling to the driven shaft.
#[derive(Debug, Clone, PartialEq)]
pub struct BrakeSpec {
    /// Torque at the rated current on the mean of both branches, without drag, at the brake's shaft, N·m.
    pub rated_torque_nm: f64,
    /// Rated current, A.
    pub rated_current_a: f64,
    /// c of the mean curve g(x) = (1 + c) x²/(x² + c), x = I/I_rated.
    pub saturation: f64,
    /// Half distance of the two branches in parts of their mean, at small current.
    pub hysteresis: f64,
    /// Drag without current, at the brake's shaft, N·m.
    pub drag_nm: f64,
    /// Resistance of the coil, Ω.
    pub coil_resistance_ohm: f64,
    /// Time constant of the current, s.
    pub current_time_constant_s: f64,
    /// Time constant of the torque, s.
    pub torque_time_constant_s: f64,
    /// Turns of the brake per turn of the driven shaft.
    pub step_up: f64,
    /// Inertia of the rotor at its own shaft, kg·m².
    pub rotor_inertia_kg_m2: f64,
    /// Size of stick-slip as the slip approaches zero, in parts of the torque; it falls linearly to nothing at 10 rpm.
    pub stick_slip_ratio: f64,
    /// Slip angle over which stick-slip builds up one unit of its level, rad.
    pub stick_slip_angle_rad: f64,
    /// Ambient temperature, °C.
    pub ambient_c: f64,
    /// Heat capacity of powder and rotor, J/K.
    pub powder_capacity_j_per_k: f64,
    /// Heat capacity of the housing, J/K.
    pub housing_capacity_j_per_k: f64,
    /// Thermal resistance from powder to housing, K/W.
    pub inner_resistance_k_per_w: f64,
    /// Thermal resistance from housing to ambient, K/W.
    pub outer_resistance_k_per_w: f64,
    /// Loss of torque per kelvin of powder temperature above ambient; 0 switches fading off.
    pub fading_per_k: f64,
    /// Ripple of the torque over the driven shaft's turn, in parts of the torque.
    pub ripple_ratio: f64,
    /// Its order.
    pub ripple_order: u32,
    /// Its phase, rad: the torque is T (1 + ratio · sin(order · θ2 − phase)).
    pub ripple_phase_rad: f64,
}

impl Default for BrakeSpec {
    fn default() -> Self {
        Self {
            rated_torque_nm: 25.0,
            rated_current_a: 1.0,
            saturation: 0.8,
            hysteresis: 0.06,
            drag_nm: 0.3,
            coil_resistance_ohm: 20.0,
            current_time_constant_s: 0.1,
            torque_time_constant_s: 0.25,
            step_up: 1.0,
            rotor_inertia_kg_m2: 0.004,
            stick_slip_ratio: 0.0175,
            stick_slip_angle_rad: 0.01,
            ambient_c: 22.0,
            powder_capacity_j_per_k: 400.0,
            housing_capacity_j_per_k: 3000.0,
            inner_resistance_k_per_w: 0.1,
            outer_resistance_k_per_w: 0.25,
            fading_per_k: 0.0,
            ripple_ratio: 0.0,
            ripple_order: 1,
            ripple_phase_rad: 0.0,
        }
    }
}

/// One point of a brake's static curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrakeCurvePoint {
    /// Coil current, A.
    pub current_a: f64,
    /// Torque on the driven shaft while the current rises from zero, drag included, N·m.
    pub rising_nm: f64,
    /// Torque on the driven shaft while the current falls from saturation, drag included, N·m.
    pub falling_nm: f64,
}

impl BrakeSpec {
    fn branches(&self) -> Branches {
        Branches {
            rated_torque_nm: self.rated_torque_nm,
            per_rated_current: 1.0 / self.rated_current_a,
            saturation: self.saturation,
            hysteresis: self.hysteresis,
        }
    }

    /// The static curve that a calibration of this brake would give: both branches over the current, drag included, as
    /// torque on the driven shaft.
    #[must_use]
    pub fn nominal_curve(&self) -> Vec<BrakeCurvePoint> {
        /// Points from zero to one and a half times the rated current.
        const POINTS: u32 = 61;
        let branches = self.branches();
        (0..POINTS)
            .map(|n| {
                let current_a = 1.5 * self.rated_current_a * f64::from(n) / f64::from(POINTS - 1);
                let (rising, falling) = branches.at(current_a);
                let on_shaft = |torque: f64| (torque + self.drag_nm) * self.step_up;
                BrakeCurvePoint { current_a, rising_nm: on_shaft(rising), falling_nm: on_shaft(falling) }
            })
            .collect()
    }

    pub(super) fn validate(&self) -> Result<(), PlantError> {
        in_range("brake.rated_torque_nm", self.rated_torque_nm, "N·m", (0.0, 1e4), "at the brake's shaft")?;
        in_range("brake.rated_current_a", self.rated_current_a, "A", (1e-3, 100.0), "of the coil")?;
        in_range("brake.saturation", self.saturation, "", (0.05, 100.0), "0.8 is a usual shape")?;
        in_range(
            "brake.hysteresis",
            self.hysteresis,
            "",
            (0.0, 0.3),
            "half distance of the branches in parts of their mean",
        )?;
        in_range("brake.drag_nm", self.drag_nm, "N·m", (0.0, 100.0), "at the brake's shaft")?;
        in_range("brake.coil_resistance_ohm", self.coil_resistance_ohm, "Ω", (0.01, 1e4), "of the coil")?;
        let usual = (1e-4, 60.0);
        in_range("brake.current_time_constant_s", self.current_time_constant_s, "s", usual, "0.06 to 0.56 s is usual")?;
        in_range("brake.torque_time_constant_s", self.torque_time_constant_s, "s", usual, "0.2 to 1.4 s is usual")?;
        in_range("brake.step_up", self.step_up, "", (0.1, 100.0), "brake turns per driven turn")?;
        in_range("brake.rotor_inertia_kg_m2", self.rotor_inertia_kg_m2, "kg·m²", (1e-5, 10.0), "at its own shaft")?;
        in_range("brake.stick_slip_ratio", self.stick_slip_ratio, "", (0.0, 0.5), "0 switches stick-slip off")?;
        in_range(
            "brake.stick_slip_angle_rad",
            self.stick_slip_angle_rad,
            "rad",
            (1e-4, 10.0),
            "slip angle of a build-up",
        )?;
        in_range("brake.ambient_c", self.ambient_c, "°C", (-50.0, 100.0), "give degrees Celsius")?;
        let capacity = (10.0, 1e7);
        in_range("brake.powder_capacity_j_per_k", self.powder_capacity_j_per_k, "J/K", capacity, "powder and rotor")?;
        in_range("brake.housing_capacity_j_per_k", self.housing_capacity_j_per_k, "J/K", capacity, "housing")?;
        let resistance = (1e-2, 1e3);
        in_range(
            "brake.inner_resistance_k_per_w",
            self.inner_resistance_k_per_w,
            "K/W",
            resistance,
            "powder to housing",
        )?;
        in_range(
            "brake.outer_resistance_k_per_w",
            self.outer_resistance_k_per_w,
            "K/W",
            resistance,
            "housing to ambient",
        )?;
        in_range("brake.fading_per_k", self.fading_per_k, "1/K", (0.0, 0.01), "0 switches fading off")?;
        in_range("brake.ripple_ratio", self.ripple_ratio, "", (0.0, 0.95), "in parts of the torque")?;
        in_range("brake.ripple_order", f64::from(self.ripple_order), "", (1.0, 64.0), "of the driven shaft")?;
        in_range("brake.ripple_phase_rad", self.ripple_phase_rad, "rad", (-1e6, 1e6), "give a finite angle")
    }
}

/// The running brake.
#[derive(Debug, Clone)]
pub(super) struct Brake {
    spec: BrakeSpec,
    /// Current that the source's limits allow in the long run, A.
    target_a: f64,
    current_a: f64,
    torque_nm: f64,
    hysteresis: Hysteresis,
    stick_slip: StickSlip,
    fading: f64,
    powder_k: f64,
    housing_k: f64,
    heat_j: f64,
    heat_time_s: f64,
    dt_s: f64,
    current_step: f64,
    torque_step: f64,
}

impl Brake {
    pub fn new(spec: &BrakeSpec, rng: Pcg64Mcg) -> Self {
        Self {
            target_a: 0.0,
            current_a: 0.0,
            torque_nm: 0.0,
            hysteresis: Hysteresis::new(spec.branches()),
            stick_slip: StickSlip::new(
                spec.stick_slip_ratio,
                STICK_SLIP_LIMIT_RPM * RAD_PER_S_PER_RPM,
                spec.stick_slip_angle_rad,
                rng,
            ),
            fading: 1.0,
            powder_k: 0.0,
            housing_k: 0.0,
            heat_j: 0.0,
            heat_time_s: 0.0,
            dt_s: 0.0,
            current_step: 0.0,
            torque_step: 0.0,
            spec: spec.clone(),
        }
    }

    pub fn set_step(&mut self, dt_s: f64) {
        self.dt_s = dt_s;
        self.current_step = 1.0 - (-dt_s / self.spec.current_time_constant_s).exp();
        self.torque_step = 1.0 - (-dt_s / self.spec.torque_time_constant_s).exp();
        self.stick_slip.set_step(dt_s);
    }

    pub fn set_drive(&mut self, enabled: bool, current_limit_a: f64, voltage_limit_v: f64) {
        // A limit that is no number, or negative, gives no current.
        let valid = |limit: f64| if limit.is_finite() { limit.max(0.0) } else { 0.0 };
        self.target_a = if enabled {
            valid(current_limit_a).min(valid(voltage_limit_v) / self.spec.coil_resistance_ohm)
        } else {
            0.0
        };
    }

    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Voltage across the coil: the steady drop of the current that the limits allow (the coil lags behind it).
    pub fn voltage_v(&self) -> f64 {
        self.target_a * self.spec.coil_resistance_ohm
    }

    /// Temperature of the housing, °C.
    pub fn temperature_c(&self) -> f64 {
        self.spec.ambient_c + self.housing_k
    }

    /// Temperature of the powder, °C.
    pub fn powder_temperature_c(&self) -> f64 {
        self.spec.ambient_c + self.powder_k
    }

    /// Friction torque available on the driven shaft in the next step, N·m, at the speed and angle of the driven shaft.
    #[inline]
    pub fn capacity_nm(&mut self, shaft_rad_per_s: f64, shaft_rad: f64) -> f64 {
        // di/dt = (V/R − i)/τ_i and dT/dt = (T_static(i) − T)/τ_T, exact over the step for a steady right-hand side.
        self.current_a += self.current_step * (self.target_a - self.current_a);
        let fixed_nm = self.hysteresis.torque_nm(self.current_a);
        self.torque_nm += self.torque_step * (fixed_nm - self.torque_nm);
        let slip_rad_per_s = shaft_rad_per_s.abs() * self.spec.step_up;
        let deviation = self.stick_slip.deviation(slip_rad_per_s * self.dt_s, slip_rad_per_s);
        let mut torque_nm = (self.torque_nm * self.fading * (1.0 + deviation) + self.spec.drag_nm) * self.spec.step_up;
        if self.spec.ripple_ratio != 0.0 {
            let turn = f64::from(self.spec.ripple_order) * shaft_rad - self.spec.ripple_phase_rad;
            torque_nm *= 1.0 + self.spec.ripple_ratio * turn.sin();
        }
        torque_nm
    }

    /// Takes up the heat of one step of friction `torque_nm` at the driven shaft.
    #[inline]
    pub fn heat(&mut self, torque_nm: f64, shaft_rad_per_s: f64) {
        self.heat_j += (torque_nm * shaft_rad_per_s).abs() * self.dt_s;
        self.heat_time_s += self.dt_s;
        if self.heat_time_s >= THERMAL_STEP_S {
            self.conduct();
        }
    }

    /// Two bodies: powder and rotor, warmed by slip; housing, cooled by the air.
    fn conduct(&mut self) {
        let spec = &self.spec;
        let inward_w = (self.powder_k - self.housing_k) / spec.inner_resistance_k_per_w;
        let outward_w = self.housing_k / spec.outer_resistance_k_per_w;
        self.powder_k += (self.heat_j - inward_w * self.heat_time_s) / spec.powder_capacity_j_per_k;
        self.housing_k += (inward_w - outward_w) * self.heat_time_s / spec.housing_capacity_j_per_k;
        self.fading = (1.0 - spec.fading_per_k * self.powder_k).max(0.0);
        self.heat_j = 0.0;
        self.heat_time_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn brake(spec: &BrakeSpec) -> Brake {
        let mut brake = Brake::new(spec, Pcg64Mcg::seed_from_u64(1));
        brake.set_step(1e-3);
        brake
    }

    fn settle(brake: &mut Brake, speed: f64, seconds: f64) -> f64 {
        let mut torque = 0.0;
        for _ in 0..(seconds * 1e3) as usize {
            torque = brake.capacity_nm(speed, 0.0);
            brake.heat(torque, speed);
        }
        torque
    }

    #[test]
    fn the_torque_settles_on_the_rising_branch_then_on_the_falling_one() {
        let spec = BrakeSpec::default();
        let mut brake = brake(&spec);
        let point = spec.nominal_curve()[20];
        assert!((point.current_a - 0.5).abs() < 1e-12);
        brake.set_drive(true, point.current_a, 60.0);
        assert!((settle(&mut brake, 2.0, 10.0) - point.rising_nm).abs() < 1e-6);
        brake.set_drive(true, 1.5, 60.0);
        settle(&mut brake, 2.0, 10.0);
        brake.set_drive(true, point.current_a, 60.0);
        assert!((settle(&mut brake, 2.0, 10.0) - point.falling_nm).abs() < 1e-6);
    }

    #[test]
    fn either_limit_bounds_the_current() {
        let mut brake = brake(&BrakeSpec::default());
        brake.set_drive(true, 0.8, 10.0);
        settle(&mut brake, 2.0, 3.0);
        assert!((brake.current_a() - 0.5).abs() < 1e-9);
        assert!((brake.voltage_v() - 10.0).abs() < 1e-9);
        brake.set_drive(true, 0.2, 10.0);
        settle(&mut brake, 2.0, 3.0);
        assert!((brake.current_a() - 0.2).abs() < 1e-9);
        brake.set_drive(false, 0.2, 10.0);
        settle(&mut brake, 2.0, 5.0);
        assert!(brake.current_a() < 1e-9);
        assert!((brake.capacity_nm(2.0, 0.0) - 0.3).abs() < 1e-3);
    }

    #[test]
    fn current_and_torque_have_their_time_constants() {
        let mut brake = brake(&BrakeSpec { stick_slip_ratio: 0.0, ..BrakeSpec::default() });
        brake.set_drive(true, 1.0, 60.0);
        settle(&mut brake, 2.0, 0.1);
        assert!((brake.current_a() - (1.0 - (-1.0f64).exp())).abs() < 1e-6);
    }

    #[test]
    fn slip_power_warms_the_housing_to_its_steady_temperature() {
        let mut brake = brake(&BrakeSpec { rated_torque_nm: 0.0, drag_nm: 10.0, ..BrakeSpec::default() });
        // 10 N·m at 10 rad/s are 100 W over 0.25 K/W, and 0.1 K/W more to the powder.
        settle(&mut brake, 10.0, 8000.0);
        assert!((brake.temperature_c() - 47.0).abs() < 0.1, "{}", brake.temperature_c());
        assert!((brake.powder_temperature_c() - 57.0).abs() < 0.1);
    }

    #[test]
    fn a_step_up_multiplies_slip_and_torque_on_the_shaft() {
        let geared = BrakeSpec { step_up: 4.0, ..BrakeSpec::default() };
        assert!((geared.nominal_curve()[0].rising_nm - 1.2).abs() < 1e-12);
        let mut brake = brake(&geared);
        brake.set_drive(true, 0.5, 60.0);
        settle(&mut brake, 0.5, 10.0);
        // 5 rpm on the driven shaft are 20 rpm of slip: no stick-slip.
        let torques: Vec<f64> = (0..1000).map(|_| brake.capacity_nm(0.53, 0.0)).collect();
        assert!(torques.iter().all(|t| (t - torques[0]).abs() < 1e-9));
    }

    #[test]
    fn fading_lowers_the_torque_when_asked_for() {
        let spec = BrakeSpec { fading_per_k: 0.002, stick_slip_ratio: 0.0, ..BrakeSpec::default() };
        let mut brake = brake(&spec);
        brake.set_drive(true, 1.0, 60.0);
        let cold = settle(&mut brake, 10.0, 3.0);
        let warm = settle(&mut brake, 10.0, 3000.0);
        assert!(warm < 0.97 * cold);
    }
}
