//! No two walls of one direction in one place.
//!
//! A face that was seen in pieces, some a little off the others, gives walls that lie partly in others. What
//! lies in another is that one; what is only drawn into it, because nobody knows how thick it is, is drawn
//! thinner.

use super::slabs::{BESIDE_M, MIN_LENGTH_M, MIN_THICKNESS_M, NEARLY_PARALLEL, Slab};
use crate::building::elevation::{Span, extent};
use crate::building::spaces::raster::CELL_M;
use biplane_geometry::vec2::dot;

/// Walls that go less deep into each other touch, meters.
const TOUCH_M: f64 = 0.01;
/// Cosine between the normals of a curved wall and of a straight one that may be a piece of it: 15 degrees. A
/// strip of an arc that was taken for a plane leans no further.
const NEARLY_ALONG_ARC: f64 = 0.966;

/// Cuts what lies in walls that come earlier in the list; straight walls also where they lie in curved ones.
pub(crate) fn cut(walls: Vec<Slab>) -> Vec<Slab> {
    let mut kept: Vec<Slab> = Vec::new();
    let (curved, straight): (Vec<Slab>, Vec<Slab>) =
        walls.into_iter().partition(|wall| wall.line.curve().is_some());
    for mut wall in curved.into_iter().chain(straight) {
        let mut left = vec![wall.span];
        for known in &mut kept {
            if !is_beside(known, &wall) {
                continue;
            }
            thin_out(&mut wall, known);
            let (rest, is_shorter) = without(&wall, &left, known);
            if is_shorter {
                known.take_spaces(&wall);
                left = rest;
            }
        }
        let is_whole = left == [wall.span];
        let pieces = left.into_iter().filter(|[from, to]| is_whole || to - from >= MIN_LENGTH_M);
        kept.extend(pieces.map(|span| Slab { span, ..wall.clone() }));
    }
    kept
}

/// Whether a straight wall is as good as parallel to another one, or like a chord of a curved one.
fn is_beside(known: &Slab, wall: &Slab) -> bool {
    if wall.line.curve().is_some() {
        return false;
    }
    let middle_m = wall.point((wall.span[0] + wall.span[1]) / 2.0, wall.known_m());
    let across = known.line.normal(known.line.place(middle_m)[1]);
    let alike = if known.line.curve().is_some() { NEARLY_ALONG_ARC } else { NEARLY_PARALLEL };
    dot(across, wall.normal()).abs() >= alike
}

/// Where the faces of a wall lie across another, at a length along it, and where along the other that is.
fn across(wall: &Slab, known: &Slab, at_m: f64) -> (Span, f64) {
    let [low, high] = wall.faces_m.map(|face_m| known.line.place(wall.point(at_m, face_m)));
    ([low[0].min(high[0]), low[0].max(high[0])], (low[1] + high[1]) / 2.0)
}

/// Lengths along a part of a wall, no more than a cell apart, with its ends.
fn stations_m([from, to]: Span) -> impl Iterator<Item = f64> {
    let steps = ((to - from) / CELL_M).ceil().max(1.0) as usize;
    (0..=steps).map(move |step| from + (to - from) * step as f64 / steps as f64)
}

/// Draws a wall of unknown thickness no deeper than to another one behind it.
fn thin_out(wall: &mut Slab, known: &Slab) {
    let Some(seen) = wall.only_face().filter(|_| known.line.curve().is_none()) else { return };
    let before = stations_m(wall.span).filter_map(|at_m| {
        let (_, along_m) = across(wall, known, at_m);
        if along_m < known.span[0] || along_m > known.span[1] {
            return None;
        }
        let [face_m, deep_m] =
            [seen, 1 - seen].map(|face| known.line.place(wall.point(at_m, wall.faces_m[face]))[0]);
        let [low, high] = known.faces_m;
        // The nearer face of the other, seen from that of this one.
        let gap_m = if deep_m > face_m { low - face_m } else { face_m - high };
        Some(gap_m)
    });
    let gap_m = extent(before)[0];
    let depth_m = wall.faces_m[1] - wall.faces_m[0];
    if gap_m >= MIN_THICKNESS_M && gap_m < depth_m {
        wall.faces_m[1 - seen] = wall.faces_m[seen] + if seen == 0 { gap_m } else { -gap_m };
    }
}

/// The parts of a wall that do not lie in another one, and whether any does.
fn without(wall: &Slab, left: &[Span], known: &Slab) -> (Vec<Span>, bool) {
    let is_in = |at_m: f64| {
        let ([low, high], along_m) = across(wall, known, at_m);
        let shared_m = high.min(known.faces_m[1]) - low.max(known.faces_m[0]);
        let place_m = known.line.place(wall.point(at_m, wall.known_m()))[0];
        let is_near = place_m > known.faces_m[0] - BESIDE_M && place_m < known.faces_m[1] + BESIDE_M;
        along_m > known.span[0] && along_m < known.span[1] && shared_m > TOUCH_M && is_near
    };
    let mut out: Vec<Span> = Vec::new();
    let mut is_shorter = false;
    for part in left {
        let mut free: Option<Span> = None;
        for at_m in stations_m(*part) {
            if is_in(at_m) {
                out.extend(free.take());
                is_shorter = true;
            } else {
                free = Some([free.map_or(at_m, |[from, _]| from), at_m]);
            }
        }
        out.extend(free);
    }
    (out, is_shorter)
}
