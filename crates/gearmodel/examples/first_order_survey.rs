//! Where the first-order TE stands against exact contact, over lobes, eccentricity, teeth and errors: the survey behind
//! `GearPair::first_order_limit_mm`. Run: `cargo run --release -p gearmodel --example first_order_survey`.

use std::f64::consts::TAU;

use gearmodel::contact::ContactModel;
use gearmodel::{CurveSpec, Direction, Errors, GearPair, ToothSpec};

fn teeth(z1: u32, z2: u32) -> ToothSpec {
    ToothSpec { teeth: (z1, z2), ..Default::default() }
}

/// The largest |exact − common normal| over the peak-to-peak of both senses, %; `None` where the teeth lose contact.
fn defect_percent(pair: GearPair, errors: &Errors) -> Option<f64> {
    let model = ContactModel::new(pair, errors).ok()?;
    let mut worst = 0.0_f64;
    for direction in Direction::BOTH {
        let (mut low, mut high, mut apart) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
        for step in 0..180 {
            let theta1 = TAU * f64::from(step) / 180.0;
            let exact = model.te_rad(theta1, direction).ok()?;
            low = low.min(exact);
            high = high.max(exact);
            apart = apart.max((exact - model.first_order_te_rad(theta1, direction).ok()?).abs());
        }
        worst = worst.max(100.0 * apart / (high - low));
    }
    Some(worst)
}

fn main() {
    for order in 1..=3 {
        for k in [0.0, 0.1, 0.2, 0.3, 0.45, 0.6] {
            for z in [18, 24, 36, 48, 78] {
                let curve = CurveSpec::Lobed { eccentricity: k, lobes: (order, order) };
                let Ok(pair) = GearPair::free(&teeth(z, z), &curve) else { continue };
                let cut = pair.check_teeth();
                let fault = cut.err().map_or(String::new(), |error| format!("{error:?}").chars().take(9).collect());
                let mut line = format!("order {order} k {k} z {z} {fault:10}");
                for e in [0.01, 0.05, 0.1] {
                    let errors =
                        Errors { e1_mm: e, phi1_rad: 0.3, e2_mm: 0.6 * e, phi2_rad: 1.1, ..Default::default() };
                    let defect = defect_percent(pair.clone(), &errors);
                    line += &format!(" e {e}: {}", defect.map_or("no contact".to_owned(), |d| format!("{d:.3} %")));
                }
                println!("{line}");
            }
        }
    }
}
