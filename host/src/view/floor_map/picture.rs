//! The map as a picture for people: walls dark, free floor white, the trajectory in color from a green start
//! to a red end.

use std::io::{self, Write};
use std::ops::Range;

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

/// Pixels in memory at a time: larger pictures are painted and compressed strip by strip.
const STRIP_PIXELS: u32 = 1 << 24;

/// Writes the picture as PNG.
///
/// # Errors
/// When writing fails.
pub(crate) fn write_png(out: &mut impl Write, image: &MapImage<'_>, poses: &[StampedPose]) -> io::Result<()> {
    let image = &image.without_spokes(poses);
    let scale = scale_of(image.size());
    let size = image.size().map(|side| side * scale + 2 * MARGIN);
    encode(out, size, STRIP_PIXELS, |rows| {
        let mut pixels = paint_cells(image, scale, size[0], rows.clone());
        draw_path(&mut pixels, image, poses, (scale, size, rows));
        pixels
    })
}

/// Writes the cells alone as PNG, a pixel a cell.
///
/// # Errors
/// When writing fails.
pub(crate) fn write_cells_png(out: &mut impl Write, image: &MapImage<'_>) -> io::Result<()> {
    let mut cells = Vec::new();
    encode(out, image.size(), STRIP_PIXELS, |rows| {
        let mut pixels = Vec::with_capacity(rows.len() * image.size()[0] as usize);
        for row in rows {
            image.fill_row(row, &mut cells);
            pixels.extend(cells.iter().map(|cell| color_of(*cell)));
        }
        pixels
    })
}

/// Encodes what `paint` makes of some rows of pixels.
fn encode(
    out: &mut impl Write,
    [width, height]: [u32; 2],
    strip_pixels: u32,
    mut paint: impl FnMut(Range<u32>) -> Vec<Rgb>,
) -> io::Result<()> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(io::Error::from)?;
    let strip = (strip_pixels / width.max(1)).max(1);
    if height <= strip {
        writer.write_image_data(paint(0..height).as_flattened()).map_err(io::Error::from)?;
        return writer.finish().map_err(io::Error::from);
    }
    let mut stream = writer.stream_writer().map_err(io::Error::from)?;
    for first in (0..height).step_by(strip as usize) {
        stream.write_all(paint(first..height.min(first + strip)).as_flattened())?;
    }
    stream.finish().map_err(io::Error::from)?;
    writer.finish().map_err(io::Error::from)
}

/// Pixels a cell.
fn scale_of([columns, rows]: [u32; 2]) -> u32 {
    (SIDE_PIXELS / columns.max(rows).max(1)).clamp(1, MAX_ENLARGED)
}

/// Some rows of pixels with the cells in them.
fn paint_cells(image: &MapImage<'_>, scale: u32, width: u32, rows: Range<u32>) -> Vec<Rgb> {
    let width = width as usize;
    let mut pixels = vec![UNKNOWN; width * rows.len()];
    let mut cells = Vec::new();
    let mut painted = None;
    for (at, y) in rows.enumerate() {
        let row = y.checked_sub(MARGIN).map(|y| y / scale).filter(|row| *row < image.size()[1]);
        let Some(row) = row else { continue };
        if painted == Some(row) {
            pixels.copy_within((at - 1) * width..at * width, at * width);
            continue;
        }
        painted = Some(row);
        image.fill_row(row, &mut cells);
        let line = &mut pixels[at * width + MARGIN as usize..(at + 1) * width];
        for (pixels, cell) in line.chunks_exact_mut(scale as usize).zip(&cells) {
            pixels.fill(color_of(*cell));
        }
    }
    pixels
}

fn color_of(probability: Option<f64>) -> Rgb {
    match probability {
        None => UNKNOWN,
        // Half-known cells shade towards the unknown's gray, so that thin evidence looks thin.
        Some(p) if p <= 0.5 => mix(FREE, UNKNOWN, ((p - 0.2) / 0.3).clamp(0.0, 1.0)),
        Some(p) => mix(UNKNOWN, WALL, ((p - 0.5) / 0.3).clamp(0.0, 1.0)),
    }
}

fn draw_path(
    pixels: &mut [Rgb],
    image: &MapImage<'_>,
    poses: &[StampedPose],
    (scale, size, rows): (u32, [u32; 2], Range<u32>),
) {
    let [x0_m, y0_m] = image.origin_m();
    let per_m = f64::from(scale) / image.resolution_m();
    let top = f64::from(size[1] - MARGIN);
    let place =
        |pose: &StampedPose| [f64::from(MARGIN) + (pose.x_m - x0_m) * per_m, top - (pose.y_m - y0_m) * per_m];
    let empty = || Mask::of_rows(size[0] as usize, rows.start as usize..rows.end as usize);
    let mut line = empty();
    for pair in poses.windows(2) {
        if pair[0].step_m(&pair[1]) <= StampedPose::LONGEST_STEP_M {
            line.cover_segment([place(&pair[0]), place(&pair[1])], HALF_LINE);
        }
    }
    line.paint(pixels, PATH, 1.0);
    for (pose, color) in [(poses.first(), START), (poses.last(), END)] {
        if let Some(pose) = pose {
            let mut dot = empty();
            dot.cover_segment([place(pose); 2], DOT);
            dot.paint(pixels, color, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{FREE, MARGIN, Rgb, START, UNKNOWN, WALL, encode, write_png};
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
        let (image, _) = MapImage::new(&grid, &[]).unwrap();
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
    #[test]
    fn a_picture_in_strips_is_the_picture() {
        let size = [30_u32, 23];
        let color = |index: u32| -> Rgb { [index as u8, (index / 7) as u8, 9] };
        let decoded = |strip_pixels: u32| {
            let mut strips = Vec::new();
            let mut bytes = Vec::new();
            let paint = |rows: std::ops::Range<u32>| {
                strips.push(rows.len());
                (rows.start * size[0]..rows.end * size[0]).map(color).collect()
            };
            encode(&mut bytes, size, strip_pixels, paint).unwrap();
            let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            reader.finish().unwrap();
            (strips, pixels)
        };
        let (whole, strips) = (decoded(1000), decoded(250));
        assert_eq!((whole.0, strips.0), (vec![23], vec![8, 8, 7]));
        assert_eq!(whole.1, strips.1);
        assert_eq!(decoded(1).0.len(), 23);
    }
}
