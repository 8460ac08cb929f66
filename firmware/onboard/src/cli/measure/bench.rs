//! `bench`: what matching costs.

use std::path::PathBuf;

use crate::cli::rig;
use crate::replay::bench::spread::Spread;
use crate::replay::bench::worst_case::{WorstCase, worst_cases};
use crate::replay::bench::{BenchOptions, BenchReport};
use crate::types::error::OnboardError;

/// Measures what matching the scans of a log costs: time a scan, iterations, allocations, memory of the map.
///
/// The scans are those that the tracker of `record` or `replay` would get; they are matched on one thread,
/// and nothing is written.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane-onboard bench intel.mcap")]
pub(crate) struct Args {
    /// A capture, an import or a recording; of one in parts all of them, or its name without the number.
    #[arg(required_unless_present = "worst_case", value_name = "LOG.mcap")]
    inputs: Vec<PathBuf>,
    /// Instead of a log's scans, times scans of so many beams that no laser would send, with both matchers,
    /// with odometry and without.
    #[arg(long, value_name = "BEAMS", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    #[arg(conflicts_with_all = ["inputs", "rig", "matcher", "set", "repeat"])]
    worst_case: Option<u32>,
    /// The rig; without it, the log's own.
    #[arg(long)]
    rig: Option<PathBuf>,
    #[command(flatten)]
    matcher: crate::cli::args::matcher::MatcherArgs,
    /// How often all scans are matched, each time from an empty map.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// The figures as JSON on stdout.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    if let Some(beams) = args.worst_case {
        let cases = worst_cases(beams as usize);
        let json = args.json.then(|| serde_json::to_string_pretty(&cases).ok()).flatten();
        crate::cli::print_result(&json.map_or_else(|| worst_case_text(beams, &cases), |json| json + "\n"));
        return Ok(0);
    }
    let options = BenchOptions {
        inputs: args.inputs.clone(),
        rig: args.rig.as_deref().map(rig::load).transpose()?,
        matcher: args.matcher.params(),
        repeat: args.repeat,
    };
    let report = crate::replay::bench::bench(&options)?;
    let json = args.json.then(|| serde_json::to_string_pretty(&report).ok()).flatten();
    crate::cli::print_result(&json.map_or_else(|| text(&report), |json| json + "\n"));
    Ok(0)
}

fn text(report: &BenchReport) -> String {
    let outcomes = &report.outcomes;
    let allocations = report.allocations.map_or_else(|| "not counted".to_owned(), |count| count.to_string());
    let megabytes = |bytes: usize| bytes as f64 * 1e-6;
    format!(
        "{}: {} scans of {:.0} beams, {} times, each time from an empty map, no scan left out\n\
         matched {} (weak {}), lost {}, without returns {}\n\
         \n\
         us a scan                      mean      p50      p99    p99.9      max\n\
         {}{}{}\
         reading the clocks takes {:.2} us of each\n\
         \n\
         {:.0} scans/s of processor time, {:.2} iterations a scan, {:.2} ns a beam and iteration\n\
         {allocations} allocations after the first scan\n\
         map: {} tiles, {} surfaces, {:.1} MB used of {:.1} MB reserved\n",
        report.matcher,
        report.scans,
        report.beams_per_scan,
        report.passes,
        outcomes.matched,
        outcomes.weak,
        outcomes.lost,
        outcomes.no_returns,
        row("processor", &report.cpu_us),
        row("processor, least of passes", &report.cpu_min_us),
        row("wall", &report.wall_us),
        report.clock_us,
        report.scans_per_s,
        report.iterations_per_scan,
        report.ns_per_beam_and_iteration,
        report.map.tiles,
        report.map.surfaces,
        megabytes(report.map.bytes_used),
        megabytes(report.map.bytes_reserved),
    )
}

fn worst_case_text(beams: u32, cases: &[WorstCase]) -> String {
    let head = format!(
        "{:44} {:>8} {:>8} {:>8}\n",
        format!("us of processor time a scan of {beams} beams"),
        "p50",
        "p99",
        "max"
    );
    let row = |case: &WorstCase| {
        let WorstCase { matcher, scans, with_odometry, cpu_us } = case;
        let odometry = if *with_odometry { "" } else { ", no odometry" };
        let name = format!("{matcher}: {scans}{odometry}");
        format!("{name:44} {:8.0} {:8.0} {:8.0}\n", cpu_us.p50, cpu_us.p99, cpu_us.max)
    };
    head + &cases.iter().map(row).collect::<String>()
}

fn row(name: &str, times: &Spread) -> String {
    let Spread { mean, p50, p99, p99_9, max } = times;
    format!("{name:26} {mean:8.1} {p50:8.1} {p99:8.1} {p99_9:8.1} {max:8.1}\n")
}
