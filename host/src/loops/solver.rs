//! Sparse symmetric positive systems of 3 x 3 blocks, a block a pose and one an edge, solved by `faer`: Cholesky with an approximate
//! minimum degree ordering.
//!
//! The structure (ordering, and where the factor has entries) is found once and used for every set of numbers. One thread, so that the
//! order of sums, and with it every bit of the result, does not depend on how many there are.

use faer::linalg::solvers::SolveCore;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Side};

/// A 3 x 3 block, row by row.
pub type Block = [f64; 9];

/// Which blocks a system has, and its order of elimination.
#[derive(Clone, Debug)]
pub struct Structure {
    /// Where each column of blocks begins in `rows`; one more than there are columns.
    starts: Vec<usize>,
    /// The rows of each column's blocks on and below the diagonal, ascending.
    rows: Vec<usize>,
    entries: SymbolicSparseColMat<usize>,
    /// `None` when there was no memory for it: then nothing is solved.
    symbolic: Option<SymbolicLlt<usize>>,
}

/// The matrix is not positive: some variable is held by nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositive;

impl Structure {
    /// Orders `count` variables that the given pairs join.
    pub fn new(count: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut columns: Vec<Vec<usize>> = (0..count).map(|at| vec![at]).collect();
        for (one, other) in pairs {
            columns[one.min(other)].push(one.max(other));
        }
        let (mut starts, mut rows) = (vec![0], Vec::new());
        let (mut ends, mut numbers) = (vec![0], Vec::new());
        for column in &mut columns {
            column.sort_unstable();
            column.dedup();
            rows.extend_from_slice(column);
            starts.push(rows.len());
            for _ in 0..3 {
                numbers.extend(column.iter().flat_map(|row| [3 * row, 3 * row + 1, 3 * row + 2]));
                ends.push(numbers.len());
            }
        }
        let entries = SymbolicSparseColMat::new_checked(3 * count, 3 * count, ends, None, numbers);
        let symbolic = SymbolicLlt::try_new(entries.as_ref(), Side::Lower).ok();
        Self { starts, rows, entries, symbolic }
    }

    /// Variables.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no variable.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the numbers of a block on or below the diagonal are: the first one, and from one column to the next.
    fn place(&self, row: usize, column: usize) -> Option<(usize, usize)> {
        let (start, end) = (self.starts[column], self.starts[column + 1]);
        let at = self.rows[start..end].binary_search(&row).ok()?;
        Some((9 * start + 3 * at, 3 * (end - start)))
    }
}

/// A system to be filled and solved.
#[derive(Clone, Debug)]
pub struct System<'a> {
    structure: &'a Structure,
    values: Vec<f64>,
    right: Vec<[f64; 3]>,
}

impl<'a> System<'a> {
    /// All zeros.
    pub fn new(structure: &'a Structure) -> Self {
        Self {
            structure,
            values: vec![0.0; 9 * structure.rows.len()],
            right: vec![[0.0; 3]; structure.len()],
        }
    }

    /// Adds to the block on the diagonal, and to the right hand side.
    pub fn add(&mut self, variable: usize, block: &Block, right: [f64; 3]) {
        self.add_block(variable, variable, block);
        for (sum, value) in self.right[variable].iter_mut().zip(right) {
            *sum += value;
        }
    }

    /// Adds to the block of `row` and `column`, which the structure has, and by symmetry to its mirror.
    pub fn add_pair(&mut self, row: usize, column: usize, block: &Block) {
        if row > column {
            self.add_block(row, column, block);
        } else {
            self.add_block(column, row, &std::array::from_fn(|at| block[3 * (at % 3) + at / 3]));
        }
    }

    fn add_block(&mut self, row: usize, column: usize, block: &Block) {
        let Some((first, stride)) = self.structure.place(row, column) else { return };
        for (at, value) in block.iter().enumerate() {
            self.values[first + at % 3 * stride + at / 3] += value;
        }
    }

    /// Adds to every number on the diagonal.
    pub fn damp(&mut self, value: f64) {
        let block = std::array::from_fn(|at| if at % 4 == 0 { value } else { 0.0 });
        for variable in 0..self.structure.len() {
            self.add_block(variable, variable, &block);
        }
    }

    /// Solves, and gives the unknowns in the order of the variables.
    ///
    /// # Errors
    /// When the matrix is not positive.
    pub fn solve(mut self) -> Result<Vec<[f64; 3]>, NotPositive> {
        let right = std::mem::take(&mut self.right);
        Ok(self.factor()?.solve(&right))
    }

    /// Factors the matrix, to be solved for many right hand sides.
    ///
    /// # Errors
    /// When the matrix is not positive.
    pub fn factor(&self) -> Result<Factor, NotPositive> {
        let symbolic = self.structure.symbolic.clone().ok_or(NotPositive)?;
        let matrix = SparseColMatRef::new(self.structure.entries.as_ref(), &self.values);
        Llt::try_new_with_symbolic(symbolic, matrix, Side::Lower).map(Factor).map_err(|_| NotPositive)
    }
}

/// A factored system.
#[derive(Clone, Debug)]
pub struct Factor(Llt<usize, f64>);

impl Factor {
    /// The unknowns for a right hand side.
    pub fn solve(&self, right: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut found = right.to_vec();
        let flat = found.as_flattened_mut();
        let rows = flat.len();
        self.0.solve_in_place_with_conj(Conj::No, MatMut::from_column_major_slice_mut(flat, rows, 1));
        found
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{Block, NotPositive, Structure, System};

    /// A number between -1 and 1 that looks random.
    fn noise(at: usize) -> f64 {
        ((at * 7919 + 104_729) % 1009) as f64 / 504.5 - 1.0
    }

    fn block(salt: usize) -> Block {
        std::array::from_fn(|at| noise(17 * salt + at))
    }

    /// `a a^T`, positive with something on the diagonal.
    fn square(a: &Block, diagonal: f64) -> Block {
        std::array::from_fn(|at| {
            let (row, column) = (at / 3, at % 3);
            let product: f64 = (0..3).map(|k| a[3 * row + k] * a[3 * column + k]).sum();
            product + if row == column { diagonal } else { 0.0 }
        })
    }

    #[test]
    fn a_sparse_system_has_the_solution_of_the_dense_one() {
        let count = 23;
        // A chain with loops.
        let pairs: Vec<(usize, usize)> =
            (1..count).map(|at| (at, at - 1)).chain([(0, 9), (20, 3), (5, 17), (22, 11), (2, 15)]).collect();
        let structure = Structure::new(count, pairs.iter().copied());
        let mut system = System::new(&structure);
        let mut dense: DMatrix<f64> = DMatrix::zeros(3 * count, 3 * count);
        let mut right: DVector<f64> = DVector::zeros(3 * count);
        for at in 0..count {
            let block = square(&block(at), 9.0);
            let values = [noise(3 * at), noise(3 * at + 1), noise(3 * at + 2)];
            system.add(at, &block, values);
            for k in 0..9 {
                dense[(3 * at + k / 3, 3 * at + k % 3)] += block[k];
            }
            for axis in 0..3 {
                right[3 * at + axis] += values[axis];
            }
        }
        for (salt, &(row, column)) in pairs.iter().enumerate() {
            let block = block(100 + salt);
            system.add_pair(row, column, &block);
            for k in 0..9 {
                dense[(3 * row + k / 3, 3 * column + k % 3)] += block[k];
                dense[(3 * column + k % 3, 3 * row + k / 3)] += block[k];
            }
        }
        let found = system.solve().unwrap();
        let expected = dense.lu().solve(&right).unwrap();
        for (at, value) in found.iter().flatten().enumerate() {
            assert!(f64::abs(value - expected[at]) < 1e-10, "{at}: {value} is not {}", expected[at]);
        }
    }

    #[test]
    fn a_system_that_nothing_holds_is_not_positive() {
        let structure = Structure::new(2, [(0, 1)].into_iter());
        let mut system = System::new(&structure);
        system.add(0, &square(&block(1), 1.0), [0.0; 3]);
        assert_eq!(system.solve().unwrap_err(), NotPositive);
    }
}
