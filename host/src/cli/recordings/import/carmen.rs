//! `biplane import carmen`: logs of CARMEN.

use std::path::{Path, PathBuf};

use crate::formats::output::unfinished::Unfinished;
use crate::formats::output::{check_free, check_not_input};
use crate::recordings::import::carmen;
use crate::recordings::import::carmen::ImportReport;
use biplane_recording::WriterOptions;
use biplane_recording::mcap::write::active_path;

use crate::cli::terminal::console::{Console, say};
use crate::cli::terminal::json::print_json;
use biplane_cli::{Outcome, counted};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane import carmen intel.log -o intel.mcap")]
pub(super) struct Args {
    /// The log
    log: PathBuf,
    /// The recording to write
    #[arg(long, short, value_name = "FILE.mcap")]
    output: PathBuf,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    check_not_input(&args.output, ".active", &args.log)?;
    check_free(&args.output, args.force)?;
    let spinner = console.spinner(format!("reading {}", args.log.display()));
    let options = WriterOptions { overwrite: args.force, ..WriterOptions::default() };
    let begun = active_path(&args.output);
    let _begun = (!begun.exists()).then(|| Unfinished::new(&begun));
    let report = carmen::import(&args.log, &args.output, &options)?;
    drop(spinner);
    print_result(&report, args, console)
}

fn print_result(report: &ImportReport, args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let outcome = if report.broken_lines == 0 { Outcome::Done } else { Outcome::Lossy };
    if args.json {
        print_json(report)?;
        return Ok(outcome);
    }
    report_losses(report, &args.log, console);
    let beams: Vec<String> = report.beams.keys().map(ToString::to_string).collect();
    let no_return = match report.no_return_m {
        Some(value_m) => format!("nothing seen from {value_m:.2} m on"),
        None => "no range means nothing seen".to_owned(),
    };
    let duration_s = report.stamps_ns.map_or(0.0, |[first_ns, last_ns]| (last_ns - first_ns) as f64 / 1e9);
    console.note(format!(
        "{}: {} of {} beams in {duration_s:.1} s ({no_return}), {}, {} back in the stamps",
        args.output.display(),
        counted(report.scans, "scan"),
        beams.join(" or "),
        counted(report.odometry, "odometry message"),
        counted(report.backward_stamps, "step")
    ));
    Ok(outcome)
}

/// Lost data is said even when quiet: the exit code alone does not tell which lines.
fn report_losses(report: &ImportReport, log: &Path, console: &Console) {
    for line in &report.broken {
        say(&format!("biplane: {} line {}: {}; skipped", log.display(), line.number, line.reason));
    }
    if report.broken_lines > report.broken.len() {
        say(&format!("biplane: {}: {} broken lines skipped in all", log.display(), report.broken_lines));
    }
    for (kind, count) in &report.others {
        console.note(format!("{}: {} not taken", log.display(), counted(*count, &format!("{kind} line"))));
    }
}
