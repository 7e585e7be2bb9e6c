//! TE under load: shafts, bearings, teeth, and how the pairs in contact share the force.
//!
//! A torque T on the driven shaft presses the flanks together with F = 1000 T/(r2 cos(α ∓ μ)) along the common normal (T in
//! N·m, arm in mm). The pairs within their tips are springs in parallel, each with its own gap behind the most advanced one:
//! Σ max(0, δ − g_j)/q_j(F_j) = F. Bearings give c_b F and their clearance; shafts wind up by C_out T and C_in i21² T. All of
//! it is a lag in the sense of motion:
//!
//! TE = TE_rigid − dir·[ (δ + c_b F + c)/(r2 cos(α ∓ μ)) + T (C_out + C_in i21²) ].
//!
//! A quasi-static elastic system does not accumulate: this TE is the same after every turn, whatever the load.

mod tooth_stiffness;

pub use tooth_stiffness::Material;

use tooth_stiffness::ToothStiffness;

use crate::contact::{ContactError, ContactModel, PairTouch};
use crate::gear::Gear;
use crate::geometry_error::check_range;
use crate::increment::common_normal;
use crate::{Direction, GearPair, GeometryError, MeshPoint};

/// What gives way beside the teeth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Supports {
    /// Compliance of the driven shaft, rad/(N·m).
    pub shaft_compliance_output_rad_per_nm: f64,
    /// Compliance of the driving shaft, rad/(N·m).
    pub shaft_compliance_input_rad_per_nm: f64,
    /// Compliance of both gears' bearings along the common normal, mm/N.
    pub bearing_compliance_mm_per_n: f64,
    /// Clearance of both gears' bearings taken up along the common normal once there is a load, mm.
    pub bearing_clearance_mm: f64,
}

/// A gear pair under load.
#[derive(Clone, Debug)]
pub struct LoadedModel {
    contact: ContactModel,
    supports: Supports,
    teeth: ToothStiffness,
}

/// State of the mesh at one angle and load.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedMesh {
    /// TE, rad.
    pub te_rad: f64,
    /// Force along the common normal, N.
    pub force_n: f64,
    /// Approach of the gears along the normal by the teeth alone, mm.
    pub tooth_deflection_mm: f64,
    /// (driver tooth, force N) of the pairs within their tips.
    pub shares: Vec<(i64, f64)>,
}

/// Largest torque accepted, N·m.
const MAX_LOAD_NM: f64 = 1e7;
/// Rounds of the force distribution with the contact's compliance at the last forces.
const ROUNDS: usize = 6;

impl LoadedModel {
    /// A pair in contact with elastic teeth and supports.
    ///
    /// # Errors
    /// [`GeometryError`] when the teeth cannot be cut (their section would not be known), or a compliance or the material is out
    /// of range.
    pub fn new(contact: ContactModel, supports: Supports, material: Material) -> Result<Self, GeometryError> {
        let pair = contact.pair();
        if !pair.has_teeth() {
            return Err(GeometryError::NoTeeth);
        }
        pair.check_teeth()?;
        let stiff = "a compliance cannot be negative";
        for (quantity, value, unit) in [
            ("shaft_compliance_output_rad_per_nm", supports.shaft_compliance_output_rad_per_nm, "rad/(N.m)"),
            ("shaft_compliance_input_rad_per_nm", supports.shaft_compliance_input_rad_per_nm, "rad/(N.m)"),
            ("bearing_compliance_mm_per_n", supports.bearing_compliance_mm_per_n, "mm/N"),
            ("bearing_clearance_mm", supports.bearing_clearance_mm, "mm"),
        ] {
            check_range(quantity, value, unit, (0.0, 1e3), stiff)?;
        }
        let steel = "steel has 206 000 N/mm2";
        check_range("youngs_modulus_n_per_mm2", material.youngs_modulus_n_per_mm2, "N/mm2", (1.0, 1e7), steel)?;
        check_range("poisson", material.poisson, "", (0.0, 0.49), "steel has 0.3")?;
        let measured = "ISO 6336-1 takes 0.8";
        check_range("stiffness_correction", material.stiffness_correction, "", (0.1, 2.0), measured)?;
        Ok(Self { supports, teeth: ToothStiffness::of(pair, material), contact })
    }

    /// The rigid contact below.
    #[must_use]
    pub fn contact(&self) -> &ContactModel {
        &self.contact
    }

    /// TE at θ1 under a torque on the driven shaft, rad.
    ///
    /// # Errors
    /// [`ContactError`] when no teeth touch there, or for a load that is not in 0 to 10⁷ N·m.
    pub fn te_rad(&self, theta1_rad: f64, direction: Direction, load_nm: f64) -> Result<f64, ContactError> {
        Ok(self.mesh(theta1_rad, direction, load_nm)?.te_rad)
    }

    /// Backlash at θ1 under load, rad: TE_cw − TE_ccw.
    ///
    /// # Errors
    /// As [`LoadedModel::te_rad`].
    pub fn backlash_rad(&self, theta1_rad: f64, load_nm: f64) -> Result<f64, ContactError> {
        Ok(self.te_rad(theta1_rad, Direction::Cw, load_nm)? - self.te_rad(theta1_rad, Direction::Ccw, load_nm)?)
    }

    /// TE, force, deflection and load sharing at θ1 under a torque on the driven shaft.
    ///
    /// # Errors
    /// As [`LoadedModel::te_rad`].
    pub fn mesh(&self, theta1_rad: f64, direction: Direction, load_nm: f64) -> Result<LoadedMesh, ContactError> {
        if !(0.0..=MAX_LOAD_NM).contains(&load_nm) {
            return Err(ContactError::Load { load_nm, limit_nm: MAX_LOAD_NM });
        }
        let mut pairs: Vec<PairTouch> = Vec::with_capacity(4);
        self.contact.for_each_pair(theta1_rad, direction, |pair| pairs.push(pair))?;
        let dir = direction.sign();
        let rigid_rad = pairs
            .iter()
            .map(|pair| dir * pair.psi2_rad)
            .max_by(f64::total_cmp)
            .ok_or(ContactError::NoPairInZone { theta1_rad, direction })?;
        let pair = self.contact.pair();
        let at = pair.at(theta1_rad);
        let arm_mm = common_normal::driven_base_arm_mm(pair, &at, direction);
        let force_n = 1000.0 * load_nm / arm_mm;
        let gaps_mm: Vec<f64> = pairs.iter().map(|touch| (rigid_rad - dir * touch.psi2_rad) * arm_mm).collect();
        let (tooth_deflection_mm, forces_n) = self.share(&at, direction, force_n, &pairs, &gaps_mm);
        let supports = &self.supports;
        let clearance_mm = if load_nm > 0.0 { supports.bearing_clearance_mm } else { 0.0 };
        let normal_mm = tooth_deflection_mm + supports.bearing_compliance_mm_per_n * force_n + clearance_mm;
        let windup_rad = load_nm
            * (supports.shaft_compliance_output_rad_per_nm
                + supports.shaft_compliance_input_rad_per_nm * at.ratio * at.ratio);
        Ok(LoadedMesh {
            te_rad: dir * rigid_rad - at.theta2_rad - dir * (normal_mm / arm_mm + windup_rad),
            force_n,
            tooth_deflection_mm,
            shares: pairs.iter().map(|touch| touch.tooth).zip(forces_n).collect(),
        })
    }

    /// Mean stiffness of the mesh over a pitch around θ1 per face width, N/(mm·µm), at a torque: the force over the mean
    /// deflection, as c_γ of ISO 6336 is meant.
    ///
    /// # Errors
    /// As [`LoadedModel::te_rad`].
    pub fn mesh_stiffness_n_per_mm_um(
        &self,
        theta1_rad: f64,
        direction: Direction,
        load_nm: f64,
    ) -> Result<f64, ContactError> {
        let pair = self.contact.pair();
        let arc_mm = pair.arc_length_mm(theta1_rad);
        let pitch_mm = std::f64::consts::PI * pair.module_mm();
        let steps = 64;
        let mut stiffness = 0.0;
        for step in 0..steps {
            let theta = pair.theta1_at_arc_length(arc_mm + pitch_mm * f64::from(step) / f64::from(steps));
            let mesh = self.mesh(theta, direction, load_nm)?;
            stiffness += mesh.force_n / mesh.tooth_deflection_mm / f64::from(steps);
        }
        Ok(stiffness / pair.face_width_mm() / 1000.0)
    }

    /// Deflection δ of the mesh and the forces of its pairs: Σ max(0, δ − g_j)/q_j = F, with the contacts' compliance at the
    /// forces of the round before.
    fn share(
        &self,
        at: &MeshPoint,
        direction: Direction,
        force_n: f64,
        pairs: &[PairTouch],
        gaps_mm: &[f64],
    ) -> (f64, Vec<f64>) {
        let mut forces_n = vec![force_n / pairs.len() as f64; pairs.len()];
        if force_n == 0.0 {
            return (0.0, forces_n);
        }
        let pair = self.contact.pair();
        let mut deflection_mm = 0.0;
        for _ in 0..ROUNDS {
            let stiffness: Vec<f64> = pairs
                .iter()
                .zip(&forces_n)
                .map(|(touch, force)| {
                    let radius_mm = relative_radius_mm(pair, at, touch, direction);
                    // A pair that carries nothing yet is as stiff as under a hundredth of the load.
                    let force = force.max(0.01 * force_n);
                    1.0 / self.teeth.compliance_mm_per_n(pair, touch.tooth, touch.phase, direction, force, radius_mm)
                })
                .collect();
            // Pairs close in the order of their gaps: try the first, the first two, …
            let mut order: Vec<usize> = (0..pairs.len()).collect();
            order.sort_by(|a, b| gaps_mm[*a].total_cmp(&gaps_mm[*b]));
            let (mut sum, mut moment) = (0.0, 0.0);
            for (n, index) in order.iter().enumerate() {
                sum += stiffness[*index];
                moment += stiffness[*index] * gaps_mm[*index];
                deflection_mm = (force_n + moment) / sum;
                if order.get(n + 1).is_none_or(|next| gaps_mm[*next] >= deflection_mm) {
                    break;
                }
            }
            for (index, force) in forces_n.iter_mut().enumerate() {
                *force = stiffness[index] * (deflection_mm - gaps_mm[index]).max(0.0);
            }
        }
        (deflection_mm, forces_n)
    }
}

/// Relative radius of curvature of the flanks of a pair, mm: ρ_i sin α ± d cos α on either gear (see
/// [`GearPair::check_teeth`]), at the common rolling position.
fn relative_radius_mm(pair: &GearPair, at: &MeshPoint, touch: &PairTouch, direction: Direction) -> f64 {
    let roll = pair.roll(at.theta1_rad);
    let (sin, cos) = pair.pressure_angle_rad().sin_cos();
    let shift_mm = direction.sign() * touch.phase * std::f64::consts::PI * pair.module_mm() * cos;
    let curvature = |gear: Gear, sign: f64| 1.0 / (sin / pair.pitch_curvature(gear, &roll) + sign * shift_mm);
    let sum = curvature(Gear::Driver, 1.0) + curvature(Gear::Driven, -1.0);
    if sum > 0.0 { 1.0 / sum } else { 1e6 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::contact::ToothErrors;
    use crate::{CircularSpec, EllipticalSpec, Errors};

    fn model(pair: GearPair, errors: &Errors, supports: Supports) -> LoadedModel {
        LoadedModel::new(ContactModel::new(pair, errors).unwrap(), supports, Material::default()).unwrap()
    }

    #[test]
    fn mesh_stiffness_lies_in_the_standards_bracket() {
        let spec = CircularSpec { module_mm: 2.0, teeth: (62, 62), face_width_mm: 20.0, ..Default::default() };
        let model = model(GearPair::circular(&spec).unwrap(), &Errors::default(), Supports::default());
        // 100 N/mm of face width, the load to which the standard refers
        let load_nm = 100.0 * 20.0 * 62.0 / 1000.0;
        let stiffness = model.mesh_stiffness_n_per_mm_um(0.3, Direction::Ccw, load_nm).unwrap();
        assert!((19.0..24.0).contains(&stiffness), "{stiffness} N/(mm um)");
    }

    #[test]
    fn load_lags_in_both_senses_and_never_accumulates() {
        let errors = Errors { e1_mm: 0.05, phi1_rad: 0.3, e2_mm: 0.03, phi2_rad: 1.1, ..Default::default() };
        let supports = Supports {
            shaft_compliance_output_rad_per_nm: 2e-5,
            shaft_compliance_input_rad_per_nm: 1e-5,
            bearing_compliance_mm_per_n: 1e-6,
            bearing_clearance_mm: 0.005,
        };
        let model = model(GearPair::elliptical(&EllipticalSpec::default()).unwrap(), &errors, supports);
        for step in 0..60 {
            let theta = TAU * f64::from(step) / 60.0;
            for direction in Direction::BOTH {
                let rigid = model.contact().te_rad(theta, direction).unwrap();
                assert!((model.te_rad(theta, direction, 0.0).unwrap() - rigid).abs() < 1e-13);
                let lag = |load: f64| -direction.sign() * (model.te_rad(theta, direction, load).unwrap() - rigid);
                assert!(lag(15.0) > lag(5.0) && lag(5.0) > 0.0);
                let later = model.te_rad(theta + 3.0 * TAU, direction, 15.0).unwrap();
                assert!((later - model.te_rad(theta, direction, 15.0).unwrap()).abs() < 1e-11);
                let mesh = model.mesh(theta, direction, 15.0).unwrap();
                let sum: f64 = mesh.shares.iter().map(|(_, force)| force).sum();
                assert!((sum / mesh.force_n - 1.0).abs() < 1e-9);
            }
            assert!(model.backlash_rad(theta, 15.0).unwrap() > model.backlash_rad(theta, 0.0).unwrap());
        }
        assert!(
            model.te_rad(0.0, Direction::Ccw, f64::NAN).is_err() && model.te_rad(0.0, Direction::Ccw, -1.0).is_err()
        );
    }

    #[test]
    fn load_evens_out_what_single_teeth_do() {
        // The magnitude of TE grows with the load while what single teeth do fades: the pair behind the gap comes to carry
        // too, so that a tooth's error is shared.
        let spec = CircularSpec { teeth: (47, 47), face_width_mm: 10.0, ..Default::default() };
        let pair = GearPair::circular(&spec).unwrap();
        let leads: Vec<f64> = (0..47_u32).map(|tooth| 1e-3 * f64::from(tooth * tooth % 13) - 6e-3).collect();
        let teeth = ToothErrors { driver_pitch_mm: [leads, vec![]], ..Default::default() };
        let perfect = ContactModel::new(pair, &Errors::default()).unwrap();
        let uneven = perfect.clone().with_tooth_errors(teeth).unwrap();
        let loaded = |contact| LoadedModel::new(contact, Supports::default(), Material::default()).unwrap();
        let (perfect, uneven) = (loaded(perfect), loaded(uneven));
        let mean_and_trace = |load: f64| {
            let te =
                |model: &LoadedModel, n: i32| model.te_rad(TAU * f64::from(n) / 940.0, Direction::Ccw, load).unwrap();
            let traces: Vec<f64> = (0..940).map(|n| te(&uneven, n) - te(&perfect, n)).collect();
            let mean = traces.iter().sum::<f64>() / 940.0;
            let variance = traces.iter().map(|trace| (trace - mean).powi(2)).sum::<f64>() / 940.0;
            ((0..940).map(|n| te(&uneven, n)).sum::<f64>() / 940.0, variance.sqrt())
        };
        let (light, heavy) = (mean_and_trace(5.0), mean_and_trace(300.0));
        assert!(heavy.0 < light.0 && heavy.1 < 0.95 * light.1, "{light:?} {heavy:?}");
    }
}
