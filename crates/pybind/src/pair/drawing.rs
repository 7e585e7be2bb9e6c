//! Flanks and outlines, for drawing and for CAD.

use std::path::PathBuf;

use gearmodel::contact::ContactModel;
use gearmodel::{Direction, Errors, Gear};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use super::GearPair;
use crate::array::count;
use crate::error::{InputError, Result, file_error};

/// Driver or driven gear by its number.
pub fn gear(number: i64) -> Result<Gear> {
    match number {
        1 => Ok(Gear::Driver),
        2 => Ok(Gear::Driven),
        _ => Err(InputError::Gear { given: number }.into()),
    }
}

/// A tooth's number as the model counts.
pub fn tooth_number(number: i64) -> Result<u32> {
    if number < 0 {
        return Err(InputError::Tooth { given: number }.into());
    }
    // A number that no integer of the model holds is refused there, with the teeth that the gear has.
    Ok(u32::try_from(number).unwrap_or(u32::MAX))
}

/// Points as an array of shape (n, 2).
fn points<'py>(py: Python<'py>, points_mm: Vec<[f64; 2]>) -> Result<Bound<'py, PyArray2<f64>>> {
    let count = points_mm.len();
    Ok(PyArray1::from_vec(py, points_mm.into_flattened()).reshape([count, 2])?)
}

#[pymethods]
impl GearPair {
    /// A tooth's working flank, from where the rack's straight flank ends to the tip.
    ///
    /// Args:
    ///     gear: 1 (driver) or 2 (driven).
    ///     tooth: 0 to Z - 1; tooth 0's ccw flank passes the pitch point at theta1 = 0.
    ///     side: "ccw" or "cw", the driver's sense in which the flank carries.
    ///     n: number of points.
    ///
    /// Returns:
    ///     Points (x, y), mm, shape (n, 2), in the gear's own body: its axis at the origin, standing as at theta1 = 0.
    ///
    /// Raises:
    ///     GeometryError: a tooth that the gear does not have, or teeth that a rack cannot cut; names gear, angle, limit.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    /// >>> pair.flank(gear=1, tooth=0, side="ccw", n=64).shape
    /// (64, 2)
    #[pyo3(signature = (gear=1, tooth=0, side="ccw", n=64))]
    fn flank<'py>(
        &self,
        py: Python<'py>,
        gear: i64,
        tooth: i64,
        side: &str,
        n: i64,
    ) -> Result<Bound<'py, PyArray2<f64>>> {
        let (gear, tooth, side) = (self::gear(gear)?, tooth_number(tooth)?, side.parse::<Direction>()?);
        let n = count("n", n)?;
        points(py, py.detach(|| self.model.pair.flank(gear, tooth, side, n))?)
    }

    /// The closed outline of a gear as its rack cuts it: flanks, tips, root fillets.
    ///
    /// Args:
    ///     gear: 1 (driver) or 2 (driven).
    ///     points_per_tooth: 12 to 100 000.
    ///
    /// Returns:
    ///     Outline: points (x, y), mm, shape (Z points_per_tooth + 1, 2), counter-clockwise, the first repeated at the end,
    ///     in the gear's own body standing as at theta1 = 0; an array with ``to_dxf(path)``, ``to_svg(path)``, ``area_mm2``.
    ///
    /// Raises:
    ///     GeometryError: teeth that a rack cannot cut (concave pitch curve, undercut, pointed tip); names gear, angle, limit.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=2, teeth=20)
    /// >>> outline = pair.outline(gear=1, points_per_tooth=40)
    /// >>> outline.shape
    /// (801, 2)
    #[pyo3(signature = (gear=1, points_per_tooth=40))]
    fn outline<'py>(&self, py: Python<'py>, gear: i64, points_per_tooth: i64) -> Result<Bound<'py, PyAny>> {
        let (gear, points_per_tooth) = (self::gear(gear)?, count("points_per_tooth", points_per_tooth)?);
        let mut outline = py.detach(|| self.model.pair.outline(gear, points_per_tooth))?.points_mm;
        outline.extend(outline.first().copied());
        let layer = format!("gear{}", gear.number());
        Ok(py.import("gearmodel._outline")?.getattr("Outline")?.call1((points(py, outline)?, layer))?)
    }

    /// Writes a gear's outline as a DXF drawing (R12, one closed polyline, mm).
    ///
    /// Raises:
    ///     GeometryError: as :meth:`outline`.
    ///     OSError: the file cannot be written.
    #[pyo3(signature = (path, gear=1, points_per_tooth=40))]
    fn to_dxf(&self, py: Python<'_>, path: PathBuf, gear: i64, points_per_tooth: i64) -> Result<()> {
        let (gear, points_per_tooth) = (self::gear(gear)?, count("points_per_tooth", points_per_tooth)?);
        let outline = py.detach(|| self.model.pair.outline(gear, points_per_tooth))?;
        let text = outline.to_dxf(&format!("gear{}", gear.number()));
        Ok(std::fs::write(&path, text).map_err(|error| file_error(&path, &error))?)
    }

    /// Writes a gear's outline as an SVG drawing (mm, y upwards, the axis marked).
    ///
    /// Raises:
    ///     GeometryError: as :meth:`outline`.
    ///     OSError: the file cannot be written.
    #[pyo3(signature = (path, gear=1, points_per_tooth=40))]
    fn to_svg(&self, py: Python<'_>, path: PathBuf, gear: i64, points_per_tooth: i64) -> Result<()> {
        let (gear, points_per_tooth) = (self::gear(gear)?, count("points_per_tooth", points_per_tooth)?);
        let outline = py.detach(|| self.model.pair.outline(gear, points_per_tooth))?;
        Ok(std::fs::write(&path, outline.to_svg()).map_err(|error| file_error(&path, &error))?)
    }

    /// Passes a pair whose teeth a rack can cut. Angles, TE and backlash need none of this.
    ///
    /// Raises:
    ///     GeometryError: a concave pitch curve, undercut, a pointed tip, a dedendum that reaches the axis, or tips that run
    ///         into the mate's feet; names gear, angle and limit. Only the first fault: :meth:`tooth_faults` has all.
    ///
    /// >>> import gearmodel as gm
    /// >>> gm.GearPair.circular(module_mm=3, teeth=(40, 12)).check_teeth()  # doctest: +ELLIPSIS
    /// Traceback (most recent call last):
    /// ...
    /// gearmodel.GeometryError: ...gear 2...
    fn check_teeth(&self) -> Result<()> {
        Ok(self.model.pair.check_teeth()?)
    }

    /// Everything that is wrong with the teeth, each fault with its gear, angle and limit; empty for a pair that can be cut.
    ///
    /// >>> import gearmodel as gm
    /// >>> len(gm.GearPair.circular(module_mm=3, teeth=(40, 12)).tooth_faults())    # undercut, and interference
    /// 2
    fn tooth_faults(&self) -> Vec<String> {
        self.model.pair.tooth_faults().iter().map(ToString::to_string).collect()
    }

    /// Contact ratio of the driver's teeth: pitches of rolling between the tips of both gears, without errors.
    ///
    /// Args:
    ///     direction: "ccw" or "cw", the flanks.
    ///
    /// Returns:
    ///     Shape (Z1,), a value a tooth.
    ///
    /// Raises:
    ///     GeometryError: a drive without known teeth.
    ///
    /// >>> import gearmodel as gm
    /// >>> pair = gm.GearPair.circular(module_mm=3, teeth=40)
    /// >>> round(float(pair.contact_ratio().min()), 2)
    /// 1.71
    #[pyo3(signature = (direction="ccw"))]
    fn contact_ratio<'py>(&self, py: Python<'py>, direction: &str) -> Result<Bound<'py, PyArray1<f64>>> {
        let direction = direction.parse::<Direction>()?;
        let pair = &self.model.pair;
        if !pair.has_teeth() {
            return Err(gearmodel::contact::ContactError::NoTeeth.into());
        }
        let contact = ContactModel::new(pair.clone(), &Errors::default())?;
        let ratios: Vec<f64> =
            py.detach(|| (0..pair.teeth().0).map(|tooth| contact.contact_ratio(tooth, direction)).collect());
        Ok(PyArray1::from_vec(py, ratios))
    }
}
