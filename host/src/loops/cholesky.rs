//! Sparse symmetric positive systems of 3 x 3 blocks: Cholesky with a minimum degree ordering.
//!
//! A pose graph's matrix has a block a pose and one an edge. Poses are eliminated in the order of how many others they are then
//! joined to (Tinney and Walker 1967), so that the chain of a drive costs nothing and only the places where loops meet fill in.
//! Written here because the libraries that are kept up cost more: `faer` 50 crates and two minutes of compiling, `nalgebra-sparse`
//! has no ordering. One order of sums: the same bits on every machine.

use std::collections::BTreeSet;

/// A 3 x 3 block, row by row.
pub type Block = [f64; 9];

/// The order of elimination, and which blocks the factor has.
#[derive(Clone, Debug)]
pub struct Structure {
    /// Position of each variable in the order.
    position: Vec<usize>,
    /// For each position the later positions that its column holds, ascending.
    columns: Vec<Vec<u32>>,
}

/// The matrix is not positive: some variable is held by nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositive;

impl Structure {
    /// Orders `count` variables that the given pairs join.
    pub fn new(count: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut joined: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (one, other) in pairs.filter(|(one, other)| one != other) {
            joined[one].push(other as u32);
            joined[other].push(one as u32);
        }
        for list in &mut joined {
            list.sort_unstable();
            list.dedup();
        }
        let mut queue: BTreeSet<(usize, usize)> =
            joined.iter().enumerate().map(|(variable, list)| (list.len(), variable)).collect();
        let mut position = vec![0; count];
        let mut columns = Vec::with_capacity(count);
        while let Some((_, variable)) = queue.pop_first() {
            position[variable] = columns.len();
            let clique = std::mem::take(&mut joined[variable]);
            for &neighbour in &clique {
                let at = neighbour as usize;
                queue.remove(&(joined[at].len(), at));
                joined[at] = union_without(&joined[at], &clique, [neighbour, variable as u32]);
                queue.insert((joined[at].len(), at));
            }
            columns.push(clique);
        }
        for column in &mut columns {
            for entry in column.iter_mut() {
                *entry = position[*entry as usize] as u32;
            }
            column.sort_unstable();
        }
        Self { position, columns }
    }

    /// Variables.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there is no variable.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }
}

/// The union of two ascending lists, without two entries.
fn union_without(one: &[u32], other: &[u32], without: [u32; 2]) -> Vec<u32> {
    let mut union = Vec::with_capacity(one.len() + other.len());
    let (mut i, mut j) = (0, 0);
    while i < one.len() || j < other.len() {
        let next = match (one.get(i), other.get(j)) {
            (Some(&a), Some(&b)) => a.min(b),
            (Some(&a), None) | (None, Some(&a)) => a,
            (None, None) => break,
        };
        i += usize::from(one.get(i) == Some(&next));
        j += usize::from(other.get(j) == Some(&next));
        if !without.contains(&next) {
            union.push(next);
        }
    }
    union
}

/// A system to be filled and solved.
#[derive(Clone, Debug)]
pub struct System<'a> {
    structure: &'a Structure,
    diagonal: Vec<Block>,
    below: Vec<Vec<Block>>,
    right: Vec<[f64; 3]>,
}

impl<'a> System<'a> {
    /// All zeros.
    pub fn new(structure: &'a Structure) -> Self {
        let count = structure.len();
        Self {
            structure,
            diagonal: vec![[0.0; 9]; count],
            below: structure.columns.iter().map(|column| vec![[0.0; 9]; column.len()]).collect(),
            right: vec![[0.0; 3]; count],
        }
    }

    /// Adds to the block on the diagonal, and to the right hand side.
    pub fn add(&mut self, variable: usize, block: &Block, right: [f64; 3]) {
        let at = self.structure.position[variable];
        add_to(&mut self.diagonal[at], block);
        for (sum, value) in self.right[at].iter_mut().zip(right) {
            *sum += value;
        }
    }

    /// Adds to the block of `row` and `column`, which the structure has, and by symmetry to its mirror.
    pub fn add_pair(&mut self, row: usize, column: usize, block: &Block) {
        let [row, column] = [row, column].map(|variable| self.structure.position[variable]);
        let (low, high, block) =
            if row > column { (column, row, *block) } else { (row, column, transposed(block)) };
        if let Ok(at) = self.structure.columns[low].binary_search(&(high as u32)) {
            add_to(&mut self.below[low][at], &block);
        }
    }

    /// Adds to every number on the diagonal.
    pub fn damp(&mut self, value: f64) {
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
    pub fn solve(self) -> Result<Vec<[f64; 3]>, NotPositive> {
        let right: Vec<[f64; 3]> = self.structure.position.iter().map(|&at| self.right[at]).collect();
        Ok(self.factor()?.solve(&right))
    }

    /// Factors the matrix, to be solved for many right hand sides.
    ///
    /// # Errors
    /// When the matrix is not positive.
    pub fn factor(mut self) -> Result<Factor<'a>, NotPositive> {
        for column in 0..self.diagonal.len() {
            let root = root(&self.diagonal[column]).ok_or(NotPositive)?;
            self.diagonal[column] = root;
            let mut blocks = std::mem::take(&mut self.below[column]);
            for block in &mut blocks {
                *block = divided(block, &root);
            }
            let rows = &self.structure.columns[column];
            for (first, (&target, left)) in rows.iter().zip(&blocks).enumerate() {
                let target = target as usize;
                subtract_product(&mut self.diagonal[target], left, left);
                let (targets, held) = (&self.structure.columns[target], &mut self.below[target]);
                let mut at = 0;
                for (&row, block) in rows[first + 1..].iter().zip(&blocks[first + 1..]) {
                    while targets[at] != row {
                        at += 1;
                    }
                    subtract_product(&mut held[at], block, left);
                }
            }
            self.below[column] = blocks;
        }
        Ok(Factor(self))
    }

    /// The unknowns, in the order of the variables, of a right hand side in the order of elimination.
    fn substitute(&self, mut right: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        for column in 0..right.len() {
            let [a, b, c] = right[column];
            let l = &self.diagonal[column];
            let x = a / l[0];
            let y = (b - l[3] * x) / l[4];
            let z = (c - l[6] * x - l[7] * y) / l[8];
            right[column] = [x, y, z];
            for (&row, block) in self.structure.columns[column].iter().zip(&self.below[column]) {
                for axis in 0..3 {
                    right[row as usize][axis] -=
                        block[3 * axis] * x + block[3 * axis + 1] * y + block[3 * axis + 2] * z;
                }
            }
        }
        for column in (0..right.len()).rev() {
            let mut sum = right[column];
            for (&row, block) in self.structure.columns[column].iter().zip(&self.below[column]) {
                let known = right[row as usize];
                for (axis, value) in sum.iter_mut().enumerate() {
                    *value -=
                        block[axis] * known[0] + block[3 + axis] * known[1] + block[6 + axis] * known[2];
                }
            }
            let l = &self.diagonal[column];
            let z = sum[2] / l[8];
            let y = (sum[1] - l[7] * z) / l[4];
            let x = (sum[0] - l[3] * y - l[6] * z) / l[0];
            right[column] = [x, y, z];
        }
        self.structure.position.iter().map(|&at| right[at]).collect()
    }
}

/// A factored system.
#[derive(Clone, Debug)]
pub struct Factor<'a>(System<'a>);

impl Factor<'_> {
    /// The unknowns for a right hand side, both in the order of the variables.
    pub fn solve(&self, right: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut ordered = vec![[0.0; 3]; right.len()];
        for (&at, right) in self.0.structure.position.iter().zip(right) {
            ordered[at] = *right;
        }
        self.0.substitute(ordered)
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

    #[test]
    fn a_chain_fills_nothing_in() {
        let structure = Structure::new(1000, (1..1000).map(|at| (at - 1, at)));
        let blocks: usize = structure.columns.iter().map(Vec::len).sum();
        assert_eq!(blocks, 999);
    }
}
