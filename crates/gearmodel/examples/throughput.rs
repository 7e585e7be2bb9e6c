//! How fast the hot paths are on this machine: `cargo run --release -p gearmodel --example throughput`.

use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::Instant;

use gearmodel::contact::{ContactModel, ToothErrors};
use gearmodel::measure::{AngleGrid, RunConditions, RunTe};
use gearmodel::sensitivity::Parameter;
use gearmodel::tolerance::{Scatter, ToleranceStudy};
use gearmodel::{Direction, EllipticalSpec, Errors, Gear, GearPair, GeometryError, NominalModel};

fn main() -> Result<(), GeometryError> {
    let pair = GearPair::elliptical(&EllipticalSpec::default())?;
    samples(&pair);
    exact_contact(&pair)?;
    let start = Instant::now();
    black_box((pair.outline(Gear::Driver, 40)?, pair.outline(Gear::Driven, 40)?));
    println!("outlines of both gears, 40 points a tooth: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    tolerance(pair)
}

/// 100 000 pairs, 720 angles, both senses.
fn tolerance(pair: GearPair) -> Result<(), GeometryError> {
    let model = NominalModel::new(pair, Errors::default())?;
    let scatter = vec![
        (Parameter::E1Mm, Scatter::Normal(0.02)),
        (Parameter::Phi1Rad, Scatter::Uniform(PI)),
        (Parameter::E2Mm, Scatter::Normal(0.02)),
        (Parameter::Phi2Rad, Scatter::Uniform(PI)),
        (Parameter::BacklashMm, Scatter::Normal(0.01)),
        (Parameter::CentreDistanceErrorMm, Scatter::Normal(0.01)),
    ];
    let study = ToleranceStudy { scatter, ..ToleranceStudy::default() };
    let start = Instant::now();
    match study.run(&model, &|_| {}) {
        Ok(figures) => println!(
            "tolerance of {} pairs at {} angles: {:.2} s; {} q95 {:.1} urad",
            study.pairs,
            study.angles,
            start.elapsed().as_secs_f64(),
            figures[0].name,
            figures[0].quantile_rad(0.95) * 1e6
        ),
        Err(error) => println!("tolerance: {error}"),
    }
    Ok(())
}

/// Exact TE of 4096 angles in both senses, rigid displacements alone and with a pitch error on every tooth.
fn exact_contact(pair: &GearPair) -> Result<(), GeometryError> {
    let errors = Errors { e1_mm: 0.05, phi1_rad: 0.3, e2_mm: 0.03, phi2_rad: 1.1, ..Errors::default() };
    let rigid = ContactModel::new(pair.clone(), &errors)?;
    let leads: Vec<f64> = (0..47).map(|tooth| 0.005 * f64::from(tooth * tooth % 13)).collect();
    let teeth = ToothErrors { driver_pitch_mm: [leads.clone(), leads], ..ToothErrors::default() };
    let uneven = rigid.clone().with_tooth_errors(teeth)?;
    for (name, model) in [("rigid displacements", &rigid), ("pitch errors", &uneven)] {
        let (mut pairs, mut angles) = (0_u64, 0_u64);
        let start = Instant::now();
        for round in 0..20 {
            for step in 0..4096 {
                let theta1_rad = TAU * (f64::from(step) + 0.05 * f64::from(round)) / 4096.0;
                for direction in Direction::BOTH {
                    if let Ok(contact) = black_box(model.contact(theta1_rad, direction)) {
                        pairs += u64::from(contact.pairs_in_zone);
                        angles += 1;
                    }
                }
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "exact contact, {name}: {:.2} M tooth pairs/s, {:.2} M angles/s on one core",
            pairs as f64 / seconds / 1e6,
            angles as f64 / seconds / 1e6
        );
        let theta1_rad: Vec<f64> = (0..4096).map(|step| TAU * f64::from(step) / 4096.0).collect();
        let start = Instant::now();
        for _ in 0..200 {
            for direction in Direction::BOTH {
                black_box(model.te_curve_rad(black_box(&theta1_rad), direction)).ok();
            }
        }
        let seconds = start.elapsed().as_secs_f64() / 200.0;
        println!(
            "exact contact, {name}, as a curve of 4096 angles x 2 senses: {:.1} us, {:.2} M tooth pairs/s, {:.2} M angles/s",
            seconds * 1e6,
            pairs as f64 / angles as f64 * 8192.0 / seconds / 1e6,
            8192.0 / seconds / 1e6
        );
    }
    Ok(())
}

/// One sample of a run: f, TE, bin sums.
fn samples(pair: &GearPair) {
    let conditions = RunConditions { direction: Direction::Ccw, load_nm: 10.0, speed_rpm: 5.0 };
    let count = 10_000_000_u32;
    let mut run = RunTe::new(AngleGrid::default(), conditions);
    let start = Instant::now();
    for n in 0..count {
        let theta1_rad = TAU * f64::from(n) / 120_000.0;
        black_box(run.push(pair, theta1_rad, theta1_rad));
    }
    println!("RunTe::push: {:.1} ns a sample", start.elapsed().as_secs_f64() * 1e9 / f64::from(count));
    let start = Instant::now();
    black_box(run.mean_curve());
    println!("RunTe::mean_curve of {} revolutions: {:.3} ms", run.revolutions(), start.elapsed().as_secs_f64() * 1e3);
}
