//! Trajectories from above: the way of each in a color of its own, in meters at equal scale, over a floor map
//! where there is one.

use std::sync::Arc;

use super::chart::{Axis, Backdrop, Chart, Curve, Dots, PANEL_WIDTH, Panel};
use super::drawing::Cells;
use crate::recordings::deskew::StampedPose;
use crate::view::floor_map::map_image::MapImage;

/// Least and largest height of the panel, points: a path along one axis has room for words, and a figure fits
/// a page.
const HEIGHT: [f64; 2] = [160.0, 820.0];
/// What is kept free around the paths, as a share of the larger side.
const MARGIN: f64 = 0.03;
/// The least side that is shown, meters: of a robot that stood still.
const MIN_SIDE_M: f64 = 1.0;
/// Poses nearer to each other are one place in the figure, points.
const SAME_PLACE: f64 = 0.4;
/// How dark free floor is, and the darkest wall, of 255.
const FLOOR_SHADE: f64 = 30.0;
const WALL_SHADE: f64 = 235.0;

/// A path to draw.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Path {
    /// What it is called in the legend.
    pub name: String,
    /// Its poses in the frame of the figure, in the order in which they were driven.
    pub poses: Vec<StampedPose>,
    /// Whether others are compared with it.
    pub is_reference: bool,
    /// How far it is from the reference, RMS in meters.
    pub off_m: Option<f64>,
}

impl Path {
    /// How far the robot drove, meters. Gaps are no way.
    fn length_m(&self) -> f64 {
        let steps = self.poses.windows(2).map(|pair| pair[0].step_m(&pair[1]));
        steps.filter(|step_m| *step_m <= StampedPose::LONGEST_STEP_M).sum()
    }

    fn legend(&self) -> String {
        let (name, length_m) = (&self.name, self.length_m());
        match (self.is_reference, self.off_m) {
            (true, _) => format!("{name} (reference): {length_m:.1} m"),
            (false, Some(off_m)) => format!("{name}: {length_m:.1} m, {off_m:.3} m RMS from the reference"),
            (false, None) => format!("{name}: {length_m:.1} m"),
        }
    }

    /// Its line: parted at gaps, without places that cannot be told apart.
    fn curve(&self, same_m: f64) -> Curve {
        let mut points: Vec<[f64; 2]> = Vec::new();
        let mut drawn: Option<&StampedPose> = None;
        for (index, pose) in self.poses.iter().enumerate() {
            let before = index.checked_sub(1).map(|before| &self.poses[before]);
            let is_gap = before.is_some_and(|before| before.step_m(pose) > StampedPose::LONGEST_STEP_M);
            if is_gap {
                points.extend(before.map(|before| [before.x_m, before.y_m]));
                points.push([f64::NAN; 2]);
            }
            let is_last = index + 1 == self.poses.len();
            if is_gap || is_last || drawn.is_none_or(|drawn| drawn.step_m(pose) >= same_m) {
                points.push([pose.x_m, pose.y_m]);
                drawn = Some(pose);
            }
        }
        Curve { points, dots: Dots::First, wide: self.is_reference, ..Curve::default() }
    }
}

/// The cells of a floor map, as they lie below paths.
pub(crate) fn backdrop(image: &MapImage<'_>) -> Backdrop {
    let [columns, rows] = image.size();
    let (min, cell_m) = (image.origin_m(), image.resolution_m());
    let mut cells = Cells { columns: columns as usize, shades: Vec::new() };
    let mut row_of = Vec::new();
    for row in 0..rows {
        image.fill_row(row, &mut row_of);
        cells.shades.extend(row_of.iter().map(|probability| shade(*probability)));
    }
    let max = [min[0] + f64::from(columns) * cell_m, min[1] + f64::from(rows) * cell_m];
    Backdrop { min, max, cells: Arc::new(cells) }
}

/// Nothing where nothing is known; the surer a wall or floor is, the darker.
fn shade(probability: Option<f64>) -> u8 {
    let part = |over: f64| (over / 0.3).clamp(0.0, 1.0);
    match probability {
        None => 0,
        Some(p) if p <= 0.5 => (FLOOR_SHADE * part(0.5 - p)) as u8,
        Some(p) => (WALL_SHADE * part(p - 0.5)) as u8,
    }
}

/// The chart of some paths.
pub(crate) fn chart(paths: &[Path], backdrop: Option<Backdrop>) -> Chart {
    let [min, max] = bounds(paths, backdrop.as_ref());
    let scale = (max[0] - min[0]) / PANEL_WIDTH;
    let height = (max[1] - min[1]) / scale;
    let axis = |label: &str, axis: usize| Axis { range: Some([min[axis], max[axis]]), ..Axis::linear(label) };
    let mut caption = "Dots: where paths begin.".to_owned();
    if paths.iter().any(|path| path.off_m.is_some()) {
        caption.push_str(" Each path is laid best upon the reference.");
    }
    if backdrop.is_some() {
        caption.push_str(" Gray: floor map.");
    }
    Chart {
        title: if paths.len() == 1 { "Trajectory" } else { "Trajectories" }.to_owned(),
        names: paths.iter().map(Path::legend).collect(),
        panels: vec![Panel {
            height,
            x: axis("x (m)", 0),
            y: axis("y (m)", 1),
            curves: paths.iter().map(|path| path.curve(SAME_PLACE * scale)).collect(),
            gridded: true,
            backdrop,
        }],
        caption,
    }
}

/// What is shown: everything, with a margin, in a shape that fits the sheet.
fn bounds(paths: &[Path], backdrop: Option<&Backdrop>) -> [[f64; 2]; 2] {
    let poses = paths.iter().flat_map(|path| path.poses.iter().map(|pose| [pose.x_m, pose.y_m]));
    let corners = backdrop.iter().flat_map(|backdrop| [backdrop.min, backdrop.max]);
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for point in poses.chain(corners) {
        for axis in [0, 1] {
            min[axis] = min[axis].min(point[axis]);
            max[axis] = max[axis].max(point[axis]);
        }
    }
    let mut sides = [0, 1].map(|axis| (max[axis] - min[axis]).max(0.0));
    let margin_m = 2.0 * MARGIN * sides[0].max(sides[1]);
    sides = sides.map(|side| (side + margin_m).max(MIN_SIDE_M));
    let [lowest, highest] = HEIGHT.map(|height| height / PANEL_WIDTH);
    sides = [sides[0].max(sides[1] / highest), sides[1].max(sides[0] * lowest)];
    let middle = [0, 1].map(|axis| (min[axis] + max[axis]) / 2.0);
    let middle = middle.map(|value| if value.is_finite() { value } else { 0.0 });
    let end = |sign: f64| [0, 1].map(|axis| middle[axis] + sign * sides[axis] / 2.0);
    [end(-1.0), end(1.0)]
}

#[cfg(test)]
mod tests {
    use super::{HEIGHT, Path, backdrop, bounds, chart, shade};
    use crate::recordings::deskew::StampedPose;
    use crate::slam::occupancy::{OccupancyGrid, OccupancyParams, Ray};
    use crate::view::floor_map::map_image::MapImage;
    use crate::view::plot::chart::PANEL_WIDTH;

    fn path(name: &str, places: &[[f64; 2]]) -> Path {
        let pose = |&[x_m, y_m]: &[f64; 2]| StampedPose { x_m, y_m, ..StampedPose::default() };
        Path { name: name.to_owned(), poses: places.iter().map(pose).collect(), ..Path::default() }
    }

    #[test]
    fn a_meter_is_as_long_upwards_as_to_the_right() {
        for places in [[[0.0, 0.0], [40.0, 10.0]], [[0.0, 0.0], [3.0, 90.0]], [[5.0, 5.0], [5.0, 5.0]]] {
            let panel = &chart(&[path("a", &places)], None).panels[0];
            let [x, y] = [&panel.x, &panel.y].map(|axis| axis.range.unwrap());
            let scales = [(x[1] - x[0]) / PANEL_WIDTH, (y[1] - y[0]) / panel.height];
            assert!((scales[0] - scales[1]).abs() < 1e-12, "{scales:?}");
            assert!(panel.height >= HEIGHT[0] - 1e-9 && panel.height <= HEIGHT[1] + 1e-9);
            let inside = |[px, py]: [f64; 2]| x[0] < px && px < x[1] && y[0] < py && py < y[1];
            assert!(places.into_iter().all(inside), "{x:?} {y:?}");
        }
        assert!(bounds(&[], None).as_flattened().iter().all(|value| value.is_finite()));
    }

    #[test]
    fn a_line_is_parted_where_the_robot_did_not_drive_and_keeps_its_ends() {
        let far = path("a", &[[0.0, 0.0], [1.0, 0.0], [1.001, 0.0], [9.0, 0.0], [10.0, 0.0], [10.001, 0.0]]);
        let shown = |value: &[f64; 2]| if value[0].is_nan() { -1.0 } else { value[0] };
        let points: Vec<f64> = far.curve(0.1).points.iter().map(shown).collect();
        assert_eq!(points, [0.0, 1.0, 1.001, -1.0, 9.0, 10.0, 10.001]);
        assert!((far.length_m() - 2.002).abs() < 1e-9);
    }

    #[test]
    fn the_legend_names_lengths_and_what_was_compared() {
        let truth = Path { is_reference: true, ..path("truth", &[[0.0, 0.0], [2.0, 0.0]]) };
        let run = Path { off_m: Some(0.0125), ..path("run", &[[0.0, 0.0], [1.0, 0.0]]) };
        let both = chart(&[truth, run], None);
        assert_eq!(both.names, ["truth (reference): 2.0 m", "run: 1.0 m, 0.013 m RMS from the reference"]);
        assert!(both.caption.contains("upon the reference") && !both.caption.contains("floor map"));
        assert!(both.panels[0].curves[0].wide && !both.panels[0].curves[1].wide);
        assert_eq!(chart(&[path("a", &[[0.0; 2]])], None).title, "Trajectory");
    }

    #[test]
    fn a_map_lies_below_where_it_was_seen() {
        let mut grid =
            OccupancyGrid::new(OccupancyParams { resolution_m: 1.0, ..OccupancyParams::default() });
        for _ in 0..12 {
            grid.add_scan(&[Ray { from_m: [0.5, 0.5], to_m: [3.5, 1.5] }]);
        }
        let (image, _) = MapImage::new(&grid, &[]).unwrap();
        let found = backdrop(&image);
        assert_eq!((found.min, found.max), ([0.0, 0.0], [4.0, 2.0]));
        // The first row is the upper one, where the beam ends.
        assert_eq!([found.cells.columns, found.cells.rows()], [4, 2]);
        assert!(found.cells.shades[3] > 200 && found.cells.shades[4] > 0 && found.cells.shades[4] < 40);
        assert_eq!([shade(None), shade(Some(0.5))], [0, 0]);
        assert!(chart(&[], Some(found)).caption.contains("floor map"));
    }
}
