//! `biplane evaluate relations`.

use std::fs::File;
use std::io::{self, BufReader, Write};
use std::path::{Path, PathBuf};

use crate::formats::output::{check_free, check_not_input, write_file};
use crate::metrics::evaluate::relations::{
    Relation, RelationError, RelationsParams, RelationsReport, read_relations, relation_errors, report,
};
use crate::recordings::deskew::StampedPose;
use crate::recordings::stamp_text::{format_seconds, format_span};
use anyhow::{Context, bail};

use super::order::Files;
use crate::cli::recordings::poses::{self, check_relations};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::values::not_negative;
use biplane_cli::{Outcome, counted};

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane evaluate relations intel.relations intel.opt.mcap\n\n\
    The rows \"squared\" are the squares of the errors, averaged: the metric of Kümmerle et al. 2009.")]
pub(super) struct Args {
    /// The relations, with "t1 t2 x y z roll pitch yaw" on each line: pose 2 seen from pose 1
    relations: PathBuf,
    /// What is judged: a posed recording, or a trajectory as text, with "t x y theta" or
    /// "t x y z qx qy qz qw" on each line
    #[arg(value_name = "TRAJ")]
    trajectory: PathBuf,
    /// Only relations whose times are at most this far apart, in seconds
    #[arg(long, value_name = "S", value_parser = not_negative)]
    max_gap: Option<f64>,
    /// Only relations whose times are at least this far apart, in seconds
    #[arg(long, value_name = "S", default_value_t = RelationsParams::default().min_gap_s, value_parser = not_negative)]
    min_gap: f64,
    /// A pose this near in time is taken as it is, in seconds; others are interpolated
    #[arg(long, value_name = "S", default_value_t = RelationsParams::default().max_dt_s, value_parser = not_negative)]
    max_dt: f64,
    /// The point of the robot whose poses the relations are of, in the base's frame, x forward and y to the
    /// left, meters [default: the base itself]
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    about: Option<Point>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Also write the error of each relation
    #[arg(long, value_name = "OUT.csv")]
    per_relation: Option<PathBuf>,
    /// Replace OUT.csv if it exists
    #[arg(long)]
    force: bool,
}

/// A point of the robot, meters.
#[derive(Clone, Copy, Debug)]
struct Point([f64; 2]);

fn point(text: &str) -> Result<Point, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    let parts = text.split_once(',').and_then(|(x, y)| Some(Point([number(x)?, number(y)?])));
    parts.ok_or_else(|| "expected two numbers such as 0.034,0.002, in meters".to_owned())
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    if let Some(output) = &args.per_relation {
        check_not_input(output, ".part", &args.trajectory)?;
        check_not_input(output, ".part", &args.relations)?;
        check_free(output, args.force)?;
    }
    let files = Files::of_relations(&args.relations, &args.trajectory, console);
    let poses = poses::read(files.judged, console)?;
    let name = files.reference.display();
    check_relations(files.reference)?;
    let file = File::open(files.reference).with_context(|| format!("cannot read {name}"))?;
    let relations = read_relations(BufReader::new(file)).with_context(|| format!("cannot read {name}"))?;
    let params = RelationsParams {
        max_dt_s: args.max_dt,
        min_gap_s: args.min_gap,
        max_gap_s: args.max_gap.unwrap_or(f64::INFINITY),
        about_m: args.about.map_or([0.0; 2], |Point(at_m)| at_m),
    };
    let (errors, found) = relation_errors(&relations, &poses, &params);
    let Some(report) = report(&errors, found) else {
        if found.relations_left_out > 0 {
            bail!("{}", all_outside(&relations, &poses, files.judged, files.reference));
        }
        bail!("none of the {} relations of {name} has times as far apart as asked", relations.len())
    };
    if let Some(output) = &args.per_relation {
        write_file(output, args.force, |out| write_errors(out, &errors))?;
    }
    match args.json {
        true => print_json(&report)?,
        false => print(&report)?,
    }
    Ok(Outcome::Done)
}

/// Why nothing was measured: nothing of the relations is in the trajectory.
fn all_outside(relations: &[Relation], poses: &[StampedPose], judged: &Path, reference: &Path) -> String {
    let times_ns = relations.iter().flat_map(|relation| [relation.stamp_a_ns, relation.stamp_b_ns]);
    format!(
        "no relation of {} lies in the time of {}: the relations are from {}, the poses from {}",
        reference.display(),
        judged.display(),
        format_span(times_ns),
        format_span(poses.iter().map(|pose| pose.stamp_ns))
    )
}

fn write_errors(out: &mut impl Write, errors: &[RelationError]) -> io::Result<()> {
    writeln!(out, "stamp_a,stamp_b,translation_m,rotation_rad")?;
    for error in errors {
        let (a, b) = (format_seconds(error.stamp_a_ns), format_seconds(error.stamp_b_ns));
        writeln!(out, "{a},{b},{:.9},{:.9}", error.translation_m, error.rotation_rad)?;
    }
    Ok(())
}

fn print(report: &RelationsReport) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let found = &report.poses;
    writeln!(
        out,
        "{} between {}: {} taken as they are, {} interpolated",
        counted(report.relations, "relation"),
        counted(found.direct + found.interpolated, "pose"),
        found.direct,
        found.interpolated
    )?;
    if report.relations_left_out > 0 {
        writeln!(
            out,
            "{} left out: outside of the trajectory's time",
            counted(report.relations_left_out, "relation")
        )?;
    }
    writeln!(out, "{:<19} {:>10} {:>10} {:>10}", "", "mean", "std", "largest")?;
    for (name, unit, figures) in [
        ("translation", "m", &report.translation_m),
        ("translation squared", "m2", &report.translation_m2),
        ("rotation", "deg", &report.rotation_deg),
        ("rotation squared", "deg2", &report.rotation_deg2),
    ] {
        writeln!(
            out,
            "{name:<19} {:>10.4} {:>10.4} {:>10.3} {unit}",
            figures.mean, figures.std, figures.max
        )?;
    }
    Ok(())
}
