//! The files of a build's folder (`docs/modeling.md`), written into its unfinished form.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::building::Building;
use crate::formats::gltf::{lod, tileset};
#[cfg(feature = "las")]
use crate::formats::las;
use crate::formats::obj;
use crate::formats::output::error::OutputError;
use crate::formats::output::write_file;
use crate::formats::ply;
use crate::formats::ply::write::{PointRows, PointTable};
use crate::formats::text::model_json::{self, ModelFile, PointsOf, ScanTimes};
use crate::formats::text::shapes_json;
use crate::formats::text::trajectory::{TrajectoryFormat, write_poses};
use crate::formats::{Shapes, cityjson, dxf, gltf, ifc};
use crate::pipeline::BuildOutput;
use crate::pipeline::drive_points::DrivePoints;
use crate::pipeline::summary::Summary;
use crate::reconstruct::revisits::split::Drive;
use crate::recordings::deskew::StampedPose;
use crate::view::floor_map::map_files::write_map;
use crate::view::floor_map::map_image::MapError;
use crate::view::floor_map::map_image::MapImage;
use serde_json::Value;

use crate::cli::models::formats::{Format, Formats};
use crate::cli::terminal::replace::Known;

/// Every name that a build writes.
const NAMES: &[&str] = &[
    "building.json",
    "map.pgm",
    "map.png",
    "map.yaml",
    "model.city.json",
    "model.dxf",
    "model.glb",
    "model.ifc",
    "model.json",
    "model.lod1.glb",
    "model.lod2.glb",
    "model.mcap",
    "model.obj",
    "model.ply",
    "planes.ply",
    "points.las",
    "points.laz",
    "points.ply",
    "raw.ply",
    "report.html",
    "shapes.json",
    "summary.json",
    "tileset.json",
    "trajectory.tum",
];

/// The names that a build with these formats writes.
pub(crate) fn names(formats: &[Formats], report: bool) -> impl Iterator<Item = &'static str> {
    let chosen = move |name: &&str| match Format::ALL.iter().find(|format| format.files().contains(name)) {
        Some(format) => formats.iter().any(|formats| formats.contains(format)),
        None => match *name {
            "report.html" => report,
            // A program without the feature `las` makes neither.
            "points.las" | "points.laz" => false,
            _ => true,
        },
    };
    NAMES.iter().copied().filter(chosen)
}

/// What a folder of a build is known by; one of `compact` has some of its names.
pub(crate) const KNOWN: Known = Known {
    by: "build",
    names: NAMES,
    pieces: Some((tileset::FOLDER, &[".glb"])),
    sign: "summary.json",
    is_ours,
};

fn is_ours(summary: &Value) -> bool {
    summary["raw_points"].is_u64() && summary["stages"].is_array()
}

/// Writes the map with the poses of its scans, and the trajectory; returns how many files.
pub(crate) fn write_floor(
    folder: &Path,
    image: &MapImage<'_>,
    at_scans: &[StampedPose],
    used: &[StampedPose],
) -> Result<usize, MapError> {
    let paths = write_map(&folder.join("map"), image, at_scans, true)?;
    write_file(&folder.join("trajectory.tum"), true, |out| write_poses(out, used, TrajectoryFormat::Tum))?;
    Ok(paths.len() + 1)
}

/// Writes the raw points, all of them, and the raw mesh of the first views.
pub(crate) fn write_raw(
    folder: &Path,
    drive: Drive<'_>,
    output: &BuildOutput,
    source: &str,
    formats: &[Formats],
) -> Result<usize, OutputError> {
    let (cloud, labels) = (&output.cloud, &output.labels);
    let written = if output.counts.revisited_points == 0 {
        let rows = PointRows { cloud, labels, scan_numbers: &[], order: None, shift_m: [0.0; 3], source };
        write_points(folder, &rows, formats)?
    } else {
        write_points(folder, &DrivePoints { drive, output, source }, formats)?
    };
    write_file(&folder.join("raw.ply"), true, |out| {
        ply::write_mesh(out, &output.mesh, &format!("raw mesh of {source}"))
    })?;
    Ok(written + 1)
}

/// Writes the points, in the formats asked for too.
pub(crate) fn write_points(
    folder: &Path,
    points: &dyn PointTable,
    formats: &[Formats],
) -> Result<usize, OutputError> {
    write_file(&folder.join("points.ply"), true, |out| ply::write_points(out, points))?;
    Ok(1 + write_las(folder, points, formats)?)
}

/// A program without the feature `las` writes neither.
#[cfg(not(feature = "las"))]
pub(crate) fn write_las(_: &Path, _: &dyn PointTable, _: &[Formats]) -> Result<usize, OutputError> {
    Ok(0)
}

/// Writes the points as LAS and LAZ, as far as these are asked for.
#[cfg(feature = "las")]
pub(crate) fn write_las(
    folder: &Path,
    points: &dyn PointTable,
    formats: &[Formats],
) -> Result<usize, OutputError> {
    let mut written = 0;
    for (name, format) in [("points.las", Format::Las), ("points.laz", Format::Laz)] {
        if formats.iter().any(|some| some.contains(&format)) {
            write_file(&folder.join(name), true, |out| {
                // The library wants a file of its own; both names are of one.
                let file = BufWriter::new(out.get_ref().try_clone()?);
                las::write(file, points, format == Format::Laz)
            })?;
            written += 1;
        }
    }
    Ok(written)
}

/// What other formats need of the points of a build besides `points.ply`.
pub(crate) fn points_of(output: &BuildOutput) -> PointsOf<'_> {
    let BuildOutput { cloud, revisits, .. } = output;
    let has_all = output.counts.revisited_points == 0;
    let count = if has_all { cloud.len() } else { revisits.kept.points() };
    let scans_ns = if has_all { &cloud.stamps_ns } else { &revisits.scans.stamps_ns };
    let times = ScanTimes { scans_ns: scans_ns.into(), beams_ns: (&cloud.delays_ns).into() };
    PointsOf { count, times: Some(times) }
}

/// Writes the model without loss, for `biplane export`, and its flat surfaces alone.
pub(crate) fn write_lossless(
    folder: &Path,
    shapes: &Shapes<'_>,
    file: &ModelFile<'_>,
) -> Result<usize, OutputError> {
    write_file(&folder.join(model_json::NAME), true, |out| file.write(out))?;
    write_file(&folder.join("planes.ply"), true, |out| ply::write_planes(out, shapes))?;
    write_file(&folder.join("shapes.json"), true, |out| shapes_json::write(out, shapes))?;
    Ok(3)
}

/// Writes rooms, walls, doors and windows.
pub(crate) fn write_elements(folder: &Path, file: &ModelFile<'_>) -> Result<usize, OutputError> {
    write_file(&folder.join("building.json"), true, |out| file.write_elements(out))?;
    Ok(1)
}

/// Writes the model in the formats asked for. `building` is there when a format wants it.
pub(crate) fn write_model(
    folder: &Path,
    shapes: &Shapes<'_>,
    building: Option<&Building>,
    formats: &[Formats],
) -> Result<usize, OutputError> {
    let write = |name: &str, fill: &dyn Fn(&mut BufWriter<File>) -> io::Result<()>| {
        write_file(&folder.join(name), true, |out| fill(out))
    };
    let mut written = 0;
    for format in
        Format::ALL.iter().copied().filter(|format| formats.iter().any(|some| some.contains(format)))
    {
        match (format, building) {
            (Format::Glb, _) => write("model.glb", &|out| gltf::write(out, shapes))?,
            (Format::Ply, _) => write("model.ply", &|out| ply::write_model(out, shapes))?,
            (Format::Obj, _) => write("model.obj", &|out| obj::write(out, shapes))?,
            (Format::CityJson, _) => {
                let elements = building.map(|building| &building.elements);
                write("model.city.json", &|out| cityjson::write_with(out, shapes, elements))?;
            }
            (Format::Dxf, Some(building)) => write("model.dxf", &|out| dxf::write(out, shapes, building))?,
            (Format::Ifc, Some(building)) => write("model.ifc", &|out| ifc::write(out, shapes, building))?,
            (Format::Dxf | Format::Ifc, None) => continue,
            (Format::Lod, _) => written += write_levels(folder, shapes)? - 1,
            (Format::Tiles3d, _) => written += tileset::write(folder, shapes)? - 1,
            // Made of the other files.
            (Format::Mcap, _) => continue,
            // Of points, not of the model.
            #[cfg(feature = "las")]
            (Format::Las | Format::Laz, _) => continue,
        }
        written += 1;
    }
    Ok(written)
}

/// Writes the levels of detail.
fn write_levels(folder: &Path, shapes: &Shapes<'_>) -> Result<usize, OutputError> {
    let triangles = shapes.triangles();
    for (number, level) in (1..).zip(&lod::LEVELS) {
        let (coarse, moved_m) = lod::coarse(shapes.model, level, triangles);
        let source = format!("{}, borders within {:.0} cm", shapes.source, 100.0 * moved_m);
        let coarse = Shapes { shift_m: shapes.shift_m, source, ..Shapes::new(&coarse) };
        write_file(&folder.join(format!("model.lod{number}.glb")), true, |out| gltf::write(out, &coarse))?;
    }
    Ok(lod::LEVELS.len())
}

/// Writes the summary.
pub(crate) fn write_summary(folder: &Path, summary: &Summary) -> Result<(), OutputError> {
    write_file(&folder.join("summary.json"), true, |out| {
        serde_json::to_writer_pretty(&mut *out, summary)?;
        writeln!(out)
    })
}
