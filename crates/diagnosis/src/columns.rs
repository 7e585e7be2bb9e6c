//! Values of all columns of a design matrix, and their sums over the grid.
//!
//! Most traces are the same in every revolution of a run: their columns hold one value a cell. Those that evolve hold one a place,
//! and beside it their weighted sums over each cell, which is all that a column of cells needs of them.

use nalgebra::{DMatrix, DMatrixView};

use super::gram::{Panel, panels};
use super::grid::{Grid, Revolution};

/// Values of a column: once a cell, or once a place where it evolves.
pub(super) enum Values {
    Cells(Vec<f64>),
    Places(Vec<f64>),
}

/// Where a column is kept.
#[derive(Clone, Copy)]
enum Slot {
    Cells(usize),
    Places(usize),
}

/// Columns, kept by kind one after the other.
#[derive(Clone, Default)]
pub(super) struct Columns {
    slots: Vec<Slot>,
    in_cells: Vec<f64>,
    in_places: Vec<f64>,
    /// Sums of the columns in `in_places` over each cell.
    sums: Vec<f64>,
}

impl Columns {
    pub(super) fn len(&self) -> usize {
        self.slots.len()
    }

    /// Makes room for columns, and no more than that: they are what most of the memory goes to.
    pub(super) fn reserve(&mut self, grid: &Grid, in_cells: usize, in_places: usize) {
        self.in_cells.reserve_exact(in_cells * grid.cells.len());
        self.in_places.reserve_exact(in_places * grid.places.len());
        self.sums.reserve_exact(in_places * grid.cells.len());
    }

    pub(super) fn push(&mut self, grid: &Grid, values: Values) {
        match values {
            Values::Cells(x) => {
                self.slots.push(Slot::Cells(self.in_cells.len() / grid.cells.len()));
                self.in_cells.extend(x);
            }
            Values::Places(x) => {
                self.slots.push(Slot::Places(self.in_places.len() / grid.places.len()));
                let first = self.sums.len();
                self.sums.resize(first + grid.cells.len(), 0.0);
                let sums = &mut self.sums[first..];
                for ((cell, w), value) in grid.cell_of.iter().zip(&grid.weight).zip(&x) {
                    sums[*cell] += w * value;
                }
                self.in_places.extend(x);
            }
        }
    }

    /// Some of the columns, copied.
    pub(super) fn only(&self, grid: &Grid, columns: &[usize]) -> Self {
        let mut few = Self::default();
        columns.iter().for_each(|column| few.push(grid, self.values(grid, *column)));
        few
    }

    fn values(&self, grid: &Grid, column: usize) -> Values {
        match self.slots[column] {
            Slot::Cells(n) => Values::Cells(self.cells(grid).column(n).iter().copied().collect()),
            Slot::Places(n) => Values::Places(self.places(grid).column(n).iter().copied().collect()),
        }
    }

    fn cells(&self, grid: &Grid) -> DMatrixView<'_, f64> {
        let rows = grid.cells.len();
        DMatrixView::from_slice(&self.in_cells, rows, self.in_cells.len() / rows)
    }

    fn places(&self, grid: &Grid) -> DMatrixView<'_, f64> {
        let rows = grid.places.len();
        DMatrixView::from_slice(&self.in_places, rows, self.in_places.len() / rows)
    }

    fn sums(&self, grid: &Grid) -> DMatrixView<'_, f64> {
        let rows = grid.cells.len();
        DMatrixView::from_slice(&self.sums, rows, self.sums.len() / rows)
    }

    /// Numbers of the columns of each kind, and how many of them are among the first `old`.
    fn by_kind(&self, old: usize) -> ([Vec<usize>; 2], [usize; 2]) {
        let mut kinds = [Vec::new(), Vec::new()];
        let mut before = [0, 0];
        for (column, slot) in self.slots.iter().enumerate() {
            let kind = usize::from(matches!(slot, Slot::Places(_)));
            kinds[kind].push(column);
            before[kind] += usize::from(column < old);
        }
        (kinds, before)
    }

    /// XᵀWX, grown by the columns from `products` on; `cell_weight` are the weights' sums by cell.
    pub(super) fn grow_products(&self, grid: &Grid, cell_weight: &[f64], products: &mut DMatrix<f64>) {
        let old = products.nrows();
        let ([cells, places], [old_cells, old_places]) = self.by_kind(old);
        let mut grown = DMatrix::zeros(self.len(), self.len());
        grown.view_mut((0, 0), (old, old)).copy_from(products);
        let mut write = |rows: &[usize], columns: &[usize], made: Vec<Panel>| {
            for (start, panel) in made {
                for (n, b) in columns.iter().take(panel.ncols()).enumerate() {
                    for (m, a) in rows[start..start + panel.nrows()].iter().enumerate() {
                        grown[(*a, *b)] = panel[(m, n)];
                        grown[(*b, *a)] = panel[(m, n)];
                    }
                }
            }
        };
        let (x, y, sums) = (self.cells(grid), self.places(grid), self.sums(grid));
        write(&cells, &cells, panels(x, old_cells, Some(cell_weight), x, true));
        // Columns that evolve against those that do not: only by the cells' sums.
        write(&places, &cells, panels(sums, old_places, None, x, false));
        let fresh = x.columns(old_cells, cells.len() - old_cells);
        write(&places, &cells[old_cells..], panels(sums.columns(0, old_places), 0, None, fresh, false));
        write(&places, &places, panels(y, old_places, Some(&grid.weight), y, true));
        *products = grown;
    }

    /// ZᵀWX of a revolution, grown by the columns from `waves` on; `weighted` is ZᵀW at its places.
    pub(super) fn grow_waves(
        &self,
        grid: &Grid,
        revolution: &Revolution,
        weighted: &DMatrix<f64>,
        waves: &mut DMatrix<f64>,
    ) {
        let old = waves.ncols();
        let ([cells, places], [old_cells, old_places]) = self.by_kind(old);
        let mut grown = DMatrix::zeros(weighted.nrows(), self.len());
        grown.columns_mut(0, old).copy_from(waves);
        let mut write = |columns: &[usize], made: DMatrix<f64>| {
            for (column, values) in columns.iter().zip(made.column_iter()) {
                grown.set_column(*column, &values);
            }
        };
        let at = revolution.places.clone();
        let x = self.cells(grid);
        let x = x.columns(old_cells, cells.len() - old_cells);
        let numbers = &grid.cell_of[at.clone()];
        // Where a revolution passes its cells one after the other they need not be gathered.
        let made = if numbers.windows(2).all(|pair| pair[1] == pair[0] + 1) {
            weighted * x.rows(numbers[0], numbers.len())
        } else {
            weighted * DMatrix::from_fn(numbers.len(), x.ncols(), |n, c| x[(numbers[n], c)])
        };
        write(&cells[old_cells..], made);
        let y = self.places(grid);
        let y = y.columns(old_places, places.len() - old_places);
        write(&places[old_places..], weighted * y.rows(at.start, at.len()));
        *waves = grown;
    }

    /// Values of a column at every place.
    pub(super) fn at_places(&self, grid: &Grid, column: usize) -> Vec<f64> {
        match self.slots[column] {
            Slot::Cells(n) => {
                let x = self.cells(grid);
                let x = x.column(n);
                grid.cell_of.iter().map(|cell| x[*cell]).collect()
            }
            Slot::Places(n) => self.places(grid).column(n).iter().copied().collect(),
        }
    }

    /// Σ columns · amplitudes at every place.
    pub(super) fn trace(&self, grid: &Grid, amplitudes: &[(usize, f64)]) -> Vec<f64> {
        let mut cells = vec![0.0; grid.cells.len()];
        let mut places = vec![0.0; grid.places.len()];
        for (column, amplitude) in amplitudes {
            match self.slots[*column] {
                Slot::Cells(n) => add(&mut cells, *amplitude, self.cells(grid).column(n).as_slice()),
                Slot::Places(n) => add(&mut places, *amplitude, self.places(grid).column(n).as_slice()),
            }
        }
        places.iter_mut().zip(&grid.cell_of).for_each(|(sum, cell)| *sum += cells[*cell]);
        places
    }
}

fn add(sums: &mut [f64], amplitude: f64, values: &[f64]) {
    sums.iter_mut().zip(values).for_each(|(sum, x)| *sum += amplitude * x);
}
