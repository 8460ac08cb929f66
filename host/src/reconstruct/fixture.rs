//! Noisy organized scans of a corridor made of rectangles, for tests: a ray caster of its own, so that truth
//! comes from outside.
//!
//! Meters, frame `map`.

use crate::model::{Cloud, Mesh};
use crate::reconstruct::planes::paper::random::Random;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{cross, dot, minus};

/// A rectangle: a corner and its two sides.
pub(crate) struct Rectangle {
    pub corner_m: [f64; 3],
    pub sides_m: [[f64; 3]; 2],
}

impl Rectangle {
    fn new(corner_m: [f64; 3], sides_m: [[f64; 3]; 2]) -> Self {
        Self { corner_m, sides_m }
    }

    /// Distance along a unit ray; the sides are orthogonal.
    fn hit_m(&self, origin: [f64; 3], ray: [f64; 3]) -> Option<f64> {
        let [u, v] = self.sides_m;
        let n = cross(u, v);
        let range_m = dot(n, minus(self.corner_m, origin)) / dot(n, ray);
        let at = minus(std::array::from_fn(|k| origin[k] + range_m * ray[k]), self.corner_m);
        let inside = |side: [f64; 3]| (0.0..=dot(side, side)).contains(&dot(at, side));
        (range_m > 0.0 && inside(u) && inside(v)).then_some(range_m)
    }
}

/// A corridor 6 m long, 2 m wide and 2.6 m high; in its left wall (y = 1) a door 0.9 m wide and 2.1 m high at
/// x = 2.0 that opens into a room of 3 m depth.
pub(crate) fn corridor() -> Vec<Rectangle> {
    let flat = |corner, x: f64, y: f64| Rectangle::new(corner, [[x, 0.0, 0.0], [0.0, y, 0.0]]);
    let along_x = |corner, x: f64, z: f64| Rectangle::new(corner, [[x, 0.0, 0.0], [0.0, 0.0, z]]);
    let along_y = |corner, y: f64, z: f64| Rectangle::new(corner, [[0.0, y, 0.0], [0.0, 0.0, z]]);
    vec![
        along_x([0.0, 1.0, 0.0], 2.0, 2.6),
        along_x([2.0, 1.0, 2.1], 0.9, 0.5),
        along_x([2.9, 1.0, 0.0], 3.1, 2.6),
        along_x([0.0, -1.0, 0.0], 6.0, 2.6),
        flat([0.0, -1.0, 2.6], 6.0, 2.0),
        along_x([0.5, 4.0, 0.0], 5.0, 2.6),
        along_y([0.5, 1.0, 0.0], 3.0, 2.6),
        along_y([5.5, 1.0, 0.0], 3.0, 2.6),
        flat([0.5, 1.0, 2.6], 5.0, 3.0),
    ]
}

/// The rectangles as triangles: the true surfaces.
pub(crate) fn truth(scene: &[Rectangle]) -> Mesh {
    let mut mesh = Mesh::default();
    for r in scene {
        let base = mesh.vertices_m.len() as u32;
        for (s, t) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            mesh.vertices_m
                .push([0, 1, 2].map(|k| (r.corner_m[k] + s * r.sides_m[0][k] + t * r.sides_m[1][k]) as f32));
        }
        mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    }
    mesh
}

/// Drives from x = 0.3 to x = 5.7 and scans across, 1 degree a beam, from the right wall over the ceiling to
/// the left.
pub(crate) fn drive(scene: &[Rectangle], scans: u32, sigma_m: f64, seed: u64) -> Cloud {
    let mut random = Random::new(seed);
    let mut cloud = Cloud { beams_per_scan: 181, ..Cloud::default() };
    for scan in 0..scans {
        let origin = [0.3 + 5.4 * f64::from(scan) / f64::from(scans), 0.0, 0.5];
        cloud.origins_m.push(origin.map(|v| v as f32));
        for beam in 0..181u16 {
            let (sin, cos) = f64::from(beam).to_radians().portable_sin_cos();
            let ray = [0.0, -cos, sin];
            let hits = scene.iter().filter_map(|r| r.hit_m(origin, ray));
            let range_m = hits.fold(f64::INFINITY, f64::min) + sigma_m * random.normal();
            if range_m.is_finite() {
                let range_m = (range_m * 100.0).round() / 100.0;
                cloud.points_m.push([0, 1, 2].map(|k| (origin[k] + range_m * ray[k]) as f32));
                cloud.scan.push(scan);
                cloud.beam.push(beam);
            }
        }
    }
    cloud
}
