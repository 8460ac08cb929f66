//! What a picture shows: coloured triangles and the lines along the borders of flat surfaces. Frame `map`, metres.

use std::collections::BTreeMap;

use super::vector::{Vec3, cross, sub, unit};
use crate::model::Mesh;
use crate::palette::Rgb;

/// One triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Its corners, counter-clockwise seen from the side that the sensor was on.
    pub corners_m: [Vec3; 3],
    /// Its unit normal.
    pub normal: Vec3,
    /// Its own colour, before light.
    pub color: Rgb,
}

/// Triangles and lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The triangles.
    pub facets: Vec<Facet>,
    /// Lines on top of them.
    pub lines_m: Vec<[Vec3; 2]>,
    /// For each line the normal of the surface that it borders.
    pub line_normals: Vec<Vec3>,
}

impl Scene {
    /// Adds the triangles of a mesh, each in the colour of its number.
    pub fn add_mesh(&mut self, mesh: &Mesh, color: impl Fn(usize) -> Rgb) {
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let Some(corners_m) = corners(mesh, triangle) else { continue };
            let normal = unit(cross(sub(corners_m[1], corners_m[0]), sub(corners_m[2], corners_m[0])));
            self.facets.push(Facet { corners_m, normal, color: color(index) });
        }
    }

    /// Adds a line along each edge that only one triangle of its group has: the borders of flat surfaces. Triangles whose
    /// group is `None` get no lines.
    pub fn add_borders(&mut self, mesh: &Mesh, group: impl Fn(usize) -> Option<i64>) {
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
            let normal = unit(cross(sub(corners_m[1], corners_m[0]), sub(corners_m[2], corners_m[0])));
            self.lines_m.push([a, b].map(|corner| corner.map(|bits| f64::from(f32::from_bits(bits)))));
            self.line_normals.push(normal);
        }
    }

    /// All corners.
    pub fn points_m(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.facets.iter().flat_map(|facet| facet.corners_m)
    }
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
    use crate::export::sample;

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
