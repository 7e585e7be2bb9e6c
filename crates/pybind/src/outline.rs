//! Text of drawings from outlines that Python holds.

use gearmodel::Outline;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

/// The points of an array of shape (n, 2), without the first one repeated at the end.
fn outline(points: &PyReadonlyArray2<'_, f64>) -> Outline {
    let mut points_mm: Vec<[f64; 2]> = points.as_array().rows().into_iter().map(|row| [row[0], row[1]]).collect();
    if points_mm.len() > 1 && points_mm.first() == points_mm.last() {
        points_mm.pop();
    }
    Outline { points_mm }
}

/// The outline as the text of a DXF drawing (R12, one closed polyline on a layer, mm).
#[pyfunction]
pub fn outline_dxf(points: PyReadonlyArray2<'_, f64>, layer: &str) -> String {
    outline(&points).to_dxf(layer)
}

/// The outline as the text of an SVG drawing (mm, y upwards, the axis marked).
#[pyfunction]
pub fn outline_svg(points: PyReadonlyArray2<'_, f64>) -> String {
    outline(&points).to_svg()
}
