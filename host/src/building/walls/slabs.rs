//! Walls: what stands between the rooms, with its thickness where both faces were seen.

use super::sides::Side;
use crate::building::elevation::{Span, extent};
use crate::building::spaces::evidence::{Evidence, Seen};
use crate::building::spaces::faces::{Face, covered_m, joined};
use crate::building::spaces::line::Line;
use crate::building::spaces::raster::CELL_M;
use biplane_geometry::vec2::dot;

/// Walls are at least this thick, meters.
pub(super) const MIN_THICKNESS_M: f64 = 0.05;
/// And at most this: what is thicker is a shaft, or a room that nobody saw.
const MAX_THICKNESS_M: f64 = 0.65;
/// Thicknesses and offsets closer than this are one, meters.
const SAME_M: f64 = 0.02;
/// Two faces are of one wall when they overlap by this, meters.
const MIN_OVERLAP_M: f64 = 0.5;
/// A wall runs on through junctions with others up to this thick, meters.
const JUNCTION_M: f64 = 0.7;
/// Shorter pieces are no walls of their own, meters.
pub(super) const MIN_LENGTH_M: f64 = 0.25;
/// Depth that a wall is drawn with whose thickness nobody knows, meters. Stated as assumed everywhere.
pub(crate) const NOMINAL_M: f64 = 0.2;
/// Where the floor between two faces is free over more than this there is a gap, and no wall, meters: wider
/// than doors.
const MAX_FREE_M: f64 = 2.0;
/// A wall of which more than this lies in another is that one.
const SAME_SHARE: f64 = 0.5;
/// How far beside a wall another may be that lies in it, meters: its middle, or the one face seen of it.
pub(super) const BESIDE_M: f64 = 0.03;
/// What the cosine between the normals of two faces of one wall lacks to 1.
const PARALLEL_FACES: f64 = 1e-4;
/// Cosine between the normals of walls that may be one: 3 degrees.
pub(super) const NEARLY_PARALLEL: f64 = 0.9986;

/// What tells how thick a wall is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ThicknessFrom {
    /// Both faces.
    Faces,
    /// Both faces elsewhere on the same line.
    SameLine,
    /// Nothing: one face was seen.
    Unknown,
}

/// A wall, straight or curved.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slab {
    /// What it is measured along and across.
    pub line: Line,
    /// Distances of its two faces across the line, meters; of an unknown one the nominal place.
    pub faces_m: [f64; 2],
    /// Whether each face was seen.
    pub is_seen: [bool; 2],
    /// From where to where along it, meters.
    pub span: Span,
    /// What its thickness is known by.
    pub from: ThicknessFrom,
    /// The rooms beside it.
    pub spaces: Vec<usize>,
}

impl Slab {
    /// A place: along it, and across.
    pub(crate) fn point(&self, at_m: f64, across_m: f64) -> [f64; 2] {
        self.line.point(at_m, across_m)
    }

    /// The direction across it in its middle.
    pub(crate) fn normal(&self) -> [f64; 2] {
        self.line.normal((self.span[0] + self.span[1]) / 2.0)
    }

    /// Middle between its faces, meters along the normal.
    pub(crate) fn middle_m(&self) -> f64 {
        (self.faces_m[0] + self.faces_m[1]) / 2.0
    }

    /// Where across it is known to be, meters: its middle, or the only face that was seen.
    pub(super) fn known_m(&self) -> f64 {
        self.only_face().map_or_else(|| self.middle_m(), |face| self.faces_m[face])
    }

    /// The one of its faces that was seen, where the other one is only assumed.
    pub(super) fn only_face(&self) -> Option<usize> {
        match (self.from, self.is_seen) {
            (ThicknessFrom::Unknown, [true, false]) => Some(0),
            (ThicknessFrom::Unknown, [false, true]) => Some(1),
            _ => None,
        }
    }

    /// Its length, meters.
    pub(crate) fn length_m(&self) -> f64 {
        self.span[1] - self.span[0]
    }

    /// Its thickness, meters, where it is known.
    pub(crate) fn thickness_m(&self) -> Option<f64> {
        (self.from != ThicknessFrom::Unknown).then(|| self.faces_m[1] - self.faces_m[0])
    }

    /// Whether it is thicker than long: two faces around a shaft or a corner, of whose walls nobody saw the
    /// other face.
    fn is_shaft(&self) -> bool {
        self.faces_m[1] - self.faces_m[0] > self.length_m()
    }

    fn is_parallel(&self, other: &Self) -> bool {
        self.line.is_parallel(&other.line)
    }

    /// Whether another wall, also one that is a little off parallel, lies in this one for more than half of
    /// its length. A curved wall may hold a straight one, but not the other way round.
    fn holds(&self, other: &Self) -> bool {
        let middle = other.point((other.span[0] + other.span[1]) / 2.0, other.known_m());
        let [across, at] = self.line.place(middle);
        if other.line.curve().is_some() && other.line != self.line
            || dot(self.line.normal(at), other.normal()).abs() < NEARLY_PARALLEL
        {
            return false;
        }
        let along = other.span.map(|at| self.line.place(other.point(at, other.middle_m()))[1]);
        let (from, to) = (along[0].min(along[1]), along[0].max(along[1]));
        let shared_m = (self.span[1].min(to) - self.span[0].max(from)).max(0.0);
        let [low, high] = self.faces_m;
        shared_m > SAME_SHARE * other.length_m() && across > low - BESIDE_M && across < high + BESIDE_M
    }

    fn touches(&self, other: &Self) -> bool {
        self.span[0] <= other.span[1] + JUNCTION_M && other.span[0] <= self.span[1] + JUNCTION_M
    }

    fn take(&mut self, other: &Self) {
        self.span = [self.span[0].min(other.span[0]), self.span[1].max(other.span[1])];
        self.take_spaces(other);
        self.is_seen = [0, 1].map(|k| self.is_seen[k] || other.is_seen[k]);
    }

    /// What another wall bounds, it bounds as well.
    pub(super) fn take_spaces(&mut self, other: &Self) {
        self.spaces.extend(&other.spaces);
        self.spaces.sort_unstable();
        self.spaces.dedup();
    }
}

/// A face that may be the far side of a wall, on one line with where it was seen.
struct FarFace {
    offset_m: f64,
    spans: Vec<Span>,
}

/// The distance of a face across the line of a side that it looks away from, and where along that line it is;
/// `None` when it runs or looks elsewhere.
fn seen_along(face: &Face, side: &Side) -> Option<(f64, Vec<Span>)> {
    let along = |ends: &Span| {
        let [a, b] = ends.map(|at| side.line.place(face.point(at))[1]);
        [a.min(b), a.max(b)]
    };
    let spans = || face.any_m.iter().map(along).collect();
    match (side.line, face.curve) {
        (Line::Straight { normal }, None) => {
            let same_way = dot(face.normal, normal);
            let offset_m = face.offset_m * same_way.signum();
            (same_way * side.outward >= 1.0 - PARALLEL_FACES).then(|| (offset_m, spans()))
        }
        (Line::Curved(curve), Some(on)) if on.curve == curve => {
            let middle = face.any_m.first().map(|[from, to]| face.point((from + to) / 2.0))?;
            let outward = dot(face.normal, side.line.normal(side.line.place(middle)[1])) * side.outward;
            (outward > 0.0).then(|| (on.radius_m, spans()))
        }
        _ => None,
    }
}

/// Far faces of a side by their distance, nearest first.
fn far_faces(side: &Side, sides: &[Side], faces: &[Face]) -> Vec<FarFace> {
    let is_near = |offset_m: f64| {
        let behind_m = (offset_m - side.offset_m) * side.outward;
        (MIN_THICKNESS_M..=MAX_THICKNESS_M).contains(&behind_m)
    };
    let opposite = sides.iter().filter(|other| {
        other.outward == -side.outward
            && other.line.is_parallel(&side.line)
            && is_near(other.offset_m)
            && covered_m(&[other.span], side.span) > MIN_OVERLAP_M
    });
    let mut found: Vec<FarFace> =
        opposite.map(|other| FarFace { offset_m: other.offset_m, spans: vec![other.span] }).collect();
    for face in faces {
        let Some((offset_m, spans)) = seen_along(face, side) else { continue };
        if is_near(offset_m) && covered_m(&spans, side.span) > MIN_OVERLAP_M {
            found.push(FarFace { offset_m, spans });
        }
    }
    found.sort_by(|a, b| (a.offset_m - side.offset_m).abs().total_cmp(&(b.offset_m - side.offset_m).abs()));
    found
}

/// Whether the floor between two faces is free: then no wall is there.
fn is_gap(evidence: &Evidence<'_>, slab: &Slab) -> bool {
    let steps = (slab.length_m() / CELL_M).ceil().max(1.0) as usize;
    let is_free = |step: &usize| {
        let at_m = slab.span[0] + slab.length_m() * (*step as f64 + 0.5) / steps as f64;
        let cell = evidence.area.grid.cell(slab.point(at_m, slab.middle_m()));
        cell.is_some_and(|cell| evidence.seen[cell] == Seen::Free)
    };
    let (mut run, mut longest) = (0, 0);
    for step in 0..steps {
        run = if is_free(&step) { run + 1 } else { 0 };
        longest = longest.max(run);
    }
    longest as f64 * CELL_M > MAX_FREE_M.min(0.8 * slab.length_m())
}

fn slab(side: &Side, span: Span, far_m: Option<f64>) -> Slab {
    let other_m = far_m.unwrap_or(side.offset_m + side.outward * NOMINAL_M);
    let is_low = side.outward > 0.0;
    let faces_m = if is_low { [side.offset_m, other_m] } else { [other_m, side.offset_m] };
    let is_seen = [is_low || far_m.is_some(), !is_low || far_m.is_some()];
    let from = if far_m.is_some() { ThicknessFrom::Faces } else { ThicknessFrom::Unknown };
    Slab { line: side.line, faces_m, is_seen, span, from, spaces: vec![side.space] }
}

/// The pieces of a side: where it has a far face, and where it has none.
fn pieces(evidence: &Evidence<'_>, side: &Side, sides: &[Side], faces: &[Face]) -> Vec<Slab> {
    let mut left = vec![side.span];
    let mut out = Vec::new();
    for far in far_faces(side, sides, faces) {
        let mut rest = Vec::new();
        for [from, to] in left {
            let shared = far.spans.iter().map(|s| [s[0].max(from), s[1].min(to)]);
            let shared = joined(shared.filter(|s| s[1] - s[0] > CELL_M).collect(), 2.0 * MIN_OVERLAP_M);
            let mut at = from;
            for span in shared {
                let piece = slab(side, span, Some(far.offset_m));
                if piece.is_shaft() || is_gap(evidence, &piece) {
                    continue;
                }
                rest.push([at, span[0]]);
                at = span[1];
                out.push(piece);
            }
            rest.push([at, to]);
        }
        left = rest.into_iter().filter(|[from, to]| to - from > CELL_M).collect();
    }
    out.extend(left.into_iter().map(|span| slab(side, span, None)));
    out
}

/// All walls of the rooms; some may still lie partly in others.
pub(crate) fn find(evidence: &Evidence<'_>, sides: &[Side], faces: &[Face]) -> Vec<Slab> {
    let mut all: Vec<Slab> = sides.iter().flat_map(|side| pieces(evidence, side, sides, faces)).collect();
    all.sort_by(|a, b| b.length_m().total_cmp(&a.length_m()));
    let (known, unknown): (Vec<Slab>, Vec<Slab>) =
        all.into_iter().partition(|slab| slab.from != ThicknessFrom::Unknown);
    let known = merged(known, |a, b| (0..2).all(|k| (a.faces_m[k] - b.faces_m[k]).abs() <= SAME_M));
    let unknown = merged(unknown, |a, b| {
        a.is_seen == b.is_seen
            && (0..2).any(|k| a.is_seen[k] && (a.faces_m[k] - b.faces_m[k]).abs() <= SAME_M)
    });
    let (mut walls, mut rest) = (known, Vec::<Slab>::new());
    for piece in unknown {
        if !extend_known(&mut walls, &piece) {
            rest.push(piece);
        }
    }
    // So short a piece of a far face that it does not show how thick the wall around it is.
    walls.retain(|wall| wall.length_m() >= MIN_OVERLAP_M || !rest.iter().any(|piece| piece.holds(wall)));
    let mut walls = merged(walls, |a, b| (0..2).all(|k| (a.faces_m[k] - b.faces_m[k]).abs() <= SAME_M));
    walls.extend(rest);
    walls.retain(|wall| wall.length_m() >= MIN_LENGTH_M);
    without_doubles(walls)
}

/// Gives a piece with one face to a wall on the same line that it goes on from: its thickness is that. One
/// that is at least half as long as the piece shows it alone, shorter ones where all of them say the same.
fn extend_known(walls: &mut [Slab], piece: &Slab) -> bool {
    let seen = usize::from(!piece.is_seen[0]);
    let is_same = |wall: &Slab| {
        wall.is_parallel(piece)
            && (wall.faces_m[seen] - piece.faces_m[seen]).abs() <= SAME_M
            && wall.touches(piece)
    };
    let same: Vec<&Slab> = walls.iter().filter(|wall| is_same(wall)).collect();
    let thickness_m = |wall: &Slab| wall.faces_m[1] - wall.faces_m[0];
    let [thin_m, thick_m] = extent(same.iter().map(|wall| thickness_m(wall)));
    let is_agreed =
        thick_m - thin_m <= SAME_M && same.iter().map(|wall| wall.length_m()).sum::<f64>() >= MIN_OVERLAP_M;
    let knows = |wall: &&mut Slab| is_same(wall) && (is_agreed || 2.0 * wall.length_m() >= piece.length_m());
    let longest = walls.iter_mut().filter(knows).max_by(|a, b| a.length_m().total_cmp(&b.length_m()));
    let Some(wall) = longest else { return false };
    if piece.length_m() > wall.length_m() {
        wall.from = ThicknessFrom::SameLine;
    }
    wall.take(piece);
    true
}

/// Drops walls that stand in others: faces that were seen in pieces, a little off each other.
fn without_doubles(mut walls: Vec<Slab>) -> Vec<Slab> {
    let rank = |wall: &Slab| (wall.from != ThicknessFrom::Unknown, wall.length_m());
    walls.sort_by(|a, b| rank(b).0.cmp(&rank(a).0).then(rank(b).1.total_cmp(&rank(a).1)));
    let mut kept: Vec<Slab> = Vec::new();
    for wall in walls {
        match kept.iter_mut().find(|known| known.holds(&wall)) {
            Some(known) => {
                let span = known.span;
                known.take(&wall);
                known.span = span;
            }
            None => kept.push(wall),
        }
    }
    kept
}

/// Makes walls one that go on from each other.
fn merged(slabs: Vec<Slab>, is_same: impl Fn(&Slab, &Slab) -> bool) -> Vec<Slab> {
    let mut out: Vec<Slab> = Vec::new();
    for slab in slabs {
        let mut slab = slab;
        // What it joins may now touch others.
        while let Some(at) = out
            .iter()
            .position(|known| known.is_parallel(&slab) && is_same(known, &slab) && known.touches(&slab))
        {
            let mut known = out.remove(at);
            known.take(&slab);
            slab = known;
        }
        out.push(slab);
    }
    out
}
