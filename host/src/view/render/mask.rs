//! How much of each pixel a line or an area covers. Coverage first, color once: a line drawn over itself
//! stays as thin as it is.

use std::ops::Range;

use crate::model::palette::Rgb;
use biplane_geometry::vec2::distance_to_segment;

/// Rows in which an area is looked at, for each row of pixels.
const ROWS_PER_PIXEL: usize = 4;

/// Coverage of a picture's pixels, from 0 to 255. Places are in pixels from the top left corner.
#[derive(Clone, Debug)]
pub(crate) struct Mask {
    size: [usize; 2],
    first_row: usize,
    coverage: Vec<u8>,
}

impl Mask {
    /// Nothing covered, in a picture of this width and height.
    pub(crate) fn new([width, height]: [usize; 2]) -> Self {
        Self::of_rows(width, 0..height)
    }

    /// Nothing covered in some rows of a picture of this width.
    pub(crate) fn of_rows(width: usize, rows: Range<usize>) -> Self {
        Self { size: [width, rows.len()], first_row: rows.start, coverage: vec![0; width * rows.len()] }
    }

    /// Covers the pixels within `half_width` of a segment, with soft edges.
    pub(crate) fn cover_segment(&mut self, [a, b]: [[f64; 2]; 2], half_width: f64) {
        let reach = half_width + 1.0;
        let (size, first) = (self.size, [0, self.first_row]);
        let span = |axis: usize| {
            let (from, to) = (first[axis] as f64, (first[axis] + size[axis]) as f64);
            let low = (a[axis].min(b[axis]) - reach).floor().clamp(from, to);
            let high = (a[axis].max(b[axis]) + reach).ceil().clamp(from, to);
            low as usize..high as usize
        };
        for y in span(1) {
            for x in span(0) {
                let distance = distance_to_segment([x as f64 + 0.5, y as f64 + 0.5], a, b);
                let part = (half_width + 0.5 - distance).clamp(0.0, 1.0);
                let pixel = &mut self.coverage[(y - first[1]) * size[0] + x];
                *pixel = (*pixel).max((part * 255.0).round() as u8);
            }
        }
    }

    /// Covers the inside of a closed area: what a line to the right leaves an odd number of times.
    pub(crate) fn cover_area(&mut self, corners: &[[f64; 2]]) {
        let [width, height] = self.size;
        let mut row = vec![0.0; width];
        let mut crossings = Vec::new();
        for y in 0..height {
            row.fill(0.0);
            for part in 0..ROWS_PER_PIXEL {
                crossings_at(
                    corners,
                    (self.first_row + y) as f64 + (part as f64 + 0.5) / ROWS_PER_PIXEL as f64,
                    &mut crossings,
                );
                for pair in crossings.chunks_exact(2) {
                    add_span(&mut row, pair[0], pair[1]);
                }
            }
            for (pixel, sum) in self.coverage[y * width..(y + 1) * width].iter_mut().zip(&row) {
                *pixel = (*pixel).max((sum / ROWS_PER_PIXEL as f64 * 255.0).round() as u8);
            }
        }
    }

    /// Paints what is covered, with this share of the color at most.
    pub(crate) fn paint(&self, pixels: &mut [Rgb], color: Rgb, opacity: f64) {
        for (pixel, &part) in pixels.iter_mut().zip(&self.coverage).filter(|(_, part)| **part > 0) {
            *pixel = mix(*pixel, color, opacity * f64::from(part) / 255.0);
        }
    }
}

/// The color this part of the way from one to another.
pub(crate) fn mix(a: Rgb, b: Rgb, part: f64) -> Rgb {
    let channel = |i: usize| f64::from(a[i]) + part * (f64::from(b[i]) - f64::from(a[i]));
    [0, 1, 2].map(|i| channel(i).round() as u8)
}

/// Where the border of an area crosses the horizontal line at `y`, from the left.
fn crossings_at(corners: &[[f64; 2]], y: f64, crossings: &mut Vec<f64>) {
    crossings.clear();
    for (index, a) in corners.iter().enumerate() {
        let b = &corners[(index + 1) % corners.len()];
        if (a[1] <= y) != (b[1] <= y) {
            crossings.push(a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
        }
    }
    crossings.sort_by(f64::total_cmp);
}

/// Adds to each pixel of a row the part of it that lies between two places.
fn add_span(row: &mut [f64], from: f64, to: f64) {
    let (from, to) = (from.clamp(0.0, row.len() as f64), to.clamp(0.0, row.len() as f64));
    for x in from.floor() as usize..(to.ceil() as usize).min(row.len()) {
        row[x] += (to.min(x as f64 + 1.0) - from.max(x as f64)).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::Mask;

    #[test]
    fn an_area_covers_whole_pixels_inside_and_parts_of_those_at_its_border() {
        let mut mask = Mask::new([4, 3]);
        mask.cover_area(&[[0.5, 0.0], [3.0, 0.0], [3.0, 1.5], [0.5, 1.5]]);
        assert_eq!(mask.coverage, [128, 255, 255, 0, 64, 128, 128, 0, 0, 0, 0, 0]);
        // A shape that reaches out of the picture is cut.
        let mut cut = Mask::new([2, 2]);
        cut.cover_area(&[[-5.0, -5.0], [9.0, -5.0], [9.0, 1.0], [-5.0, 1.0]]);
        assert_eq!(cut.coverage, [255, 255, 0, 0]);
    }

    #[test]
    fn rows_of_a_picture_are_covered_as_in_the_whole() {
        let segment = [[0.3, 0.9], [6.1, 8.2]];
        let mut whole = Mask::new([7, 9]);
        whole.cover_segment(segment, 1.1);
        let mut rows = Vec::new();
        for part in [0..2, 2..3, 3..8, 8..9] {
            let mut part = Mask::of_rows(7, part);
            part.cover_segment(segment, 1.1);
            rows.extend(part.coverage);
        }
        assert_eq!(rows, whole.coverage);
    }

    #[test]
    fn a_segment_covers_its_width_and_paints_once() {
        let mut mask = Mask::new([3, 3]);
        for _ in 0..2 {
            mask.cover_segment([[-1.0, 1.5], [4.0, 1.5]], 0.5);
        }
        assert_eq!(mask.coverage, [0, 0, 0, 255, 255, 255, 0, 0, 0]);
        let mut pixels = vec![[255; 3]; 9];
        mask.paint(&mut pixels, [55, 155, 255], 0.5);
        assert_eq!((pixels[0], pixels[4]), ([255; 3], [155, 205, 255]));
    }
}
