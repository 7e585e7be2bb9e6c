//! Takes documented effects off runs: what slipped, wore or warmed in one run stays in the next.

use std::f64::consts::TAU;

use super::levels::levels;
use super::local_speed::{local_speeds, mean_speed};
use super::nominal::{Nominal, carried_by_line};
use super::reduce::ReducedRun;
use super::settings::ReductionSettings;
use gearmodel::effect::{OperatingPoint, RevolutionsByLoad, Term};

impl Nominal {
    /// Takes the documented effects off runs that are in order of time and share one clock: what slipped, wore or warmed in
    /// one run stays in the next.
    pub fn take_off_effects(&self, runs: &mut [ReducedRun], settings: &ReductionSettings) {
        let effects = &self.model().effects;
        let Some(rig) = effects.rig() else { return };
        let terms: Vec<&Term> = effects.terms().iter().filter(|term| !carried_by_line(term)).collect();
        let start_s = runs.iter().filter_map(|run| run.points.first()).map(|p| p.time_s).fold(f64::INFINITY, f64::min);
        let loads_nm = runs.iter().flat_map(|run| run.points.iter().map(|p| p.load_nm));
        let mut revolutions_by_load = RevolutionsByLoad::at_loads(&levels(loads_nm, settings.same_level));
        for run in runs {
            let set_point = run.direction.sign() * run.speed_rpm * TAU / 60.0;
            let mean = if run.points.len() > 1 { mean_speed(run) } else { set_point };
            let speeds = local_speeds(&run.points, mean, settings);
            let mut before_rad = run.points.first().map_or(0.0, |point| point.theta1_rad);
            for (point, speed_rad_per_s) in run.points.iter_mut().zip(speeds) {
                revolutions_by_load.turn(point.load_nm, (point.theta1_rad - before_rad) / TAU);
                before_rad = point.theta1_rad;
                let at = OperatingPoint {
                    load_nm: point.load_nm,
                    speed_rad_per_s,
                    time_s: point.time_s - start_s,
                    way_rev: revolutions_by_load.total_way_rev(),
                    revolutions_by_load,
                    ..rig.operating_point(point.theta1_rad, point.theta2_rad, run.direction)
                };
                point.rho_rad -= terms.iter().map(|term| term.te_rad(rig, &at)).sum::<f64>();
            }
        }
    }
}
