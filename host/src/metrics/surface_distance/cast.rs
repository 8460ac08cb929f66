//! The first surface along a ray. Meters. Source of the intersection: Moeller and Trumbore, "Fast, Minimum
//! Storage Ray/Triangle Intersection" (1997); both sides of a triangle count.

use super::tree::{Content, Node, Surface, Triangle};
use biplane_geometry::vec3::{cross, dot, minus};

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, meters.
    pub range_m: f64,
    /// Index of the triangle in the mesh.
    pub triangle: usize,
}

impl Surface {
    /// The first triangle along the ray from `origin` in `direction` (of length 1) that is nearer than
    /// `within_m`.
    pub fn cast(&self, origin: [f64; 3], direction: [f64; 3], within_m: f64) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut open = Vec::with_capacity(64);
        open.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(node) = open.pop() {
            let here = &self.nodes[node];
            let limit_m = best.map_or(within_m, |hit| hit.range_m);
            if here.entered_at(origin, direction).is_none_or(|range_m| range_m >= limit_m) {
                continue;
            }
            match here.content {
                Content::Leaf(start, end) => {
                    for (triangle, index) in &self.triangles[start..end] {
                        let limit_m = best.map_or(within_m, |hit| hit.range_m);
                        if let Some(range_m) = meets(triangle, origin, direction).filter(|r| *r < limit_m) {
                            best = Some(Hit { range_m, triangle: *index });
                        }
                    }
                }
                Content::Split(second) => {
                    let enters = |k: usize| self.nodes[k].entered_at(origin, direction);
                    let first = node + 1;
                    let first_is_nearer =
                        enters(first).unwrap_or(f64::INFINITY) <= enters(second).unwrap_or(f64::INFINITY);
                    open.extend(if first_is_nearer { [second, first] } else { [first, second] });
                }
            }
        }
        best
    }
}

impl Node {
    /// How far along the ray its box begins, 0 inside of it; `None` when the ray misses it.
    fn entered_at(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let low = (self.low_m[k] - origin[k]) / direction[k];
            let high = (self.high_m[k] - origin[k]) / direction[k];
            // A ray within a side of the box gives NaN, which max and min pass over: it is taken to touch the
            // box.
            enter = enter.max(low.min(high));
            leave = leave.min(low.max(high));
        }
        // Rounding must not lose a box as thin as a wall.
        (enter <= leave + 1e-9 * leave.abs()).then_some(enter)
    }
}

/// Distance along the ray to a triangle, its edges included.
fn meets([a, b, c]: &Triangle, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
    let (ab, ac) = (minus(*b, *a), minus(*c, *a));
    let p = cross(direction, ac);
    let scale = dot(ab, p).recip();
    let from_a = minus(origin, *a);
    let u = dot(from_a, p) * scale;
    let q = cross(from_a, ab);
    let v = dot(direction, q) * scale;
    let range_m = dot(ac, q) * scale;
    // False for NaN, so a ray within the triangle's plane meets nothing.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && range_m > 0.0 && range_m.is_finite()).then_some(range_m)
}

#[cfg(test)]
mod tests {
    use super::{Hit, Surface, meets};
    use crate::model::Mesh;
    use crate::reconstruct::planes::paper::random::Random;

    #[test]
    fn a_ray_meets_the_nearest_of_two_walls_from_either_side() {
        let wall = |y: f32| [[-1.0, y, -1.0], [1.0, y, -1.0], [0.0, y, 2.0]];
        let vertices_m = wall(5.0).into_iter().chain(wall(2.0)).collect();
        let surface = Surface::new(&Mesh { vertices_m, triangles: vec![[0, 1, 2], [3, 4, 5]] });
        let ahead = [0.0, 1.0, 0.0];
        assert_eq!(surface.cast([0.0; 3], ahead, 9.0), Some(Hit { range_m: 2.0, triangle: 1 }));
        assert_eq!(surface.cast([0.0; 3], ahead, 2.0), None);
        assert_eq!(
            surface.cast([0.0, 7.0, 0.0], [0.0, -1.0, 0.0], 9.0),
            Some(Hit { range_m: 2.0, triangle: 0 })
        );
        assert_eq!(surface.cast([0.0; 3], [1.0, 0.0, 0.0], 9.0), None);
        assert_eq!(Surface::default().cast([0.0; 3], ahead, 9.0), None);
    }

    #[test]
    fn rays_agree_with_trying_every_triangle() {
        let mut random = Random::new(5);
        let mut point = || -> [f64; 3] { std::array::from_fn(|_| 4.0 * random.unit()) };
        let vertices_m: Vec<[f32; 3]> = (0..180).map(|_| point().map(|v| v as f32)).collect();
        let mesh = Mesh { vertices_m, triangles: (0..60).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect() };
        let surface = Surface::new(&mesh);
        let mut hits = 0;
        for _ in 0..300 {
            let (from, to) = (point(), point());
            let way = [0, 1, 2].map(|k| to[k] - from[k]);
            let length = way.iter().map(|v| v * v).sum::<f64>().sqrt();
            let direction = way.map(|v| v / length);
            let corners = |t: &[u32; 3]| t.map(|k| mesh.vertices_m[k as usize].map(f64::from));
            let nearest = mesh
                .triangles
                .iter()
                .filter_map(|t| meets(&corners(t), from, direction))
                .fold(f64::INFINITY, f64::min);
            let found = surface.cast(from, direction, 100.0).map_or(f64::INFINITY, |hit| hit.range_m);
            assert_eq!(found, nearest);
            hits += usize::from(found.is_finite());
        }
        assert!(hits > 100, "{hits}");
    }
}
