//! Wavefront OBJ that keeps polygons: one face a polygon, vertices shared between faces, `map` axes, meters.
//!
//! An OBJ face has one ring, so a polygon with holes is written as one ring with cuts of no width
//! (`export::keyhole`); the rare one that cannot be cut so is written as triangles. Source: the OBJ format
//! appendix of Wavefront's Advanced Visualizer manual.

use std::io::{self, Write};

use super::keyhole;
use super::welded::WeldedVertices;
use crate::formats::input::shift::restored;
use crate::formats::{Shapes, description};
use crate::model::palette::Orientation;
use crate::model::{Mesh, PlanarPolygon, Plane};

/// Corners closer than this are one vertex, meters; also the last decimal that is written.
const STEP_M: f64 = 1e-4;

struct Group {
    name: String,
    /// Index of the normal, from 1.
    normal: Option<usize>,
    faces: Vec<Vec<usize>>,
}

/// Writes the model as OBJ.
///
/// # Errors
/// When writing fails.
pub fn write(out: &mut impl Write, shapes: &Shapes<'_>) -> io::Result<()> {
    let mut vertices = WeldedVertices::new(STEP_M);
    let mut groups = Vec::new();
    for (index, polygons) in shapes.polygons_by_plane().iter().enumerate() {
        let plane = &shapes.model.planes[index];
        let of = |index: &usize| (&shapes.model.polygons[*index], &shapes.faces[*index]);
        let faces = polygons.iter().map(of);
        let faces: Vec<Vec<usize>> =
            faces.flat_map(|(polygon, face)| faces_of(polygon, plane, face, &mut vertices)).collect();
        if !faces.is_empty() {
            let name = format!("plane_{index}_{}", Orientation::of(plane).name());
            groups.push(Group { name, normal: Some(index + 1), faces });
        }
    }
    for (index, (round, mesh)) in shapes.model.cylinders.iter().zip(&shapes.rounds).enumerate() {
        let name = format!("{}_{index}", round.kind.name());
        groups.push(Group { name, normal: None, faces: triangles(mesh, &mut vertices) });
    }
    let leftovers = triangles(&shapes.model.leftovers, &mut vertices);
    if !leftovers.is_empty() {
        groups.push(Group { name: "leftovers".to_owned(), normal: None, faces: leftovers });
    }

    let planes = shapes.model.planes.len();
    for (index, surface) in shapes.model.inferred.iter().enumerate() {
        let faces = faces_of(&surface.polygon(), &surface.plane(), &shapes.inferred[index], &mut vertices);
        if !faces.is_empty() {
            let name = surface.name().replace([' ', '(', ')'], "_");
            let name = name.trim_end_matches('_').replace("__", "_");
            groups.push(Group { name, normal: Some(planes + index + 1), faces });
        }
    }

    writeln!(out, "# {}", description(shapes))?;
    writeln!(out, "# one face a polygon; a polygon with holes is one ring with cuts of no width")?;
    for position_m in vertices.positions_m() {
        let [x, y, z] = restored(position_m, shapes.shift_m);
        writeln!(out, "v {x:.4} {y:.4} {z:.4}")?;
    }
    let of_planes = shapes.model.planes.iter().map(|plane| plane.normal);
    for normal in of_planes.chain(shapes.model.inferred.iter().map(|surface| surface.normal)) {
        let [x, y, z] = normal;
        writeln!(out, "vn {x:.6} {y:.6} {z:.6}")?;
    }
    groups.iter().try_for_each(|group| write_group(out, group))
}

fn faces_of(
    polygon: &PlanarPolygon,
    plane: &Plane,
    face: &Mesh,
    vertices: &mut WeldedVertices,
) -> Vec<Vec<usize>> {
    match keyhole::single_ring(polygon, plane.normal) {
        Some(ring) => Some(vertices.ring(&ring)).filter(|ring| !ring.is_empty()).into_iter().collect(),
        None => triangles(face, vertices),
    }
}

fn triangles(mesh: &Mesh, vertices: &mut WeldedVertices) -> Vec<Vec<usize>> {
    let corner = |index: u32| mesh.vertices_m.get(index as usize).map(|point| point.map(f64::from));
    let mut faces = Vec::new();
    for corners in &mesh.triangles {
        let points: Vec<[f64; 3]> = corners.iter().filter_map(|&index| corner(index)).collect();
        faces.push(vertices.ring(&points));
    }
    faces.retain(|face| !face.is_empty());
    faces
}

fn write_group(out: &mut impl Write, group: &Group) -> io::Result<()> {
    writeln!(out, "o {}", group.name)?;
    for face in &group.faces {
        write!(out, "f")?;
        for vertex in face {
            match group.normal {
                Some(normal) => write!(out, " {}//{normal}", vertex + 1)?,
                None => write!(out, " {}", vertex + 1)?,
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::write;
    use crate::formats::Shapes;
    use crate::model::{Model, sample};

    #[test]
    fn each_polygon_is_a_face_over_shared_vertices() {
        let model = Model { inferred: vec![sample::inferred()], ..sample::model() };
        let mut bytes = Vec::new();
        write(&mut bytes, &Shapes { faces: sample::faces(&model), ..Shapes::new(&model) }).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let vertices: Vec<[f64; 3]> = text
            .lines()
            .filter_map(|line| line.strip_prefix("v "))
            .map(|line| {
                let values: Vec<f64> = line.split(' ').map(|value| value.parse().unwrap()).collect();
                values.try_into().unwrap()
            })
            .collect();
        // Two corners of the floor are corners of the wall.
        assert_eq!(vertices.len(), 8 + 2 + 3 + 4);
        let face = |line: &str| -> Vec<[f64; 3]> {
            let corners = line.split(' ').skip(1);
            corners
                .map(|corner| vertices[corner.split('/').next().unwrap().parse::<usize>().unwrap() - 1])
                .collect()
        };
        let faces: Vec<Vec<[f64; 3]>> =
            text.lines().filter(|line| line.starts_with("f ")).map(face).collect();
        let corners: Vec<usize> = faces.iter().map(Vec::len).collect();
        assert_eq!(corners, [4 + 4 + 2, 4, 3, 4]);
        // The wall faces -y: seen from there its ring runs counter-clockwise, around 12 - 1 square meters.
        let ring = &faces[0];
        let twice: f64 = (0..ring.len())
            .map(|i| (ring[i], ring[(i + 1) % ring.len()]))
            .map(|(p, q)| p[0] * q[2] - q[0] * p[2])
            .sum();
        assert!((twice / 2.0 - 11.0).abs() < 1e-9);
        let objects: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("o ")).collect();
        assert_eq!(objects, ["plane_0_wall", "plane_1_floor", "leftovers", "S1-W01_wall_base_inferred"]);
        assert!(text.contains("vn 0.000000 -1.000000 0.000000\n"));
    }
}
