//! Captions: capitals and digits of five by seven dots, so that no font file is needed.

use super::Picture;
use crate::model::palette::Rgb;

/// Columns of a glyph and the gap after it.
const ADVANCE: usize = 6;
/// Rows of a glyph.
pub(crate) const HEIGHT: usize = 7;

/// Rows of a glyph from the top, five bits each, the highest on the left; unknown characters are blank.
fn glyph(character: char) -> [u8; HEIGHT] {
    match character.to_ascii_uppercase() {
        'A' => [14, 17, 17, 31, 17, 17, 17],
        'B' => [30, 17, 17, 30, 17, 17, 30],
        'C' => [14, 17, 16, 16, 16, 17, 14],
        'D' => [30, 17, 17, 17, 17, 17, 30],
        'E' => [31, 16, 16, 30, 16, 16, 31],
        'F' => [31, 16, 16, 30, 16, 16, 16],
        'G' => [14, 17, 16, 23, 17, 17, 15],
        'H' => [17, 17, 17, 31, 17, 17, 17],
        'I' => [14, 4, 4, 4, 4, 4, 14],
        'J' => [7, 2, 2, 2, 2, 18, 12],
        'K' => [17, 18, 20, 24, 20, 18, 17],
        'L' => [16, 16, 16, 16, 16, 16, 31],
        'M' => [17, 27, 21, 21, 17, 17, 17],
        'N' => [17, 17, 25, 21, 19, 17, 17],
        'O' => [14, 17, 17, 17, 17, 17, 14],
        'P' => [30, 17, 17, 30, 16, 16, 16],
        'Q' => [14, 17, 17, 17, 21, 18, 13],
        'R' => [30, 17, 17, 30, 20, 18, 17],
        'S' => [15, 16, 16, 14, 1, 1, 30],
        'T' => [31, 4, 4, 4, 4, 4, 4],
        'U' => [17, 17, 17, 17, 17, 17, 14],
        'V' => [17, 17, 17, 17, 17, 10, 4],
        'W' => [17, 17, 17, 21, 21, 21, 10],
        'X' => [17, 17, 10, 4, 10, 17, 17],
        'Y' => [17, 17, 17, 10, 4, 4, 4],
        'Z' => [31, 1, 2, 4, 8, 16, 31],
        '0' => [14, 17, 19, 21, 25, 17, 14],
        '1' => [4, 12, 4, 4, 4, 4, 14],
        '2' => [14, 17, 1, 2, 4, 8, 31],
        '3' => [31, 2, 4, 2, 1, 17, 14],
        '4' => [2, 6, 10, 18, 31, 2, 2],
        '5' => [31, 16, 30, 1, 1, 17, 14],
        '6' => [6, 8, 16, 30, 17, 17, 14],
        '7' => [31, 1, 2, 4, 8, 8, 8],
        '8' => [14, 17, 17, 14, 17, 17, 14],
        '9' => [14, 17, 17, 15, 1, 2, 12],
        ',' => [0, 0, 0, 0, 12, 4, 8],
        '.' => [0, 0, 0, 0, 0, 12, 12],
        ':' => [0, 12, 12, 0, 12, 12, 0],
        '+' => [0, 4, 4, 31, 4, 4, 0],
        '-' => [0, 0, 0, 31, 0, 0, 0],
        '(' => [2, 4, 8, 8, 8, 4, 2],
        ')' => [8, 4, 2, 2, 2, 4, 8],
        '/' => [1, 1, 2, 4, 8, 16, 16],
        '=' => [0, 0, 31, 0, 31, 0, 0],
        '_' => [0, 0, 0, 0, 0, 0, 31],
        '%' => [24, 25, 2, 4, 8, 19, 3],
        _ => [0; HEIGHT],
    }
}

/// Width of a line of words, pixels, with `dot` pixels a dot.
pub(crate) fn width(text: &str, dot: usize) -> usize {
    (text.chars().count() * ADVANCE).saturating_sub(1) * dot
}

/// Writes a line of text into a picture with its top left corner at a place; `dot` pixels a dot.
pub(crate) fn write_text(picture: &mut Picture, text: &str, [left, top]: [usize; 2], dot: usize, color: Rgb) {
    for (index, character) in text.chars().enumerate() {
        for (row, bits) in glyph(character).into_iter().enumerate() {
            for column in (0..5).filter(|column| bits >> (4 - column) & 1 == 1) {
                fill(picture, [left + (index * ADVANCE + column) * dot, top + row * dot], dot, color);
            }
        }
    }
}

fn fill(picture: &mut Picture, [left, top]: [usize; 2], side: usize, color: Rgb) {
    for y in top..(top + side).min(picture.height) {
        for x in left..(left + side).min(picture.width) {
            picture.pixels[y * picture.width + x] = color;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{HEIGHT, Picture, write_text};

    #[test]
    fn text_is_drawn_dot_by_dot_and_cut_at_the_edge() {
        let mut picture = Picture::blank(12, HEIGHT);
        write_text(&mut picture, "Lt+", [0, 0], 1, [0; 3]);
        let rows: Vec<String> = picture
            .pixels
            .chunks(12)
            .map(|row| row.iter().map(|pixel| if *pixel == [0; 3] { '#' } else { '.' }).collect())
            .collect();
        let expected = [
            "#.....#####.",
            "#.......#...",
            "#.......#...",
            "#.......#...",
            "#.......#...",
            "#.......#...",
            "#####...#...",
        ];
        assert_eq!(rows, expected);
    }
}
