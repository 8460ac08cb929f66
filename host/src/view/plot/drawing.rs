//! Lines, areas and words on a sheet: what a chart becomes before it is written as SVG or PNG.
//!
//! Places are in points from the top left, y downwards. Colors are named by what they are for, so that a
//! picture can have a light and a dark look.

use std::sync::Arc;

use crate::model::palette::Rgb;

/// What something is drawn for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ink {
    /// The sheet.
    Paper,
    /// Words, and the frame of a panel.
    Text,
    /// Words of less weight.
    Faint,
    /// Lines to read values by.
    Grid,
    /// The curve with this index; they repeat after [`CURVES`].
    Curve(usize),
}

/// How many curves have a color of their own.
pub(crate) const CURVES: usize = 6;

const CURVES_ON_LIGHT: [Rgb; CURVES] =
    [[9, 105, 218], [209, 87, 10], [26, 127, 55], [130, 80, 223], [191, 57, 137], [87, 96, 106]];
const CURVES_ON_DARK: [Rgb; CURVES] =
    [[88, 166, 255], [240, 136, 62], [63, 185, 80], [188, 140, 255], [247, 120, 186], [139, 148, 158]];

impl Ink {
    /// Its color on light paper.
    pub(crate) fn on_light(self) -> Rgb {
        match self {
            Self::Paper => [255, 255, 255],
            Self::Text => [31, 35, 40],
            Self::Faint => [89, 99, 110],
            Self::Grid => [223, 227, 232],
            Self::Curve(index) => CURVES_ON_LIGHT[index % CURVES],
        }
    }

    /// Its color on dark paper.
    pub(crate) fn on_dark(self) -> Rgb {
        match self {
            Self::Paper => [13, 17, 23],
            Self::Text => [230, 237, 243],
            Self::Faint => [145, 152, 161],
            Self::Grid => [48, 54, 61],
            Self::Curve(index) => CURVES_ON_DARK[index % CURVES],
        }
    }
}

/// Which point of a line of words is at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    /// Its left end.
    Left,
    /// Its middle.
    Middle,
    /// Its right end.
    Right,
}

/// One thing on the sheet.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Item {
    /// A line through points.
    Line {
        /// The points, in order.
        points: Vec<[f64; 2]>,
        /// Its width.
        width: f64,
        /// Its color.
        ink: Ink,
    },
    /// A closed area, thin enough to see through.
    Area {
        /// Its corners, in order.
        corners: Vec<[f64; 2]>,
        /// Its color.
        ink: Ink,
    },
    /// A dot.
    Dot {
        /// Its middle.
        at: [f64; 2],
        /// Its radius.
        radius: f64,
        /// Its color.
        ink: Ink,
    },
    /// Cells, shaded gray: a map below curves.
    Cells {
        /// The top left corner.
        at: [f64; 2],
        /// Width and height.
        size: [f64; 2],
        /// The cells.
        cells: Arc<Cells>,
    },
    /// A line of words.
    Words {
        /// The place of its anchor, on the line that letters stand on.
        at: [f64; 2],
        /// Which point of it that is.
        anchor: Anchor,
        /// Height of the letters, as fonts count it.
        size: f64,
        /// Its color.
        ink: Ink,
        /// The words.
        text: String,
    },
}

/// Shaded cells, row by row from the top left.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cells {
    /// Cells of a row.
    pub columns: usize,
    /// How much of the gray of [`CELL_GRAY`] shows in each: 0 nothing, 255 all of it.
    pub shades: Vec<u8>,
}

impl Cells {
    /// How many rows there are.
    pub(crate) fn rows(&self) -> usize {
        self.shades.len() / self.columns.max(1)
    }
}

/// The gray of cells: it stands out from light paper and from dark.
pub(crate) const CELL_GRAY: u8 = 118;

/// How much of an area's color shows.
pub(crate) const AREA_OPACITY: f64 = 0.18;

/// Width of a letter over its size, on average: both for SVG's sans-serif and for the dots of PNG.
pub(crate) const LETTER_WIDTH: f64 = 0.56;

/// A sheet. Later things lie on earlier ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Drawing {
    /// Width and height.
    pub size: [f64; 2],
    /// What is on it.
    pub items: Vec<Item>,
}

impl Drawing {
    /// Draws a line.
    pub(crate) fn line(&mut self, points: Vec<[f64; 2]>, width: f64, ink: Ink) {
        self.items.push(Item::Line { points, width, ink });
    }

    /// Writes a line of words.
    pub(crate) fn words(
        &mut self,
        text: impl Into<String>,
        at: [f64; 2],
        anchor: Anchor,
        size: f64,
        ink: Ink,
    ) {
        self.items.push(Item::Words { at, anchor, size, ink, text: text.into() });
    }
}
