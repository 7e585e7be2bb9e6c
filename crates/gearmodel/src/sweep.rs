//! Labelled sweeps: a figure over a grid of design and error parameters, on all cores.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::contact::ContactModel;
use crate::increment::common_normal;
use crate::sensitivity::Parameter;
use crate::{CurveSpec, Direction, EllipticalSpec, Errors, GeometryError, NominalModel, PairSpec, ToothSpec};

/// Figure of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SweepFigure {
    /// Peak-to-peak of TE in a sense, rad.
    TePp(Direction),
    /// RMS of TE about its mean in a sense, rad.
    TeRms(Direction),
    /// Mean of TE in a sense, rad.
    TeMean(Direction),
    /// Peak-to-peak of the backlash, rad.
    BacklashPp,
    /// Mean of the backlash, rad.
    BacklashMean,
}

/// How TE is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SweepMethod {
    /// The increment along the common normal.
    CommonNormal,
    /// Exact contact of rigid teeth, with the wind-up added.
    Exact,
}

/// What to sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// The pair at the grid's origin, of any kind. Where a size of its gears is swept its centre distance follows closure.
    pub gears: PairSpec,
    /// Its errors.
    pub errors: Errors,
    /// Load on the driven shaft, N·m.
    pub load_nm: f64,
    /// Axes: parameter and its values, in its unit; the last axis runs fastest.
    pub over: Vec<(Parameter, Vec<f64>)>,
    /// Figure.
    pub of: SweepFigure,
    /// Method.
    pub method: SweepMethod,
    /// Angles a turn.
    pub angles: usize,
}

/// Values over the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepTable {
    /// The axes, as given.
    pub axes: Vec<(Parameter, Vec<f64>)>,
    /// Values, rad, last axis fastest. NaN where no pair exists; `faults` says why.
    pub values_rad: Vec<f64>,
    /// (index in `values_rad`, reason) of the cells without a value.
    pub faults: Vec<(usize, String)>,
}

impl PairSpec {
    /// Sets a parameter of the gears; others than those of the gears are left alone. Two equal circular gears become
    /// elliptical ones by an eccentricity.
    fn set(&mut self, parameter: Parameter, value: f64) -> Result<(), GeometryError> {
        if let (Self::Circular(spec), Parameter::Eccentricity) = (&*self, parameter)
            && spec.teeth.0 == spec.teeth.1
        {
            *self = Self::Elliptical(EllipticalSpec { teeth: spec.clone(), eccentricity: 0.0 });
        }
        let foreign = GeometryError::ForeignParameter { parameter: parameter.name(), kind: self.kind() };
        // What changes the size of the gears changes the distance at which they close.
        let resizes = matches!(parameter, Parameter::ModuleMm | Parameter::Eccentricity | Parameter::HarmonicScale);
        let changed = |mut teeth: ToothSpec| {
            match parameter {
                Parameter::BacklashMm => teeth.backlash_mm = value,
                Parameter::PressureAngleRad => teeth.pressure_angle_deg = value.to_degrees(),
                Parameter::ModuleMm => teeth.module_mm = value,
                _ => {}
            }
            if resizes {
                teeth.centre_distance_mm = None;
            }
            teeth
        };
        match self {
            Self::Elliptical(EllipticalSpec { teeth, .. }) | Self::Circular(teeth) | Self::Free { teeth, .. } => {
                *teeth = changed(teeth.clone());
            }
            Self::Constant { .. } => {}
        }
        match (parameter, self) {
            (Parameter::Eccentricity, Self::Elliptical(spec)) => spec.eccentricity = value,
            (Parameter::Eccentricity, Self::Free { curve: CurveSpec::Lobed { eccentricity, .. }, .. }) => {
                *eccentricity = value;
            }
            (
                Parameter::HarmonicScale,
                Self::Free {
                    curve: CurveSpec::Fourier { cosines, sines } | CurveSpec::Transmission { cosines, sines },
                    ..
                },
            ) => cosines.iter_mut().chain(sines).for_each(|amplitude| *amplitude *= value),
            (Parameter::Eccentricity | Parameter::HarmonicScale, _)
            | (Parameter::BacklashMm | Parameter::PressureAngleRad | Parameter::ModuleMm, Self::Constant { .. }) => {
                return Err(foreign);
            }
            _ => {}
        }
        Ok(())
    }
}

/// Most cells of a grid.
const MAX_CELLS: usize = 10_000_000;

impl Sweep {
    /// Evaluates the grid. `progress` hears the number of cells finished, from any thread.
    ///
    /// # Errors
    /// [`GeometryError::Length`] for an empty axis, a grid of over 10⁷ cells, or fewer than 8 angles;
    /// [`GeometryError::ForeignParameter`] for a parameter that this kind of pair does not have.
    pub fn run(&self, progress: &(dyn Fn(usize) + Sync)) -> Result<SweepTable, GeometryError> {
        let length = |quantity: &'static str, given: usize, lower: usize, upper: usize| {
            if (lower..=upper).contains(&given) {
                Ok(())
            } else {
                Err(GeometryError::Length { quantity, given, lower, upper })
            }
        };
        length("angles of a sweep", self.angles, 8, 100_000)?;
        let mut cells = 1_usize;
        for (parameter, values) in &self.over {
            // Whether a pair has a parameter does not depend on its value.
            self.gears.clone().set(*parameter, 0.0)?;
            length("an axis of a sweep", values.len(), 1, MAX_CELLS)?;
            cells = cells.saturating_mul(values.len());
        }
        length("cells of a sweep", cells, 1, MAX_CELLS)?;
        let finished = std::sync::atomic::AtomicUsize::new(0);
        let results: Vec<Result<f64, String>> = (0..cells)
            .into_par_iter()
            .map(|index| {
                let value = self.cell(index);
                progress(finished.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1);
                value
            })
            .collect();
        let mut faults = Vec::new();
        let values_rad = results
            .into_iter()
            .enumerate()
            .map(|(index, result)| {
                result.unwrap_or_else(|reason| {
                    faults.push((index, reason));
                    f64::NAN
                })
            })
            .collect();
        Ok(SweepTable { axes: self.over.clone(), values_rad, faults })
    }

    fn cell(&self, index: usize) -> Result<f64, String> {
        let (mut gears, mut errors) = (self.gears.clone(), self.errors);
        let (mut load_nm, mut da_mm, mut theta1_rad) = (self.load_nm, 0.0, 0.0);
        let mut rest = index;
        for (parameter, values) in self.over.iter().rev() {
            let value = values[rest % values.len()];
            rest /= values.len();
            match parameter {
                Parameter::E1Mm => errors.e1_mm = value,
                Parameter::Phi1Rad => errors.phi1_rad = value,
                Parameter::E2Mm => errors.e2_mm = value,
                Parameter::Phi2Rad => errors.phi2_rad = value,
                Parameter::CentreDistanceErrorMm => da_mm = value,
                Parameter::ShaftComplianceOutputRadPerNm => errors.shaft_compliance_output_rad_per_nm = value,
                Parameter::ShaftComplianceInputRadPerNm => errors.shaft_compliance_input_rad_per_nm = value,
                Parameter::MeshComplianceMm2RadPerNm => errors.mesh_compliance_mm2_rad_per_nm = value,
                Parameter::LoadNm => load_nm = value,
                Parameter::Theta1Rad => theta1_rad = value,
                Parameter::BacklashMm
                | Parameter::PressureAngleRad
                | Parameter::ModuleMm
                | Parameter::Eccentricity
                | Parameter::HarmonicScale => gears.set(*parameter, value).map_err(|error| error.to_string())?,
            }
        }
        if !(load_nm.is_finite() && da_mm.is_finite() && theta1_rad.is_finite()) {
            return Err("a swept value is not finite".to_owned());
        }
        let pair = gears.build().map_err(|error| error.to_string())?;
        let model = NominalModel::new(pair, errors).map_err(|error| error.to_string())?;
        let exact = match self.method {
            SweepMethod::CommonNormal => None,
            SweepMethod::Exact => Some(
                ContactModel::new(model.pair.clone(), &errors)
                    .and_then(|contact| contact.with_displacement(-da_mm, 0.0))
                    .map_err(|error| error.to_string())?,
            ),
        };
        let turn_rad: Vec<f64> = (0..self.angles).map(|n| theta1_rad + TAU * n as f64 / self.angles as f64).collect();
        let te = |direction: Direction| -> Result<Vec<f64>, String> {
            let mut te_rad = match &exact {
                None => vec![0.0; turn_rad.len()],
                Some(contact) => contact.te_curve_rad(&turn_rad, direction).map_err(|error| error.to_string())?,
            };
            for (te_rad, theta1_rad) in te_rad.iter_mut().zip(&turn_rad) {
                let at = model.pair.at(*theta1_rad);
                *te_rad += match exact {
                    None => {
                        model.te_at_rad(&at, direction, load_nm)
                            + common_normal::displacement_te_rad(&model.pair, &at, (-da_mm, 0.0), direction)
                    }
                    Some(_) => model.windup_rad(&at, direction, load_nm),
                };
            }
            Ok(te_rad)
        };
        let values = match self.of {
            SweepFigure::TePp(direction) | SweepFigure::TeRms(direction) | SweepFigure::TeMean(direction) => {
                te(direction)?
            }
            SweepFigure::BacklashPp | SweepFigure::BacklashMean => {
                te(Direction::Cw)?.iter().zip(te(Direction::Ccw)?).map(|(cw, ccw)| cw - ccw).collect()
            }
        };
        let (mut low, mut high, mut sum, mut squares) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
        for value in values {
            low = low.min(value);
            high = high.max(value);
            sum += value;
            squares += value * value;
        }
        let count = self.angles as f64;
        Ok(match self.of {
            SweepFigure::TePp(_) | SweepFigure::BacklashPp => high - low,
            SweepFigure::TeMean(_) | SweepFigure::BacklashMean => sum / count,
            SweepFigure::TeRms(_) => (squares / count - (sum / count).powi(2)).max(0.0).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_pair_sweeps_what_it_has() {
        let teeth = ToothSpec { teeth: (48, 48), centre_distance_mm: Some(144.0), ..Default::default() };
        let free =
            |curve: CurveSpec| PairSpec::Free { teeth: ToothSpec { centre_distance_mm: None, ..teeth.clone() }, curve };
        let theta1_rad: Vec<f64> = (0..60).map(|n| TAU * f64::from(n) / 60.0).collect();
        let radius = theta1_rad.iter().map(|theta| 1.0 + 0.1 * theta.cos()).collect();
        let kinds = [
            (PairSpec::Circular(teeth.clone()), Parameter::Eccentricity, Some(Parameter::HarmonicScale)),
            (
                free(CurveSpec::Lobed { eccentricity: 0.05, lobes: (2, 2) }),
                Parameter::Eccentricity,
                Some(Parameter::HarmonicScale),
            ),
            (
                free(CurveSpec::Fourier { cosines: vec![0.1, 0.02], sines: vec![0.01] }),
                Parameter::HarmonicScale,
                Some(Parameter::Eccentricity),
            ),
            (
                free(CurveSpec::Transmission { cosines: vec![0.1], sines: vec![] }),
                Parameter::HarmonicScale,
                Some(Parameter::Eccentricity),
            ),
            (free(CurveSpec::Sampled { theta1_rad, radius }), Parameter::ModuleMm, Some(Parameter::Eccentricity)),
            (PairSpec::Constant { ratio: 3.0 }, Parameter::LoadNm, Some(Parameter::ModuleMm)),
        ];
        for (gears, own, foreign) in kinds {
            let kind = gears.kind();
            let mut errors = sweep(SweepFigure::BacklashMean, SweepMethod::Exact).errors;
            errors.shaft_compliance_output_rad_per_nm = 1e-5;
            let run = |parameter: Parameter, values: Vec<f64>, method| {
                let (over, gears) = (vec![(parameter, values)], gears.clone());
                Sweep { gears, errors, over, ..sweep(SweepFigure::TePp(Direction::Ccw), method) }.run(&|_| {})
            };
            let values = match own {
                Parameter::Eccentricity => vec![0.0, 0.05],
                Parameter::LoadNm => vec![0.0, 10.0],
                _ => vec![0.5, 1.0],
            };
            let table = run(own, values, SweepMethod::CommonNormal).unwrap();
            assert!(table.faults.is_empty(), "{kind}: {:?}", table.faults);
            assert!(table.values_rad[0] != table.values_rad[1] || own == Parameter::LoadNm, "{kind}");
            if own != Parameter::LoadNm {
                let exact = run(own, vec![0.5], SweepMethod::Exact).unwrap();
                let first = run(own, vec![0.5], SweepMethod::CommonNormal).unwrap();
                let (a, b) = (exact.values_rad[0], first.values_rad[0]);
                assert!((a / b - 1.0).abs() < 1e-2, "{kind}: {a} {b} {:?}", exact.faults);
            }
            if let Some(foreign) = foreign {
                let error = run(foreign, vec![0.1], SweepMethod::CommonNormal).unwrap_err();
                assert!(matches!(error, GeometryError::ForeignParameter { .. }), "{kind}: {error}");
                assert!(error.to_string().contains(kind) && error.to_string().contains(foreign.name()));
            }
        }
        // As given: the grid's origin is the pair itself.
        let gears = free(CurveSpec::Fourier { cosines: vec![0.1, 0.02], sines: vec![0.01] });
        let origin = gears.build().unwrap();
        let mut scaled = gears;
        scaled.set(Parameter::HarmonicScale, 1.0).unwrap();
        assert_eq!(scaled.build().unwrap(), origin);
    }

    fn sweep(of: SweepFigure, method: SweepMethod) -> Sweep {
        Sweep {
            gears: PairSpec::Elliptical(EllipticalSpec::default()),
            errors: Errors { e1_mm: 0.05, e2_mm: 0.03, phi1_rad: 0.3, phi2_rad: 1.1, ..Default::default() },
            load_nm: 0.0,
            over: vec![(Parameter::Eccentricity, vec![0.2, 0.4, 0.6, 1.5]), (Parameter::E1Mm, vec![0.0, 0.05, 0.1])],
            of,
            method,
            angles: 180,
        }
    }

    #[test]
    fn the_grid_is_labelled_and_says_why_a_cell_is_empty() {
        for method in [SweepMethod::CommonNormal, SweepMethod::Exact] {
            let table = sweep(SweepFigure::TePp(Direction::Ccw), method).run(&|_| {}).unwrap();
            assert_eq!(table.values_rad.len(), 12);
            let faulty: Vec<usize> = table.faults.iter().map(|fault| fault.0).collect();
            assert_eq!(faulty, [9, 10, 11]);
            assert!(table.faults[0].1.contains("eccentricity") && table.values_rad[9].is_nan());
            // The document's finding: the amplitude grows with k.
            assert!(table.values_rad[1] < table.values_rad[4] && table.values_rad[4] < table.values_rad[7]);
        }
    }

    #[test]
    fn both_methods_agree_to_first_order_and_bad_grids_are_refused() {
        for of in [SweepFigure::TeRms(Direction::Cw), SweepFigure::BacklashPp, SweepFigure::TeMean(Direction::Ccw)] {
            let [first, exact] =
                [SweepMethod::CommonNormal, SweepMethod::Exact].map(|method| sweep(of, method).run(&|_| {}).unwrap());
            for (a, b) in first.values_rad.iter().zip(&exact.values_rad).take(9) {
                assert!((a - b).abs() < 1e-5, "{of:?}: {a} {b}");
            }
        }
        let mut empty = sweep(SweepFigure::BacklashMean, SweepMethod::CommonNormal);
        empty.over[0].1.clear();
        assert!(empty.run(&|_| {}).is_err());
    }
}
