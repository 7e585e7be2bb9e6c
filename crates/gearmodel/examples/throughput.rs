//! How fast the hot paths are on this machine: `cargo run --release -p gearmodel --example throughput`.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use gearmodel::measure::{AngleGrid, RunConditions, RunTe};
use gearmodel::{Direction, EllipticalSpec, GearPair, GeometryError};

fn main() -> Result<(), GeometryError> {
    let pair = GearPair::elliptical(&EllipticalSpec::default())?;
    samples(&pair);
    Ok(())
}

/// One sample of a run: f, TE, bin sums.
fn samples(pair: &GearPair) {
    let conditions = RunConditions {
        direction: Direction::Ccw,
        load_nm: 10.0,
        speed_rpm: 5.0,
    };
    let count = 10_000_000_u32;
    let mut run = RunTe::new(AngleGrid::default(), conditions);
    let start = Instant::now();
    for n in 0..count {
        let theta1_rad = TAU * f64::from(n) / 120_000.0;
        black_box(run.push(pair, theta1_rad, theta1_rad));
    }
    println!(
        "RunTe::push: {:.1} ns a sample",
        start.elapsed().as_secs_f64() * 1e9 / f64::from(count)
    );
    let start = Instant::now();
    black_box(run.mean_curve());
    println!(
        "RunTe::mean_curve of {} revolutions: {:.3} ms",
        run.revolutions(),
        start.elapsed().as_secs_f64() * 1e3
    );
}
