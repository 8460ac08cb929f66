//! `biplane calibrate`: the vertical laser's mount and delay and the odometry's scale, refined from a
//! recording.

use std::io::{self, Write};
use std::path::PathBuf;

use crate::calibrate::{Calibration, Row, calibrate};
use crate::formats::output::{check_free, check_not_input, write_file};
use crate::recordings::run::Run;
use anyhow::bail;

use super::rig_text;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::threads::Threads;
use biplane_cli::Outcome;
use biplane_recording::Rig;

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  biplane calibrate office.mcap\n  biplane calibrate office.mcap -o rig.toml\n\n\
    Use it: biplane-onboard replay RUN.mcap --rig rig.toml -o BETTER.mcap; or for the next drive. docs/calibration.md tells how to drive for it."
)]
pub(crate) struct Args {
    /// A posed recording; of one in parts all of them, in any order, or its name without the number
    #[arg(required = true, value_name = "RUN.mcap")]
    recordings: Vec<PathBuf>,
    /// Write the corrected rig; without it the lines that change are printed
    #[arg(long, short, value_name = "rig.toml")]
    output: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    Threads::default().take()?;
    if let Some(output) = &args.output {
        check_free(output, args.force)?;
    }
    let run = Run::open(&args.recordings)?;
    for (output, recording) in
        args.output.iter().flat_map(|output| run.recording().paths().map(move |p| (output, p)))
    {
        check_not_input(output, ".part", recording)?;
    }
    console.report_missing(run.recording());
    let found = calibrate(&run)?;
    let mut out = io::stdout().lock();
    if args.json {
        json(&mut out, &found)?;
    } else {
        table(&mut out, &found)?;
    }
    if !found.observed() {
        bail!("{}: nothing can be determined: {}", run.path().display(), why(&found));
    }
    match &args.output {
        Some(output) => {
            write_file(output, args.force, |out| out.write_all(found.corrected.to_toml().as_bytes()))?;
            console.note(format!("{}: the rig with {} corrected", output.display(), written(&found)));
        }
        None if !args.json => changes(&mut out, &found, &run.rig()?)?,
        None => {}
    }
    Ok(Outcome::Done)
}

fn json(out: &mut impl Write, found: &Calibration) -> io::Result<()> {
    let mut value = serde_json::to_value(found).map_err(io::Error::from)?;
    value["rig"] = found.corrected.to_toml().into();
    serde_json::to_writer_pretty(&mut *out, &value).map_err(io::Error::from)?;
    writeln!(out)
}

fn table(out: &mut impl Write, found: &Calibration) -> io::Result<()> {
    writeln!(
        out,
        "{} vertical scans, {} stretches of odometry, while the robot moved",
        found.vertical_scans, found.odometry_segments
    )?;
    for fit in found.fits.iter().filter(|fit| fit.strips > 0) {
        writeln!(out, "  {}: {} strips of scans, {:.1} mm RMS", fit.of, fit.strips, fit.rms_m * 1e3)?;
    }
    for missing in &found.missing {
        writeln!(out, "  {missing}")?;
    }
    writeln!(
        out,
        "  {:<12}{:<6}{:>10}{:>12}{:>10}{:>10}  {:10}remark",
        "", "unit", "before", "correction", "refined", "sigma", "observed"
    )?;
    found.rows.iter().try_for_each(|row| line(out, row))
}

fn line(out: &mut impl Write, row: &Row) -> io::Result<()> {
    let digits = match row.unit {
        "deg" => 3,
        "ms" => 2,
        _ => 4,
    };
    // What another parameter may as well be has no value of its own: as one that nothing tells.
    let known = row.sigma.filter(|_| !row.is_inseparable());
    let sigma = known.map_or("unknown".to_owned(), |sigma| format!("{sigma:.digits$}"));
    let (correction, refined) =
        if row.is_inseparable() { (0.0, row.before) } else { (row.correction, row.refined) };
    let observed = if row.observed { "yes" } else { "no" };
    let remark = format!("{observed:10}{}", row.note);
    writeln!(
        out,
        "  {:<12}{:<6}{:>10.digits$}{:>+12.digits$}{:>10.digits$}{sigma:>10}  {}",
        row.name,
        row.unit,
        row.before,
        correction,
        refined,
        remark.trim_end()
    )
}

/// The lines of the rig that change, as they were and as they become. A recording has every key, also those
/// that no `rig.toml` has to have: what goes without saying is no line to take out.
fn changes(out: &mut impl Write, found: &Calibration, recorded: &Rig) -> io::Result<()> {
    let (before, after, recorded) = (found.rig.to_toml(), found.corrected.to_toml(), recorded.to_toml());
    let recorded: Vec<&str> = recorded.lines().collect();
    let mut section = "";
    for (was, is) in before.lines().zip(after.lines()) {
        if is.starts_with('[') {
            section = is;
        }
        if was == is {
            continue;
        }
        let begins = recorded.iter().position(|line| *line == section).unwrap_or(0);
        let number = recorded.iter().skip(begins).position(|line| *line == was).map(|at| begins + at);
        let instead = match number {
            None => Some("what the base says"),
            Some(number) if rig_text::goes_without_saying(&recorded, number) => Some("the default"),
            Some(_) => None,
        };
        match (instead, was.split_once(" = ")) {
            (Some(source), Some((_, value))) => {
                writeln!(out, "{section}\n+ {is}  # instead of {value}, {source}")?;
            }
            _ => writeln!(out, "{section}\n- {was}\n+ {is}")?,
        }
    }
    Ok(())
}

fn written(found: &Calibration) -> String {
    let names: Vec<&str> = found.rows.iter().filter(|row| row.written).map(|row| row.name).collect();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

/// Why nothing was observed.
fn why(found: &Calibration) -> String {
    if !found.missing.is_empty() {
        return found.missing.join("; ");
    }
    "the drive tells too little: drive with turns both ways past walls".to_owned()
}
