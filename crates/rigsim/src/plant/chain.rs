//! The chain of five rotating inertias and its integrator.
//!
//! input shaft (motor, encoder 1) – C_in – gear 1 – mesh – gear 2 – C_out – disc (encoder 2) – coupling – brake rotor
//!
//! Angles in rad, each in its own sense of motion; torques in N·m. One step of length h solves for the change Δv of the
//! five speeds at once, J Δv = h τ, and then moves on by q ← q + h (v + Δv/2). The torques are linear in Δv:
//!
//! - shafts at the midpoint, q + h v/2 + h Δv/4 and v + Δv/2: second order, no numerical damping;
//! - tooth contact at the end of the step, q + h v + h Δv/2 and v + Δv: its fastest mode, ω h ≈ 2.5 at 100 µs, is stable
//!   and damped, for the map of one step has the determinant 1/(1 + ω²h²/2); the flank is linearised about q + h v;
//! - the brake's Coulomb friction at the end of the step: what elimination leaves at the last inertia is the scalar
//!   inclusion d v' + h T sgn(v') ∋ R, which holds exactly still where |R| ≤ h T.
//!
//! All laws are monotone, so exactly one contact state is consistent; it is found by trying the last one first.

use super::flank::Flank;
use super::mesh::Mesh;

/// Indices of the inertias.
pub(super) const INPUT: usize = 0;
pub(super) const GEAR1: usize = 1;
pub(super) const GEAR2: usize = 2;
pub(super) const DISC: usize = 3;
pub(super) const ROTOR: usize = 4;

/// A torsional spring with a damper in parallel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spring {
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
}

impl Spring {
    /// Torque over the step without a change of speed, and its slope over the change of the relative speed.
    #[inline]
    fn midpoint(self, h: f64, twist: f64, rate: f64) -> (f64, f64) {
        let (k, c) = (self.stiffness_nm_per_rad, self.damping_nm_s_per_rad);
        (k * (twist + 0.5 * h * rate) + c * rate, 0.25 * h * k + 0.5 * c)
    }
}

/// Constants of the chain.
#[derive(Debug, Clone)]
pub(super) struct ChainSpec {
    pub inertia_kg_m2: [f64; 5],
    /// Viscous friction of the bearings of gear 1 and gear 2, N·m·s/rad.
    pub bearing_nm_s_per_rad: f64,
    pub input_shaft: Spring,
    pub output_shaft: Spring,
    pub brake_coupling: Spring,
    /// tan²(β/2) of a Cardan joint in the output shaft at the angle β, and its phase, rad.
    pub cardan: Option<(f64, f64)>,
    /// The same of a joint in the input shaft.
    pub input_cardan: Option<(f64, f64)>,
}

/// What acts from outside in one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drive {
    /// Motor torque at the driver shaft, explicit friction taken off.
    pub torque_nm: f64,
    /// Friction of the drive to be taken implicitly, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// Dry friction on the output disc, explicit, N·m.
    pub seal_nm: f64,
    /// The same where it is to be taken implicitly, N·m·s/rad.
    pub seal_nm_s_per_rad: f64,
    /// Friction that the brake can offer.
    pub brake_capacity_nm: f64,
    /// Angle by which the output clamp has slipped, rad.
    pub clamp_slip_rad: f64,
    /// Run-out of the gears along the pitch line, mm.
    pub run_out_mm: f64,
}

/// State of the chain.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    spec: ChainSpec,
    pub q: [f64; 5],
    pub v: [f64; 5],
    /// The flank in contact, none while the teeth are apart.
    pub contact: Option<Flank>,
    /// Torque of the tooth contact on gear 2 (positive drives it forward), over the last step.
    pub mesh_torque_nm: f64,
    /// Torque that gear 2 hands on to the output shaft, over the last step.
    pub load_torque_nm: f64,
    /// Friction torque of the brake on the driven shaft, over the last step (positive opposes positive motion).
    pub brake_torque_nm: f64,
    /// Torque of the input shaft on gear 1, over the last step.
    pub input_torque_nm: f64,
}

/// The linear system of one step but for the contact.
struct Assembly {
    diagonal: [f64; 5],
    right: [f64; 5],
    /// Coupling of (0,1), (2,3), (3,4); that of (1,2) is the contact's.
    coupling: [f64; 3],
}

/// The contact, linear in the change of speed: torque on gear 2 = start + slope (ratio Δv1 − Δv2).
#[derive(Clone, Copy)]
struct ContactLaw {
    start_nm: f64,
    slope: f64,
    ratio: f64,
}

impl Chain {
    pub fn new(spec: ChainSpec, input_rad: f64, driven_rad: f64) -> Self {
        let encoder = joint(spec.cardan, driven_rad).0;
        let gear1 = joint(spec.input_cardan, input_rad).0;
        Self {
            spec,
            q: [input_rad, gear1, driven_rad, encoder, encoder],
            v: [0.0; 5],
            contact: None,
            mesh_torque_nm: 0.0,
            load_torque_nm: 0.0,
            brake_torque_nm: 0.0,
            input_torque_nm: 0.0,
        }
    }

    /// Twist of the output shaft, rad, without what the clamp has slipped.
    pub fn output_twist_rad(&self, clamp_slip_rad: f64) -> f64 {
        joint(self.spec.cardan, self.q[GEAR2]).0 - self.q[DISC] - clamp_slip_rad
    }

    /// Twist of the input shaft, rad.
    pub fn input_twist_rad(&self) -> f64 {
        joint(self.spec.input_cardan, self.q[INPUT]).0 - self.q[GEAR1]
    }

    /// Advances by `h` seconds.
    #[inline]
    pub fn step(&mut self, h: f64, drive: &Drive, mesh: &Mesh) {
        let (q, v) = (self.q, self.v);
        // Gear 1 will be here unless its speed changes; linearising about this place leaves no error of second order.
        let ahead1 = q[GEAR1] + h * v[GEAR1];
        let ahead2 = q[GEAR2] + h * v[GEAR2];
        let place = mesh.locate(ahead1);
        let lift_rad = drive.run_out_mm * mesh.inverse_radius(place);

        let (output_rad, output_ratio) = joint(self.spec.cardan, q[GEAR2]);
        let (input_rad, input_ratio) = joint(self.spec.input_cardan, q[INPUT]);
        let input_rate = input_ratio * v[INPUT] - v[GEAR1];
        let (input_torque, input_slope) = self.spec.input_shaft.midpoint(h, input_rad - q[GEAR1], input_rate);
        let twist = output_rad - q[DISC] - drive.clamp_slip_rad;
        let output_rate = output_ratio * v[GEAR2] - v[DISC];
        let (output_torque, output_slope) = self.spec.output_shaft.midpoint(h, twist, output_rate);
        let coupling_rate = v[DISC] - v[ROTOR];
        let (coupling_torque, coupling_slope) = self.spec.brake_coupling.midpoint(h, q[DISC] - q[ROTOR], coupling_rate);

        let bearing = h * self.spec.bearing_nm_s_per_rad;
        let motor = h * drive.viscous_nm_s_per_rad;
        let seal = h * drive.seal_nm_s_per_rad;
        let [g01, g23, g34] = [h * input_slope, h * output_slope, h * coupling_slope];
        let inertia = &self.spec.inertia_kg_m2;
        let assembly = Assembly {
            diagonal: [
                inertia[INPUT] + g01 * input_ratio * input_ratio + motor,
                inertia[GEAR1] + g01 + bearing,
                inertia[GEAR2] + g23 * output_ratio * output_ratio + bearing,
                inertia[DISC] + g23 + g34 + seal,
                inertia[ROTOR] + g34,
            ],
            right: [
                h * (drive.torque_nm - input_torque * input_ratio) - motor * v[INPUT],
                h * input_torque - bearing * v[GEAR1],
                -h * output_torque * output_ratio - bearing * v[GEAR2],
                h * (output_torque - coupling_torque - drive.seal_nm) - seal * v[DISC],
                h * coupling_torque,
            ],
            coupling: [-g01 * input_ratio, -g23 * output_ratio, -g34],
        };

        let law = |flank: Flank| -> ContactLaw {
            let at = mesh.flank(place, flank);
            let stiffness = mesh.stiffness_nm_per_rad(&at);
            let damping = stiffness * mesh.damping_time_s();
            let gap_rad = at.psi_rad + lift_rad - ahead2;
            ContactLaw {
                start_nm: stiffness * gap_rad + damping * (at.ratio * v[GEAR1] - v[GEAR2]),
                slope: 0.5 * h * stiffness + damping,
                ratio: at.ratio,
            }
        };
        let capacity = h * drive.brake_capacity_nm;
        let mut contact = self.contact;
        let mut active;
        let mut change;
        let mut torque;
        // Monotone laws leave at most three states to try: the last, apart, the other flank.
        let mut tries = 0;
        loop {
            active = contact.map(law);
            change = assembly.solve(h, active, v[ROTOR], capacity);
            torque = active.map_or(0.0, |law| law.torque_nm(&change));
            tries += 1;
            let next = match contact {
                Some(flank) if flank.sign() * torque >= 0.0 => break,
                Some(_) => None,
                None => {
                    let pressed = |flank: Flank| flank.sign() * law(flank).torque_nm(&change) > 0.0;
                    [Flank::Ccw, Flank::Cw].into_iter().find(|&flank| pressed(flank))
                }
            };
            if next == contact {
                break;
            }
            if tries >= 4 {
                // Only rounding at the very edge of contact leads here; the teeth never pull.
                torque = 0.0;
                break;
            }
            contact = next;
        }

        for n in 0..5 {
            self.q[n] = q[n] + h * (v[n] + 0.5 * change[n]);
            self.v[n] = v[n] + change[n];
        }
        self.contact = contact;
        self.mesh_torque_nm = torque;
        self.input_torque_nm = input_torque + input_slope * (input_ratio * change[INPUT] - change[GEAR1]);
        let output_change = output_ratio * change[GEAR2] - change[DISC];
        self.load_torque_nm = (output_torque + output_slope * output_change) * output_ratio;
        let coupling = coupling_torque + coupling_slope * (change[DISC] - change[ROTOR]);
        self.brake_torque_nm = coupling - inertia[ROTOR] * change[ROTOR] / h;
    }
}

/// Angle behind a Cardan joint that is turned to `angle_rad`, and its derivative; without a joint the angle itself.
///
/// tan q_out = tan q_in/cos β, that is q_in + atan2(ε sin w, 1 − ε cos w) with ε = tan²(β/2) and w = 2 q_in − phase; its derivative
/// is (1 − ε²)/(1 − 2 ε cos w + ε²).
#[inline]
fn joint(cardan: Option<(f64, f64)>, angle_rad: f64) -> (f64, f64) {
    match cardan {
        None => (angle_rad, 1.0),
        Some((epsilon, phase)) => {
            let (sin, cos) = (2.0 * angle_rad - phase).sin_cos();
            let square = epsilon * epsilon;
            let ratio = (1.0 - square) / (1.0 - 2.0 * epsilon * cos + square);
            (angle_rad + (epsilon * sin).atan2(1.0 - epsilon * cos), ratio)
        }
    }
}

impl ContactLaw {
    #[inline]
    fn torque_nm(&self, change: &[f64; 5]) -> f64 {
        self.start_nm + self.slope * (self.ratio * change[GEAR1] - change[GEAR2])
    }
}

impl Assembly {
    /// Solves the tridiagonal system for the change of speeds, the brake's friction impulse up to `capacity` included.
    ///
    /// Input and disc are eliminated first, side by side, then gear 1, then gear 2; the rotor with its friction comes
    /// last.
    #[inline]
    fn solve(&self, h: f64, contact: Option<ContactLaw>, rotor_speed: f64, capacity: f64) -> [f64; 5] {
        let [d0, mut d1, mut d2, d3, mut d4] = self.diagonal;
        let [r0, mut r1, mut r2, r3, mut r4] = self.right;
        let [c01, c23, c34] = self.coupling;
        let mut c12 = 0.0;
        if let Some(law) = contact {
            let slope = h * law.slope;
            c12 = -slope * law.ratio;
            d1 -= c12 * law.ratio;
            d2 += slope;
            r1 -= h * law.start_nm * law.ratio;
            r2 += h * law.start_nm;
        }
        let i0 = 1.0 / d0;
        d1 -= c01 * c01 * i0;
        r1 -= c01 * i0 * r0;
        let i3 = 1.0 / d3;
        let (f2, f4) = (c23 * i3, c34 * i3);
        d2 -= f2 * c23;
        r2 -= f2 * r3;
        d4 -= f4 * c34;
        r4 -= f4 * r3;
        let c24 = -f2 * c34;
        let i1 = 1.0 / d1;
        d2 -= c12 * c12 * i1;
        r2 -= c12 * i1 * r1;
        let i2 = 1.0 / d2;
        d4 -= c24 * c24 * i2;
        r4 -= c24 * i2 * r2;

        // d (v' − v) = r − impulse, impulse ∈ capacity·sgn(v').
        let momentum = r4 + d4 * rotor_speed;
        let x4 = if momentum.abs() <= capacity {
            -rotor_speed
        } else {
            (momentum - capacity.copysign(momentum)) / d4 - rotor_speed
        };
        let x2 = (r2 - c24 * x4) * i2;
        let x1 = (r1 - c12 * x2) * i1;
        [(r0 - c01 * x1) * i0, x1, x2, (r3 - c23 * x2 - c34 * x4) * i3, x4]
    }
}
