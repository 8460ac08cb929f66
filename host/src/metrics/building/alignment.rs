//! Brings a model's plan into the frame of the truth.
//!
//! The borders of rooms are laid on each other: corners vote for a shift at each turn that makes directions
//! agree, then borders are fitted, each point of one to a line of the other that faces the same way. Where
//! both are in one frame already, only the fit is done, within 30 cm and 3 degrees: what remains is the drift
//! at the start of the drive, not an error of the building.

use biplane_geometry::PortableMath;
use std::collections::BTreeMap;

use biplane_geometry::{Pose2, wrap_angle};

use super::plan::{Frame, Plan, Room};
use super::region::Point;
use super::rooms::edges;

/// Borders of rooms, each with the room to its left.
struct Borders(Vec<Frame>);

/// Shorter borders neither vote nor hold, meters.
const MIN_BORDER_M: f64 = 0.4;
/// Distance of the points on a border, meters.
const STEP_M: f64 = 0.1;
/// Cells in which turns and shifts are voted for.
const TURN_DEG: f64 = 3.0;
const SHIFT_M: f64 = 0.3;
/// So many of the best turns, and of the best shifts of each, are fitted.
const TURNS: usize = 8;
const SHIFTS: usize = 6;
/// Points are fitted to borders nearer than this, from the first step to the last, meters.
const FIRST_NEAR_M: f64 = 0.5;
const LAST_NEAR_M: f64 = 0.1;
const STEPS: usize = 20;
/// Limits of a fit in one frame.
const MAX_SHIFT_M: f64 = 0.3;
const MAX_TURN_RAD: f64 = 0.05;

impl Borders {
    fn of(rooms: &[Room]) -> Self {
        let left = |ring: &[Point], is_hole: bool| -> Vec<Frame> {
            let area: f64 = edges(ring).map(|[a, b]| a[0] * b[1] - a[1] * b[0]).sum();
            let turn = |[a, b]: [Point; 2]| if (area > 0.0) == is_hole { [b, a] } else { [a, b] };
            edges(ring).map(turn).filter_map(|[a, b]| Frame::between(a, b)).collect()
        };
        let of = |room: &Room| {
            let holes = room.holes_m.iter().flat_map(|hole| left(hole, true));
            left(&room.outline_m, false).into_iter().chain(holes).collect::<Vec<_>>()
        };
        let borders = rooms.iter().flat_map(of).filter(|border| border.length_m >= MIN_BORDER_M);
        Self(borders.collect())
    }

    /// Points on them with their directions.
    fn points(&self) -> Vec<(Point, Point)> {
        let of = |border: &Frame| {
            let count = (border.length_m / STEP_M).ceil() as usize;
            let at = |k: usize| (k as f64 + 0.5) / count as f64 * border.length_m;
            (0..count).map(|k| (border.point(at(k), 0.0), border.along)).collect::<Vec<_>>()
        };
        self.0.iter().flat_map(of).collect()
    }

    /// Offset to the nearest border that runs the same way: distance to its left, and its normal.
    fn nearest(&self, point: Point, along: Point, near_m: f64) -> Option<(f64, Point)> {
        let here = |border: &Frame| {
            let [s, t] = border.coordinates(point);
            let same = border.along[0] * along[0] + border.along[1] * along[1] > 0.97;
            let is_near = t.abs() < near_m && s > -near_m && s < border.length_m + near_m;
            (same && is_near).then_some((t, [-border.along[1], border.along[0]]))
        };
        self.0.iter().filter_map(here).min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
    }

    fn heading_deg(border: &Frame) -> f64 {
        border.along[1].portable_atan2(border.along[0]).to_degrees()
    }
}

/// The fit of a model that is in the truth's frame already, but for the drift at its start.
pub(crate) fn refine(truth: &Plan, model: &Plan) -> Pose2 {
    let (to, from) = (Borders::of(&truth.rooms), Borders::of(&model.rooms).points());
    let (found, _) = fit(&to, &from, Pose2::IDENTITY);
    let is_small = found.distance_m() < MAX_SHIFT_M && found.theta_rad.abs() < MAX_TURN_RAD;
    if is_small { found } else { Pose2::IDENTITY }
}

/// Where a model lies in the truth's frame; none without borders that agree.
pub(crate) fn search(truth: &Plan, model: &Plan) -> Option<Pose2> {
    let (to, own) = (Borders::of(&truth.rooms), Borders::of(&model.rooms));
    let points = own.points();
    let mut best: Option<(f64, Pose2)> = None;
    for turn_rad in turns(&to, &own) {
        for [x_m, y_m] in shifts(truth, model, turn_rad) {
            let (pose, score) = fit(&to, &points, Pose2::new(x_m, y_m, turn_rad));
            if best.is_none_or(|(other, _)| score > other) {
                best = Some((score, pose));
            }
        }
    }
    best.map(|(_, pose)| pose)
}

/// Keys by their votes, the largest first.
fn ranked<K: Ord + Copy>(votes: BTreeMap<K, f64>, count: usize) -> Vec<K> {
    let mut votes: Vec<(K, f64)> = votes.into_iter().collect();
    votes.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    votes.into_iter().take(count).map(|(key, _)| key).collect()
}

/// Turns that make borders run the same way.
fn turns(to: &Borders, own: &Borders) -> Vec<f64> {
    let mut votes: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
    for border in &to.0 {
        for other in &own.0 {
            let turn = (Borders::heading_deg(border) - Borders::heading_deg(other)).rem_euclid(360.0);
            let weight = border.length_m.min(other.length_m);
            let vote = votes.entry((turn / TURN_DEG).round() as i64 % (360.0 / TURN_DEG) as i64).or_default();
            let from_first = if turn > 360.0 - TURN_DEG { turn - 360.0 } else { turn };
            *vote = (vote.0 + weight, vote.1 + weight * from_first);
        }
    }
    let best = ranked(votes.iter().map(|(key, vote)| (*key, vote.0)).collect(), TURNS);
    best.into_iter().map(|key| (votes[&key].1 / votes[&key].0).to_radians()).collect()
}

/// Shifts that lay corners of rooms on corners, after a turn.
fn shifts(truth: &Plan, model: &Plan, turn_rad: f64) -> Vec<Point> {
    let turn = Pose2::new(0.0, 0.0, turn_rad);
    let mut votes: BTreeMap<[i64; 2], f64> = BTreeMap::new();
    for own in model.rooms.iter().flat_map(|room| &room.outline_m) {
        let own = turn.transform(*own);
        for corner in truth.rooms.iter().flat_map(|room| &room.outline_m) {
            let cell = [0, 1].map(|axis| ((corner[axis] - own[axis]) / SHIFT_M).round() as i64);
            // Corners a little to the side of a cell's border vote for both.
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)] {
                *votes.entry([cell[0] + dx, cell[1] + dy]).or_default() += if dx == dy { 1.0 } else { 0.5 };
            }
        }
    }
    ranked(votes, SHIFTS).into_iter().map(|cell| cell.map(|k| k as f64 * SHIFT_M)).collect()
}

/// Fits points to borders from a first guess; the pose, and how many points lie near a border at the end.
fn fit(to: &Borders, points: &[(Point, Point)], first: Pose2) -> (Pose2, f64) {
    let mut pose = first;
    for step in 0..STEPS {
        let share = step as f64 / (STEPS - 1) as f64;
        let near_m = FIRST_NEAR_M + share * (LAST_NEAR_M - FIRST_NEAR_M);
        let Some(change) = step_of(to, points, &pose, near_m) else { break };
        pose = change;
    }
    let turned = Pose2::new(0.0, 0.0, pose.theta_rad);
    let near = points.iter().filter(|(point, along)| {
        to.nearest(pose.transform(*point), turned.transform(*along), LAST_NEAR_M).is_some()
    });
    (pose, near.count() as f64)
}

/// One step of Gauss and Newton on the distances of points to borders.
fn step_of(to: &Borders, points: &[(Point, Point)], pose: &Pose2, near_m: f64) -> Option<Pose2> {
    let turned = Pose2::new(0.0, 0.0, pose.theta_rad);
    let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
    for (point, along) in points {
        let at = turned.transform(*point);
        let Some((off, normal)) =
            to.nearest([at[0] + pose.x_m, at[1] + pose.y_m], turned.transform(*along), near_m)
        else {
            continue;
        };
        let row = [normal[0], normal[1], normal[1] * at[0] - normal[0] * at[1]];
        for i in 0..3 {
            b[i] -= row[i] * off;
            for j in 0..3 {
                a[i][j] += row[i] * row[j];
            }
        }
    }
    let [x, y, turn] = solve(a, b)?;
    let theta_rad = wrap_angle(pose.theta_rad + turn);
    Some(Pose2::new(pose.x_m + x, pose.y_m + y, theta_rad))
}

/// Cramer's rule; none where the borders leave a direction open.
fn solve(a: [[f64; 3]; 3], b: [f64; 3]) -> Option<[f64; 3]> {
    let det = |m: [[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = det(a);
    let scale = a[0][0].max(a[1][1]).max(1.0);
    if whole.abs() < 1e-9 * scale * scale * a[2][2].max(1.0) {
        return None;
    }
    Some([0, 1, 2].map(|column| {
        let mut m = a;
        for row in 0..3 {
            m[row][column] = b[row];
        }
        det(m) / whole
    }))
}

#[cfg(test)]
mod tests {
    use super::{Plan, Pose2, Room, refine, search};

    fn plan() -> Plan {
        let room = |outline_m: &[[f64; 2]]| Room { outline_m: outline_m.to_vec(), ..Room::default() };
        let rooms = vec![
            room(&[[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [2.0, 4.0], [2.0, 3.0], [0.0, 3.0]]),
            room(&[[5.1, 0.0], [8.0, 0.0], [8.0, 4.0], [5.1, 4.0]]),
        ];
        Plan { rooms, ..Plan::default() }
    }

    fn off_m(found: &Pose2, truth: &Pose2) -> f64 {
        let corners = [[0.0, 0.0], [8.0, 4.0]];
        let apart = |p: [f64; 2]| {
            let (a, b) = (found.transform(p), truth.transform(p));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        corners.map(apart).into_iter().fold(0.0, f64::max)
    }

    #[test]
    fn a_plan_is_found_wherever_it_lies() {
        for truth in [
            Pose2::new(13.0, -7.0, 2.1),
            Pose2::new(-3.0, 100.0, -1.5),
            Pose2::new(0.0, 0.0, 0.004),
            Pose2::new(4.0, 4.0, 3.1),
        ] {
            let found = search(&plan(), &plan().moved(&truth.inverse())).expect("found");
            assert!(off_m(&found, &truth) < 1e-6, "{found:?} {truth:?}");
        }
    }

    #[test]
    fn in_one_frame_only_a_small_drift_is_taken_away() {
        let drift = Pose2::new(0.05, -0.03, 0.01);
        let found = refine(&plan(), &plan().moved(&drift.inverse()));
        assert!(off_m(&found, &drift) < 1e-6, "{found:?}");
        let far = Pose2::new(2.0, 0.0, 0.0);
        assert_eq!(refine(&plan(), &plan().moved(&far)), Pose2::IDENTITY);
    }
}
