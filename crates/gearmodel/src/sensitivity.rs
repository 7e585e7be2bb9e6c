//! Exact derivatives of the nominal TE by every parameter of the model.
//!
//! With c = σα − μ (σ = +1 ccw, −1 cw), u = θ1 + φ1, v = θ2 + φ2 and the base arm b = r2 cos c the model reads
//!
//! TE = [e1 sin(u + c) + e2 sin(v − c) − σ (j/2) cos α]/b − Δa tan c/r2 − σT [C_out + C_in i² + C_mesh/b²].
//!
//! Every derivative follows by the chain rule from those of (θ2, μ, i, r2) and the explicit ones.

use serde::{Deserialize, Serialize};

use crate::increment::common_normal;
use crate::pitch_curve::PitchCurve;
use crate::{Direction, NominalModel};

/// A parameter of the nominal model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Parameter {
    /// e1, mm.
    E1Mm,
    /// φ1, rad.
    Phi1Rad,
    /// e2, mm.
    E2Mm,
    /// φ2, rad.
    Phi2Rad,
    /// Designed backlash j, mm.
    BacklashMm,
    /// Growth of the centre distance Δa about 0, mm.
    CentreDistanceErrorMm,
    /// Pressure angle α, rad.
    PressureAngleRad,
    /// Module m, mm, the teeth kept.
    ModuleMm,
    /// Eccentricity k of an elliptic or lobed pair, module and teeth kept: both gears are designed anew and f with them.
    Eccentricity,
    /// Factor on all amplitudes of a Fourier or transmission curve, 1 as given: both gears are designed anew.
    HarmonicScale,
    /// C_out, rad/(N·m).
    ShaftComplianceOutputRadPerNm,
    /// C_in, rad/(N·m).
    ShaftComplianceInputRadPerNm,
    /// C_mesh, mm²·rad/(N·m).
    MeshComplianceMm2RadPerNm,
    /// Load T, N·m.
    LoadNm,
    /// Driver angle θ1, rad.
    Theta1Rad,
}

impl Parameter {
    /// All parameters, in the order of the model's description.
    pub const ALL: [Self; 15] = [
        Self::E1Mm,
        Self::Phi1Rad,
        Self::E2Mm,
        Self::Phi2Rad,
        Self::BacklashMm,
        Self::CentreDistanceErrorMm,
        Self::PressureAngleRad,
        Self::ModuleMm,
        Self::Eccentricity,
        Self::HarmonicScale,
        Self::ShaftComplianceOutputRadPerNm,
        Self::ShaftComplianceInputRadPerNm,
        Self::MeshComplianceMm2RadPerNm,
        Self::LoadNm,
        Self::Theta1Rad,
    ];

    /// Name with its unit, as in `pair.toml`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::E1Mm => "e1_mm",
            Self::Phi1Rad => "phi1_rad",
            Self::E2Mm => "e2_mm",
            Self::Phi2Rad => "phi2_rad",
            Self::BacklashMm => "backlash_mm",
            Self::CentreDistanceErrorMm => "centre_distance_error_mm",
            Self::PressureAngleRad => "pressure_angle_rad",
            Self::ModuleMm => "module_mm",
            Self::Eccentricity => "eccentricity",
            Self::HarmonicScale => "harmonic_scale",
            Self::ShaftComplianceOutputRadPerNm => "shaft_compliance_output_rad_per_nm",
            Self::ShaftComplianceInputRadPerNm => "shaft_compliance_input_rad_per_nm",
            Self::MeshComplianceMm2RadPerNm => "mesh_compliance_mm2_rad_per_nm",
            Self::LoadNm => "load_nm",
            Self::Theta1Rad => "theta1_rad",
        }
    }

    /// The parameter of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.name() == name)
    }
}

/// Change of the kinematics with a parameter.
#[derive(Clone, Copy, Debug, Default)]
struct Change {
    theta2: f64,
    mu: f64,
    ratio: f64,
    r2: f64,
    alpha: f64,
    theta1: f64,
}

impl NominalModel {
    /// ∂TE/∂parameter at θ1 under `load_nm`, rad per unit of the parameter. `None` where the pair does not have the parameter:
    /// the eccentricity of a pair that is neither elliptic nor lobed, the module of a drive without teeth. None of them has a
    /// derivative by the scale of harmonics, whose amplitudes a made pair does not keep: sweep it.
    #[must_use]
    pub fn te_derivative(
        &self,
        parameter: Parameter,
        theta1_rad: f64,
        direction: Direction,
        load_nm: f64,
    ) -> Option<f64> {
        let (pair, errors) = (&self.pair, &self.errors);
        let roll = pair.roll(theta1_rad);
        let at = &roll.at;
        let sign = direction.sign();
        let alpha = pair.pressure_angle_rad();
        let c = sign * alpha - at.mu_rad;
        let (sin_c, cos_c) = c.sin_cos();
        let arm = at.r2_mm * cos_c;
        let u = theta1_rad + errors.phi1_rad;
        let v = at.theta2_rad + errors.phi2_rad;
        let compliance = errors.shaft_compliance_output_rad_per_nm
            + errors.shaft_compliance_input_rad_per_nm * at.ratio * at.ratio
            + errors.mesh_compliance_mm2_rad_per_nm / (arm * arm);

        let change = match parameter {
            Parameter::E1Mm => return Some((u + c).sin() / arm),
            Parameter::Phi1Rad => return Some(errors.e1_mm * (u + c).cos() / arm),
            Parameter::E2Mm => return Some((v - c).sin() / arm),
            Parameter::Phi2Rad => return Some(errors.e2_mm * (v - c).cos() / arm),
            Parameter::BacklashMm => return Some(-sign * 0.5 * alpha.cos() / arm),
            Parameter::CentreDistanceErrorMm => {
                return Some(common_normal::displacement_te_rad(pair, at, (-1.0, 0.0), direction));
            }
            Parameter::ShaftComplianceOutputRadPerNm => return Some(-sign * load_nm),
            Parameter::ShaftComplianceInputRadPerNm => return Some(-sign * load_nm * at.ratio * at.ratio),
            Parameter::MeshComplianceMm2RadPerNm => return Some(-sign * load_nm / (arm * arm)),
            Parameter::LoadNm => return Some(-sign * compliance),
            Parameter::PressureAngleRad => Change { alpha: 1.0, ..Change::default() },
            Parameter::ModuleMm => {
                if !pair.has_teeth() {
                    return None;
                }
                Change { r2: at.r2_mm / pair.module_mm(), ..Change::default() }
            }
            Parameter::Theta1Rad => {
                let ratio = pair.pitch_curve().motion(theta1_rad).ratio_slope;
                Change {
                    theta1: 1.0,
                    theta2: at.ratio,
                    mu: roll.mu_slope,
                    ratio,
                    r2: -pair.centre_distance_mm() * ratio / (1.0 + at.ratio).powi(2),
                    alpha: 0.0,
                }
            }
            Parameter::HarmonicScale => return None,
            Parameter::Eccentricity => {
                let by_k = pair.pitch_curve().by_eccentricity(theta1_rad)?;
                let a = pair.centre_distance_mm();
                Change {
                    theta2: by_k.theta2,
                    mu: by_k.mu,
                    ratio: by_k.ratio,
                    // r2 = a/(1 + i)
                    r2: at.r2_mm * by_k.relative_distance - a * by_k.ratio / (1.0 + at.ratio).powi(2),
                    alpha: 0.0,
                    theta1: 0.0,
                }
            }
        };

        // Chain rule: dc = σ dα − dμ, db = dr2 cos c − r2 sin c dc.
        let dc = sign * change.alpha - change.mu;
        let d_arm = change.r2 * cos_c - at.r2_mm * sin_c * dc;
        let line =
            errors.e1_mm * (u + c).sin() + errors.e2_mm * (v - c).sin() - sign * 0.5 * pair.backlash_mm() * alpha.cos();
        let d_line = errors.e1_mm * (u + c).cos() * (change.theta1 + dc)
            + errors.e2_mm * (v - c).cos() * (change.theta2 - dc)
            + sign * 0.5 * pair.backlash_mm() * alpha.sin() * change.alpha;
        let d_compliance = 2.0 * errors.shaft_compliance_input_rad_per_nm * at.ratio * change.ratio
            - 2.0 * errors.mesh_compliance_mm2_rad_per_nm * d_arm / (arm * arm * arm);
        Some(d_line / arm - line * d_arm / (arm * arm) - sign * load_nm * d_compliance)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{CurveSpec, EllipticalSpec, Errors, GearPair, ToothSpec};

    /// Teeth, eccentricity, and the lobes of a lobed pair.
    type Spec = (ToothSpec, f64, Option<(u32, u32)>);

    fn pair((teeth, eccentricity, lobes): &Spec) -> GearPair {
        let eccentricity = *eccentricity;
        match *lobes {
            None => GearPair::elliptical(&EllipticalSpec { teeth: teeth.clone(), eccentricity }).unwrap(),
            Some(lobes) => GearPair::free(teeth, &CurveSpec::Lobed { eccentricity, lobes }).unwrap(),
        }
    }

    /// The model with one parameter moved, and the θ1, Δa and load at which to evaluate it.
    fn te_with(base: &(Spec, Errors, f64, f64), parameter: Parameter, by: f64, direction: Direction) -> f64 {
        let ((mut spec, mut k, lobes), mut errors, mut theta1, mut load) = base.clone();
        let mut da = 0.0;
        match parameter {
            Parameter::E1Mm => errors.e1_mm += by,
            Parameter::Phi1Rad => errors.phi1_rad += by,
            Parameter::E2Mm => errors.e2_mm += by,
            Parameter::Phi2Rad => errors.phi2_rad += by,
            Parameter::BacklashMm => spec.backlash_mm += by,
            Parameter::CentreDistanceErrorMm => da = by,
            Parameter::PressureAngleRad => spec.pressure_angle_deg += by.to_degrees(),
            Parameter::ModuleMm => spec.module_mm += by,
            Parameter::Eccentricity => k += by,
            Parameter::HarmonicScale => {}
            Parameter::ShaftComplianceOutputRadPerNm => errors.shaft_compliance_output_rad_per_nm += by,
            Parameter::ShaftComplianceInputRadPerNm => errors.shaft_compliance_input_rad_per_nm += by,
            Parameter::MeshComplianceMm2RadPerNm => errors.mesh_compliance_mm2_rad_per_nm += by,
            Parameter::LoadNm => load += by,
            Parameter::Theta1Rad => theta1 += by,
        }
        let model = NominalModel::new(pair(&(spec, k, lobes)), errors).unwrap();
        let at = model.pair.at(theta1);
        model.te_rad(theta1, direction, load)
            + common_normal::displacement_te_rad(&model.pair, &at, (-da, 0.0), direction)
    }

    proptest! {
        #[test]
        fn derivatives_agree_with_central_differences(
            k in 0.05..0.7_f64, e1 in 0.01..0.1_f64, phi1 in -3.0..3.0_f64, e2 in 0.01..0.1_f64, phi2 in -3.0..3.0_f64,
            backlash in 0.02..0.2_f64, theta in -7.0..7.0_f64, load in 1.0..20.0_f64, cw in any::<bool>(), kind in 0..4_usize,
        ) {
            let (lobes, teeth) = [(None, (47, 47)), (Some((1, 2)), (40, 80)), (Some((2, 3)), (48, 72)), (Some((3, 3)), (60, 60))][kind];
            let spec = ToothSpec { teeth, backlash_mm: backlash, ..Default::default() };
            // Higher orders get steep: k n/√(1 − k²) is tan μ.
            let k = if lobes.is_some_and(|lobes| lobes.0 > 1) { 0.4 * k } else { k };
            let errors = Errors {
                e1_mm: e1, phi1_rad: phi1, e2_mm: e2, phi2_rad: phi2, shaft_compliance_output_rad_per_nm: 2e-5,
                shaft_compliance_input_rad_per_nm: 1e-5, mesh_compliance_mm2_rad_per_nm: 5e-3,
            };
            let direction = if cw { Direction::Cw } else { Direction::Ccw };
            let base = ((spec, k, lobes), errors, theta, load);
            let model = NominalModel::new(pair(&base.0), errors).unwrap();
            for parameter in Parameter::ALL.into_iter().filter(|parameter| *parameter != Parameter::HarmonicScale) {
                let scale = match parameter {
                    Parameter::ShaftComplianceOutputRadPerNm | Parameter::ShaftComplianceInputRadPerNm => 1e-5,
                    Parameter::MeshComplianceMm2RadPerNm => 1e-3,
                    Parameter::Eccentricity | Parameter::E1Mm | Parameter::E2Mm | Parameter::BacklashMm => 1e-2,
                    _ => 1.0,
                };
                // Fourth-order central difference: its own error stays far below the tolerance.
                let h = 3e-3 * scale;
                let difference = |steps: f64| {
                    te_with(&base, parameter, steps * h, direction) - te_with(&base, parameter, -steps * h, direction)
                };
                let numeric = (8.0 * difference(1.0) - difference(2.0)) / (12.0 * h);
                let exact = model.te_derivative(parameter, theta, direction, load).unwrap();
                // Relative to the size of the derivative over a turn, not to a zero crossing.
                let size = (0..32)
                    .map(|n| model.te_derivative(parameter, 0.2 * f64::from(n), direction, load).unwrap().abs())
                    .fold(0.0, f64::max);
                prop_assert!((exact - numeric).abs() <= 1e-6 * size, "{parameter:?}: {exact} {numeric} {size}");
            }
        }
    }

    #[test]
    fn names_round_trip_and_absent_parameters_are_none() {
        for parameter in Parameter::ALL {
            assert_eq!(Parameter::from_name(parameter.name()), Some(parameter));
        }
        let model = NominalModel::new(GearPair::constant(3.0).unwrap(), Errors::default()).unwrap();
        assert_eq!(model.te_derivative(Parameter::Eccentricity, 0.0, Direction::Ccw, 1.0), None);
        assert_eq!(model.te_derivative(Parameter::HarmonicScale, 0.0, Direction::Ccw, 1.0), None);
        assert_eq!(model.te_derivative(Parameter::ModuleMm, 0.0, Direction::Ccw, 1.0), None);
        assert_eq!(model.te_derivative(Parameter::LoadNm, 0.0, Direction::Ccw, 1.0), Some(-0.0));
    }
}
