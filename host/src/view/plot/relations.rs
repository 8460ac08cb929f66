//! The error along a run: each relation of the relations metric at the time of its later pose, as running
//! median and 90 % band.

use super::chart::{Axis, Chart, Curve, Panel, Scale};
use super::running::running;
use super::table::{Table, TableError};

/// Places along a curve.
const PLACES: usize = 160;

/// How the errors are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RelationsPlotParams {
    /// Relations of which the median is taken. Larger is smoother and hides short events.
    pub window: usize,
    /// Upwards by the logarithm: runs of very different quality can be compared, small errors look large.
    pub logarithmic: bool,
}

impl Default for RelationsPlotParams {
    fn default() -> Self {
        Self { window: 101, logarithmic: false }
    }
}

/// The errors of a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RunErrors {
    /// What the run is called in the legend.
    pub name: String,
    /// Time in seconds, meters and radians of each relation, in the order of time.
    errors: Vec<[f64; 3]>,
}

/// The errors that `biplane evaluate relations --per-relation` wrote.
///
/// # Errors
/// When a column is missing or a field is no number.
pub(crate) fn read(name: &str, table: &Table) -> Result<RunErrors, TableError> {
    let (a, b) = (table.numbers("stamp_a")?, table.numbers("stamp_b")?);
    let (translation_m, rotation_rad) = (table.numbers("translation_m")?, table.numbers("rotation_rad")?);
    let mut errors: Vec<[f64; 3]> =
        (0..a.len()).map(|row| [a[row].max(b[row]), translation_m[row], rotation_rad[row]]).collect();
    errors.sort_by(|one, other| one[0].total_cmp(&other[0]));
    Ok(RunErrors { name: name.to_owned(), errors })
}

impl RunErrors {
    fn mean(&self, column: usize) -> f64 {
        self.errors.iter().map(|error| error[column]).sum::<f64>() / self.errors.len() as f64
    }

    fn curve(&self, start_s: f64, column: usize, unit: f64, window: usize) -> Curve {
        let points: Vec<[f64; 2]> =
            self.errors.iter().map(|error| [(error[0] - start_s) / 60.0, unit * error[column]]).collect();
        let found = running(&points, window, PLACES);
        Curve {
            points: found.iter().map(|(x, spread)| [*x, spread.median]).collect(),
            band: found.iter().map(|(x, spread)| [*x, spread.band[0], spread.band[1]]).collect(),
            ..Curve::default()
        }
    }
}

/// The chart of some runs.
pub(crate) fn chart(runs: &[RunErrors], params: &RelationsPlotParams) -> Chart {
    let start_s = runs.iter().map(|run| run.errors[0][0]).fold(f64::INFINITY, f64::min);
    let scale = if params.logarithmic { Scale::Logarithmic } else { Scale::Linear };
    let panel = |label: &str, column: usize, unit: f64| Panel {
        height: 170.0,
        x: Axis::linear("time since the first relation (min)"),
        y: Axis { scale, ..Axis::linear(label) },
        curves: runs.iter().map(|run| run.curve(start_s, column, unit, params.window)).collect(),
        ..Panel::default()
    };
    let name = |run: &RunErrors| {
        format!(
            "{}: mean {:.4} m, {:.2} deg over {} relations",
            run.name,
            run.mean(1),
            run.mean(2).to_degrees(),
            run.errors.len()
        )
    };
    Chart {
        title: "Error along the run".to_owned(),
        names: runs.iter().map(name).collect(),
        panels: vec![panel("translation (cm)", 1, 100.0), panel("rotation (deg)", 2, 1_f64.to_degrees())],
        caption: format!(
            "Line: running median of {} relations, each at the time of its later pose. Band: 90 % of them.",
            params.window
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::{RelationsPlotParams, chart, read};
    use crate::view::plot::chart::Scale;
    use crate::view::plot::table::Table;

    #[test]
    fn relations_lie_at_their_later_pose_in_centimeters_and_degrees() {
        let text = "stamp_a,stamp_b,translation_m,rotation_rad\n\
            160,40,0.03,0.1\n\
            40,10,0.01,0\n\
            20,100,0.02,0.2\n";
        let run = read("map", &Table::read(text.as_bytes()).unwrap()).unwrap();
        let chart = chart(&[run], &RelationsPlotParams { window: 1, logarithmic: true });
        assert_eq!(chart.panels[1].y.scale, Scale::Logarithmic);
        assert_eq!(chart.names, ["map: mean 0.0200 m, 5.73 deg over 3 relations"]);
        assert_eq!(chart.panels[0].curves[0].points, [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]]);
        let turned = chart.panels[1].curves[0].points[1][1];
        assert!((turned - 0.2_f64.to_degrees()).abs() < 1e-12);
    }

    #[test]
    fn a_wider_window_is_smoother() {
        let mut text = "stamp_a,stamp_b,translation_m,rotation_rad\n".to_owned();
        for second in 0..50 {
            text.push_str(&format!("{second},{second},{},0\n", i32::from(second % 3 == 0)));
        }
        let run = read("map", &Table::read(text.as_bytes()).unwrap()).unwrap();
        let highest = |window: usize| {
            let chart = chart(
                std::slice::from_ref(&run),
                &RelationsPlotParams { window, ..RelationsPlotParams::default() },
            );
            chart.panels[0].curves[0].points.iter().map(|point| point[1]).fold(0.0, f64::max)
        };
        assert_eq!(highest(1), 100.0);
        assert!(highest(20) < 100.0);
    }
}
