//! Which of many numbered things hang together: a forest whose roots stand for their groups.

use alloc::vec::Vec;

/// Groups of the numbers from 0 on. The smallest number of a group is its root, whatever the order of joins.
#[derive(Clone, Debug)]
pub struct UnionFind(Vec<u32>);

impl UnionFind {
    /// So many things, each a group of its own; at most 2^32.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The smallest number of the group that `member` is in.
    ///
    /// # Panics
    /// When there is no such member.
    pub fn root(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            // Each step halves the path for those who come later.
            let above = self.0[self.0[member as usize] as usize];
            self.0[member as usize] = above;
            member = above;
        }
        member
    }

    /// Makes the groups of two members one.
    ///
    /// # Panics
    /// When there is no such member.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::UnionFind;

    #[test]
    fn groups_are_those_that_coloring_the_pairs_gives() {
        let mut seed = 1_u32;
        let mut random = move |below: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) % below
        };
        for _ in 0..50 {
            let mut groups = UnionFind::new(40);
            let mut colors: [u32; 40] = core::array::from_fn(|k| k as u32);
            for _ in 0..random(60) {
                let (a, b) = (random(40), random(40));
                groups.join(a, b);
                let (one, other) = (colors[a as usize], colors[b as usize]);
                colors.iter_mut().filter(|c| **c == one || **c == other).for_each(|c| *c = one.min(other));
            }
            for (member, color) in colors.iter().enumerate() {
                assert_eq!(groups.root(member as u32), *color);
            }
        }
    }
}
