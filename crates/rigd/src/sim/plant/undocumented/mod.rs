//! Effects that the plant can have and the nominal model does not know. One file each: what it is, and how it enters
//! the plant.
//!
//! Sizes are those of a rig in need of attention: well above the noise, well below what one would see by eye. A new
//! effect is a file and a line in [`UNDOCUMENTED`].

use super::PlantSpec;

pub mod backlash_error;
pub mod centre_distance_error;
pub mod count_loss;
pub mod coupling_misalignment_output;
pub mod encoder1_eccentricity;
pub mod encoder1_ellipticity;
pub mod encoder2_eccentricity;
pub mod encoder2_ellipticity;
pub mod gear1_eccentricity;
pub mod gear2_eccentricity;
pub mod mesh_compliance;
pub mod shaft_compliance_input;
pub mod shaft_compliance_output;
pub mod slip;
pub mod thermal_drift;
pub mod time_skew;

/// Name, one-line summary with the size, and what puts the effect into a specification.
pub type Undocumented = (&'static str, &'static str, fn(&mut PlantSpec));

/// All effects, by the names under which the diagnosis knows them.
pub const UNDOCUMENTED: &[Undocumented] = &[
    ("gear1_eccentricity", "gear 1 sits 11 µm off the documented centre", gear1_eccentricity::apply),
    ("gear2_eccentricity", "gear 2 sits 11 µm off the documented centre", gear2_eccentricity::apply),
    ("centre_distance_error", "centre distance 30 µm too large", centre_distance_error::apply),
    ("backlash_error", "teeth 20 µm thinner than documented", backlash_error::apply),
    ("encoder1_eccentricity", "input encoder's disc off centre by 4e-5 of its radius", encoder1_eccentricity::apply),
    ("encoder2_eccentricity", "output encoder's disc off centre by 4e-5 of its radius", encoder2_eccentricity::apply),
    ("encoder1_ellipticity", "input encoder's disc out of round by 3e-5", encoder1_ellipticity::apply),
    ("encoder2_ellipticity", "output encoder's disc out of round by 3e-5", encoder2_ellipticity::apply),
    ("shaft_compliance_input", "input shaft softer by 4e-6 rad/(N·m)", shaft_compliance_input::apply),
    ("shaft_compliance_output", "output shaft softer by 6e-6 rad/(N·m)", shaft_compliance_output::apply),
    ("mesh_compliance", "mesh softer by 0.03 mm²·rad/(N·m)", mesh_compliance::apply),
    ("slip", "output clamp creeps 4 µrad per revolution and N·m above 4 N·m", slip::apply),
    ("count_loss", "output counter loses 24 counts about every 1.4 revolutions", count_loss::apply),
    ("time_skew", "output latched 60 µs late", time_skew::apply),
    ("thermal_drift", "centre distance grows 20 µm within minutes", thermal_drift::apply),
    ("coupling_misalignment_output", "output coupling bent by 0.8°", coupling_misalignment_output::apply),
];

#[cfg(test)]
mod tests {
    use super::super::Plant;
    use super::*;

    #[test]
    fn every_effect_changes_the_plant_and_leaves_it_buildable() {
        for (name, summary, apply) in UNDOCUMENTED {
            let mut spec = PlantSpec::default();
            apply(&mut spec);
            assert_ne!(spec, PlantSpec::default(), "{name}");
            assert!(!summary.is_empty());
            assert!(Plant::new(&spec, 10_000.0, 1).is_ok(), "{name}");
        }
    }

    #[test]
    fn names_are_unique_and_effects_combine() {
        let mut spec = PlantSpec::default();
        for (n, (name, _, apply)) in UNDOCUMENTED.iter().enumerate() {
            assert!(UNDOCUMENTED[..n].iter().all(|(other, ..)| other != name));
            apply(&mut spec);
        }
        assert!(Plant::new(&spec, 10_000.0, 1).is_ok());
    }
}
