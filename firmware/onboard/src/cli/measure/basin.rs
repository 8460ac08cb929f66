//! `basin`: from how far off the matcher finds one scan in another.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::cli::rig;
use crate::replay::basin::summary::{Shares, Summary};
use crate::replay::basin::trial::Basin;
use crate::replay::basin::{BasinOptions, measure};
use crate::types::error::OnboardError;
use biplane_cli::counted;
use biplane_recording::Recording;
use biplane_recording::mcap::write::check_outputs;

/// Measures the basin of convergence: the second scan of each pair is found in the first one alone, from 52
/// wrong starts.
///
/// The starts lie 10 cm off in x and in y and up to 30 degrees off in heading (the paper's figure 2).
/// Success: within 2 cm and 0.5 degrees of the pose that the list has; gross: more than 10 cm or 2 degrees
/// wrong.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane-onboard basin intel.mcap intel_pairs.txt -o basin.csv")]
pub(crate) struct Args {
    /// A capture, an import or a recording.
    #[arg(value_name = "LOG.mcap")]
    input: PathBuf,
    /// The pairs: lines `stamp_a stamp_b x y theta` (s, m, rad), the base at scan b seen from scan a.
    #[arg(value_name = "PAIRS")]
    pairs: PathBuf,
    /// The rig; without it, the log's own.
    #[arg(long)]
    rig: Option<PathBuf>,
    #[command(flatten)]
    matcher: crate::cli::args::matcher::MatcherArgs,
    /// A table with a line a start (CSV).
    #[arg(long, short, value_name = "BASIN.csv")]
    output: Option<PathBuf>,
    /// A table of what each iteration of each pair's first start did (CSV).
    #[arg(long, value_name = "JOURNAL.csv")]
    journal: Option<PathBuf>,
    /// Replace outputs that exist.
    #[arg(long)]
    force: bool,
    /// The result as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    let inputs = vec![args.input.clone()];
    check(args, &inputs)?;
    let options = BasinOptions {
        inputs,
        rig: args.rig.as_deref().map(rig::load).transpose()?,
        pairs: args.pairs.clone(),
        matcher: args.matcher.params(),
        journal: args.journal.clone(),
        overwrite: args.force,
    };
    let basin = measure(&options)?;
    let name = options.matcher.method.name();
    if let Some(path) = &args.output {
        write(path, &csv(name, &basin))?;
    }
    let summary = Summary::new(name, &basin);
    if args.json {
        crate::cli::print_result(&(serde_json::to_string_pretty(&summary).unwrap_or_default() + "\n"));
    } else {
        crate::cli::print_result(&text(&summary));
    }
    Ok(0)
}

/// Nothing that is read may be written, and no table onto the other.
fn check(args: &Args, inputs: &[PathBuf]) -> Result<(), OnboardError> {
    let recording = Recording::open(inputs)?;
    let beside = [Some(&args.pairs), args.rig.as_ref()].into_iter().flatten().cloned();
    let read: Vec<PathBuf> = recording.paths().map(Path::to_owned).chain(beside).collect();
    let outputs = [&args.output, &args.journal].into_iter().flatten().map(PathBuf::as_path);
    Ok(check_outputs(&outputs.collect::<Vec<_>>(), &read, args.force)?)
}

fn write(path: &Path, text: &str) -> Result<(), OnboardError> {
    std::fs::write(path, text).map_err(|source| OnboardError::Place { path: path.to_owned(), source })
}

/// One line a start; `start_*` is the start's error about the true pose.
fn csv(matcher: &str, basin: &Basin) -> String {
    let mut text = String::from(
        "matcher,stamp_a,stamp_b,start_x_m,start_y_m,start_theta_rad,error_m,error_rad,iterations,cpu_us\n",
    );
    for trial in &basin.trials {
        let [first, second] = basin.pairs[trial.pair].stamps_ns.map(|ns| ns as f64 * 1e-9);
        let start = trial.start;
        let _ = writeln!(
            text,
            "{matcher},{first:.6},{second:.6},{:.3},{:.3},{:.6},{:.6},{:.6},{},{:.1}",
            start.x_m,
            start.y_m,
            start.theta_rad,
            trial.error_m,
            trial.error_rad,
            trial.iterations,
            trial.cpu_ns as f64 * 1e-3
        );
    }
    text
}

fn text(summary: &Summary) -> String {
    let mut text = format!(
        "{}: {}, {}; {} with a stamp that several scans bear\n",
        summary.matcher,
        counted(summary.pairs, "pair"),
        counted(summary.all.starts, "start"),
        counted(summary.ambiguous_pairs, "pair")
    );
    text += "starts             success    gross  back to its own optimum\n";
    let mut line = |name: &str, shares: &Shares| {
        let Shares { success_percent, gross_percent, own_optimum_percent, .. } = shares;
        let _ = writeln!(
            text,
            "{name:17} {success_percent:6.2} % {gross_percent:6.2} % {own_optimum_percent:6.2} %"
        );
    };
    line("all", &summary.all);
    line("unambiguous pairs", &summary.unambiguous);
    for at in &summary.by_heading {
        line(&format!("{:+} deg", at.heading_deg), &at.shares);
    }
    text + &costs(summary)
}

fn costs(summary: &Summary) -> String {
    format!(
        "iterations: median {:.0}, p99 {:.0}\n\
         CPU an alignment: median {:.1} us, p99 {:.1} us; with the reference's preparation: median {:.1} us\n\
         CPU to prepare a reference: median {:.1} us; all time by all iterations: {:.2} us\n",
        summary.iterations_median,
        summary.iterations_p99,
        summary.cpu_us_median,
        summary.cpu_us_p99,
        summary.cpu_with_preparation_us_median,
        summary.prepare_us_median,
        summary.iteration_us
    )
}
