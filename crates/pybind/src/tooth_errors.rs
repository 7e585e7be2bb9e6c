//! `ToothErrors`, `Profile`, `ToothDamage`: errors of single teeth.

use gearmodel::{Direction, contact};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::array::column;
use crate::error::Result;
use crate::pair::drawing::tooth_number;

/// The same profile deviation on every tooth of a flank, over the phase u in pitches of rolling from the pitch point.
///
/// Args:
///     slope_mm: lead a pitch of rolling, mm: a wrong pressure angle.
///     crown_mm: relief half a pitch from the pitch point, mm, growing with u squared.
///     waves: (amplitude mm, phase rad) of mesh order 1, 2, ...: lead = sum of amplitude cos(2 pi n u - phase).
///
/// >>> import gearmodel as gm
/// >>> gm.Profile(crown_mm=0.01)
/// Profile(slope_mm=0.0, crown_mm=0.01, waves=[])
#[pyclass(frozen, eq, module = "gearmodel", name = "Profile")]
#[derive(Clone, PartialEq)]
pub struct Profile(contact::Profile);

#[pymethods]
impl Profile {
    #[new]
    #[pyo3(signature = (*, slope_mm=0.0, crown_mm=0.0, waves=None))]
    fn new(slope_mm: f64, crown_mm: f64, waves: Option<Vec<(f64, f64)>>) -> Self {
        Self(contact::Profile { slope_mm, crown_mm, waves: waves.unwrap_or_default() })
    }

    /// Lead a pitch of rolling, mm.
    #[getter]
    fn slope_mm(&self) -> f64 {
        self.0.slope_mm
    }

    /// Relief half a pitch from the pitch point, mm.
    #[getter]
    fn crown_mm(&self) -> f64 {
        self.0.crown_mm
    }

    /// (amplitude mm, phase rad) of mesh order 1, 2, ...
    #[getter]
    fn waves(&self) -> Vec<(f64, f64)> {
        self.0.waves.clone()
    }

    /// The call that makes an equal profile.
    fn __repr__(&self) -> String {
        let contact::Profile { slope_mm, crown_mm, waves } = &self.0;
        format!("Profile(slope_mm={slope_mm:?}, crown_mm={crown_mm:?}, waves={waves:?})")
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("slope_mm", self.0.slope_mm)?;
        keywords.set_item("crown_mm", self.0.crown_mm)?;
        keywords.set_item("waves", self.waves())?;
        Ok((PyTuple::empty(py), keywords))
    }
}

/// Material missing on one flank of one driver tooth: a lag depth cos^2(pi u/(2 width)) for |u| < width.
///
/// Args:
///     tooth: 0 to Z1 - 1.
///     depth_mm: along the normal, mm.
///     width: in pitches of rolling; full at half depth.
///     flank: "ccw" or "cw", the driving sense in which it carries.
///
/// Raises:
///     ValueError: another flank, or a tooth below 0.
///
/// >>> import gearmodel as gm
/// >>> gm.ToothDamage(tooth=5, depth_mm=0.02, width=0.3)
/// ToothDamage(tooth=5, depth_mm=0.02, width=0.3, flank='ccw')
#[pyclass(frozen, eq, module = "gearmodel", name = "ToothDamage")]
#[derive(Clone, PartialEq)]
pub struct ToothDamage(contact::ToothDamage);

#[pymethods]
impl ToothDamage {
    #[new]
    #[pyo3(signature = (tooth, depth_mm, width, flank="ccw"))]
    fn new(tooth: i64, depth_mm: f64, width: f64, flank: &str) -> Result<Self> {
        let tooth = tooth_number(tooth)?;
        Ok(Self(contact::ToothDamage { tooth, flank: flank.parse::<Direction>()?, depth_mm, width }))
    }

    /// Tooth of the driver.
    #[getter]
    fn tooth(&self) -> u32 {
        self.0.tooth
    }

    /// Depth along the normal, mm.
    #[getter]
    fn depth_mm(&self) -> f64 {
        self.0.depth_mm
    }

    /// Width in pitches of rolling.
    #[getter]
    fn width(&self) -> f64 {
        self.0.width
    }

    /// "ccw" or "cw".
    #[getter]
    fn flank(&self) -> &'static str {
        self.0.flank.as_str()
    }

    /// The call that makes an equal damage.
    fn __repr__(&self) -> String {
        let contact::ToothDamage { tooth, flank, depth_mm, width } = self.0;
        format!("ToothDamage(tooth={tooth}, depth_mm={depth_mm:?}, width={width:?}, flank='{flank}')")
    }

    fn __getnewargs__(&self) -> (u32, f64, f64, &'static str) {
        (self.0.tooth, self.0.depth_mm, self.0.width, self.flank())
    }
}

/// Errors of the teeth of both gears; what is left out is perfect.
///
/// A lead is positive, in mm along the common normal, where it moves the driven gear ahead, in both senses: a tooth displaced
/// as a whole is equal on both flanks, a thicker tooth opposite. Of the pairs in contact the most advanced carries.
///
/// Args:
///     driver_ccw_mm, driver_cw_mm: lead of each driver tooth on its ccw and cw flank, mm, Z1 values.
///     driven_ccw_mm, driven_cw_mm: lead by each tooth space of the driven gear, mm, Z2 values; entry j mates with driver
///         tooth j.
///     profile_ccw, profile_cw: :class:`Profile` of the flanks of both gears together.
///     damage: list of :class:`ToothDamage`.
///
/// They are checked against a pair where they are used: GeometryError for a table of another length than the teeth, or an
/// error beyond the module.
///
/// >>> import gearmodel as gm
/// >>> pair = gm.GearPair.circular(module_mm=3, teeth=40)
/// >>> teeth = gm.ToothErrors(damage=[gm.ToothDamage(0, depth_mm=0.02, width=1.0)])
/// >>> te = pair.transmission_error(0.0, method="exact", tooth_errors=teeth)
#[pyclass(frozen, eq, module = "gearmodel", name = "ToothErrors")]
#[derive(PartialEq)]
pub struct ToothErrors(pub contact::ToothErrors);

#[pymethods]
impl ToothErrors {
    #[new]
    #[pyo3(signature = (*, driver_ccw_mm=None, driver_cw_mm=None, driven_ccw_mm=None, driven_cw_mm=None, profile_ccw=None,
        profile_cw=None, damage=None))]
    fn new(
        driver_ccw_mm: Option<&Bound<'_, PyAny>>,
        driver_cw_mm: Option<&Bound<'_, PyAny>>,
        driven_ccw_mm: Option<&Bound<'_, PyAny>>,
        driven_cw_mm: Option<&Bound<'_, PyAny>>,
        profile_ccw: Option<&Bound<'_, Profile>>,
        profile_cw: Option<&Bound<'_, Profile>>,
        damage: Option<Vec<Bound<'_, ToothDamage>>>,
    ) -> Result<Self> {
        let table =
            |field, given: Option<&Bound<'_, PyAny>>| given.map_or(Ok(Vec::new()), |given| column(field, given));
        let profile = |given: Option<&Bound<'_, Profile>>| given.map(|given| given.get().0.clone()).unwrap_or_default();
        Ok(Self(contact::ToothErrors {
            driver_pitch_mm: [table("driver_ccw_mm", driver_ccw_mm)?, table("driver_cw_mm", driver_cw_mm)?],
            driven_pitch_mm: [table("driven_ccw_mm", driven_ccw_mm)?, table("driven_cw_mm", driven_cw_mm)?],
            profile: [profile(profile_ccw), profile(profile_cw)],
            damage: damage.unwrap_or_default().iter().map(|damage| damage.get().0).collect(),
        }))
    }

    /// What is not perfect.
    fn __repr__(&self, py: Python<'_>) -> Result<String> {
        let mut given = Vec::new();
        for (name, value) in self.__getnewargs_ex__(py)?.1.iter() {
            if value.is_truthy()? && !value.eq(Profile(contact::Profile::default()).into_pyobject(py)?)? {
                given.push(format!("{name}={}", value.repr()?));
            }
        }
        Ok(format!("ToothErrors({})", given.join(", ")))
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        let contact::ToothErrors { driver_pitch_mm, driven_pitch_mm, profile, damage } = &self.0;
        for (name, table) in [
            ("driver_ccw_mm", &driver_pitch_mm[0]),
            ("driver_cw_mm", &driver_pitch_mm[1]),
            ("driven_ccw_mm", &driven_pitch_mm[0]),
            ("driven_cw_mm", &driven_pitch_mm[1]),
        ] {
            keywords.set_item(name, table)?;
        }
        keywords.set_item("profile_ccw", Profile(profile[0].clone()).into_pyobject(py)?)?;
        keywords.set_item("profile_cw", Profile(profile[1].clone()).into_pyobject(py)?)?;
        let damage: Vec<ToothDamage> = damage.iter().copied().map(ToothDamage).collect();
        keywords.set_item("damage", damage)?;
        Ok((PyTuple::empty(py), keywords))
    }
}
