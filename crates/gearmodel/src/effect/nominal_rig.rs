//! The rig as documented: what effects are linearised about.

use std::f64::consts::{PI, TAU};

use super::OperatingPoint;
use crate::contact::ContactModel;
use crate::increment::common_normal;
use crate::pitch_curve::AnyCurve;
use crate::{Direction, Errors, GearPair};

/// Angles a turn at which the teeth in contact are looked up before their ends are refined.
const ZONE_STEPS: usize = 720;
/// Angles a turn at which the ratio is taken apart into orders of the driver.
const RATIO_STEPS: usize = 512;
/// Orders of the ratio smaller than this part of the largest are left out.
const LEAST_ORDER: f64 = 1e-9;
/// Steps a tooth at which the mesh's wave is taken apart, and the part of it under which an order is left out.
const MESH_STEPS_A_TOOTH: i32 = 16;
const LEAST_MESH_ORDER: f64 = 1e-4;
/// Halvings of an angle step until the end of a contact is known, to 0.002°.
const HALVINGS: usize = 8;

/// A pair with its documented errors, and what was noted about the encoders.
#[derive(Clone, Debug)]
pub struct NominalRig {
    pair: GearPair,
    errors: Errors,
    /// Lines of the input and of the output encoder, where known.
    pub lines: [Option<f64>; 2],
    /// Counts a revolution of the output encoder, where known or seen in the data.
    pub output_counts_per_rev: Option<f64>,
    /// From where to where each driver tooth's flank is in contact, pitches from its pitch point, by sense.
    spans: [Vec<Span>; 2],
    pitch_mm: f64,
    /// Amplitudes of cos nθ1 and sin nθ1 in i21(θ1), n = 1, 2, …; empty where the ratio is constant.
    ratio_orders: Vec<[f64; 2]>,
    mesh_orders: MeshOrders,
}

/// The mesh's wave e^{j2πu}, u the pitches rolled on the ccw flank, as orders of the driver's turn: on a pair whose radius varies the
/// mesh frequency is modulated.
#[derive(Clone, Debug, Default)]
pub struct MeshOrders {
    /// First order.
    pub first: i32,
    /// Complex amplitudes [re, im] of this and the next orders.
    pub amplitudes: Vec<[f64; 2]>,
}

impl NominalRig {
    /// A rig of a pair with its documented errors; `lines` are those of the input and of the output encoder.
    #[must_use]
    pub fn new(pair: GearPair, errors: Errors, lines: [Option<f64>; 2], output_counts_per_rev: Option<f64>) -> Self {
        let spans = spans(&pair);
        let pitch_mm = pair.pitch_mm().unwrap_or(f64::NAN);
        let ratio_orders = ratio_orders(&pair);
        let mesh_orders = mesh_orders(&pair, pitch_mm);
        Self { pair, errors, lines, output_counts_per_rev, spans, pitch_mm, ratio_orders, mesh_orders }
    }

    /// The pair.
    #[must_use]
    pub fn pair(&self) -> &GearPair {
        &self.pair
    }

    /// Amplitudes of cos nθ1 and sin nθ1 in i21(θ1), n = 1, 2, …; empty where the ratio is constant.
    #[must_use]
    pub fn ratio_orders(&self) -> &[[f64; 2]] {
        &self.ratio_orders
    }

    /// The mesh's wave as orders of the driver's turn; empty where there are no teeth.
    #[must_use]
    pub fn mesh_orders(&self) -> &MeshOrders {
        &self.mesh_orders
    }

    /// k of an elliptic pair.
    #[must_use]
    pub fn eccentricity(&self) -> Option<f64> {
        match self.pair().pitch_curve() {
            AnyCurve::Ellipse(ellipse) => Some(ellipse.eccentricity()),
            _ => None,
        }
    }

    /// ∂θ2/∂k at a fixed θ1, the centre distance following by closure; `None` for curves without an eccentricity k.
    #[must_use]
    pub fn theta2_slope_over_k(&self, theta2_rad: f64) -> Option<f64> {
        match self.pair().pitch_curve() {
            // 2 sin θ2/(1 − k²) from tan(θ2/2) = (1 + k)/(1 − k) tan(θ1/2)
            AnyCurve::Ellipse(ellipse) => {
                let k = ellipse.eccentricity();
                Some(2.0 * theta2_rad.sin() / (1.0 - k * k))
            }
            AnyCurve::Lobed(lobed) => Some(lobed.theta2_slope_over_k(theta2_rad)),
            _ => None,
        }
    }

    /// Fills in what follows from angle and sense.
    #[must_use]
    pub fn operating_point(&self, theta1_rad: f64, theta2_rad: f64, direction: Direction) -> OperatingPoint {
        let at = self.pair().at(theta1_rad);
        let sense = direction.sign();
        let pressure_rad = common_normal::effective_pressure_angle_rad(self.pair(), &at, direction);
        let pitches = if self.pair().has_teeth() {
            let half = if direction == Direction::Ccw { 0.0 } else { 0.5 };
            self.pair().arc_length_mm(theta1_rad) / self.pitch_mm - half
        } else {
            0.0
        };
        OperatingPoint {
            theta1_rad,
            theta2_rad,
            sense,
            ratio: at.ratio,
            r2_mm: at.r2_mm,
            pressure_rad,
            arm_mm: at.r2_mm * pressure_rad.cos(),
            pitches,
            pitches_per_rad: if self.pair().has_teeth() { at.r1_mm / (at.mu_rad.cos() * self.pitch_mm) } else { 0.0 },
            ..OperatingPoint::default()
        }
    }

    /// Driver teeth in contact where tips reach as far as `reach` says: 0 for the nominal tips, 1 for those of a rack, the longest
    /// there are, less than 0 for tips that are relieved.
    pub fn teeth_in_contact(&self, at: &OperatingPoint, reach: f64) -> impl Iterator<Item = usize> + '_ {
        // A rack's contact point stands u·π m cos α sin α from the pitch line.
        let (sin, cos) = self.pair().pressure_angle_rad().sin_cos();
        let of_rack = self.pair().addendum() / (PI * cos * sin);
        let spans = &self.spans[usize::from(at.sense < 0.0)];
        let (pitches, near, teeth) = (at.pitches, at.pitches.floor() as i64, spans.len() as i64);
        (near - 1..=near + 2).filter_map(move |tooth| {
            let index = usize::try_from(tooth.checked_rem_euclid(teeth)?).ok()?;
            let from_pitch_point = pitches - tooth as f64;
            let span = spans[index];
            let (from, to) = (span.from - reach * (of_rack + span.from), span.to + reach * (of_rack - span.to));
            (from <= from_pitch_point && from_pitch_point <= to).then_some(index)
        })
    }

    /// Share of the pitch about a station on which one pair alone carries: two less the contact ratio.
    #[must_use]
    pub fn single_pair_duty(&self, at: &OperatingPoint) -> f64 {
        let spans = &self.spans[usize::from(at.sense < 0.0)];
        let nearest = (at.pitches.round() as i64).checked_rem_euclid(spans.len() as i64);
        nearest.and_then(|n| spans.get(n as usize)).map_or(0.0, Span::single_pair_duty)
    }

    /// The same in the mean over all teeth and both senses.
    #[must_use]
    pub fn mean_single_pair_duty(&self) -> f64 {
        let all: Vec<f64> = self.spans.iter().flatten().map(Span::single_pair_duty).collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    }

    /// Compliance of the whole train at the driven encoder, rad/(N·m): C_out + C_in i² + C_mesh/A²; 1 rad/(N·m) at the output
    /// where none is documented.
    #[must_use]
    pub fn train_compliance_rad_per_nm(&self, at: &OperatingPoint) -> f64 {
        let Errors {
            shaft_compliance_output_rad_per_nm: output,
            shaft_compliance_input_rad_per_nm: input,
            mesh_compliance_mm2_rad_per_nm: mesh,
            ..
        } = self.errors;
        if output == 0.0 && input == 0.0 && mesh == 0.0 {
            return 1.0;
        }
        output + input * at.ratio * at.ratio + mesh / (at.arm_mm * at.arm_mm)
    }
}

/// A segment of contact, pitches from the pitch point.
#[derive(Clone, Copy, Debug, Default)]
struct Span {
    from: f64,
    to: f64,
}

impl Span {
    fn single_pair_duty(&self) -> f64 {
        (2.0 - (self.to - self.from)).clamp(0.0, 1.0)
    }
}

/// Orders of the driver's turn in the ratio: a discrete Fourier transform, exact for curves whose orders end below half of its steps.
fn ratio_orders(pair: &GearPair) -> Vec<[f64; 2]> {
    let ratios: Vec<f64> = (0..RATIO_STEPS).map(|n| pair.ratio(TAU * n as f64 / RATIO_STEPS as f64)).collect();
    let mut orders: Vec<[f64; 2]> = (1..RATIO_STEPS / 4)
        .map(|order| {
            let (mut cosine, mut sine) = (0.0, 0.0);
            for (n, ratio) in ratios.iter().enumerate() {
                let (sin, cos) = (TAU * (order * n % RATIO_STEPS) as f64 / RATIO_STEPS as f64).sin_cos();
                cosine += ratio * cos;
                sine += ratio * sin;
            }
            [2.0 * cosine / RATIO_STEPS as f64, 2.0 * sine / RATIO_STEPS as f64]
        })
        .collect();
    let size = |order: &[f64; 2]| order[0].hypot(order[1]);
    let mean = ratios.iter().sum::<f64>() / RATIO_STEPS as f64;
    let largest = orders.iter().map(size).fold(0.0, f64::max);
    // What rounding leaves of a constant ratio is none.
    let least = LEAST_ORDER * largest.max(1e-3 * mean);
    let last = orders.iter().rposition(|order| size(order) > least).map_or(0, |n| n + 1);
    orders.truncate(last);
    orders
}

/// Orders of the driver's turn in e^{j2πu}: a discrete Fourier transform over the turn, about the order of the teeth.
fn mesh_orders(pair: &GearPair, pitch_mm: f64) -> MeshOrders {
    let teeth = pair.teeth().0 as i32;
    if !pair.has_teeth() || teeth == 0 {
        return MeshOrders::default();
    }
    let steps = MESH_STEPS_A_TOOTH * teeth;
    let wave: Vec<(f64, f64)> = (0..steps)
        .map(|n| (TAU * pair.arc_length_mm(TAU * f64::from(n) / f64::from(steps)) / pitch_mm).sin_cos())
        .collect();
    let amplitude = |order: i32| {
        let (mut re, mut im) = (0.0, 0.0);
        for (n, (sin, cos)) in (0_i32..).zip(&wave) {
            let place = (i64::from(order) * i64::from(n)).rem_euclid(i64::from(steps));
            let (s, c) = (TAU * place as f64 / f64::from(steps)).sin_cos();
            // e^{j2πu} e^{−jnθ1}
            re += cos * c + sin * s;
            im += sin * c - cos * s;
        }
        [re / f64::from(steps), im / f64::from(steps)]
    };
    // The mesh never runs backwards, nor so much faster than in the mean that its orders would reach half of the steps.
    let all: Vec<(i32, [f64; 2])> = (0..=3 * teeth).map(|order| (order, amplitude(order))).collect();
    let counts = |(_, [re, im]): &(i32, [f64; 2])| re.hypot(*im) > LEAST_MESH_ORDER;
    let (Some(low), Some(high)) = (all.iter().position(counts), all.iter().rposition(counts)) else {
        return MeshOrders::default();
    };
    MeshOrders { first: all[low].0, amplitudes: all[low..=high].iter().map(|(_, amplitude)| *amplitude).collect() }
}

/// Contact of every driver tooth's flank, by sense; empty where there are no teeth.
fn spans(pair: &GearPair) -> [Vec<Span>; 2] {
    let contact = ContactModel::new(pair.clone(), &Errors::default()).ok();
    let teeth = i64::from(pair.teeth().0);
    Direction::BOTH.map(|direction| {
        let Some(contact) = contact.as_ref().filter(|_| teeth > 0) else { return Vec::new() };
        let half = if direction == Direction::Ccw { 0.0 } else { 0.5 };
        let touches = |tooth: i64, theta1_rad: f64| {
            let mut found = false;
            // An angle without any contact has none of this tooth either.
            let _ = contact.for_each_pair(theta1_rad, direction, |touch| {
                found |= (touch.tooth - tooth).rem_euclid(teeth) == 0;
            });
            found
        };
        let pitch_mm = pair.pitch_mm().unwrap_or(f64::NAN);
        let step_rad = TAU / ZONE_STEPS as f64;
        (0..teeth)
            .map(|tooth| {
                let centre_rad = pair.theta1_at_arc_length((tooth as f64 + half) * pitch_mm);
                let end = |way: f64| {
                    let (mut inside, mut outside) = (0.0, 0.0);
                    for n in 1..ZONE_STEPS / 2 {
                        outside = way * n as f64 * step_rad;
                        if !touches(tooth, centre_rad + outside) {
                            break;
                        }
                        inside = outside;
                    }
                    for _ in 0..HALVINGS {
                        let middle = 0.5 * (inside + outside);
                        if touches(tooth, centre_rad + middle) { inside = middle } else { outside = middle }
                    }
                    pair.arc_length_mm(centre_rad + 0.5 * (inside + outside)) / pitch_mm - half - tooth as f64
                };
                Span { from: end(-1.0), to: end(1.0) }
            })
            .collect()
    })
}
