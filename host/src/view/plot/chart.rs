//! A chart: a title, a legend, panels one below the other with axes and curves, and a caption that tells how
//! it was measured.

use std::sync::Arc;

use super::drawing::{Anchor, Cells, Drawing, Ink, Item, LETTER_WIDTH};
use super::ticks;
use biplane_geometry::PortableMath;

const WIDTH: f64 = 760.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = WIDTH - 22.0;
/// Above the first legend line, and below the caption.
const TOP: f64 = 46.0;
const BOTTOM: f64 = 14.0;
const LEGEND_LINE: f64 = 19.0;
/// Width of a panel, points.
pub(crate) const PANEL_WIDTH: f64 = RIGHT - LEFT;
/// Above a panel: its label. Below: the ticks' words, and the words of the axis.
const LABEL: f64 = 24.0;
const TICK_WORDS: f64 = 20.0;
const AXIS_WORDS: f64 = 18.0;
const CAPTION_LINE: f64 = 16.0;
/// Intervals between ticks of a linear axis: to the right, and the least height of one upwards.
const X_INTERVALS: usize = 10;
const TICK_HEIGHT: f64 = 25.0;
/// Widths of curves, and radii of their dots.
const LINE: f64 = 2.0;
const WIDE_LINE: f64 = 5.0;
const DOT: f64 = 3.0;
const FIRST_DOT: f64 = 5.0;
const TITLE_SIZE: f64 = 16.0;
const WORDS_SIZE: f64 = 12.5;
const CAPTION_SIZE: f64 = 11.5;

/// How values lie along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm; what is not positive is not shown.
    Logarithmic,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// How.
    pub scale: Scale,
    /// From where to where; without it from the values: a linear one from zero to the last value, to a round
    /// number when upwards.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis.
    pub(crate) fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), ..Self::default() }
    }

    /// From where to where, with these values on it; `rounded` to an end of at most so many intervals.
    fn resolved(&self, values: impl Iterator<Item = f64>, rounded: Option<usize>) -> [f64; 2] {
        let shown = values.filter(|value| self.shows(*value));
        let ends = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
        let found = shown.fold([f64::INFINITY, f64::NEG_INFINITY], ends);
        match (self.range, self.scale) {
            (Some(range), _) => range,
            (None, Scale::Linear) if found[0].min(0.0) >= found[1] => [0.0, 1.0],
            (None, Scale::Linear) => {
                let range = [found[0].min(0.0), found[1]];
                rounded.map_or(range, |maximum| ticks::rounded_range(range, maximum))
            }
            (None, Scale::Logarithmic) if found[0] > found[1] => [1.0, 10.0],
            (None, Scale::Logarithmic) => ticks::decades(found),
        }
    }

    fn shows(&self, value: f64) -> bool {
        value.is_finite() && (self.scale == Scale::Linear || value > 0.0)
    }

    /// Where a value lies in a range, from 0 to 1; cut at its ends.
    fn place(&self, value: f64, [low, high]: [f64; 2]) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - low) / (high - low),
            Scale::Logarithmic => (value / low).portable_log10() / (high / low).portable_log10(),
        };
        share.clamp(0.0, 1.0)
    }

    fn ticks(&self, range: [f64; 2], maximum: usize) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Linear => ticks::linear(range, maximum),
            Scale::Logarithmic => ticks::logarithmic(range),
        }
    }
}

/// A curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Curve {
    /// Its points; one whose x is no number parts the line.
    pub points: Vec<[f64; 2]>,
    /// The band around it: x, lower and upper end.
    pub band: Vec<[f64; 3]>,
    /// Which points have a dot.
    pub dots: Dots,
    /// Whether it is wide enough to be seen below a curve that lies on it.
    pub wide: bool,
}

/// Which points of a curve have a dot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Dots {
    /// None.
    #[default]
    No,
    /// Each.
    Each,
    /// The first.
    First,
}

/// Cells below the curves, from a lower left to an upper right corner in the units of the axes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Backdrop {
    /// The lower left corner.
    pub min: [f64; 2],
    /// The upper right corner.
    pub max: [f64; 2],
    /// The cells.
    pub cells: Arc<Cells>,
}

/// A panel: one curve for each name of the chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Panel {
    /// Its height, points.
    pub height: f64,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// The curves, in the order of the chart's names.
    pub curves: Vec<Curve>,
    /// Whether there are lines to read values by along both axes.
    pub gridded: bool,
    /// What lies below the curves.
    pub backdrop: Option<Backdrop>,
}

/// A chart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chart {
    /// What it shows.
    pub title: String,
    /// A line of the legend for each curve.
    pub names: Vec<String>,
    /// The panels, from above.
    pub panels: Vec<Panel>,
    /// How it was measured; broken into lines as needed.
    pub caption: String,
}

impl Chart {
    /// Lays the chart out.
    pub(crate) fn draw(&self) -> Drawing {
        let mut drawing = Drawing { size: [WIDTH, 0.0], ..Drawing::default() };
        drawing.words(&self.title, [LEFT, 28.0], Anchor::Left, TITLE_SIZE, Ink::Text);
        let mut y = self.draw_legend(&mut drawing, TOP);
        for (index, panel) in self.panels.iter().enumerate() {
            let next = self.panels.get(index + 1);
            let x_words = next.is_none_or(|next| next.x.label != panel.x.label);
            panel.draw(&mut drawing, y + LABEL);
            y += LABEL + panel.height + TICK_WORDS;
            if x_words {
                y += AXIS_WORDS;
                drawing.words(&panel.x.label, [RIGHT, y - 4.0], Anchor::Right, WORDS_SIZE, Ink::Text);
            }
        }
        let maximum = ((RIGHT - LEFT) / (CAPTION_SIZE * LETTER_WIDTH)) as usize;
        for line in broken(&self.caption, maximum) {
            y += CAPTION_LINE;
            drawing.words(line, [LEFT, y], Anchor::Left, CAPTION_SIZE, Ink::Faint);
        }
        drawing.size[1] = y + BOTTOM;
        drawing
    }

    /// A stroke and a name for each curve, one below the other; where the legend ends.
    fn draw_legend(&self, drawing: &mut Drawing, mut y: f64) -> f64 {
        for (index, name) in self.names.iter().enumerate() {
            drawing.line(vec![[LEFT, y], [LEFT + 22.0, y]], 3.0, Ink::Curve(index));
            drawing.words(name, [LEFT + 30.0, y + 4.0], Anchor::Left, WORDS_SIZE, Ink::Text);
            y += LEGEND_LINE;
        }
        y
    }
}

impl Panel {
    /// How many intervals between ticks fit upwards.
    fn y_intervals(&self) -> usize {
        (self.height / TICK_HEIGHT) as usize
    }

    fn draw(&self, drawing: &mut Drawing, top: f64) {
        let curves = self.curves.iter();
        let xs = curves.clone().flat_map(|curve| curve.points.iter().map(|point| point[0]));
        let bands =
            curves.clone().flat_map(|curve| curve.band.iter().flat_map(|[_, low, high]| [*low, *high]));
        let ys = curves.flat_map(|curve| curve.points.iter().map(|point| point[1])).chain(bands);
        let frame = Frame {
            panel: self,
            top,
            x_range: self.x.resolved(xs, None),
            y_range: self.y.resolved(ys, Some(self.y_intervals())),
        };
        frame.draw_backdrop(drawing);
        frame.draw_axes(drawing);
        for (index, curve) in self.curves.iter().enumerate() {
            frame.draw_band(drawing, curve, Ink::Curve(index));
        }
        for (index, curve) in self.curves.iter().enumerate() {
            frame.draw_curve(drawing, curve, Ink::Curve(index));
        }
    }
}

/// A panel at its place.
struct Frame<'a> {
    panel: &'a Panel,
    top: f64,
    x_range: [f64; 2],
    y_range: [f64; 2],
}

impl Frame<'_> {
    fn x(&self, value: f64) -> f64 {
        LEFT + self.panel.x.place(value, self.x_range) * (RIGHT - LEFT)
    }

    fn y(&self, value: f64) -> f64 {
        self.top + (1.0 - self.panel.y.place(value, self.y_range)) * self.panel.height
    }

    fn draw_axes(&self, drawing: &mut Drawing) {
        let bottom = self.top + self.panel.height;
        drawing.words(&self.panel.y.label, [LEFT, self.top - 8.0], Anchor::Left, WORDS_SIZE, Ink::Text);
        for (value, words) in self.panel.y.ticks(self.y_range, self.panel.y_intervals()) {
            let y = self.y(value);
            drawing.line(vec![[LEFT, y], [RIGHT, y]], 1.0, Ink::Grid);
            drawing.words(words, [LEFT - 6.0, y + 4.0], Anchor::Right, WORDS_SIZE, Ink::Faint);
        }
        for (value, words) in self.panel.x.ticks(self.x_range, X_INTERVALS) {
            let x = self.x(value);
            if self.panel.gridded {
                drawing.line(vec![[x, self.top], [x, bottom]], 1.0, Ink::Grid);
            }
            drawing.line(vec![[x, bottom], [x, bottom + 4.0]], 1.0, Ink::Text);
            drawing.words(words, [x, bottom + 17.0], Anchor::Middle, WORDS_SIZE, Ink::Faint);
        }
        drawing.line(vec![[LEFT, self.top], [LEFT, bottom], [RIGHT, bottom]], 1.0, Ink::Text);
    }

    fn draw_backdrop(&self, drawing: &mut Drawing) {
        let Some(Backdrop { min, max, cells }) = &self.panel.backdrop else { return };
        let (left, right) = (self.x(min[0]), self.x(max[0]));
        let (top, bottom) = (self.y(max[1]), self.y(min[1]));
        let (at, size) = ([left, top], [right - left, bottom - top]);
        drawing.items.push(Item::Cells { at, size, cells: Arc::clone(cells) });
    }

    fn draw_band(&self, drawing: &mut Drawing, curve: &Curve, ink: Ink) {
        let shown = |[x, low, high]: &&[f64; 3]| {
            self.panel.x.shows(*x) && self.panel.y.shows(*low) && self.panel.y.shows(*high)
        };
        let band: Vec<&[f64; 3]> = curve.band.iter().filter(shown).collect();
        let upper = band.iter().map(|[x, _, high]| [self.x(*x), self.y(*high)]);
        let lower = band.iter().rev().map(|[x, low, _]| [self.x(*x), self.y(*low)]);
        let corners: Vec<[f64; 2]> = upper.chain(lower).collect();
        if corners.len() > 2 {
            drawing.items.push(Item::Area { corners, ink });
        }
    }

    fn draw_curve(&self, drawing: &mut Drawing, curve: &Curve, ink: Ink) {
        let shown = |[x, y]: &&[f64; 2]| self.panel.x.shows(*x) && self.panel.y.shows(*y);
        let width = if curve.wide { WIDE_LINE } else { LINE };
        for part in curve.points.split(|[x, _]| x.is_nan()) {
            let points: Vec<[f64; 2]> =
                part.iter().filter(shown).map(|[x, y]| [self.x(*x), self.y(*y)]).collect();
            if curve.dots == Dots::Each {
                drawing.items.extend(points.iter().map(|at| Item::Dot { at: *at, radius: DOT, ink }));
            }
            drawing.line(points, width, ink);
        }
        if let (Dots::First, Some([x, y])) = (curve.dots, curve.points.iter().find(shown)) {
            drawing.items.push(Item::Dot { at: [self.x(*x), self.y(*y)], radius: FIRST_DOT, ink });
        }
    }
}

/// Breaks a text into lines of at most so many letters, between words.
fn broken(text: &str, maximum: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= maximum => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::{Axis, Chart, Curve, Dots, LEFT, Panel, RIGHT, Scale, broken};
    use crate::view::plot::drawing::{Drawing, Ink, Item};

    fn chart(scale: Scale, points: Vec<[f64; 2]>, band: Vec<[f64; 3]>) -> Drawing {
        let y = Axis { scale, ..Axis::linear("error (cm)") };
        let curves = vec![Curve { points, band, dots: Dots::Each, ..Curve::default() }];
        let panel = Panel { height: 200.0, x: Axis::linear("time (min)"), y, curves, ..Panel::default() };
        let names = vec!["map".to_owned()];
        Chart { title: "t".to_owned(), names, panels: vec![panel], caption: "c".to_owned() }.draw()
    }

    fn curve(drawing: &Drawing) -> Vec<[f64; 2]> {
        let of_curve = |item: &Item| match item {
            Item::Line { points, width, ink: Ink::Curve(0) } if *width < 3.0 => Some(points.clone()),
            _ => None,
        };
        drawing.items.iter().find_map(of_curve).unwrap()
    }

    #[test]
    fn values_lie_where_their_axes_say() {
        let drawing = chart(Scale::Linear, vec![[0.0, 0.0], [5.0, 10.0], [10.0, 5.0]], Vec::new());
        let points = curve(&drawing);
        assert_eq!(points[0][0], LEFT);
        assert_eq!(points[2][0], RIGHT);
        assert!((points[1][0] - (LEFT + RIGHT) / 2.0).abs() < 1e-9);
        assert_eq!(points[0][1] - points[1][1], 200.0);
        assert_eq!(points[0][1] - points[2][1], 100.0);
        let reported = |wanted: &str| {
            drawing.items.iter().any(|item| matches!(item, Item::Words { text, .. } if text == wanted))
        };
        assert!(["t", "map", "error (cm)", "time (min)", "c", "10"].into_iter().all(reported));
    }

    #[test]
    fn a_logarithmic_axis_shows_equal_ratios_alike_and_leaves_out_what_is_not_positive() {
        let points = curve(&chart(
            Scale::Logarithmic,
            vec![[0.0, 1.0], [1.0, 10.0], [2.0, 100.0], [3.0, 0.0]],
            Vec::new(),
        ));
        assert_eq!(points.len(), 3);
        assert!((points[0][1] - 2.0 * points[1][1] + points[2][1]).abs() < 1e-9);
    }

    #[test]
    fn a_band_goes_forth_above_and_back_below_and_widens_the_axis() {
        let drawing =
            chart(Scale::Linear, vec![[0.0, 1.0], [1.0, 1.0]], vec![[0.0, 0.0, 10.0], [1.0, 0.5, 5.0]]);
        let area = drawing.items.iter().find_map(|item| match item {
            Item::Area { corners, .. } => Some(corners.clone()),
            _ => None,
        });
        let area = area.unwrap();
        assert_eq!(area.len(), 4);
        assert_eq!(area[3][1] - area[0][1], 200.0);
        assert_eq!(area[1][0], RIGHT);
    }

    #[test]
    fn a_chart_without_values_still_has_axes() {
        assert!(!chart(Scale::Logarithmic, Vec::new(), Vec::new()).items.is_empty());
        assert!(!chart(Scale::Linear, vec![[f64::NAN, 1.0]], Vec::new()).items.is_empty());
    }

    #[test]
    fn a_caption_is_broken_between_words() {
        assert_eq!(broken("one two  three", 7), ["one two", "three"]);
        assert_eq!(broken("unbreakable", 4), ["unbreakable"]);
        assert!(broken("", 4).is_empty());
    }
}
