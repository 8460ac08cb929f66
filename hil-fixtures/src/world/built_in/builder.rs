//! Putting a world together from walls, blocks, cylinders and trees.
//!
//! Everything is placed in the builder's current frame (x forward, y left, z up; meters), which may itself be
//! placed and turned in the world. A rectangle is one surface and gets one plane label, whatever holes are
//! cut out of it.

use crate::rng::Rng;
use crate::world::built_in::round::{RoundKind, RoundSide, RoundThing, sides};
use crate::world::mesh::{LabeledMesh, NO_PLANE};
use crate::world::pose::Pose;
use crate::world::vec3::{Vec3, add, cross, length, scale, sub, unit};

/// An interval along an axis: from, to.
pub type Span = [f64; 2];

/// A rectangular hole in a rectangle, in the rectangle's own two axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hole {
    /// Along the first axis (x, or y for a surface that faces along x).
    pub u: Span,
    /// Along the second axis (z, or y for a surface that faces up or down).
    pub v: Span,
}

/// Which way a rectangle looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// +x
    Front,
    /// -x
    Back,
    /// +y
    Left,
    /// -y
    Right,
    /// +z
    Up,
    /// -z
    Down,
}

impl Facing {
    /// The axis it looks along, and its own two axes.
    fn axes(self) -> [usize; 3] {
        match self {
            Self::Front | Self::Back => [0, 1, 2],
            Self::Left | Self::Right => [1, 0, 2],
            Self::Up | Self::Down => [2, 0, 1],
        }
    }

    /// Whether corners that go round its own axes go round clockwise, seen from where it looks.
    fn flipped(self) -> bool {
        // x of (y, z) and z of (x, y) are right-handed, y of (x, z) is not.
        matches!(self, Self::Back | Self::Left | Self::Down)
    }
}

/// A world under construction.
#[derive(Clone, Debug, Default)]
pub struct Builder {
    mesh: LabeledMesh,
    planes: i32,
    frame: Pose,
    rounds: Vec<RoundThing>,
}

impl Builder {
    /// The finished surfaces.
    #[must_use]
    pub fn finish(self) -> LabeledMesh {
        self.mesh
    }

    /// The finished surfaces, and the round things among them.
    #[must_use]
    pub fn finish_all(self) -> (LabeledMesh, Vec<RoundThing>) {
        (self.mesh, self.rounds)
    }

    /// Builds in a frame that lies at `x`, `y`, `z` of the current one, turned by `yaw_deg`.
    pub fn within(&mut self, at_m: Vec3, yaw_deg: f64, build: impl FnOnce(&mut Self)) {
        let outer = self.frame;
        self.frame = outer.then(&Pose::from_angles(at_m, [0.0, 0.0, yaw_deg.to_radians()]));
        build(self);
        self.frame = outer;
    }

    fn new_plane(&mut self) -> i32 {
        self.planes += 1;
        self.planes - 1
    }

    /// A flat rectangle at `at` on the axis it looks along, with holes.
    pub fn rect(&mut self, facing: Facing, at: f64, u: Span, v: Span, holes: &[Hole]) {
        let plane = self.new_plane();
        for [u, v] in cells(u, v, holes) {
            let mut quad = [[u[0], v[0]], [u[1], v[0]], [u[1], v[1]], [u[0], v[1]]].map(|corner| {
                let [axis, first, second] = facing.axes();
                let mut point = [0.0; 3];
                (point[axis], point[first], point[second]) = (at, corner[0], corner[1]);
                point
            });
            if facing.flipped() {
                quad.reverse();
            }
            self.fan(&quad, plane);
        }
    }

    /// A flat convex polygon, counter-clockwise as seen from where it looks.
    pub fn polygon(&mut self, corners: &[Vec3]) {
        let plane = self.new_plane();
        self.fan(corners, plane);
    }

    /// Convex polygons that are parts of one flat surface, each counter-clockwise as seen from where it
    /// looks.
    pub fn pieces(&mut self, pieces: &[Vec<Vec3>]) {
        let plane = self.new_plane();
        pieces.iter().for_each(|corners| self.fan(corners, plane));
    }

    /// The same of a surface that is not flat.
    pub fn bent(&mut self, pieces: &[Vec<Vec3>]) {
        pieces.iter().for_each(|corners| self.fan(corners, NO_PLANE));
    }

    fn fan(&mut self, corners: &[Vec3], plane: i32) {
        let at: Vec<u32> = corners.iter().map(|corner| self.mesh.vertex(self.frame.apply(*corner))).collect();
        for i in 1..at.len().saturating_sub(1) {
            self.mesh.face([at[0], at[i], at[i + 1]], plane);
        }
    }

    /// A closed block.
    pub fn block(&mut self, x: Span, y: Span, z: Span) {
        self.block_with(
            x,
            y,
            z,
            &[Facing::Front, Facing::Back, Facing::Left, Facing::Right, Facing::Up, Facing::Down],
        );
    }

    /// A block of which only some sides are there: what stands against a wall has no back.
    pub fn block_with(&mut self, x: Span, y: Span, z: Span, sides: &[Facing]) {
        for side in sides {
            match side {
                Facing::Front => self.rect(*side, x[1], y, z, &[]),
                Facing::Back => self.rect(*side, x[0], y, z, &[]),
                Facing::Left => self.rect(*side, y[1], x, z, &[]),
                Facing::Right => self.rect(*side, y[0], x, z, &[]),
                Facing::Up => self.rect(*side, z[1], x, y, &[]),
                Facing::Down => self.rect(*side, z[0], x, y, &[]),
            }
        }
    }

    /// What closes a hole in the surface y = 0 at `depth` behind it: reveals all round, and a pane when
    /// `pane`. `u` along x, `v` along z; a hole that starts at the floor (v from 0) has no sill.
    pub fn recess(&mut self, hole: Hole, depth: f64, pane: bool) {
        let y = [-depth, 0.0];
        self.rect(Facing::Front, hole.u[0], y, hole.v, &[]);
        self.rect(Facing::Back, hole.u[1], y, hole.v, &[]);
        self.rect(Facing::Down, hole.v[1], hole.u, y, &[]);
        if hole.v[0] > 0.0 {
            self.rect(Facing::Up, hole.v[0], hole.u, y, &[]);
        }
        if pane {
            self.rect(Facing::Left, -depth, hole.u, hole.v, &[]);
        }
    }

    /// A wall along x whose front is y = 0 and looks to +y, with holes all through it.
    pub fn wall(&mut self, x: Span, thickness: f64, height: f64, holes: &[Hole]) {
        self.rect(Facing::Left, 0.0, x, [0.0, height], holes);
        self.rect(Facing::Right, -thickness, x, [0.0, height], holes);
        for hole in holes {
            self.recess(*hole, thickness, false);
        }
    }

    /// An upright cylinder, closed on top.
    pub fn cylinder(&mut self, center: [f64; 2], radius: f64, z: Span) {
        self.standing(RoundKind::Pole, center, radius, z);
    }

    /// An upright cylinder that is more than a pole, closed on top.
    pub fn standing(&mut self, kind: RoundKind, center: [f64; 2], radius: f64, z: Span) {
        let [from, to] = z.map(|z| [center[0], center[1], z]);
        self.tube(kind, [from, to], radius);
        let high = self.ring([from, to], radius, to, [0.0, 360.0]);
        let top = self.mesh.vertex(self.frame.apply(to));
        for pair in high.windows(2) {
            self.mesh.face([pair[0], pair[1], top], NO_PLANE);
        }
    }

    /// A cylinder along any axis, open at its ends, seen from outside.
    pub fn tube(&mut self, kind: RoundKind, axis: [Vec3; 2], radius: f64) {
        self.round(kind, axis, radius, [0.0, 360.0], RoundSide::Outside);
    }

    /// A part of an upright cylinder that is seen from inside, as an apse; degrees from the frame's x.
    pub fn niche(&mut self, center: [f64; 2], radius: f64, z: Span, arc_deg: Span) {
        let axis = z.map(|z| [center[0], center[1], z]);
        self.round(RoundKind::Wall, axis, radius, arc_deg, RoundSide::Inside);
    }

    fn round(&mut self, kind: RoundKind, axis: [Vec3; 2], radius: f64, arc_deg: Span, side: RoundSide) {
        let (low, high) =
            (self.ring(axis, radius, axis[0], arc_deg), self.ring(axis, radius, axis[1], arc_deg));
        for i in 1..low.len() {
            let (a, b, c, d) = (low[i - 1], low[i], high[i], high[i - 1]);
            let faces = match side {
                RoundSide::Outside => [[a, b, c], [a, c, d]],
                RoundSide::Inside => [[a, c, b], [a, d, c]],
            };
            faces.into_iter().for_each(|face| self.mesh.face(face, NO_PLANE));
        }
        let [axis_from_m, axis_to_m] = axis.map(|p| self.frame.apply(p));
        let arc_deg = arc_deg[1] - arc_deg[0];
        self.rounds.push(RoundThing {
            kind,
            axis_from_m,
            axis_to_m,
            radius_m: radius,
            arc_deg,
            seen_from: side,
        });
    }

    /// Corners along an arc about an axis, in the plane through `at`. Upright axes count from the frame's x.
    fn ring(&mut self, axis: [Vec3; 2], radius: f64, at: Vec3, arc_deg: Span) -> Vec<u32> {
        let along = sub(axis[1], axis[0]);
        let along = scale(along, 1.0 / length(along));
        let upright = along[2].abs() > 0.9;
        let first = unit(cross(if upright { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] }, along));
        let second = cross(along, first);
        let [from, to] = arc_deg.map(f64::to_radians);
        let count = (f64::from(sides(radius)) * (to - from) / std::f64::consts::TAU).ceil().max(3.0);
        (0..=count as u32)
            .map(|k| from + (to - from) * f64::from(k) / count)
            .map(|a| add(at, add(scale(first, radius * a.cos()), scale(second, radius * a.sin()))))
            .map(|p| self.mesh.vertex(self.frame.apply(p)))
            .collect()
    }

    /// Loose leaves within an ellipsoid.
    pub fn foliage(&mut self, center: Vec3, radii: Vec3, leaves: u32, rng: &mut Rng) {
        for _ in 0..leaves {
            let direction = unit([rng.normal(), rng.normal(), rng.normal()]);
            // Most leaves are outside.
            let out = rng.unit().powf(0.25);
            let at = add(center, [0, 1, 2].map(|i| radii[i] * direction[i] * out));
            let size = rng.between(0.06, 0.2);
            let corners =
                [0; 3].map(|_| add(at, scale(unit([rng.normal(), rng.normal(), rng.normal()]), size)));
            let corners = corners.map(|p| self.mesh.vertex(self.frame.apply(p)));
            self.mesh.face(corners, NO_PLANE);
        }
    }

    /// A tree: a trunk and a crown.
    pub fn tree(&mut self, at: [f64; 2], height: f64, crown_radius: f64, rng: &mut Rng) {
        self.cylinder(at, rng.between(0.1, 0.2), [0.0, 0.6 * height]);
        let crown_height = 0.35 * height;
        let leaves = (140.0 * crown_radius * crown_radius) as u32;
        let center = [at[0], at[1], height - crown_height];
        self.foliage(center, [crown_radius, crown_radius, crown_height], leaves, rng);
    }
}

/// A rectangle without its holes, as rectangles: strips between all edges along u, each cut along v.
fn cells(u: Span, v: Span, holes: &[Hole]) -> Vec<[Span; 2]> {
    let mut cuts = vec![u[0], u[1]];
    cuts.extend(holes.iter().flat_map(|hole| hole.u).filter(|x| *x > u[0] && *x < u[1]));
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let mut out = Vec::new();
    for strip in cuts.windows(2) {
        let middle = 0.5 * (strip[0] + strip[1]);
        let mut gaps: Vec<Span> =
            holes.iter().filter(|hole| hole.u[0] < middle && middle < hole.u[1]).map(|hole| hole.v).collect();
        gaps.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut from = v[0];
        for gap in gaps {
            if gap[0] > from {
                out.push([[strip[0], strip[1]], [from, gap[0].min(v[1])]]);
            }
            from = from.max(gap[1]);
        }
        if from < v[1] {
            out.push([[strip[0], strip[1]], [from, v[1]]]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{Builder, Facing, Hole};
    use crate::world::mesh::LabeledMesh;
    use crate::world::raycast::normal;
    use crate::world::vec3::{cross, length, sub};

    fn area(mesh: &LabeledMesh) -> f64 {
        (0..mesh.faces.len())
            .map(|i| mesh.corners(i))
            .map(|[a, b, c]| 0.5 * length(cross(sub(b, a), sub(c, a))))
            .sum()
    }

    #[test]
    fn a_rectangle_with_holes_has_the_area_that_is_left_and_one_label() {
        let mut builder = Builder::default();
        let holes = [
            Hole { u: [1.0, 2.0], v: [0.0, 2.0] },
            Hole { u: [4.0, 5.0], v: [1.0, 2.0] },
            Hole { u: [4.5, 5.5], v: [2.2, 2.4] },
        ];
        builder.rect(Facing::Left, 0.0, [0.0, 10.0], [0.0, 3.0], &holes);
        let mesh = builder.finish();
        assert!((area(&mesh) - (30.0 - 2.0 - 1.0 - 0.2)).abs() < 1e-9, "{}", area(&mesh));
        assert_eq!(mesh.plane_count(), 1);
    }

    #[test]
    fn the_sides_of_a_block_look_outwards() {
        let mut builder = Builder::default();
        builder.block([1.0, 2.0], [3.0, 5.0], [0.0, 4.0]);
        let mesh = builder.finish();
        assert_eq!((mesh.plane_count(), mesh.faces.len()), (6, 12));
        for i in 0..mesh.faces.len() {
            let [a, ..] = mesh.corners(i);
            let out = normal(mesh.corners(i));
            let from_center = sub(a, [1.5, 4.0, 2.0]);
            assert!((0..3).map(|k| out[k] * from_center[k]).sum::<f64>() > 0.0, "face {i}: {out:?}");
        }
    }

    #[test]
    fn nested_frames_turn_and_shift() {
        let mut builder = Builder::default();
        builder.within([10.0, 0.0, 0.0], 90.0, |b| {
            b.within([1.0, 0.0, 0.0], 0.0, |b| b.polygon(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]));
        });
        let mesh = builder.finish();
        let [a, b, _] = mesh.corners(0);
        assert!(length(sub(a, [10.0, 1.0, 0.0])) < 1e-12, "{a:?}");
        assert!(length(sub(b, [10.0, 2.0, 0.0])) < 1e-12, "{b:?}");
    }
}
