//! What the page's script reads: where the meshes lie, which triangles are which polygon, and what is known
//! of each.

use std::fmt::Write;
use std::io;

use serde::Serialize;

use super::pack::{Lattice, Packed};
use crate::formats::Shapes;
use crate::model::area::area_m2;
use crate::model::cylinder::Cylinder;
use crate::model::palette;
use crate::model::palette::{Orientation, Rgb};
use crate::model::turn::Turn;
use crate::model::{Mesh, Model};
use crate::recordings::deskew::StampedPose;
use crate::view::markup::inline_json;
use crate::view::report::drawn::Drawn;
use crate::view::report::sources::Sources;
use crate::view::report::text::grouped;

/// Rows of the table of planes.
const TABLE_ROWS: usize = 15;
/// Between two poses one after the other no robot climbs so far, meters.
const STOREY_M: f64 = 1.0;
/// The robot's way has no corners nearer to each other than this, meters.
const CORNER_M: f64 = 0.1;

#[derive(Serialize)]
struct Contents<'a> {
    origin_m: [f64; 3],
    step_m: f64,
    meshes: Vec<MeshNote<'a>>,
    /// Triangles of the whole raw mesh, also when fewer are shown.
    raw_triangles: usize,
    planes: Vec<PlaneNote>,
    polygons: Vec<PolygonNote>,
    rounds: Vec<RoundNote>,
    inferred: Vec<InferredNote>,
    bounds_m: [[f64; 3]; 2],
    inside: [[f64; 3]; 2],
    /// By what the plan is turned, and the view from above with it.
    turned_rad: f64,
    #[serde(rename = "way_m")]
    path_m: Vec<Vec<[f64; 3]>>,
}

#[derive(Serialize)]
struct MeshNote<'a> {
    name: &'a str,
    vertices: usize,
    triangles: usize,
}

#[derive(Serialize)]
struct PlaneNote {
    normal: [f64; 3],
    offset_m: f64,
    points: usize,
    rms_m: f64,
    color: Rgb,
    kind: &'static str,
}

/// The triangles of polygons come first in the model's mesh, polygon by polygon; none shares a vertex with
/// another.
#[derive(Serialize)]
struct PolygonNote {
    plane: usize,
    triangles: usize,
    area_m2: f64,
    holes: usize,
    corners: usize,
}

/// A round thing. Its triangles follow those of the polygons, in the same order.
#[derive(Serialize)]
struct RoundNote {
    name: String,
    triangles: usize,
    radius_m: f64,
    length_m: f64,
    arc_deg: f64,
    axis: [f64; 3],
    points: usize,
    rms_m: f64,
    color: Rgb,
}

/// A surface that nobody measured. Its triangles follow those of the round things, in the same order.
#[derive(Serialize)]
struct InferredNote {
    name: String,
    triangles: usize,
    area_m2: f64,
    normal: [f64; 3],
    color: Rgb,
}

/// The model as one mesh: each polygon with vertices of its own, then round things, then what is inferred,
/// then what is left over.
pub(crate) fn model_mesh(shapes: &Shapes<'_>, leftovers: &Mesh) -> Mesh {
    let mut mesh = Mesh::default();
    let surfaces = shapes.faces.iter().chain(&shapes.rounds).chain(&shapes.inferred);
    for part in surfaces.chain([leftovers]) {
        let first = mesh.vertices_m.len() as u32;
        mesh.vertices_m.extend_from_slice(&part.vertices_m);
        mesh.triangles.extend(part.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
    }
    mesh
}

/// The color of a plane, as in all pictures.
pub(crate) fn color(model: &Model, plane: usize) -> Rgb {
    model.planes.get(plane).map_or(palette::LEFTOVERS, |known| palette::plane_color(plane, known))
}

/// All of it, safe to stand in a `<script>` element.
pub(crate) fn json(
    sources: &Sources<'_>,
    lattice: &Lattice,
    packed: &[(&str, Packed)],
    drawn: &Drawn,
    turn: &Turn,
) -> io::Result<String> {
    let model = sources.shapes.model;
    let planes = model.planes.iter().enumerate().map(|(index, plane)| PlaneNote {
        normal: plane.normal.map(|value| rounded(value, 1e6)),
        offset_m: rounded(plane.offset_m, 1e5),
        points: plane.points,
        rms_m: rounded(plane.rms_m, 1e6),
        color: color(model, index),
        kind: Orientation::of(plane).name(),
    });
    let polygons = model.polygons.iter().zip(&sources.shapes.faces).map(|(polygon, face)| PolygonNote {
        plane: polygon.plane,
        triangles: face.triangles.len(),
        area_m2: rounded(area_m2(face), 1e4),
        holes: polygon.holes_m.len(),
        corners: polygon.outer_m.len() + polygon.holes_m.iter().map(Vec::len).sum::<usize>(),
    });
    let rounds =
        model.cylinders.iter().zip(&sources.shapes.rounds).enumerate().map(|(index, (round, mesh))| {
            RoundNote {
                name: round_name(index, round),
                triangles: mesh.triangles.len(),
                radius_m: rounded(round.radius_m, 1e4),
                length_m: rounded(round.to_m - round.from_m, 1e3),
                arc_deg: rounded(round.arc_deg[1] - round.arc_deg[0], 1.0),
                axis: round.axis_direction.map(|value| rounded(value, 1e6)),
                points: round.points,
                rms_m: rounded(round.rms_m, 1e6),
                color: palette::ROUND,
            }
        });
    let inferred = model.inferred.iter().zip(&sources.shapes.inferred).map(|(surface, mesh)| InferredNote {
        name: format!("{} {}", surface.part_of, surface.kind.name()),
        triangles: mesh.triangles.len(),
        area_m2: rounded(surface.area_m2(), 1e4),
        normal: surface.normal.map(|value| rounded(value, 1e6)),
        color: palette::inferred_color(surface.kind),
    });
    let contents = Contents {
        origin_m: lattice.origin_m,
        step_m: lattice.step_m,
        meshes: packed
            .iter()
            .map(|(name, mesh)| MeshNote { name, vertices: mesh.vertices, triangles: mesh.triangles })
            .collect(),
        raw_triangles: sources.raw.triangles.len(),
        planes: planes.collect(),
        polygons: polygons.collect(),
        rounds: rounds.collect(),
        inferred: inferred.collect(),
        bounds_m: drawn.bounds_m,
        inside: drawn.inside,
        turned_rad: turn.angle_rad,
        path_m: way(sources.poses),
    };
    Ok(inline_json(&serde_json::to_string(&contents)?))
}

fn rounded(value: f64, digits: f64) -> f64 {
    (value * digits).round() / digits
}

/// The robot's way, drive by drive, at the heights that it has. Poses a step apart that no robot makes, or
/// on floors above each other, belong to two drives.
fn way(poses: &[StampedPose]) -> Vec<Vec<[f64; 3]>> {
    let is_one = |a: &StampedPose, b: &StampedPose| {
        a.step_m(b) <= StampedPose::LONGEST_STEP_M && (b.z_m - a.z_m).abs() <= STOREY_M
    };
    let corners = |drive: &[StampedPose]| {
        let mut path_m: Vec<[f64; 3]> = Vec::new();
        for pose in drive {
            let at = [pose.x_m, pose.y_m, pose.z_m];
            let step2 =
                |last: &[f64; 3]| (0..3).map(|axis| (at[axis] - last[axis]) * (at[axis] - last[axis])).sum();
            if path_m.last().map(step2).is_none_or(|step2: f64| step2 >= CORNER_M * CORNER_M) {
                path_m.push(at.map(|value| (value * 100.0).round() / 100.0 + 0.0));
            }
        }
        path_m
    };
    poses.chunk_by(is_one).map(corners).collect()
}

/// The name of a round thing, the same as in the other files of the model.
fn round_name(index: usize, round: &Cylinder) -> String {
    format!("{} {index}", round.kind.name())
}

/// The round things as a table; a click on a row shows one in the 3D view.
pub(crate) fn table_of_rounds(model: &Model) -> String {
    if model.cylinders.is_empty() {
        return String::new();
    }
    let [r, g, b] = palette::ROUND;
    let mut rows = String::new();
    for (index, round) in model.cylinders.iter().enumerate() {
        let _ = write!(
            rows,
            "<tr data-surface=\"{}\"><th scope=\"row\"><button type=\"button\"><i style=\"background:#{r:02x}{g:02x}{b:02x}\"></i>{}\
             </button></th><td>{:.3}</td><td>{:.2}</td><td>{:.0}</td><td>{:.2}</td><td>{}</td></tr>",
            model.polygons.len() + index,
            round_name(index, round),
            round.radius_m,
            round.to_m - round.from_m,
            round.arc_deg[1] - round.arc_deg[0],
            100.0 * round.rms_m,
            grouped(round.points),
        );
    }
    format!(
        "<section><h2>Round things</h2><div class=\"scroll\"><table class=\"figures surfaces\" id=\"rounds\"><thead><tr><th scope=\"col\">name</th>\
         <th scope=\"col\">radius, m</th><th scope=\"col\">length, m</th><th scope=\"col\">arc, degrees</th><th scope=\"col\">RMS, cm</th>\
         <th scope=\"col\">points</th></tr></thead><tbody>{rows}</tbody></table></div><p class=\"note\">Press a name to see it above.</p></section>"
    )
}

/// The largest polygons as a table; a click on a row shows one in the 3D view.
pub(crate) fn table(shapes: &Shapes<'_>) -> String {
    let model = shapes.model;
    let mut order: Vec<(usize, f64)> = shapes.faces.iter().map(area_m2).enumerate().collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let mut rows = String::new();
    for &(index, area) in order.iter().take(TABLE_ROWS) {
        let polygon = &model.polygons[index];
        let Some(plane) = model.planes.get(polygon.plane) else { continue };
        let [r, g, b] = color(model, polygon.plane);
        // Adding zero makes -0 and 0 one.
        let [x, y, z] = plane.normal.map(|value| rounded(value, 1e3) + 0.0);
        let _ = write!(
            rows,
            "<tr data-surface=\"{index}\"><th scope=\"row\"><button type=\"button\"><i style=\"background:#{r:02x}{g:02x}{b:02x}\"></i>surface {index}\
             </button></th><td>{}</td><td>{area:.2}</td><td>{}</td><td>{x:.3}, {y:.3}, {z:.3}</td><td>{:.2}</td><td>{}</td></tr>",
            Orientation::of(plane).name(),
            polygon.holes_m.len(),
            100.0 * plane.rms_m,
            grouped(plane.points),
        );
    }
    if rows.is_empty() {
        return String::new();
    }
    let shown = if order.len() > TABLE_ROWS {
        format!("The {TABLE_ROWS} largest of {} polygons.", grouped(order.len()))
    } else {
        "All polygons, the largest first.".to_owned()
    };
    format!(
        "<section><h2>Flat surfaces</h2><div class=\"scroll\"><table class=\"figures surfaces\" id=\"planes\"><thead><tr><th scope=\"col\">name</th>\
         <th scope=\"col\">kind</th><th scope=\"col\">area, m²</th><th scope=\"col\">openings</th><th scope=\"col\">normal x, y, z</th><th scope=\"col\">RMS, cm</th>\
         <th scope=\"col\">points</th></tr></thead><tbody>{rows}</tbody></table></div><p class=\"note\">{shown} The kind goes by the direction alone: a table’s top counts as a floor. Points and RMS are those of \
         the whole plane that a surface lies in. Press a name to see it above.</p></section>"
    )
}
