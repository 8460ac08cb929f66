//! A drawing as pixels, on light paper, with two pixels a point and letters of dots.

use super::drawing::{AREA_OPACITY, Anchor, CELL_GRAY, Cells, Drawing, Ink, Item};
use crate::view::render::Picture;
use crate::view::render::font;
use crate::view::render::mask::{Mask, mix};

/// Pixels a point.
const SCALE: f64 = 2.0;
/// Letters from this size on have larger dots.
const LARGE: f64 = 15.0;

/// Draws it.
pub(crate) fn to_picture(drawing: &Drawing) -> Picture {
    let [width, height] = drawing.size.map(|side| (side * SCALE).round() as usize);
    let mut picture = Picture::blank(width, height);
    for item in &drawing.items {
        let mut mask = Mask::new([width, height]);
        let (ink, opacity) = match item {
            Item::Line { points, width, ink } => {
                for pair in points.windows(2) {
                    mask.cover_segment([pixels(pair[0]), pixels(pair[1])], width * SCALE / 2.0);
                }
                (*ink, 1.0)
            }
            Item::Area { corners, ink } => {
                mask.cover_area(&corners.iter().map(|corner| pixels(*corner)).collect::<Vec<_>>());
                (*ink, AREA_OPACITY)
            }
            Item::Dot { at, radius, ink } => {
                mask.cover_segment([pixels(*at); 2], radius * SCALE);
                (*ink, 1.0)
            }
            Item::Cells { at, size, cells } => {
                shade(&mut picture, cells, pixels(*at), pixels(*size));
                continue;
            }
            Item::Words { at, anchor, size, ink, text } => {
                write(&mut picture, text, pixels(*at), *anchor, *size, *ink);
                continue;
            }
        };
        mask.paint(&mut picture.pixels, ink.on_light(), opacity);
    }
    picture
}

fn pixels(place: [f64; 2]) -> [f64; 2] {
    place.map(|value| value * SCALE)
}

/// Shades pixels by the darkest of the cells that they cover, so that thin walls stay whole.
fn shade(picture: &mut Picture, cells: &Cells, [left, top]: [f64; 2], size: [f64; 2]) {
    let count = [cells.columns, cells.rows()];
    let covered = |axis: usize, pixel: usize, start: f64| {
        let place = |pixel: f64| (pixel - start) / size[axis] * count[axis] as f64;
        let (from, to) = (place(pixel as f64).max(0.0), place(pixel as f64 + 1.0).max(0.0));
        from as usize..(to.ceil() as usize).min(count[axis])
    };
    for y in top.max(0.0) as usize..((top + size[1]).max(0.0) as usize).min(picture.height) {
        for x in left.max(0.0) as usize..((left + size[0]).max(0.0) as usize).min(picture.width) {
            let columns = covered(0, x, left);
            let rows = covered(1, y, top).map(|row| row * cells.columns);
            let shades = rows.flat_map(|row| columns.clone().map(move |column| cells.shades[row + column]));
            let pixel = &mut picture.pixels[y * picture.width + x];
            *pixel = mix(*pixel, [CELL_GRAY; 3], f64::from(shades.max().unwrap_or(0)) / 255.0);
        }
    }
}

fn write(picture: &mut Picture, text: &str, [x, y]: [f64; 2], anchor: Anchor, size: f64, ink: Ink) {
    let dot = if size < LARGE { 2 } else { 3 };
    let width = font::width(text, dot) as f64;
    let left = match anchor {
        Anchor::Left => x,
        Anchor::Middle => x - width / 2.0,
        Anchor::Right => x - width,
    };
    let top = y - (font::HEIGHT * dot) as f64;
    font::write_text(picture, text, [left.max(0.0) as usize, top.max(0.0) as usize], dot, ink.on_light());
}

#[cfg(test)]
mod tests {
    use super::to_picture;
    use std::sync::Arc;

    use crate::view::plot::drawing::{Anchor, CELL_GRAY, Cells, Drawing, Ink, Item};

    #[test]
    fn a_pixel_is_as_dark_as_the_darkest_cell_below_it() {
        let mut drawing = Drawing { size: [4.0, 2.0], ..Drawing::default() };
        // Eight cells on four pixels' width and half a cell's height: the wall in the third one stays.
        let cells = Arc::new(Cells { columns: 8, shades: vec![0, 0, 255, 0, 0, 0, 0, 51] });
        drawing.items.push(Item::Cells { at: [1.0, 0.0], size: [2.0, 1.0], cells });
        let picture = to_picture(&drawing);
        let row: Vec<u8> = picture.pixels[..8].iter().map(|pixel| pixel[0]).collect();
        let faint = 255 - ((255.0 - f64::from(CELL_GRAY)) / 5.0).round() as u8;
        assert_eq!(row, [255, 255, 255, CELL_GRAY, 255, faint, 255, 255]);
        assert_eq!(picture.pixels[8..16], picture.pixels[..8]);
        assert!(picture.pixels[16..].iter().all(|pixel| *pixel == [255; 3]));
    }

    #[test]
    fn lines_areas_dots_and_words_come_onto_the_paper() {
        let mut drawing = Drawing { size: [40.0, 30.0], ..Drawing::default() };
        drawing.items.push(Item::Area {
            corners: vec![[20.0, 0.0], [40.0, 0.0], [40.0, 10.0], [20.0, 10.0]],
            ink: Ink::Curve(0),
        });
        drawing.line(vec![[0.0, 15.0], [10.0, 15.0]], 2.0, Ink::Text);
        drawing.items.push(Item::Dot { at: [30.0, 20.0], radius: 3.0, ink: Ink::Curve(1) });
        drawing.words("I", [20.0, 30.0], Anchor::Right, 12.0, Ink::Text);
        let picture = to_picture(&drawing);
        assert_eq!([picture.width, picture.height], [80, 60]);
        let at = |x: usize, y: usize| picture.pixels[y * picture.width + x];
        assert_eq!(at(5, 5), [255; 3]);
        assert_eq!(at(60, 10), [211, 228, 248]); // 18 % of the color on white
        assert_eq!(at(10, 30), Ink::Text.on_light());
        assert_eq!(at(60, 40), Ink::Curve(1).on_light());
        // The letter's stem is its third column of dots; the letter ends at x = 40.
        assert_eq!(at(40 - 10 + 4, 50), Ink::Text.on_light());
    }
}
