//! The points of the vertical laser so far: one for each small cube of space, so that a robot that stands
//! still adds nothing, in memory that is bounded whatever the building.
//!
//! Frame: map. Units: meters.

use std::collections::HashSet;

/// Side of the cubes at first, meters. Smaller: finer, and full sooner.
const CUBE_M: f32 = 0.05;
/// Points kept; with more the cubes get twice as wide and the points are thinned. A viewer has to draw as
/// many.
const MAX_POINTS: usize = 500_000;

/// Points in the order in which they came.
#[derive(Clone, Debug)]
pub(crate) struct PointAccumulator {
    points_m: Vec<[f32; 3]>,
    taken: HashSet<[i32; 3]>,
    cube_m: f32,
    maximum: usize,
}

impl Default for PointAccumulator {
    fn default() -> Self {
        Self::with_bounds(CUBE_M, MAX_POINTS)
    }
}

impl PointAccumulator {
    fn with_bounds(cube_m: f32, maximum: usize) -> Self {
        Self { points_m: Vec::new(), taken: HashSet::new(), cube_m, maximum }
    }

    /// Adds a point, unless its cube has one, or it is none, or there is no room: then
    /// [`PointAccumulator::thin`] makes some.
    pub(crate) fn add(&mut self, point_m: [f32; 3]) {
        if self.is_full() || !point_m.iter().all(|coordinate| coordinate.is_finite()) {
            return;
        }
        if self.taken.insert(cube(point_m, self.cube_m)) {
            self.points_m.push(point_m);
        }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.points_m.len()
    }

    /// So many of them, from a place on.
    pub(crate) fn from(&self, place: usize, maximum: usize) -> &[[f32; 3]] {
        let rest = self.points_m.get(place..).unwrap_or_default();
        &rest[..rest.len().min(maximum)]
    }

    /// Whether no more can be added.
    pub(crate) fn is_full(&self) -> bool {
        self.points_m.len() >= self.maximum
    }

    /// Makes room: cubes twice as wide, until half of it is free. `places` are moved to where their points
    /// are now.
    pub(crate) fn thin<'a>(&mut self, places: impl IntoIterator<Item = &'a mut usize>) {
        let mut places: Vec<&mut usize> = places.into_iter().collect();
        while self.points_m.len() * 2 > self.maximum {
            self.cube_m *= 2.0;
            self.taken.clear();
            let kept: Vec<bool> =
                self.points_m.iter().map(|&point_m| self.taken.insert(cube(point_m, self.cube_m))).collect();
            for place in &mut places {
                **place = kept.iter().take(**place).filter(|&&kept| kept).count();
            }
            let mut kept = kept.into_iter();
            self.points_m.retain(|_| kept.next().unwrap_or(false));
        }
    }
}

fn cube(point_m: [f32; 3], cube_m: f32) -> [i32; 3] {
    // Beyond what an i32 holds it saturates: far away all is one cube.
    point_m.map(|coordinate| (coordinate / cube_m).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_has_one_point_and_what_is_no_point_none() {
        let mut point_accumulator = PointAccumulator::default();
        for point in [[0.01, 0.01, 0.01], [0.04, 0.02, 0.0], [-0.01, 0.01, 0.01], [0.06, 0.0, 0.0]] {
            point_accumulator.add(point);
        }
        point_accumulator.add([f32::NAN, 0.0, 0.0]);
        point_accumulator.add([0.0, f32::INFINITY, 0.0]);
        assert_eq!(point_accumulator.len(), 3);
        assert_eq!(point_accumulator.from(1, 1), [[-0.01, 0.01, 0.01]]);
        assert_eq!(point_accumulator.from(3, 5), [[0.0_f32; 3]; 0]);
    }

    #[test]
    fn a_full_sheet_is_thinned_and_every_place_still_parts_the_same_points() {
        let mut point_accumulator = PointAccumulator::with_bounds(0.1, 64);
        for i in 0..100 {
            point_accumulator.add([0.1 * i as f32 + 0.05, 0.0, 0.0]);
        }
        assert!(point_accumulator.is_full() && point_accumulator.len() == 64);
        let (mut half, mut all) = (32, 64);
        let before = point_accumulator.points_m.clone();
        point_accumulator.thin([&mut half, &mut all]);
        assert!((16..=33).contains(&point_accumulator.len()), "{}", point_accumulator.len());
        assert_eq!(all, point_accumulator.len());
        // Sent before: those with x below 3.2 m; still to be sent: the others.
        assert!(point_accumulator.points_m[..half].iter().all(|point| point[0] < 3.2));
        assert!(point_accumulator.points_m[half..].iter().all(|point| point[0] > 3.2));
        assert!(point_accumulator.points_m.iter().all(|point| before.contains(point)));
        point_accumulator.add([100.0, 0.0, 0.0]);
        assert_eq!(point_accumulator.len(), all + 1);
    }
}
