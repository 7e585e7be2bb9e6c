//! The simulated rig: everything put together and advanced sample by sample.

use super::brake::Brake;
use super::chain::{Chain, ChainSpec, DISC, Drive, GEAR1, GEAR2, INPUT, ROTOR, Spring};
use super::encoder::Encoder;
use super::error::{PlantError, in_range};
use super::flank::Flank;
use super::geometry::PitchCurves;
use super::mesh::Mesh;
use super::reading_error::{ActiveReadingError, RigState};
use super::resonance::SoftCoupling;
use super::run_out::RunOut;
use super::servo::Servo;
use super::skew::Delay;
use super::slippage::{CountLoss, Creep};
use super::spec::PlantSpec;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// The integrator's steps are not longer than this, s.
const LONGEST_STEP_S: f64 = 100e-6;
/// A shaft without compliance is taken as stiff as this, rad/(N·m): 0.1 µrad at 10 N·m.
const RIGID_SHAFT_RAD_PER_NM: f64 = 1e-8;

/// Both counters, latched together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// Counter of the input encoder.
    pub input_counts: i64,
    /// Counter of the output encoder.
    pub output_counts: i64,
}

/// What a real rig would not tell: the true state, for tests and studies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Simulated time, s.
    pub time_s: f64,
    /// True angles of input shaft, gear 1, gear 2, output disc and brake rotor, rad.
    pub angles_rad: [f64; 5],
    /// Their speeds, rad/s.
    pub speeds_rad_per_s: [f64; 5],
    /// Torque of the input shaft on gear 1, N·m.
    pub input_torque_nm: f64,
    /// Torque of the teeth on gear 2, N·m.
    pub mesh_torque_nm: f64,
    /// Torque that gear 2 hands on to its shaft, N·m: the load at the gears.
    pub load_torque_nm: f64,
    /// Friction torque of the brake at the driven shaft, N·m.
    pub brake_torque_nm: f64,
    /// Twist of the input shaft, rad: input encoder ahead of gear 1.
    pub input_windup_rad: f64,
    /// Twist of the output shaft, rad: gear 2 ahead of the output encoder, without what the clamp has slipped.
    pub output_windup_rad: f64,
    /// Slip of the clamp so far, rad.
    pub clamp_slip_rad: f64,
    /// Times that the output's counter has lost counts.
    pub count_losses: u64,
    /// Driven angle less f(driver angle) at the encoders, rad, without any reading error.
    pub transmission_error_rad: f64,
    /// The flank in contact; none while the teeth are apart.
    pub contact: Option<Flank>,
}

/// The rig in the time domain.
#[derive(Debug, Clone)]
pub struct Plant {
    spec: PlantSpec,
    curves: PitchCurves,
    mesh: Mesh,
    chain: Chain,
    servo: Servo,
    brake: Brake,
    input: Encoder,
    output: Encoder,
    run_out: RunOut,
    slow_run_out: Option<RunOut>,
    creep: Option<Creep>,
    count_loss: Option<CountLoss>,
    count_losses: u64,
    skew: Option<Delay>,
    coupling: Option<SoftCoupling>,
    /// Lead of the output encoder's disc over its shaft, rad.
    coupling_twist_rad: f64,
    reading_errors: Vec<ActiveReadingError>,
    /// When the housing began to warm up, s.
    warming_since_s: f64,
    wear_mm: f64,
    clamp_slip_rad: f64,
    start_s: f64,
    samples: u64,
    sample_rate_hz: f64,
    steps_per_sample: u32,
    step_s: f64,
}

/// Independent streams of random numbers, so that switching one disturbance leaves the others as they were.
fn stream(seed: u64, number: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

impl Plant {
    /// Builds the rig, at rest at a random angle, counters at 0, indices unknown, servo and brake off.
    ///
    /// # Errors
    /// [`PlantError`] for a value out of range, for teeth that jam, and for flanks that find no contact.
    pub fn new(spec: &PlantSpec, sample_rate_hz: f64, seed: u64) -> Result<Self, PlantError> {
        spec.validate()?;
        let curves = PitchCurves::new(&spec.gears);
        let mesh = Mesh::new(&spec.gears, &spec.mesh, &spec.teeth, &spec.bearings, &spec.housing)?;
        let draw: f64 = StandardUniform.sample(&mut stream(seed, 1));
        // Not within a thousandth of a turn of the index, where noise might or might not pass it.
        let input_rad = TAU * (0.001 + 0.998 * draw);
        let place = mesh.locate(input_rad);
        // Teeth apart, in the middle of the gap.
        let driven_rad = 0.5 * (mesh.flank(place, Flank::Ccw).psi_rad + mesh.flank(place, Flank::Cw).psi_rad);
        let chain = Chain::new(chain_spec(spec), input_rad, driven_rad);
        let loss = &spec.encoders.output_count_loss;
        let mut plant = Self {
            servo: Servo::new(&spec.drive),
            brake: Brake::new(&spec.brake, stream(seed, 2)),
            input: Encoder::new(&spec.encoders.input, chain.q[INPUT], stream(seed, 3)),
            output: Encoder::new(&spec.encoders.output, chain.q[DISC], stream(seed, 4)),
            run_out: RunOut::new(spec.noise.run_out_rms_mm, spec.noise.run_out_correlation_rev, stream(seed, 5)),
            slow_run_out: (spec.noise.slow_run_out_rms_mm != 0.0).then(|| {
                let noise = &spec.noise;
                RunOut::new(noise.slow_run_out_rms_mm, noise.slow_run_out_correlation_rev, stream(seed, 8))
            }),
            creep: Creep::new(&spec.clamp, stream(seed, 6)),
            count_loss: CountLoss::new(loss.counts, loss.losses_per_rev, stream(seed, 7)),
            count_losses: 0,
            skew: None,
            coupling: spec.encoders.output_coupling.map(|coupling| SoftCoupling::new(coupling, 0.0)),
            coupling_twist_rad: 0.0,
            reading_errors: (10..)
                .zip(&spec.reading_errors)
                .map(|(n, error)| ActiveReadingError::new(error, stream(seed, n)))
                .collect(),
            warming_since_s: 0.0,
            wear_mm: 0.0,
            clamp_slip_rad: 0.0,
            start_s: 0.0,
            samples: 0,
            // Set by set_sample_rate_hz below; at zero samples any rate gives time zero.
            sample_rate_hz: 1.0,
            steps_per_sample: 1,
            step_s: 0.0,
            curves,
            mesh,
            chain,
            spec: spec.clone(),
        };
        plant.set_sample_rate_hz(sample_rate_hz)?;
        Ok(plant)
    }

    /// Changes the rate at which [`Plant::step`] latches the counters.
    ///
    /// # Errors
    /// [`PlantError::OutOfRange`] outside 1 Hz to 1 MHz; the plant then keeps its rate.
    pub fn set_sample_rate_hz(&mut self, sample_rate_hz: f64) -> Result<(), PlantError> {
        in_range("sample_rate_hz", sample_rate_hz, "Hz", (1.0, 1e6), "10 kHz is usual")?;
        self.start_s = self.time_s();
        self.samples = 0;
        self.sample_rate_hz = sample_rate_hz;
        let period_s = 1.0 / sample_rate_hz;
        // The margin keeps rounding from adding a step at 10 kHz.
        self.steps_per_sample = (period_s / LONGEST_STEP_S - 1e-9).ceil().max(1.0) as u32;
        self.step_s = period_s / f64::from(self.steps_per_sample);
        self.servo.set_step(self.step_s);
        self.brake.set_step(self.step_s);
        let skew_s = self.spec.encoders.time_skew_s;
        let early = self.early_shaft();
        self.skew =
            (skew_s != 0.0).then(|| Delay::new(skew_s.abs(), self.step_s, self.chain.q[early], self.chain.v[early]));
        Ok(())
    }

    /// The shaft that is latched early: the input for a positive skew.
    fn early_shaft(&self) -> usize {
        if self.spec.encoders.time_skew_s > 0.0 { INPUT } else { DISC }
    }

    /// Advances the rig by exactly one sample period and latches both counters.
    #[inline]
    pub fn step(&mut self) -> Sample {
        for _ in 0..self.steps_per_sample {
            self.advance();
        }
        self.samples += 1;
        if self.spec.housing.growth_mm != 0.0 {
            // Δa(t) = Δa (1 − exp(−t/τ))
            let warm_s = self.time_s() - self.warming_since_s;
            self.mesh.set_warmth(-(-warm_s / self.spec.housing.time_constant_s).exp_m1());
        }
        if self.spec.teeth.wear_mm_per_rev_nm != 0.0 {
            self.mesh.set_wear(self.wear_mm);
        }
        let (mut input_rad, mut output_rad) = (self.chain.q[INPUT], self.chain.q[DISC]);
        if let Some(skew) = &self.skew {
            if self.spec.encoders.time_skew_s > 0.0 {
                input_rad = skew.angle_rad();
            } else {
                output_rad = skew.angle_rad();
            }
        }
        output_rad += self.coupling_twist_rad;
        if !self.reading_errors.is_empty() {
            let rig = RigState {
                time_s: self.time_s(),
                dt_s: 1.0 / self.sample_rate_hz,
                theta1_rad: self.chain.q[INPUT],
                theta2_rad: self.chain.q[DISC],
                speed_rad_per_s: self.chain.v[INPUT],
                load_nm: self.chain.load_torque_nm,
            };
            output_rad += self.reading_errors.iter_mut().map(|error| error.advance(&rig)).sum::<f64>();
        }
        Sample { input_counts: self.input.read(input_rad), output_counts: self.output.read(output_rad) }
    }

    #[inline]
    fn advance(&mut self) {
        let h = self.step_s;
        let torque_nm = self.servo.torque_nm(self.chain.q[INPUT], self.chain.v[INPUT]);
        let (friction_nm, viscous_nm_s_per_rad) = self.servo.friction();
        let travel_rad = (h * self.chain.v[GEAR1]).abs();
        let (seal_nm, seal_nm_s_per_rad) = self.seal();
        let drive = Drive {
            torque_nm: torque_nm - friction_nm,
            viscous_nm_s_per_rad,
            seal_nm,
            seal_nm_s_per_rad,
            brake_capacity_nm: self.brake.capacity_nm(self.chain.v[ROTOR], self.chain.q[ROTOR]),
            clamp_slip_rad: self.clamp_slip_rad,
            run_out_mm: self.run_out.advance(travel_rad)
                + self.slow_run_out.as_mut().map_or(0.0, |slow| slow.advance(travel_rad)),
        };
        self.chain.step(h, &drive, &self.mesh);
        self.brake.heat(self.chain.brake_torque_nm, self.chain.v[ROTOR]);
        if let Some(creep) = &mut self.creep {
            self.clamp_slip_rad = creep.advance(travel_rad, self.chain.load_torque_nm);
        }
        if let Some(loss) = &mut self.count_loss {
            let lost = loss.advance(travel_rad);
            if lost != 0 {
                self.output.lose(lost);
                self.count_losses += (lost / self.spec.encoders.output_count_loss.counts).unsigned_abs();
            }
        }
        // j grows with ∫ |T| dθ1/2π.
        self.wear_mm += self.spec.teeth.wear_mm_per_rev_nm * self.chain.load_torque_nm.abs() * travel_rad / TAU;
        if let Some(coupling) = &mut self.coupling {
            self.coupling_twist_rad = coupling.advance(h, self.chain.v[DISC]);
        }
        let early = self.early_shaft();
        if let Some(skew) = &mut self.skew {
            skew.push(self.chain.q[early]);
        }
    }

    /// Dry drag of the output seal: (explicit torque, N·m; coefficient to be taken implicitly, N·m·s/rad).
    #[inline]
    fn seal(&self) -> (f64, f64) {
        /// Its reversal is spread over this speed, rad/s.
        const CREEP_RAD_PER_S: f64 = 1e-3;
        let (drag_nm, speed) = (self.spec.shafts.seal_drag_nm, self.chain.v[DISC]);
        if speed.abs() > CREEP_RAD_PER_S { (drag_nm.copysign(speed), 0.0) } else { (0.0, drag_nm / CREEP_RAD_PER_S) }
    }

    /// The rig is new again from now on: the housing cold, the teeth unworn.
    pub fn renew(&mut self) {
        self.warming_since_s = self.time_s();
        self.wear_mm = 0.0;
    }

    /// Simulated time since the start, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.start_s + self.samples as f64 / self.sample_rate_hz
    }

    /// The specification the plant was built from.
    #[must_use]
    pub fn spec(&self) -> &PlantSpec {
        &self.spec
    }

    /// Counter of the input encoder as its index last passed; `None` before the first pass.
    #[must_use]
    pub fn input_index_counts(&self) -> Option<i64> {
        self.input.index_counts()
    }

    /// Counter of the output encoder as its index last passed; `None` before the first pass.
    #[must_use]
    pub fn output_index_counts(&self) -> Option<i64> {
        self.output.index_counts()
    }

    /// Counts per revolution of input and output encoder.
    #[must_use]
    pub fn counts_per_rev(&self) -> (u64, u64) {
        let encoders = &self.spec.encoders;
        (encoders.input.counts_per_rev(), encoders.output.counts_per_rev())
    }

    /// Lines of input and output encoder.
    #[must_use]
    pub fn lines(&self) -> (u32, u32) {
        (self.spec.encoders.input.lines, self.spec.encoders.output.lines)
    }

    /// Nominal driven angle f(θ1) of the pair, rad.
    #[must_use]
    pub fn nominal_driven_rad(&self, theta1_rad: f64) -> f64 {
        self.curves.driven_angle(theta1_rad)
    }

    /// Nominal ratio i21(θ1).
    #[must_use]
    pub fn nominal_ratio(&self, theta1_rad: f64) -> f64 {
        self.curves.ratio(theta1_rad)
    }

    /// Transmission error of the rigid, displaced pair on `flank` at gear 1's angle, rad: the exact contact of the
    /// moment.
    #[must_use]
    pub fn rigid_error_rad(&self, theta1_rad: f64, flank: Flank) -> f64 {
        self.mesh.flank(self.mesh.locate(theta1_rad), flank).psi_rad - self.curves.driven_angle(theta1_rad)
    }

    /// Lever arm of the common normal of `flank` about the driven axis, mm.
    #[must_use]
    pub fn driven_arm_mm(&self, theta1_rad: f64, flank: Flank) -> f64 {
        self.mesh.flank(self.mesh.locate(theta1_rad), flank).arm_squared_mm2.sqrt()
    }

    /// The true state.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let chain = &self.chain;
        Truth {
            time_s: self.time_s(),
            angles_rad: chain.q,
            speeds_rad_per_s: chain.v,
            input_torque_nm: chain.input_torque_nm,
            mesh_torque_nm: chain.mesh_torque_nm,
            load_torque_nm: chain.load_torque_nm,
            brake_torque_nm: chain.brake_torque_nm,
            input_windup_rad: chain.input_twist_rad(),
            output_windup_rad: chain.output_twist_rad(self.clamp_slip_rad),
            clamp_slip_rad: self.clamp_slip_rad,
            count_losses: self.count_losses,
            transmission_error_rad: chain.q[DISC] - self.curves.driven_angle(chain.q[INPUT]),
            contact: chain.contact,
        }
    }

    /// Servo on or off; off, the shaft coasts against friction.
    pub fn set_enabled(&mut self, enabled: bool) {
        self.servo.set_enabled(enabled);
    }

    /// Whether the servo is on.
    #[must_use]
    pub fn enabled(&self) -> bool {
        self.servo.enabled()
    }

    /// Speed that the ramp heads for, motor rpm; positive turns the driver counter-clockwise.
    pub fn set_speed_reference_rpm(&mut self, motor_rpm: f64) {
        self.servo.set_speed_reference_rpm(motor_rpm);
    }

    /// Times for 3000 motor rpm of acceleration and deceleration, ms.
    pub fn set_ramp_ms(&mut self, accel_ms: f64, decel_ms: f64) {
        self.servo.set_ramp_ms(accel_ms, decel_ms);
    }

    /// Motor speed as the drive reports it, rpm.
    #[must_use]
    pub fn speed_rpm(&self) -> f64 {
        self.servo.speed_rpm()
    }

    /// Motor torque as the drive reports it, percent of rated.
    #[must_use]
    pub fn torque_percent(&self) -> f64 {
        self.servo.torque_percent()
    }

    /// Speed reference behind the ramp generator, motor rpm.
    #[must_use]
    pub fn reference_speed_after_ramp_rpm(&self) -> f64 {
        self.servo.reference_speed_after_ramp_rpm()
    }

    /// The brake's current source: on or off, and its limits.
    pub fn set_drive(&mut self, enabled: bool, current_limit_a: f64, voltage_limit_v: f64) {
        self.brake.set_drive(enabled, current_limit_a, voltage_limit_v);
    }

    /// Coil current, A.
    #[must_use]
    pub fn current_a(&self) -> f64 {
        self.brake.current_a()
    }

    /// Voltage across the coil, V.
    #[must_use]
    pub fn voltage_v(&self) -> f64 {
        self.brake.voltage_v()
    }

    /// Temperature of the brake's housing, °C.
    #[must_use]
    pub fn temperature_c(&self) -> f64 {
        self.brake.temperature_c()
    }

    /// Temperature of the brake's powder, °C.
    #[must_use]
    pub fn powder_temperature_c(&self) -> f64 {
        self.brake.powder_temperature_c()
    }
}

fn chain_spec(spec: &PlantSpec) -> ChainSpec {
    let shafts = &spec.shafts;
    let spring = |compliance_rad_per_nm: f64, damping_time_s: f64| {
        let stiffness_nm_per_rad = 1.0 / compliance_rad_per_nm.max(RIGID_SHAFT_RAD_PER_NM);
        Spring { stiffness_nm_per_rad, damping_nm_s_per_rad: damping_time_s * stiffness_nm_per_rad }
    };
    let joint =
        |angle_rad: f64, phase_rad: f64| (angle_rad != 0.0).then(|| ((0.5 * angle_rad).tan().powi(2), phase_rad));
    let step_up = spec.brake.step_up;
    let mut inertia_kg_m2 = [0.0; 5];
    inertia_kg_m2[INPUT] = spec.drive.inertia_kg_m2;
    inertia_kg_m2[GEAR1] = shafts.gear1_inertia_kg_m2;
    inertia_kg_m2[GEAR2] = shafts.gear2_inertia_kg_m2;
    inertia_kg_m2[DISC] = shafts.disc_inertia_kg_m2;
    inertia_kg_m2[ROTOR] = spec.brake.rotor_inertia_kg_m2 * step_up * step_up;
    ChainSpec {
        inertia_kg_m2,
        bearing_nm_s_per_rad: shafts.bearing_nm_s_per_rad,
        input_shaft: spring(shafts.compliance_input_rad_per_nm, shafts.damping_time_s),
        output_shaft: spring(shafts.compliance_output_rad_per_nm, shafts.damping_time_s),
        brake_coupling: spring(shafts.compliance_brake_rad_per_nm, shafts.brake_damping_time_s),
        cardan: joint(shafts.output_cardan_angle_rad, shafts.output_cardan_phase_rad),
        input_cardan: joint(shafts.input_cardan_angle_rad, shafts.input_cardan_phase_rad),
    }
}
