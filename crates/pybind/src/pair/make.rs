//! The kinds of pairs, from what a drawing says.

use gearmodel::{CurveSpec, EllipticalSpec, PairSpec, ToothSpec};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::GearPair;
use crate::array::{column, is_scalar};
use crate::error::{InputError, Result};

/// `47` for both gears, or `(47, 31)`.
fn teeth(given: &Bound<'_, PyAny>) -> Result<(u32, u32)> {
    let number = |gear: u8, given: &Bound<'_, PyAny>| -> Result<u32> {
        if !is_scalar(given)? {
            let kind = given.get_type();
            return Err(
                PyTypeError::new_err(format!("teeth of gear {gear} are of type {kind}: an integer is needed")).into()
            );
        }
        // Whole floats are taken: tables and sweeps hold numbers that way.
        let number: f64 = given.extract().unwrap_or(f64::INFINITY);
        if number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number) {
            Ok(number as u32)
        } else {
            Err(InputError::Teeth { gear, given: given.to_string() }.into())
        }
    };
    if given.hasattr("__len__")? {
        if given.is_instance_of::<PyString>() || given.len()? != 2 {
            return Err(
                PyTypeError::new_err(format!("teeth = {given}: an integer or (driver, driven) is needed")).into()
            );
        }
        Ok((number(1, &given.get_item(0)?)?, number(2, &given.get_item(1)?)?))
    } else {
        Ok((number(1, given)?, number(2, given)?))
    }
}

/// Lobes as a whole number; how many there may be is the model's to say.
fn whole_lobes(gear: u8, given: f64) -> Result<u32> {
    if given.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&given) {
        Ok(given as u32)
    } else {
        Err(InputError::Lobes { gear, given }.into())
    }
}

/// Amplitudes of orders 1, 2, …; left out = none.
fn waves(field: &'static str, given: Option<&Bound<'_, PyAny>>) -> Result<Vec<f64>> {
    given.map_or(Ok(Vec::new()), |given| column(field, given))
}

/// Teeth and sizes from the arguments that all kinds with teeth share, in their order.
fn tooth_spec(
    module_mm: f64,
    teeth: &Bound<'_, PyAny>,
    pressure_angle_deg: f64,
    centre_distance_mm: Option<f64>,
    backlash_mm: f64,
    face_width_mm: f64,
    addendum: f64,
    dedendum_clearance: f64,
) -> Result<ToothSpec> {
    Ok(ToothSpec {
        module_mm,
        teeth: self::teeth(teeth)?,
        pressure_angle_deg,
        centre_distance_mm,
        backlash_mm,
        face_width_mm,
        addendum,
        dedendum_clearance,
    })
}

#[pymethods]
impl GearPair {
    /// Identical elliptic gears, each turning about a focus: r1 = p/(1 - k cos theta1).
    ///
    /// The tooth condition, perimeter = pi m Z, fixes the size; closure fixes the centre distance.
    ///
    /// Args:
    ///     module_mm: module m of the rack, mm.
    ///     teeth: Z of both gears, or a pair of equal numbers.
    ///     eccentricity: k of the pitch ellipse, 0 (circle) to below 1.
    ///     pressure_angle_deg: alpha of the rack, deg.
    ///     centre_distance_mm: that of the drawing, mm; checked against closure. None: the one that closes.
    ///     backlash_mm: designed backlash of both gears together along the pitch curve, mm.
    ///     face_width_mm: mm.
    ///     addendum: in modules.
    ///     dedendum_clearance: over the mate's addendum, in modules.
    ///
    /// Raises:
    ///     GeometryError: a number outside its range, or a centre distance that does not close; the text gives the closure
    ///         sum and the distance that closes.
    ///
    /// >>> import gearmodel as gm
    /// >>> gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287, centre_distance_mm=150)
    /// Traceback (most recent call last):
    /// ...
    /// gearmodel.GeometryError: centre distance 150 mm does not close: the driven gear turns 0.928484 times a turn of the driver instead of 1.000000; this pitch curve closes at 144.999717 mm
    #[staticmethod]
    #[pyo3(signature = (*, module_mm, teeth, eccentricity, pressure_angle_deg=20.0, centre_distance_mm=None,
        backlash_mm=0.0, face_width_mm=30.0, addendum=1.0, dedendum_clearance=0.25))]
    fn elliptical(
        module_mm: f64,
        teeth: &Bound<'_, PyAny>,
        eccentricity: f64,
        pressure_angle_deg: f64,
        centre_distance_mm: Option<f64>,
        backlash_mm: f64,
        face_width_mm: f64,
        addendum: f64,
        dedendum_clearance: f64,
    ) -> Result<Self> {
        #[rustfmt::skip]
        let teeth = tooth_spec(
            module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum, dedendum_clearance,
        )?;
        Self::from_spec(PairSpec::Elliptical(EllipticalSpec { teeth, eccentricity }))
    }

    /// Circular gears, of equal or different tooth numbers.
    ///
    /// Args:
    ///     module_mm: module m of the rack, mm.
    ///     teeth: Z of both gears, or (Z1, Z2).
    ///     pressure_angle_deg, backlash_mm, face_width_mm, addendum, dedendum_clearance: as in :meth:`elliptical`.
    ///     centre_distance_mm: that of the drawing, mm; checked against m (Z1 + Z2)/2. None: that one.
    ///
    /// Raises:
    ///     GeometryError: a number outside its range, or a centre distance that does not close.
    ///
    /// >>> import gearmodel as gm
    /// >>> gm.GearPair.circular(module_mm=2, teeth=(20, 40)).centre_distance_mm
    /// 60.0
    #[staticmethod]
    #[pyo3(signature = (*, module_mm, teeth, pressure_angle_deg=20.0, centre_distance_mm=None,
        backlash_mm=0.0, face_width_mm=30.0, addendum=1.0, dedendum_clearance=0.25))]
    fn circular(
        module_mm: f64,
        teeth: &Bound<'_, PyAny>,
        pressure_angle_deg: f64,
        centre_distance_mm: Option<f64>,
        backlash_mm: f64,
        face_width_mm: f64,
        addendum: f64,
        dedendum_clearance: f64,
    ) -> Result<Self> {
        #[rustfmt::skip]
        let teeth = tooth_spec(
            module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum, dedendum_clearance,
        )?;
        Self::from_spec(PairSpec::Circular(teeth))
    }

    /// Ellipses of higher order: r1 = p/(1 - k cos(n1 theta1)), n1 lobes driving n2.
    ///
    /// Args:
    ///     eccentricity: k, 0 to below 1; 3 lobes are convex up to k = 1/8.
    ///     lobes: (n1, n2) of driver and driven gear; the teeth stand in the same ratio.
    ///     module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum,
    ///         dedendum_clearance: as in :meth:`elliptical`; the tooth numbers fix the turns of the driven gear.
    ///
    /// Raises:
    ///     GeometryError: a number outside its range, teeth in another ratio, a centre distance that does not close.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.lobed(module_mm=2, teeth=(40, 60), eccentricity=0.1, lobes=(2, 3))
    /// >>> round(pair.closure, 12)
    /// 0.666666666667
    #[staticmethod]
    #[pyo3(signature = (*, module_mm, teeth, eccentricity, lobes, pressure_angle_deg=20.0, centre_distance_mm=None,
        backlash_mm=0.0, face_width_mm=30.0, addendum=1.0, dedendum_clearance=0.25))]
    fn lobed(
        module_mm: f64,
        teeth: &Bound<'_, PyAny>,
        eccentricity: f64,
        lobes: (f64, f64),
        pressure_angle_deg: f64,
        centre_distance_mm: Option<f64>,
        backlash_mm: f64,
        face_width_mm: f64,
        addendum: f64,
        dedendum_clearance: f64,
    ) -> Result<Self> {
        #[rustfmt::skip]
        let teeth = tooth_spec(
            module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum, dedendum_clearance,
        )?;
        let lobes = (whole_lobes(1, lobes.0)?, whole_lobes(2, lobes.1)?);
        Self::from_spec(PairSpec::Free { teeth, curve: CurveSpec::Lobed { eccentricity, lobes } })
    }

    /// A driver with the pitch curve r1 ~ 1 + sum of cosines[n-1] cos(n theta1) + sines[n-1] sin(n theta1), and its mate.
    ///
    /// The tooth condition scales the curve; the mate and the centre distance are solved for closure.
    ///
    /// Args:
    ///     cosines: amplitudes from order 1, relative to the mean radius.
    ///     sines: amplitudes from order 1.
    ///     module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum,
    ///         dedendum_clearance: as in :meth:`elliptical`; the tooth numbers fix the turns of the driven gear.
    ///
    /// Raises:
    ///     GeometryError: a curve that is not positive, orders with which the mate would not repeat, a centre distance that
    ///         does not close.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.fourier(module_mm=2, teeth=40, cosines=[0.1, 0.02])
    /// >>> round(pair.theta2(6.283185307179586), 9)
    /// 6.283185307
    #[staticmethod]
    #[pyo3(signature = (*, module_mm, teeth, cosines=None, sines=None, pressure_angle_deg=20.0, centre_distance_mm=None,
        backlash_mm=0.0, face_width_mm=30.0, addendum=1.0, dedendum_clearance=0.25))]
    fn fourier(
        module_mm: f64,
        teeth: &Bound<'_, PyAny>,
        cosines: Option<&Bound<'_, PyAny>>,
        sines: Option<&Bound<'_, PyAny>>,
        pressure_angle_deg: f64,
        centre_distance_mm: Option<f64>,
        backlash_mm: f64,
        face_width_mm: f64,
        addendum: f64,
        dedendum_clearance: f64,
    ) -> Result<Self> {
        #[rustfmt::skip]
        let teeth = tooth_spec(
            module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum, dedendum_clearance,
        )?;
        let (cosines, sines) = (waves("cosines", cosines)?, waves("sines", sines)?);
        Self::from_spec(PairSpec::Free { teeth, curve: CurveSpec::Fourier { cosines, sines } })
    }

    /// A driver whose pitch curve passes through samples, by a periodic cubic spline, and its mate.
    ///
    /// Args:
    ///     theta1_rad: angles, rad, increasing within one turn; the first point is not repeated at the end.
    ///     radius: radii at these angles, in any unit: the tooth condition scales them.
    ///     module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum,
    ///         dedendum_clearance: as in :meth:`elliptical`; the tooth numbers fix the turns of the driven gear.
    ///
    /// Raises:
    ///     GeometryError: samples that are not positive, finite and in order (names the index), or that do not repeat as the
    ///         tooth numbers need; a centre distance that does not close.
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> angle = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    /// >>> pair = gm.GearPair.sampled(module_mm=3, teeth=47, theta1_rad=angle, radius=1 / (1 - 0.3287 * np.cos(angle)))
    /// >>> round(pair.centre_distance_mm, 4)
    /// 144.9997
    #[staticmethod]
    #[pyo3(signature = (*, module_mm, teeth, theta1_rad, radius, pressure_angle_deg=20.0, centre_distance_mm=None,
        backlash_mm=0.0, face_width_mm=30.0, addendum=1.0, dedendum_clearance=0.25))]
    fn sampled(
        module_mm: f64,
        teeth: &Bound<'_, PyAny>,
        theta1_rad: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        pressure_angle_deg: f64,
        centre_distance_mm: Option<f64>,
        backlash_mm: f64,
        face_width_mm: f64,
        addendum: f64,
        dedendum_clearance: f64,
    ) -> Result<Self> {
        #[rustfmt::skip]
        let teeth = tooth_spec(
            module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum, dedendum_clearance,
        )?;
        let (theta1_rad, radius) = (column("theta1_rad", theta1_rad)?, column("radius", radius)?);
        Self::from_spec(PairSpec::Free { teeth, curve: CurveSpec::Sampled { theta1_rad, radius } })
    }

    /// A pair of given transmission i21 ~ 1 + sum of cosines[n-1] cos(n theta1) + sines[n-1] sin(n theta1), scaled so that
    /// it closes with the teeth.
    ///
    /// Args:
    ///     cosines: amplitudes from order 1, relative to the mean ratio.
    ///     sines: amplitudes from order 1.
    ///     module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum,
    ///         dedendum_clearance: as in :meth:`elliptical`; the tooth numbers fix the turns of the driven gear.
    ///
    /// Raises:
    ///     GeometryError: a ratio that is not positive, orders with which the mate would not repeat, a centre distance that
    ///         does not close.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.transmission(module_mm=2, teeth=40, cosines=[0.2])
    /// >>> round(pair.ratio(0.0), 9)
    /// 1.2
    #[staticmethod]
    #[pyo3(signature = (*, module_mm, teeth, cosines=None, sines=None, pressure_angle_deg=20.0, centre_distance_mm=None,
        backlash_mm=0.0, face_width_mm=30.0, addendum=1.0, dedendum_clearance=0.25))]
    fn transmission(
        module_mm: f64,
        teeth: &Bound<'_, PyAny>,
        cosines: Option<&Bound<'_, PyAny>>,
        sines: Option<&Bound<'_, PyAny>>,
        pressure_angle_deg: f64,
        centre_distance_mm: Option<f64>,
        backlash_mm: f64,
        face_width_mm: f64,
        addendum: f64,
        dedendum_clearance: f64,
    ) -> Result<Self> {
        #[rustfmt::skip]
        let teeth = tooth_spec(
            module_mm, teeth, pressure_angle_deg, centre_distance_mm, backlash_mm, face_width_mm, addendum, dedendum_clearance,
        )?;
        let (cosines, sines) = (waves("cosines", cosines)?, waves("sines", sines)?);
        Self::from_spec(PairSpec::Free { teeth, curve: CurveSpec::Transmission { cosines, sines } })
    }

    /// Any drive of constant ratio with two encoders (cycloidal, harmonic, belt): theta2 = theta1 / ratio.
    ///
    /// No teeth are known: r2 = 1 mm and alpha = 0 stand in.
    ///
    /// Args:
    ///     ratio: turns of the driver a turn of the driven shaft, > 0; ``pair.ratio()`` is 1/ratio.
    ///
    /// Raises:
    ///     GeometryError: a ratio that is not finite or not positive.
    ///
    /// >>> import gearmodel as gm
    /// >>> gm.GearPair.constant(ratio=81.0).theta2(8.1)
    /// 0.1
    #[staticmethod]
    fn constant(ratio: f64) -> Result<Self> {
        Self::from_spec(PairSpec::Constant { ratio })
    }
}
