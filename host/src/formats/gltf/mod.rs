//! glTF 2.0 in one binary file (GLB): what Blender, game engines and web viewers open.
//!
//! One mesh a plane in the plane's flat color, the leftovers as a mesh of their own. Positions are in `map`;
//! the root node turns z up to glTF's y up. Each plane's node carries its figures as `extras`. Source:
//! Khronos glTF 2.0 specification.

pub(crate) mod lod;
pub(crate) mod tileset;

use crate::model::area::area_m2;
use biplane_geometry::PortableMath;
use std::io::{self, Write};

use serde_json::{Value, json};

use super::text::shapes_json;
use super::{Shapes, append, generator};
use crate::model::inferred::InferredSurface;
use crate::model::palette;
use crate::model::palette::{Orientation, Rgb};
use crate::model::{Mesh, Plane};

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// Quarter turn about x: takes z up to y up.
const MAP_TO_GLTF_XYZW: [f64; 4] =
    [-std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2];

/// The parts of the binary chunk, and the JSON objects that point into them.
#[derive(Default)]
struct Builder {
    positions_m: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    indices: Vec<u32>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    colors: Vec<Rgb>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    /// See [`Shapes::shift_m`].
    shift_m: [f64; 3],
    /// See [`Shapes::source`].
    source: String,
}

/// Buffer views, in the order of the binary chunk.
const INDICES: u32 = 0;
const POSITIONS: u32 = 1;
const NORMALS: u32 = 2;

impl Builder {
    fn material(&mut self, color: Rgb) -> usize {
        if let Some(known) = self.colors.iter().position(|other| *other == color) {
            return known;
        }
        let [r, g, b] = color.map(linear);
        self.colors.push(color);
        self.materials.push(json!({
            "name": format!("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]),
            "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9
            }
        }));
        self.colors.len() - 1
    }

    fn accessor(&mut self, value: Value) -> usize {
        self.accessors.push(value);
        self.accessors.len() - 1
    }

    fn add_positions(&mut self, vertices_m: &[[f32; 3]]) -> usize {
        let offset = self.positions_m.len() * 12;
        self.positions_m.extend_from_slice(vertices_m);
        let fold = |pick: fn(f32, f32) -> f32, start: f32| -> [f64; 3] {
            [0, 1, 2].map(|axis| f64::from(vertices_m.iter().fold(start, |best, p| pick(best, p[axis]))))
        };
        let (min, max) = (fold(f32::min, f32::INFINITY), fold(f32::max, f32::NEG_INFINITY));
        self.accessor(json!({
            "bufferView": POSITIONS, "byteOffset": offset, "componentType": FLOAT, "count": vertices_m.len(),
            "type": "VEC3", "min": min, "max": max
        }))
    }

    fn add_normals(&mut self, normals: &[[f32; 3]], count: usize) -> usize {
        let offset = self.normals.len() * 12;
        self.normals.extend(normals.iter().cycle().take(count));
        self.accessor(json!({
            "bufferView": NORMALS, "byteOffset": offset, "componentType": FLOAT, "count": count, "type": "VEC3"
        }))
    }

    fn add_indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let offset = self.indices.len() * 4;
        self.indices.extend_from_slice(triangles.as_flattened());
        self.accessor(json!({
            "bufferView": INDICES, "byteOffset": offset, "componentType": UNSIGNED_INT,
            "count": 3 * triangles.len(), "type": "SCALAR"
        }))
    }

    /// Adds a mesh with its node, its normals one for all corners or one each. Without any, viewers shade
    /// each triangle flat, as the specification asks.
    fn add(&mut self, name: &str, mesh: &Mesh, normals: &[[f32; 3]], color: Rgb, extras: &Value) {
        if mesh.triangles.is_empty() {
            return;
        }
        let mut attributes = json!({ "POSITION": self.add_positions(&mesh.vertices_m) });
        if !normals.is_empty() {
            attributes["NORMAL"] = self.add_normals(normals, mesh.vertices_m.len()).into();
        }
        let indices = self.add_indices(&mesh.triangles);
        let material = self.material(color);
        let primitive =
            json!({ "attributes": attributes, "indices": indices, "material": material, "mode": 4 });
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
        self.nodes.push(json!({ "name": name, "mesh": self.meshes.len() - 1, "extras": extras }));
    }

    fn binary(&self) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        for value in self.positions_m.iter().chain(&self.normals).flatten() {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        bytes
    }

    fn document(mut self, binary_len: usize) -> Value {
        let root = self.nodes.len();
        let children: Vec<usize> = (0..root).collect();
        let mut node = json!({ "name": "map", "rotation": MAP_TO_GLTF_XYZW });
        if self.shift_m != [0.0; 3] {
            // In the axes of glTF, because a node is turned before it is moved.
            let [x, y, z] = self.shift_m;
            node["translation"] = json!([x, z, -y]);
        }
        if !children.is_empty() {
            node["children"] = children.into();
        }
        self.nodes.push(node);
        let mut document = json!({
            "asset": {
                "version": "2.0", "generator": generator(),
                "extras": {
                    "unit": "metre", "frame": "children of the node map are in frame map, z up",
                    "source": self.source
                }
            },
            "scene": 0,
            "scenes": [{ "name": "model", "nodes": [root] }],
            "nodes": self.nodes,
        });
        if binary_len > 0 {
            let lengths = [self.indices.len() * 4, self.positions_m.len() * 12, self.normals.len() * 12];
            document["meshes"] = self.meshes.into();
            document["materials"] = self.materials.into();
            document["accessors"] = self.accessors.into();
            document["bufferViews"] = views(lengths).into();
            document["buffers"] = json!([{ "byteLength": binary_len }]);
        }
        document
    }
}

fn views([indices, positions, normals]: [usize; 3]) -> Vec<Value> {
    let mut views = vec![
        json!({ "name": "indices", "buffer": 0, "byteOffset": 0, "byteLength": indices, "target": ELEMENT_ARRAY_BUFFER }),
        json!({ "name": "positions", "buffer": 0, "byteOffset": indices, "byteLength": positions, "byteStride": 12,
                "target": ARRAY_BUFFER }),
    ];
    if normals > 0 {
        views.push(
            json!({ "name": "normals", "buffer": 0, "byteOffset": indices + positions, "byteLength": normals,
                           "byteStride": 12, "target": ARRAY_BUFFER }),
        );
    }
    views
}

/// sRGB as stored to the linear value that glTF wants, in four decimals.
fn linear(value: u8) -> f64 {
    let value = f64::from(value) / 255.0;
    let linear = if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).portable_powf(2.4) };
    (linear * 1e4).round() / 1e4
}

fn plane_mesh(shapes: &Shapes<'_>, polygons: &[usize]) -> Mesh {
    let mut mesh = Mesh::default();
    for face in polygons.iter().filter_map(|&index| shapes.faces.get(index)) {
        append(face, &mut mesh.vertices_m, &mut mesh.triangles);
    }
    mesh
}

fn plane_extras(shapes: &Shapes<'_>, index: usize, plane: &Plane, polygons: &[usize], mesh: &Mesh) -> Value {
    let holes: usize = polygons.iter().map(|&polygon| shapes.model.polygons[polygon].holes_m.len()).sum();
    json!({
        "plane": index,
        "kind": Orientation::of(plane).name(),
        "normal": plane.normal,
        "offset_m": shapes.offset_m(plane),
        "area_m2": (area_m2(mesh) * 1e4).round() / 1e4,
        "rms_m": plane.rms_m,
        "points": plane.points,
        "polygons": polygons.len(),
        "holes": holes,
    })
}

fn inferred_extras(surface: &InferredSurface, mesh: &Mesh) -> Value {
    json!({
        "inferred": true,
        "kind": surface.kind.name(),
        "part_of": surface.part_of,
        "normal": surface.normal,
        "area_m2": (area_m2(mesh) * 1e4).round() / 1e4,
    })
}

/// Writes the model as GLB.
///
/// # Errors
/// When writing fails, or the model is larger than a GLB can be (4 GiB).
pub fn write(out: &mut impl Write, shapes: &Shapes<'_>) -> io::Result<()> {
    let mut builder =
        Builder { shift_m: shapes.shift_m, source: shapes.source.clone(), ..Builder::default() };
    for (index, polygons) in shapes.polygons_by_plane().iter().enumerate() {
        let plane = &shapes.model.planes[index];
        let mesh = plane_mesh(shapes, polygons);
        let extras = plane_extras(shapes, index, plane, polygons, &mesh);
        let name = palette::plane_name(index, plane);
        let normal = plane.normal.map(|v| v as f32);
        builder.add(&name, &mesh, &[normal], palette::plane_color(index, plane), &extras);
    }
    let numbers = shapes.round_numbers.iter();
    for ((number, round), mesh) in numbers.zip(&shapes.model.cylinders).zip(&shapes.rounds) {
        let name = format!("{} {number}", round.kind.name());
        let extras = shapes_json::figures(round, shapes.shift_m);
        builder.add(&name, mesh, &round.normals(), palette::ROUND, &extras);
    }
    let leftovers = &shapes.model.leftovers;
    let extras = json!({ "triangles": leftovers.triangles.len() });
    builder.add("leftovers", leftovers, &[], palette::LEFTOVERS, &extras);

    for (surface, mesh) in shapes.model.inferred.iter().zip(&shapes.inferred) {
        let normal = surface.normal.map(|v| v as f32);
        let color = palette::inferred_color(surface.kind);
        builder.add(&surface.name(), mesh, &[normal], color, &inferred_extras(surface, mesh));
    }

    let binary = builder.binary();
    let mut text = serde_json::to_vec(&builder.document(binary.len()))?;
    text.resize(text.len().next_multiple_of(4), b' ');
    write_chunks(out, &text, &binary)
}

fn write_chunks(out: &mut impl Write, text: &[u8], binary: &[u8]) -> io::Result<()> {
    let word = |length: usize| {
        u32::try_from(length)
            .map_err(|_| io::Error::new(io::ErrorKind::FileTooLarge, "a GLB holds 4 GiB at most"))
    };
    let chunk = |length: usize| if length > 0 { 8 + length } else { 0 };
    out.write_all(b"glTF")?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&word(12 + chunk(text.len()) + chunk(binary.len()))?.to_le_bytes())?;
    for (kind, bytes) in [(b"JSON", text), (b"BIN\0", binary)] {
        if !bytes.is_empty() {
            out.write_all(&word(bytes.len())?.to_le_bytes())?;
            out.write_all(kind)?;
            out.write_all(bytes)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::write;
    use crate::formats::Shapes;
    use crate::model::Model;
    use crate::model::sample;

    fn word(bytes: &[u8], at: usize) -> usize {
        u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
    }

    /// The JSON and the binary chunk.
    fn read(bytes: &[u8]) -> (Value, &[u8]) {
        assert_eq!((&bytes[..4], word(bytes, 4), word(bytes, 8)), (b"glTF".as_slice(), 2, bytes.len()));
        let text = word(bytes, 12);
        assert_eq!(&bytes[16..20], b"JSON");
        assert!(text.is_multiple_of(4));
        let document = serde_json::from_slice(&bytes[20..20 + text]).unwrap();
        let rest = &bytes[20 + text..];
        if rest.is_empty() {
            return (document, rest);
        }
        assert_eq!((word(rest, 0), &rest[4..8]), (rest.len() - 8, b"BIN\0".as_slice()));
        (document, &rest[8..])
    }

    #[test]
    fn each_plane_is_a_mesh_whose_accessors_lead_to_its_triangles() {
        let model = sample::model();
        let mut bytes = Vec::new();
        write(&mut bytes, &Shapes { faces: sample::faces(&model), ..Shapes::new(&model) }).unwrap();
        let (document, binary) = read(&bytes);
        let names: Vec<&str> =
            document["nodes"].as_array().unwrap().iter().map(|node| node["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["plane 0 (wall)", "plane 1 (floor)", "leftovers", "map"]);
        assert_eq!(document["nodes"][0]["extras"]["area_m2"], 11.0);
        assert_eq!(document["nodes"][0]["extras"]["holes"], 1);
        assert_eq!(document["buffers"][0]["byteLength"], binary.len());

        // The floor, followed by hand from its node to its corners.
        let primitive = &document["meshes"][1]["primitives"][0];
        let at = |accessor: &Value| {
            let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
            let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
            let offset = accessor["byteOffset"].as_u64().unwrap() + view["byteOffset"].as_u64().unwrap();
            (offset as usize, accessor["count"].as_u64().unwrap() as usize)
        };
        let (first, count) = at(&primitive["indices"]);
        let indices: Vec<usize> = (0..count).map(|index| word(binary, first + 4 * index)).collect();
        assert_eq!(indices, [0, 1, 2, 0, 2, 3]);
        let (first, count) = at(&primitive["attributes"]["POSITION"]);
        assert_eq!(count, 4);
        let corner: Vec<f32> =
            (0..3).map(|axis| f32::from_bits(word(binary, first + 24 + 4 * axis) as u32)).collect();
        assert_eq!(corner, [4.0, 2.0, 0.0]);
        let (first, _) = at(&primitive["attributes"]["NORMAL"]);
        assert_eq!(f32::from_bits(word(binary, first + 8) as u32), 1.0);
    }

    #[test]
    fn what_nobody_measured_has_a_node_and_a_material_of_its_own() {
        let model = Model { inferred: vec![sample::inferred()], ..sample::model() };
        let mut bytes = Vec::new();
        write(&mut bytes, &Shapes::new(&model)).unwrap();
        let (document, _) = read(&bytes);
        let node =
            document["nodes"].as_array().unwrap().iter().find(|node| node["extras"]["inferred"] == true);
        let node = node.unwrap();
        assert_eq!(node["name"], "S1-W01 wall base (inferred)");
        assert_eq!(node["extras"]["area_m2"], 1.0);
        let material = |mesh: &Value| mesh["primitives"][0]["material"].clone();
        let meshes = document["meshes"].as_array().unwrap();
        let own = &meshes[node["mesh"].as_u64().unwrap() as usize];
        assert_eq!(meshes.iter().filter(|mesh| material(mesh) == material(own)).count(), 1);
    }

    #[test]
    fn an_empty_model_is_a_valid_file_without_a_binary_chunk() {
        let model = Model::default();
        let mut bytes = Vec::new();
        write(&mut bytes, &Shapes::new(&model)).unwrap();
        let (document, binary) = read(&bytes);
        assert!(binary.is_empty() && document.get("buffers").is_none() && document.get("meshes").is_none());
        assert_eq!(document["nodes"][0]["name"], "map");
    }
}
