//! Iterations of a matcher: what each step gained and how far it went, over all matches of a journal.
//!
//! A row of the table is one iteration of one match. Matches need different numbers of iterations, so figures
//! at a late one are those of the matches that still went on. A scan can be matched more than once.

use super::chart::{Axis, Chart, Curve, Dots, Panel, Scale};
use super::running::spread;
use super::table::{Table, TableError};

/// An iteration that fewer scans than this share came to is not shown: chance, not a curve.
const MIN_SHARE: f64 = 0.005;
/// A curve of more points has no dots: they would touch.
const MAX_DOTS: usize = 30;

/// The iterations of one journal.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Journal {
    /// What it is called in the legend.
    pub name: String,
    /// By iteration, from the first on.
    iterations: Vec<Iteration>,
}

/// What all scans did at one iteration.
#[derive(Clone, Debug, Default, PartialEq)]
struct Iteration {
    number: f64,
    /// Cost over the first iteration's, per cent.
    cost_percent: Vec<f64>,
    step_mm: Vec<f64>,
    step_deg: Vec<f64>,
}

/// Reads a journal.
///
/// # Errors
/// When a column is missing or a field is no number.
pub(crate) fn read(name: &str, table: &Table) -> Result<Journal, TableError> {
    let stamps = table.texts("stamp_s")?;
    let (number, cost) = (table.numbers("iteration")?, table.numbers("cost")?);
    let (step_m, step_rad) = (table.numbers("step_m")?, table.numbers("step_rad")?);
    let mut iterations: Vec<Iteration> = Vec::new();
    let mut first_row = 0;
    for row in 0..stamps.len() {
        // A scan's rows follow each other; where the count does not go up, another match has begun.
        if row > 0 && (stamps[row] != stamps[row - 1] || number[row] <= number[row - 1]) {
            first_row = row;
        }
        let index = row - first_row;
        if index == iterations.len() {
            iterations.push(Iteration { number: number[row], ..Iteration::default() });
        }
        let iteration = &mut iterations[index];
        iteration.cost_percent.push(100.0 * cost[row] / cost[first_row]);
        iteration.step_mm.push(1000.0 * step_m[row]);
        iteration.step_deg.push(step_rad[row].to_degrees().abs());
    }
    let scans = iterations.first().map_or(0, |first| first.step_mm.len());
    iterations.retain(|iteration| iteration.step_mm.len() as f64 >= MIN_SHARE * scans as f64);
    Ok(Journal { name: name.to_owned(), iterations })
}

impl Journal {
    fn matches(&self) -> usize {
        self.iterations.first().map_or(0, |first| first.step_mm.len())
    }

    fn curve(&self, of: fn(&Iteration) -> &[f64]) -> Curve {
        let found = self
            .iterations
            .iter()
            .filter_map(|iteration| Some((iteration.number, spread(of(iteration).iter().copied())?)));
        let found: Vec<_> = found.collect();
        Curve {
            points: found.iter().map(|(number, spread)| [*number, spread.median]).collect(),
            band: found.iter().map(|(number, spread)| [*number, spread.band[0], spread.band[1]]).collect(),
            dots: dots(found.len()),
            ..Curve::default()
        }
    }

    fn going_on(&self) -> Curve {
        let share = |iteration: &Iteration| 100.0 * iteration.step_mm.len() as f64 / self.matches() as f64;
        let points = self.iterations.iter().map(|iteration| [iteration.number, share(iteration)]).collect();
        Curve { points, dots: dots(self.iterations.len()), ..Curve::default() }
    }
}

/// Dots where they do not touch.
fn dots(points: usize) -> Dots {
    if points <= MAX_DOTS { Dots::Each } else { Dots::No }
}

/// The chart of some journals.
pub(crate) fn chart(journals: &[Journal]) -> Chart {
    let panel = |y: Axis, of: fn(&Iteration) -> &[f64]| Panel {
        height: 130.0,
        x: Axis::linear("iteration"),
        y,
        curves: journals.iter().map(|journal| journal.curve(of)).collect(),
        ..Panel::default()
    };
    let logarithmic = |label: &str| Axis { scale: Scale::Logarithmic, ..Axis::linear(label) };
    let going_on = Panel {
        height: 90.0,
        x: Axis::linear("iteration"),
        y: Axis { range: Some([0.0, 100.0]), ..Axis::linear("matches that still go on (%)") },
        curves: journals.iter().map(Journal::going_on).collect(),
        ..Panel::default()
    };
    Chart {
        title: "Iterations".to_owned(),
        names: journals
            .iter()
            .map(|journal| format!("{}: {} matches", journal.name, journal.matches()))
            .collect(),
        panels: vec![
            panel(Axis::linear("cost (% of the first)"), |iteration| &iteration.cost_percent),
            panel(logarithmic("step (mm)"), |iteration| &iteration.step_mm),
            panel(logarithmic("turn (deg)"), |iteration| &iteration.step_deg),
            going_on,
        ],
        caption: format!(
            "Line: median over the matches that still went on at this iteration. Band: 90 % of them. Left out: iterations that fewer \
             than {} % of them came to.",
            100.0 * MIN_SHARE
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::{chart, read};
    use crate::view::plot::table::Table;

    #[test]
    fn iterations_are_gathered_over_scans_of_different_length() {
        let text = "stamp_s,iteration,x_m,y_m,theta_rad,cost,step_m,step_rad,used\n\
            1.5,0,0,0,0,200,0.010,0.1,180\n\
            1.5,1,0,0,0,100,0.001,-0.01,180\n\
            1.6,0,0,0,0,10,0.030,0.3,180\n\
            1.6,0,0,0,0,10,0.020,0.2,180\n";
        let journal = read("map", &Table::read(text.as_bytes()).unwrap()).unwrap();
        let chart = chart(&[journal]);
        assert_eq!(chart.names, ["map: 3 matches"]);
        let points = |panel: usize| &chart.panels[panel].curves[0].points;
        assert_eq!(*points(0), [[0.0, 100.0], [1.0, 50.0]]);
        assert_eq!(*points(1), [[0.0, 20.0], [1.0, 1.0]]);
        assert!((points(2)[1][1] - 0.01_f64.to_degrees()).abs() < 1e-12);
        assert_eq!(*points(3), [[0.0, 100.0], [1.0, 100.0 / 3.0]]);
    }

    #[test]
    fn an_iteration_of_one_scan_in_a_thousand_is_not_shown() {
        let mut text = "stamp_s,iteration,cost,step_m,step_rad\n".to_owned();
        for scan in 0..1000 {
            text.push_str(&format!("{scan},0,1,1,1\n"));
        }
        text.push_str("999,1,1,1,1\n");
        let chart = chart(&[read("map", &Table::read(text.as_bytes()).unwrap()).unwrap()]);
        assert_eq!(chart.names, ["map: 1000 matches"]);
        assert_eq!(chart.panels[1].curves[0].points.len(), 1);
    }
}
