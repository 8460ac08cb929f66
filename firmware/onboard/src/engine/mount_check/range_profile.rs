//! A scan thinned to a range a direction, and how well one agrees with another one after a motion.

use biplane_geometry::PortableMath;
use biplane_matcher::Pose2;

use crate::engine::scan_data::ScanData;

/// Most directions of a profile: one a degree of half a circle.
pub(crate) const DIRECTIONS: usize = 181;
/// Ranges that are compared, meters: nearer is the robot itself, further a degree is too coarse.
const NEAR_M: f32 = 0.3;
/// See [`NEAR_M`].
const FAR_M: f32 = 20.0;
/// Two ranges agree within this, meters, and a share of the range: odometry over a step, and walls seen
/// aslant.
const TOLERANCE_M: f32 = 0.1;
/// See [`TOLERANCE_M`].
const TOLERANCE_SHARE: f32 = 0.02;
/// A surface this much further away than a point, meters, and a share of its distance: the laser has seen
/// through the point.
const THROUGH_M: f32 = 0.5;
/// See [`THROUGH_M`].
const THROUGH_SHARE: f32 = 0.1;
/// Fewer points in view say nothing.
const FEWEST: usize = 40;

/// What a profile says of a point.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Visibility {
    /// Outside the field of view or the ranges, or hidden.
    Unseen,
    /// There is a surface.
    Surface,
    /// The laser has seen through it.
    Free,
}

/// A scan in a laser's own frame, or in its mirror image.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Profile {
    first_rad: f32,
    step_rad: f32,
    ranges_m: heapless::Vec<f32, DIRECTIONS>,
}

impl Profile {
    /// Of a scan; `mirrored` for a laser on its back: left and right are exchanged then.
    #[must_use]
    pub(crate) fn of(scan: &ScanData, mirrored: bool) -> Self {
        let stride = scan.ranges_m.len().div_ceil(DIRECTIONS).max(1);
        let mut ranges_m: heapless::Vec<f32, DIRECTIONS> = heapless::Vec::new();
        for &range_m in scan.ranges_m.iter().step_by(stride) {
            let is_hit = range_m >= scan.range_min_m && range_m <= scan.range_max_m;
            // There is room: the stride sees to it.
            let _ = ranges_m.push(if is_hit || range_m == f32::INFINITY { range_m } else { f32::NAN });
        }
        let step_rad = scan.angle_increment_rad as f32 * stride as f32;
        let mut first_rad = scan.angle_min_rad as f32;
        if mirrored {
            ranges_m.reverse();
            first_rad = -(first_rad + step_rad * ranges_m.len().saturating_sub(1) as f32);
        }
        Self { first_rad, step_rad, ranges_m }
    }

    /// Directions (radians) and ranges (meters) of what is near enough to be compared.
    pub(crate) fn hits(&self) -> impl Iterator<Item = (f32, f32)> {
        self.ranges_m
            .iter()
            .enumerate()
            .map(|(i, &range_m)| (self.first_rad + self.step_rad * i as f32, range_m))
            .filter(|(_, range_m)| (NEAR_M..FAR_M).contains(range_m))
    }

    /// The points of what is near enough to be compared, in its frame, meters.
    #[must_use]
    pub(crate) fn points(&self) -> heapless::Vec<[f64; 2], DIRECTIONS> {
        let point = |(angle_rad, range_m)| {
            let (sin, cos) = f64::from(angle_rad).portable_sin_cos();
            [f64::from(range_m) * cos, f64::from(range_m) * sin]
        };
        self.hits().map(point).collect()
    }

    /// The share of the [points](Self::points) of an earlier profile that are seen where the motion has taken
    /// them, 0 to 1; `None` when too few would be in view.
    #[must_use]
    pub(crate) fn agreement(&self, before: &[[f64; 2]], self_from_before: &Pose2) -> Option<f32> {
        let (mut seen, mut fits) = (0_usize, 0_usize);
        for point_m in before {
            let point_m = self_from_before.transform(*point_m);
            if let Some(near) = self.around(point_m) {
                seen += 1;
                fits += usize::from(near.fits());
            }
        }
        (seen >= FEWEST).then(|| fits as f32 / seen as f32)
    }

    /// What this profile says of a point in its frame, meters.
    #[must_use]
    pub(crate) fn visibility(&self, point_m: [f64; 2]) -> Visibility {
        match self.around(point_m) {
            Some(near) if near.fits() => Visibility::Surface,
            Some(near) if near.is_through() => Visibility::Free,
            _ => Visibility::Unseen,
        }
    }

    /// The ranges in the direction of a point; `None` outside the field of view or what is compared.
    fn around(&self, point_m: [f64; 2]) -> Option<Near<'_>> {
        let distance_m = (point_m[0] * point_m[0] + point_m[1] * point_m[1]).sqrt() as f32;
        let angle_rad = point_m[1].portable_atan2(point_m[0]) as f32;
        let place = ((angle_rad - self.first_rad) / self.step_rad).round();
        let in_view = place >= 0.0 && place < self.ranges_m.len() as f32;
        if !in_view || !(NEAR_M..FAR_M).contains(&distance_m) {
            return None;
        }
        let place = place as usize;
        let ranges_m = self.ranges_m.get(place.saturating_sub(1)..(place + 2).min(self.ranges_m.len()))?;
        Some(Near { distance_m, ranges_m })
    }
}

/// A point's distance, and what was measured in its direction and to both sides of it.
struct Near<'a> {
    distance_m: f32,
    ranges_m: &'a [f32],
}

impl Near<'_> {
    fn fits(&self) -> bool {
        let tolerance_m = TOLERANCE_M + TOLERANCE_SHARE * self.distance_m;
        self.ranges_m.iter().any(|range_m| (range_m - self.distance_m).abs() <= tolerance_m)
    }

    fn is_through(&self) -> bool {
        let limit_m = self.distance_m * (1.0 + THROUGH_SHARE) + THROUGH_M;
        self.ranges_m.iter().all(|&range_m| range_m > limit_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_recording::messages::LaserScan;

    /// What a laser at this pose sees of a square room of 6 m by 4 m round the origin, over half a circle;
    /// `nearer_m` than it is.
    pub(super) fn room(pose: &Pose2, step_deg: f64, nearer_m: f64) -> ScanData {
        let count = (180.0 / step_deg) as usize + 1;
        let ranges_m = (0..count).map(|i| {
            let angle_rad = pose.theta_rad + (-90.0 + i as f64 * step_deg).to_radians();
            let (sin, cos) = angle_rad.sin_cos();
            let along = |at_m: f64, direction: f64, half_m: f64| {
                if direction.abs() < 1e-9 {
                    f64::INFINITY
                } else {
                    (half_m * direction.signum() - at_m) / direction
                }
            };
            (along(pose.x_m, cos, 3.0).min(along(pose.y_m, sin, 2.0)) - nearer_m) as f32
        });
        let message = LaserScan {
            angle_min_rad: -std::f32::consts::FRAC_PI_2,
            angle_increment_rad: step_deg.to_radians() as f32,
            range_min_m: 0.01,
            range_max_m: 80.0,
            ranges_m: ranges_m.collect(),
            ..LaserScan::default()
        };
        ScanData::of_message(&message, None)
    }

    #[test]
    fn a_profile_agrees_with_itself_after_the_motion_that_was_made_and_with_no_other() {
        let (from, to) = (Pose2::new(-0.5, 0.3, 0.2), Pose2::new(0.1, 0.2, 0.5));
        for step_deg in [1.0, 0.5] {
            let [before, after] = [from, to].map(|pose| Profile::of(&room(&pose, step_deg, 0.0), false));
            let to_from_from = to.between(&from);
            assert!(after.agreement(&before.points(), &to_from_from).unwrap() > 0.97);
            assert!(after.agreement(&before.points(), &to_from_from.inverse()).unwrap() < 0.6);
            assert!(after.agreement(&before.points(), &Pose2::IDENTITY).unwrap() < 0.6);
        }
    }

    #[test]
    fn the_mirror_image_of_a_scan_moves_like_the_mirror_image_of_the_motion() {
        let (from, to) = (Pose2::new(-0.5, 0.3, 0.2), Pose2::new(0.1, 0.2, 0.5));
        let [before, after] = [from, to].map(|pose| Profile::of(&room(&pose, 1.0, 0.0), true));
        let motion = to.between(&from);
        let mirrored = Pose2::new(motion.x_m, -motion.y_m, -motion.theta_rad);
        assert!(after.agreement(&before.points(), &mirrored).unwrap() > 0.97);
        assert!(after.agreement(&before.points(), &motion).unwrap() < 0.6);
    }

    #[test]
    fn a_point_is_on_a_surface_or_in_the_free_or_unseen() {
        let profile = Profile::of(&room(&Pose2::IDENTITY, 1.0, 0.0), false);
        assert_eq!(profile.visibility([3.05, 0.1]), Visibility::Surface);
        assert_eq!(profile.visibility([1.0, 0.1]), Visibility::Free);
        for hidden in [[4.0, 0.1], [-1.0, 0.0], [0.05, 0.0], [50.0, 0.0], [2.4, 0.0]] {
            assert_eq!(profile.visibility(hidden), Visibility::Unseen, "{hidden:?}");
        }
    }

    #[test]
    fn of_a_scan_without_beams_or_steps_nothing_is_said() {
        for (step, ranges_m) in [(0.0, vec![1.0; 181]), (0.017, Vec::new()), (f32::NAN, vec![1.0; 500])] {
            let message =
                LaserScan { angle_increment_rad: step, range_max_m: 80.0, ranges_m, ..LaserScan::default() };
            let profile = Profile::of(&ScanData::of_message(&message, None), true);
            let _ = profile.agreement(&profile.points(), &Pose2::IDENTITY);
            assert_ne!(profile.visibility([f64::NAN, 1.0]), Visibility::Surface);
        }
    }
}
