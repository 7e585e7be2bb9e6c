//! Tolerance studies: what scatter of the errors does to TE and backlash.
//!
//! TE of the increment is linear in the error vectors (e cos φ, e sin φ), the backlash, the centre distance and T·C, so the
//! curves of unit errors are evaluated once and every drawn pair is a weighted sum of them: 100 000 pairs take seconds.
//! A pair's draws depend on the seed and its own number alone, never on the number of threads.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::geometry_error::check_range;
use crate::increment::common_normal;
use crate::sensitivity::Parameter;
use crate::{Direction, Errors, GeometryError, NominalModel};

/// How a parameter scatters about its nominal value, in the parameter's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scatter {
    /// Normal with this standard deviation.
    Normal(f64),
    /// Uniform within ± this half width (π for a phase that assembly leaves open).
    Uniform(f64),
}

/// A tolerance study to run.
#[derive(Clone, Debug, PartialEq)]
pub struct ToleranceStudy {
    /// What scatters. A negative eccentricity drawn is one with its phase turned by π.
    pub scatter: Vec<(Parameter, Scatter)>,
    /// Load on the driven shaft, N·m.
    pub load_nm: f64,
    /// Pairs to draw.
    pub pairs: usize,
    /// Angles a turn.
    pub angles: usize,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for ToleranceStudy {
    /// 100 000 pairs at 720 angles without load; nothing scatters yet.
    fn default() -> Self {
        Self { scatter: Vec::new(), load_nm: 0.0, pairs: 100_000, angles: 720, seed: 0 }
    }
}

/// A figure of each drawn pair.
#[derive(Clone, Debug, PartialEq)]
pub struct ToleranceFigure {
    /// Name with its unit.
    pub name: &'static str,
    /// One value a pair, in the order of the draws, rad.
    pub values_rad: Vec<f64>,
    /// Mean over the pairs, rad.
    pub mean_rad: f64,
    /// Standard deviation over the pairs, rad.
    pub std_rad: f64,
    /// First-order share of each parameter in the variance, 0 to 1, Sobol-like: variance of the mean given the parameter over
    /// the whole variance. What is missing to 1 is interaction.
    pub shares: Vec<(Parameter, f64)>,
    sorted_rad: Vec<f64>,
}

impl ToleranceFigure {
    /// The value below which a share `probability` of the pairs stays, rad, interpolated; the probability is clamped to 0..1.
    #[must_use]
    pub fn quantile_rad(&self, probability: f64) -> f64 {
        let last = self.sorted_rad.len() - 1;
        let position = probability.clamp(0.0, 1.0) * last as f64;
        let index = (position as usize).min(last);
        let above = (index + 1).min(last);
        self.sorted_rad[index] + (position - index as f64) * (self.sorted_rad[above] - self.sorted_rad[index])
    }
}

/// Why a study cannot be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ToleranceError {
    /// The parameter changes the design, not its errors.
    #[error(
        "{parameter} is a parameter of the design, not an error of made gears: sweep it instead, or let e1_mm, phi1_rad, \
         e2_mm, phi2_rad, backlash_mm, centre_distance_error_mm or a compliance scatter"
    )]
    Design {
        /// The parameter's name.
        parameter: &'static str,
    },
    /// A parameter that scatters twice.
    #[error("{parameter} is given twice: state its scatter once")]
    Twice {
        /// The parameter's name.
        parameter: &'static str,
    },
    /// A number out of range.
    #[error(transparent)]
    Range(#[from] GeometryError),
}

/// Names of the figures, in order.
const FIGURES: [&str; 5] =
    ["te_ccw_pp_rad", "te_cw_pp_rad", "backlash_min_rad", "backlash_mean_rad", "backlash_pp_rad"];
/// Unit errors that the curves are linear in.
const BASIS: usize = 9;
/// Pairs a task.
const CHUNK: usize = 512;

/// Curves of unit errors: TE at each angle for e1 cos φ1, e1 sin φ1, e2 cos φ2, e2 sin φ2, j, Δa, C_out, C_in, C_mesh.
struct Basis {
    /// By sense, by unit error, by angle.
    te: [[Vec<f64>; BASIS]; 2],
}

impl Basis {
    fn of(model: &NominalModel, angles: usize, load_nm: f64) -> Self {
        let pair = &model.pair;
        let te = Direction::BOTH.map(|direction| {
            let sign = direction.sign();
            let mut curves: [Vec<f64>; BASIS] = std::array::from_fn(|_| Vec::with_capacity(angles));
            for n in 0..angles {
                let at = pair.at(TAU * n as f64 / angles as f64);
                for (curve, errors) in curves.iter_mut().zip(&Errors::UNIT_ECCENTRICITIES) {
                    curve.push(common_normal::eccentricity_te_rad(pair, errors, &at, direction));
                }
                let arm_mm = common_normal::driven_base_arm_mm(pair, &at, direction);
                curves[4].push(-sign * 0.5 * pair.pressure_angle_rad().cos() / arm_mm);
                curves[5].push(common_normal::displacement_te_rad(pair, &at, (-1.0, 0.0), direction));
                curves[6].push(-sign * load_nm);
                curves[7].push(-sign * load_nm * at.ratio * at.ratio);
                curves[8].push(-sign * load_nm / (arm_mm * arm_mm));
            }
            curves
        });
        Self { te }
    }
}

/// Values of the parameters of one pair, in the order of [`Parameter`]'s errors.
#[derive(Clone, Copy)]
struct Drawn {
    errors: Errors,
    backlash_mm: f64,
    centre_distance_error_mm: f64,
    load_factor: f64,
}

impl Drawn {
    fn add(&mut self, parameter: Parameter, by: f64, load_nm: f64) {
        match parameter {
            Parameter::E1Mm => self.errors.e1_mm += by,
            Parameter::Phi1Rad => self.errors.phi1_rad += by,
            Parameter::E2Mm => self.errors.e2_mm += by,
            Parameter::Phi2Rad => self.errors.phi2_rad += by,
            Parameter::BacklashMm => self.backlash_mm += by,
            Parameter::CentreDistanceErrorMm => self.centre_distance_error_mm += by,
            Parameter::ShaftComplianceOutputRadPerNm => self.errors.shaft_compliance_output_rad_per_nm += by,
            Parameter::ShaftComplianceInputRadPerNm => self.errors.shaft_compliance_input_rad_per_nm += by,
            Parameter::MeshComplianceMm2RadPerNm => self.errors.mesh_compliance_mm2_rad_per_nm += by,
            Parameter::LoadNm => self.load_factor += if load_nm == 0.0 { 0.0 } else { by / load_nm },
            // Refused before any draw.
            Parameter::PressureAngleRad
            | Parameter::ModuleMm
            | Parameter::Eccentricity
            | Parameter::HarmonicScale
            | Parameter::Theta1Rad => {}
        }
    }

    fn weights(&self) -> [f64; BASIS] {
        let (sin1, cos1) = self.errors.phi1_rad.sin_cos();
        let (sin2, cos2) = self.errors.phi2_rad.sin_cos();
        [
            self.errors.e1_mm * cos1,
            self.errors.e1_mm * sin1,
            self.errors.e2_mm * cos2,
            self.errors.e2_mm * sin2,
            self.backlash_mm,
            self.centre_distance_error_mm,
            self.load_factor * self.errors.shaft_compliance_output_rad_per_nm,
            self.load_factor * self.errors.shaft_compliance_input_rad_per_nm,
            self.load_factor * self.errors.mesh_compliance_mm2_rad_per_nm,
        ]
    }
}

impl ToleranceStudy {
    fn check(&self) -> Result<(), ToleranceError> {
        for (n, (parameter, scatter)) in self.scatter.iter().enumerate() {
            let design = [
                Parameter::PressureAngleRad,
                Parameter::ModuleMm,
                Parameter::Eccentricity,
                Parameter::HarmonicScale,
                Parameter::Theta1Rad,
            ];
            if design.contains(parameter) {
                return Err(ToleranceError::Design { parameter: parameter.name() });
            }
            if self.scatter[..n].iter().any(|(other, _)| other == parameter) {
                return Err(ToleranceError::Twice { parameter: parameter.name() });
            }
            let (Scatter::Normal(width) | Scatter::Uniform(width)) = scatter;
            check_range("scatter", *width, "of the parameter's unit", (0.0, 1e6), "give a width, not a variance")?;
        }
        check_range("load_nm", self.load_nm, "N.m", (0.0, 1e7), "the load is positive in both senses")?;
        let count = "fewer pairs give no quantiles, more no further digit";
        check_range("pairs", self.pairs as f64, "", (2.0, 2e6), count)?;
        check_range("angles", self.angles as f64, "", (8.0, 1e5), "720 is every half degree")?;
        Ok(())
    }

    /// Draws the pairs on all cores. `progress` hears the number of pairs finished, now and then, from any thread.
    ///
    /// # Errors
    /// [`ToleranceError`] when something scatters that is no error of a made gear, or a number is out of range.
    pub fn run(
        &self,
        model: &NominalModel,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<ToleranceFigure>, ToleranceError> {
        self.check()?;
        let basis = Basis::of(model, self.angles, self.load_nm);
        let nominal = Drawn {
            errors: model.errors,
            backlash_mm: model.pair.backlash_mm(),
            centre_distance_error_mm: 0.0,
            load_factor: 1.0,
        };
        let finished = std::sync::atomic::AtomicUsize::new(0);
        let chunks: Vec<Vec<(Vec<f64>, [f64; 5])>> = (0..self.pairs.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(self.pairs);
                let count = range.len();
                let mut buffers = [vec![0.0; self.angles], vec![0.0; self.angles]];
                let result = range.map(|number| self.pair(number, &nominal, &basis, &mut buffers)).collect();
                progress(finished.fetch_add(count, std::sync::atomic::Ordering::Relaxed) + count);
                result
            })
            .collect();
        let drawn: Vec<(Vec<f64>, [f64; 5])> = chunks.into_iter().flatten().collect();
        let orders: Vec<Vec<usize>> = (0..self.scatter.len())
            .into_par_iter()
            .map(|column| {
                let mut order: Vec<usize> = (0..drawn.len()).collect();
                order.sort_unstable_by(|a, b| drawn[*a].0[column].total_cmp(&drawn[*b].0[column]));
                order
            })
            .collect();
        Ok((0..FIGURES.len())
            .into_par_iter()
            .map(|figure| {
                let values_rad: Vec<f64> = drawn.iter().map(|(_, figures)| figures[figure]).collect();
                let shares = self
                    .scatter
                    .iter()
                    .zip(&orders)
                    .map(|((parameter, _), order)| (*parameter, first_order_share(&values_rad, order)))
                    .collect();
                let (mean_rad, variance) = mean_and_variance(&values_rad);
                let mut sorted_rad = values_rad.clone();
                sorted_rad.sort_unstable_by(f64::total_cmp);
                let name = FIGURES[figure];
                ToleranceFigure { name, values_rad, mean_rad, std_rad: variance.sqrt(), shares, sorted_rad }
            })
            .collect())
    }

    /// Draws one pair and takes its figures.
    fn pair(&self, number: usize, nominal: &Drawn, basis: &Basis, buffers: &mut [Vec<f64>; 2]) -> (Vec<f64>, [f64; 5]) {
        // One stream a pair: the draws do not depend on who draws.
        let mut random = Pcg64::new(u128::from(self.seed), number as u128);
        let mut drawn = *nominal;
        let deviations: Vec<f64> = self
            .scatter
            .iter()
            .map(|(parameter, scatter)| {
                let by = match scatter {
                    Scatter::Normal(sigma) => {
                        let standard: f64 = StandardNormal.sample(&mut random);
                        sigma * standard
                    }
                    Scatter::Uniform(half_width) => half_width * (2.0 * random.random::<f64>() - 1.0),
                };
                drawn.add(*parameter, by, self.load_nm);
                by
            })
            .collect();
        let weights = drawn.weights();
        for (buffer, curves) in buffers.iter_mut().zip(&basis.te) {
            buffer.fill(0.0);
            for (weight, curve) in weights.iter().zip(curves) {
                if *weight != 0.0 {
                    for (sum, value) in buffer.iter_mut().zip(curve) {
                        *sum += weight * value;
                    }
                }
            }
        }
        let [ccw, cw] = &*buffers;
        let mut spans = [(f64::INFINITY, f64::NEG_INFINITY); 3];
        let mut total = 0.0;
        for (ccw, cw) in ccw.iter().zip(cw) {
            for (span, value) in spans.iter_mut().zip([*ccw, *cw, cw - ccw]) {
                // Branch-free minimum and maximum: no value is NaN.
                span.0 = if value < span.0 { value } else { span.0 };
                span.1 = if value > span.1 { value } else { span.1 };
            }
            total += cw - ccw;
        }
        let pp = |span: (f64, f64)| span.1 - span.0;
        (deviations, [pp(spans[0]), pp(spans[1]), spans[2].0, total / self.angles as f64, pp(spans[2])])
    }
}

fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0))
}

/// Var(E[y|x])/Var(y): the pairs are put in the order of the parameter, in classes of equal number; the classes' means scatter
/// by the parameter's effect and by chance, and the latter is known from the scatter within.
fn first_order_share(values: &[f64], order: &[usize]) -> f64 {
    let classes = ((values.len() as f64).sqrt() / 4.0).clamp(2.0, 64.0) as usize;
    let (mean, variance) = mean_and_variance(values);
    if variance <= 0.0 || values.len() < 4 * classes {
        return 0.0;
    }
    let size = values.len() / classes;
    let (mut between, mut within) = (0.0, 0.0);
    for class in order.chunks_exact(size).take(classes) {
        let class: Vec<f64> = class.iter().map(|index| values[*index]).collect();
        let (class_mean, class_variance) = mean_and_variance(&class);
        between += (class_mean - mean).powi(2) / classes as f64;
        within += class_variance / classes as f64;
    }
    ((between - within / size as f64) / variance).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::{EllipticalSpec, GearPair, ToothSpec};

    fn model() -> NominalModel {
        let pair = GearPair::elliptical(&EllipticalSpec {
            teeth: ToothSpec { backlash_mm: 0.1, ..Default::default() },
            ..Default::default()
        })
        .unwrap();
        NominalModel::new(pair, Errors { e1_mm: 0.02, phi1_rad: 0.4, ..Default::default() }).unwrap()
    }

    #[test]
    fn nothing_scatters_gives_the_nominal_figures() {
        let model = model();
        let study = ToleranceStudy { pairs: 16, ..Default::default() };
        let figures = study.run(&model, &|_| {}).unwrap();
        let te: Vec<f64> = (0..720).map(|n| model.te_rad(TAU * f64::from(n) / 720.0, Direction::Ccw, 0.0)).collect();
        let pp = te.iter().copied().fold(f64::MIN, f64::max) - te.iter().copied().fold(f64::MAX, f64::min);
        assert!((figures[0].mean_rad - pp).abs() < 1e-15 && figures[0].std_rad < 1e-18);
        assert!((figures[0].quantile_rad(0.5) - pp).abs() < 1e-15);
    }

    #[test]
    fn draws_depend_on_the_seed_alone_and_shares_find_the_cause() {
        let model = model();
        let scatter = vec![
            (Parameter::E2Mm, Scatter::Normal(0.01)),
            (Parameter::Phi2Rad, Scatter::Uniform(PI)),
            (Parameter::BacklashMm, Scatter::Normal(0.02)),
            (Parameter::ShaftComplianceOutputRadPerNm, Scatter::Uniform(1e-6)),
        ];
        let study = ToleranceStudy { scatter, pairs: 20_000, angles: 90, load_nm: 10.0, ..Default::default() };
        let one = study.run(&model, &|_| {}).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(pool.install(|| study.run(&model, &|_| {})).unwrap(), one);
        assert_ne!(ToleranceStudy { seed: 1, ..study }.run(&model, &|_| {}).unwrap(), one);
        // The mean backlash is made by the thinning, the peak-to-peak of TE not by the compliance.
        let share = |figure: usize, n: usize| one[figure].shares[n].1;
        assert!(share(3, 2) > 0.7 && share(0, 3) < 0.02, "{:?} {:?}", one[3].shares, one[0].shares);
        assert!(one[0].quantile_rad(0.95) > one[0].quantile_rad(0.5));
    }

    #[test]
    fn what_is_no_error_is_refused() {
        let run = |scatter| ToleranceStudy { scatter, pairs: 10, ..Default::default() }.run(&model(), &|_| {});
        let design = run(vec![(Parameter::Eccentricity, Scatter::Normal(0.1))]);
        assert_eq!(design, Err(ToleranceError::Design { parameter: "eccentricity" }));
        let e1 = (Parameter::E1Mm, Scatter::Normal(0.1));
        assert_eq!(run(vec![e1, e1]), Err(ToleranceError::Twice { parameter: "e1_mm" }));
        assert!(matches!(run(vec![(Parameter::E1Mm, Scatter::Normal(f64::NAN))]), Err(ToleranceError::Range(_))));
    }
}
