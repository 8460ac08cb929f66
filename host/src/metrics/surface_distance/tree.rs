//! A tree of boxes over triangles that finds the nearest one to a point; `cast` finds the first along a ray.
//! Meters.

use crate::model::Mesh;
use biplane_geometry::vec3::{dot, minus};

pub(crate) type Triangle = [[f64; 3]; 3];

/// The triangles of a mesh, ready to be asked for distances.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// In the order of the tree's leaves, each with its index in the mesh.
    pub(crate) triangles: Vec<(Triangle, usize)>,
    pub(crate) nodes: Vec<Node>,
}

#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) low_m: [f64; 3],
    pub(crate) high_m: [f64; 3],
    pub(crate) content: Content,
}

#[derive(Clone, Debug)]
pub(crate) enum Content {
    /// Triangles `start..end`.
    Leaf(usize, usize),
    /// The second child's node; the first one follows its parent.
    Split(usize),
}

const LEAF_SIZE: usize = 4;

impl Surface {
    /// Builds the tree; triangles with missing corners or corners that are not finite are left out.
    pub fn new(mesh: &Mesh) -> Self {
        let all = mesh.triangles.iter().enumerate();
        let triangles: Vec<_> =
            all.filter_map(|(index, t)| corners(mesh, *t).map(|found| (found, index))).collect();
        let mut surface = Self { triangles, nodes: Vec::new() };
        if !surface.triangles.is_empty() {
            surface.split(0, surface.triangles.len());
        }
        surface
    }

    fn split(&mut self, start: usize, end: usize) -> usize {
        let own = &mut self.triangles[start..end];
        let mut low_m = [f64::INFINITY; 3];
        let mut high_m = [f64::NEG_INFINITY; 3];
        for p in own.iter().flat_map(|(triangle, _)| triangle) {
            for k in 0..3 {
                low_m[k] = low_m[k].min(p[k]);
                high_m[k] = high_m[k].max(p[k]);
            }
        }
        let node = self.nodes.len();
        self.nodes.push(Node { low_m, high_m, content: Content::Leaf(start, end) });
        if own.len() > LEAF_SIZE {
            let longest = (0..3)
                .fold(0, |best, k| if high_m[k] - low_m[k] > high_m[best] - low_m[best] { k } else { best });
            let center = |(t, _): &(Triangle, usize)| t[0][longest] + t[1][longest] + t[2][longest];
            let half = own.len() / 2;
            own.select_nth_unstable_by(half, |a, b| center(a).total_cmp(&center(b)));
            self.split(start, start + half);
            let second = self.split(start + half, end);
            self.nodes[node].content = Content::Split(second);
        }
        node
    }

    /// Distance from a point to the nearest triangle, meters; infinite without triangles or for a point that
    /// is not finite.
    pub fn distance_m(&self, p: [f64; 3]) -> f64 {
        let mut best2 = f64::INFINITY;
        let mut open = Vec::with_capacity(64);
        open.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(node) = open.pop() {
            let here = &self.nodes[node];
            if here.distance2(p) >= best2 {
                continue;
            }
            match here.content {
                Content::Leaf(start, end) => {
                    let near = self.triangles[start..end].iter().map(|(t, _)| triangle_distance2(t, p));
                    best2 = near.fold(best2, f64::min);
                }
                Content::Split(second) => {
                    let first = node + 1;
                    let first_is_nearer = self.nodes[first].distance2(p) <= self.nodes[second].distance2(p);
                    open.extend(if first_is_nearer { [second, first] } else { [first, second] });
                }
            }
        }
        best2.sqrt()
    }
}

impl Node {
    fn distance2(&self, p: [f64; 3]) -> f64 {
        let outside = |k: usize| (self.low_m[k] - p[k]).max(p[k] - self.high_m[k]).max(0.0);
        (0..3).map(|k| outside(k).powi(2)).sum()
    }
}

/// Squared distance from a point to a triangle (Ericson, "Real-Time Collision Detection", 5.1.5: by the
/// regions of the triangle).
fn triangle_distance2([a, b, c]: &Triangle, p: [f64; 3]) -> f64 {
    let (ab, ac, ap) = (minus(*b, *a), minus(*c, *a), minus(p, *a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return dot(ap, ap);
    }
    let bp = minus(p, *b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return dot(bp, bp);
    }
    let cp = minus(p, *c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return dot(cp, cp);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return off_edge2(ap, ab, d1 / (d1 - d3));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return off_edge2(ap, ac, d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return off_edge2(bp, minus(*c, *b), (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = (va + vb + vc).recip();
    let (v, w) = (vb * scale, vc * scale);
    let off: [f64; 3] = std::array::from_fn(|k| ap[k] - v * ab[k] - w * ac[k]);
    dot(off, off)
}

fn off_edge2(from_start: [f64; 3], edge: [f64; 3], share: f64) -> f64 {
    let off: [f64; 3] = std::array::from_fn(|k| from_start[k] - share * edge[k]);
    dot(off, off)
}

/// Corners of a triangle; `None` when one is missing or not finite.
pub(crate) fn corners(mesh: &Mesh, triangle: [u32; 3]) -> Option<[[f64; 3]; 3]> {
    let mut found = [[0.0; 3]; 3];
    for (slot, corner) in found.iter_mut().zip(triangle) {
        let p = mesh.vertices_m.get(corner as usize)?.map(f64::from);
        if !p.iter().all(|v| v.is_finite()) {
            return None;
        }
        *slot = p;
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::triangle_distance2;

    #[test]
    fn each_region_of_a_triangle_has_its_own_nearest_point() {
        let t = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let cases = [
            ([0.5, 0.5, 3.0], 9.0),
            ([-3.0, -4.0, 0.0], 25.0),
            ([5.0, -4.0, 0.0], 25.0),
            ([-4.0, 5.0, 0.0], 25.0),
            ([1.0, -2.0, 0.0], 4.0),
            ([-2.0, 1.0, 0.0], 4.0),
            ([2.0, 2.0, 0.0], 2.0),
        ];
        for (p, distance2) in cases {
            assert!((triangle_distance2(&t, p) - distance2).abs() < 1e-12, "{p:?}");
        }
    }
}
