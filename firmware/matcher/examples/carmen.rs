//! Runs the tracker over a CARMEN log (FLASER lines) and writes `t x y theta` lines; for development and measurements.
//!
//! `cargo run --release -p biplane-matcher --example carmen -- intel.log -o traj.txt [--table scans.txt] [--method gradient] [--set align.outlier_m=0.05]
//! [--every 2] [--odom-scale 0.9] [--no-odom]`

use std::error::Error;
use std::fmt::Write as _;

use biplane_clock::{monotonic_ns, peak_memory_bytes, process_cpu_ns};
use biplane_matcher::{Beam, Outcome, Pose2, Scan, Tracker, TrackerParams, wrap_angle};

/// Ranges from here on mean "nothing in range" in these logs.
const NO_RETURN_M: f32 = 49.9;
const TURN_S: f64 = 0.01332;

struct Options {
    input: String,
    output: Option<String>,
    table: Option<String>,
    params: TrackerParams,
    every: usize,
    odom_scale: f64,
    no_odom: bool,
}

struct Line {
    stamp_s: f64,
    ranges_m: Vec<f32>,
    odom_from_base: Pose2,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = parse_options()?;
    let text = std::fs::read_to_string(&options.input)?;
    let lines: Vec<Line> = text.lines().filter_map(parse_line).step_by(options.every).collect();
    let mut tracker = Tracker::new(options.params);
    let mut trajectory = String::new();
    let mut table = String::new();
    let mut durations_ns = Vec::with_capacity(lines.len());
    let mut outcomes = [0_usize; 5];
    let mut iterations = 0;
    let mut odometry = ScaledOdometry::default();
    let cpu_before_ns = process_cpu_ns();
    let mut beams = Vec::new();
    for line in &lines {
        let (odom_from_base, twist_in_base) = odometry.next(line, options.odom_scale);
        fill_beams(&line.ranges_m, &mut beams);
        let scan = Scan {
            stamp_ns: (line.stamp_s * 1e9) as i64,
            laser_in_base_m: [0.0, 0.0],
            beams: &beams,
            twist_in_base: if options.no_odom { [0.0; 3] } else { twist_in_base },
        };
        let start_ns = monotonic_ns();
        let tracked = tracker.track(&scan, (!options.no_odom).then_some(odom_from_base));
        durations_ns.push(monotonic_ns() - start_ns);
        outcomes[outcome_index(tracked.outcome)] += 1;
        iterations += tracked.iterations as usize;
        let Pose2 { x_m, y_m, theta_rad } = tracked.map_from_base;
        let sigma = [0, 1, 2].map(|axis| tracked.covariance[axis][axis].sqrt());
        writeln!(
            table,
            "{:.6} {:?} {:.3} {} {:.5} {:.5} {:.6}",
            line.stamp_s, tracked.outcome, tracked.score, tracked.iterations, sigma[0], sigma[1], sigma[2]
        )?;
        writeln!(trajectory, "{:.6} {x_m:.6} {y_m:.6} {theta_rad:.6}", line.stamp_s)?;
    }
    let cpu_us = (process_cpu_ns() - cpu_before_ns) as f64 / 1e3 / lines.len().max(1) as f64;
    if let Some(path) = &options.output {
        std::fs::write(path, trajectory)?;
    }
    if let Some(path) = &options.table {
        std::fs::write(path, table)?;
    }
    durations_ns.sort_unstable();
    let at = |q: f64| {
        durations_ns.get((q * durations_ns.len() as f64) as usize).map_or(0.0, |&ns| ns as f64 / 1e3)
    };
    println!(
        "{} scans, {:.1} us CPU a scan ({:.0} scans/s), wall p50 {:.1} p99 {:.1} p99.9 {:.1} max {:.1} us, {:.1} iterations a scan",
        lines.len(),
        cpu_us,
        1e6 / cpu_us,
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0 - 1e-9),
        iterations as f64 / lines.len().max(1) as f64
    );
    let [first, matched, weak, lost, empty] = outcomes;
    println!("first {first}, matched {matched}, weak {weak}, lost {lost}, no returns {empty}");
    let size = tracker.map_size();
    println!(
        "map: {} tiles, {} surfaces; peak memory {} MB",
        size.tiles,
        size.surfaces,
        peak_memory_bytes().unwrap_or(0) / 1_000_000
    );
    Ok(())
}

fn outcome_index(outcome: Outcome) -> usize {
    match outcome {
        Outcome::First => 0,
        Outcome::Matched => 1,
        Outcome::Weak => 2,
        Outcome::Lost => 3,
        Outcome::NoReturns => 4,
    }
}

fn parse_options() -> Result<Options, Box<dyn Error>> {
    let mut options = Options {
        input: String::new(),
        output: None,
        table: None,
        params: TrackerParams::default(),
        every: 1,
        odom_scale: 1.0,
        no_odom: false,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--table" => options.table = Some(value()?),
            "-o" => options.output = Some(value()?),
            "--method" => options.params = TrackerParams::for_method(value()?.parse()?),
            "--set" => {
                let setting = value()?;
                let (name, value) = setting.split_once('=').ok_or("--set needs NAME=VALUE")?;
                options.params.set(name, value.parse()?)?;
            }
            "--every" => options.every = value()?.parse::<usize>()?.max(1),
            "--odom-scale" => options.odom_scale = value()?.parse()?,
            "--no-odom" => options.no_odom = true,
            _ => options.input = word,
        }
    }
    if options.input.is_empty() {
        return Err("expected a CARMEN log".into());
    }
    Ok(options)
}

/// `FLASER n r1..rn x y theta odom_x odom_y odom_theta ipc_stamp host logger_stamp`
fn parse_line(line: &str) -> Option<Line> {
    let mut words = line.split_ascii_whitespace();
    if words.next()? != "FLASER" {
        return None;
    }
    let count: usize = words.next()?.parse().ok()?;
    let mut numbers = words.map(str::parse::<f64>);
    let mut next = || numbers.next()?.ok();
    let ranges_m = (0..count).map(|_| next().map(|range| range as f32)).collect::<Option<Vec<_>>>()?;
    let _corrected = [next()?, next()?, next()?];
    let odom_from_base = Pose2::new(next()?, next()?, next()?);
    Some(Line { stamp_s: next()?, ranges_m, odom_from_base })
}

fn fill_beams(ranges_m: &[f32], beams: &mut Vec<Beam>) {
    let n = ranges_m.len();
    let step_deg = if n.is_multiple_of(2) { 180.0 / n as f64 } else { 180.0 / (n as f64 - 1.0) };
    beams.clear();
    beams.extend(ranges_m.iter().enumerate().map(|(i, &range_m)| {
        let angle_rad = (-90.0 + i as f64 * step_deg).to_radians();
        Beam {
            direction_in_base: [angle_rad.cos() as f32, angle_rad.sin() as f32],
            range_m: if range_m >= NO_RETURN_M { f32::INFINITY } else { range_m },
            delay_s: (i as f64 * step_deg / 360.0 * TURN_S) as f32,
        }
    }));
}

/// Odometry whose motion is multiplied by a factor, and the twist between its readings.
#[derive(Default)]
struct ScaledOdometry {
    last: Option<(Pose2, f64)>,
    scaled: Pose2,
}

impl ScaledOdometry {
    fn next(&mut self, line: &Line, scale: f64) -> (Pose2, [f64; 3]) {
        let mut twist = [0.0; 3];
        if let Some((last, last_s)) = self.last {
            let step = last.between(&line.odom_from_base);
            let step = Pose2::new(step.x_m * scale, step.y_m * scale, wrap_angle(step.theta_rad * scale));
            self.scaled = self.scaled * step;
            let dt_s = line.stamp_s - last_s;
            if dt_s > 0.02 && dt_s < 2.0 {
                twist = [step.x_m / dt_s, step.y_m / dt_s, step.theta_rad / dt_s];
            }
        }
        self.last = Some((line.odom_from_base, line.stamp_s));
        (self.scaled, twist)
    }
}
