//! 3D Tiles 1.1: a model in levels and pieces, so that a web viewer loads what is near and large enough.
//!
//! The root is the coarsest level of the whole ([`super::lod`]). Below it each square of the floor has its
//! part of the finer level, and below that its part of the model itself; each replaces the one above it. A
//! surface is whole in the square of its middle: nothing is cut, so there are no cracks between pieces.
//! `geometricError` bounds what a level leaves out. Source: OGC 22-025r4, 3D Tiles 1.1. Frame `map` (z up),
//! meters; the pieces are GLB, whose root node turns to y up, as 3D Tiles expects of glTF.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;

use serde_json::{Value, json};

use super::lod::{self, LEVELS};
use crate::formats::output::error::OutputError;
use crate::formats::output::write_file;
use crate::formats::{Shapes, append, generator, gltf};
use crate::model::cylinder::Cylinder;
use crate::model::{Mesh, Model, part};

/// The file that a viewer opens.
pub(crate) const NAME: &str = "tileset.json";
/// The folder of the pieces beside it.
pub(crate) const FOLDER: &str = "tiles";
/// Side of the squares, meters: a large room, some hundred kilobytes.
const SIDE_M: f64 = 20.0;
/// What a level may leave out, in lengths by which its borders move: a loose piece goes that is no larger
/// than a square of this side.
const LEFT_OUT: f64 = 3.0;

/// Column and row of a square of the floor.
type Square = [i64; 2];

/// The smallest and the largest coordinates of something, meters.
type Bounds = [[f64; 3]; 2];

const NOWHERE: Bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

/// A model, or a level of it, in parts.
#[derive(Default)]
struct Parts {
    squares: BTreeMap<Square, Model>,
    /// What its levels may leave out, meters.
    error_m: f64,
}

/// Writes `tileset.json` and its pieces; returns how many files.
///
/// # Errors
/// When the system refuses.
pub(crate) fn write(folder: &Path, shapes: &Shapes<'_>) -> Result<usize, OutputError> {
    let pieces = folder.join(FOLDER);
    if pieces.is_dir() {
        // Of an older model.
        fs::remove_dir_all(&pieces).map_err(OutputError::io("remove", &pieces))?;
    }
    fs::create_dir_all(&pieces).map_err(OutputError::io("create", &pieces))?;
    let triangles = shapes.triangles();
    let level = |level| {
        let (model, moved_m) = lod::coarse(shapes.model, level, triangles);
        (model, LEFT_OUT * moved_m)
    };
    let ((near, near_m), (far, far_m)) = (level(&LEVELS[0]), level(&LEVELS[1]));
    let finest = Parts { squares: in_squares(shapes.model), error_m: 0.0 };
    let middle = Parts { squares: as_in(&finest.squares, in_squares(&near)), error_m: near_m };
    let mut writer = Writer { pieces: &pieces, shapes, files: 0 };
    let mut children = Vec::new();
    let mut bounds = bounds_of(&far);
    for (square, model) in &finest.squares {
        let of_square = join(bounds_of(model), middle.squares.get(square).map_or(NOWHERE, bounds_of));
        bounds = join(bounds, of_square);
        let name = format!("{}_{}", square[0], square[1]);
        let fine = writer.tile(&format!("{name}.glb"), model, of_square, 0.0, Vec::new())?;
        children.push(match middle.squares.get(square) {
            Some(model) => {
                writer.tile(&format!("{name}.lod1.glb"), model, of_square, middle.error_m, vec![fine])?
            }
            None => fine,
        });
    }
    let root = writer.tile("root.glb", &far, bounds, far_m.max(near_m), children)?;
    let size_m: f64 = (0..3).map(|k| (bounds[1][k] - bounds[0][k]).max(0.0).powi(2)).sum::<f64>().sqrt();
    let tileset = json!({
        "asset": { "version": "1.1", "generator": generator() },
        "geometricError": if size_m.is_finite() { size_m } else { 0.0 },
        "root": root,
    });
    write_file(&folder.join(NAME), true, |out| {
        serde_json::to_writer_pretty(&mut *out, &tileset)?;
        writeln!(out)
    })?;
    Ok(writer.files + 1)
}

/// Writes pieces and tells of them.
struct Writer<'a> {
    pieces: &'a Path,
    shapes: &'a Shapes<'a>,
    files: usize,
}

impl Writer<'_> {
    fn tile(
        &mut self,
        name: &str,
        model: &Model,
        bounds: Bounds,
        error_m: f64,
        children: Vec<Value>,
    ) -> Result<Value, OutputError> {
        let source = self.shapes.source.clone();
        let known = &self.shapes.model.cylinders;
        let number_of = |one| known.iter().position(|other| other == one);
        let round_numbers = model.cylinders.iter().filter_map(number_of).collect();
        let of_model = Shapes { shift_m: self.shapes.shift_m, source, round_numbers, ..Shapes::new(model) };
        write_file(&self.pieces.join(name), true, |out| gltf::write(out, &of_model))?;
        self.files += 1;
        let mut tile = json!({
            "boundingVolume": { "box": bounding_box(bounds, self.shapes.shift_m) },
            "geometricError": error_m,
            "refine": "REPLACE",
            "content": { "uri": format!("{FOLDER}/{name}") },
        });
        if !children.is_empty() {
            tile["children"] = children.into();
        }
        Ok(tile)
    }
}

/// Center and three half axes.
fn bounding_box([low, high]: Bounds, shift_m: [f64; 3]) -> [f64; 12] {
    let mut numbers = [0.0; 12];
    for k in (0..3).filter(|k| low[*k] <= high[*k]) {
        numbers[k] = 0.5 * (low[k] + high[k]) + shift_m[k];
        // Positions are written in 32 bits: the box is a little larger.
        numbers[3 + 4 * k] = 0.5 * (high[k] - low[k]) + 1e-3;
    }
    numbers
}

fn join(a: Bounds, b: Bounds) -> Bounds {
    [std::array::from_fn(|k| a[0][k].min(b[0][k])), std::array::from_fn(|k| a[1][k].max(b[1][k]))]
}

fn around(points: impl Iterator<Item = [f64; 3]>) -> Bounds {
    points.fold(NOWHERE, |bounds, p| join(bounds, [p, p]))
}

fn bounds_of(model: &Model) -> Bounds {
    let inferred = model.inferred.iter().flat_map(|surface| surface.outer_m.iter());
    let of_polygons = model.polygons.iter().flat_map(|polygon| &polygon.outer_m).chain(inferred).copied();
    let vertices = model.leftovers.triangles.iter().flatten();
    let of_leftovers = vertices.map(|vertex| model.leftovers.vertices_m[*vertex as usize].map(f64::from));
    let rounds: Vec<Mesh> = model.cylinders.iter().map(Cylinder::mesh).collect();
    let of_rounds = rounds.iter().flat_map(|mesh| &mesh.vertices_m).map(|vertex| vertex.map(f64::from));
    around(of_polygons.chain(of_leftovers).chain(of_rounds))
}

/// The parts of a model by the square in which their middle lies.
fn in_squares(model: &Model) -> BTreeMap<Square, Model> {
    let square_of = |[low, high]: Bounds| -> Square {
        [0, 1].map(|k| (0.5 * (low[k] + high[k]) / SIDE_M).floor() as i64)
    };
    let mut squares: BTreeMap<Square, Model> = BTreeMap::new();
    let empty = || Model { planes: model.planes.clone(), ..Model::default() };
    for polygon in &model.polygons {
        let square = square_of(around(polygon.outer_m.iter().copied()));
        squares.entry(square).or_insert_with(empty).polygons.push(polygon.clone());
    }
    for surface in &model.inferred {
        let square = square_of(around(surface.outer_m.iter().copied()));
        squares.entry(square).or_insert_with(empty).inferred.push(surface.clone());
    }
    for round in &model.cylinders {
        let square = square_of(around(round.mesh().vertices_m.iter().map(|vertex| vertex.map(f64::from))));
        squares.entry(square).or_insert_with(empty).cylinders.push(round.clone());
    }
    let Mesh { vertices_m, triangles } = &model.leftovers;
    let mut leftovers: BTreeMap<Square, Vec<usize>> = BTreeMap::new();
    for (number, corners) in triangles.iter().enumerate() {
        let corners = corners.iter().map(|corner| vertices_m[*corner as usize].map(f64::from));
        leftovers.entry(square_of(around(corners))).or_default().push(number);
    }
    for (square, triangles) in leftovers {
        squares.entry(square).or_insert_with(empty).leftovers = part::only(&model.leftovers, &triangles);
    }
    squares
}

/// Parts of a coarser level by the squares of the finest one: a surface whose middle has moved into a square
/// where the finest has nothing goes to the nearest one.
fn as_in(finest: &BTreeMap<Square, Model>, coarse: BTreeMap<Square, Model>) -> BTreeMap<Square, Model> {
    let mut out: BTreeMap<Square, Model> = BTreeMap::new();
    for (square, part) in coarse {
        let apart = |other: &&Square| (0..2).map(|k| (other[k] - square[k]).pow(2)).sum::<i64>();
        let nearest = finest.keys().min_by_key(apart).copied().unwrap_or(square);
        let Some(known) = out.get_mut(&nearest) else {
            out.insert(nearest, part);
            continue;
        };
        known.polygons.extend(part.polygons);
        known.cylinders.extend(part.cylinders);
        known.inferred.extend(part.inferred);
        let Mesh { vertices_m, triangles } = &mut known.leftovers;
        append(&part.leftovers, vertices_m, triangles);
    }
    out
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;

    use serde_json::Value;

    use super::{in_squares, write};
    use crate::formats::Shapes;
    use crate::model::sample;
    use crate::model::{Model, PlanarPolygon};

    /// The sample model with a column and an apse, and its polygons and its column once more 100 m away.
    fn two_places() -> Model {
        let mut model = sample::model();
        let mut moved_column = sample::column();
        moved_column.axis_point_m[1] += 100.0;
        model.cylinders = vec![sample::apse(), moved_column, sample::column()];
        let moved = |p: &[f64; 3]| [p[0], p[1] + 100.0, p[2]];
        let mut far: Vec<PlanarPolygon> = model.polygons.clone();
        far.retain(|polygon| model.planes[polygon.plane].normal[1].abs() < 0.5);
        for polygon in &mut far {
            polygon.outer_m = polygon.outer_m.iter().map(moved).collect();
            polygon.holes_m = polygon.holes_m.iter().map(|ring| ring.iter().map(moved).collect()).collect();
        }
        model.polygons.extend(far);
        model
    }

    fn numbers(tile: &Value) -> Vec<f64> {
        let numbers = tile["boundingVolume"]["box"].as_array().unwrap();
        numbers.iter().map(|v| v.as_f64().unwrap()).collect()
    }

    /// Looks at a tile and those below it.
    fn check(tile: &Value, uris: &mut BTreeSet<String>) {
        assert!(uris.insert(tile["content"]["uri"].as_str().unwrap().to_owned()), "{tile}");
        let own = numbers(tile);
        for child in tile["children"].as_array().into_iter().flatten() {
            assert!(child["geometricError"].as_f64() < tile["geometricError"].as_f64(), "{tile}");
            let of_child = numbers(child);
            for k in 0..3 {
                let reach = |all: &[f64]| [all[k] - all[3 + 4 * k], all[k] + all[3 + 4 * k]];
                let ([low, high], [child_low, child_high]) = (reach(&own), reach(&of_child));
                assert!(low - 1e-9 <= child_low && child_high <= high + 1e-9, "{tile}");
            }
            check(child, uris);
        }
    }

    #[test]
    fn every_piece_is_there_lies_in_its_parent_and_is_finer() {
        let folder = std::env::temp_dir().join(format!("biplane-tileset-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("tiles")).unwrap();
        fs::write(folder.join("tiles/9_9.glb"), "of an older model").unwrap();
        let model = two_places();
        let files = write(&folder, &Shapes::new(&model)).unwrap();
        let tileset: Value = serde_json::from_slice(&fs::read(folder.join("tileset.json")).unwrap()).unwrap();
        assert_eq!(tileset["asset"]["version"], "1.1");
        assert!(tileset["geometricError"].as_f64().unwrap() > 90.0, "{tileset}");
        let mut uris = BTreeSet::new();
        check(&tileset["root"], &mut uris);
        assert!(tileset["root"]["children"].as_array().unwrap().len() >= 2, "{tileset}");
        let there: BTreeSet<String> = fs::read_dir(folder.join("tiles"))
            .unwrap()
            .map(|entry| format!("tiles/{}", entry.unwrap().file_name().to_string_lossy()))
            .collect();
        assert_eq!((uris.len() + 1, uris), (files, there));
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn every_surface_is_in_one_square() {
        let model = two_places();
        let squares = in_squares(&model);
        let polygons: usize = squares.values().map(|part| part.polygons.len()).sum();
        let triangles: usize = squares.values().map(|part| part.leftovers.triangles.len()).sum();
        let rounds: usize = squares.values().map(|part| part.cylinders.len()).sum();
        let all = (model.polygons.len(), model.leftovers.triangles.len(), model.cylinders.len());
        assert_eq!((polygons, triangles, rounds), all);
        assert!(squares.len() >= 2, "{:?}", squares.keys());
    }
}
