//! The whole rig: statics, motion, limits, effects.

mod drive_train;
mod effects;
mod motion;
mod statics;
mod tooth_errors;

use super::*;

/// A rig without anything random, turning at `driver_rpm` under a brake current, settled.
fn turning(spec: &PlantSpec, driver_rpm: f64, current_a: f64) -> Plant {
    let mut plant = Plant::new(spec, 10_000.0, 11).unwrap();
    plant.set_enabled(true);
    plant.set_speed_reference_rpm(driver_rpm * spec.drive.reduction);
    plant.set_drive(current_a > 0.0, current_a, 60.0);
    run(&mut plant, 4.0);
    plant
}

/// Lets the rig run for a while.
fn run(plant: &mut Plant, seconds: f64) {
    let end = plant.time_s() + seconds;
    while plant.time_s() < end {
        plant.step();
    }
}

/// RMS of the values about their mean, and the mean.
fn spread(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64;
    (square.sqrt(), mean)
}

/// The true state at `count` instants over one driver turn of 5 rpm.
fn turn_of_truth(plant: &mut Plant, count: usize) -> Vec<Truth> {
    (0..count)
        .map(|_| {
            run(plant, 12.0 / count as f64);
            plant.truth()
        })
        .collect()
}
