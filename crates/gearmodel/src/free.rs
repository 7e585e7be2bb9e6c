//! Pairs with free pitch curves.

use std::f64::consts::{PI, TAU};

use crate::geometry_error::{GeometryError, check_range};
use crate::pair::check_centre_distance;
use crate::pitch_curve::shape::{Spline, closing_distance, fourier};
use crate::pitch_curve::{AnyCurve, Lobed, MAX_ECCENTRICITY, Numeric, PitchCurve, highest};
use crate::spec::{CurveSpec, ToothSpec};
use crate::{Gear, GearPair};

/// Highest harmonic of a Fourier curve.
const MAX_HARMONICS: usize = 256;
/// Most samples of a sampled curve.
const MAX_SAMPLES: usize = 20_000;
/// Most lobes.
const MAX_LOBES: u32 = 64;

impl GearPair {
    /// A pair whose driver has a free pitch curve, with the mate that closes.
    ///
    /// # Errors
    /// [`GeometryError`] for a number outside its range, a curve that is not positive, harmonics whose mate would not
    /// repeat, or a centre distance that does not close. Whether the teeth can be cut is asked by [`GearPair::check_teeth`].
    pub fn free(teeth: &ToothSpec, curve: &CurveSpec) -> Result<Self, GeometryError> {
        teeth.check()?;
        let (z1, z2) = teeth.teeth;
        let closure = f64::from(z1) / f64::from(z2);
        let curve: AnyCurve = match curve {
            CurveSpec::Lobed { eccentricity, lobes } => lobed(*eccentricity, *lobes, teeth.teeth)?.into(),
            CurveSpec::Fourier { cosines, sines } => {
                check_harmonics(cosines, sines, teeth.teeth)?;
                let radius = |theta: f64| fourier(cosines, sines, theta);
                from_radius("fourier", &[], closure, radius)?.into()
            }
            CurveSpec::Sampled { theta1_rad, radius } => {
                check_samples(theta1_rad, radius)?;
                let spline = Spline::new(theta1_rad, radius);
                check_repetition(&spline, teeth.teeth)?;
                from_radius("sampled", theta1_rad, closure, |theta| spline.at(theta))?.into()
            }
            CurveSpec::Transmission { cosines, sines } => {
                check_harmonics(cosines, sines, teeth.teeth)?;
                let ratio = |theta: f64| {
                    let (value, slope) = fourier(cosines, sines, theta);
                    (closure * value, closure * slope)
                };
                check_positive("ratio", |theta| ratio(theta).0)?;
                Numeric::from_ratio("transmission", &[], closure, ratio).into()
            }
        };
        let closing_mm = PI * teeth.module_mm * f64::from(z1) / curve.arc(TAU);
        if let Some(given_mm) = teeth.centre_distance_mm {
            let radius = |theta: f64| {
                let i = curve.ratio(theta);
                i / (1.0 + i)
            };
            let (at, largest) = highest(radius);
            check_centre_distance(given_mm, closing_mm, closure, (largest, at), |distance| {
                // A refusal needs no more than the trapezoidal rule gives.
                let steps = 4096;
                let turns = |n: i32| {
                    let r = radius(TAU * f64::from(n) / f64::from(steps));
                    r / (distance - r)
                };
                (distance > largest).then(|| (0..steps).map(turns).sum::<f64>() / f64::from(steps))
            })?;
        }
        teeth.pair(curve, closing_mm)
    }

    /// Radius of curvature of a gear's pitch curve at θ1, mm: positive where convex, negative where concave.
    #[must_use]
    pub fn curvature_radius_mm(&self, gear: Gear, theta1_rad: f64) -> f64 {
        1.0 / self.pitch_curvature(gear, &self.roll(theta1_rad))
    }
}

fn lobed(k: f64, lobes: (u32, u32), teeth: (u32, u32)) -> Result<Lobed, GeometryError> {
    check_range("eccentricity", k, "", (0.0, MAX_ECCENTRICITY), "k of r1 = p/(1 - k cos n1 theta1)")?;
    for lobes in [lobes.0, lobes.1] {
        let range = (1.0, f64::from(MAX_LOBES));
        check_range("lobes", f64::from(lobes), "", range, "give the lobes of both gears, as [2, 3]")?;
    }
    if u64::from(teeth.0) * u64::from(lobes.1) != u64::from(teeth.1) * u64::from(lobes.0) {
        return Err(GeometryError::TeethRatio {
            kind: "lobed",
            teeth1: teeth.0,
            teeth2: teeth.1,
            needed: f64::from(teeth.0) * f64::from(lobes.1) / f64::from(lobes.0),
        });
    }
    Ok(Lobed::new(k, lobes))
}

fn from_radius(
    kind: &'static str,
    knots_rad: &[f64],
    closure: f64,
    radius: impl Fn(f64) -> (f64, f64),
) -> Result<Numeric, GeometryError> {
    check_positive("radius", |theta| radius(theta).0)?;
    let distance = closing_distance(knots_rad, closure, |theta| radius(theta).0)
        .ok_or(GeometryError::NoClosingDistance { closure_needed: closure })?;
    Ok(Numeric::from_radius(kind, knots_rad, closure, distance, radius))
}

/// A thousandth of the mean radius is no gear any more.
fn check_positive(quantity: &'static str, function: impl Fn(f64) -> f64) -> Result<(), GeometryError> {
    let (theta1_rad, lowest) = highest(|theta| -function(theta));
    let mean = (0..256).map(|n| function(TAU * f64::from(n) / 256.0)).sum::<f64>() / 256.0;
    let value = -lowest / mean;
    if value.is_nan() || value < 1e-3 || mean <= 0.0 {
        return Err(GeometryError::NotPositive { quantity, value, theta1_rad });
    }
    Ok(())
}

/// Repetitions a turn that gear 1 must have: the mate turns once while gear 1 turns Z2/Z1 times, so a pattern of gear 1 must
/// be the same after Z2/Z1 of a turn and after a turn; with Z1/Z2 = n1/n2 in lowest terms, after 1/n1 of a turn.
fn repetitions((z1, z2): (u32, u32)) -> u32 {
    let (mut a, mut b) = (z1, z2);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    z1 / a.max(1)
}

fn check_harmonics(cosines: &[f64], sines: &[f64], teeth: (u32, u32)) -> Result<(), GeometryError> {
    let needed = repetitions(teeth);
    for (quantity, list) in [("cosines", cosines), ("sines", sines)] {
        if list.len() > MAX_HARMONICS {
            return Err(GeometryError::Length { quantity, given: list.len(), lower: 0, upper: MAX_HARMONICS });
        }
        for (order, value) in (1_u32..).zip(list) {
            check_range(quantity, *value, "", (-1.0, 1.0), "amplitudes are relative to the mean")?;
            if *value != 0.0 && order % needed != 0 {
                return Err(GeometryError::Harmonic { order, teeth1: teeth.0, teeth2: teeth.1, needed });
            }
        }
    }
    Ok(())
}

fn check_samples(theta1_rad: &[f64], radius: &[f64]) -> Result<(), GeometryError> {
    let (lower, upper) = (4, MAX_SAMPLES);
    for (quantity, given) in [("theta1_rad", theta1_rad.len()), ("radius", radius.len())] {
        if !(lower..=upper).contains(&given) {
            return Err(GeometryError::Length { quantity, given, lower, upper });
        }
    }
    if radius.len() != theta1_rad.len() {
        let (lower, upper) = (theta1_rad.len(), theta1_rad.len());
        return Err(GeometryError::Length { quantity: "radius", given: radius.len(), lower, upper });
    }
    for (index, (theta, radius)) in theta1_rad.iter().zip(radius).enumerate() {
        let problem = if !theta.is_finite() || !radius.is_finite() {
            Some("angle and radius must be finite")
        } else if *radius <= 0.0 || *radius > 1e9 {
            Some("the radius must be positive")
        } else if index > 0 && *theta - theta1_rad[index - 1] < 1e-6 {
            Some("the angle must be larger than the one before (by 1e-6 rad)")
        } else if *theta - theta1_rad[0] > TAU - 1e-6 {
            Some("the angles must lie within one turn; leave out the repeated first point")
        } else {
            None
        };
        if let Some(problem) = problem {
            return Err(GeometryError::Sample { index, problem });
        }
    }
    Ok(())
}

/// Samples repeat as often as closure needs, to a ten-thousandth of the radius.
fn check_repetition(spline: &Spline, teeth: (u32, u32)) -> Result<(), GeometryError> {
    let needed = repetitions(teeth);
    if needed == 1 {
        return Ok(());
    }
    let period = TAU / f64::from(needed);
    let (_, worst) = highest(|theta| (spline.at(theta + period).0 / spline.at(theta).0 - 1.0).abs());
    if worst > 1e-4 {
        return Err(GeometryError::Harmonic { order: 1, teeth1: teeth.0, teeth2: teeth.1, needed });
    }
    Ok(())
}
