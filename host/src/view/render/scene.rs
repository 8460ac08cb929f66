//! What a picture shows: colored triangles and the lines along the borders of flat surfaces. Frame `map`,
//! meters.

use biplane_geometry::polygon_area::doubled_triangle_normal;
use biplane_geometry::vec3::{plus, scaled, unit};
use std::collections::BTreeMap;

use super::vector::Vec3;
use crate::model::Mesh;
use crate::model::palette::Rgb;

/// One triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facet {
    /// Its corners, counter-clockwise seen from the side that the sensor was on.
    pub corners_m: [Vec3; 3],
    /// Its unit normal.
    pub normal: Vec3,
    /// Which way the surface around it faces; decides whether it turns its back.
    pub facing: Vec3,
    /// Its own color, before light.
    pub color: Rgb,
}

/// Triangles and lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Scene {
    /// The triangles.
    pub facets: Vec<Facet>,
    /// Lines on top of them.
    pub lines_m: Vec<[Vec3; 2]>,
    /// For each line the normal of the surface that it borders.
    pub line_normals: Vec<Vec3>,
}

/// A noisy mesh faces where its triangles face after so many rounds of averaging with their neighbors.
const SMOOTHING_ROUNDS: usize = 6;

impl Scene {
    /// Adds the triangles of a clean mesh, each in the color of its number.
    pub(crate) fn add_mesh(&mut self, mesh: &Mesh, color: impl Fn(usize) -> Rgb) {
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let Some(corners_m) = corners(mesh, triangle) else { continue };
            let normal = unit(doubled_triangle_normal(corners_m));
            self.facets.push(Facet { corners_m, normal, facing: normal, color: color(index) });
        }
    }

    /// Adds the triangles of a noisy mesh in one color. Each has the light of its own normal, but turns its
    /// back together with its neighbors.
    pub(crate) fn add_noisy_mesh(&mut self, mesh: &Mesh, color: Rgb) {
        let facing = smoothed_normals(mesh);
        self.facets.reserve_exact(mesh.triangles.len());
        for (triangle, facing) in mesh.triangles.iter().zip(facing) {
            let Some(corners_m) = corners(mesh, triangle) else { continue };
            self.facets.push(Facet {
                corners_m,
                normal: unit(doubled_triangle_normal(corners_m)),
                facing,
                color,
            });
        }
    }

    /// Adds a line along each edge that only one triangle of its group has: the borders of flat surfaces.
    /// Triangles whose group is `None` get no lines.
    pub(crate) fn add_borders(&mut self, mesh: &Mesh, group: impl Fn(usize) -> Option<i64>) {
        type Corner = [u32; 3];
        let mut edges: BTreeMap<(i64, Corner, Corner), (u32, usize)> = BTreeMap::new();
        let key = |index: u32| mesh.vertices_m.get(index as usize).map(|point| point.map(f32::to_bits));
        for (number, triangle) in mesh.triangles.iter().enumerate() {
            let Some(group) = group(number) else { continue };
            for side in 0..3 {
                if let (Some(a), Some(b)) = (key(triangle[side]), key(triangle[(side + 1) % 3])) {
                    edges.entry((group, a.min(b), a.max(b))).or_insert((0, number)).0 += 1;
                }
            }
        }
        for ((_, a, b), (_, number)) in edges.into_iter().filter(|(_, (uses, _))| *uses == 1) {
            let Some(corners_m) = corners(mesh, &mesh.triangles[number]) else { continue };
            let normal = unit(doubled_triangle_normal(corners_m));
            self.lines_m.push([a, b].map(|corner| corner.map(|bits| f64::from(f32::from_bits(bits)))));
            self.line_normals.push(normal);
        }
    }
}

/// For each triangle the direction that the mesh around it faces.
fn smoothed_normals(mesh: &Mesh) -> Vec<Vec3> {
    let own = |triangle| corners(mesh, triangle).map_or([0.0; 3], doubled_triangle_normal);
    let mut facing: Vec<Vec3> = mesh.triangles.iter().map(own).collect();
    let mut at_vertices = vec![[0.0; 3]; mesh.vertices_m.len()];
    for _ in 0..SMOOTHING_ROUNDS {
        at_vertices.fill([0.0; 3]);
        for (triangle, normal) in mesh.triangles.iter().zip(&facing) {
            for &corner in triangle {
                if let Some(sum) = at_vertices.get_mut(corner as usize) {
                    *sum = plus(*sum, *normal);
                }
            }
        }
        let at = |corner: u32| at_vertices.get(corner as usize).copied().unwrap_or_default();
        for (triangle, normal) in mesh.triangles.iter().zip(&mut facing) {
            *normal = scaled(plus(plus(at(triangle[0]), at(triangle[1])), at(triangle[2])), 1.0 / 9.0);
        }
    }
    facing
}

fn corners(mesh: &Mesh, triangle: &[u32; 3]) -> Option<[Vec3; 3]> {
    let corner = |index: u32| {
        let point = mesh.vertices_m.get(index as usize)?.map(f64::from);
        point.iter().all(|value| value.is_finite()).then_some(point)
    };
    Some([corner(triangle[0])?, corner(triangle[1])?, corner(triangle[2])?])
}

#[cfg(test)]
mod tests {
    use super::Scene;
    use crate::model::Mesh;
    use crate::model::sample;

    #[test]
    fn a_crumpled_wall_faces_one_way() {
        // A sheet in the plane y = 0 seen from negative y, with vertices shaken so much that some triangles
        // face away.
        let mut mesh = Mesh::default();
        let shake = |i: u32| if (i * 7919) % 13 < 6 { 0.06 } else { -0.06 };
        for i in 0..400 {
            let (column, row) = (i % 20, i / 20);
            mesh.vertices_m.push([column as f32 * 0.05 + 0.7 * shake(i), shake(i + 1), row as f32 * 0.05]);
            if column < 19 && row < 19 {
                mesh.triangles.extend([[i, i + 1, i + 21], [i, i + 21, i + 20]]);
            }
        }
        let mut scene = Scene::default();
        scene.add_noisy_mesh(&mesh, [0; 3]);
        assert!(scene.facets.iter().any(|facet| facet.normal[1] > 0.0));
        let away = scene.facets.iter().filter(|facet| facet.facing[1] >= 0.0).count();
        assert!(away == 0, "{away} of {}", scene.facets.len());
    }

    #[test]
    fn lines_run_around_surfaces_and_their_windows_only() {
        let model = sample::model();
        let mut scene = Scene::default();
        for face in sample::faces(&model) {
            scene.add_mesh(&face, |_| [1, 2, 3]);
            scene.add_borders(&face, |_| Some(0));
        }
        assert_eq!(scene.facets.len(), 8 + 2);
        // Wall: four sides and four of its window; floor: four sides, its diagonal is none.
        assert_eq!(scene.lines_m.len(), 8 + 4);
        assert!(scene.line_normals[..8].iter().all(|normal| normal[1].abs() > 0.99));
        assert_eq!(scene.facets[9].normal, [0.0, 0.0, 1.0]);
    }
}
