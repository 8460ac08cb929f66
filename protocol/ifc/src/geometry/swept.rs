//! Solids that a profile sweeps.

use crate::geometry::mesh::{Triangle, face, ring_normal};
use crate::geometry::vector::{Placement, Vec3, add, cross, dot, scale, sub, unit};

/// Angle of a revolution that becomes one flat piece, radians: 10 degrees.
const TURN_STEP_RAD: f64 = std::f64::consts::PI / 18.0;

/// Extrudes rings, the first of them the outline, along a vector.
pub(crate) fn extrude(rings: &[Vec<Vec3>], placement: &Placement, along: Vec3) -> Vec<Triangle> {
    let stations =
        [*placement, Placement { origin: add(placement.origin, placement.vector(along)), ..*placement }];
    sweep(rings, &stations, false)
}

/// Turns rings about an axis, radians.
pub(crate) fn revolve(
    rings: &[Vec<Vec3>],
    placement: &Placement,
    axis: &Placement,
    turn: f64,
) -> Vec<Triangle> {
    let steps = (turn.abs() / TURN_STEP_RAD).ceil().clamp(1.0, 72.0) as usize;
    let is_whole = (turn.abs() - std::f64::consts::TAU).abs() < 1e-6;
    let count = if is_whole { steps } else { steps + 1 };
    let station = |k: usize| {
        let angle = turn * k as f64 / steps as f64;
        let about = |v: Vec3| turned(v, axis.axes[2], angle);
        let moved = Placement {
            axes: [about([1.0, 0.0, 0.0]), about([0.0, 1.0, 0.0]), about([0.0, 0.0, 1.0])],
            origin: sub(axis.origin, about(axis.origin)),
        };
        placement.after(&moved)
    };
    sweep(rings, &(0..count).map(station).collect::<Vec<_>>(), is_whole)
}

fn turned(v: Vec3, axis: Vec3, angle: f64) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    let along = scale(axis, dot(axis, v) * (1.0 - cos));
    add(add(scale(v, cos), scale(cross(axis, v), sin)), along)
}

/// Walls between the stations of a profile, and caps at the ends unless it is closed; looks outward.
fn sweep(rings: &[Vec<Vec3>], stations: &[Placement], is_closed: bool) -> Vec<Triangle> {
    let turned = |ring: &Vec<Vec3>, is_hole: bool| {
        let mut ring = ring.clone();
        if (ring_normal(&ring)[2] > 0.0) == is_hole {
            ring.reverse();
        }
        ring
    };
    let rings: Vec<Vec<Vec3>> = rings.iter().enumerate().map(|(k, ring)| turned(ring, k > 0)).collect();
    let mut body = Vec::new();
    let next = |k: usize| stations.get(k + 1).or(if is_closed { stations.first() } else { None });
    for (k, station) in stations.iter().enumerate() {
        let Some(after) = next(k) else { break };
        for ring in &rings {
            for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                let quad = [station.point(*a), station.point(*b), after.point(*b), after.point(*a)];
                body.push([quad[0], quad[1], quad[2]]);
                body.push([quad[0], quad[2], quad[3]]);
            }
        }
    }
    if let (Some(first), Some(last), false) = (stations.first(), stations.last(), is_closed) {
        for [a, b, c] in face(&rings) {
            body.push([first.point(c), first.point(b), first.point(a)]);
            body.push([last.point(a), last.point(b), last.point(c)]);
        }
    }
    if volume(&body) < 0.0 {
        body.iter_mut().for_each(|triangle| triangle.reverse());
    }
    body
}

/// Volume of a closed body; negative when it is inside out.
pub(crate) fn volume(body: &[Triangle]) -> f64 {
    let origin = body.first().map_or([0.0; 3], |triangle| triangle[0]);
    let part = |[a, b, c]: &Triangle| dot(sub(*a, origin), cross(sub(*b, origin), sub(*c, origin))) / 6.0;
    body.iter().map(part).sum()
}

/// A body on one side of a plane that reaches beyond a box: for half spaces. `near` are corners to reach
/// beyond.
pub(crate) fn half_space(origin: Vec3, outward: Vec3, near: &[Triangle]) -> Vec<Triangle> {
    let Some(outward) = unit(outward) else { return Vec::new() };
    let corners = || near.iter().flatten();
    let reach = corners().map(|c| sub(*c, origin)).map(|off| dot(off, off)).fold(1.0, f64::max).sqrt() * 2.0;
    let frame = Placement::new(origin, outward, [1.0, 0.0, 0.0]);
    let ring = vec![[-reach, -reach, 0.0], [reach, -reach, 0.0], [reach, reach, 0.0], [-reach, reach, 0.0]];
    extrude(&[ring], &frame, [0.0, 0.0, -reach])
}
