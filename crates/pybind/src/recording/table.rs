//! Recordings from tables. The reading is Python's, where numpy and pyarrow are.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::Recording;
use crate::error::Result;

/// Calls a reader of `gearmodel._columns` with what its caller states beside the file.
fn read<'py>(
    py: Python<'py>,
    reader: &str,
    path: &Bound<'py, PyAny>,
    conditions: [(&str, Option<&Bound<'py, PyAny>>); 3],
    lines: (Option<i64>, Option<i64>),
) -> Result<Bound<'py, PyAny>> {
    let given = PyDict::new(py);
    for (name, value) in conditions {
        given.set_item(name, value)?;
    }
    given.set_item("input_lines", lines.0)?;
    given.set_item("output_lines", lines.1)?;
    Ok(py.import("gearmodel._columns")?.call_method(reader, (path,), Some(&given))?)
}

#[pymethods]
impl Recording {
    /// Reads a CSV table.
    ///
    /// The first line that is no comment (#) names the columns, separated by comma, semicolon or tab: time_s, theta1_rad and
    /// theta2_rad, and where they are there load_nm, speed_rpm and direction ("ccw", "cw", "auto"). Others are not looked
    /// at; an empty field is a gap.
    ///
    /// Args:
    ///     path: the file.
    ///     load_nm: in place of the column.
    ///     speed_rpm: in place of the column; 0 = not known where there is neither.
    ///     direction: in place of the column; "auto" where there is neither, or where the column changes.
    ///     input_lines, output_lines: as in :class:`Recording`.
    ///
    /// Raises:
    ///     ValueError: a column is missing, or as in :class:`Recording`.
    ///     OSError: the file cannot be read.
    #[staticmethod]
    #[pyo3(signature = (path, *, load_nm=None, speed_rpm=None, direction=None, input_lines=None, output_lines=None))]
    fn from_csv<'py>(
        py: Python<'py>,
        path: &Bound<'py, PyAny>,
        load_nm: Option<&Bound<'py, PyAny>>,
        speed_rpm: Option<&Bound<'py, PyAny>>,
        direction: Option<&Bound<'py, PyAny>>,
        input_lines: Option<i64>,
        output_lines: Option<i64>,
    ) -> Result<Bound<'py, PyAny>> {
        let conditions = [("load_nm", load_nm), ("speed_rpm", speed_rpm), ("direction", direction)];
        read(py, "from_csv", path, conditions, (input_lines, output_lines))
    }

    /// Reads the columns of a Parquet file, as :meth:`from_csv` those of a table; null is a gap. Needs pyarrow.
    ///
    /// Raises:
    ///     ImportError: pyarrow is missing; says how to install it.
    ///     ValueError: a column is missing, or as in :class:`Recording`.
    ///     OSError: the file cannot be read.
    #[staticmethod]
    #[pyo3(signature = (path, *, load_nm=None, speed_rpm=None, direction=None, input_lines=None, output_lines=None))]
    fn from_parquet<'py>(
        py: Python<'py>,
        path: &Bound<'py, PyAny>,
        load_nm: Option<&Bound<'py, PyAny>>,
        speed_rpm: Option<&Bound<'py, PyAny>>,
        direction: Option<&Bound<'py, PyAny>>,
        input_lines: Option<i64>,
        output_lines: Option<i64>,
    ) -> Result<Bound<'py, PyAny>> {
        let conditions = [("load_nm", load_nm), ("speed_rpm", speed_rpm), ("direction", direction)];
        read(py, "from_parquet", path, conditions, (input_lines, output_lines))
    }
}
