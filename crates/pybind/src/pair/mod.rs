//! `GearPair`: a pair with its documented errors.

use std::path::PathBuf;

use gearmodel::{CircularSpec, Direction, EllipticalSpec, NominalModel, PairFile, PairSpec};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};

use crate::array::{Numbers, is_scalar};
use crate::error::{InputError, Result};
use crate::errors::Errors;
use crate::increment::{self, Method};

/// A pair of gears that closes, with its documented errors: the nominal model.
///
/// Made by :meth:`elliptical`, :meth:`circular`, :meth:`constant` or :meth:`from_toml`. Instances do not change.
/// The driver's angle theta1 and the driven angle theta2 = f(theta1) are in rad, both positive in the ccw sense of the
/// driver; f is unwrapped and increasing. Methods of theta1 take a number or any array-like of any shape and give a float
/// or a float64 array of the same shape; NaN stays NaN. Long arrays are shared over the cores with the GIL released.
///
/// >>> import gearmodel as gm
/// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
/// >>> round(pair.centre_distance_mm, 3)
/// 145.0
#[pyclass(frozen, eq, module = "gearmodel", name = "GearPair")]
#[derive(PartialEq)]
pub struct GearPair {
    pub file: PairFile,
    pub model: NominalModel,
}

impl GearPair {
    pub fn from_file(file: PairFile) -> Result<Self> {
        let model = file.model()?;
        Ok(Self { file, model })
    }

    fn from_spec(gears: PairSpec) -> Result<Self> {
        Self::from_file(PairFile { gears, documented: gearmodel::Errors::default() })
    }

    /// The model with the pair's own errors, or with those given.
    fn model_with(&self, errors: Option<&Errors>) -> NominalModel {
        // The constructor of Errors has checked them.
        NominalModel { pair: self.model.pair.clone(), errors: errors.map_or(self.model.errors, |errors| errors.0) }
    }
}

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

/// Text of a pair file: the argument itself where it has a line break, which no path has, else what the file holds.
fn toml_text(given: &Bound<'_, PyAny>) -> Result<String> {
    if let Ok(text) = given.cast::<PyString>() {
        let text = text.to_str()?;
        if text.contains('\n') {
            return Ok(text.to_owned());
        }
    }
    let path: PathBuf = given.extract()?;
    Ok(std::fs::read_to_string(&path).map_err(|error| crate::error::file_error(&path, &error))?)
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
        Self::from_spec(PairSpec::Elliptical(EllipticalSpec {
            module_mm,
            teeth: self::teeth(teeth)?,
            eccentricity,
            pressure_angle_deg,
            centre_distance_mm,
            backlash_mm,
            face_width_mm,
            addendum,
            dedendum_clearance,
        }))
    }

    /// Circular gears.
    ///
    /// Args:
    ///     module_mm: module m of the rack, mm.
    ///     teeth: of both gears, or (driver, driven).
    ///     pressure_angle_deg: alpha of the rack, deg.
    ///     centre_distance_mm: that of the drawing, mm; checked against m (Z1 + Z2)/2. None: that one.
    ///     backlash_mm: designed backlash of both gears together along the pitch circle, mm.
    ///     face_width_mm: mm.
    ///     addendum: in modules.
    ///     dedendum_clearance: over the mate's addendum, in modules.
    ///
    /// Raises:
    ///     GeometryError: a number outside its range, or another centre distance.
    ///
    /// >>> import gearmodel as gm
    /// >>> gm.GearPair.circular(module_mm=3, teeth=(47, 31)).centre_distance_mm
    /// 117.0
    #[staticmethod]
    #[pyo3(signature = (*, module_mm, teeth, pressure_angle_deg=20.0, centre_distance_mm=None, backlash_mm=0.0,
        face_width_mm=30.0, addendum=1.0, dedendum_clearance=0.25))]
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
        Self::from_spec(PairSpec::Circular(CircularSpec {
            module_mm,
            teeth: self::teeth(teeth)?,
            pressure_angle_deg,
            centre_distance_mm,
            backlash_mm,
            face_width_mm,
            addendum,
            dedendum_clearance,
        }))
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

    /// Reads a ``pair.toml``.
    ///
    /// Args:
    ///     source: path of the file, or its text (anything with a line break).
    ///
    /// Raises:
    ///     GeometryError: the text does not describe a pair; names the line and the key, or the quantity.
    ///     OSError: the file cannot be read.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=2, teeth=(20, 31))
    /// >>> gm.GearPair.from_toml(pair.to_toml()) == pair
    /// True
    #[staticmethod]
    fn from_toml(source: &Bound<'_, PyAny>) -> Result<Self> {
        Self::from_file(PairFile::parse(&toml_text(source)?)?)
    }

    /// The text of a ``pair.toml`` that :meth:`from_toml` reads back to an equal pair; written to `path` too, where given.
    ///
    /// Raises:
    ///     OSError: the file cannot be written.
    #[pyo3(signature = (path=None))]
    fn to_toml(&self, path: Option<PathBuf>) -> Result<String> {
        let text = self.file.to_toml();
        if let Some(path) = path {
            std::fs::write(&path, &text).map_err(|error| crate::error::file_error(&path, &error))?;
        }
        Ok(text)
    }

    /// Kind of pair as in ``pair.toml``: "elliptical", "circular", "constant".
    #[getter]
    fn kind(&self) -> &'static str {
        self.model.pair.kind()
    }

    /// Module, mm; 0 without teeth.
    #[getter]
    fn module_mm(&self) -> f64 {
        self.model.pair.module_mm()
    }

    /// Teeth of driver and driven gear; (0, 0) without teeth.
    #[getter]
    fn teeth(&self) -> (u32, u32) {
        self.model.pair.teeth()
    }

    /// Pressure angle alpha of the rack, rad.
    #[getter]
    fn pressure_angle_rad(&self) -> f64 {
        self.model.pair.pressure_angle_rad()
    }

    /// Designed backlash of both gears together along the pitch curve, mm.
    #[getter]
    fn backlash_mm(&self) -> f64 {
        self.model.pair.backlash_mm()
    }

    /// Face width, mm.
    #[getter]
    fn face_width_mm(&self) -> f64 {
        self.model.pair.face_width_mm()
    }

    /// Addendum, in modules.
    #[getter]
    fn addendum(&self) -> f64 {
        self.model.pair.addendum()
    }

    /// Clearance of the dedendum over the mate's addendum, in modules.
    #[getter]
    fn dedendum_clearance(&self) -> f64 {
        self.model.pair.dedendum_clearance()
    }

    /// Centre distance that closes, mm.
    #[getter]
    fn centre_distance_mm(&self) -> f64 {
        self.model.pair.centre_distance_mm()
    }

    /// Half the sum of the driver's largest and smallest radius, mm: A of an ellipse, the radius of a circle.
    #[getter]
    fn semi_major_mm(&self) -> f64 {
        self.model.pair.semi_major_mm()
    }

    /// Perimeter of the driver's pitch curve, mm: pi m Z1.
    #[getter]
    fn perimeter_mm(&self) -> f64 {
        self.model.pair.perimeter_mm()
    }

    /// Turns of the driven gear a turn of the driver, (1/2 pi) times the integral of i21 over a turn.
    #[getter]
    fn closure(&self) -> f64 {
        self.model.pair.closure()
    }

    /// The documented errors that the nominal model contains.
    #[getter]
    fn errors(&self) -> Errors {
        Errors(self.model.errors)
    }

    /// The same pair with these documented errors in place of its own.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=2, teeth=30).with_errors(gm.Errors(e1_mm=0.02))
    /// >>> pair.errors.e1_mm
    /// 0.02
    fn with_errors(&self, errors: &Errors) -> Result<Self> {
        Self::from_file(PairFile { gears: self.file.gears.clone(), documented: errors.0 })
    }

    /// Driven angle f(theta1), rad: unwrapped, increasing.
    ///
    /// Error: closed form; 1e-10 rad within a few turns. Source: tan(theta2/2) = ((1 + k)/(1 - k)) tan(theta1/2) for the ellipse.
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    /// >>> pair.theta2(np.zeros((2, 3))).shape
    /// (2, 3)
    /// >>> round(pair.theta2(np.pi / 2), 6)
    /// 2.205946
    fn theta2<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>) -> Result<Bound<'py, PyAny>> {
        Numbers::take("theta1", theta1)?.map(py, |theta1_rad| self.model.pair.theta2(theta1_rad))
    }

    /// Driver angle at which f(theta1) = theta2, rad: the inverse of :meth:`theta2`.
    fn theta1<'py>(&self, py: Python<'py>, theta2: &Bound<'py, PyAny>) -> Result<Bound<'py, PyAny>> {
        Numbers::take("theta2", theta2)?.map(py, |theta2_rad| self.model.pair.theta2_inverse(theta2_rad))
    }

    /// Ratio i21 = d theta2 / d theta1 = r1/r2.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.6)
    /// >>> round(pair.ratio(0.0), 9)
    /// 4.0
    #[pyo3(signature = (theta1=None))]
    fn ratio<'py>(&self, py: Python<'py>, theta1: Option<&Bound<'py, PyAny>>) -> Result<Bound<'py, PyAny>> {
        let theta1 = theta1.map_or(Ok(Numbers::One(0.0)), |theta1| Numbers::take("theta1", theta1))?;
        theta1.map(py, |theta1_rad| self.model.pair.ratio(theta1_rad))
    }

    /// Pitch radius at the pitch point, mm: r1 of the driver (gear 1) or r2 = a - r1 of the driven gear (gear 2), both over
    /// the driver's angle.
    ///
    /// Raises:
    ///     ValueError: another gear than 1 or 2.
    #[pyo3(signature = (theta1, gear=1))]
    fn radius<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>, gear: i64) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        match gear {
            1 => theta1.map(py, |theta1_rad| self.model.pair.radius(theta1_rad)),
            2 => theta1.map(py, |theta1_rad| self.model.pair.driven_radius(theta1_rad)),
            _ => Err(InputError::Gear { given: gear }.into()),
        }
    }

    /// Inclination mu of the pitch curves' common tangent from the perpendicular of the centre line, rad: tan mu = r1'/r1.
    fn inclination<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>) -> Result<Bound<'py, PyAny>> {
        Numbers::take("theta1", theta1)?.map(py, |theta1_rad| self.model.pair.inclination(theta1_rad))
    }

    /// Arc length s(theta1) of the driver's pitch curve from theta1 = 0, mm, unwrapped; s/(pi m) counts the teeth.
    fn arc_length_mm<'py>(&self, py: Python<'py>, theta1: &Bound<'py, PyAny>) -> Result<Bound<'py, PyAny>> {
        Numbers::take("theta1", theta1)?.map(py, |theta1_rad| self.model.pair.arc_length_mm(theta1_rad))
    }

    /// Predicted TE = theta2 - f(theta1), rad at the driven shaft, positive when the driven gear is ahead.
    ///
    /// Args:
    ///     theta1: driver angle, rad; a number or an array-like of any shape.
    ///     errors: these errors in place of the pair's own; None: its own.
    ///     direction: "ccw" or "cw", the driver's sense of rotation and with it the flank that carries. TE of both senses
    ///         counts in the same positive sense of theta2.
    ///     method: "common_normal" (default), "exact" or "published".
    ///         common_normal: meshing line increment over the driven base arm r2 cos(alpha -+ mu); designed backlash
    ///         included; first order in the errors: 0.03 % (k = 0.3287) to 0.07 % (k = 0.6) of the RMS for e = 0.05 mm.
    ///         exact: rigid contact of rack-generated flanks, solved to 1e-12 mm.
    ///         published: the printed equations of the source document, kept for comparison; 52 to 78 % off.
    ///     load_nm: torque on the driven shaft, N m; winds up the compliances of the errors. 0 with "published".
    ///     relative_to_start: subtract the value at theta1 = 0. "published" keeps its printed start terms either way.
    ///
    /// Returns:
    ///     A float, or a float64 array in the shape of theta1.
    ///
    /// Raises:
    ///     ValueError: an unknown direction or method, or a load that the method cannot take.
    ///     GeometryError: no tooth contact at an angle ("exact").
    ///
    /// >>> import gearmodel as gm, numpy as np
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    /// >>> errors = gm.Errors(e1_mm=0.05, phi1_rad=0.3, e2_mm=0.03, phi2_rad=1.1)
    /// >>> te = pair.transmission_error(np.linspace(0, 2 * np.pi, 721), errors)
    /// >>> print(f"{np.ptp(te) * 1e6:.0f} urad p-p")
    /// 2661 urad p-p
    #[pyo3(signature = (theta1, errors=None, direction="ccw", method="common_normal", load_nm=0.0, relative_to_start=false))]
    fn transmission_error<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        errors: Option<&Bound<'py, Errors>>,
        direction: &str,
        method: &str,
        load_nm: f64,
        relative_to_start: bool,
    ) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        let (direction, method) = (direction.parse::<Direction>()?, Method::parse(method)?);
        let model = self.model_with(errors.map(Bound::get));
        increment::transmission_error(py, &model, &theta1, direction, method, load_nm, relative_to_start)
    }

    /// Predicted backlash TE_cw - TE_ccw at equal theta1, rad at the driven shaft: designed and periodic.
    ///
    /// Args:
    ///     theta1: driver angle, rad; a number or an array-like of any shape.
    ///     errors: these errors in place of the pair's own; None: its own.
    ///     method: as in :meth:`transmission_error`; "published" is the printed periodic part alone.
    ///     load_nm: torque on the driven shaft, N m.
    ///
    /// Returns:
    ///     A float, or a float64 array in the shape of theta1.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=3, teeth=47, backlash_mm=0.1)
    /// >>> round(pair.backlash(0.0) * 70.5, 12)     # j = b r2
    /// 0.1
    #[pyo3(signature = (theta1, errors=None, method="common_normal", load_nm=0.0))]
    fn backlash<'py>(
        &self,
        py: Python<'py>,
        theta1: &Bound<'py, PyAny>,
        errors: Option<&Bound<'py, Errors>>,
        method: &str,
        load_nm: f64,
    ) -> Result<Bound<'py, PyAny>> {
        let theta1 = Numbers::take("theta1", theta1)?;
        let model = self.model_with(errors.map(Bound::get));
        increment::backlash(py, &model, &theta1, Method::parse(method)?, load_nm)
    }

    /// The call that makes an equal pair.
    fn __repr__(&self) -> String {
        let tooth_data = |module_mm: f64, teeth: (u32, u32)| {
            let pair = &self.model.pair;
            let teeth = if teeth.0 == teeth.1 { teeth.0.to_string() } else { format!("{teeth:?}") };
            let alpha_deg = match &self.file.gears {
                PairSpec::Elliptical(spec) => spec.pressure_angle_deg,
                PairSpec::Circular(spec) => spec.pressure_angle_deg,
                _ => pair.pressure_angle_rad().to_degrees(),
            };
            let mut text = format!("module_mm={module_mm:?}, teeth={teeth}, pressure_angle_deg={alpha_deg:?}");
            for (name, value, usual) in [
                ("backlash_mm", pair.backlash_mm(), 0.0),
                ("face_width_mm", pair.face_width_mm(), 30.0),
                ("addendum", pair.addendum(), 1.0),
                ("dedendum_clearance", pair.dedendum_clearance(), 0.25),
            ] {
                if value != usual {
                    text.push_str(&format!(", {name}={value:?}"));
                }
            }
            text
        };
        let pair = match &self.file.gears {
            PairSpec::Elliptical(spec) => format!(
                "GearPair.elliptical({}, eccentricity={:?}{})",
                tooth_data(spec.module_mm, spec.teeth),
                spec.eccentricity,
                spec.centre_distance_mm.map_or_else(String::new, |a| format!(", centre_distance_mm={a:?}")),
            ),
            PairSpec::Circular(spec) => format!(
                "GearPair.circular({}{})",
                tooth_data(spec.module_mm, spec.teeth),
                spec.centre_distance_mm.map_or_else(String::new, |a| format!(", centre_distance_mm={a:?}")),
            ),
            PairSpec::Constant { ratio } => format!("GearPair.constant(ratio={ratio:?})"),
            _ => format!("GearPair.from_toml({:?})", self.file.to_toml()),
        };
        if self.model.errors == gearmodel::Errors::default() {
            pair
        } else {
            format!("{pair}.with_errors({})", Errors(self.model.errors).__repr__())
        }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Result<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let text = slf.get().file.to_toml();
        Ok((slf.get_type().getattr("from_toml")?, (text,).into_pyobject(slf.py())?))
    }
}
