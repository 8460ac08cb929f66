//! The map as a picture for people: walls dark, free floor white, the trajectory in color from a green start
//! to a red end.

use std::io::{self, Write};

use crate::model::palette::Rgb;
use crate::recordings::deskew::StampedPose;
use crate::view::floor_map::map_image::MapImage;
use crate::view::render::mask::{Mask, mix};

const UNKNOWN: Rgb = [226, 230, 235];
const FREE: Rgb = [255, 255, 255];
const WALL: Rgb = [24, 28, 36];
const PATH: Rgb = [33, 118, 214];
const START: Rgb = [22, 160, 90];
const END: Rgb = [222, 60, 60];
/// Small maps are enlarged by whole pixels up to about this size.
const SIDE_PIXELS: u32 = 2000;
const MAX_ENLARGED: u32 = 6;
/// Pixels around the map.
const MARGIN: u32 = 12;
/// Half the width of the trajectory's line, pixels.
const HALF_LINE: f64 = 1.1;
/// Radius of the dots at its ends, pixels.
const DOT: f64 = 6.0;

struct Picture {
    size: [u32; 2],
    pixels: Vec<Rgb>,
}

/// Writes the picture as PNG.
///
/// # Errors
/// When writing fails.
pub(crate) fn write_png(out: &mut impl Write, image: &MapImage<'_>, poses: &[StampedPose]) -> io::Result<()> {
    let image = &image.without_spokes(poses);
    let scale = scale_of(image.size());
    let mut picture = paint_cells(image, scale);
    draw_path(&mut picture, image, poses, scale);
    encode(out, &picture)
}

/// Writes the cells alone as PNG, a pixel a cell.
///
/// # Errors
/// When writing fails.
pub(crate) fn write_cells_png(out: &mut impl Write, image: &MapImage<'_>) -> io::Result<()> {
    let [columns, rows] = image.size();
    let cell = |index: u32| color_of(image.probability(index % columns, index / columns));
    let pixels = (0..columns * rows).map(cell).collect();
    encode(out, &Picture { size: [columns, rows], pixels })
}

fn encode(out: &mut impl Write, picture: &Picture) -> io::Result<()> {
    let mut encoder = png::Encoder::new(out, picture.size[0], picture.size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(io::Error::from)?;
    writer.write_image_data(picture.pixels.as_flattened()).map_err(io::Error::from)?;
    writer.finish().map_err(io::Error::from)
}

/// Pixels a cell.
fn scale_of([columns, rows]: [u32; 2]) -> u32 {
    (SIDE_PIXELS / columns.max(rows).max(1)).clamp(1, MAX_ENLARGED)
}

fn paint_cells(image: &MapImage<'_>, scale: u32) -> Picture {
    let [columns, rows] = image.size();
    let size = [columns * scale + 2 * MARGIN, rows * scale + 2 * MARGIN];
    let mut pixels = vec![UNKNOWN; size[0] as usize * size[1] as usize];
    for row in 0..rows {
        let first = (MARGIN + row * scale) as usize * size[0] as usize;
        for column in 0..columns {
            let color = color_of(image.probability(column, row));
            let from = first + (MARGIN + column * scale) as usize;
            pixels[from..from + scale as usize].fill(color);
        }
        for copy in 1..scale as usize {
            pixels.copy_within(first..first + size[0] as usize, first + copy * size[0] as usize);
        }
    }
    Picture { size, pixels }
}

fn color_of(probability: Option<f64>) -> Rgb {
    match probability {
        None => UNKNOWN,
        // Half-known cells shade towards the unknown's gray, so that thin evidence looks thin.
        Some(p) if p <= 0.5 => mix(FREE, UNKNOWN, ((p - 0.2) / 0.3).clamp(0.0, 1.0)),
        Some(p) => mix(UNKNOWN, WALL, ((p - 0.5) / 0.3).clamp(0.0, 1.0)),
    }
}

fn draw_path(picture: &mut Picture, image: &MapImage<'_>, poses: &[StampedPose], scale: u32) {
    let [x0_m, y0_m] = image.origin_m();
    let per_m = f64::from(scale) / image.resolution_m();
    let top = f64::from(picture.size[1] - MARGIN);
    let place =
        |pose: &StampedPose| [f64::from(MARGIN) + (pose.x_m - x0_m) * per_m, top - (pose.y_m - y0_m) * per_m];
    let size = picture.size.map(|side| side as usize);
    let mut line = Mask::new(size);
    for pair in poses.windows(2) {
        if pair[0].step_m(&pair[1]) <= StampedPose::LONGEST_STEP_M {
            line.cover_segment([place(&pair[0]), place(&pair[1])], HALF_LINE);
        }
    }
    line.paint(&mut picture.pixels, PATH, 1.0);
    for (pose, color) in [(poses.first(), START), (poses.last(), END)] {
        if let Some(pose) = pose {
            let mut dot = Mask::new(size);
            dot.cover_segment([place(pose); 2], DOT);
            dot.paint(&mut picture.pixels, color, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{FREE, MARGIN, START, UNKNOWN, WALL, write_png};
    use crate::recordings::deskew::StampedPose;
    use crate::slam::occupancy::OccupancyGrid;
    use crate::slam::occupancy::OccupancyParams;
    use crate::slam::occupancy::Ray;
    use crate::view::floor_map::map_image::MapImage;

    #[test]
    fn the_picture_shows_walls_floor_and_where_the_robot_started() {
        let mut grid =
            OccupancyGrid::new(OccupancyParams { resolution_m: 1.0, ..OccupancyParams::default() });
        for _ in 0..12 {
            grid.add_scan(&[
                Ray { from_m: [0.5, 0.5], to_m: [9.5, 0.5] },
                Ray { from_m: [0.5, 0.5], to_m: [0.5, 9.5] },
            ]);
        }
        let image = MapImage::new(&grid, &[]).unwrap();
        let pose = StampedPose { x_m: 2.5, y_m: 0.5, ..StampedPose::default() };
        let mut bytes = Vec::new();
        write_png(&mut bytes, &image, &[pose, StampedPose { x_m: 7.5, ..pose }]).unwrap();

        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut pixels).unwrap();
        let scale = super::scale_of(image.size());
        assert_eq!(frame.width, 10 * scale + 2 * MARGIN);
        let at = |column: u32, row_from_below: u32| {
            let middle = |cell: u32| MARGIN + cell * scale + scale / 2;
            let index = 3 * (middle(9 - row_from_below) * frame.width + middle(column)) as usize;
            [pixels[index], pixels[index + 1], pixels[index + 2]]
        };
        assert_eq!(at(9, 0), WALL);
        assert_eq!(at(0, 9), WALL);
        assert_eq!(at(0, 5), FREE);
        assert_eq!(at(5, 5), UNKNOWN);
        assert_eq!(at(2, 0), START);
        assert_eq!(at(4, 0), super::PATH);
    }
}
