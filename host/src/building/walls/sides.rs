//! The sides of rooms: edges of their outlines on which there is wall.

use crate::building::elevation::Span;
use crate::building::spaces::Plan;
use crate::building::spaces::arrangement::length_m;
use crate::building::spaces::faces::{Face, covered_m};
use crate::building::spaces::line::Line;
use crate::building::spaces::outline::ends;
use biplane_geometry::vec2::{dot, minus};

/// Edges with a smaller share of wall are where a room is open, or nobody looked.
const MIN_WALLED: f64 = 0.2;

/// Chords of one circle meet this closely, meters.
const CHORD_GAP_M: f64 = 0.05;
/// Faces this close to a side are on it, meters.
const BESIDE_M: f64 = 0.1;
/// Walls whose far side is all that was seen are no thicker, meters.
const MAX_THICKNESS_M: f64 = 0.35;

/// One side of a room, straight or curved.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Side {
    /// Index of the room.
    pub space: usize,
    /// What it is measured along; the same for all sides of one direction.
    pub line: Line,
    /// Its distance across that, meters.
    pub offset_m: f64,
    /// 1 when the outside is where distances grow, else -1.
    pub outward: f64,
    /// From where to where along it.
    pub span: Span,
}

/// The one of two opposite normals that stands for both.
fn canonical(normal: [f64; 2]) -> [f64; 2] {
    let is_first = normal[0] > 1e-9 || (normal[0].abs() <= 1e-9 && normal[1] > 0.0);
    if is_first { normal } else { normal.map(|value| -value) }
}

/// All sides of all rooms that have wall.
pub(crate) fn find(plan: &Plan) -> Vec<Side> {
    let mut sides = Vec::new();
    for (space, room) in plan.spaces.iter().enumerate() {
        for ([a, b], line) in room.rings.iter().flat_map(ends) {
            let Some(face) = line.and_then(|line| plan.faces.get(line)) else { continue };
            if length_m([a, b]) < 1e-6 || walled_share(&plan.faces, face, [a, b]) < MIN_WALLED {
                continue;
            }
            let (line, offset_m) = match face.line() {
                (Line::Straight { normal }, _) => {
                    let normal = canonical(normal);
                    (Line::Straight { normal }, dot(normal, a))
                }
                curved => curved,
            };
            let at = [a, b].map(|place| line.place(place)[1]);
            let span = [at[0].min(at[1]), at[0].max(at[1])];
            // The room is to the left of its edges, the outside to the right.
            let [x, y] = minus(b, a);
            let outward = dot(line.normal((at[0] + at[1]) / 2.0), [y, -x]).signum();
            sides.push(Side { space, line, offset_m, outward, span });
        }
    }
    joined_chords(sides)
}

/// Makes chords of one circle that follow each other one curved side.
fn joined_chords(sides: Vec<Side>) -> Vec<Side> {
    let mut out: Vec<Side> = Vec::new();
    let (mut curved, straight): (Vec<Side>, Vec<Side>) =
        sides.into_iter().partition(|side| side.line.curve().is_some());
    curved.sort_by(|a, b| a.span[0].total_cmp(&b.span[0]));
    for side in curved {
        let goes_on = |known: &&mut Side| {
            known.space == side.space
                && known.line == side.line
                && known.outward == side.outward
                && (known.offset_m - side.offset_m).abs() < 1e-9
                && side.span[0] - known.span[1] <= CHORD_GAP_M
        };
        match out.iter_mut().find(goes_on) {
            Some(known) => known.span[1] = known.span[1].max(side.span[1]),
            None => out.push(side),
        }
    }
    [straight, out].concat()
}

/// Whether a face is on a room's side or, seen from the other room, a wall's thickness behind it.
fn is_wall_at(face: &Face, own: &Face, place: [f64; 2]) -> bool {
    let off_m = face.before_m(place);
    off_m.abs() < BESIDE_M || (off_m > -MAX_THICKNESS_M && off_m < 0.0 && dot(face.normal, own.normal) < 0.0)
}

/// Share of an edge on which any face on its line or just beside it has points.
fn walled_share(faces: &[Face], own: &Face, [a, b]: [[f64; 2]; 2]) -> f64 {
    let length = length_m([a, b]);
    let best = faces
        .iter()
        .filter(|face| dot(face.normal, own.normal).abs() > 0.999)
        .filter(|face| [a, b].iter().all(|p| is_wall_at(face, own, *p)))
        .map(|face| {
            let at = [a, b].map(|p| dot(face.along(), p));
            covered_m(&face.any_m, [at[0].min(at[1]), at[0].max(at[1])]) / length
        });
    best.fold(0.0, f64::max)
}
