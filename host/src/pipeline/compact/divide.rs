//! Large triangles in small parts, so that there are points wherever there is surface.
//!
//! A drawn wall is two triangles whose corners tell the search nothing. Edges are halved, longest first,
//! until all are short; both triangles at an edge halve it at the same place, so no gap opens. Meters.

use crate::model::Mesh;
use crate::model::area::area_m2;
use crate::reconstruct::planes::params::PlaneParams;
use biplane_geometry::polygon_area::doubled_triangle_normal;
use biplane_geometry::vec3::{distance, dot};
use std::collections::HashMap;

/// A mesh whose triangles are parts of another's.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Division {
    /// The parts. Its first vertices are those of the other mesh.
    pub mesh: Mesh,
    /// For each part the triangle it is of; ascending.
    pub parent: Vec<u32>,
    /// Longest edge of a part, meters.
    pub edge_m: f64,
}

impl Division {
    /// What the search looks for among the points of the parts: where these lie further apart than usual,
    /// over larger cells.
    pub(super) fn search(&self, params: &PlaneParams) -> PlaneParams {
        if self.edge_m <= EDGE_M {
            return params.clone();
        }
        let cell_m = params.cell_m.or(Some(CELL_EDGES * self.edge_m));
        PlaneParams { cell_m, delta_m: params.delta_m.max(DELTA_EDGES * self.edge_m), ..params.clone() }
    }
}

/// Points further apart than this are not of one surface for the search (its delta): triangles with longer
/// edges hide what they cover.
const LARGE_M: f64 = 0.3;
/// A mesh is divided when triangles with longer edges than that make up this share of its area, and it is
/// drawn. Scanned meshes have such triangles across gaps and far away, and must not get points there.
const LARGE_SHARE: f64 = 0.5;
/// A mesh is drawn when this share of the area of those triangles lies in one plane with a neighbor, as the
/// two halves of a drawn wall do. In scanned meshes noise turns each triangle its own way. By area: the
/// leaves of one drawn tree are more than the walls of a house.
const LEVEL_SHARE: f64 = 0.5;
/// Triangles are in one plane when their normals differ by less than 0.2 degrees (cosine).
const LEVEL_COSINE: f64 = 0.999994;
/// Longest edge of a part, meters: gives the search's cells enough points.
const EDGE_M: f64 = 0.1;
/// Parts at most, about: larger meshes get longer edges. Fewer: of a building with its grounds small surfaces
/// are missed. More: gigabytes.
const MAX_PARTS: f64 = 4e6;
/// Edge of a cell of the search over longer edges, in edges: about six points a cell, as elsewhere.
const CELL_EDGES: f64 = 1.5;
/// The search's delta over longer edges, in edges: as many as usual.
const DELTA_EDGES: f64 = 3.0;

/// A drawn mesh in parts; `None` when a mesh has points enough as it is.
pub(super) fn divide(mesh: &Mesh) -> Option<Division> {
    let area = |triangle: &[u32; 3]| {
        area_m2(&Mesh {
            vertices_m: triangle.map(|k| mesh.vertices_m[k as usize]).to_vec(),
            triangles: vec![[0, 1, 2]],
        })
    };
    let (mut all_m2, mut large_m2) = (0.0, 0.0);
    for triangle in &mesh.triangles {
        let own_m2 = area(triangle);
        all_m2 += own_m2;
        if longest(&mesh.vertices_m, *triangle).1 > LARGE_M {
            large_m2 += own_m2;
        }
    }
    if large_m2 <= LARGE_SHARE * all_m2 || !is_drawn(mesh) {
        return None;
    }
    // Halving leaves parts of about a third of a square on the longest edge.
    let edge_m = EDGE_M.max((3.0 * all_m2 / MAX_PARTS).sqrt());
    Some(halve(mesh, edge_m))
}

/// Whether large triangles lie in one plane with a neighbor as often as in a drawing.
fn is_drawn(mesh: &Mesh) -> bool {
    let face_of = |triangle: &[u32; 3]| {
        doubled_triangle_normal(triangle.map(|k| mesh.vertices_m[k as usize].map(f64::from)))
    };
    let large: Vec<[u32; 3]> =
        mesh.triangles.iter().filter(|t| longest(&mesh.vertices_m, **t).1 > LARGE_M).copied().collect();
    let faces: Vec<[f64; 3]> = large.iter().map(face_of).collect();
    let areas: Vec<f64> = faces.iter().map(|n| dot(*n, *n).sqrt()).collect();
    // One that touches no other is drawn as well: each point of a scan is a corner of several.
    let (mut level, mut alone) = (vec![false; large.len()], vec![true; large.len()]);
    let mut known: HashMap<[u32; 2], usize> = HashMap::new();
    for (index, triangle) in large.iter().enumerate() {
        for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (triangle[i], triangle[j])) {
            let Some(other) = known.insert([a.min(b), a.max(b)], index) else { continue };
            (alone[index], alone[other]) = (false, false);
            if dot(faces[index], faces[other]).abs() >= LEVEL_COSINE * areas[index] * areas[other] {
                (level[index], level[other]) = (true, true);
            }
        }
    }
    let drawn = (0..large.len()).filter(|k| level[*k] || alone[*k]);
    drawn.map(|k| areas[k]).sum::<f64>() >= LEVEL_SHARE * areas.iter().sum::<f64>()
}

fn halve(mesh: &Mesh, edge_m: f64) -> Division {
    let mut vertices_m = mesh.vertices_m.clone();
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut out = Division { edge_m, ..Division::default() };
    for (parent, triangle) in mesh.triangles.iter().enumerate() {
        let mut open = vec![*triangle];
        while let Some([a, b, c]) = open.pop() {
            let (side, length_m) = longest(&vertices_m, [a, b, c]);
            if length_m <= edge_m {
                out.mesh.triangles.push([a, b, c]);
                out.parent.push(parent as u32);
                continue;
            }
            // The corners turned so that the longest edge goes from the first to the second.
            let [from, to, tip] = [[a, b, c], [b, c, a], [c, a, b]][side];
            let middle = *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                let (p, q) = (vertices_m[from.min(to) as usize], vertices_m[from.max(to) as usize]);
                vertices_m.push(std::array::from_fn(|k| 0.5 * (p[k] + q[k])));
                vertices_m.len() as u32 - 1
            });
            open.push([middle, to, tip]);
            open.push([from, middle, tip]);
        }
    }
    out.mesh.vertices_m = vertices_m;
    out
}

/// The longest edge of a triangle: which one, counted from the edge between its first two corners, and its
/// length, meters.
fn longest(vertices_m: &[[f32; 3]], corners: [u32; 3]) -> (usize, f64) {
    let [p, q, r] = corners.map(|k| vertices_m[k as usize].map(f64::from));
    let lengths = [distance(p, q), distance(q, r), distance(r, p)];
    let side = (1..3).fold(0, |best, k| if lengths[k] > lengths[best] { k } else { best });
    (side, lengths[side])
}

#[cfg(test)]
mod tests {
    use super::divide;
    use crate::model::Mesh;
    use crate::model::area::area_m2;
    use std::collections::HashMap;

    #[test]
    fn a_drawn_wall_gets_points_and_stays_closed_and_as_large_as_it_was() {
        let wall = Mesh {
            vertices_m: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 2.5], [0.0, 0.0, 2.5]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let fine = divide(&wall).unwrap();
        assert!(fine.mesh.vertices_m.len() > 1000 && fine.mesh.vertices_m[..4] == wall.vertices_m);
        assert!((area_m2(&fine.mesh) - 10.0).abs() < 1e-4);
        assert_eq!((fine.parent.len(), fine.parent.last()), (fine.mesh.triangles.len(), Some(&1)));
        // Closed: each edge between two parts is run through once in either direction; those at the border
        // once.
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        for t in &fine.mesh.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }
        }
        let border_m: f64 = edges
            .iter()
            .filter(|edge| *edge.1 != 0)
            .map(|(edge, _)| {
                let [p, q] = edge.map(|k| fine.mesh.vertices_m[k as usize]);
                (0..3).map(|k| f64::from(p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
            })
            .sum();
        assert!((border_m - 13.0).abs() < 1e-3, "{border_m}");
    }

    #[test]
    fn a_scan_of_points_far_apart_is_no_drawing() {
        // A grid of points half a meter apart with 2 cm of noise: all triangles are large, no two are in one
        // plane.
        let mut random = crate::reconstruct::planes::paper::random::Random::new(3);
        let at = |k: u32| [0.4 * (k % 20) as f32, 0.0, 0.4 * (k / 20) as f32];
        let mut mesh = Mesh { vertices_m: (0..400).map(at).collect(), triangles: Vec::new() };
        for k in (0..379).filter(|k| k % 20 < 19) {
            mesh.triangles.extend([[k, k + 1, k + 21], [k, k + 21, k + 20]]);
        }
        assert!(divide(&mesh).is_some());
        mesh.vertices_m.iter_mut().for_each(|p| p[1] += 0.04 * random.unit() as f32);
        assert!(divide(&mesh).is_none());
    }

    #[test]
    fn a_scanned_mesh_stays_as_it_is_though_a_few_triangles_are_large() {
        let mut mesh = Mesh::default();
        for k in 0..200u8 {
            let x = 0.1 * f32::from(k);
            mesh.vertices_m.extend([[x, 0.0, 0.0], [x, 0.1, 0.0]]);
        }
        mesh.triangles = (0..398).map(|k| [k, k + 1, k + 2]).collect();
        mesh.vertices_m.push([0.0, 5.0, 0.0]);
        mesh.triangles.push([0, 1, 400]);
        assert_eq!(divide(&mesh), None);
        assert_eq!(divide(&Mesh::default()), None);
    }
}
