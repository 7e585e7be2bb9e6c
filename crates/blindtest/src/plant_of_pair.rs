//! The simulated rig of a nominal pair: this crate and the daemon know both, the plant knows no model and the model no plant.

use gearmodel::NominalModel;
use gearmodel::pitch_curve::AnyCurve;
use rigsim::plant::PlantSpec;
use thiserror::Error;

/// The pair is of a kind that the plant cannot turn.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("simulated rig: a pair of kind '{kind}' has no simulated gears; elliptical and circular pairs have")]
pub struct NoSimulatedGears {
    /// The kind.
    pub kind: &'static str,
}

/// A sound plant with the gears and documented errors of a nominal pair.
///
/// # Errors
/// [`NoSimulatedGears`] for a kind of pair that the plant has not.
pub fn plant_of_pair(model: &NominalModel) -> Result<PlantSpec, NoSimulatedGears> {
    let (pair, errors) = (&model.pair, &model.errors);
    let mut spec = PlantSpec::default();
    let eccentricity = match pair.pitch_curve() {
        AnyCurve::Ellipse(ellipse) => ellipse.eccentricity(),
        AnyCurve::Circle(_) if pair.has_teeth() => 0.0,
        _ => return Err(NoSimulatedGears { kind: pair.kind() }),
    };
    let gears = &mut spec.gears;
    gears.module_mm = pair.module_mm();
    gears.teeth = [pair.teeth().0, pair.teeth().1];
    gears.eccentricity = eccentricity;
    gears.pressure_angle_deg = pair.pressure_angle_rad().to_degrees();
    gears.backlash_mm = pair.backlash_mm();
    gears.e1_mm = errors.e1_mm;
    gears.phi1_rad = errors.phi1_rad;
    gears.e2_mm = errors.e2_mm;
    gears.phi2_rad = errors.phi2_rad;
    spec.shafts.compliance_output_rad_per_nm = errors.shaft_compliance_output_rad_per_nm;
    spec.shafts.compliance_input_rad_per_nm = errors.shaft_compliance_input_rad_per_nm;
    spec.mesh.compliance_mm2_rad_per_nm = errors.mesh_compliance_mm2_rad_per_nm;
    spec.teeth.addendum = pair.addendum();
    Ok(spec)
}
