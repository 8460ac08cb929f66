//! End points on a map of end points: the alignment for whoever has both already, as loop closing has.
//!
//! Frame: that of the map's points. Units: meters, radians.

use nalgebra::Matrix3;

use crate::map::point_map::PointMap;
use crate::registration::covariance::rows;
use crate::registration::gauss_newton::params::{AlignParams, BEAMS_PER_INDEPENDENT_ONE};
use crate::registration::gauss_newton::prior::Prior;
use crate::registration::gauss_newton::{Asking, align};
use crate::registration::journal::Journal;
use crate::scan::end_points::EndPoint;
use biplane_geometry::Pose2;

/// Where end points came to lie on a [`PointMap`].
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct PointAlignment {
    /// The end points' frame in the map's.
    pub map_from_points: Pose2,
    /// What the end points alone know of x (m), y (m) and theta (rad): the inverse of a covariance, in the
    /// map's axes. Along a bare corridor it is about zero.
    pub information: [[f64; 3]; 3],
    /// Share of the end points that lie on the map, by weight, 0 to 1.
    pub explained_share: f64,
}

impl PointMap {
    /// Aligns end points with this map, beginning where they are expected. `information` is the inverse
    /// covariance of the expected x, y and theta in the map's axes; it holds however far off the end points
    /// draw, unlike a tracker's odometry, which may slip.
    #[must_use]
    pub fn align(
        &self,
        points: &[EndPoint],
        expected: &Pose2,
        information: [[f64; 3]; 3],
        params: &AlignParams,
    ) -> PointAlignment {
        let information = Matrix3::from_fn(|row, column| information[row][column]);
        let prior = Prior {
            mean: *expected,
            // The steps count every beam; this information is that of an error as it is.
            information: information * BEAMS_PER_INDEPENDENT_ONE,
            measured: false,
            gives_way: false,
        };
        let found =
            align(&mut Asking { map: self, points }, prior.mean, &prior, params, &mut Journal::default());
        let total = found.fit.total;
        PointAlignment {
            map_from_points: found.pose,
            information: rows(&found.information),
            explained_share: if total > 0.0 { found.fit.explained / total } else { 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_geometry::vec2::norm;

    /// Walls of a room 6 m by 4 m, or of a corridor without ends, seen from inside at a pose.
    fn walls(pose: Pose2, ends: bool) -> Vec<EndPoint> {
        let long = (-60..=60).flat_map(|at| {
            let x = f64::from(at) * 0.05;
            [([x, 2.0], [0.0, -1.0]), ([x, -2.0], [0.0, 1.0])]
        });
        let short = (-40..=40).filter(|_| ends).flat_map(|at| {
            let y = f64::from(at) * 0.05;
            [([3.0, y], [-1.0, 0.0]), ([-3.0, y], [1.0, 0.0])]
        });
        let inside = pose.inverse();
        let turn = Pose2::new(0.0, 0.0, inside.theta_rad);
        let point = |(at, normal)| EndPoint {
            at_m: inside.transform(at).map(|value| value as f32),
            normal: turn.transform(normal).map(|value| value as f32),
            weight: 1.0,
            ..EndPoint::default()
        };
        long.chain(short).map(point).collect()
    }

    fn found(ends: bool, truth: Pose2) -> PointAlignment {
        let params = AlignParams { capture_m: 0.3, ..AlignParams::default() };
        let map = PointMap::new(&walls(Pose2::IDENTITY, ends));
        map.align(&walls(truth, ends), &Pose2::IDENTITY, rows(&Matrix3::identity()), &params)
    }

    #[test]
    fn a_room_is_found_back_and_a_corridor_only_across() {
        let truth = Pose2::new(0.15, -0.1, 0.05);
        let room = found(true, truth);
        let [x, y, turn] = room.map_from_points.step_from(&truth);
        assert!(norm([x, y]) < 5e-3 && turn.abs() < 5e-3 && room.explained_share > 0.95, "{room:?}");
        let corridor = found(false, truth);
        assert!((corridor.map_from_points.y_m - truth.y_m).abs() < 5e-3, "{corridor:?}");
        let known = corridor.information;
        assert!(known[0][0] < 1e-3 * known[1][1], "{known:?}");
    }

    #[test]
    fn without_end_points_or_without_a_map_what_was_expected_comes_back() {
        let (expected, held) = (Pose2::new(1.0, 2.0, 0.5), rows(&Matrix3::identity()));
        let points = walls(Pose2::IDENTITY, true);
        for (map, points) in [(PointMap::default(), &points[..]), (PointMap::new(&points), &[][..])] {
            let found = map.align(points, &expected, held, &AlignParams::default());
            let nothing = PointAlignment {
                map_from_points: expected,
                information: [[0.0; 3]; 3],
                explained_share: 0.0,
            };
            assert_eq!(found, nothing);
        }
    }
}
