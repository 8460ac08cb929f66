//! Sparse symmetric positive systems of 3 x 3 blocks, a block a pose and one an edge: Cholesky with a minimum
//! degree ordering.
//!
//! Poses are eliminated in the order of how many others they are then joined to (Tinney and Walker, "Direct
//! solutions of sparse network equations", 1967), so that the chain of a drive costs nothing and only the
//! places where loops meet fill in. The structure (ordering, and which blocks the factor has) is found once
//! and used for every set of numbers.
//!
//! Written here because the library that did it, `faer`, was a quarter of all compiling: a pose graph needs
//! two of its many factorizations. One order of sums and no instructions chosen by the processor: the same
//! bits on every machine and any number of threads.

use crate::slam::pose_graph::elimination_order::{Elimination, eliminate};

/// A 3 x 3 block, row by row.
pub(crate) type Block = [f64; 9];

/// Which blocks the factor of a system has, and the order of elimination.
#[derive(Clone, Debug)]
pub(crate) struct Structure {
    /// Position of each variable in the order.
    position: Vec<usize>,
    /// Where the blocks below the diagonal of each position begin in `rows`; one more than there are
    /// positions.
    starts: Vec<usize>,
    /// Positions of the rows of each column's blocks below the diagonal, ascending.
    rows: Vec<u32>,
}

/// The matrix is not positive: some variable is held by nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NonPositive;

impl Structure {
    /// Orders `count` variables that the given pairs join.
    pub(crate) fn new(count: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let Elimination { position, starts, neighbors: mut rows } = eliminate(count, pairs);
        rows.iter_mut().for_each(|row| *row = position[*row as usize] as u32);
        starts.windows(2).for_each(|own| rows[own[0]..own[1]].sort_unstable());
        Self { position, starts, rows }
    }

    /// Variables.
    pub(crate) fn len(&self) -> usize {
        self.position.len()
    }

    /// Blocks below the diagonal of the factor.
    #[cfg(test)]
    pub(crate) fn blocks(&self) -> usize {
        self.rows.len()
    }

    /// Where the blocks below the diagonal of a column are.
    fn column(&self, at: usize) -> std::ops::Range<usize> {
        self.starts[at]..self.starts[at + 1]
    }
}

/// The place of a block below the diagonal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    at: usize,
    is_mirrored: bool,
}

/// A system to be filled and solved.
#[derive(Clone, Debug)]
pub(crate) struct System<'a> {
    structure: &'a Structure,
    /// By position.
    diagonal: Vec<Block>,
    /// Beside [`Structure::rows`].
    below: Vec<Block>,
    /// By variable.
    right: Vec<[f64; 3]>,
}

impl<'a> System<'a> {
    /// All zeros.
    pub(crate) fn new(structure: &'a Structure) -> Self {
        Self {
            structure,
            diagonal: vec![[0.0; 9]; structure.len()],
            below: vec![[0.0; 9]; structure.rows.len()],
            right: vec![[0.0; 3]; structure.len()],
        }
    }

    /// Adds to the block on the diagonal, and to the right hand side.
    pub(crate) fn add(&mut self, variable: usize, block: &Block, right: [f64; 3]) {
        add_to(&mut self.diagonal[self.structure.position[variable]], block);
        for (sum, value) in self.right[variable].iter_mut().zip(right) {
            *sum += value;
        }
    }

    /// Adds to the block of `row` and `column`, which the structure has, and by symmetry to its mirror.
    pub(crate) fn add_pair(&mut self, row: usize, column: usize, block: &Block) {
        self.add_at(self.slot(row, column), block);
    }

    /// Where the block of `row` and `column` is; `None` where the structure has none.
    pub(crate) fn slot(&self, row: usize, column: usize) -> Option<Slot> {
        let [row, column] = [row, column].map(|variable| self.structure.position[variable]);
        let blocks = self.structure.column(row.min(column));
        let at = self.structure.rows[blocks.clone()].binary_search(&(row.max(column) as u32)).ok()?;
        Some(Slot { at: blocks.start + at, is_mirrored: row < column })
    }

    /// The same as [`System::add_pair`] for a block whose place is known.
    pub(crate) fn add_at(&mut self, slot: Option<Slot>, block: &Block) {
        match slot {
            Some(Slot { at, is_mirrored: true }) => add_to(&mut self.below[at], &transposed(block)),
            Some(Slot { at, is_mirrored: false }) => add_to(&mut self.below[at], block),
            None => (),
        }
    }

    /// Adds to every number on the diagonal.
    pub(crate) fn damp(&mut self, value: f64) {
        for block in &mut self.diagonal {
            for axis in 0..3 {
                block[4 * axis] += value;
            }
        }
    }

    /// Solves, and gives the unknowns in the order of the variables.
    ///
    /// # Errors
    /// When the matrix is not positive.
    pub(crate) fn solve(mut self) -> Result<Vec<[f64; 3]>, NonPositive> {
        let right = std::mem::take(&mut self.right);
        Ok(self.factor()?.solve(&right))
    }

    /// Factors the matrix, to be solved for many right hand sides.
    ///
    /// # Errors
    /// When the matrix is not positive.
    pub(crate) fn factor(mut self) -> Result<Factor<'a>, NonPositive> {
        let mut held = Vec::new();
        for column in 0..self.structure.len() {
            self.eliminate(column, &mut held)?;
        }
        Ok(Factor { structure: self.structure, diagonal: self.diagonal, below: self.below })
    }

    /// Makes a column one of the factor, and takes what it explains off the columns to its right. `held` is
    /// memory for it.
    fn eliminate(&mut self, column: usize, held: &mut Vec<(u32, Block)>) -> Result<(), NonPositive> {
        let root = root(&self.diagonal[column]).ok_or(NonPositive)?;
        self.diagonal[column] = root;
        let own = self.structure.column(column);
        // All columns that it meets are later ones.
        let (before, after) = self.below.split_at_mut(own.end);
        // Variables that may not move are joined to others by zeros, and explain nothing.
        held.clear();
        for (&row, block) in self.structure.rows[own.clone()].iter().zip(&mut before[own.clone()]) {
            if *block != [0.0; 9] {
                *block = divided(block, &root);
                held.push((row, *block));
            }
        }
        for (first, (target, left)) in held.iter().enumerate() {
            subtract_product(&mut self.diagonal[*target as usize], left, left);
            let its = self.structure.column(*target as usize);
            let mut slots = self.structure.rows[its.clone()]
                .iter()
                .zip(&mut after[its.start - own.end..its.end - own.end]);
            for (row, block) in &held[first + 1..] {
                // The structure has a slot for each: both lists ascend.
                if let Some((_, slot)) = slots.find(|(at, _)| *at == row) {
                    subtract_product(slot, block, left);
                }
            }
        }
        Ok(())
    }
}

/// A factored system.
#[derive(Clone, Debug)]
pub(crate) struct Factor<'a> {
    structure: &'a Structure,
    diagonal: Vec<Block>,
    below: Vec<Block>,
}

/// What is solved for at once, row by row of a variable.
type Values<const N: usize> = [[f64; N]; 3];

impl Factor<'_> {
    /// The unknowns for a right hand side, both in the order of the variables.
    pub(crate) fn solve(&self, right: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut ordered = vec![[[0.0]; 3]; right.len()];
        for (&at, right) in self.structure.position.iter().zip(right) {
            ordered[at] = right.map(|value| [value]);
        }
        (0..ordered.len()).for_each(|column| self.forward(column, &mut ordered));
        (0..ordered.len()).rev().for_each(|column| self.backward(column, &mut ordered));
        self.structure.position.iter().map(|&at| ordered[at].map(|[value]| value)).collect()
    }

    /// The part of the inverse that two variables share: entries of each column, the first variable's first.
    ///
    /// Only what is eliminated after them and joined to them has a part in it.
    pub(crate) fn inverse_of(&self, variables: [usize; 2]) -> [[f64; 6]; 6] {
        let positions = variables.map(|variable| self.structure.position[variable]);
        let mut path: Vec<usize> = positions
            .iter()
            .flat_map(|&position| {
                let next =
                    |at: &usize| Some(*self.structure.rows[self.structure.column(*at)].first()? as usize);
                std::iter::successors(Some(position), next)
            })
            .collect();
        path.sort_unstable();
        path.dedup();
        let mut values: Vec<Values<6>> = vec![[[0.0; 6]; 3]; self.structure.len()];
        for at in 0..6 {
            values[positions[at / 3]][at % 3][at] = 1.0;
        }
        path.iter().for_each(|&column| self.forward(column, &mut values));
        path.iter().rev().for_each(|&column| self.backward(column, &mut values));
        std::array::from_fn(|column| std::array::from_fn(|row| values[positions[row / 3]][row % 3][column]))
    }

    /// A step of solving with the lower factor, in the order of elimination.
    fn forward<const N: usize>(&self, column: usize, values: &mut [Values<N>]) {
        let l = &self.diagonal[column];
        let [a, b, c] = values[column];
        let x: [f64; N] = std::array::from_fn(|n| a[n] / l[0]);
        let y: [f64; N] = std::array::from_fn(|n| (b[n] - l[3] * x[n]) / l[4]);
        let z: [f64; N] = std::array::from_fn(|n| (c[n] - l[6] * x[n] - l[7] * y[n]) / l[8]);
        values[column] = [x, y, z];
        for (&row, block) in self.blocks(column) {
            for (axis, value) in values[row as usize].iter_mut().enumerate() {
                for n in 0..N {
                    value[n] -=
                        block[3 * axis] * x[n] + block[3 * axis + 1] * y[n] + block[3 * axis + 2] * z[n];
                }
            }
        }
    }

    /// A step of solving with the transposed factor, in the reverse order.
    fn backward<const N: usize>(&self, column: usize, values: &mut [Values<N>]) {
        let l = &self.diagonal[column];
        let mut sum = values[column];
        for (&row, block) in self.blocks(column) {
            let known = values[row as usize];
            for (axis, value) in sum.iter_mut().enumerate() {
                for n in 0..N {
                    value[n] -= block[axis] * known[0][n]
                        + block[3 + axis] * known[1][n]
                        + block[6 + axis] * known[2][n];
                }
            }
        }
        let z: [f64; N] = std::array::from_fn(|n| sum[2][n] / l[8]);
        let y: [f64; N] = std::array::from_fn(|n| (sum[1][n] - l[7] * z[n]) / l[4]);
        let x: [f64; N] = std::array::from_fn(|n| (sum[0][n] - l[3] * y[n] - l[6] * z[n]) / l[0]);
        values[column] = [x, y, z];
    }

    /// The blocks below the diagonal of a column, each with its row.
    fn blocks(&self, column: usize) -> impl Iterator<Item = (&u32, &Block)> {
        let own = self.structure.column(column);
        self.structure.rows[own.clone()].iter().zip(&self.below[own])
    }
}

fn add_to(sum: &mut Block, block: &Block) {
    for (sum, value) in sum.iter_mut().zip(block) {
        *sum += value;
    }
}

fn transposed(block: &Block) -> Block {
    std::array::from_fn(|at| block[3 * (at % 3) + at / 3])
}

/// `sum - a b^T`.
fn subtract_product(sum: &mut Block, a: &Block, b: &Block) {
    for row in 0..3 {
        for column in 0..3 {
            sum[3 * row + column] -= a[3 * row] * b[3 * column]
                + a[3 * row + 1] * b[3 * column + 1]
                + a[3 * row + 2] * b[3 * column + 2];
        }
    }
}

/// The lower triangular root of a positive block.
fn root(block: &Block) -> Option<Block> {
    let positive = |value: f64| (value > 0.0 && value.is_finite()).then(|| value.sqrt());
    let a = positive(block[0])?;
    let (b, d) = (block[3] / a, block[6] / a);
    let c = positive(block[4] - b * b)?;
    let e = (block[7] - d * b) / c;
    let f = positive(block[8] - d * d - e * e)?;
    Some([a, 0.0, 0.0, b, c, 0.0, d, e, f])
}

/// `block root^-T`.
fn divided(block: &Block, root: &Block) -> Block {
    let mut out = [0.0; 9];
    for row in 0..3 {
        let x = block[3 * row] / root[0];
        let y = (block[3 * row + 1] - x * root[3]) / root[4];
        let z = (block[3 * row + 2] - x * root[6] - y * root[7]) / root[8];
        (out[3 * row], out[3 * row + 1], out[3 * row + 2]) = (x, y, z);
    }
    out
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{Block, NonPositive, Structure, System};

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
        assert_eq!(system.solve().unwrap_err(), NonPositive);
    }

    #[test]
    fn a_chain_fills_nothing_in() {
        let structure = Structure::new(1000, (1..1000).map(|at| (at - 1, at)));
        assert_eq!(structure.rows.len(), 999);
    }

    #[test]
    fn a_grid_fills_in_far_less_than_row_by_row() {
        let side = 40;
        let right = (0..side * side).filter(|at| at % side > 0).map(|at| (at - 1, at));
        let below = (side..side * side).map(|at| (at - side, at));
        let structure = Structure::new(side * side, right.chain(below));
        let row_by_row = side * side * side;
        assert!(3 * structure.rows.len() < row_by_row, "{}", structure.rows.len());
    }
}
