//! A small piece of a mapped wall: running means of the end points that fell on it and of the normals they
//! brought.
//!
//! Frame: map. Units: meters. A piece on a wall is a line (position and normal); a pole, a corner or clutter,
//! whose normals disagree, is a point.

use crate::map::params::MapParams;
use biplane_geometry::vec2::dot;

/// What a hit counts for a surface, in beams that pass through it. Larger: people who stood still stay
/// longer. Error 0.0247 m halved, 0.0249 m doubled.
const EVIDENCE_PER_HIT: i16 = 3;
/// The most evidence a surface has: so many beams must pass through before it goes. Larger: moved things stay
/// longer; smaller: grazing beams carve walls away. Error 0.0246 m halved, 0.0247 m doubled.
const EVIDENCE_MAX: i16 = 60;

/// One piece of mapped surface.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Surfel {
    /// Mean of the end points, meters.
    pub at_m: [f32; 2],
    /// Mean of their unit normals; its length is 1 on a wall and small where they disagree.
    pub normal: [f32; 2],
    /// End points that it has taken, up to the cap.
    pub hits: f32,
    /// Hits count for it, beams that passed through count against it.
    pub evidence: i16,
    /// The cell in which it was begun.
    pub home: [i16; 2],
    /// The submap of the map that it belongs to (see `belief`).
    pub submap: u8,
}

impl Surfel {
    /// A surface of one end point (`at_m` and `normal` in the map).
    pub fn new(at_m: [f32; 2], normal: [f32; 2], home: [i32; 2], submap: u8) -> Self {
        Self {
            at_m,
            normal,
            hits: 1.0,
            evidence: EVIDENCE_PER_HIT,
            home: home.map(|cell| cell as i16),
            submap,
        }
    }

    /// Takes one more end point. One that has no direction takes from the surface's own.
    #[inline(always)]
    pub fn add(&mut self, at_m: [f32; 2], normal: [f32; 2], params: &MapParams) {
        self.hits = (self.hits + 1.0).min(params.memory_hits as f32);
        let rate = 1.0 / self.hits;
        for axis in 0..2 {
            self.at_m[axis] += rate * (at_m[axis] - self.at_m[axis]);
            self.normal[axis] += rate * (normal[axis] - self.normal[axis]);
        }
        self.evidence = (self.evidence + EVIDENCE_PER_HIT).min(EVIDENCE_MAX);
    }

    /// Whether an end point at `offset` (meters from its mean) with this normal belongs to it.
    #[inline(always)]
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

fn square(value: f32) -> f32 {
    value * value
}
