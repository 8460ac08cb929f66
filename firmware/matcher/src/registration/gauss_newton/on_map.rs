//! End points of a scan on the map that grows: what they meet is kept from pose to pose.
//!
//! Frame: map. Units: meters, radians.

use nalgebra::Matrix3;

use crate::lanes::{InLanes, widest};
use crate::map::LocalMap;
use crate::placement::Placement;
use crate::registration::gauss_newton::correspondences::{Correspondences, Met, Part, Placed, all_bits};
use crate::registration::gauss_newton::fit::Fit;
use crate::registration::gauss_newton::params::AlignParams;
use crate::registration::gauss_newton::{Laid, cauchy, cost, square};
use crate::registration::normal_equations::{BATCH, LineSums, Normal};
use crate::scan::end_points::EndPoint;
use biplane_geometry::Pose2;
use biplane_geometry::vec2::dot;

/// End points on the map.
pub(crate) struct OnMap<'a> {
    /// The map.
    pub map: &'a LocalMap,
    /// The end points.
    pub points: &'a [EndPoint],
    /// What they meet.
    pub correspondences: &'a mut Correspondences,
}

impl Laid for OnMap<'_> {
    fn sums(&mut self, pose: &Pose2, scale_m: f32, params: &AlignParams) -> (Normal, Matrix3<f64>) {
        widest(AddUp { laid: self, pose, scale_m, params })
    }

    fn fit(&mut self, pose: &Pose2, params: &AlignParams) -> Fit {
        widest(Judge { laid: self, pose, params })
    }

    fn cost(&self, pose: &Pose2, scale_m: f32, params: &AlignParams) -> (f64, u32) {
        cost(self.map, self.points, pose, scale_m, params)
    }
}

/// End points on the map whose sums are wanted, see [`Laid::sums`].
struct AddUp<'a, 'b> {
    laid: &'a mut OnMap<'b>,
    pose: &'a Pose2,
    scale_m: f32,
    params: &'a AlignParams,
}

impl InLanes for AddUp<'_, '_> {
    type Output = (Normal, Matrix3<f64>);

    #[inline(always)]
    fn work(self) -> Self::Output {
        let Self { laid: OnMap { map, correspondences, .. }, pose, scale_m, params } = self;
        let (mut lines, mut spots) = (LineSums::default(), Normal::default());
        let point_noise = square(params.point_noise_m);
        let placement = Placement::new(pose);
        let laying = correspondences.lay(&placement);
        for number in laying.numbers() {
            let (part, placed, batch) = correspondences.part(map, &laying, number);
            for index in part.spots() {
                let ([arm_x, arm_y], [offset_x, offset_y]) = (&placed.arm, &placed.offset);
                let (arm, offset) = ([arm_x[index], arm_y[index]], [offset_x[index], offset_y[index]]);
                let weight = part.sureness[index] * cauchy(dot(offset, offset), scale_m) / point_noise;
                spots.add_both(arm, offset, weight);
            }
            part.gather_lines(placed, batch);
            lines.take(batch, scale_m);
        }
        let (normal, tangent) = lines.finish(1.0 / square(params.range_noise_m));
        (normal.plus(&spots), tangent)
    }
}

/// End points on the map whose fit is wanted, see [`Laid::fit`].
struct Judge<'a, 'b> {
    laid: &'a mut OnMap<'b>,
    pose: &'a Pose2,
    params: &'a AlignParams,
}

impl InLanes for Judge<'_, '_> {
    type Output = Fit;

    #[inline(always)]
    fn work(self) -> Fit {
        let Self { laid: OnMap { map, correspondences, .. }, pose, params } = self;
        let placement = Placement::new(pose);
        let mut fit = Fit::default();
        let near_m = params.explained_m as f32;
        let mut near = Near::default();
        let laying = correspondences.lay(&placement);
        for number in laying.numbers() {
            let (part, placed, _) = correspondences.part(map, &laying, number);
            near.fill(part, placed, near_m * near_m);
            for index in part.nothings() {
                let at_m = placement.place([part.at[0][index], part.at[1][index]]);
                let is_seen = all_bits(map.seen_through(at_m));
                near.says[index] = f64::from(f32::from_bits(part.weight[index].to_bits() & is_seen));
            }
            for index in 0..part.len {
                fit.total += f64::from(part.weight[index]);
                fit.informative += near.says[index];
                fit.explained += near.weight[index];
                fit.on_lines += near.on_line[index];
                fit.squares_m2 += near.squares_m2[index];
            }
        }
        fit
    }
}

/// The end points that lie near their surfaces; the others count nothing.
struct Near {
    /// Weight of those that meet anything, however far off.
    says: [f64; BATCH],
    /// Weight of those near.
    weight: [f64; BATCH],
    /// Weight of those near lines.
    on_line: [f64; BATCH],
    /// Their squared distances from the lines, as if the map were exact, by weight, square meters.
    squares_m2: [f64; BATCH],
}

impl Default for Near {
    fn default() -> Self {
        let zeros = [0.0; BATCH];
        Self { says: zeros, weight: zeros, on_line: zeros, squares_m2: zeros }
    }
}

impl Near {
    #[inline(always)]
    fn fill(&mut self, part: &Part, placed: &Placed, near_m2: f32) {
        let ([offset_x, offset_y], [normal_x, normal_y]) = (&placed.offset, &part.normal);
        for i in 0..BATCH {
            let across = offset_x[i] * normal_x[i] + offset_y[i] * normal_y[i];
            let from_line = across * across / placed.strength[i];
            let from_spot = offset_x[i] * offset_x[i] + offset_y[i] * offset_y[i];
            let is_line = all_bits(part.met[i] == Met::Line);
            let near_line = is_line & !placed.is_other_face[i] & all_bits(from_line < near_m2);
            let is_met = all_bits(part.met[i] != Met::Nothing);
            let near_spot = is_met & !is_line & all_bits(from_spot < near_m2);
            let weight = part.weight[i].to_bits();
            self.says[i] = f64::from(f32::from_bits(weight & is_met));
            self.weight[i] = f64::from(f32::from_bits(weight & (near_line | near_spot)));
            let on_line = f64::from(f32::from_bits(weight & near_line));
            let square_m2 = from_line * part.hits[i] / (1.0 + part.hits[i]);
            self.on_line[i] = on_line;
            self.squares_m2[i] = on_line * f64::from(f32::from_bits(square_m2.to_bits() & near_line));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::MapParams;
    use crate::registration::gauss_newton::Asking;
    use crate::scan::end_points::{EndPoints, PointParams};
    use crate::scan::{Beam, Scan};

    /// A room of 7 by 5 m with a cupboard and some posts, 300 beams.
    fn room() -> EndPoints {
        let beams: Vec<Beam> = (0..300)
            .map(|i| {
                let (sin, cos) = (f64::from(i) * 0.0209).sin_cos();
                let to_x = if cos > 0.0 { 4.0 / cos } else { -3.0 / cos };
                let to_y = if sin > 0.0 { 2.7 / sin } else { -2.3 / sin };
                let near_m = if (40..52).contains(&i) { 0.7 } else { 0.0 };
                let range_m = if i % 29 == 0 { 1.4 } else { to_x.min(to_y) - near_m };
                Beam { direction_in_base: [cos as f32, sin as f32], range_m: range_m as f32, delay_s: 0.0 }
            })
            .collect();
        let mut points = EndPoints::new(PointParams::default());
        points.fill(&Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] });
        points
    }

    #[test]
    fn what_is_kept_from_pose_to_pose_is_what_each_pose_finds_alone() {
        let (points, params) = (room(), AlignParams::default());
        let points = points.as_slice();
        let mut map = LocalMap::new(MapParams { tiles: 300, surfaces: 10_000, ..MapParams::default() });
        map.add(&Pose2::IDENTITY, points);
        map.add(&Pose2::new(0.02, -0.01, 0.01), points);
        let mut correspondences = Correspondences::with_capacity(points.len());
        correspondences.begin(points);
        let mut kept = OnMap { map: &map, points, correspondences: &mut correspondences };
        let mut alone = Asking { map: &map, points };
        for step in 0..60 {
            // From far off to rest, and off again.
            let far = [0.3, 0.05, 0.004, 0.0003, 0.0][step % 5];
            let pose = Pose2::new(far * (step as f64).sin(), far * (step as f64).cos(), 0.5 * far);
            for scale_m in [0.15, 0.06] {
                let [(normal, along), (normal_alone, along_alone)] =
                    [kept.sums(&pose, scale_m, &params), alone.sums(&pose, scale_m, &params)];
                assert_eq!(
                    (normal.matrix(), normal.vector()),
                    (normal_alone.matrix(), normal_alone.vector())
                );
                assert_eq!(along, along_alone);
            }
            let fit = kept.fit(&pose, &params);
            assert_eq!(fit, alone.fit(&pose, &params), "{pose:?}");
            assert!(fit.explained > fit.on_lines || far > 0.1, "there are spots: {fit:?}");
        }
    }
}
