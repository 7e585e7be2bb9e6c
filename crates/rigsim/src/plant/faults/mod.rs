//! Faults that the plant can have and the nominal model does not know, a file a family. Each says what it is, its usual size, how it
//! is drawn, what it does in truth, and how it enters the plant.
//!
//! Usual sizes are those of a rig in need of attention: well above the noise, well below what one would see by eye. Names, parameters,
//! signs and phases are those under which the diagnosis reports them. A new fault is an entry in its family's file and a line in
//! [`FAULTS`]; what the diagnosis shall not know by name goes into [`UNMODELLED_FAULTS`]. The order of both lists is part of every
//! withheld case that was ever drawn: new faults come last.

mod compliance;
mod counters;
mod couplings;
mod drifts;
mod encoder_disc;
mod encoder_interpolation;
mod fault;
mod fault_rng;
mod mounting;
mod parameters;
mod signature;
mod tooth_form;
mod torques;
mod unmodelled;

pub use fault::Fault;
pub use fault_rng::FaultRng;
pub use parameters::{Parameters, Value};
pub use signature::{Accumulation, Carrier, Parity, Signature};
pub use unmodelled::UNMODELLED_FAULTS;

/// All faults that the diagnosis knows.
pub const FAULTS: &[Fault] = &[
    mounting::GEAR1_ECCENTRICITY,
    mounting::GEAR2_ECCENTRICITY,
    mounting::CENTRE_DISTANCE_ERROR,
    tooth_form::BACKLASH_ERROR,
    tooth_form::PITCH_CURVE_ERROR,
    mounting::PHASING_ERROR,
    tooth_form::PITCH_ERRORS,
    tooth_form::PROFILE_ERROR,
    tooth_form::TOOTH_DAMAGE,
    encoder_disc::INPUT_ECCENTRICITY,
    encoder_disc::OUTPUT_ECCENTRICITY,
    encoder_disc::INPUT_ELLIPTICITY,
    encoder_disc::OUTPUT_ELLIPTICITY,
    encoder_interpolation::INPUT,
    encoder_interpolation::OUTPUT,
    couplings::INPUT_MISALIGNMENT,
    couplings::OUTPUT_MISALIGNMENT,
    counters::TIME_SKEW,
    counters::COUNT_LOSS,
    compliance::INPUT_SHAFT,
    compliance::OUTPUT_SHAFT,
    compliance::MESH,
    compliance::BEARING,
    compliance::MESH_STIFFNESS_VARIATION,
    mounting::BEARING_CLEARANCE,
    torques::FRICTION_WINDUP,
    couplings::SLIP,
    torques::BRAKE_TORQUE_RIPPLE,
    couplings::TORSIONAL_RESONANCE,
    drifts::THERMAL_DRIFT,
    drifts::WEAR_DRIFT,
];

/// The fault of this name, known to the diagnosis or not.
#[must_use]
pub fn find(name: &str) -> Option<&'static Fault> {
    FAULTS.iter().chain(UNMODELLED_FAULTS).find(|fault| fault.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Plant, PlantSpec};

    #[test]
    fn every_fault_changes_the_plant_and_leaves_it_buildable() {
        for fault in FAULTS.iter().chain(UNMODELLED_FAULTS) {
            let mut spec = PlantSpec::default();
            fault.apply_usual(&mut spec);
            assert_ne!(spec, PlantSpec::default(), "{}", fault.name);
            assert!(!fault.summary.is_empty());
            assert!(Plant::new(&spec, 10_000.0, 1).is_ok(), "{}", fault.name);
            let mut drawn = PlantSpec::default();
            let parameters = fault.draw(&drawn, &mut FaultRng::new(5));
            (fault.apply)(&mut drawn, &parameters);
            assert!(Plant::new(&drawn, 10_000.0, 1).is_ok(), "{}", fault.name);
        }
    }

    #[test]
    fn no_amount_is_no_fault() {
        for fault in FAULTS.iter().chain(UNMODELLED_FAULTS) {
            // A count cannot be lost by halves, a coupling cannot be infinitely stiff.
            if ["count_loss", "torsional_resonance"].contains(&fault.name) {
                continue;
            }
            let spec = PlantSpec::default().quiet();
            let mut none = spec.clone();
            (fault.apply)(&mut none, &(fault.usual)(&spec).scaled(fault.amounts, 1e-12));
            let samples = |spec: &PlantSpec| {
                let mut plant = Plant::new(spec, 1000.0, 1).unwrap();
                plant.set_enabled(true);
                plant.set_speed_reference_rpm(100.0);
                plant.set_drive(true, 0.4, 60.0);
                let truth = |plant: &Plant| plant.truth().transmission_error_rad;
                (0..3000).map(|_| (plant.step(), truth(&plant))).last()
            };
            let ((a, te_a), (b, te_b)) = (samples(&spec).unwrap(), samples(&none).unwrap());
            assert!((te_a - te_b).abs() < 1e-9, "{}: {te_a} {te_b}", fault.name);
            assert!((a.output_counts - b.output_counts).abs() <= 1, "{}", fault.name);
        }
    }

    #[test]
    fn names_are_unique_and_faults_combine() {
        let mut spec = PlantSpec::default();
        let all: Vec<&Fault> = FAULTS.iter().chain(UNMODELLED_FAULTS).collect();
        for (n, fault) in all.iter().enumerate() {
            assert!(all[..n].iter().all(|other| other.name != fault.name));
            fault.apply_usual(&mut spec);
        }
        assert!(Plant::new(&spec, 10_000.0, 1).is_ok());
    }

    #[test]
    fn traces_are_shared_with_faults_that_there_are() {
        for fault in FAULTS {
            let first = fault.same_trace_as.map(|name| find(name).unwrap());
            // The first of those that share a trace names no other.
            assert!(first.is_none_or(|first| first.same_trace_as.is_none()), "{}", fault.name);
        }
        let alike = |a: &str, b: &str| find(a).unwrap().is_confusable_with(find(b).unwrap());
        assert!(alike("encoder2_eccentricity", "phasing_error") && alike("slip", "slip"));
        assert!(!alike("encoder1_ellipticity", "encoder2_ellipticity"));
    }
}
