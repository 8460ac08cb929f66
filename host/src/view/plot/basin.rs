//! Basin of convergence (figure 2 of the paper, over many pairs): how often a matcher finds the pose, by how
//! far off it began.
//!
//! A row of the table is one start of one pair of scans: how far off it began and how far off it ended.

use super::chart::{Axis, Chart, Curve, Dots, Panel};
use super::running::spread;
use super::table::{Table, TableError};

/// What counts as found, and as wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BasinParams {
    /// Found: at most this far off, meters. Larger also counts optima that are not the right one.
    pub within_m: f64,
    /// Found: at most this far turned, degrees.
    pub within_deg: f64,
    /// Grossly wrong: farther off than this, meters: a pose that would spoil a map.
    pub gross_m: f64,
    /// Grossly wrong: turned farther than this, degrees.
    pub gross_deg: f64,
}

impl Default for BasinParams {
    fn default() -> Self {
        Self { within_m: 0.02, within_deg: 0.5, gross_m: 0.1, gross_deg: 2.0 }
    }
}

/// All starts of one matcher.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Basin {
    /// The matcher.
    pub matcher: String,
    /// The table that it is from.
    pub table: String,
    starts: Vec<Start>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Start {
    begun_off_deg: f64,
    error_m: f64,
    error_deg: f64,
    cpu_us: f64,
}

/// The matchers of a table, in the order in which they come. `name` is the table's: it tells runs of one
/// matcher apart.
///
/// # Errors
/// When a column is missing or a field is no number.
pub(crate) fn read(name: &str, table: &Table) -> Result<Vec<Basin>, TableError> {
    let (begun, cpu_us) = (table.numbers("start_theta_rad")?, table.numbers("cpu_us")?);
    let (error_m, error_rad) = (table.numbers("error_m")?, table.numbers("error_rad")?);
    let mut basins: Vec<Basin> = Vec::new();
    for (row, matcher) in table.texts("matcher")?.into_iter().enumerate() {
        let start = Start {
            begun_off_deg: begun[row].to_degrees().abs(),
            error_m: error_m[row],
            error_deg: error_rad[row].to_degrees().abs(),
            cpu_us: cpu_us[row],
        };
        match basins.iter_mut().find(|basin| basin.matcher == matcher) {
            Some(basin) => basin.starts.push(start),
            None => basins.push(Basin {
                matcher: matcher.to_owned(),
                table: name.to_owned(),
                starts: vec![start],
            }),
        }
    }
    Ok(basins)
}

impl BasinParams {
    fn found(&self, start: &Start) -> bool {
        start.error_m <= self.within_m && start.error_deg <= self.within_deg
    }

    fn gross(&self, start: &Start) -> bool {
        // Written so that an error that is no number is gross.
        !(start.error_m <= self.gross_m && start.error_deg <= self.gross_deg)
    }
}

/// Per cent of the starts that are so.
fn share(starts: &[Start], is: impl Fn(&Start) -> bool) -> f64 {
    100.0 * starts.iter().filter(|start| is(start)).count() as f64 / starts.len().max(1) as f64
}

/// Share by initial heading error, to the nearest half degree.
fn curve(basin: &Basin, is: impl Fn(&Start) -> bool) -> Curve {
    let mut halves: Vec<(i64, Vec<Start>)> = Vec::new();
    for start in &basin.starts {
        let half = (2.0 * start.begun_off_deg).round() as i64;
        match halves.iter_mut().find(|(known, _)| *known == half) {
            Some((_, starts)) => starts.push(*start),
            None => halves.push((half, vec![*start])),
        }
    }
    halves.sort_by_key(|(half, _)| *half);
    let points = halves.iter().map(|(half, starts)| [*half as f64 / 2.0, share(starts, &is)]).collect();
    Curve { points, dots: Dots::Each, ..Curve::default() }
}

/// The chart of some matchers: shares found and grossly wrong against the initial heading error.
pub(crate) fn chart(basins: &[Basin], params: &BasinParams) -> Chart {
    let name = |basin: &Basin| {
        let cpu = spread(basin.starts.iter().map(|start| start.cpu_us));
        let cpu = cpu.map_or_else(String::new, |cpu| format!(", median {:.2} ms", cpu.median / 1000.0));
        let (found, gross) = (
            share(&basin.starts, |start| params.found(start)),
            share(&basin.starts, |start| params.gross(start)),
        );
        let twice = basins.iter().filter(|other| other.matcher == basin.matcher).count() > 1;
        let matcher =
            if twice { format!("{} ({})", basin.matcher, basin.table) } else { basin.matcher.clone() };
        format!("{matcher}: {found:.1} % found, {gross:.1} % grossly wrong{cpu}")
    };
    let x = Axis::linear("initial heading error (deg)");
    let found = Panel {
        height: 240.0,
        x: x.clone(),
        y: Axis { range: Some([0.0, 100.0]), ..Axis::linear("found (% of the starts)") },
        curves: basins.iter().map(|basin| curve(basin, |start| params.found(start))).collect(),
        ..Panel::default()
    };
    let gross = Panel {
        height: 110.0,
        x,
        y: Axis::linear("grossly wrong (% of the starts)"),
        curves: basins.iter().map(|basin| curve(basin, |start| params.gross(start))).collect(),
        ..Panel::default()
    };
    let starts = basins.iter().map(|basin| basin.starts.len()).max().unwrap_or(0);
    Chart {
        title: "Basin of convergence".to_owned(),
        names: basins.iter().map(name).collect(),
        panels: vec![found, gross],
        caption: format!(
            "{starts} starts a matcher. Found: within {} cm and {} deg. Grossly wrong: more than {} cm or {} deg off. Time: CPU of a match, the reference prepared before.",
            100.0 * params.within_m,
            params.within_deg,
            100.0 * params.gross_m,
            params.gross_deg
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::{BasinParams, chart, read};
    use crate::view::plot::table::Table;

    const HEADER: &str =
        "matcher,stamp_a,stamp_b,start_x_m,start_y_m,start_theta_rad,error_m,error_rad,iterations,cpu_us";

    #[test]
    fn shares_are_counted_by_heading_error_on_both_sides() {
        // Starts of 10 deg on either side: one found, one a little off; of 30 deg: one found, one far off,
        // one lost.
        let rows = "map,1,2,0.1,0.1,0.17453,0.019,0.001,5,200\n\
            map,1,2,0.1,-0.1,-0.17453,0.021,0.001,5,300\n\
            map,1,2,0.1,0.1,0.5236,0.001,-0.0087,5,100\n\
            map,1,2,0.1,0.1,-0.5236,0.001,0.0350,5,400\n\
            map,1,2,0.1,0.1,-0.5236,nan,nan,5,400\n\
            gradient,1,2,0.1,0.1,0,0.0,0.0,5,100\n";
        let basins = read("t", &Table::read(format!("{HEADER}\n{rows}").as_bytes()).unwrap()).unwrap();
        let chart = chart(&basins, &BasinParams::default());
        assert_eq!(
            chart.names,
            [
                "map: 40.0 % found, 40.0 % grossly wrong, median 0.30 ms",
                "gradient: 100.0 % found, 0.0 % grossly wrong, median 0.10 ms"
            ]
        );
        let [found, gross] = &chart.panels[..] else { panic!("{chart:?}") };
        assert_eq!(found.curves[0].points, [[10.0, 50.0], [30.0, 100.0 / 3.0]]);
        assert_eq!(gross.curves[0].points, [[10.0, 0.0], [30.0, 200.0 / 3.0]]);
        assert_eq!(found.curves[1].points, [[0.0, 100.0]]);
    }

    #[test]
    fn every_bound_decides() {
        let rows = "map,1,2,0,0,0,0.05,0.02,5,200\n";
        let basins = read("t", &Table::read(format!("{HEADER}\n{rows}").as_bytes()).unwrap()).unwrap();
        let name = |params: BasinParams| chart(&basins, &params).names[0].clone();
        let default = BasinParams::default();
        assert!(name(default).starts_with("map: 0.0 % found, 0.0 % gross"));
        assert!(name(BasinParams { within_m: 0.06, ..default }).starts_with("map: 0.0 % found"));
        assert!(
            name(BasinParams { within_m: 0.06, within_deg: 2.0, ..default })
                .starts_with("map: 100.0 % found")
        );
        assert!(name(BasinParams { gross_m: 0.04, ..default }).contains(" 100.0 % gross"));
        assert!(name(BasinParams { gross_deg: 1.0, ..default }).contains(" 100.0 % gross"));
    }
}
