//! Labelled sweeps: a figure over a grid of design and error parameters, on all cores.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::contact::ContactModel;
use crate::increment::common_normal;
use crate::sensitivity::Parameter;
use crate::{Direction, EllipticalSpec, Errors, GearPair, GeometryError, NominalModel};

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
    /// The elliptic pair at the grid's origin.
    pub gears: EllipticalSpec,
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

/// Most cells of a grid.
const MAX_CELLS: usize = 10_000_000;

impl Sweep {
    /// Evaluates the grid. `progress` hears the number of cells finished, from any thread.
    ///
    /// # Errors
    /// [`GeometryError::Length`] for an empty axis, a grid of over 10⁷ cells, or fewer than 8 angles.
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
        for (_, values) in &self.over {
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
                Parameter::BacklashMm => gears.backlash_mm = value,
                Parameter::CentreDistanceErrorMm => da_mm = value,
                Parameter::PressureAngleRad => gears.pressure_angle_deg = value.to_degrees(),
                Parameter::ModuleMm => gears.module_mm = value,
                Parameter::Eccentricity => gears.eccentricity = value,
                Parameter::ShaftComplianceOutputRadPerNm => errors.shaft_compliance_output_rad_per_nm = value,
                Parameter::ShaftComplianceInputRadPerNm => errors.shaft_compliance_input_rad_per_nm = value,
                Parameter::MeshComplianceMm2RadPerNm => errors.mesh_compliance_mm2_rad_per_nm = value,
                Parameter::LoadNm => load_nm = value,
                Parameter::Theta1Rad => theta1_rad = value,
            }
        }
        if !(load_nm.is_finite() && da_mm.is_finite() && theta1_rad.is_finite()) {
            return Err("a swept value is not finite".to_owned());
        }
        let pair = GearPair::elliptical(&gears).map_err(|error| error.to_string())?;
        let model = NominalModel::new(pair, errors).map_err(|error| error.to_string())?;
        let exact = match self.method {
            SweepMethod::CommonNormal => None,
            SweepMethod::Exact => Some(
                ContactModel::new(model.pair.clone(), &errors)
                    .and_then(|contact| contact.with_displacement(-da_mm, 0.0))
                    .map_err(|error| error.to_string())?,
            ),
        };
        let te = |theta1_rad: f64, direction: Direction| -> Result<f64, String> {
            let at = model.pair.at(theta1_rad);
            match &exact {
                None => Ok(model.te_at_rad(&at, direction, load_nm)
                    + common_normal::displacement_te_rad(&model.pair, &at, (-da_mm, 0.0), direction)),
                Some(contact) => contact
                    .te_rad(theta1_rad, direction)
                    .map(|te| te + model.windup_rad(&at, direction, load_nm))
                    .map_err(|error| error.to_string()),
            }
        };
        let (mut low, mut high, mut sum, mut squares) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
        for n in 0..self.angles {
            let theta1_rad = theta1_rad + TAU * n as f64 / self.angles as f64;
            let value = match self.of {
                SweepFigure::TePp(direction) | SweepFigure::TeRms(direction) | SweepFigure::TeMean(direction) => {
                    te(theta1_rad, direction)?
                }
                SweepFigure::BacklashPp | SweepFigure::BacklashMean => {
                    te(theta1_rad, Direction::Cw)? - te(theta1_rad, Direction::Ccw)?
                }
            };
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

    fn sweep(of: SweepFigure, method: SweepMethod) -> Sweep {
        Sweep {
            gears: EllipticalSpec::default(),
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
