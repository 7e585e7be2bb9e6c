//! Effects that the plant can have and the nominal model does not know. One file each: what it is, its usual size, how it is drawn,
//! and how it enters the plant.
//!
//! Usual sizes are those of a rig in need of attention: well above the noise, well below what one would see by eye. Names, parameters,
//! signs and phases are those under which the diagnosis reports them. A new effect is a file and a line in [`UNDOCUMENTED`]; what the
//! diagnosis shall not know by name goes into [`outside`].

use super::PlantSpec;

pub mod backlash_error;
pub mod bearing_clearance;
pub mod bearing_compliance;
pub mod brake_torque_ripple;
pub mod centre_distance_error;
pub mod count_loss;
pub mod coupling_misalignment_input;
pub mod coupling_misalignment_output;
pub mod encoder1_eccentricity;
pub mod encoder1_ellipticity;
pub mod encoder1_interpolation;
pub mod encoder2_eccentricity;
pub mod encoder2_ellipticity;
pub mod encoder2_interpolation;
pub mod friction_windup;
pub mod gear1_eccentricity;
pub mod gear2_eccentricity;
pub mod mesh_compliance;
pub mod mesh_stiffness_variation;
pub mod outside;
mod parameters;
pub mod phasing_error;
pub mod pitch_curve_error;
pub mod pitch_errors;
pub mod profile_error;
mod rng;
pub mod shaft_compliance_input;
pub mod shaft_compliance_output;
pub mod slip;
pub mod thermal_drift;
pub mod time_skew;
pub mod tooth_damage;
pub mod torsional_resonance;
pub mod wear_drift;

pub use outside::OUTSIDE;
pub use parameters::{Parameters, Value};
pub use rng::FaultRng;

/// An effect of the plant.
#[derive(Debug, Clone, Copy)]
pub struct Undocumented {
    /// The name under which the diagnosis knows it.
    pub name: &'static str,
    /// A line with its usual size.
    pub summary: &'static str,
    /// Its parameters at the usual size on a plant.
    pub usual: fn(&PlantSpec) -> Parameters,
    /// Its parameters about the usual size, phases and places at random.
    pub draw: fn(&PlantSpec, &mut FaultRng) -> Parameters,
    /// The parameters that carry its size, and the power of the size with which each goes.
    pub amounts: &'static [(&'static str, f64)],
    /// Whether what it adds changes from revolution to revolution.
    pub develops: bool,
    /// Puts it into a plant.
    pub apply: fn(&mut PlantSpec, &Parameters),
}

impl Undocumented {
    /// Puts the effect into a plant at its usual size.
    pub fn apply_usual(&self, spec: &mut PlantSpec) {
        let parameters = (self.usual)(spec);
        (self.apply)(spec, &parameters);
    }
}

/// All effects that the diagnosis knows.
pub const UNDOCUMENTED: &[Undocumented] = &[
    gear1_eccentricity::EFFECT,
    gear2_eccentricity::EFFECT,
    centre_distance_error::EFFECT,
    backlash_error::EFFECT,
    pitch_curve_error::EFFECT,
    phasing_error::EFFECT,
    pitch_errors::EFFECT,
    profile_error::EFFECT,
    tooth_damage::EFFECT,
    encoder1_eccentricity::EFFECT,
    encoder2_eccentricity::EFFECT,
    encoder1_ellipticity::EFFECT,
    encoder2_ellipticity::EFFECT,
    encoder1_interpolation::EFFECT,
    encoder2_interpolation::EFFECT,
    coupling_misalignment_input::EFFECT,
    coupling_misalignment_output::EFFECT,
    time_skew::EFFECT,
    count_loss::EFFECT,
    shaft_compliance_input::EFFECT,
    shaft_compliance_output::EFFECT,
    mesh_compliance::EFFECT,
    bearing_compliance::EFFECT,
    mesh_stiffness_variation::EFFECT,
    bearing_clearance::EFFECT,
    friction_windup::EFFECT,
    slip::EFFECT,
    brake_torque_ripple::EFFECT,
    torsional_resonance::EFFECT,
    thermal_drift::EFFECT,
    wear_drift::EFFECT,
];

/// The effect of this name, within the library or outside it.
#[must_use]
pub fn find(name: &str) -> Option<&'static Undocumented> {
    UNDOCUMENTED.iter().chain(OUTSIDE).find(|effect| effect.name == name)
}

#[cfg(test)]
mod tests {
    use super::super::Plant;
    use super::*;

    #[test]
    fn every_effect_changes_the_plant_and_leaves_it_buildable() {
        for effect in UNDOCUMENTED.iter().chain(OUTSIDE) {
            let mut spec = PlantSpec::default();
            effect.apply_usual(&mut spec);
            assert_ne!(spec, PlantSpec::default(), "{}", effect.name);
            assert!(!effect.summary.is_empty());
            assert!(Plant::new(&spec, 10_000.0, 1).is_ok(), "{}", effect.name);
            let mut drawn = PlantSpec::default();
            let parameters = (effect.draw)(&drawn, &mut FaultRng::new(5));
            (effect.apply)(&mut drawn, &parameters);
            assert!(Plant::new(&drawn, 10_000.0, 1).is_ok(), "{}", effect.name);
        }
    }

    #[test]
    fn no_amount_is_no_effect() {
        for effect in UNDOCUMENTED.iter().chain(OUTSIDE) {
            // A count cannot be lost by halves, a coupling cannot be infinitely stiff.
            if ["count_loss", "torsional_resonance"].contains(&effect.name) {
                continue;
            }
            let spec = PlantSpec::default().quiet();
            let mut none = spec.clone();
            (effect.apply)(&mut none, &(effect.usual)(&spec).scaled(effect.amounts, 1e-12));
            let samples = |spec: &PlantSpec| {
                let mut plant = Plant::new(spec, 1000.0, 1).unwrap();
                plant.set_enabled(true);
                plant.set_speed_reference_rpm(100.0);
                plant.set_drive(true, 0.4, 60.0);
                let truth = |plant: &Plant| plant.truth().transmission_error_rad;
                (0..3000).map(|_| (plant.step(), truth(&plant))).last()
            };
            let ((a, te_a), (b, te_b)) = (samples(&spec).unwrap(), samples(&none).unwrap());
            assert!((te_a - te_b).abs() < 1e-9, "{}: {te_a} {te_b}", effect.name);
            assert!((a.output_counts - b.output_counts).abs() <= 1, "{}", effect.name);
        }
    }

    #[test]
    fn names_are_unique_and_effects_combine() {
        let mut spec = PlantSpec::default();
        let all: Vec<&Undocumented> = UNDOCUMENTED.iter().chain(OUTSIDE).collect();
        for (n, effect) in all.iter().enumerate() {
            assert!(all[..n].iter().all(|other| other.name != effect.name));
            effect.apply_usual(&mut spec);
        }
        assert!(Plant::new(&spec, 10_000.0, 1).is_ok());
    }
}
