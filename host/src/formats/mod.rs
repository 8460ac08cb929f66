//! The model in the formats that other programs open. One file a format.
//!
//! All are in `map` axes (z up) and meters but glTF, whose root node turns to its own axes (y up). The same
//! model gives the same bytes.

pub(crate) mod cityjson;
pub(crate) mod dxf;
pub(crate) mod gltf;
pub(crate) mod ifc;
pub(crate) mod input;
#[cfg(feature = "las")]
pub(crate) mod las;
#[cfg(feature = "cli")]
pub(crate) mod mcap;
pub(crate) mod obj;
pub(crate) mod output;
pub(crate) mod ply;
pub(crate) mod text;

use std::path::Path;

use crate::formats::input::shift::restored;
use crate::model::cylinder::Cylinder;
use crate::model::turn::Turn;
use crate::model::{Mesh, Model, Plane};
use crate::reconstruct::polygons::triangulate::{faces, inferred_faces};

/// A model with its polygons cut into triangles, as most formats want them.
#[derive(Clone, Debug)]
pub struct Shapes<'a> {
    /// The model.
    pub model: &'a Model,
    /// The triangles of each polygon, in the order of the polygons, wound as the polygon is.
    pub faces: Vec<Mesh>,
    /// The smooth mesh of each round thing.
    pub rounds: Vec<Mesh>,
    /// The number by which all files name each round thing: its place among them, unless the model is a part
    /// of a larger one.
    pub round_numbers: Vec<usize>,
    /// The triangles of each inferred surface.
    pub inferred: Vec<Mesh>,
    /// What is added to every coordinate that is written, meters: models far from zero are kept near it
    /// (`crate::formats::input::shift`).
    pub shift_m: [f64; 3],
    /// By what DXF and IFC are turned before that, about the vertical axis: their users want walls along x
    /// and y.
    pub turn: Turn,
    /// What the model was made of: names of files, without folders.
    pub source: String,
}

impl<'a> Shapes<'a> {
    /// Cuts the polygons of a model.
    pub fn new(model: &'a Model) -> Self {
        let rounds: Vec<Mesh> = model.cylinders.iter().map(Cylinder::mesh).collect();
        let round_numbers = (0..rounds.len()).collect();
        Self {
            model,
            faces: faces(model),
            rounds,
            round_numbers,
            inferred: inferred_faces(model),
            shift_m: [0.0; 3],
            turn: Turn::default(),
            source: String::new(),
        }
    }

    /// A plane's offset where the model is written, meters.
    fn offset_m(&self, plane: &Plane) -> f64 {
        plane.offset_m + self.shift_m.iter().zip(plane.normal).map(|(s, n)| s * n).sum::<f64>()
    }

    /// Triangles of the whole model, leftovers and inferred surfaces included.
    pub fn triangles(&self) -> usize {
        self.faces.iter().map(|face| face.triangles.len()).sum::<usize>()
            + self.rounds.iter().chain(&self.inferred).map(|mesh| mesh.triangles.len()).sum::<usize>()
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

/// Where a model is drawn: turned, then moved, so that one far away is turned about a place near it.
#[derive(Clone, Copy, Debug)]
struct Placement {
    shift_m: [f64; 3],
    turn: Turn,
}

impl Placement {
    fn of(shapes: &Shapes<'_>) -> Self {
        Self { shift_m: shapes.shift_m, turn: shapes.turn }
    }

    /// A point of the model in the file.
    fn at(&self, point_m: [f64; 3]) -> [f64; 3] {
        restored(self.turn.apply(point_m), self.shift_m)
    }
}

/// What a file says of itself.
fn generator() -> String {
    format!("biplane {}", env!("CARGO_PKG_VERSION"))
}

/// The name by which files tell what they were made of: a file's name without folders, in printable ASCII,
/// because headers hold no more.
pub(crate) fn source_name(path: &Path) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    name.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '_' }).collect()
}

/// What a file of the model says of itself in one line: program, source, frame, unit.
fn description(shapes: &Shapes<'_>) -> String {
    let source = if shapes.source.is_empty() { String::new() } else { format!(" from {}", shapes.source) };
    let turn = &shapes.turn;
    let turned = match turn.is_none() {
        true => String::new(),
        false => format!(" turned by {:.6} degrees about z", turn.angle_rad.to_degrees()),
    };
    format!("{}{source}: frame map (z up){turned}, meters", generator())
}

/// Adds a mesh's vertices and triangles to lists that hold others already.
fn append(mesh: &Mesh, vertices_m: &mut Vec<[f32; 3]>, triangles: &mut Vec<[u32; 3]>) {
    let first = vertices_m.len() as u32;
    vertices_m.extend_from_slice(&mesh.vertices_m);
    triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
}
