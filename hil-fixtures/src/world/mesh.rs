//! Surfaces of a world: triangles, each with the label of the plane that it belongs to.
//!
//! A label names one flat surface: all faces of a wall share it, whatever holes it has. Curved things and
//! foliage have [`NO_PLANE`]. Meters; the frame is the owner's.

use crate::world::pose::Pose;
use crate::world::vec3::Vec3;
use std::ops::Range;

/// Label of faces that belong to no plane.
pub const NO_PLANE: i32 = -1;

/// Triangles with labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabeledMesh {
    /// Corners.
    pub vertices_m: Vec<Vec3>,
    /// Indices of three corners a face.
    pub faces: Vec<[u32; 3]>,
    /// Plane label a face: 0 and up, or [`NO_PLANE`].
    pub planes: Vec<i32>,
}

/// A named part of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Object {
    /// Its name in the file.
    pub name: String,
    /// Its faces.
    pub faces: Range<usize>,
}

impl LabeledMesh {
    /// Adds a corner and gives its index.
    pub fn vertex(&mut self, at: Vec3) -> u32 {
        self.vertices_m.push(at);
        (self.vertices_m.len() - 1) as u32
    }

    /// Adds a face.
    pub fn face(&mut self, corners: [u32; 3], plane: i32) {
        self.faces.push(corners);
        self.planes.push(plane);
    }

    /// The corners of face `index`.
    #[must_use]
    pub fn corners(&self, index: usize) -> [Vec3; 3] {
        self.faces[index].map(|i| self.vertices_m[i as usize])
    }

    /// The same surfaces without the faces of some objects.
    #[must_use]
    pub fn without<'a>(&self, objects: impl IntoIterator<Item = &'a Object>) -> Self {
        let mut kept = vec![true; self.faces.len()];
        for face in objects.into_iter().flat_map(|object| object.faces.clone()) {
            kept[face] = false;
        }
        let pairs = self.faces.iter().zip(&self.planes).zip(kept).filter(|(_, kept)| *kept);
        let (faces, planes) = pairs.map(|((face, plane), _)| (*face, *plane)).unzip();
        Self { vertices_m: self.vertices_m.clone(), faces, planes }
    }

    /// The same surfaces in another frame.
    #[must_use]
    pub fn moved(&self, a_from_b: &Pose) -> Self {
        let vertices_m = self.vertices_m.iter().map(|v| a_from_b.apply(*v)).collect();
        Self { vertices_m, ..self.clone() }
    }

    /// Lowest and highest coordinates; zeros when there are no vertices.
    #[must_use]
    pub fn bounds(&self) -> [Vec3; 2] {
        let Some(first) = self.vertices_m.first() else { return [[0.0; 3]; 2] };
        self.vertices_m.iter().fold([*first; 2], |[low, high], v| {
            [[0, 1, 2].map(|i| low[i].min(v[i])), [0, 1, 2].map(|i| high[i].max(v[i]))]
        })
    }

    /// How many different planes there are.
    #[must_use]
    pub fn plane_count(&self) -> usize {
        let mut labels: Vec<i32> = self.planes.iter().copied().filter(|label| *label != NO_PLANE).collect();
        labels.sort_unstable();
        labels.dedup();
        labels.len()
    }
}
