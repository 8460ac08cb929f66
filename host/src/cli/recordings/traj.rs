//! `biplane traj`: the trajectory as text, one line a horizontal scan.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::formats::output::{check_free, check_not_input, write_file};
use crate::formats::text::trajectory::{TrajectoryFormat, write_poses};
use crate::recordings::deskew::StampedPose;
use crate::recordings::run::Run;
use clap::ValueEnum;
use serde::Serialize;

use crate::cli::terminal::bad_argument::BadArgument;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use biplane_cli::{Outcome, counted};

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane traj office.mcap -o office.tum\n  \
    biplane traj office.mcap -o - --format xytheta")]
pub(crate) struct Args {
    /// A posed recording; of one in parts all of them, in any order, or its name without the number
    #[arg(required = true, value_name = "RUN.mcap")]
    recordings: Vec<PathBuf>,
    /// The file to write, `-` for stdout
    #[arg(long, short, value_name = "T.tum")]
    output: PathBuf,
    /// What a line holds
    #[arg(long, value_enum, default_value_t = Format::Tum)]
    format: Format,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Written {
    /// The file.
    output: String,
    /// Its lines: scans with a pose.
    poses: usize,
    /// Scans without a pose nearby, and so without a line.
    unposed_scans: usize,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// t x y z qx qy qz qw
    Tum,
    /// t x y theta
    Xytheta,
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let to_stdout = args.output == Path::new("-");
    if args.json && to_stdout {
        let why = "--json prints to stdout, where the trajectory would be: name a file with -o".to_owned();
        return Err(BadArgument { command: "traj", why }.into());
    }
    let run = Run::open(&args.recordings)?;
    if !to_stdout {
        for recording in run.recording().paths() {
            check_not_input(&args.output, ".part", recording)?;
        }
        check_free(&args.output, args.force)?;
    }
    console.report_missing(run.recording());
    let poses = run.poses()?;
    console.report_poses(run.recording(), &poses);
    let at_scans = poses.at_scans();
    let known: Vec<StampedPose> = at_scans.iter().flatten().copied().collect();
    let format = match args.format {
        Format::Tum => TrajectoryFormat::Tum,
        Format::Xytheta => TrajectoryFormat::XyTheta,
    };
    let unposed_scans = at_scans.len() - known.len();
    if to_stdout {
        let mut out = BufWriter::new(io::stdout().lock());
        write_poses(&mut out, &known, format)?;
        out.flush()?;
    } else {
        write_file(&args.output, args.force, |out| write_poses(out, &known, format))?;
        if args.json {
            let output = args.output.display().to_string();
            print_json(&Written { output, poses: known.len(), unposed_scans })?;
            return Ok(Outcome::Done);
        }
        console.note(format!("{}: {}", args.output.display(), counted(known.len(), "pose")));
    }
    if unposed_scans > 0 {
        console.note(format!(
            "{}: {} without a pose nearby, and so without a line",
            run.path().display(),
            counted(unposed_scans, "scan")
        ));
    }
    Ok(Outcome::Done)
}
