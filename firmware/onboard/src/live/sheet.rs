//! The points of the vertical laser so far: one for each small cube of space, so that a robot that stands still adds nothing, in memory
//! that is bounded whatever the building.
//!
//! Frame: map. Units: metres.

use std::collections::HashSet;

/// Side of the cubes at first, metres. Smaller: finer, and full sooner.
const CUBE_M: f32 = 0.05;
/// Points kept; with more the cubes get twice as wide and the points are thinned. A viewer has to draw as many.
const MOST_POINTS: usize = 500_000;

/// Points in the order in which they came.
#[derive(Clone, Debug)]
pub struct Sheet {
    points_m: Vec<[f32; 3]>,
    taken: HashSet<[i32; 3]>,
    cube_m: f32,
    most: usize,
}

impl Default for Sheet {
    fn default() -> Self {
        Self::with_bounds(CUBE_M, MOST_POINTS)
    }
}

impl Sheet {
    fn with_bounds(cube_m: f32, most: usize) -> Self {
        Self { points_m: Vec::new(), taken: HashSet::new(), cube_m, most }
    }

    /// Adds a point, unless its cube has one, or it is none, or there is no room: then [`Sheet::thin`] makes some.
    pub fn add(&mut self, point_m: [f32; 3]) {
        if self.is_full() || !point_m.iter().all(|coordinate| coordinate.is_finite()) {
            return;
        }
        if self.taken.insert(cube(point_m, self.cube_m)) {
            self.points_m.push(point_m);
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.points_m.len()
    }

    /// So many of them, from a place on.
    pub fn from(&self, place: usize, most: usize) -> &[[f32; 3]] {
        let rest = self.points_m.get(place..).unwrap_or_default();
        &rest[..rest.len().min(most)]
    }

    /// Whether no more can be added.
    pub fn is_full(&self) -> bool {
        self.points_m.len() >= self.most
    }

    /// Makes room: cubes twice as wide, until half of it is free. `places` are moved to where their points are now.
    pub fn thin<'a>(&mut self, places: impl IntoIterator<Item = &'a mut usize>) {
        let mut places: Vec<&mut usize> = places.into_iter().collect();
        while self.points_m.len() * 2 > self.most {
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
        let mut sheet = Sheet::default();
        for point in [[0.01, 0.01, 0.01], [0.04, 0.02, 0.0], [-0.01, 0.01, 0.01], [0.06, 0.0, 0.0]] {
            sheet.add(point);
        }
        sheet.add([f32::NAN, 0.0, 0.0]);
        sheet.add([0.0, f32::INFINITY, 0.0]);
        assert_eq!(sheet.len(), 3);
        assert_eq!(sheet.from(1, 1), [[-0.01, 0.01, 0.01]]);
        assert_eq!(sheet.from(3, 5), [[0.0_f32; 3]; 0]);
    }

    #[test]
    fn a_full_sheet_is_thinned_and_every_place_still_parts_the_same_points() {
        let mut sheet = Sheet::with_bounds(0.1, 64);
        for i in 0..100 {
            sheet.add([0.1 * i as f32 + 0.05, 0.0, 0.0]);
        }
        assert!(sheet.is_full() && sheet.len() == 64);
        let (mut half, mut all) = (32, 64);
        let before = sheet.points_m.clone();
        sheet.thin([&mut half, &mut all]);
        assert!((16..=33).contains(&sheet.len()), "{}", sheet.len());
        assert_eq!(all, sheet.len());
        // Sent before: those with x below 3.2 m; still to be sent: the others.
        assert!(sheet.points_m[..half].iter().all(|point| point[0] < 3.2));
        assert!(sheet.points_m[half..].iter().all(|point| point[0] > 3.2));
        assert!(sheet.points_m.iter().all(|point| before.contains(point)));
        sheet.add([100.0, 0.0, 0.0]);
        assert_eq!(sheet.len(), all + 1);
    }
}
