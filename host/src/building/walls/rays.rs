//! What rays tell of a wall: in cells of its elevation, how many ended on it and how many passed.

use super::slabs::Slab;
use crate::building::spaces::evidence::Evidence;

/// Side of a cell of an elevation, meters.
pub(crate) const STEP_M: f64 = 0.05;
/// Rays that end further before a wall say nothing of it.
const MAX_Z_M: f64 = 6.0;

/// The elevation of a wall.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Elevation {
    /// Cells along and up.
    pub size: [usize; 2],
    /// Place of the first cell: along the wall, and height.
    pub origin_m: [f64; 2],
    /// Rays that ended on a face, by cell.
    pub hits: Vec<u16>,
    /// Rays that went on behind a face.
    pub passes: Vec<u16>,
    /// Where each ray came to the wall: along and height, and how far behind the face it ended when it did
    /// not end there, meters.
    pub rays: Vec<([f32; 2], Option<f32>)>,
    /// Where each ray ended that ended on the wall: along, height, and how far behind the face; negative
    /// before it, meters.
    pub on_face_m: Vec<[f32; 3]>,
    /// Points between the two faces, and a little behind one that has no other: along, height, and how far
    /// behind the face from which they were seen.
    pub inside_m: Vec<[f32; 3]>,
}

/// What a cell shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// Rays ended.
    Wall,
    /// Rays passed.
    Open,
    /// No ray came here.
    Unseen,
}

impl Elevation {
    /// Of a wall, up to a height.
    pub(crate) fn of(evidence: &Evidence<'_>, slab: &Slab, top_m: f64) -> Self {
        let floor_m = evidence.floor_m;
        let height_m = (top_m - floor_m).clamp(0.0, MAX_Z_M);
        let count = |length: f64| (length / STEP_M).ceil() as usize;
        let size = [count(slab.length_m()), count(height_m)];
        let cells = size[0] * size[1];
        let mut out = Self {
            size,
            origin_m: [slab.span[0], floor_m],
            hits: vec![0; cells],
            passes: vec![0; cells],
            rays: Vec::new(),
            on_face_m: Vec::new(),
            inside_m: Vec::new(),
        };
        let pass_m = evidence.pass_m();
        let flat = |p: &[f32; 3]| [f64::from(p[0]), f64::from(p[1])];
        let across: Vec<f64> =
            evidence.cloud.origins_m.iter().map(|origin| slab.line.place(flat(origin))[0]).collect();
        for (point, scan) in evidence.cloud.points_m.iter().zip(&evidence.cloud.scan) {
            let Some(across_m) = across.get(*scan as usize) else { continue };
            let origin = &evidence.cloud.origins_m[*scan as usize];
            let heights_m = [origin[2], point[2]].map(f64::from);
            out.add(slab, *across_m, [flat(origin), flat(point)], heights_m, pass_m);
        }
        out
    }

    /// Counts one ray between two places at their heights, of which the first is at a distance across.
    fn add(
        &mut self,
        slab: &Slab,
        across_m: f64,
        ends: [[f64; 2]; 2],
        [from_z, to_z]: [f64; 2],
        pass_m: f64,
    ) {
        let [low, high] = slab.faces_m;
        let face_m = match across_m {
            across if across < low => low,
            across if across > high => high,
            _ => return,
        };
        let sign = if face_m == low { 1.0 } else { -1.0 };
        let is_seen = slab.is_seen[usize::from(face_m == high)];
        let to = slab.line.place(ends[1]);
        let beyond_m = (to[0] - face_m) * sign;
        if !is_seen || beyond_m < -pass_m {
            return;
        }
        if beyond_m <= pass_m {
            self.count([to[1], to_z], None);
            if self.is_near(to[1]) {
                self.on_face_m.push([to[1], to_z, beyond_m].map(|value| value as f32));
            }
            return;
        }
        let Some([share, at_m]) = slab.line.crossing(ends, face_m) else { return };
        // What came into a circle elsewhere says nothing of the wall on it.
        if slab.line.curve().is_some() && !self.is_near(at_m) {
            return;
        }
        self.count([at_m, from_z + share * (to_z - from_z)], Some(beyond_m as f32));
        if beyond_m < high - low - 0.01 && self.is_near(to[1]) {
            self.inside_m.push([to[1], to_z, beyond_m].map(|value| value as f32));
        }
    }

    fn is_near(&self, at_m: f64) -> bool {
        let end_m = self.origin_m[0] + self.size[0] as f64 * STEP_M;
        at_m > self.origin_m[0] - 0.5 && at_m < end_m + 0.5
    }

    fn count(&mut self, place: [f64; 2], beyond_m: Option<f32>) {
        let at = [0, 1].map(|axis| ((place[axis] - self.origin_m[axis]) / STEP_M).floor());
        if (0..2).all(|axis| at[axis] >= 0.0 && at[axis] < self.size[axis] as f64) {
            let cell = at[1] as usize * self.size[0] + at[0] as usize;
            let counts = if beyond_m.is_none() { &mut self.hits } else { &mut self.passes };
            counts[cell] = counts[cell].saturating_add(1);
            self.rays.push((place.map(|value| value as f32), beyond_m));
        }
    }

    /// What a cell shows, by most of the rays.
    pub(crate) fn shown(&self, column: usize, row: usize) -> Shown {
        let cell = row * self.size[0] + column;
        let (hits, passes) = (self.hits[cell], self.passes[cell]);
        match (hits, passes) {
            (0, 0) => Shown::Unseen,
            _ if passes > hits => Shown::Open,
            _ => Shown::Wall,
        }
    }
}
