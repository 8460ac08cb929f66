//! Which raw triangles are no surface at all: gaps behind edges, mixed pixels, spikes of single points, steps
//! nobody saw.
//!
//! A raw mesh joins what is close, whatever lies between. What joins a near surface to one behind it was
//! never seen. Frame `map`, meters. Source: the paper, section 2.3 ("to avoid closing holes such as
//! doorways").

use crate::model::{Cloud, Mesh};
use crate::reconstruct::planes::reject::mixed_pixel_planes::next_beam;
use crate::reconstruct::polygons::params::PolygonParams;
use crate::reconstruct::polygons::triangles::sliver_planes::SLIVER;
use biplane_geometry::PortableMath;
use biplane_geometry::UnionFind;
use biplane_geometry::vec3::distance as distance_m;
use biplane_geometry::vec3::dot;

/// Tells gaps from surfaces.
pub(crate) struct JumpEdges<'a> {
    params: &'a PolygonParams,
    cloud: &'a Cloud,
    labels: &'a [i32],
    /// Whether a point is on no plane and has hardly any neighbor of its kind, or was on one that turned out
    /// to be none.
    spikes: Vec<bool>,
}

impl<'a> JumpEdges<'a> {
    /// Looks at all points of a mesh, whose planes (or -1) are `labels`.
    pub(crate) fn new(params: &'a PolygonParams, cloud: &'a Cloud, mesh: &Mesh, labels: &'a [i32]) -> Self {
        Self { params, cloud, labels, spikes: spikes(mesh, labels, params.min_structure_points) }
    }

    /// Whether a triangle across a border hangs on a mixed pixel or runs along the beam.
    pub(crate) fn is_jump_edge(&self, corners: [usize; 3]) -> bool {
        corners.iter().any(|corner| self.is_mixed(*corner)) || self.runs_along_beam(corners)
    }

    /// Whether a triangle that could not be laid on planes shows nothing: it joins planes that do not meet
    /// here, or hangs on a spike.
    pub(crate) fn is_open(&self, corners: [usize; 3]) -> bool {
        corners.iter().all(|corner| self.labels[*corner] >= 0)
            || corners.iter().any(|corner| self.spikes[*corner])
    }

    /// Whether a point on no plane lies between the ranges of its neighboring beams, which both met a plane:
    /// the beam met an edge.
    fn is_mixed(&self, point: usize) -> bool {
        if self.labels[point] >= 0 {
            return false;
        }
        let range_of = |other: usize| {
            let beside = next_beam(self.cloud, point, other) && self.labels[other] >= 0;
            beside.then(|| self.range_m(other)).flatten()
        };
        let Some(own) = self.range_m(point) else { return false };
        match (range_of(point.wrapping_sub(1)), range_of(point + 1)) {
            (Some(before), Some(after)) => (before - own) * (own - after) > 0.0,
            _ => false,
        }
    }

    fn range_m(&self, point: usize) -> Option<f64> {
        let origin = self.cloud.origin_of(point)?.map(f64::from);
        Some(distance_m(self.cloud.points_m[point].map(f64::from), origin))
    }

    /// Whether an edge of the triangle runs along the beam over a longer stretch.
    fn runs_along_beam(&self, corners: [usize; 3]) -> bool {
        let max_sine = self.params.veil_angle_deg.to_radians().portable_sin();
        [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (corners[i], corners[j])).into_iter().any(|(from, to)| {
            let Some(origin) = self.cloud.origin_of(from) else { return false };
            let [p, q] = [from, to].map(|corner| self.cloud.points_m[corner].map(f64::from));
            let edge: [f64; 3] = std::array::from_fn(|k| q[k] - p[k]);
            let beam: [f64; 3] = std::array::from_fn(|k| p[k] - f64::from(origin[k]));
            let (edge2, beam2, along) = (dot(edge, edge), dot(beam, beam), dot(edge, beam));
            let sine2 = 1.0 - along * along / (edge2 * beam2);
            edge2 >= self.params.veil_length_m.powi(2) && sine2 <= max_sine * max_sine
        })
    }
}

/// Points on no plane that hang together in groups of fewer than `least`.
fn spikes(mesh: &Mesh, labels: &[i32], minimum: usize) -> Vec<bool> {
    let free = |point: u32| labels.get(point as usize).is_some_and(|label| *label < 0);
    let mut groups = UnionFind::new(labels.len());
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
            if free(from) && free(to) {
                groups.join(from, to);
            }
        }
    }
    let mut sizes = vec![0usize; labels.len()];
    (0..labels.len() as u32).for_each(|point| sizes[groups.root(point) as usize] += 1);
    let is_spike = |point: u32| {
        let few = sizes[groups.root(point) as usize] < minimum;
        free(point) && (few || labels[point as usize] == SLIVER)
    };
    (0..labels.len() as u32).map(is_spike).collect()
}
