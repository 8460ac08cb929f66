//! The order in which the variables of a sparse symmetric system are eliminated: always one of those that
//! are joined to the fewest others, of these the first.
//!
//! Variables that one joins are joined to each other once it is gone. While many are left, which ones are
//! joined is a set of pairs, so that a step costs what the one taken out joins and not what its neighbors do:
//! a plane that is seen all the way is joined to thousands. Once few are left, it is a bit for each pair.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::model::voxels::Keys;

/// What is eliminated after what, and what is left to join then.
#[derive(Clone, Debug)]
pub(crate) struct Elimination {
    /// Position of each variable in the order.
    pub position: Vec<usize>,
    /// Where the neighbors of each position begin; one more than there are positions.
    pub starts: Vec<usize>,
    /// For each position the variables that were left to join, in no order.
    pub neighbors: Vec<u32>,
}

/// With so many variables left a bit for each pair takes less time than a set, and 2 MB.
const FEW: usize = 4096;

/// Orders `count` variables that these pairs join, each pair once or more often.
pub(crate) fn eliminate(count: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Elimination {
    eliminate_with(count, pairs, FEW)
}

fn eliminate_with(count: usize, pairs: impl Iterator<Item = (usize, usize)>, few: usize) -> Elimination {
    let mut found = Elimination { position: vec![0; count], starts: vec![0], neighbors: Vec::new() };
    if count <= few {
        let mut bits = JoinedBits::new((0..count as u32).collect());
        pairs.for_each(|(one, other)| bits.join(one, other));
        bits.eliminate(&mut found);
        return found;
    }
    let mut set = JoinedSet::new(count);
    pairs.for_each(|(one, other)| set.join(one as u32, other as u32));
    set.eliminate(&mut found, few);
    let left: Vec<u32> = (0..count as u32).filter(|&variable| !set.is_gone[variable as usize]).collect();
    let mut bits = JoinedBits::new(left);
    for number in 0..bits.variables.len() {
        for &other in &set.lists[bits.variables[number] as usize] {
            if let Ok(other) = bits.variables.binary_search(&other) {
                bits.join(number, other);
            }
        }
    }
    bits.eliminate(&mut found);
    found
}

impl Elimination {
    fn push(&mut self, variable: u32, neighbors: impl Iterator<Item = u32>) {
        self.position[variable as usize] = self.starts.len() - 1;
        self.neighbors.extend(neighbors);
        self.starts.push(self.neighbors.len());
    }
}

/// Which variables are joined, as a set of pairs.
struct JoinedSet {
    /// The two numbers of each pair, the greater one first. Pairs of those that are gone may be forgotten.
    pairs: Keys,
    /// Those that each one is joined to, some of them gone.
    lists: Vec<Vec<u32>>,
    /// To how many each one is joined that are not gone.
    degrees: Vec<u32>,
    is_gone: Vec<bool>,
}

impl JoinedSet {
    fn new(count: usize) -> Self {
        let (lists, degrees) = (vec![Vec::new(); count], vec![0; count]);
        Self { pairs: Keys::default(), lists, degrees, is_gone: vec![false; count] }
    }

    fn join(&mut self, one: u32, other: u32) {
        if self.pairs.len() == self.pairs.capacity() {
            self.forget_gone();
        }
        let pair = u64::from(one.max(other)) << 32 | u64::from(one.min(other));
        if one == other || !self.pairs.insert(pair) {
            return;
        }
        for (at, other) in [(one, other), (other, one)] {
            self.lists[at as usize].push(other);
            self.degrees[at as usize] += 1;
        }
    }

    /// Makes room for as many pairs as there are, without those of variables that are gone.
    fn forget_gone(&mut self) {
        let is_left = |at: u64| !self.is_gone[at as usize];
        self.pairs.retain(|pair| is_left(pair >> 32) && is_left(pair & u64::from(u32::MAX)));
        self.pairs.reserve(self.pairs.len().max(64));
    }

    /// Takes out variables until few are left.
    fn eliminate(&mut self, found: &mut Elimination, few: usize) {
        let count = self.lists.len();
        // Holds what degrees were as well; those are passed over.
        let mut queue: BinaryHeap<Reverse<(u32, u32)>> =
            (0..).zip(&self.degrees).map(|(variable, &degree)| Reverse((degree, variable))).collect();
        while found.starts.len() + few <= count {
            let Some(Reverse((degree, variable))) = queue.pop() else { return };
            if self.is_gone[variable as usize] || self.degrees[variable as usize] != degree {
                continue;
            }
            self.is_gone[variable as usize] = true;
            let mut clique = std::mem::take(&mut self.lists[variable as usize]);
            clique.retain(|&neighbor| !self.is_gone[neighbor as usize]);
            for (number, &one) in clique.iter().enumerate() {
                self.degrees[one as usize] -= 1;
                clique[..number].iter().for_each(|&other| self.join(one, other));
            }
            queue.extend(clique.iter().map(|&one| Reverse((self.degrees[one as usize], one))));
            found.push(variable, clique.into_iter());
        }
    }
}

/// The degree of a variable that is taken out.
const GONE: u32 = u32::MAX;

/// Which variables are joined, a bit a pair.
struct JoinedBits {
    /// The variables, ascending.
    variables: Vec<u32>,
    /// Words of a row.
    width: usize,
    /// A row a variable. Each one is joined to itself.
    rows: Vec<u64>,
}

impl JoinedBits {
    fn new(variables: Vec<u32>) -> Self {
        let width = variables.len().div_ceil(64);
        let mut bits = Self { rows: vec![0; width * variables.len()], variables, width };
        (0..bits.variables.len()).for_each(|number| bits.join(number, number));
        bits
    }

    fn join(&mut self, one: usize, other: usize) {
        self.rows[one * self.width + other / 64] |= 1 << (other % 64);
        self.rows[other * self.width + one / 64] |= 1 << (one % 64);
    }

    /// Takes out all variables.
    fn eliminate(mut self, found: &mut Elimination) {
        let count = self.variables.len();
        let mut degrees: Vec<u32> = self.rows.chunks(self.width.max(1)).map(degree).collect();
        let mut clique: Vec<u64> = Vec::new();
        for left in (1..=count).rev() {
            let Some(variable) = (0..count).min_by_key(|&number| degrees[number]) else { return };
            if degrees[variable] as usize + 1 == left {
                return self.push_all(&degrees, found);
            }
            degrees[variable] = GONE;
            clique.clear();
            clique.extend_from_slice(&self.rows[variable * self.width..][..self.width]);
            clique[variable / 64] &= !(1 << (variable % 64));
            found.push(self.variables[variable], ones(&clique).map(|number| self.variables[number]));
            for number in ones(&clique) {
                let row = &mut self.rows[number * self.width..][..self.width];
                row[variable / 64] &= !(1 << (variable % 64));
                degrees[number] -= 1;
                for (word, of_clique) in row.iter_mut().zip(&clique) {
                    let added = of_clique & !*word;
                    if added != 0 {
                        *word |= added;
                        degrees[number] += added.count_ones();
                    }
                }
            }
        }
    }

    /// Takes out all that are left, which are joined each to each other.
    fn push_all(&self, degrees: &[u32], found: &mut Elimination) {
        let is_left = |(_, degree): &(&u32, &u32)| **degree != GONE;
        let left: Vec<u32> =
            self.variables.iter().zip(degrees).filter(is_left).map(|(variable, _)| *variable).collect();
        for (number, &variable) in left.iter().enumerate() {
            found.push(variable, left[number + 1..].iter().copied());
        }
    }
}

/// To how many others a row's variable is joined.
fn degree(row: &[u64]) -> u32 {
    row.iter().map(|word| word.count_ones()).sum::<u32>().saturating_sub(1)
}

/// The numbers of the bits that are set.
fn ones(words: &[u64]) -> impl Iterator<Item = usize> {
    words.iter().enumerate().flat_map(|(at, &word)| {
        let next = |left: &u64| Some(left & (left - 1)).filter(|left| *left != 0);
        std::iter::successors(Some(word).filter(|word| *word != 0), next)
            .map(move |left| 64 * at + left.trailing_zeros() as usize)
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::eliminate_with;

    /// The order and the neighbors of each position, ascending, found the plain way.
    fn plainly(count: usize, pairs: &[(usize, usize)]) -> Vec<(usize, Vec<usize>)> {
        let mut joined = vec![BTreeSet::new(); count];
        for &(one, other) in pairs.iter().filter(|(one, other)| one != other) {
            joined[one].insert(other);
            joined[other].insert(one);
        }
        let mut left: BTreeSet<usize> = (0..count).collect();
        let mut order = Vec::new();
        while let Some(&next) = left.iter().min_by_key(|&&variable| (joined[variable].len(), variable)) {
            left.remove(&next);
            let clique = std::mem::take(&mut joined[next]);
            for &one in &clique {
                joined[one].extend(&clique);
                joined[one].remove(&one);
                joined[one].remove(&next);
            }
            order.push((next, clique.into_iter().collect()));
        }
        order
    }

    #[test]
    fn it_is_the_order_of_the_plain_way_with_a_set_and_with_bits() {
        // A chain whose members see things that others see as well, and some of them twice.
        let (chain, things) = (300, 40);
        let next = (1..chain).map(|at| (at - 1, at));
        let seen = (0..chain).flat_map(|at| (0..5).map(move |k| (at, chain + (at / 7 + k * k * 3) % things)));
        let loops = (0..20).map(|at| (at * 13 % chain, at * 29 % chain));
        let pairs: Vec<(usize, usize)> = next.clone().chain(seen).chain(loops).chain(next).collect();
        let count = chain + things + 2;
        let expected = plainly(count, &pairs);
        for few in [count, 200, 1, 0] {
            let found = eliminate_with(count, pairs.iter().copied(), few);
            for (position, (variable, neighbors)) in expected.iter().enumerate() {
                assert_eq!(found.position[*variable], position, "{few}");
                let own = found.starts[position]..found.starts[position + 1];
                let own: BTreeSet<usize> = found.neighbors[own].iter().map(|&at| at as usize).collect();
                assert_eq!(own.into_iter().collect::<Vec<_>>(), *neighbors, "{few} {position}");
            }
        }
    }
}
