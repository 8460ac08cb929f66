//! `model.mcap`: the model, the points, the map and the way in one file that viewers open. It is made of the
//! other files of the folder, so that `build` and `export` write the same bytes.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use crate::formats::mcap::{self, Surroundings};
use crate::formats::output::error::OutputError;
use crate::formats::output::write_file;
use crate::formats::ply::points_file::PointsFile;
use crate::formats::ply::write::PointTable;
use crate::formats::text::model_json::ModelFile;
use crate::formats::text::trajectory::read_poses;
use crate::formats::{Shapes, input::shift::restored};
use crate::view::floor_map::map_read::read_map;

use crate::cli::models::formats::{Format, Formats};

/// Of more points every n-th is shown: a viewer holds them all. Twelve bytes each.
const MAX_POINTS: usize = 1_000_000;

/// Writes `model.mcap` into a folder that has its other files, if it is asked for; how many files that are.
pub(crate) fn write_viewer_file(
    folder: &Path,
    shapes: &Shapes<'_>,
    file: &ModelFile<'_>,
    formats: &[Formats],
) -> Result<usize, OutputError> {
    if !formats.iter().any(|some| some.contains(&Format::Mcap)) {
        return Ok(0);
    }
    let around = surroundings(folder, file).map_err(OutputError::io("read the files of", folder))?;
    write_file(&folder.join("model.mcap"), true, |out| mcap::write(out, shapes, &around))?;
    Ok(1)
}

/// What a folder holds beside the model. One of `compact` has neither a map nor a way.
fn surroundings(folder: &Path, file: &ModelFile<'_>) -> io::Result<Surroundings> {
    let points = folder.join("points.ply");
    let points_m = if points.exists() {
        let points = PointsFile::open(&points, file).map_err(io::Error::other)?;
        thinned_m(&points)?
    } else {
        Vec::new()
    };
    let way = folder.join("trajectory.tum");
    let poses = if way.exists() {
        read_poses(BufReader::new(File::open(&way)?)).unwrap_or_default()
    } else {
        Vec::new()
    };
    Ok(Surroundings { points_m, floor_map: read_map(folder)?, poses })
}

fn thinned_m(points: &dyn PointTable) -> io::Result<Vec<[f32; 3]>> {
    let step = points.count().div_ceil(MAX_POINTS).max(1);
    let shift_m = points.shift_m();
    let mut points_m = Vec::with_capacity(points.count() / step + 1);
    let mut index = 0_usize;
    points.visit(&mut |row| {
        if index.is_multiple_of(step) {
            points_m.push(restored(row.point_m.map(f64::from), shift_m).map(|value| value as f32));
        }
        index += 1;
        Ok(())
    })?;
    Ok(points_m)
}
