//! Columns of all candidates over the grid, and the sums from which every fit is made.
//!
//! A block's raw columns are turned into unit-RMS orthogonal ones, so that an amplitude is the RMS of its trace in rad; directions
//! that the plan cannot see are dropped. After [`Pool::new`] nothing touches the places any more: all fits, with whatever
//! noise, come from XᵀWX and from the columns' low-order waves in each revolution.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use super::grid::Grid;
use super::noise::WAVES;
use super::unknown::Pattern;
use crate::effect::{Effect, Rig, Shape};

/// What a block of columns stands for.
#[derive(Clone)]
pub enum Cause {
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

/// A block of unit-RMS columns in the pool.
#[derive(Clone)]
pub struct Block {
    /// What it stands for.
    pub cause: Cause,
    /// Its columns in the pool.
    pub columns: std::ops::Range<usize>,
    /// Raw amplitudes = `transform` · amplitudes in the pool.
    pub transform: DMatrix<f64>,
}

impl Block {
    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.columns.len()
    }
}

/// Values of a column: once a cell, or once a place where it evolves.
enum Values {
    Cells(Vec<f64>),
    Places(Vec<f64>),
}

/// All blocks with their sums. Column 0 is the residual, column 1 the free zero.
pub struct Pool {
    /// Blocks.
    pub blocks: Vec<Block>,
    values: Vec<Values>,
    /// XᵀWX.
    pub products: DMatrix<f64>,
    /// ZᵀWX of every revolution.
    pub waves: Vec<DMatrix<f64>>,
    /// ZᵀWZ of every revolution.
    pub wave_products: Vec<DMatrix<f64>>,
    /// XᵀWX of every run; kept for the held-out fits of chosen columns only.
    cell_weight: Vec<f64>,
    wave_values: Vec<[f64; WAVES]>,
}

/// Stations over a bin at which a trace that jumps is averaged.
const SUB_STATIONS: usize = 6;
/// Columns a matrix product.
const PANEL: usize = 64;
/// Traces smaller than this part of a block's largest direction are not seen under the plan.
const UNSEEN: f64 = 1e-5;

impl Pool {
    /// The residual and the zero, without blocks.
    #[must_use]
    pub fn new(grid: &Grid) -> Self {
        let mut cell_weight = vec![0.0; grid.cells.len()];
        for (cell, weight) in grid.cell_of.iter().zip(&grid.weight) {
            cell_weight[*cell] += weight;
        }
        let wave_values: Vec<[f64; WAVES]> = grid
            .cells
            .iter()
            .zip(&grid.part_of_cell)
            .map(|(cell, part)| super::noise::waves(cell.theta1_rad, *part))
            .collect();
        let wave_products = grid
            .revolutions
            .iter()
            .map(|revolution| {
                let mut sum = DMatrix::zeros(WAVES, WAVES);
                for place in revolution.places.clone() {
                    let z = &wave_values[grid.cell_of[place]];
                    let w = grid.weight[place];
                    for a in 0..WAVES {
                        let wz = w * z[a];
                        for b in 0..=a {
                            sum[(a, b)] += wz * z[b];
                        }
                    }
                }
                sum.fill_upper_triangle_with_lower_triangle();
                sum
            })
            .collect();
        let mut pool = Self {
            blocks: Vec::new(),
            values: Vec::new(),
            products: DMatrix::zeros(0, 0),
            waves: vec![DMatrix::zeros(WAVES, 0); grid.revolutions.len()],
            wave_products,
            cell_weight,
            wave_values,
        };
        pool.append(grid, vec![Values::Places(grid.rho_rad.clone()), Values::Cells(vec![1.0; grid.cells.len()])]);
        pool
    }

    /// Columns in all.
    #[must_use]
    pub fn width(&self) -> usize {
        self.values.len()
    }

    /// Adds blocks; those that the plan cannot see are left out. Returns the numbers of those added.
    pub fn add(&mut self, grid: &Grid, rig: &Rig, causes: Vec<Cause>) -> Vec<usize> {
        let made: Vec<(Cause, Vec<Values>, DMatrix<f64>)> = causes
            .into_par_iter()
            .filter_map(|cause| {
                let (values, transform) = self.unit_columns(grid, rig, &cause)?;
                Some((cause, values, transform))
            })
            .collect();
        let mut numbers = Vec::new();
        let mut all = Vec::new();
        let mut next = self.width();
        for (cause, values, transform) in made {
            let columns = next..next + values.len();
            next = columns.end;
            numbers.push(self.blocks.len());
            self.blocks.push(Block { cause, columns, transform });
            all.extend(values);
        }
        self.append(grid, all);
        numbers
    }

    /// Drops the blocks that were added last, all but one of them; returns its new number where it is one of these.
    pub fn keep_of(&mut self, last: &[usize], keep: usize) -> Option<usize> {
        let first = *last.first()?;
        let old = self.blocks[first].columns.start;
        let kept = last.contains(&keep).then(|| self.blocks[keep].clone());
        self.blocks.truncate(first);
        let columns: Vec<usize> = (0..old).chain(kept.iter().flat_map(|block| block.columns.clone())).collect();
        let mut values: Vec<Option<Values>> = std::mem::take(&mut self.values).into_iter().map(Some).collect();
        self.values = columns.iter().filter_map(|c| values[*c].take()).collect();
        self.products = DMatrix::from_fn(columns.len(), columns.len(), |m, n| self.products[(columns[m], columns[n])]);
        for waves in &mut self.waves {
            *waves = DMatrix::from_fn(waves.nrows(), columns.len(), |m, n| waves[(m, columns[n])]);
        }
        let mut block = kept?;
        block.columns = old..old + block.columns.len();
        self.blocks.push(block);
        Some(first)
    }

    fn unit_columns(&self, grid: &Grid, rig: &Rig, cause: &Cause) -> Option<(Vec<Values>, DMatrix<f64>)> {
        let (width, evolves) = match cause {
            Cause::Effect { effect, shape, .. } => (effect.width(rig, shape), effect.evolves()),
            Cause::Unknown(pattern) => (pattern.width(), pattern.evolves()),
        };
        let (stations, weights) = if evolves { (&grid.places, &grid.weight) } else { (&grid.cells, &self.cell_weight) };
        let mut raw = vec![0.0; stations.len() * width];
        for (row, station) in raw.chunks_exact_mut(width).zip(stations) {
            match cause {
                Cause::Effect { effect, shape, .. } if effect.sharp() => {
                    let width_rad = std::f64::consts::TAU / grid.bins as f64;
                    let mut part = vec![0.0; width];
                    for n in 0..SUB_STATIONS {
                        let step = (n as f64 + 0.5) / SUB_STATIONS as f64 - 0.5;
                        part.fill(0.0);
                        effect.row(rig, shape, &station.moved(step * width_rad), &mut part);
                        row.iter_mut().zip(&part).for_each(|(sum, x)| *sum += x / SUB_STATIONS as f64);
                    }
                }
                Cause::Effect { effect, shape, .. } => effect.row(rig, shape, station, row),
                Cause::Unknown(pattern) => pattern.row(station, row),
            }
        }
        let total: f64 = weights.iter().sum();
        let raw = DMatrix::from_row_slice(stations.len(), width, &raw);
        // A constant is the zero's; what is left of a column is its trace.
        let weight = DVector::from_column_slice(weights);
        let means = raw.tr_mul(&weight) / total;
        let mut weighted = raw.clone();
        for (mut row, w) in weighted.row_iter_mut().zip(weights) {
            row *= *w;
        }
        let covariance = raw.transpose() * &weighted / total - &means * means.transpose();
        let scale = DVector::from_fn(width, |n, _| covariance[(n, n)].max(0.0).sqrt());
        if scale.iter().any(|s| !s.is_finite()) || scale.max() <= 0.0 {
            return None;
        }
        // A column that is all zero beside the constant must not count through its rounding.
        let size = raw.amax();
        if scale.max() < 1e-9 * size {
            return None;
        }
        let eigen = SymmetricEigen::new(covariance);
        let largest = eigen.eigenvalues.max();
        let kept: Vec<usize> = (0..width).filter(|n| eigen.eigenvalues[*n] > UNSEEN * UNSEEN * largest).collect();
        let mut transform = DMatrix::zeros(width, kept.len());
        for (to, from) in kept.iter().enumerate() {
            let mut direction = eigen.eigenvectors.column(*from) / eigen.eigenvalues[*from].sqrt();
            // A block of one column keeps its sign, so that one-sided amplitudes stay positive.
            if width == 1 && direction[0] < 0.0 {
                direction = -direction;
            }
            transform.set_column(to, &direction);
        }
        let unit = raw * &transform;
        let values = unit
            .column_iter()
            .map(|column| {
                let column = column.iter().copied().collect();
                if evolves { Values::Places(column) } else { Values::Cells(column) }
            })
            .collect();
        Some((values, transform))
    }

    /// Adds columns with their sums.
    fn append(&mut self, grid: &Grid, new: Vec<Values>) {
        if new.is_empty() {
            return;
        }
        let old = self.values.len();
        self.values.extend(new);
        let width = self.values.len();
        // Weighted values: of an evolving column also their sums over each cell.
        let weighted: Vec<Vec<f64>> = self.values[old..]
            .par_iter()
            .map(|values| match values {
                Values::Cells(x) => x.iter().zip(&self.cell_weight).map(|(x, w)| x * w).collect(),
                Values::Places(x) => x.iter().zip(&grid.weight).map(|(x, w)| x * w).collect(),
            })
            .collect();
        let by_cell: Vec<Vec<f64>> = self.values[old..]
            .par_iter()
            .zip(&weighted)
            .map(|(values, weighted)| match values {
                Values::Cells(_) => Vec::new(),
                Values::Places(_) => {
                    let mut sums = vec![0.0; self.cell_weight.len()];
                    for (cell, value) in grid.cell_of.iter().zip(weighted) {
                        sums[*cell] += value;
                    }
                    sums
                }
            })
            .collect();
        let mut products = DMatrix::zeros(width, width);
        products.view_mut((0, 0), (old, old)).copy_from(&self.products);
        // Columns that are the same in every revolution, which most are: by panels as matrix products.
        let in_cells: Vec<usize> = (0..width).filter(|c| matches!(self.values[*c], Values::Cells(_))).collect();
        let fresh: Vec<usize> = in_cells.iter().copied().filter(|c| *c >= old).collect();
        let matrix = self.cell_matrix(&in_cells);
        let panels: Vec<(Vec<usize>, DMatrix<f64>)> = fresh
            .par_chunks(PANEL)
            .map(|panel| {
                let left =
                    DMatrix::from_fn(panel.len(), self.cell_weight.len(), |n, cell| weighted[panel[n] - old][cell]);
                (panel.to_vec(), left * &matrix)
            })
            .collect();
        for (panel, values) in panels {
            for (m, a) in panel.into_iter().enumerate() {
                for (n, b) in in_cells.iter().enumerate() {
                    products[(a, *b)] = values[(m, n)];
                    products[(*b, a)] = values[(m, n)];
                }
            }
        }
        let rows: Vec<Vec<f64>> = (old..width)
            .into_par_iter()
            .map(|a| {
                (0..=a)
                    .map(|b| {
                        let at = a - old;
                        match (&self.values[a], &self.values[b]) {
                            (Values::Cells(_), Values::Cells(_)) => products[(a, b)],
                            (Values::Places(_), Values::Places(y)) => dot(&weighted[at], y),
                            (Values::Places(_), Values::Cells(y)) => dot(&by_cell[at], y),
                            (Values::Cells(x), Values::Places(y)) => {
                                if b >= old {
                                    dot(&by_cell[b - old], x)
                                } else {
                                    grid.cell_of.iter().zip(&grid.weight).zip(y).map(|((c, w), y)| x[*c] * w * y).sum()
                                }
                            }
                        }
                    })
                    .collect()
            })
            .collect();
        for (a, row) in rows.into_iter().enumerate() {
            for (b, value) in row.into_iter().enumerate() {
                products[(old + a, b)] = value;
                products[(b, old + a)] = value;
            }
        }
        self.products = products;
        let values = &self.values;
        let wave_values = &self.wave_values;
        self.waves.par_iter_mut().zip(&grid.revolutions).for_each(|(waves, revolution)| {
            let mut grown = DMatrix::zeros(WAVES, width);
            grown.view_mut((0, 0), (WAVES, old)).copy_from(waves);
            let count = revolution.places.len();
            let mut z = DMatrix::zeros(WAVES, count);
            for (n, place) in revolution.places.clone().enumerate() {
                let w = grid.weight[place];
                for (a, value) in wave_values[grid.cell_of[place]].iter().enumerate() {
                    z[(a, n)] = w * value;
                }
            }
            let mut x = DMatrix::zeros(count, width - old);
            for (n, column) in values[old..].iter().enumerate() {
                match column {
                    Values::Cells(v) => {
                        for (row, place) in revolution.places.clone().enumerate() {
                            x[(row, n)] = v[grid.cell_of[place]];
                        }
                    }
                    Values::Places(v) => {
                        for (row, place) in revolution.places.clone().enumerate() {
                            x[(row, n)] = v[place];
                        }
                    }
                }
            }
            grown.view_mut((0, old), (WAVES, width - old)).copy_from(&(z * x));
            *waves = grown;
        });
    }

    fn cell_matrix(&self, columns: &[usize]) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.cell_weight.len(), columns.len());
        for (mut to, column) in matrix.column_iter_mut().zip(columns) {
            if let Values::Cells(x) = &self.values[*column] {
                to.copy_from_slice(x);
            }
        }
        matrix
    }

    /// Values of a column at every place.
    #[must_use]
    pub fn column(&self, grid: &Grid, column: usize) -> Vec<f64> {
        match &self.values[column] {
            Values::Cells(x) => grid.cell_of.iter().map(|cell| x[*cell]).collect(),
            Values::Places(x) => x.clone(),
        }
    }

    /// Σ columns · amplitudes at every place.
    #[must_use]
    pub fn trace(&self, grid: &Grid, amplitudes: &[(usize, f64)]) -> Vec<f64> {
        let mut cells = vec![0.0; self.cell_weight.len()];
        let mut places = vec![0.0; grid.places.len()];
        for (column, amplitude) in amplitudes {
            match &self.values[*column] {
                Values::Cells(x) => cells.iter_mut().zip(x).for_each(|(sum, x)| *sum += amplitude * x),
                Values::Places(x) => places.iter_mut().zip(x).for_each(|(sum, x)| *sum += amplitude * x),
            }
        }
        places.iter_mut().zip(&grid.cell_of).for_each(|(sum, cell)| *sum += cells[*cell]);
        places
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums at once, so that the additions need not wait for one another.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a4.zip(b4) {
        for n in 0..4 {
            sums[n] += a[n] * b[n];
        }
    }
    sums.iter().sum::<f64>() + rest
}
