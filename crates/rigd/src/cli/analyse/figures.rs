//! The figures of a run.

use gearmodel::NominalModel;
use gearmodel::measure::{
    AngleGrid, Curve, FloorError, OrderAxis, OrderSpectrum, RepeatabilityFloor, RunConditions, RunFigures,
    SpectrumError, WaveFilter, WaveSplit,
};

use super::Run;

/// The axes of orders by their names.
pub const AXES: [(OrderAxis, &str); 3] =
    [(OrderAxis::Driver, "input"), (OrderAxis::Driven, "output"), (OrderAxis::Mesh, "mesh")];

/// Highest line where nobody asks for more: nearly four times the mesh of 47 teeth.
const HIGHEST: u32 = 180;

/// Where long waves end and short ones begin.
pub type Split = WaveFilter;

/// The name of an axis.
pub fn name(axis: OrderAxis) -> &'static str {
    AXES.iter().find(|(known, _)| *known == axis).map_or("", |(_, name)| name)
}

/// What is known of a run.
pub struct Figures {
    /// Its set-points.
    pub conditions: RunConditions,
    /// Samples used.
    pub samples: u64,
    /// Samples missing.
    pub losses: u64,
    /// Whole turns of the driven shaft.
    pub driven_revolutions: usize,
    /// Bins of θ1.
    pub grid: AngleGrid,
    /// Mean curve over θ1.
    pub mean: Curve,
    /// The usual figures against the model.
    pub te: RunFigures,
    /// The floor with its interval.
    pub floor: Result<RepeatabilityFloor, FloorError>,
    /// Spectra in the order of [`AXES`].
    pub spectra: Vec<(OrderAxis, Result<OrderSpectrum, SpectrumError>)>,
    /// The filter.
    pub filter: WaveFilter,
    /// Long and short waves.
    pub waves: Result<WaveSplit, SpectrumError>,
}

impl Figures {
    /// Figures of a run. A line above what the bins resolve is refused where it was asked for, and left out where not.
    pub fn of(run: &Run, model: &NominalModel, highest: Option<u32>, filter: WaveFilter) -> Self {
        let te = &run.over_driver;
        let (grid, mean) = (te.grid(), te.mean_curve());
        let spectrum = |axis| {
            let limit = OrderSpectrum::highest_line(grid, &model.pair, axis)?;
            OrderSpectrum::of(grid, &mean, &model.pair, axis, highest.unwrap_or(HIGHEST.min(limit)))
        };
        Self {
            conditions: te.conditions(),
            samples: te.samples(),
            losses: run.losses,
            driven_revolutions: run.over_driven.revolutions(),
            grid,
            te: RunFigures::of(te, model, None),
            floor: RepeatabilityFloor::of(te),
            spectra: AXES.iter().map(|(axis, _)| (*axis, spectrum(*axis))).collect(),
            waves: filter.split(grid, &mean, &model.pair),
            filter,
            mean,
        }
    }
}
