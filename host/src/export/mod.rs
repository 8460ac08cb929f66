//! The model in the formats that other programs open. One file a format.
//!
//! All are in `map` axes (z up) and metres but glTF, whose root node turns to its own axes (y up). The same model gives the same bytes.

pub mod cityjson;
pub mod dxf;
pub mod gltf;
pub mod ifc;
mod keyhole;
#[cfg(feature = "las")]
pub mod las;
pub mod lod;
mod number;
pub mod obj;
pub mod ply;
mod welded;

use std::path::Path;

use rayon::prelude::*;

use crate::model::{Mesh, Model, PlanarPolygon, Plane};
use crate::triangulate::triangulate;

/// A model with its polygons cut into triangles, as most formats want them.
#[derive(Clone, Debug)]
pub struct Shapes<'a> {
    /// The model.
    pub model: &'a Model,
    /// The triangles of each polygon, in the order of the polygons, wound as the polygon is.
    pub faces: Vec<Mesh>,
    /// What is added to every coordinate that is written, metres: models far from zero are kept near it ([`crate::shift`]).
    pub shift_m: [f64; 3],
    /// What the model was made of: names of files, without folders.
    pub source: String,
}

impl<'a> Shapes<'a> {
    /// Cuts the polygons of a model.
    pub fn new(model: &'a Model) -> Self {
        let cut = |polygon: &PlanarPolygon| {
            let flat =
                model.planes.get(polygon.plane).map(|plane| triangulate(plane, polygon)).unwrap_or_default();
            Mesh {
                vertices_m: flat.vertices_m.iter().map(|point| point.map(|value| value as f32)).collect(),
                triangles: flat.triangles,
            }
        };
        Self {
            model,
            faces: model.polygons.par_iter().map(cut).collect(),
            shift_m: [0.0; 3],
            source: String::new(),
        }
    }

    /// A plane's offset where the model is written, metres.
    fn offset_m(&self, plane: &Plane) -> f64 {
        plane.offset_m + self.shift_m.iter().zip(plane.normal).map(|(s, n)| s * n).sum::<f64>()
    }

    /// Triangles of the whole model, leftovers included.
    pub fn triangles(&self) -> usize {
        self.faces.iter().map(|face| face.triangles.len()).sum::<usize>()
            + self.model.leftovers.triangles.len()
    }

    /// The indices of the polygons of each plane, in the order of the planes.
    fn polygons_by_plane(&self) -> Vec<Vec<usize>> {
        let mut by_plane = vec![Vec::new(); self.model.planes.len()];
        for (index, polygon) in self.model.polygons.iter().enumerate() {
            if let Some(polygons) = by_plane.get_mut(polygon.plane) {
                polygons.push(index);
            }
        }
        by_plane
    }
}

/// What a file says of itself.
fn generator() -> String {
    format!("biplane {}", env!("CARGO_PKG_VERSION"))
}

/// The name by which files tell what they were made of: a file's name without folders, in printable ASCII, because headers hold no more.
pub fn source_name(path: &Path) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    name.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '_' }).collect()
}

/// What a file of the model says of itself in one line: program, source, frame, unit.
fn description(shapes: &Shapes<'_>) -> String {
    let source = if shapes.source.is_empty() { String::new() } else { format!(" from {}", shapes.source) };
    format!("{}{source}: frame map (z up), metres", generator())
}

/// Adds a mesh's vertices and triangles to lists that hold others already.
fn append(mesh: &Mesh, vertices_m: &mut Vec<[f32; 3]>, triangles: &mut Vec<[u32; 3]>) {
    let first = vertices_m.len() as u32;
    vertices_m.extend_from_slice(&mesh.vertices_m);
    triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
}

/// Area of a mesh, square metres.
pub(crate) fn area_m2(mesh: &Mesh) -> f64 {
    mesh.triangles.iter().map(|triangle| triangle_area_m2(mesh, triangle)).sum()
}

/// Area of a triangle of a mesh, square metres.
pub(crate) fn triangle_area_m2(mesh: &Mesh, triangle: &[u32; 3]) -> f64 {
    let corner = |index: u32| mesh.vertices_m.get(index as usize).map_or([0.0; 3], |p| p.map(f64::from));
    let [a, b, c] = triangle.map(corner);
    let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    cross.iter().map(|value| value * value).sum::<f64>().sqrt() / 2.0
}

/// Area of a flat ring, square metres.
pub(crate) fn ring_area_m2(ring_m: &[[f64; 3]]) -> f64 {
    let Some(first) = ring_m.first() else { return 0.0 };
    let from_first = |p: &[f64; 3]| [0, 1, 2].map(|k| p[k] - first[k]);
    let mut sum = [0.0; 3];
    for pair in ring_m.windows(2) {
        let (u, v) = (from_first(&pair[0]), from_first(&pair[1]));
        let cross = crate::polygons::frame::cross(u, v);
        sum = [0, 1, 2].map(|k| sum[k] + cross[k]);
    }
    sum.iter().map(|value| value * value).sum::<f64>().sqrt() / 2.0
}

/// A small model for the tests of the formats: a wall with a window, a floor, and one loose triangle.
#[cfg(test)]
pub(crate) mod sample {
    use crate::model::{Mesh, Model, PlanarPolygon, Plane};

    /// Wall in the plane y = 2 seen from y < 2, 4 m by 3 m with a window 1 m by 1 m; floor z = 0, 4 m by 2 m.
    pub(crate) fn model() -> Model {
        let wall = Plane { normal: [0.0, -1.0, 0.0], offset_m: -2.0, points: 900, rms_m: 0.011 };
        let floor = Plane { normal: [0.0, 0.0, 1.0], offset_m: 0.0, points: 500, rms_m: 0.009 };
        let wall_polygon = PlanarPolygon {
            plane: 0,
            outer_m: vec![[0.0, 2.0, 0.0], [4.0, 2.0, 0.0], [4.0, 2.0, 3.0], [0.0, 2.0, 3.0]],
            holes_m: vec![vec![[1.0, 2.0, 1.0], [1.0, 2.0, 2.0], [2.0, 2.0, 2.0], [2.0, 2.0, 1.0]]],
        };
        let floor_polygon = PlanarPolygon {
            plane: 1,
            outer_m: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 2.0, 0.0], [0.0, 2.0, 0.0]],
            holes_m: Vec::new(),
        };
        let leftovers = Mesh {
            vertices_m: vec![[1.0, 1.0, 0.5], [1.5, 1.0, 0.5], [1.0, 1.5, 0.75]],
            triangles: vec![[0, 1, 2]],
        };
        Model { planes: vec![wall, floor], polygons: vec![wall_polygon, floor_polygon], leftovers }
    }

    /// The sample's polygons as triangles: the wall as eight around its window, the floor as two.
    pub(crate) fn faces(model: &Model) -> Vec<Mesh> {
        let to_f32 = |ring: &[[f64; 3]]| ring.iter().map(|p| p.map(|v| v as f32)).collect::<Vec<_>>();
        let mut wall = to_f32(&model.polygons[0].outer_m);
        wall.extend(to_f32(&model.polygons[0].holes_m[0]));
        #[rustfmt::skip]
        let around = vec![[0, 1, 4], [4, 1, 7], [1, 2, 7], [7, 2, 6], [2, 3, 6], [6, 3, 5], [3, 0, 5], [5, 0, 4]];
        let floor = to_f32(&model.polygons[1].outer_m);
        vec![
            Mesh { vertices_m: wall, triangles: around },
            Mesh { vertices_m: floor, triangles: vec![[0, 1, 2], [0, 2, 3]] },
        ]
    }
}
