//! `GearPair`: a pair with its documented errors. Its methods stand in files of one idea each.

pub mod drawing;
mod increment;
mod kinematics;
pub mod loaded;
mod make;
pub mod phases;

use std::path::PathBuf;

use gearmodel::{CurveSpec, NominalModel, PairFile, PairSpec, ToothSpec};
use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};

use crate::error::Result;
use crate::errors::Errors;

/// A pair of gears that closes, with its documented errors: the nominal model.
///
/// Made by :meth:`elliptical`, :meth:`circular`, :meth:`lobed`, :meth:`fourier`, :meth:`sampled`, :meth:`transmission`,
/// :meth:`constant` or :meth:`from_toml`. Instances do not change.
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
        Self::from_file(PairFile { gears, documented: gearmodel::Errors::default(), effects: Default::default() })
    }

    /// The model with the pair's own errors, or with those given; its documented effects stay.
    pub fn model_with(&self, errors: Option<&Errors>) -> Result<NominalModel> {
        Ok(match errors {
            None => self.model.clone(),
            Some(errors) => {
                let file = self.file.with_errors(errors.0);
                NominalModel::with_effects(self.model.pair.clone(), file.documented, &file.effects)?
            }
        })
    }
}

/// The call of a constructor with teeth; sizes that are usual are left out.
fn tooth_call(kind: &str, spec: &ToothSpec, own: &str) -> String {
    let teeth = if spec.teeth.0 == spec.teeth.1 { spec.teeth.0.to_string() } else { format!("{:?}", spec.teeth) };
    let mut text = format!("GearPair.{kind}(module_mm={:?}, teeth={teeth}", spec.module_mm);
    if !own.is_empty() {
        text.push_str(", ");
        text.push_str(own);
    }
    let usual = ToothSpec::default();
    for (name, value, usual) in [
        ("pressure_angle_deg", spec.pressure_angle_deg, usual.pressure_angle_deg),
        ("backlash_mm", spec.backlash_mm, usual.backlash_mm),
        ("face_width_mm", spec.face_width_mm, usual.face_width_mm),
        ("addendum", spec.addendum, usual.addendum),
        ("dedendum_clearance", spec.dedendum_clearance, usual.dedendum_clearance),
    ] {
        if value != usual {
            text.push_str(&format!(", {name}={value:?}"));
        }
    }
    if let Some(distance_mm) = spec.centre_distance_mm {
        text.push_str(&format!(", centre_distance_mm={distance_mm:?}"));
    }
    text.push(')');
    text
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

    /// Kind of pair as in ``pair.toml``: "elliptical", "circular", "lobed", "fourier", "sampled", "transmission", "constant".
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

    /// Names of the documented effects beyond those errors, as a calibrated model has them.
    #[getter]
    fn effects(&self) -> Vec<&'static str> {
        self.model.effects.terms().iter().map(|term| term.effect.name()).collect()
    }

    /// The same pair with these documented errors in place of its own; documented effects stay.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=2, teeth=30).with_errors(gm.Errors(e1_mm=0.02))
    /// >>> pair.errors.e1_mm
    /// 0.02
    fn with_errors(&self, errors: &Errors) -> Result<Self> {
        Self::from_file(self.file.with_errors(errors.0))
    }

    /// The call that makes an equal pair.
    fn __repr__(&self) -> String {
        if !self.file.effects.is_empty() {
            return format!("GearPair.from_toml({:?})", self.file.to_toml());
        }
        let pair = match &self.file.gears {
            PairSpec::Elliptical(spec) => {
                tooth_call("elliptical", &spec.teeth, &format!("eccentricity={:?}", spec.eccentricity))
            }
            PairSpec::Circular(teeth) => tooth_call("circular", teeth, ""),
            PairSpec::Free { teeth, curve } => {
                let own = match curve {
                    CurveSpec::Lobed { eccentricity, lobes } => {
                        format!("eccentricity={eccentricity:?}, lobes={lobes:?}")
                    }
                    CurveSpec::Fourier { cosines, sines } | CurveSpec::Transmission { cosines, sines } => {
                        format!("cosines={cosines:?}, sines={sines:?}")
                    }
                    CurveSpec::Sampled { theta1_rad, radius } => {
                        format!("theta1_rad={theta1_rad:?}, radius={radius:?}")
                    }
                };
                tooth_call(self.kind(), teeth, &own)
            }
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
