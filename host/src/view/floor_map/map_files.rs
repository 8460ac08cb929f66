//! An occupancy grid as files: the pair that ROS's map_server reads (`NAME.pgm`, `NAME.yaml`) and a picture
//! (`NAME.png`).
//!
//! The first row of an image is the map's top (largest y). `origin` in the YAML is the lower left corner of
//! the lower left pixel in `map`, meters. Source: the map_server and nav2_map_server pages of ROS.

use crate::view::floor_map::map_image::CellState;
use crate::view::floor_map::map_image::MapError;
use crate::view::floor_map::map_image::MapImage;
use crate::view::floor_map::map_image::{FREE, OCCUPIED, state_of};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::formats::output;
use crate::recordings::deskew::StampedPose;
use biplane_recording::mcap::write::with_suffix;

pub(crate) use crate::view::floor_map::picture::{write_cells_png, write_png};

/// Writes the image that map_server reads: binary PGM, 0 occupied, 254 free, 205 unknown.
///
/// # Errors
/// When writing fails.
pub(crate) fn write_pgm(out: &mut impl Write, image: &MapImage<'_>) -> io::Result<()> {
    let [columns, rows] = image.size();
    write!(out, "P5\n{columns} {rows}\n255\n")?;
    let mut line = Vec::with_capacity(columns as usize);
    let mut cells = Vec::new();
    for row in 0..rows {
        image.fill_row(row, &mut cells);
        line.clear();
        line.extend(cells.iter().map(|cell| match state_of(*cell) {
            CellState::Occupied => 0_u8,
            CellState::Free => 254,
            CellState::Unknown => 205,
        }));
        out.write_all(&line)?;
    }
    Ok(())
}

/// Writes the description that map_server reads. `image_name` is the image's file name beside it.
///
/// # Errors
/// When writing fails.
pub(crate) fn write_yaml(out: &mut impl Write, image: &MapImage<'_>, image_name: &str) -> io::Result<()> {
    let [x_m, y_m] = image.origin_m();
    writeln!(out, "image: {}", yaml_text(image_name))?;
    writeln!(out, "mode: trinary")?;
    writeln!(out, "resolution: {}", image.resolution_m())?;
    writeln!(out, "origin: [{x_m:.6}, {y_m:.6}, 0.0]")?;
    writeln!(out, "negate: 0")?;
    writeln!(out, "occupied_thresh: {OCCUPIED}")?;
    writeln!(out, "free_thresh: {FREE}")
}

/// A file name as YAML: plain when nothing in it could be read as something else.
fn yaml_text(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-' | '/');
    let starts_plain = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '/' || c == '_');
    if starts_plain && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
    }
}

/// Where the three files go: `NAME.pgm`, `NAME.yaml`, `NAME.png`; a name that ends like one of them is meant
/// without its ending.
pub(crate) fn map_paths(name: &Path) -> [PathBuf; 3] {
    let known = name.extension().is_some_and(|end| ["pgm", "yaml", "png"].iter().any(|known| end == *known));
    let stem = if known { name.with_extension("") } else { name.to_owned() };
    ["pgm", "yaml", "png"].map(|end| with_suffix(&stem, &format!(".{end}")))
}

/// Writes all three files of a map, the trajectory on the picture.
///
/// # Errors
/// When a file exists and `overwrite` is not set (nothing is written then), or the system refuses.
pub(crate) fn write_map(
    name: &Path,
    image: &MapImage<'_>,
    poses: &[StampedPose],
    overwrite: bool,
) -> Result<[PathBuf; 3], MapError> {
    let paths = map_paths(name);
    for path in &paths {
        output::check_free(path, overwrite)?;
    }
    let image_name = paths[0].file_name().unwrap_or_default().to_string_lossy().into_owned();
    // The picture first: it needs the most memory, and where there is too little no file is to be left.
    output::write_file(&paths[2], overwrite, |out| write_png(out, image, poses))?;
    output::write_file(&paths[0], overwrite, |out| write_pgm(out, image))?;
    output::write_file(&paths[1], overwrite, |out| write_yaml(out, image, &image_name))?;
    Ok(paths)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::map_paths;
    use super::write_pgm;
    use super::write_yaml;
    use crate::recordings::deskew::StampedPose;
    use crate::slam::occupancy::OccupancyGrid;
    use crate::slam::occupancy::OccupancyParams;
    use crate::slam::occupancy::Ray;
    use crate::view::floor_map::map_image::MapError;
    use crate::view::floor_map::map_image::MapImage;

    /// A room from x 0 to 4 and y -1 to 2 in cells of a meter, seen many times from its lower left.
    fn room() -> OccupancyGrid {
        let mut grid =
            OccupancyGrid::new(OccupancyParams { resolution_m: 1.0, ..OccupancyParams::default() });
        let from_m = [0.5, -0.5];
        for _ in 0..12 {
            let ends = [[3.5, -0.5], [0.5, 1.5]];
            grid.add_scan(&ends.map(|to_m| Ray { from_m, to_m }));
        }
        grid
    }

    #[test]
    fn the_image_of_a_small_room_has_the_bytes_that_map_server_expects() {
        let grid = room();
        let mut bytes = Vec::new();
        write_pgm(&mut bytes, &MapImage::new(&grid, &[]).unwrap().0).unwrap();
        #[rustfmt::skip]
        let expected = [
            b"P5\n4 3\n255\n".as_slice(),
            &[  0, 205, 205, 205], // y = 1: the wall above
            &[254, 205, 205, 205], // y = 0
            &[254, 254, 254,   0], // y = -1: the laser's own row, the wall to the right
        ].concat();
        assert_eq!(bytes, expected);
    }

    #[test]
    fn the_image_reaches_to_where_the_robot_was() {
        let grid = room();
        let pose = StampedPose { x_m: -2.5, y_m: 0.0, ..StampedPose::default() };
        let (image, _) = MapImage::new(&grid, &[pose, StampedPose { x_m: f64::NAN, ..pose }]).unwrap();
        assert_eq!((image.size(), image.origin_m()), ([7, 3], [-3.0, -1.0]));
    }

    #[test]
    fn a_picture_leaves_thin_spokes_out_and_the_robot_in() {
        let mut grid =
            OccupancyGrid::new(OccupancyParams { resolution_m: 0.02, ..OccupancyParams::default() });
        // A room of 10 m by 10 m, and one beam that goes 6 m on.
        let mut rays = vec![Ray { from_m: [0.01, 0.01], to_m: [16.01, 0.01] }];
        for row in -250..250 {
            let y_m = f64::from(row) * 0.02 + 0.01;
            rays.push(Ray { from_m: [0.01, y_m], to_m: [10.01, y_m] });
        }
        for _ in 0..5 {
            grid.add_scan(&rays);
        }
        let (whole, _) = MapImage::new(&grid, &[]).unwrap();
        assert_eq!(whole.size(), [801, 500]);
        let pose = |x_m| StampedPose { x_m, ..StampedPose::default() };
        let size = |poses: &[StampedPose]| whole.without_spokes(poses).size();
        // 500 cells of floor, the wall behind, the border; then as far as the robot went.
        assert_eq!(size(&[]), [501 + 8, 500]);
        assert_eq!(size(&[pose(12.01)]), [601 + 8, 500]);
    }

    #[test]
    fn the_description_names_the_image_and_its_lower_left_corner() {
        let grid = room();
        let mut text = Vec::new();
        write_yaml(&mut text, &MapImage::new(&grid, &[]).unwrap().0, "room.pgm").unwrap();
        let expected = "image: room.pgm\nmode: trinary\nresolution: 1\norigin: [0.000000, -1.000000, 0.0]\nnegate: 0\n\
                        occupied_thresh: 0.65\nfree_thresh: 0.196\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
        assert_eq!(super::yaml_text("a: b"), "\"a: b\"");
        assert_eq!(super::yaml_text("1"), "\"1\"");
    }

    #[test]
    fn an_empty_grid_is_refused_and_a_boundless_one_drawn_coarser() {
        let mut grid =
            OccupancyGrid::new(OccupancyParams { resolution_m: 0.01, ..OccupancyParams::default() });
        assert!(matches!(MapImage::new(&grid, &[]), Err(MapError::Empty)));
        for x_m in [0.0, 9e4] {
            grid.add_scan(&[Ray { from_m: [x_m, x_m], to_m: [x_m + 1.0, x_m] }]);
        }
        let (image, coarsened) = MapImage::new(&grid, &[]).unwrap();
        let coarsened = coarsened.unwrap();
        assert_eq!((coarsened.size, coarsened.asked_m), ([9_000_101, 9_000_001], 0.01));
        assert_eq!((coarsened.drawn_m, image.resolution_m()), (5.5, 5.5));
        assert_eq!((image.size(), image.origin_m()), ([16_364, 16_364], [0.0, 0.0]));
    }

    #[test]
    fn a_name_with_a_known_ending_is_meant_without_it() {
        let names = |name: &str| map_paths(Path::new(name)).map(|path| path.to_string_lossy().into_owned());
        assert_eq!(names("out/intel"), ["out/intel.pgm", "out/intel.yaml", "out/intel.png"]);
        assert_eq!(names("intel.pgm"), ["intel.pgm", "intel.yaml", "intel.png"]);
        assert_eq!(names("run.2"), ["run.2.pgm", "run.2.yaml", "run.2.png"]);
    }
}
