//! The shape of a drive on the floor: waypoints with rounded corners, as points 5 mm apart. Meters, the
//! world's own frame.

use crate::world::path::{MAX_TURN_DEG, Path, PathError, turn_rad};

/// The longest way, meters.
const MAX_M: f64 = 10_000.0;
/// Distance between points of the way, meters.
const KNOT_M: f64 = 0.005;
/// Over which length a weave comes and goes at the ends, meters.
const WEAVE_FADE_M: f64 = 1.0;

/// A point on the floor.
pub(crate) type Point = [f64; 2];

pub(crate) fn distance(a: Point, b: Point) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

fn between(a: Point, b: Point, u: f64) -> Point {
    [a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1])]
}

/// The way as points about [`KNOT_M`] apart.
pub(crate) fn round_corners(path: &Path) -> Result<Vec<Point>, PathError> {
    let mut corners: Vec<Point> = Vec::new();
    for point in &path.waypoints_m {
        if corners.last().is_none_or(|last| distance(*last, *point) > 1e-6) {
            corners.push(*point);
        }
    }
    if corners.len() < 2 {
        return Err(PathError::TooShort { found: corners.len() });
    }
    let found_m = corners.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
    if found_m > MAX_M {
        return Err(PathError::TooLong { found_m, max_m: MAX_M });
    }
    let mut way = vec![corners[0]];
    for i in 1..corners.len() - 1 {
        let [a, b, c] = [corners[i - 1], corners[i], corners[i + 1]];
        let turn = turn_rad(a, b, c).to_degrees();
        if turn.abs() > MAX_TURN_DEG {
            return Err(PathError::TooSharp { waypoint: i, turn_deg: turn, max_deg: MAX_TURN_DEG });
        }
        let reach = path.corner_m.min(0.499 * distance(a, b)).min(0.499 * distance(b, c));
        if turn.abs() < 1e-9 || reach <= 0.0 {
            line_to(&mut way, b);
            continue;
        }
        let (before, after) = (reach / distance(a, b), reach / distance(b, c));
        let controls: [Point; 6] = [
            between(b, a, before),
            between(b, a, before * 2.0 / 3.0),
            between(b, a, before / 3.0),
            between(b, c, after / 3.0),
            between(b, c, after * 2.0 / 3.0),
            between(b, c, after),
        ];
        line_to(&mut way, controls[0]);
        let steps = (2.0 * reach / KNOT_M).ceil().max(8.0) as usize;
        way.extend((1..=steps).map(|k| bezier(controls, k as f64 / steps as f64)));
    }
    line_to(&mut way, corners[corners.len() - 1]);
    Ok(way)
}

fn line_to(way: &mut Vec<Point>, to: Point) {
    let Some(&from) = way.last() else { return };
    let steps = (distance(from, to) / KNOT_M).ceil() as usize;
    way.extend((1..=steps).map(|k| between(from, to, k as f64 / steps as f64)));
}

/// A curve of degree 5 (de Casteljau).
fn bezier(mut controls: [Point; 6], u: f64) -> Point {
    for order in (1..controls.len()).rev() {
        for i in 0..order {
            controls[i] = between(controls[i], controls[i + 1], u);
        }
    }
    controls[0]
}

/// Direction of the way at a point, from its neighbors.
pub(crate) fn heading(way: &[Point], i: usize) -> f64 {
    let (a, b) = (way[i.saturating_sub(1)], way[(i + 1).min(way.len() - 1)]);
    (b[1] - a[1]).atan2(b[0] - a[0])
}

/// Swings the way to the left and right of itself; the ends stay where they are.
pub(crate) fn weave(way: &[Point], path: &Path) -> Vec<Point> {
    if path.weave_m == 0.0 {
        return way.to_vec();
    }
    let mut along = vec![0.0];
    for pair in way.windows(2) {
        along.push(along[along.len() - 1] + distance(pair[0], pair[1]));
    }
    let length = along[along.len() - 1];
    let fade = |m: f64| {
        let u = (m / WEAVE_FADE_M).clamp(0.0, 1.0);
        u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
    };
    (0..way.len())
        .map(|i| {
            let s = along[i];
            let swing = (std::f64::consts::TAU * s / path.weave_length_m).sin();
            let aside = path.weave_m * fade(s) * fade(length - s) * swing;
            let (sin, cos) = heading(way, i).sin_cos();
            [way[i][0] - sin * aside, way[i][1] + cos * aside]
        })
        .collect()
}
