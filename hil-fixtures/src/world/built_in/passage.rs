//! A corridor whose floor and ceiling rise and fall, along any way: walls, floor and ceiling between
//! stations, and things that stand along it.

use super::builder::{Builder, Facing};
use crate::world::vec3::Vec3;

/// Directions closer than this are the same, radians.
const SAME_RAD: f64 = 1e-6;
/// What stands on a slope reaches so far below its floor, meters: to where nobody sees its foot.
const BELOW_M: f64 = 0.3;

/// Where floor and ceiling are at a place of the way, meters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    /// The middle of the corridor.
    pub at_m: [f64; 2],
    /// Height of the floor.
    pub floor_m: f64,
    /// Height of the ceiling.
    pub ceiling_m: f64,
}

/// Something upright that stands or hangs at a wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thing {
    /// From and to along the way, meters.
    pub along_m: [f64; 2],
    /// Whether it is at the left wall.
    pub left: bool,
    /// How far it stands out from the wall.
    pub depth_m: f64,
    /// From and to above the floor in its middle; from 0 it stands.
    pub height_m: [f64; 2],
}

/// The corridor along its stations.
pub(super) struct Passage {
    pub stations: Vec<Station>,
    /// Half its width, meters.
    pub half_m: f64,
}

impl Passage {
    /// Builds all of it with closed ends.
    pub(super) fn build(&self, b: &mut Builder, things: &[Thing]) {
        for side in [1.0, -1.0] {
            for run in self.runs(|one, other| (self.turn_rad(one, other)).abs() < SAME_RAD) {
                let walls: Vec<Vec<Vec3>> = run.map(|segment| self.wall(segment, side)).collect();
                b.pieces(&walls);
            }
        }
        for ceiling in [false, true] {
            let same = |one: usize, other: usize| {
                self.turn_rad(one, other).abs() < SAME_RAD
                    && (self.rise(one, ceiling) - self.rise(other, ceiling)).abs() < SAME_RAD
            };
            for run in self.runs(same) {
                let is_flat = run.clone().all(|segment| self.is_flat(segment, ceiling));
                let cover: Vec<Vec<Vec3>> =
                    run.flat_map(|segment| self.cover(segment, ceiling, is_flat)).collect();
                if is_flat { b.pieces(&cover) } else { b.bent(&cover) }
            }
        }
        let last = self.stations.len() - 1;
        let [start, end] = [0, last].map(|at| [1.0, -1.0].map(|side| self.corner(at, side)));
        b.pieces(&[upright(start[0], start[1], self.heights(0), self.heights(0))]);
        b.pieces(&[upright(end[1], end[0], self.heights(last), self.heights(last))]);
        things.iter().for_each(|thing| self.thing(b, thing));
    }

    /// Ranges of segments that go on as one surface.
    fn runs(&self, same: impl Fn(usize, usize) -> bool) -> Vec<std::ops::Range<usize>> {
        let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
        for segment in 0..self.stations.len() - 1 {
            match runs.last_mut() {
                Some(run) if same(segment - 1, segment) => run.end = segment + 1,
                _ => runs.push(segment..segment + 1),
            }
        }
        runs
    }

    fn heights(&self, station: usize) -> [f64; 2] {
        [self.stations[station].floor_m, self.stations[station].ceiling_m]
    }

    fn direction_rad(&self, segment: usize) -> f64 {
        let [a, b] = [segment, segment + 1].map(|at| self.stations[at].at_m);
        (b[1] - a[1]).atan2(b[0] - a[0])
    }

    fn turn_rad(&self, one: usize, other: usize) -> f64 {
        let turn = self.direction_rad(other) - self.direction_rad(one);
        turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round()
    }

    fn long_m(&self, segment: usize) -> f64 {
        let [a, b] = [segment, segment + 1].map(|at| self.stations[at].at_m);
        (b[0] - a[0]).hypot(b[1] - a[1])
    }

    fn rise(&self, segment: usize, ceiling: bool) -> f64 {
        let [a, b] = [segment, segment + 1].map(|at| self.heights(at)[usize::from(ceiling)]);
        (b - a) / self.long_m(segment)
    }

    /// Whether floor or ceiling of a segment is flat: level, or straight on at both ends.
    fn is_flat(&self, segment: usize, ceiling: bool) -> bool {
        let bends = |one: usize, other: usize| {
            other + 1 < self.stations.len() && self.turn_rad(one, other).abs() >= SAME_RAD
        };
        let curved = bends(segment, segment + 1) || segment > 0 && bends(segment - 1, segment);
        self.rise(segment, ceiling).abs() < SAME_RAD || !curved
    }

    /// Where a wall stands at a station: on the line that halves the corner.
    fn corner(&self, station: usize, side: f64) -> [f64; 2] {
        let last = self.stations.len() - 2;
        let before = station.saturating_sub(1).min(last);
        let half_turn = 0.5 * self.turn_rad(before, station.min(last));
        let (sin, cos) = (self.direction_rad(before) + half_turn).sin_cos();
        let out_m = side * self.half_m / half_turn.cos();
        let [x, y] = self.stations[station].at_m;
        [x - sin * out_m, y + cos * out_m]
    }

    fn wall(&self, segment: usize, side: f64) -> Vec<Vec3> {
        let (one, other) = (segment, segment + 1);
        let (from, to) = if side > 0.0 { (other, one) } else { (one, other) };
        upright(self.corner(from, side), self.corner(to, side), self.heights(from), self.heights(to))
    }

    /// Floor or ceiling of a segment.
    fn cover(&self, segment: usize, ceiling: bool, is_flat: bool) -> Vec<Vec<Vec3>> {
        let place = |station: usize, side: f64| {
            let [x, y] = self.corner(station, side);
            [x, y, self.heights(station)[usize::from(ceiling)]]
        };
        let (one, other) = (segment, segment + 1);
        let mut quad = vec![place(one, 1.0), place(one, -1.0), place(other, -1.0), place(other, 1.0)];
        if ceiling {
            quad.reverse();
        }
        if is_flat { vec![quad] } else { vec![quad[..3].to_vec(), vec![quad[0], quad[2], quad[3]]] }
    }

    /// The place so far along the way: x, y, height of the floor, direction.
    fn at(&self, along_m: f64) -> ([f64; 3], f64) {
        let mut left_m = along_m;
        let mut segment = 0;
        while segment + 2 < self.stations.len() && left_m > self.long_m(segment) {
            left_m -= self.long_m(segment);
            segment += 1;
        }
        let (a, b) = (self.stations[segment], self.stations[segment + 1]);
        let u = left_m / self.long_m(segment);
        let mix = |a: f64, b: f64| a + u * (b - a);
        let at = [mix(a.at_m[0], b.at_m[0]), mix(a.at_m[1], b.at_m[1]), mix(a.floor_m, b.floor_m)];
        (at, self.direction_rad(segment))
    }

    fn thing(&self, b: &mut Builder, thing: &Thing) {
        let [from, to] = thing.along_m;
        let (at, direction_rad) = self.at(0.5 * (from + to));
        let half_m = 0.5 * (to - from);
        let [low, high] = thing.height_m;
        let low = if low == 0.0 { -BELOW_M } else { low };
        let (y, face) = if thing.left {
            ([self.half_m - thing.depth_m, self.half_m], Facing::Right)
        } else {
            ([-self.half_m, thing.depth_m - self.half_m], Facing::Left)
        };
        let sides = [Facing::Front, Facing::Back, face, Facing::Up, Facing::Down];
        b.within(at, direction_rad.to_degrees(), |b| b.block_with([-half_m, half_m], y, [low, high], &sides));
    }
}

/// An upright quadrilateral that looks to the left of the way from `from` to `to`.
fn upright(from: [f64; 2], to: [f64; 2], of_from: [f64; 2], of_to: [f64; 2]) -> Vec<Vec3> {
    let place = |[x, y]: [f64; 2], z: f64| [x, y, z];
    vec![place(to, of_to[0]), place(from, of_from[0]), place(from, of_from[1]), place(to, of_to[1])]
}
