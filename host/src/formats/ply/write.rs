//! PLY, binary little endian: what CloudCompare, MeshLab, Blender, Open3D and trimesh open.
//!
//! Vertices `float x y z`, colors `uchar red green blue`, faces `list uchar int vertex_indices`, and the
//! plane's index as `int plane` (-1 for none), a property that readers keep or skip. Source: Turk's PLY file
//! format page.

use std::io::{self, Write};

use crate::formats::input::shift::restored;
use crate::formats::{Shapes, append, generator};
use crate::model::palette;
use crate::model::palette::Rgb;
use crate::model::{Cloud, Mesh};

/// Rows of equal length, little endian, as the header declares them.
fn header(out: &mut impl Write, comment: &str, elements: &[(&str, usize, &[&str])]) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "comment {}: {comment}", generator())?;
    writeln!(out, "comment frame map (z up), meters")?;
    for (element, count, properties) in elements {
        writeln!(out, "element {element} {count}")?;
        for property in *properties {
            writeln!(out, "property {property}")?;
        }
    }
    writeln!(out, "end_header")
}

/// What is in a file, and what of.
fn of(what: &str, source: &str) -> String {
    if source.is_empty() { what.to_owned() } else { format!("{what}, of {source}") }
}

const XYZ: [&str; 3] = ["float x", "float y", "float z"];
const FACE: &str = "list uchar int vertex_indices";
const FAR_XYZ: [&str; 3] = ["double x", "double y", "double z"];
const COLOR: [&str; 3] = ["uchar red", "uchar green", "uchar blue"];
const CLOUD_POINT: [&str; 3] = ["int plane", "int scan", "int beam"];

/// How coordinates are written: as they are, or with a shift and then in 64 bits.
#[derive(Clone, Copy)]
struct Coordinates {
    shift_m: [f64; 3],
}

impl Coordinates {
    fn is_far(self) -> bool {
        self.shift_m != [0.0; 3]
    }

    fn xyz(self) -> [&'static str; 3] {
        if self.is_far() { FAR_XYZ } else { XYZ }
    }

    /// The coordinates, and what else a record has.
    fn and(self, more: [&'static str; 3]) -> Vec<&'static str> {
        self.xyz().into_iter().chain(more).collect()
    }

    fn put(self, out: &mut impl Write, point: &[f32; 3]) -> io::Result<()> {
        if self.is_far() {
            let far = restored(point.map(f64::from), self.shift_m);
            far.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
        } else {
            point.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
        }
    }
}

fn put_face(out: &mut impl Write, corners: &[u32; 3]) -> io::Result<()> {
    out.write_all(&[3])?;
    corners.iter().try_for_each(|corner| out.write_all(&corner.to_le_bytes()))
}

/// Triangles with a color a vertex and a plane a face.
#[derive(Default)]
struct Colored {
    vertices_m: Vec<[f32; 3]>,
    colors: Vec<Rgb>,
    triangles: Vec<[u32; 3]>,
    planes: Vec<i32>,
    /// Triangles of surfaces that were measured; those that follow are inferred.
    measured: usize,
}

impl Colored {
    fn add(&mut self, mesh: &Mesh, color: Rgb, plane: i32) {
        append(mesh, &mut self.vertices_m, &mut self.triangles);
        self.colors.resize(self.vertices_m.len(), color);
        self.planes.resize(self.triangles.len(), plane);
        self.measured = self.triangles.len();
    }

    fn add_inferred(&mut self, mesh: &Mesh, color: Rgb) {
        let measured = self.measured;
        self.add(mesh, color, -1);
        self.measured = measured;
    }

    fn write(&self, out: &mut impl Write, shift_m: [f64; 3], comment: &str) -> io::Result<()> {
        let coordinates = Coordinates { shift_m };
        let properties = coordinates.and(COLOR);
        let vertex = ("vertex", self.vertices_m.len(), properties.as_slice());
        // A model of which all was measured has no property that tells it apart.
        let has_inferred = self.measured < self.triangles.len();
        let of_face = [FACE, "int plane", "uchar inferred"];
        let face = ("face", self.triangles.len(), &of_face[..if has_inferred { 3 } else { 2 }]);
        header(out, comment, &[vertex, face])?;
        for (point, color) in self.vertices_m.iter().zip(&self.colors) {
            coordinates.put(out, point)?;
            out.write_all(color)?;
        }
        for (index, (corners, plane)) in self.triangles.iter().zip(&self.planes).enumerate() {
            put_face(out, corners)?;
            out.write_all(&plane.to_le_bytes())?;
            if has_inferred {
                out.write_all(&[u8::from(index >= self.measured)])?;
            }
        }
        Ok(())
    }
}

fn polygons(shapes: &Shapes<'_>) -> Colored {
    let mut colored = Colored::default();
    for (polygon, face) in shapes.model.polygons.iter().zip(&shapes.faces) {
        if let Some(plane) = shapes.model.planes.get(polygon.plane) {
            colored.add(face, palette::plane_color(polygon.plane, plane), polygon.plane as i32);
        }
    }
    colored
}

/// Writes the polygons alone, as triangles (`planes.ply`).
///
/// # Errors
/// When writing fails.
pub(crate) fn write_planes(out: &mut impl Write, shapes: &Shapes<'_>) -> io::Result<()> {
    polygons(shapes).write(out, shapes.shift_m, &of("flat surfaces as triangles", &shapes.source))
}

/// Writes the polygons as triangles and the leftovers (`model.ply`), then what is inferred: faces have a
/// property of this name where there is any.
///
/// # Errors
/// When writing fails.
pub fn write_model(out: &mut impl Write, shapes: &Shapes<'_>) -> io::Result<()> {
    let mut colored = polygons(shapes);
    shapes.rounds.iter().for_each(|mesh| colored.add(mesh, palette::ROUND, -1));
    colored.add(&shapes.model.leftovers, palette::LEFTOVERS, -1);
    for (surface, mesh) in shapes.model.inferred.iter().zip(&shapes.inferred) {
        colored.add_inferred(mesh, palette::inferred_color(surface.kind));
    }
    let comment = of("flat surfaces as triangles, and fine structure (plane -1)", &shapes.source);
    colored.write(out, shapes.shift_m, &comment)
}

/// Writes a mesh without colors (`raw.ply`).
///
/// # Errors
/// When writing fails.
pub fn write_mesh(out: &mut impl Write, mesh: &Mesh, comment: &str) -> io::Result<()> {
    write_far_mesh(out, mesh, [0.0; 3], comment)
}

/// Writes a mesh without colors, with a shift added to every coordinate, meters; 64-bit coordinates are
/// written when it is not zero.
///
/// # Errors
/// When writing fails.
pub(crate) fn write_far_mesh(
    out: &mut impl Write,
    mesh: &Mesh,
    shift_m: [f64; 3],
    comment: &str,
) -> io::Result<()> {
    let coordinates = Coordinates { shift_m };
    let (xyz, face) = (coordinates.xyz(), ("face", mesh.triangles.len(), [FACE].as_slice()));
    header(out, comment, &[("vertex", mesh.vertices_m.len(), xyz.as_slice()), face])?;
    mesh.vertices_m.iter().try_for_each(|point| coordinates.put(out, point))?;
    mesh.triangles.iter().try_for_each(|corners| put_face(out, corners))
}

/// Points with what is written of each.
#[derive(Clone, Copy, Debug)]
pub struct PointRows<'a> {
    /// The points, with scans, beams and origins where these are known.
    pub cloud: &'a Cloud,
    /// The plane of each; a point beyond these is on none.
    pub labels: &'a [i32],
    /// The number of each scan, where it is not its place in the cloud.
    pub scan_numbers: &'a [u32],
    /// The order in which points are written, as indices into the cloud; `None` = the cloud's own.
    pub order: Option<&'a [u32]>,
    /// What is added to every coordinate; 64-bit coordinates are written when it is not zero.
    pub shift_m: [f64; 3],
    /// What they come from, see `crate::formats::source_name`.
    pub source: &'a str,
}

/// What is written of one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointRow {
    /// Where it is, meters.
    pub point_m: [f32; 3],
    /// Its plane, scan and beam; -1 where there is none.
    pub numbers: [i32; 3],
    /// When it was measured, nanoseconds of Unix time, where that is known.
    pub stamp_ns: Option<i64>,
}

/// Points for a file, one after the other: nobody needs to hold all of them.
pub trait PointTable {
    /// How many there are.
    fn count(&self) -> usize;
    /// Whether points have scans and beams.
    fn has_scans(&self) -> bool;
    /// Where each scan was taken from, by its number; empty where that is not known.
    fn origins_m(&self) -> &[[f32; 3]];
    /// What is added to every coordinate.
    fn shift_m(&self) -> [f64; 3];
    /// What they come from, see `crate::formats::source_name`.
    fn source(&self) -> &str;
    /// Visits all, in order.
    ///
    /// # Errors
    /// The visitor's.
    fn visit(&self, visit: &mut dyn FnMut(&PointRow) -> io::Result<()>) -> io::Result<()>;
}

impl PointTable for PointRows<'_> {
    fn count(&self) -> usize {
        self.cloud.len()
    }

    fn has_scans(&self) -> bool {
        !self.cloud.scan.is_empty()
    }

    fn origins_m(&self) -> &[[f32; 3]] {
        // Rows of the element `scan` are found by the scan's number.
        let in_order = self.scan_numbers.iter().zip(0..).all(|(number, index)| *number == index);
        if in_order { &self.cloud.origins_m } else { &[] }
    }

    fn shift_m(&self) -> [f64; 3] {
        self.shift_m
    }

    fn source(&self) -> &str {
        self.source
    }

    fn visit(&self, visit: &mut dyn FnMut(&PointRow) -> io::Result<()>) -> io::Result<()> {
        let number =
            |scan: &u32| self.scan_numbers.get(*scan as usize).map_or(*scan, |number| *number) as i32;
        for row in 0..self.cloud.len() {
            let index = self.order.map_or(row, |order| order[row] as usize);
            let numbers = [
                self.labels.get(index).copied().unwrap_or(-1),
                self.cloud.scan.get(index).map_or(-1, number),
                self.cloud.beam.get(index).map_or(-1, |&beam| i32::from(beam)),
            ];
            let point_m = self.cloud.points_m[index];
            visit(&PointRow { point_m, numbers, stamp_ns: self.cloud.stamp_of(index) })?;
        }
        Ok(())
    }
}

/// Writes the points with the plane, scan and beam of each (`points.ply`), and where each scan was taken
/// from, if that is known: element `scan`, a row a scan.
///
/// # Errors
/// When writing fails.
pub fn write_points(out: &mut impl Write, points: &dyn PointTable) -> io::Result<()> {
    let coordinates = Coordinates { shift_m: points.shift_m() };
    let properties = coordinates.and(CLOUD_POINT);
    let mut elements = vec![("vertex", points.count(), properties.as_slice())];
    let origins = points.origins_m();
    if !origins.is_empty() {
        elements.push(("scan", origins.len(), &properties[..3]));
    }
    header(out, &of("raw points; plane -1 = none", points.source()), &elements)?;
    points.visit(&mut |row| {
        coordinates.put(out, &row.point_m)?;
        row.numbers.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
    })?;
    origins.iter().try_for_each(|origin| coordinates.put(out, origin))
}
