//! `biplane evaluate trajectory`.

use std::io::{self, Write};
use std::path::PathBuf;

use crate::metrics::evaluate::association::associate;
use crate::metrics::evaluate::pose_error::{PoseErrors, Step, absolute, alignment, relative, size_ratio};
use anyhow::bail;
use biplane_matcher::Pose2;
use serde::Serialize;

use super::order::Files;
use crate::cli::recordings::poses;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::values::not_negative;
use biplane_cli::{Outcome, counted};

/// Ways whose sizes differ by a larger factor are hardly in one unit: odometry that drifts does less.
const OTHER_UNIT: f64 = 3.0;
/// A unit is named where the factor is so near to it.
const UNIT_SHARE: f64 = 0.1;

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane evaluate trajectory truth/poses.tum office.mcap")]
pub(super) struct Args {
    /// The reference: a trajectory as text with "t x y theta" or "t x y z qx qy qz qw" on each line, or a
    /// posed recording
    truth: PathBuf,
    /// The estimate that is judged, in one of the same forms
    estimate: PathBuf,
    /// Poses at most this far apart in time are compared, in seconds
    #[arg(long, value_name = "S", default_value_t = 0.01, value_parser = not_negative)]
    max_dt: f64,
    /// Compare the poses as they are, without laying the estimate upon the truth first
    #[arg(long)]
    no_align: bool,
    /// How far compared poses are apart in the relative error: 5f (frames), 1m or 2.5s; may be given several
    /// times [default: 1f, 1m, 1s]
    #[arg(long, value_name = "LENGTH", value_parser = step)]
    delta: Vec<Step>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

fn step(text: &str) -> Result<Step, String> {
    let wrong = || "expected a length such as 5f (frames), 1m or 2.5s".to_owned();
    let (number, unit) = text.split_at_checked(text.len().saturating_sub(1)).ok_or_else(wrong)?;
    let value = number.parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0);
    match (unit, value) {
        ("f", Some(frames)) if frames.fract() == 0.0 => Ok(Step::Frames(frames as usize)),
        ("m", Some(length_m)) => Ok(Step::Meters(length_m)),
        ("s", Some(duration_s)) => Ok(Step::Seconds(duration_s)),
        _ => Err(wrong()),
    }
}

/// What the command says.
#[derive(Debug, Serialize)]
struct Report {
    /// Poses compared.
    pairs: usize,
    /// What the estimate was moved by: x and y in meters, heading in degrees; zero with `--no-align`.
    alignment: [f64; 3],
    /// Of each pose.
    absolute: PoseErrors,
    /// How many times larger than the reference the estimate is; none where one hardly moved.
    size_ratio: Option<f64>,
    /// Of the way between poses; without figures where nothing is that far apart.
    relative: Vec<Relative>,
}

#[derive(Debug, Serialize)]
struct Relative {
    delta: Step,
    errors: Option<PoseErrors>,
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let files = Files::of_trajectories(&args.truth, &args.estimate, console);
    let estimate = poses::read(files.judged, console)?;
    let truth = poses::read(files.reference, console)?;
    let pairs = associate(&estimate, &truth, (args.max_dt * 1e9) as u64);
    let moved = if args.no_align { Pose2::IDENTITY } else { alignment(&pairs) };
    let Some(absolute) = absolute(&pairs, &moved) else {
        bail!("{}", poses::none_nearby([files.judged, files.reference], [&estimate, &truth], args.max_dt))
    };
    let deltas = match &args.delta[..] {
        [] => &[Step::Frames(1), Step::Meters(1.0), Step::Seconds(1.0)],
        given => given,
    };
    let relative_of = |delta: &Step| Relative { delta: *delta, errors: relative(&pairs, *delta) };
    let report = Report {
        pairs: pairs.len(),
        alignment: [moved.x_m, moved.y_m, moved.theta_rad.to_degrees()],
        absolute,
        size_ratio: size_ratio(&pairs),
        relative: deltas.iter().map(relative_of).collect(),
    };
    if let Some(words) = report.size_ratio.and_then(unit_words) {
        console.warn(format!("biplane: {}: {words}", files.judged.display()));
    }
    match args.json {
        true => print_json(&report)?,
        false => print(&report)?,
    }
    Ok(Outcome::Done)
}

/// What to say of an estimate that is so many times larger than the reference, where no error of a drive
/// explains it.
fn unit_words(ratio: f64) -> Option<String> {
    let (times, which, how) = match ratio {
        _ if ratio > OTHER_UNIT => (ratio, "estimate", "larger"),
        _ if ratio < 1.0 / OTHER_UNIT => (1.0 / ratio, "reference", "smaller"),
        _ => return None,
    };
    let is_near = |unit: f64| (times / unit - 1.0).abs() < UNIT_SHARE;
    let unit = match times {
        _ if is_near(100.0) => "centimeters",
        _ if is_near(1000.0) => "millimeters",
        _ => "other units than meters",
    };
    Some(format!("{times:.1} times {how} than the reference: is the {which} in {unit}? Lengths are meters"))
}

fn print(report: &Report) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let [x_m, y_m, turn_deg] = report.alignment;
    writeln!(
        out,
        "{} compared; the estimate was turned by {turn_deg:.4} deg and moved by {x_m:.4}, {y_m:.4} m",
        counted(report.pairs, "pose")
    )?;
    writeln!(out, "{:<24} {:>10} {:>10} {:>10} {:>10}", "", "RMS", "mean", "median", "largest")?;
    print_errors(&mut out, "of each pose (ATE)", Some(&report.absolute))?;
    for Relative { delta, errors } in &report.relative {
        let name = match delta {
            Step::Frames(count) => format!("over {} (RPE)", counted(*count, "frame")),
            Step::Meters(length_m) => format!("over {length_m} m (RPE)"),
            Step::Seconds(duration_s) => format!("over {duration_s} s (RPE)"),
        };
        print_errors(&mut out, &name, errors.as_ref())?;
    }
    Ok(())
}

fn print_errors(out: &mut impl Write, name: &str, errors: Option<&PoseErrors>) -> io::Result<()> {
    let Some(errors) = errors else { return writeln!(out, "{name:<24} nothing is that far apart") };
    for (name, unit, of) in [(name, "m", &errors.translation_m), ("", "deg", &errors.rotation_deg)] {
        writeln!(
            out,
            "{name:<24} {:>10.4} {:>10.4} {:>10.4} {:>10.4} {unit}",
            of.rmse, of.mean, of.median, of.max
        )?;
    }
    Ok(())
}
