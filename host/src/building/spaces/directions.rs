//! The directions in which a building's walls stand, and lines turned into them.

use crate::building::elevation::extent;
use crate::building::part::is_upright;
use crate::model::{Model, PlanarPolygon};
use biplane_geometry::PortableMath;
use biplane_geometry::polygon_area::ring_area_m2;
use std::f64::consts::{FRAC_PI_2, PI};

/// Faces within this of a direction take it over, radians: 4 degrees, more than planes of noisy points are
/// off.
const SNAP_RAD: f64 = 0.07;
/// But none is turned so far that its ends move by more than this, meters: long faces know their direction.
const MAX_MOVE_M: f64 = 0.04;
/// Directions that are averaged into one, radians: 1 degree.
const SPREAD_RAD: f64 = 0.02;
/// A second pair of directions of the whole building has at least this share of all faces; others are of
/// single skew walls.
const MIN_SHARE: f64 = 0.15;
/// Skew walls that are looked for at most.
const MAX_ANGLES: usize = 16;
/// Steps of the histogram of directions over a right angle.
const STEPS: usize = 180;

/// An upright face: the direction of its normal, its weight, its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facing {
    /// Direction of the normal, radians.
    pub angle_rad: f64,
    /// Its area or the like.
    pub weight: f64,
    /// Meters.
    pub length_m: f64,
}

/// Pairs of directions at right angles.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Directions {
    /// Angles from 0 to less than a right angle, radians; the first has the largest part of the walls.
    angles_rad: Vec<f64>,
    /// How many of the first are of the whole building.
    main: usize,
}

/// What an angle is beyond the nearest multiple of a right angle of another, radians.
pub(crate) fn beyond_rad(angle_rad: f64, of_rad: f64) -> f64 {
    let off = (angle_rad - of_rad).rem_euclid(FRAC_PI_2);
    if off > FRAC_PI_2 / 2.0 { off - FRAC_PI_2 } else { off }
}

/// How far a face of a length may be turned, radians.
fn limit_rad(length_m: f64) -> f64 {
    SNAP_RAD.min(2.0 * MAX_MOVE_M / length_m.max(1e-3))
}

impl Directions {
    /// Of all upright planes of a model, by area.
    pub(crate) fn of_model(model: &Model) -> Self {
        let upright = model.polygons.iter().filter_map(|polygon| {
            let plane = model.planes.get(polygon.plane).filter(|plane| is_upright(plane))?;
            let angle_rad = plane.normal[1].portable_atan2(plane.normal[0]);
            Some(Facing { angle_rad, weight: ring_area_m2(&polygon.outer_m), length_m: length_m(&[polygon]) })
        });
        Self::of(&upright.collect::<Vec<_>>())
    }

    /// Of all faces.
    pub(crate) fn of(faces: &[Facing]) -> Self {
        let total: f64 = faces.iter().map(|face| face.weight).sum();
        let mut left = faces.to_vec();
        let mut found = Self::default();
        while let Some(angle_rad) = strongest(&left).filter(|_| found.angles_rad.len() < MAX_ANGLES) {
            let is_near =
                |face: &Facing| beyond_rad(face.angle_rad, angle_rad).abs() <= limit_rad(face.length_m);
            let weight: f64 = left.iter().filter(|face| is_near(face)).map(|face| face.weight).sum();
            let before = left.len();
            left.retain(|face| !is_near(face));
            if left.len() == before {
                break;
            }
            let is_main = found.angles_rad.is_empty() || weight >= MIN_SHARE * total;
            found.main += usize::from(is_main && found.main == found.angles_rad.len() && found.main < 2);
            found.angles_rad.push(angle_rad);
        }
        found
    }

    /// The direction of most walls, or 0, from 0 to less than a right angle, radians.
    pub(crate) fn main_rad(&self) -> f64 {
        self.angles_rad.first().copied().unwrap_or_default()
    }

    /// Whether a normal is one of the whole building's directions.
    pub(crate) fn has(&self, normal: [f64; 2]) -> bool {
        let angle_rad = normal[1].portable_atan2(normal[0]);
        self.angles_rad[..self.main].iter().any(|of_rad| beyond_rad(angle_rad, *of_rad).abs() < 1e-6)
    }

    /// The direction that a face's normal takes over, or its own.
    pub(crate) fn snapped(&self, angle_rad: f64, length_m: f64) -> f64 {
        let mut off = self.angles_rad.iter().map(|of_rad| beyond_rad(angle_rad, *of_rad));
        // Those of the whole building come first.
        angle_rad - off.find(|off| off.abs() <= limit_rad(length_m)).unwrap_or(0.0)
    }
}

/// The mean direction, modulo a right angle, around the fullest part of the histogram.
fn strongest(faces: &[Facing]) -> Option<f64> {
    let mut bins = [0.0; STEPS];
    for face in faces {
        let bin = (face.angle_rad.rem_euclid(FRAC_PI_2) / FRAC_PI_2 * STEPS as f64) as usize;
        bins[bin.min(STEPS - 1)] += face.weight;
    }
    let around = |bin: usize, shares: [f64; 5]| {
        let nearby = shares.into_iter().enumerate();
        nearby.map(|(k, share)| share * bins[(bin + STEPS + k - 2) % STEPS]).sum::<f64>()
    };
    // Bins with as much around them: the one in the middle of it, or its faces may lie farther away than what
    // is averaged.
    let fullness = |bin: usize| [around(bin, [1.0; 5]), around(bin, [1.0, 2.0, 3.0, 2.0, 1.0])];
    let is_fuller = |a: &usize, b: &usize| {
        let ([all_a, middle_a], [all_b, middle_b]) = (fullness(*a), fullness(*b));
        all_a.total_cmp(&all_b).then(middle_a.total_cmp(&middle_b)).then(b.cmp(a))
    };
    let best = (0..STEPS).max_by(is_fuller)?;
    let mut middle_rad = (best as f64 + 0.5) / STEPS as f64 * FRAC_PI_2;
    // Twice: the first mean comes nearer to the middle of what is averaged.
    for _ in 0..2 {
        let near = faces.iter().filter(|face| beyond_rad(face.angle_rad, middle_rad).abs() <= SPREAD_RAD);
        let (sum, weights) = near.fold((0.0, 0.0), |(sum, weights), face| {
            (sum + face.weight * beyond_rad(face.angle_rad, middle_rad), weights + face.weight)
        });
        if weights <= 0.0 {
            return None;
        }
        middle_rad += sum / weights;
    }
    Some(middle_rad.rem_euclid(FRAC_PI_2))
}

/// How long polygons of one upright plane are, level, meters.
pub(super) fn length_m(polygons: &[&PlanarPolygon]) -> f64 {
    let corners = || polygons.iter().flat_map(|polygon| &polygon.outer_m);
    let [x_m, y_m] = [0, 1].map(|axis| {
        let [low, high] = extent(corners().map(|p| p[axis]));
        (high - low).max(0.0)
    });
    x_m.portable_hypot(y_m)
}

/// An angle from -pi to pi as the unit vector it stands for.
pub(crate) fn unit(angle_rad: f64) -> [f64; 2] {
    // Right angles give whole numbers, so that level lines stay level.
    let quarter = angle_rad / FRAC_PI_2;
    if (quarter - quarter.round()).abs() < 1e-12 {
        return [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]][quarter.round().rem_euclid(4.0) as usize];
    }
    let (sin, cos) = (angle_rad % (2.0 * PI)).portable_sin_cos();
    [cos, sin]
}

#[cfg(test)]
mod tests {
    use super::{Directions, Facing};

    #[test]
    fn noisy_faces_take_the_direction_of_all_and_skew_ones_keep_theirs() {
        let half_pi = std::f64::consts::FRAC_PI_2;
        let face = |angle_rad: f64, weight: f64, length_m: f64| Facing { angle_rad, weight, length_m };
        let noise = |k: i32| 0.005 * (f64::from(k % 5) - 2.0);
        let mut all: Vec<Facing> =
            (0..40).map(|k| face(0.2 + half_pi * f64::from(k % 4) + noise(k), 1.0, 1.0)).collect();
        all.push(face(0.9, 3.0, 4.0));
        all.push(face(0.9 - half_pi + 0.002, 3.0, 4.0));
        let found = Directions::of(&all);
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        near(found.snapped(0.2 + 2.0 * half_pi + 0.05, 1.0), 0.2 + 2.0 * half_pi);
        // A face of 8 m that is 2 degrees off is skew; a short one is noise.
        near(found.snapped(0.235, 8.0), 0.235);
        near(found.snapped(0.235, 0.5), 0.2);
        // Both sides of a skew wall take one direction, and it is none of the whole building.
        near(found.snapped(0.9, 4.0), 0.901);
        near(found.snapped(0.9 - half_pi + 0.002, 4.0), 0.901 - half_pi);
        let normal = |angle: f64| [angle.cos(), angle.sin()];
        assert!(found.has(normal(0.2)) && found.has(normal(0.2 - half_pi)) && !found.has(normal(0.901)));
        assert_eq!(Directions::of(&[]), Directions::default());
    }

    #[test]
    fn walls_of_one_direction_have_it_however_the_building_stands() {
        for tenth in 0..900 {
            let angle_rad = (f64::from(tenth) * 0.1).to_radians();
            let faces = [0.0, 1.0, 2.0, 3.0].map(|quarter| Facing {
                angle_rad: angle_rad + quarter * std::f64::consts::FRAC_PI_2,
                weight: 1.0,
                length_m: 5.0,
            });
            let off = Directions::of(&faces).snapped(angle_rad + 0.01, 5.0) - angle_rad;
            assert!(off.abs() < 1e-9, "{tenth}: {off}");
        }
    }
}
