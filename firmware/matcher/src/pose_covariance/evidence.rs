//! What a scan knows of its pose, and from which submaps of the map.
//!
//! The same residuals and weights as the last iteration of the alignment, their normal equations kept apart
//! by the submap of the surface. Units: meters, radians; map's axes, about the base.

use nalgebra::Matrix3;

use crate::lanes::{InLanes, widest};
use crate::map::LocalMap;
use crate::placement::Placement;
use crate::registration::gauss_newton::cauchy;
use crate::registration::gauss_newton::correspondences::{Column, Correspondences, Met, Part, Placed};
use crate::registration::gauss_newton::params::AlignParams;
use crate::registration::normal_equations::BATCH;
use crate::scan::end_points::Kind;
use biplane_geometry::Pose2;
use biplane_geometry::vec2::{dot, minus};

/// Submaps that one scan may see; what belongs to further ones counts for the last.
pub(super) const PARTS: usize = 12;
/// A piece of wall reaches this far from where the first beam meets it, meters.
const PIECE_M: f32 = 0.5;
/// Where walls stand out from each other by more than this there is an edge, meters.
const EDGE_M: f32 = 0.05;
/// Residuals of so many neighbors may be common.
const WINDOW: usize = 8;

/// Sums of J^T W J over the end points of a scan at its pose.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Evidence {
    /// A submap and what the scan knows by it.
    parts: [(u8, Matrix3<f64>); PARTS],
    count: usize,
    /// The same over the walls' tangents.
    pub along: Matrix3<f64>,
    /// What the residuals that are left pull the pose by, squared.
    pub noise: Matrix3<f64>,
    /// The same of a meter by which each piece of a longer wall is off as a whole, and each face that ends at
    /// edges on both sides.
    pub common: [Matrix3<f64>; 2],
}

impl Evidence {
    /// Submaps and what the scan knows by each.
    pub(crate) fn parts(&self) -> &[(u8, Matrix3<f64>)] {
        &self.parts[..self.count]
    }

    /// What the scan knows by all of them.
    pub(crate) fn across(&self) -> Matrix3<f64> {
        self.parts().iter().map(|(_, information)| information).sum()
    }

    /// Gathers what a scan knows at a pose.
    pub(crate) fn gather(
        map: &LocalMap,
        correspondences: &mut Correspondences,
        pose: &Pose2,
        params: &AlignParams,
    ) -> Self {
        widest(Gather { map, correspondences, pose, params })
    }

    /// What a scan knows by so many reference scans, each an equal part. Their beams' errors are all common.
    pub(crate) fn shared(information: &Matrix3<f64>, common: f64, references: usize) -> Self {
        let mut evidence =
            Self { along: Matrix3::identity(), noise: information * common, ..Self::default() };
        evidence.count = references.clamp(1, PARTS);
        let share = information / evidence.count as f64;
        for (part, submap) in evidence.parts[..evidence.count].iter_mut().zip(0..) {
            *part = (submap, share);
        }
        evidence
    }
}

/// A scan of which is gathered what it knows at a pose.
struct Gather<'a> {
    map: &'a LocalMap,
    correspondences: &'a mut Correspondences,
    pose: &'a Pose2,
    params: &'a AlignParams,
}

impl InLanes for Gather<'_> {
    type Output = Evidence;

    #[inline(always)]
    fn work(self) -> Evidence {
        let Self { map, correspondences, pose, params } = self;
        let mut sums = Sums::default();
        let mut rows = Rows::default();
        let laying = correspondences.lay(&Placement::new(pose));
        for number in laying.numbers() {
            let (part, placed, _) = correspondences.part(map, &laying, number);
            rows.fill(part, placed, params);
            for index in 0..part.len {
                match part.met[index] {
                    Met::Nothing => {}
                    Met::Spot => sums.spot((part, placed), index, params),
                    Met::Line if placed.is_other_face[index] != 0 => {}
                    Met::Line => sums.line(part, &rows, index),
                }
            }
        }
        sums.finish()
    }
}

/// The sums while they are made.
#[derive(Copy, Clone, Debug, Default)]
struct Sums {
    parts: [(u8, Upper); PARTS],
    count: usize,
    /// The part that was added to last.
    last: usize,
    along: Upper,
    common: [Upper; 2],
    pulls: Pulls,
    piece: Piece,
}

impl Sums {
    /// An end point that lies on a surface which is no line.
    #[inline(always)]
    fn spot(&mut self, (part, placed): (&Part, &Placed), index: usize, params: &AlignParams) {
        if part.kind[index] != Kind::Point {
            return;
        }
        let ([arm_x, arm_y], [offset_x, offset_y]) = (&placed.arm, &placed.offset);
        let (arm, offset) = ([arm_x[index], arm_y[index]], [offset_x[index], offset_y[index]]);
        let per_point = (1.0 / (params.point_noise_m * params.point_noise_m)) as f32;
        let weight = part.weight[index] * cauchy(dot(offset, offset), params.outlier_m as f32) * per_point;
        let sureness = part.hits[index] / (1.0 + part.hits[index]);
        for (row, residual) in [([1.0, 0.0, -arm[1]], offset[0]), ([0.0, 1.0, arm[0]], offset[1])] {
            let pull = sureness * sureness.sqrt() * weight * residual;
            self.pulls.add(row.map(|part| f64::from(part * pull)));
            self.part(part.submap[index]).add(row.map(f64::from), f64::from(sureness * weight));
        }
    }

    /// An end point that lies on a line.
    #[inline(always)]
    fn line(&mut self, part: &Part, rows: &Rows, index: usize) {
        let row = [rows.normal[0][index], rows.normal[1][index], rows.turn[index]];
        let (pull, weight) = (rows.pull[index], rows.weight[index]);
        self.pulls.add(row.map(|part| f64::from(part * pull)));
        self.part(part.submap[index]).add(row.map(f64::from), f64::from(weight));
        self.piece_of_wall([part.mean[0][index], part.mean[1][index]], row, weight);
        self.along.add([-row[1], row[0], rows.along[index]].map(f64::from), f64::from(weight));
    }

    /// The sums of a submap.
    #[inline(always)]
    fn part(&mut self, submap: u8) -> &mut Upper {
        if self.parts[self.last].0 != submap || self.count == 0 {
            let known = self.parts[..self.count].iter().position(|(other, _)| *other == submap);
            self.last = known.unwrap_or_else(|| {
                if self.count < PARTS {
                    self.parts[self.count].0 = submap;
                    self.count += 1;
                }
                self.count - 1
            });
        }
        &mut self.parts[self.last].1
    }

    /// A beam meets a piece of wall: the last one, or another.
    #[inline(always)]
    fn piece_of_wall(&mut self, at_m: [f32; 2], row: [f32; 3], weight: f32) {
        let away = minus(at_m, self.piece.at_m);
        let normal = [row[0], row[1]];
        let edge = dot(normal, self.piece.normal) < 0.9 || dot(away, normal).abs() > EDGE_M;
        if edge || dot(away, away) > PIECE_M * PIECE_M {
            self.end_piece(edge);
            self.piece = Piece { at_m, normal, pull: [0.0; 3], edge };
        }
        for (pull, part) in self.piece.pull.iter_mut().zip(row) {
            *pull += f64::from(weight * part);
        }
    }

    #[inline(always)]
    fn end_piece(&mut self, edge: bool) {
        self.common[usize::from(self.piece.edge && edge)].add(self.piece.pull, 1.0);
    }

    fn finish(mut self) -> Evidence {
        self.end_piece(true);
        Evidence {
            parts: self.parts.map(|(submap, sum)| (submap, sum.matrix())),
            count: self.count,
            along: self.along.matrix(),
            noise: self.pulls.finish(),
            common: self.common.map(|sum| sum.matrix()),
        }
    }
}

/// What the residuals of end points on lines say: a column a quantity. Those that are on none have numbers of
/// no meaning.
struct Rows {
    /// The residual by the base's place and turn.
    normal: [Column; 2],
    turn: Column,
    /// The same along the wall by the turn.
    along: Column,
    weight: Column,
    /// What the residual pulls by.
    pull: Column,
}

impl Default for Rows {
    fn default() -> Self {
        let zeros = [0.0; BATCH];
        Self { normal: [zeros; 2], turn: zeros, along: zeros, weight: zeros, pull: zeros }
    }
}

impl Rows {
    #[inline(always)]
    fn fill(&mut self, part: &Part, placed: &Placed, params: &AlignParams) {
        let scale_m = params.outlier_m as f32;
        let per_line = (1.0 / (params.range_noise_m * params.range_noise_m)) as f32;
        let ([arm_x, arm_y], [offset_x, offset_y]) = (&placed.arm, &placed.offset);
        let [normal_x, normal_y] = &mut self.normal;
        for i in 0..BATCH {
            let unit = 1.0 / placed.strength[i].sqrt();
            let normal = [part.normal[0][i] * unit, part.normal[1][i] * unit];
            let residual = offset_x[i] * normal[0] + offset_y[i] * normal[1];
            let weight = part.weight[i] * cauchy(residual * residual, scale_m) * per_line;
            let sureness = part.hits[i] / (1.0 + part.hits[i]);
            self.turn[i] = arm_x[i] * normal[1] - arm_y[i] * normal[0];
            self.along[i] = arm_x[i] * normal[0] + arm_y[i] * normal[1];
            self.pull[i] = sureness * sureness.sqrt() * weight * residual;
            self.weight[i] = weight * sureness;
            [normal_x[i], normal_y[i]] = normal;
        }
    }
}

/// The upper triangle of a sum of weighted squares of rows.
#[derive(Copy, Clone, Debug, Default)]
struct Upper([f64; 6]);

impl Upper {
    #[inline(always)]
    fn add(&mut self, [x, y, turn]: [f64; 3], weight: f64) {
        let [wx, wy, wt] = [weight * x, weight * y, weight * turn];
        let squares = [wx * x, wx * y, wx * turn, wy * y, wy * turn, wt * turn];
        self.0.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
    }

    fn matrix(&self) -> Matrix3<f64> {
        let [xx, xy, xt, yy, yt, tt] = self.0;
        Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
    }
}

/// A piece of wall that some beams meet, one after the other.
#[derive(Copy, Clone, Debug, Default)]
struct Piece {
    at_m: [f32; 2],
    normal: [f32; 2],
    /// What a meter that it is off pulls the pose by.
    pull: [f64; 3],
    /// It begins at an edge.
    edge: bool,
}

/// The residuals' pulls on the pose, summed up over windows of neighbors before they are squared (Newey and
/// West 1987).
#[derive(Copy, Clone, Debug, Default)]
struct Pulls {
    window: [[f64; 3]; WINDOW],
    next: usize,
    sum: [f64; 3],
    squares: Upper,
}

impl Pulls {
    #[inline(always)]
    fn add(&mut self, pull: [f64; 3]) {
        let first = std::mem::replace(&mut self.window[self.next], pull);
        for ((sum, pull), first) in self.sum.iter_mut().zip(pull).zip(first) {
            *sum += pull - first;
        }
        self.next = (self.next + 1) % WINDOW;
        self.squares.add(self.sum, 1.0);
    }

    fn finish(mut self) -> Matrix3<f64> {
        for _ in 1..WINDOW {
            self.add([0.0; 3]);
        }
        self.squares.matrix() / WINDOW as f64
    }
}
