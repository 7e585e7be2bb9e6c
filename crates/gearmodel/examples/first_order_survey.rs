//! Where the first-order TE stands against exact contact, over random pairs and errors: the survey behind
//! `GearPair::first_order_limit_mm`. Run: `cargo run --release -p gearmodel --example first_order_survey [-- PAIRS]`.
//!
//! k is 0 to 0.6, lobes 1 to 3 on either gear, 17 to 80 teeth, the sum of eccentricities up to 0.2 mm, phases at random, the
//! axes displaced in half of them by up to the larger eccentricity. For every order,
//! convex and concave pitch curves apart: the largest defect |exact − common normal| over the peak-to-peak, in 0.1 % and in units
//! of what the stated limit allows for the displacement at hand: above 1 the limit would not hold.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use gearmodel::contact::ContactModel;
use gearmodel::{CurveSpec, Direction, Errors, GearPair, GeometryError, ToothSpec};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Angles a turn.
const ANGLES: usize = 360;

/// The largest |exact − common normal| of both senses over the peak-to-peak that e1 or e2 alone makes, whichever is larger;
/// `None` where the teeth lose contact.
fn defect(pair: &GearPair, errors: &Errors, displacement_mm: (f64, f64)) -> Option<f64> {
    let curves = |errors: &Errors, (dx_mm, dy_mm): (f64, f64)| -> Option<(f64, f64)> {
        let model = ContactModel::new(pair.clone(), errors).ok()?.with_displacement(dx_mm, dy_mm).ok()?;
        let theta1: Vec<f64> = (0..ANGLES).map(|n| TAU * n as f64 / ANGLES as f64).collect();
        let (mut apart, mut size) = (0.0_f64, 0.0_f64);
        for direction in Direction::BOTH {
            let exact = model.te_curve_rad(&theta1, direction).ok()?;
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for (theta, exact) in theta1.iter().zip(exact) {
                let first = model.first_order_te_rad(*theta, direction).ok()?;
                (low, high) = (low.min(first), high.max(first));
                apart = apart.max((exact - first).abs());
            }
            size = size.max(high - low);
        }
        Some((apart, size))
    };
    let (apart, _) = curves(errors, displacement_mm)?;
    let (_, first) = curves(&Errors { e2_mm: 0.0, ..*errors }, (0.0, 0.0))?;
    let (_, second) = curves(&Errors { e1_mm: 0.0, ..*errors }, (0.0, 0.0))?;
    Some(apart / first.max(second))
}

#[derive(Default)]
struct Row {
    pairs: u32,
    without_contact: u32,
    within: u32,
    worst_defect: f64,
    worst_against_limit: f64,
    where_worst: String,
}

fn main() {
    let count: u32 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(2000);
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut rows: BTreeMap<(u32, &str), Row> = BTreeMap::new();
    let mut made = 0;
    while made < count {
        let lobes = (random.random_range(1..=3_u32), random.random_range(1..=3_u32));
        let eccentricity = random.random_range(0.0..0.6);
        let unit = random.random_range(6..=80_u32);
        let teeth = (lobes.0 * unit, lobes.1 * unit);
        if teeth.0.min(teeth.1) < 17 || teeth.0.max(teeth.1) > 80 {
            continue;
        }
        let spec = ToothSpec { teeth, ..Default::default() };
        let Ok(pair) = GearPair::free(&spec, &CurveSpec::Lobed { eccentricity, lobes }) else { continue };
        made += 1;
        let errors = Errors {
            e1_mm: random.random_range(0.001..0.1),
            phi1_rad: random.random_range(-PI..PI),
            e2_mm: random.random_range(0.001..0.1),
            phi2_rad: random.random_range(-PI..PI),
            ..Default::default()
        };
        // In every other pair the axes are displaced as well, by no more than the larger eccentricity.
        let displaced_mm =
            if made % 2 == 0 { errors.e1_mm.max(errors.e2_mm) * random.random_range(0.0..1.0) } else { 0.0 };
        let angle = random.random_range(-PI..PI);
        let displacement_mm = (displaced_mm * angle.cos(), displaced_mm * angle.sin());
        let concave = pair.tooth_faults().iter().any(|fault| matches!(fault, GeometryError::Concave { .. }));
        let row = rows.entry((lobes.0, if concave { "concave" } else { "convex" })).or_default();
        row.pairs += 1;
        let Some(defect) = defect(&pair, &errors, displacement_mm) else {
            row.without_contact += 1;
            continue;
        };
        row.worst_defect = row.worst_defect.max(defect);
        if let Some(limit_mm) = pair.first_order_limit_mm() {
            let total_mm = errors.e1_mm + errors.e2_mm + displaced_mm;
            row.within += u32::from(total_mm <= limit_mm);
            // The defect is of second order: a thousandth at the limit, in proportion to the displacement.
            let against = defect / (1e-3 * total_mm / limit_mm);
            if against > row.worst_against_limit {
                row.worst_against_limit = against;
                row.where_worst = format!("k = {eccentricity:.3}, {lobes:?}, {teeth:?}, limit {limit_mm:.4} mm");
            }
        }
    }
    println!("lobes  curve    pairs  no contact  within limit  worst defect  of what the limit allows");
    for ((lobes, shape), row) in rows {
        println!(
            "{lobes:5}  {shape:8} {:5}  {:10}  {:12}  {:10.3} %  {:.3}  {}",
            row.pairs,
            row.without_contact,
            row.within,
            100.0 * row.worst_defect,
            row.worst_against_limit,
            row.where_worst
        );
    }
}
