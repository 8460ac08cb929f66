//! The border of many triangles: edges that are passed once in each direction lie inside and cancel.
//!
//! How often rings go round a place does not change when two opposite edges are left out. So the union of
//! triangles that share corners is that of the rings of what is left, which are far fewer.

/// Directed edges between numbered corners.
#[derive(Clone, Debug, Default)]
pub(crate) struct DirectedEdges {
    /// Edges from the smaller number to the larger one, as one number each.
    up: Vec<u64>,
    /// The others, written the same way.
    down: Vec<u64>,
}

impl DirectedEdges {
    /// Room for the edges of so many triangles.
    pub(crate) fn with_room(triangles: usize) -> Self {
        let edges = 3 * triangles / 2;
        Self { up: Vec::with_capacity(edges), down: Vec::with_capacity(edges) }
    }

    /// Adds the edges of a triangle, in the order of its corners.
    pub(crate) fn add(&mut self, [a, b, c]: [u32; 3]) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let number = |low: u32, high: u32| u64::from(low) << 32 | u64::from(high);
            match from.cmp(&to) {
                std::cmp::Ordering::Less => self.up.push(number(from, to)),
                std::cmp::Ordering::Greater => self.down.push(number(to, from)),
                std::cmp::Ordering::Equal => {}
            }
        }
    }

    /// Closed rings of the edges that have no opposite.
    pub(crate) fn rings(self) -> Vec<Vec<u32>> {
        let mut edges = self.unpaired();
        edges.sort_unstable();
        // As many edges lead to a corner as away from it: whoever goes on always comes back.
        let mut used = vec![false; edges.len()];
        let mut rings = Vec::new();
        for start in 0..edges.len() {
            let mut ring = Vec::new();
            let mut next = Some(start).filter(|start| !used[*start]);
            while let Some(edge) = next {
                used[edge] = true;
                let (from, to) = edges[edge];
                ring.push(from);
                let first = edges.partition_point(|(other, _)| *other < to);
                let out =
                    edges[first..].iter().zip(&used[first..]).take_while(|((other, _), _)| *other == to);
                next = out.zip(first..).find(|((_, used), _)| !**used).map(|(_, index)| index);
            }
            if ring.len() > 2 {
                rings.push(ring);
            }
        }
        rings
    }

    fn unpaired(self) -> Vec<(u32, u32)> {
        let Self { mut up, mut down } = self;
        up.sort_unstable();
        down.sort_unstable();
        let mut left = Vec::new();
        let (mut up, mut down) = (up.into_iter().peekable(), down.into_iter().peekable());
        let split = |number: u64| ((number >> 32) as u32, number as u32);
        loop {
            match (up.peek(), down.peek()) {
                (Some(a), Some(b)) if a == b => {
                    up.next();
                    down.next();
                }
                (Some(a), other) if other.is_none_or(|b| a < b) => {
                    left.push(split(*a));
                    up.next();
                }
                (_, Some(b)) => {
                    let (low, high) = split(*b);
                    left.push((high, low));
                    down.next();
                }
                _ => return left,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::DirectedEdges;
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::polygons::outline::union::{Ring, doubled_area, union};
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn rings(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
        let mut edges = DirectedEdges::with_room(triangles.len());
        triangles.iter().for_each(|triangle| edges.add(*triangle));
        edges.rings()
    }

    #[test]
    fn a_fan_has_one_ring_and_two_that_touch_in_a_corner_are_gone_round_once_each() {
        assert_eq!(rings(&[[0, 1, 2], [0, 2, 3], [0, 3, 4]]), [[0, 1, 2, 3, 4]]);
        let touching = rings(&[[0, 1, 2], [2, 3, 4]]);
        assert_eq!(touching.iter().map(Vec::len).sum::<usize>(), 6);
        assert!(rings(&[]).is_empty() && rings(&[[0, 1, 2], [0, 2, 1]]).is_empty());
    }

    #[test]
    fn the_union_of_the_rings_is_that_of_the_triangles() {
        for seed in 1..20 {
            let mut random = Random::new(seed);
            // Few corners: triangles share edges, overlap and turn over.
            let corners: Vec<FlatPoint> = (0..30)
                .map(|_| [(); 2].map(|()| (9000.0 * random.unit()) as i32))
                .map(|[x, y]| FlatPoint::new(x, y))
                .collect();
            let mut triangles = Vec::new();
            while triangles.len() < 60 {
                let [a, b, c] = [(); 3].map(|()| (30.0 * random.unit()) as u32);
                match doubled_area(&[a, b, c].map(|k| corners[k as usize])) {
                    0 => {}
                    area if area > 0 => triangles.push([a, b, c]),
                    _ => triangles.push([a, c, b]),
                }
            }
            let flat = |ring: &[u32]| ring.iter().map(|k| corners[*k as usize]).collect::<Ring>();
            let area = |rings: &[Ring]| {
                union(rings.iter().map(Vec::as_slice)).iter().flatten().map(|r| doubled_area(r)).sum::<i64>()
            };
            let all: Vec<Ring> = triangles.iter().map(|triangle| flat(triangle)).collect();
            let border: Vec<Ring> = rings(&triangles).iter().map(|ring| flat(ring)).collect();
            assert!(border.iter().map(Vec::len).sum::<usize>() < 180);
            // Crossings are rounded to whole steps.
            let (whole, left) = (area(&all), area(&border));
            assert!((whole - left).abs() < whole / 500, "seed {seed}: {whole} {left}");
        }
    }
}
