//! Walls by what their footprints cover, and their thickness.
//!
//! Of a true wall only those parts count that bound a room that was entered: along its axis, every 2 cm, it
//! is asked whether such a room lies beside it. A wall of the model has a footprint where its thickness is
//! known; elsewhere it can be traced, but not found.

use serde::Serialize;

use super::plan::{Frame, Plan, Wall};
use super::region::{Overlap, Point, Region};
use super::scores::Errors;

/// Shorter walls do not count, meters.
const MIN_LENGTH_M: f64 = 1.0;
/// A wall is found when more than this share of it is covered.
const MIN_SHARE: f64 = 0.5;
/// Steps along a wall, meters, and across it.
const STEP_M: f64 = 0.02;
const ACROSS: usize = 9;
/// A room lies beside a wall when it begins so near to its face, meters: over plaster, skirting, noise.
const BESIDE_M: f64 = 0.08;
/// A wall's face is traced by a wall of the model this near, meters.
const TRACED_M: f64 = 0.1;
/// The same where no thickness is known: the axis may lie on the face or within the wall, meters.
const TRACED_BY_AXIS_M: f64 = 0.2;
/// A stated thickness that is off by more than this is wrong, meters.
const MAX_THICKNESS_ERROR_M: f64 = 0.02;
/// A wall of the model is on the true wall that covers the largest share of it, if at least this.
const MIN_OWN_SHARE: f64 = 0.2;

/// How well walls were found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct WallFigures {
    /// True straight walls longer than 1 m that bound rooms that were entered.
    #[serde(rename = "true")]
    pub truth: usize,
    /// Of these, those of which the footprints of the model's walls cover more than half.
    pub found: usize,
    /// Of these, those with a room that was entered on both sides.
    pub true_inner: usize,
    /// Inner walls found.
    pub found_inner: usize,
    /// True walls along more than half of whose face there is a wall of the model, whatever its thickness.
    pub traced: usize,
    /// Walls of the model.
    pub model: usize,
    /// Walls of the model over true walls of all kinds and lengths that bound rooms that were entered.
    pub model_per_true: f64,
    /// Walls of the model whose thickness is stated.
    pub thickness_stated: usize,
    /// Differences of stated and true thickness, meters.
    pub thickness_error_m: Errors,
    /// Stated thicknesses that are wrong by more than 2 cm, or of walls that are none.
    pub thickness_wrong: usize,
}

/// The parts of a true wall that count.
struct Counted<'a> {
    wall: &'a Wall,
    frame: Frame,
    /// Places along it with a room that was entered on the left, on the right.
    beside: Vec<(f64, [bool; 2])>,
}

impl<'a> Counted<'a> {
    fn new(wall: &'a Wall, rooms: &[Region]) -> Option<Self> {
        let (frame, half) = (wall.frame()?, wall.thickness_m.unwrap_or(0.0) / 2.0);
        let steps = (frame.length_m / STEP_M).floor() as usize;
        let places = (0..steps).map(|step| (step as f64 + 0.5) * STEP_M);
        let at = |along: f64| {
            let is_room = |aside: f64| {
                let point = frame.point(along, aside);
                rooms.iter().any(|room| room.contains(point))
            };
            (along, [is_room(half + BESIDE_M), is_room(-half - BESIDE_M)])
        };
        let beside: Vec<_> = places.map(at).filter(|(_, sides)| sides[0] || sides[1]).collect();
        (!beside.is_empty()).then_some(Self { wall, frame, beside })
    }

    fn length_m(&self) -> f64 {
        self.beside.len() as f64 * STEP_M
    }

    fn is_inner(&self) -> bool {
        2 * self.beside.iter().filter(|(_, sides)| sides[0] && sides[1]).count() > self.beside.len()
    }

    /// Share of its footprint that regions cover.
    fn covered(&self, footprints: &[Region]) -> f64 {
        let thickness = self.wall.thickness_m.unwrap_or(0.0);
        let offsets = (0..ACROSS).map(|k| ((k as f64 + 0.5) / ACROSS as f64 - 0.5) * thickness);
        let offsets: Vec<f64> = offsets.collect();
        let points = self.beside.iter().flat_map(|(along, _)| offsets.iter().map(move |o| (*along, *o)));
        let is_covered = |(along, aside): (f64, f64)| {
            let point = self.frame.point(along, aside);
            footprints.iter().any(|footprint| footprint.contains(point))
        };
        let covered = points.filter(|point| is_covered(*point)).count();
        covered as f64 / (self.beside.len() * ACROSS) as f64
    }

    /// Share of its faces toward rooms with a wall of the model nearby that runs the same way.
    fn traced(&self, walls: &[&Wall]) -> f64 {
        let half = self.wall.thickness_m.unwrap_or(0.0) / 2.0;
        let faces = self.beside.iter().flat_map(|(along, sides)| {
            let asides = [half, -half].into_iter().zip(sides).filter(|(_, is_room)| **is_room);
            asides.map(move |(aside, _)| (*along, aside))
        });
        let near = |(along, aside): (f64, f64)| {
            let point = self.frame.point(along, aside);
            walls.iter().any(|wall| is_traced_by(wall, point, self.frame.along))
        };
        let faces: Vec<_> = faces.collect();
        faces.iter().filter(|face| near(**face)).count() as f64 / faces.len() as f64
    }
}

/// Whether a wall of the model runs past a point of a true face. With no thickness known its axis may lie on
/// the face or within the wall.
fn is_traced_by(wall: &Wall, point: Point, along: Point) -> bool {
    let Some(frame) = wall.frame() else { return false };
    let [s, t] = frame.coordinates(point);
    let turn = (frame.along[0] * along[1] - frame.along[1] * along[0]).abs();
    let (half, near) = wall.thickness_m.map_or((0.0, TRACED_BY_AXIS_M), |t| (t / 2.0, TRACED_M));
    turn < 0.1 && s > -TRACED_M && s < frame.length_m + TRACED_M && (t.abs() - half).abs() < near
}

/// Measures walls. `entered` are the rooms that were entered, of the truth.
pub(crate) fn measure(truth: &Plan, model: &Plan, entered: &[Region]) -> WallFigures {
    let counted: Vec<Counted<'_>> = truth.walls.iter().filter_map(|w| Counted::new(w, entered)).collect();
    let straight: Vec<&Counted<'_>> =
        counted.iter().filter(|c| c.wall.is_straight() && c.length_m() > MIN_LENGTH_M).collect();
    let footprints: Vec<Region> = model.walls.iter().filter_map(Wall::footprint).collect();
    let walls: Vec<&Wall> = model.walls.iter().collect();
    let is_found = |c: &&&Counted<'_>| c.covered(&footprints) > MIN_SHARE;
    let inner: Vec<&Counted<'_>> = straight.iter().copied().filter(|c| c.is_inner()).collect();
    let claims = thickness_claims(truth, model);
    let error = |claim: &Option<f64>| claim.is_none_or(|error| error.abs() > MAX_THICKNESS_ERROR_M);
    WallFigures {
        truth: straight.len(),
        found: straight.iter().filter(is_found).count(),
        true_inner: inner.len(),
        found_inner: inner.iter().filter(is_found).count(),
        traced: straight.iter().filter(|c| c.traced(&walls) > MIN_SHARE).count(),
        model: model.walls.len(),
        model_per_true: model.walls.len() as f64 / counted.len().max(1) as f64,
        thickness_stated: claims.len(),
        thickness_error_m: Errors::of(claims.iter().flatten().copied()),
        thickness_wrong: claims.iter().filter(|claim| error(claim)).count(),
    }
}

/// For each wall of the model with a thickness: how far it is off, or nothing where there is no wall.
fn thickness_claims(truth: &Plan, model: &Plan) -> Vec<Option<f64>> {
    let true_footprints: Vec<(f64, Region)> =
        truth.walls.iter().filter_map(|wall| Some((wall.thickness_m?, wall.footprint()?))).collect();
    let claim = |wall: &Wall| {
        let (thickness, footprint) = (wall.thickness_m?, wall.footprint()?);
        let share = |other: &Region| {
            let found = Overlap::of(&[&footprint], &[other]);
            found.both_m2 / found.first_m2.max(1e-9)
        };
        let shares = true_footprints.iter().map(|(t, region)| (share(region), *t));
        let best = shares.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(share, _)| *share >= MIN_OWN_SHARE);
        Some(best.map(|(_, true_m)| thickness - true_m))
    };
    model.walls.iter().filter_map(claim).collect()
}

#[cfg(test)]
mod tests {
    use super::{Plan, Region, Wall, measure};

    fn wall(axis_m: [[f64; 2]; 2], thickness_m: Option<f64>) -> Wall {
        Wall { axis_m, thickness_m, ..Wall::default() }
    }

    #[test]
    fn only_parts_beside_entered_rooms_count_and_need_a_thickness() {
        // A wall of 10 m of which the first 4 bound rooms, and one that bounds none.
        let walls =
            vec![wall([[0.0, 0.0], [10.0, 0.0]], Some(0.2)), wall([[0.0, 9.0], [10.0, 9.0]], Some(0.2))];
        let truth = Plan { walls, ..Plan::default() };
        let room = |y: [f64; 2]| Region::new(&[[0.0, y[0]], [4.0, y[0]], [4.0, y[1]], [0.0, y[1]]], &[]);
        let rooms = [room([0.1, 3.0]), room([-3.0, -0.1])];
        let model =
            |thickness| Plan { walls: vec![wall([[0.0, 0.0], [3.0, 0.0]], thickness)], ..Plan::default() };
        let found = measure(&truth, &model(Some(0.19)), &rooms);
        assert_eq!((found.truth, found.true_inner, found.found, found.found_inner), (1, 1, 1, 1));
        assert!((found.thickness_error_m.worst.unwrap() - 0.01).abs() < 1e-9);
        assert_eq!(found.thickness_wrong, 0);
        let unknown = measure(&truth, &model(None), &rooms);
        assert_eq!((unknown.found, unknown.traced, unknown.thickness_stated), (0, 1, 0));
        let wrong = measure(&truth, &model(Some(0.3)), &rooms);
        assert_eq!((wrong.found, wrong.thickness_wrong), (1, 1));
    }
}
