//! What a scan knows of its pose, and from which chapters of the map.
//!
//! The same residuals and weights as the last iteration of the alignment, their normal equations kept apart by the chapter
//! of the surface. Units: metres, radians; map's axes, about the base.

use nalgebra::{Matrix3, Vector3};

use crate::align::{AlignParams, cauchy};
use crate::local_map::LocalMap;
use crate::points::{EndPoints, Kind};
use crate::pose::Pose2;
use crate::surface::{Placement, Surface, dot, minus};

/// Chapters that one scan may see; what belongs to further ones counts for the last.
pub const PARTS: usize = 12;
/// A piece of wall reaches this far from where the first beam meets it, metres.
const PIECE_M: f32 = 0.5;
/// Where walls stand out from each other by more than this there is an edge, metres.
const EDGE_M: f32 = 0.05;
/// Residuals of so many neighbours may be common.
const WINDOW: usize = 8;

/// Sums of J^T W J over the end points of a scan at its pose.
#[derive(Copy, Clone, Debug, Default)]
pub struct Evidence {
    /// A chapter and what the scan knows by it.
    parts: [(u8, Matrix3<f64>); PARTS],
    count: usize,
    /// The same over the walls' tangents.
    pub along: Matrix3<f64>,
    /// What the residuals that are left pull the pose by, squared.
    pub noise: Matrix3<f64>,
    /// The same of a metre by which each piece of a longer wall is off as a whole, and each face that ends at edges on both sides.
    pub common: [Matrix3<f64>; 2],
    pulls: Pulls,
    piece: Piece,
}

impl Evidence {
    /// Chapters and what the scan knows by each.
    pub fn parts(&self) -> &[(u8, Matrix3<f64>)] {
        &self.parts[..self.count]
    }

    /// What the scan knows by all of them.
    pub fn across(&self) -> Matrix3<f64> {
        self.parts().iter().map(|(_, information)| information).sum()
    }

    /// Gathers what a scan knows at a pose.
    pub fn gather(map: &LocalMap, points: &EndPoints, pose: &Pose2, params: &AlignParams) -> Self {
        let mut evidence = Self::default();
        let placement = Placement::new(pose);
        let scale_m = params.outlier_m as f32;
        for point in points.as_slice() {
            let arm = placement.turn(point.at_m);
            let at_m = [arm[0] + placement.at_m[0], arm[1] + placement.at_m[1]];
            let Some(surface) = map.nearest(at_m) else { continue };
            let offset = minus(at_m, surface.at_m);
            let strength = dot(surface.normal, surface.normal);
            let sureness = f64::from(surface.hits / (1.0 + surface.hits));
            if !map.is_line(surface) {
                if point.kind == Kind::Point {
                    let weight = f64::from(point.weight * cauchy(dot(offset, offset), scale_m))
                        / (params.point_noise_m * params.point_noise_m);
                    evidence.add(surface.chapter, ([1.0, 0.0], -arm[1]), offset[0], weight, sureness);
                    evidence.add(surface.chapter, ([0.0, 1.0], arm[0]), offset[1], weight, sureness);
                }
                continue;
            }
            let own = placement.turn(point.normal);
            if dot(own, surface.normal) < 0.5 * strength && dot(point.normal, point.normal) > 0.5 {
                continue;
            }
            let normal = surface.normal.map(|part| part / strength.sqrt());
            let residual = dot(offset, normal);
            let weight = f64::from(point.weight * cauchy(residual * residual, scale_m))
                / (params.range_noise_m * params.range_noise_m);
            let turn = arm[0] * normal[1] - arm[1] * normal[0];
            evidence.add(surface.chapter, (normal, turn), residual, weight, sureness);
            evidence.piece_of_wall(surface, (normal, turn), weight * sureness);
            let tangent = Vector3::new(-normal[1], normal[0], dot(arm, normal)).map(f64::from);
            evidence.along += weight * sureness * tangent * tangent.transpose();
        }
        evidence.noise = evidence.pulls.finish();
        evidence.end_piece(true);
        evidence
    }

    /// What a scan knows by so many reference scans, each an equal part. Their beams' errors are all common.
    pub fn shared(information: &Matrix3<f64>, common: f64, references: usize) -> Self {
        let mut evidence =
            Self { along: Matrix3::identity(), noise: information * common, ..Self::default() };
        evidence.count = references.clamp(1, PARTS);
        let share = information / evidence.count as f64;
        for (part, chapter) in evidence.parts[..evidence.count].iter_mut().zip(0..) {
            *part = (chapter, share);
        }
        evidence
    }

    /// A beam meets a piece of wall: the last one, or another.
    fn piece_of_wall(&mut self, surface: &Surface, (normal, turn): ([f32; 2], f32), weight: f64) {
        let away = minus(surface.at_m, self.piece.at_m);
        let edge = dot(normal, self.piece.normal) < 0.9 || dot(away, normal).abs() > EDGE_M;
        if edge || dot(away, away) > PIECE_M * PIECE_M {
            self.end_piece(edge);
            self.piece = Piece { at_m: surface.at_m, normal, pull: Vector3::zeros(), edge };
        }
        self.piece.pull += weight * Vector3::new(normal[0], normal[1], turn).map(f64::from);
    }

    fn end_piece(&mut self, edge: bool) {
        self.common[usize::from(self.piece.edge && edge)] += self.piece.pull * self.piece.pull.transpose();
    }

    fn add(
        &mut self,
        chapter: u8,
        (direction, turn): ([f32; 2], f32),
        residual: f32,
        weight: f64,
        sureness: f64,
    ) {
        let row = Vector3::new(direction[0], direction[1], turn).map(f64::from);
        let square = weight * row * row.transpose();
        self.pulls.add(row * (sureness.powf(1.5) * weight * f64::from(residual)));
        let known = self.parts().iter().position(|(other, _)| *other == chapter);
        let part = known.unwrap_or_else(|| {
            if self.count < PARTS {
                self.parts[self.count] = (chapter, Matrix3::zeros());
                self.count += 1;
            }
            self.count - 1
        });
        self.parts[part].1 += sureness * square;
    }
}

/// A piece of wall that some beams meet, one after the other.
#[derive(Copy, Clone, Debug, Default)]
struct Piece {
    at_m: [f32; 2],
    normal: [f32; 2],
    /// What a metre that it is off pulls the pose by.
    pull: Vector3<f64>,
    /// It begins at an edge.
    edge: bool,
}

/// The residuals' pulls on the pose, summed up over windows of neighbours before they are squared (Newey and West 1987).
#[derive(Copy, Clone, Debug)]
struct Pulls {
    window: [Vector3<f64>; WINDOW],
    next: usize,
    sum: Vector3<f64>,
    squares: Matrix3<f64>,
}

impl Default for Pulls {
    fn default() -> Self {
        Self { window: [Vector3::zeros(); WINDOW], next: 0, sum: Vector3::zeros(), squares: Matrix3::zeros() }
    }
}

impl Pulls {
    fn add(&mut self, pull: Vector3<f64>) {
        self.sum += pull - self.window[self.next];
        self.window[self.next] = pull;
        self.next = (self.next + 1) % WINDOW;
        self.squares += self.sum * self.sum.transpose();
    }

    fn finish(mut self) -> Matrix3<f64> {
        for _ in 1..WINDOW {
            self.add(Vector3::zeros());
        }
        self.squares / WINDOW as f64
    }
}
