//! A small piece of a mapped wall: running means of the end points that fell on it and of the normals they brought.
//!
//! Frame: map. Units: metres. A piece on a wall is a line (position and normal); a pole, a corner or clutter, whose
//! normals disagree, is a point.

use crate::local_map::MapParams;
use crate::points::EndPoint;

/// One piece of mapped surface.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Surface {
    /// Mean of the end points, metres.
    pub at_m: [f32; 2],
    /// Mean of their unit normals; its length is 1 on a wall and small where they disagree.
    pub normal: [f32; 2],
    /// End points that it has taken, up to the cap.
    pub hits: f32,
    /// Hits count for it, beams that passed through count against it.
    pub evidence: i16,
    /// The cell in which it was begun.
    pub home: [i16; 2],
    /// The chapter of the map that it belongs to (see `belief`).
    pub chapter: u8,
}

impl Surface {
    /// A surface of one end point (`at_m` and `normal` in the map).
    pub fn new(at_m: [f32; 2], normal: [f32; 2], home: [i32; 2], chapter: u8, params: &MapParams) -> Self {
        Self {
            at_m,
            normal,
            hits: 1.0,
            evidence: params.evidence_per_hit,
            home: home.map(|cell| cell as i16),
            chapter,
        }
    }

    /// Takes one more end point. One that has no direction takes from the surface's own.
    pub fn add(&mut self, at_m: [f32; 2], normal: [f32; 2], params: &MapParams) {
        self.hits = (self.hits + 1.0).min(params.memory_hits as f32);
        let rate = 1.0 / self.hits;
        for axis in 0..2 {
            self.at_m[axis] += rate * (at_m[axis] - self.at_m[axis]);
            self.normal[axis] += rate * (normal[axis] - self.normal[axis]);
        }
        self.evidence = (self.evidence + params.evidence_per_hit).min(params.evidence_max);
    }

    /// Whether an end point at `offset` (metres from its mean) with this normal belongs to it.
    pub fn takes(&self, offset: [f32; 2], normal: [f32; 2], params: &MapParams) -> bool {
        let agree = dot(self.normal, normal);
        let strength = dot(self.normal, self.normal);
        if strength < 0.25 || dot(normal, normal) < 0.25 {
            return dot(offset, offset) < square(0.5 * params.cell_m as f32);
        }
        let across = dot(offset, self.normal) / strength.sqrt();
        let along_squared = dot(offset, offset) - across * across;
        agree > 0.5 * strength.sqrt()
            && across.abs() < params.merge_across_m as f32
            && along_squared < square(0.7 * params.cell_m as f32)
    }
}

/// A normal turned and a point moved by a pose given as sine, cosine and translation.
#[derive(Copy, Clone, Debug)]
pub struct Placement {
    /// Sine of the heading.
    pub sin: f32,
    /// Cosine of the heading.
    pub cos: f32,
    /// Translation, metres.
    pub at_m: [f32; 2],
}

impl Placement {
    /// The placement of a pose.
    pub fn new(pose: &crate::Pose2) -> Self {
        let (sin, cos) = pose.theta_rad.sin_cos();
        Self { sin: sin as f32, cos: cos as f32, at_m: [pose.x_m as f32, pose.y_m as f32] }
    }

    /// A direction in the outer frame.
    #[inline]
    pub fn turn(&self, v: [f32; 2]) -> [f32; 2] {
        [self.cos * v[0] - self.sin * v[1], self.sin * v[0] + self.cos * v[1]]
    }

    /// A point in the outer frame.
    #[inline]
    pub fn place(&self, point_m: [f32; 2]) -> [f32; 2] {
        let turned = self.turn(point_m);
        [turned[0] + self.at_m[0], turned[1] + self.at_m[1]]
    }

    /// An end point's position and normal in the outer frame.
    #[inline]
    pub fn place_point(&self, point: &EndPoint) -> ([f32; 2], [f32; 2]) {
        (self.place(point.at_m), self.turn(point.normal))
    }
}

/// The scalar product.
#[inline]
pub fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

/// The difference `a - b`.
#[inline]
pub fn minus(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn square(value: f32) -> f32 {
    value * value
}
