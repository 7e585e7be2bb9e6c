//! Why a table cannot become a log: file, row, column and value.

use std::path::PathBuf;

use gearmodel::Direction;
use riglog::LogError;
use thiserror::Error;

use crate::quantity::QuantityError;
use riglog::PairError;

/// Why a table cannot become a log.
#[derive(Debug, Error)]
pub enum ImportError {
    /// The pair.
    #[error(transparent)]
    Pair(#[from] PairError),
    /// A quantity on the command line.
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    /// The table cannot be read.
    #[error("{}: {source}; give a table with the columns time_s, theta1_rad, theta2_rad, load_nm, speed_rpm, direction", path.display())]
    Open {
        /// The table.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The name tells no format.
    #[error("{}: a table's name ends in .csv or .parquet", path.display())]
    Format {
        /// The table.
        path: PathBuf,
    },
    /// This build has no Parquet.
    #[cfg(not(feature = "parquet"))]
    #[error(
        "{}: this build of rigd cannot read Parquet; build it with `cargo build --release -p rigd --features parquet`, or save the table as CSV",
        path.display()
    )]
    NoParquet {
        /// The table.
        path: PathBuf,
    },
    /// Not CSV.
    #[error("{}: {source}", path.display())]
    Csv {
        /// The table.
        path: PathBuf,
        /// What the reader says, with its line.
        source: csv::Error,
    },
    /// Not Parquet.
    #[cfg(feature = "parquet")]
    #[error("{}: {source}", path.display())]
    Parquet {
        /// The table.
        path: PathBuf,
        /// What the reader says.
        source: parquet::errors::ParquetError,
    },
    /// A column is missing.
    #[error("{}: there is no column {column} among {found}; {advice}", path.display())]
    NoColumn {
        /// The table.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// The columns that there are.
        found: String,
        /// What to do.
        advice: &'static str,
    },
    /// A column stands twice.
    #[error("{}: column {column} stands twice; leave one", path.display())]
    TwoColumns {
        /// The table.
        path: PathBuf,
        /// The column.
        column: &'static str,
    },
    /// A value that is none.
    #[error("{}, row {row}, column {column}: '{value}' is not {needed}", path.display())]
    Value {
        /// The table.
        path: PathBuf,
        /// Line of a CSV file, row of a Parquet file, counted from 1.
        row: u64,
        /// The column.
        column: &'static str,
        /// What stands there.
        value: String,
        /// What may stand there.
        needed: &'static str,
    },
    /// Time stands still or runs back within a run.
    #[error(
        "{}, row {row}, column time_s: {time_s} s does not follow {before_s} s of the row before; time must increase within a run: sort the rows",
        path.display()
    )]
    Time {
        /// The table.
        path: PathBuf,
        /// The row.
        row: u64,
        /// Its time.
        time_s: f64,
        /// The time before.
        before_s: f64,
    },
    /// An angle jumps.
    #[error(
        "{}, row {row}, column {column}: {value_rad} rad is {step_rad:.6} rad from the row before; angles must run on over the turns: unwrap them (numpy.unwrap), and keep rows closer than half a turn",
        path.display()
    )]
    Jump {
        /// The table.
        path: PathBuf,
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
        /// The angle.
        value_rad: f64,
        /// From the row before.
        step_rad: f64,
    },
    /// An angle beyond what counts can tell.
    #[error(
        "{}, row {row}, column {column}: {value_rad} rad is more than {counts_per_rev} counts a revolution can tell; is the angle in rad? else lower --counts-per-rev",
        path.display()
    )]
    TooFar {
        /// The table.
        path: PathBuf,
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
        /// The angle.
        value_rad: f64,
        /// The resolution.
        counts_per_rev: u64,
    },
    /// The angle moves against the stated sense.
    #[error(
        "{}, rows {first_row} to {last_row}, column {column}: the angle moves by {travel_rad:.6} rad, but direction is {direction}; both angles increase driving ccw and decrease driving cw: change the sign of the angles, or the direction",
        path.display()
    )]
    Sense {
        /// The table.
        path: PathBuf,
        /// First row of the run.
        first_row: u64,
        /// Last row of the run.
        last_row: u64,
        /// The column.
        column: &'static str,
        /// Last less first angle.
        travel_rad: f64,
        /// The stated sense.
        direction: Direction,
    },
    /// Readings where set-points belong.
    #[error(
        "{}, row {row}, column {column}: {value} follows {before} after {samples} rows; load_nm and speed_rpm hold set-points, which stay through a run: give {instead} in place of the column",
        path.display()
    )]
    Reading {
        /// The table.
        path: PathBuf,
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
        /// Its value.
        value: f64,
        /// The value before.
        before: f64,
        /// Rows of the run that it ends.
        samples: u64,
        /// The option that replaces the column.
        instead: &'static str,
    },
    /// Nothing to import.
    #[error("{}: no row with both angles; there is nothing to import", path.display())]
    Empty {
        /// The table.
        path: PathBuf,
    },
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The finished log cannot be given its name.
    #[error("{}: {source}; the finished log is {}", path.display(), part.display())]
    Rename {
        /// The name.
        path: PathBuf,
        /// The log as it is.
        part: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
}
