//! Columns of all candidates over the grid, and the sums from which every fit is made.
//!
//! A block's raw columns are turned into unit-RMS orthogonal ones, so that an amplitude is the RMS of its trace in rad; directions
//! that the plan cannot see are dropped. After [`DesignMatrix::new`] nothing touches the places any more: all fits, with whatever
//! noise, come from XᵀWX and from the columns' low-order waves in each revolution.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use super::columns::{Columns, Values};
use super::gram;
use super::grid::Grid;
use super::nuisance_patterns::Pattern;
use super::settings::{DesignSettings, EvidenceSettings, Settings};
use super::waves::{WAVES, waves};
use gearmodel::effect::{Effect, Grain, NominalRig, OperatingPoint, Rows, Shape};

/// Column of the residual and of the zero in the design matrix.
pub(super) const RESIDUAL: usize = 0;
pub(super) const ZERO: usize = 1;

/// What a block of columns stands for.
#[derive(Clone)]
pub enum Candidate {
    /// An effect of the library, at one shape.
    Effect {
        /// The effect.
        effect: &'static dyn Effect,
        /// Its place in the library.
        number: usize,
        /// Shape.
        shape: Shape,
        /// What the choice of the shape costs, nats.
        cost_nats: f64,
    },
    /// A pattern that no effect of the library makes.
    Unknown(Pattern),
}

impl Candidate {
    /// Its columns before those that the plan cannot see are dropped.
    fn width(&self, rig: &NominalRig) -> usize {
        match self {
            Self::Effect { effect, shape, .. } => effect.width(rig, shape),
            Self::Unknown(pattern) => pattern.width(),
        }
    }

    /// True where its trace differs between the revolutions of a run.
    fn evolves(&self) -> bool {
        match self {
            Self::Effect { effect, shape, .. } => effect.evolves(shape),
            Self::Unknown(pattern) => pattern.evolves(),
        }
    }

    /// True where beside one of them the other explains nothing: steps at times of one's choice follow any random walk.
    #[must_use]
    pub fn excludes(&self, other: &Self) -> bool {
        let walks = |candidate: &Self| matches!(candidate, Self::Unknown(Pattern::RandomWalk { .. }));
        let steps = |candidate: &Self| match candidate {
            Self::Effect { effect, .. } => effect.steps(),
            Self::Unknown(pattern) => matches!(pattern, Pattern::Step { .. }),
        };
        walks(self) && steps(other) || steps(self) && walks(other)
    }

    /// True of an effect at an order of its choice and a pattern at the same: one of them would have to be there by chance.
    #[must_use]
    pub fn coincides(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Effect { effect, shape, .. }, Self::Unknown(Pattern::Order { shaft, order, .. })) => {
                effect.order(shape) == Some((*shaft, *order))
            }
            _ => false,
        }
    }
}

/// A block of unit-RMS columns in the design matrix.
#[derive(Clone)]
pub struct Block {
    /// What it stands for.
    pub candidate: Candidate,
    /// Its columns in the design matrix.
    pub columns: std::ops::Range<usize>,
    /// Raw amplitudes = `transform` · amplitudes in the design matrix.
    pub transform: DMatrix<f64>,
}

impl Block {
    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.columns.len()
    }
}

/// All blocks with their sums. Column 0 is the residual, column 1 the free zero.
#[derive(Clone)]
pub struct DesignMatrix {
    /// Blocks.
    pub blocks: Vec<Block>,
    columns: Columns,
    /// XᵀWX.
    pub products: DMatrix<f64>,
    /// ZᵀWX of every revolution.
    pub waves: Vec<DMatrix<f64>>,
    base: Arc<Base>,
}

/// What design matrices over one grid share.
struct Base {
    /// Sums of the weights over each cell.
    cell_weight: Vec<f64>,
    /// ZᵀW of every revolution at its places.
    weighted: Vec<DMatrix<f64>>,
    /// ZᵀWZ of every revolution.
    wave_products: Vec<DMatrix<f64>>,
    own: DesignSettings,
    evidence: EvidenceSettings,
}

impl Base {
    fn new(grid: &Grid, settings: &Settings) -> Self {
        let mut cell_weight = vec![0.0; grid.cells.len()];
        for (cell, weight) in grid.cell_of.iter().zip(&grid.weight) {
            cell_weight[*cell] += weight;
        }
        let wave_values: Vec<[f64; WAVES]> =
            grid.cells.iter().zip(&grid.part_of_cell).map(|(cell, part)| waves(cell.theta1_rad, *part)).collect();
        let (weighted, wave_products) = grid
            .revolutions
            .par_iter()
            .map(|revolution| {
                let at = |n: usize| revolution.places.start + n;
                let z = DMatrix::from_fn(revolution.places.len(), WAVES, |n, w| wave_values[grid.cell_of[at(n)]][w]);
                let weighted = DMatrix::from_fn(WAVES, z.nrows(), |w, n| grid.weight[at(n)] * z[(n, w)]);
                let products = &weighted * z;
                (weighted, products)
            })
            .unzip();
        Self { cell_weight, weighted, wave_products, own: settings.design, evidence: settings.evidence }
    }
}

/// Rows of a candidate at operating points.
fn rows(candidate: &Candidate, rig: &NominalRig, operating_points: &[OperatingPoint], width: usize) -> DMatrix<f64> {
    let mut raw = DMatrix::zeros(operating_points.len(), width);
    let (mut row, mut part) = (vec![0.0; width], vec![0.0; width]);
    let grain = match candidate {
        Candidate::Effect { effect, shape, .. } => effect.grain(shape),
        Candidate::Unknown(_) => Grain::Smooth,
    };
    let places = grain.places();
    let mut take: Rows<'_> = match candidate {
        Candidate::Effect { effect, shape, .. } => effect.rows(rig, shape),
        Candidate::Unknown(pattern) => Box::new(|at, row| pattern.row(at, row)),
    };
    for (number, at) in operating_points.iter().enumerate() {
        row.fill(0.0);
        if grain == Grain::Smooth {
            take(at, &mut row);
        } else {
            let mut near = *at;
            for place in places {
                near.move_from(at, place * at.spread_rad);
                part.fill(0.0);
                take(&near, &mut part);
                row.iter_mut().zip(&part).for_each(|(sum, x)| *sum += x / places.len() as f64);
            }
        }
        for (column, value) in row.iter().enumerate() {
            raw[(number, column)] = *value;
        }
    }
    raw
}

/// Cells' rows at every place, grown with time.
fn grown(grid: &Grid, of_cells: &DMatrix<f64>, mean_s: f64) -> DMatrix<f64> {
    let mut raw = DMatrix::zeros(grid.places.len(), of_cells.ncols());
    for (mut column, cells) in raw.column_iter_mut().zip(of_cells.column_iter()) {
        for ((value, cell), at) in column.iter_mut().zip(&grid.cell_of).zip(&grid.places) {
            *value = cells[*cell] * at.time_s / mean_s;
        }
    }
    raw
}

fn values(unit: &DMatrix<f64>, evolves: bool, transform: DMatrix<f64>) -> (Vec<Values>, DMatrix<f64>) {
    let column = |column: Vec<f64>| if evolves { Values::Places(column) } else { Values::Cells(column) };
    (unit.column_iter().map(|x| column(x.iter().copied().collect())).collect(), transform)
}

/// Blocks made at a time.
const BATCH: usize = 64;

impl DesignMatrix {
    /// The residual and the zero, without blocks.
    #[must_use]
    pub fn new(grid: &Grid, settings: &Settings) -> Self {
        let mut design = Self {
            blocks: Vec::new(),
            columns: Columns::default(),
            products: DMatrix::zeros(0, 0),
            waves: vec![DMatrix::zeros(WAVES, 0); grid.revolutions.len()],
            base: Arc::new(Base::new(grid, settings)),
        };
        design.columns.push(grid, Values::Places(grid.rho_rad.clone()));
        design.columns.push(grid, Values::Cells(vec![1.0; grid.cells.len()]));
        design.grow_sums(grid);
        design
    }

    /// A design matrix of some of the blocks, in their order, for trials: it stays small.
    #[must_use]
    pub fn only(&self, grid: &Grid, blocks: &[usize]) -> Self {
        let mut columns = vec![RESIDUAL, ZERO];
        let mut few = Vec::new();
        for block in blocks.iter().map(|number| &self.blocks[*number]) {
            let first = columns.len();
            columns.extend(block.columns.clone());
            few.push(Block { columns: first..columns.len(), ..block.clone() });
        }
        Self {
            blocks: few,
            columns: self.columns.only(grid, &columns),
            products: self.products.select_rows(&columns).select_columns(&columns),
            waves: self.waves.iter().map(|waves| waves.select_columns(&columns)).collect(),
            base: Arc::clone(&self.base),
        }
    }

    /// How the evidence of its blocks is weighed.
    #[must_use]
    pub(super) fn evidence(&self) -> &EvidenceSettings {
        &self.base.evidence
    }

    /// Columns in all.
    #[must_use]
    pub fn width(&self) -> usize {
        self.columns.len()
    }

    /// Mean product of two columns over the samples, their means taken off.
    #[must_use]
    pub fn covariance(&self, m: usize, n: usize) -> f64 {
        let weight = self.products[(ZERO, ZERO)];
        (self.products[(m, n)] - self.products[(m, ZERO)] * self.products[(n, ZERO)] / weight) / weight
    }

    /// RMS of the residual, its mean taken off, rad.
    #[must_use]
    pub fn residual_rms_rad(&self) -> f64 {
        self.covariance(RESIDUAL, RESIDUAL).max(0.0).sqrt()
    }

    /// ZᵀWZ of every revolution.
    #[must_use]
    pub fn wave_products(&self) -> &[DMatrix<f64>] {
        &self.base.wave_products
    }

    /// Adds blocks; those that the plan cannot see are left out. Returns the numbers of those added.
    pub fn add(&mut self, grid: &Grid, rig: &NominalRig, candidates: &[Candidate]) -> Vec<usize> {
        let mut numbers = Vec::new();
        let (evolving, others): (Vec<_>, Vec<_>) = candidates.iter().partition(|candidate| candidate.evolves());
        let width = |candidates: &[&Candidate]| candidates.iter().map(|candidate| candidate.width(rig)).sum();
        self.columns.reserve(grid, width(&others), width(&evolving));
        // Not all at once: before a column stands among the others it takes up memory twice.
        for batch in candidates.chunks(BATCH) {
            let made: Vec<_> = batch.par_iter().map(|candidate| self.unit_columns(grid, rig, candidate)).collect();
            for (candidate, (values, transform)) in
                batch.iter().zip(made).filter_map(|(candidate, made)| Some((candidate, made?)))
            {
                let first = self.width();
                values.into_iter().for_each(|values| self.columns.push(grid, values));
                numbers.push(self.blocks.len());
                self.blocks.push(Block { candidate: candidate.clone(), columns: first..self.width(), transform });
            }
        }
        self.grow_sums(grid);
        numbers
    }

    fn unit_columns(
        &self,
        grid: &Grid,
        rig: &NominalRig,
        candidate: &Candidate,
    ) -> Option<(Vec<Values>, DMatrix<f64>)> {
        let (width, evolves) = (candidate.width(rig), candidate.evolves());
        let (operating_points, weights) =
            if evolves { (&grid.places, &grid.weight) } else { (&grid.cells, &self.base.cell_weight) };
        let growing = match candidate {
            Candidate::Unknown(pattern) => pattern.growing(),
            Candidate::Effect { .. } => None,
        };
        let raw = match growing {
            Some((steady, mean_s)) => grown(grid, &rows(&Candidate::Unknown(steady), rig, &grid.cells, width), mean_s),
            None => rows(candidate, rig, operating_points, width),
        };
        let total: f64 = weights.iter().sum();
        // A constant is the zero's; what is left of a column is its trace.
        let means = raw.tr_mul(&DVector::from_column_slice(weights)) / total;
        let covariance = gram::weighted(&raw, weights) / total - &means * means.transpose();
        let scale = DVector::from_fn(width, |n, _| covariance[(n, n)].max(0.0).sqrt());
        if scale.iter().any(|s| !s.is_finite()) || scale.max() <= 0.0 {
            return None;
        }
        // A column that is all zero beside the constant must not count through its rounding.
        let size = raw.amax();
        if scale.max() < self.base.own.constant * size {
            return None;
        }
        if matches!(candidate, Candidate::Unknown(pattern) if pattern.keeps_sizes()) {
            let transform = DMatrix::identity(width, width) * (width as f64 / covariance.trace()).sqrt();
            return Some(values(&(raw * transform[(0, 0)]), evolves, transform));
        }
        let eigen = SymmetricEigen::new(covariance);
        let (largest, unseen) = (eigen.eigenvalues.max(), self.base.own.unseen);
        let kept: Vec<usize> = (0..width).filter(|n| eigen.eigenvalues[*n] > unseen * unseen * largest).collect();
        let mut transform = DMatrix::zeros(width, kept.len());
        for (to, from) in kept.iter().enumerate() {
            let mut direction = eigen.eigenvectors.column(*from) / eigen.eigenvalues[*from].sqrt();
            // A block of one column keeps its sign, so that one-sided amplitudes stay positive.
            if width == 1 && direction[0] < 0.0 {
                direction = -direction;
            }
            transform.set_column(to, &direction);
        }
        Some(values(&gram::times(&raw, &transform), evolves, transform))
    }

    /// The sums of columns that were added.
    fn grow_sums(&mut self, grid: &Grid) {
        if self.products.ncols() == self.width() {
            return;
        }
        self.columns.grow_products(grid, &self.base.cell_weight, &mut self.products);
        let (columns, weighted) = (&self.columns, &self.base.weighted);
        self.waves
            .par_iter_mut()
            .zip(&grid.revolutions)
            .zip(weighted)
            .for_each(|((waves, revolution), weighted)| columns.grow_waves(grid, revolution, weighted, waves));
    }

    /// Values of a column at every place.
    #[must_use]
    pub fn column(&self, grid: &Grid, column: usize) -> Vec<f64> {
        self.columns.at_places(grid, column)
    }

    /// What a model (column, amplitude) leaves of the residual at every place.
    #[must_use]
    pub fn rest(&self, grid: &Grid, amplitudes: &[(usize, f64)]) -> Vec<f64> {
        grid.rho_rad.iter().zip(self.trace(grid, amplitudes)).map(|(y, m)| y - m).collect()
    }

    /// Σ columns · amplitudes at every place.
    #[must_use]
    pub fn trace(&self, grid: &Grid, amplitudes: &[(usize, f64)]) -> Vec<f64> {
        self.columns.trace(grid, amplitudes)
    }
}
