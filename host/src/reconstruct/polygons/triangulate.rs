//! Polygons with holes as triangles, for formats that know nothing else.
//!
//! Frame `map`, meters.

use crate::model::cylinder::Cylinder;
use crate::model::inferred::InferredSurface;
use crate::model::{Mesh, Model, PlanarPolygon, Plane};
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame};
use i_overlay::core::overlay::IntOverlayOptions;
use i_overlay::core::solver::Solver;
use i_triangle::int::triangulator::IntTriangulator;
use i_triangle::int::validation::Validation;
use rayon::prelude::*;
use std::collections::HashMap;

/// Triangles of one flat surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FlatMesh {
    /// Vertices on the plane, meters.
    pub vertices_m: Vec<[f64; 3]>,
    /// Three vertex indices a triangle, counter-clockwise seen from the normal's tip.
    pub triangles: Vec<[u32; 3]>,
}

/// Cuts a polygon into triangles. Corners that are not finite, or kilometers from the others, give an empty
/// mesh.
pub(crate) fn triangulate(plane: &Plane, polygon: &PlanarPolygon) -> FlatMesh {
    let Some(first) = polygon.outer_m.first() else { return FlatMesh::default() };
    let frame = Frame::new(plane, *first);
    let rings_m = || std::iter::once(&polygon.outer_m).chain(&polygon.holes_m);
    let shape: Option<Vec<Vec<FlatPoint>>> =
        rings_m().map(|ring| ring.iter().map(|p| frame.flat(*p)).collect()).collect();
    let Some(shape) = shape else { return FlatMesh::default() };
    // Every corner stays, those on straight edges too: they are corners of the neighbors.
    let options =
        IntOverlayOptions { preserve_input_collinear: true, ..IntOverlayOptions::keep_output_points() };
    let validation = Validation { options, ..Validation::default() };
    let cut = IntTriangulator::<i32, u32>::new(64, validation, Solver::default()).triangulate_shape(&shape);
    // Corners stay exactly where they are, as they are in the neighbors.
    let exact: HashMap<FlatPoint, [f64; 3]> =
        shape.iter().flatten().copied().zip(rings_m().flatten().copied()).collect();
    FlatMesh {
        vertices_m: cut
            .points
            .iter()
            .map(|p| exact.get(p).copied().unwrap_or_else(|| frame.lift(*p)))
            .collect(),
        triangles: cut.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

/// The triangles of each polygon of a model, in the order of the polygons, wound as the polygon is.
pub(crate) fn faces(model: &Model) -> Vec<Mesh> {
    let cut = |polygon: &PlanarPolygon| {
        let flat =
            model.planes.get(polygon.plane).map(|plane| triangulate(plane, polygon)).unwrap_or_default();
        in_floats(&flat)
    };
    model.polygons.par_iter().map(cut).collect()
}

/// The triangles of each inferred surface of a model, in their order.
pub(crate) fn inferred_faces(model: &Model) -> Vec<Mesh> {
    let cut = |surface: &InferredSurface| in_floats(&triangulate(&surface.plane(), &surface.polygon()));
    model.inferred.iter().map(cut).collect()
}

fn in_floats(flat: &FlatMesh) -> Mesh {
    Mesh {
        vertices_m: flat.vertices_m.iter().map(|point| point.map(|value| value as f32)).collect(),
        triangles: flat.triangles.clone(),
    }
}

/// All polygons of a model as one mesh, without the leftovers.
pub fn polygons_mesh(model: &Model) -> Mesh {
    let mut mesh = Mesh::default();
    for polygon in &model.polygons {
        let Some(plane) = model.planes.get(polygon.plane) else { continue };
        let flat = triangulate(plane, polygon);
        let base = mesh.vertices_m.len() as u32;
        mesh.vertices_m.extend(flat.vertices_m.iter().map(|p| p.map(|v| v as f32)));
        mesh.triangles.extend(flat.triangles.iter().map(|t| t.map(|corner| base + corner)));
    }
    mesh
}

/// The whole model as one mesh: polygons, then round things, then leftovers.
pub fn model_mesh(model: &Model) -> Mesh {
    let mut mesh = polygons_mesh(model);
    let rounds: Vec<Mesh> = model.cylinders.iter().map(Cylinder::mesh).collect();
    for part in rounds.iter().chain([&model.leftovers]) {
        let base = mesh.vertices_m.len() as u32;
        mesh.vertices_m.extend_from_slice(&part.vertices_m);
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|corner| base + corner)));
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::{model_mesh, polygons_mesh, triangulate};
    use crate::model::{Mesh, Model, PlanarPolygon, Plane};
    use biplane_geometry::vec3::cross;
    use biplane_geometry::vec3::dot;

    const WALL: Plane = Plane { normal: [0.0, -1.0, 0.0], offset_m: -1.0, points: 3, rms_m: 0.0 };

    /// A wall 4 m by 3 m with a door of 1 m by 2 m that reaches the floor only almost.
    fn wall_with_door() -> PlanarPolygon {
        let on_wall = |(x, z): &(f64, f64)| [*x, 1.0, *z];
        let outer = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)];
        let door = [(1.0, 0.1), (1.0, 2.1), (2.0, 2.1), (2.0, 0.1)];
        PlanarPolygon {
            plane: 0,
            outer_m: outer.iter().map(on_wall).collect(),
            holes_m: vec![door.iter().map(on_wall).collect()],
        }
    }

    #[test]
    fn the_triangles_cover_the_wall_without_its_door_and_face_the_sensor() {
        let flat = triangulate(&WALL, &wall_with_door());
        let mut area = 0.0;
        for t in &flat.triangles {
            let [a, b, c] = t.map(|corner| flat.vertices_m[corner as usize]);
            let side = |p: [f64; 3], q: [f64; 3]| std::array::from_fn(|k| q[k] - p[k]);
            let signed = 0.5 * dot(cross(side(a, b), side(a, c)), WALL.normal);
            assert!(signed > 0.0);
            area += signed;
        }
        assert!((area - 10.0).abs() < 1e-6);
    }

    #[test]
    fn the_mesh_of_a_model_has_its_polygons_then_its_leftovers() {
        let leftovers = Mesh { vertices_m: vec![[9.0; 3]; 3], triangles: vec![[0, 1, 2]] };
        let (planes, polygons) = (vec![WALL], vec![wall_with_door()]);
        let model = Model { planes, polygons, leftovers, ..Model::default() };
        let (flat, whole) = (polygons_mesh(&model), model_mesh(&model));
        assert_eq!(whole.triangles.len(), flat.triangles.len() + 1);
        assert_eq!(whole.vertices_m[whole.triangles.last().unwrap()[0] as usize], [9.0; 3]);
    }

    #[test]
    fn an_empty_polygon_gives_no_triangle() {
        assert!(triangulate(&WALL, &PlanarPolygon::default()).triangles.is_empty());
        let nowhere = PlanarPolygon { outer_m: vec![[f64::NAN; 3]; 3], ..PlanarPolygon::default() };
        assert!(triangulate(&WALL, &nowhere).triangles.is_empty());
    }
}
