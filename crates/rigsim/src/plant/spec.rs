//! What the simulated rig is made of.

use super::brake::BrakeSpec;
use super::encoder::EncodersSpec;
use super::error::{PlantError, in_range};
use super::geometry::GearSpec;
use super::mesh::{BearingSpec, HousingSpec, MeshSpec};
use super::reading_error::ReadingError;
use super::run_out::NoiseSpec;
use super::servo::DriveSpec;
use super::slippage::ClampSpec;
use super::teeth::ToothSpec;

/// Default compliance of the shaft from the input encoder to gear 1, rad/(N·m).
pub const DEFAULT_SHAFT_COMPLIANCE_INPUT_RAD_PER_NM: f64 = 5e-6;
/// Default compliance of the shaft from gear 2 to the output encoder, rad/(N·m).
pub const DEFAULT_SHAFT_COMPLIANCE_OUTPUT_RAD_PER_NM: f64 = 8e-6;

/// Shafts, gears as bodies, and couplings.
#[derive(Debug, Clone, PartialEq)]
pub struct ShaftSpec {
    /// Compliance from the input encoder to gear 1, rad/(N·m).
    pub compliance_input_rad_per_nm: f64,
    /// Compliance from gear 2 to the output encoder, rad/(N·m).
    pub compliance_output_rad_per_nm: f64,
    /// Compliance of the coupling between the output encoder and the brake, rad/(N·m); TE does not see it.
    pub compliance_brake_rad_per_nm: f64,
    /// Damping of the shafts in parts of their stiffness, s.
    pub damping_time_s: f64,
    /// Damping of the brake's coupling in parts of its stiffness, s.
    pub brake_damping_time_s: f64,
    /// Inertia of gear 1, kg·m².
    pub gear1_inertia_kg_m2: f64,
    /// Inertia of gear 2, kg·m².
    pub gear2_inertia_kg_m2: f64,
    /// Inertia of the output encoder's disc and its shaft, kg·m².
    pub disc_inertia_kg_m2: f64,
    /// Viscous friction of the bearings of either gear, N·m·s/rad.
    pub bearing_nm_s_per_rad: f64,
    /// Angle of a Cardan joint in the output shaft, rad; 0 is a straight coupling.
    pub output_cardan_angle_rad: f64,
    /// Phase of the joint, rad: to first order the output gains tan²(β/2) sin(2θ2 − phase).
    pub output_cardan_phase_rad: f64,
    /// Angle of a Cardan joint in the input shaft, between encoder and gear 1, rad; 0 is a straight coupling.
    pub input_cardan_angle_rad: f64,
    /// Phase of the joint, rad: to first order gear 1 gains tan²(β/2) sin(2θ1 − phase).
    pub input_cardan_phase_rad: f64,
    /// Dry drag of the seal at the output encoder, N·m: twists every shaft before it and is no load that the brake knows.
    pub seal_drag_nm: f64,
}

impl Default for ShaftSpec {
    fn default() -> Self {
        Self {
            compliance_input_rad_per_nm: DEFAULT_SHAFT_COMPLIANCE_INPUT_RAD_PER_NM,
            compliance_output_rad_per_nm: DEFAULT_SHAFT_COMPLIANCE_OUTPUT_RAD_PER_NM,
            compliance_brake_rad_per_nm: 5e-5,
            damping_time_s: 1e-5,
            brake_damping_time_s: 2e-4,
            gear1_inertia_kg_m2: 0.009,
            gear2_inertia_kg_m2: 0.009,
            disc_inertia_kg_m2: 0.002,
            bearing_nm_s_per_rad: 1e-3,
            output_cardan_angle_rad: 0.0,
            output_cardan_phase_rad: 0.0,
            input_cardan_angle_rad: 0.0,
            input_cardan_phase_rad: 0.0,
            seal_drag_nm: 0.0,
        }
    }
}

impl ShaftSpec {
    fn validate(&self) -> Result<(), PlantError> {
        let compliance = (0.0, 0.1);
        let hint = "a stiff shaft has 1e-6, a soft one 1e-3, a rigid one 0";
        in_range(
            "shafts.compliance_input_rad_per_nm",
            self.compliance_input_rad_per_nm,
            "rad/(N·m)",
            compliance,
            hint,
        )?;
        in_range(
            "shafts.compliance_output_rad_per_nm",
            self.compliance_output_rad_per_nm,
            "rad/(N·m)",
            compliance,
            hint,
        )?;
        in_range(
            "shafts.compliance_brake_rad_per_nm",
            self.compliance_brake_rad_per_nm,
            "rad/(N·m)",
            compliance,
            hint,
        )?;
        in_range("shafts.damping_time_s", self.damping_time_s, "s", (0.0, 0.1), "damping over stiffness")?;
        in_range("shafts.brake_damping_time_s", self.brake_damping_time_s, "s", (0.0, 0.1), "damping over stiffness")?;
        let inertia = (1e-5, 100.0);
        in_range("shafts.gear1_inertia_kg_m2", self.gear1_inertia_kg_m2, "kg·m²", inertia, "of gear 1")?;
        in_range("shafts.gear2_inertia_kg_m2", self.gear2_inertia_kg_m2, "kg·m²", inertia, "of gear 2")?;
        in_range("shafts.disc_inertia_kg_m2", self.disc_inertia_kg_m2, "kg·m²", inertia, "of the disc and its shaft")?;
        in_range("shafts.bearing_nm_s_per_rad", self.bearing_nm_s_per_rad, "N·m·s/rad", (0.0, 100.0), "viscous")?;
        let (bent, phase) = ((-0.5, 0.5), (-1e6, 1e6));
        in_range("shafts.output_cardan_angle_rad", self.output_cardan_angle_rad, "rad", bent, "under 0.5 rad")?;
        in_range("shafts.output_cardan_phase_rad", self.output_cardan_phase_rad, "rad", phase, "give a finite angle")?;
        in_range("shafts.input_cardan_angle_rad", self.input_cardan_angle_rad, "rad", bent, "under 0.5 rad")?;
        in_range("shafts.input_cardan_phase_rad", self.input_cardan_phase_rad, "rad", phase, "give a finite angle")?;
        in_range("shafts.seal_drag_nm", self.seal_drag_nm, "N·m", (0.0, 20.0), "dry drag at the output encoder")
    }
}

/// The whole rig. The default is the source document's pair on a rig whose compliances are known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlantSpec {
    /// The gear pair as made and mounted.
    pub gears: GearSpec,
    /// Stiffness of the teeth.
    pub mesh: MeshSpec,
    /// Errors, damage and wear of the teeth.
    pub teeth: ToothSpec,
    /// Bearings that give way or have play.
    pub bearings: BearingSpec,
    /// Servo drive.
    pub drive: DriveSpec,
    /// Shafts and inertias.
    pub shafts: ShaftSpec,
    /// Powder brake.
    pub brake: BrakeSpec,
    /// Encoders and counters.
    pub encoders: EncodersSpec,
    /// Random disturbances of the mechanics.
    pub noise: NoiseSpec,
    /// Clamp of the output encoder's shaft.
    pub clamp: ClampSpec,
    /// Housing that may grow.
    pub housing: HousingSpec,
    /// Displacements of the output's reading that no known effect makes.
    pub reading_errors: Vec<ReadingError>,
}

impl PlantSpec {
    /// The same rig without anything random: no reading noise, run-out, stick-slip or velocity ripple.
    #[must_use]
    pub fn quiet(mut self) -> Self {
        self.encoders.input.noise_rad = 0.0;
        self.encoders.output.noise_rad = 0.0;
        self.noise.run_out_rms_mm = 0.0;
        self.noise.slow_run_out_rms_mm = 0.0;
        self.brake.stick_slip_ratio = 0.0;
        self.drive.ripple.clear();
        self
    }

    /// Refuses what is outside the range in which the plant is meaningful, by name.
    ///
    /// # Errors
    /// The first [`PlantError`] found.
    pub fn validate(&self) -> Result<(), PlantError> {
        self.gears.validate()?;
        self.mesh.validate()?;
        self.teeth.validate(&self.gears, self.mesh.compliance_mm2_rad_per_nm)?;
        self.bearings.validate()?;
        self.reading_errors.iter().try_for_each(ReadingError::validate)?;
        self.drive.validate()?;
        self.shafts.validate()?;
        self.brake.validate()?;
        self.encoders.validate()?;
        self.noise.validate()?;
        self.clamp.validate()?;
        self.housing.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_a_nonsense_value_is_named() {
        assert_eq!(PlantSpec::default().validate(), Ok(()));
        let mut spec = PlantSpec::default();
        spec.shafts.compliance_output_rad_per_nm = -1.0;
        let message = spec.validate().unwrap_err().to_string();
        assert!(message.contains("shafts.compliance_output_rad_per_nm is -1 rad/(N·m)"), "{message}");
    }
}
