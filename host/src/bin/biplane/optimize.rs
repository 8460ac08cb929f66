//! `biplane optimize`: loop closing and pose-graph optimisation of recordings.

mod loops_found;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use anyhow::{Context, bail};
use biplane::loops::checkpoint::Checkpoint;
use biplane::loops::corrected::Corrected;
use biplane::loops::trail::Trail;
use biplane::loops::{self, Counts, LoopFound, LoopParams, Optimised, Progress, output};
use biplane::output::{check_free, check_not_input, with_suffix};
use biplane::run::Run;
use serde::Serialize;

use crate::Outcome;
use crate::console::{Console, say};
use crate::moment::Moment;
use crate::plan::Plan;
use crate::threads::Threads;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Several recordings are put into one frame where they saw the same places; nothing needs to be known of where they \
    began. Parts of one recording (RUN_0.mcap, RUN_1.mcap) count as one. A recording that matches none of the others is written apart, as \
    OPT.apart-N.mcap, and that is said.\nStopped with Ctrl-C, the same command goes on where it was (OPT.mcap.loops)."
)]
pub struct Args {
    /// Posed recordings
    #[arg(required = true, value_name = "RUN.mcap")]
    recordings: Vec<PathBuf>,
    /// The recording to write: the same messages with better poses
    #[arg(long, short, value_name = "OPT.mcap")]
    output: PathBuf,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
    /// Say what would be read, done and written, and do none of it
    #[arg(long)]
    dry_run: bool,
    /// Print what was found as JSON
    #[arg(long)]
    json: bool,
    /// Write the loops found, a line each: where, how sure, and whether believed
    #[arg(long, value_name = "LOOPS.csv")]
    loops: Option<PathBuf>,
    #[command(flatten)]
    threads: Threads,
    /// Replace this share of the loops found by random ones: a test of how well false ones are told
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share, hide = true)]
    spoil_loops: f64,
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err("expected a share between 0 and 1".to_owned()),
    }
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Report {
    recordings: Vec<RecordingReport>,
    #[serde(flatten)]
    counts: Counts,
    wall_s: f64,
    cpu_s: f64,
    peak_memory_bytes: Option<u64>,
}

#[derive(Debug, Serialize)]
struct RecordingReport {
    path: String,
    scans: usize,
    /// The file that it is in now.
    output: String,
    /// Whether it lies in one frame with another one.
    joined: bool,
    /// Stretches of its way that were found in other recordings: a few are a weak reason to join.
    shared_stretches: usize,
    /// Share of their points that the others explain, 0 to 1, on average. Two floors of one plan come near 1, too.
    shared_agreement: f64,
}

/// What a recording, by number, has in common with the others.
fn shared(number: usize, trails: &[Trail], loops: &[LoopFound]) -> (usize, f64) {
    let first: usize = trails[..number].iter().map(|trail| trail.nodes.len()).sum();
    let own = first..first + trails[number].nodes.len();
    let across = loops
        .iter()
        .filter(|found| found.believed && own.contains(&found.nodes[0]) != own.contains(&found.nodes[1]));
    let of: BTreeMap<usize, f64> = across
        .map(|found| (found.nodes[usize::from(own.contains(&found.nodes[1]))], found.agreement.share))
        .collect();
    (of.len(), of.values().sum::<f64>() / of.len().max(1) as f64)
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let moment = Moment::now();
    args.threads.take()?;
    let runs = open(&args.recordings, console)?;
    let apart = |number: usize| args.output.with_extension(format!("apart-{}.mcap", number + 1));
    check_outputs(args, &runs, &apart)?;
    if args.dry_run {
        let plan = Plan {
            reads: runs.iter().flat_map(|run| run.recording().paths()).collect(),
            steps: vec!["read", "optimize", "write"],
            writes: vec![args.output.display().to_string()],
        };
        return Ok(plan.tell());
    }
    let params = LoopParams { spoilt_share: args.spoil_loops, ..LoopParams::default() };
    let trails = read(&runs, &params, console)?;
    let kept = with_suffix(&args.output, ".loops");
    let mut checkpoint = checkpoint(&kept, &runs, &params, console)?;
    let optimised = work(&trails, &params, &mut checkpoint, console);
    let is_resumed = !checkpoint.is_empty();
    drop(checkpoint);
    let corrected: Vec<Corrected> =
        trails.iter().zip(&optimised.poses).map(|(trail, poses)| Corrected::new(trail, poses)).collect();
    let spinner = console.spinner(format!("writing {}", args.output.display()));
    let told = told(&runs, &optimised);
    for (path, members) in files(&optimised.groups, &args.output, &apart) {
        let members: Vec<(&Run, &Corrected)> =
            members.iter().map(|&number| (&runs[number], &corrected[number])).collect();
        if is_resumed {
            // Begun by the run that was killed: the searches beside it are of this very job.
            let _ = std::fs::remove_file(with_suffix(&path, ".active"));
        }
        output::write(&path, &members, args.force, &told)?;
    }
    drop(spinner);
    if let Some(path) = &args.loops {
        loops_found::write(path, &trails, &optimised.loops)
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    // What was kept to go on with is of no use any more.
    let _ = std::fs::remove_file(kept);
    let report = report(&runs, &trails, &optimised, (&args.output, &apart), &moment);
    tell(args, &report, console)?;
    Ok(Outcome::Done)
}

/// Opens recordings; parts of one count as one.
pub fn open(paths: &[PathBuf], console: &Console) -> anyhow::Result<Vec<Run>> {
    for (number, path) in paths.iter().enumerate() {
        let same = |other: &PathBuf| other == path || other.canonicalize().ok() == path.canonicalize().ok();
        if path.exists() && paths[..number].iter().any(same) {
            bail!("{} is given twice", path.display());
        }
    }
    let one = Run::open(paths);
    let runs = match one {
        Ok(run) => vec![run],
        Err(_) if paths.len() > 1 => {
            paths.iter().map(|path| Run::open(std::slice::from_ref(path))).collect::<Result<_, _>>()?
        }
        Err(error) => return Err(error.into()),
    };
    for run in &runs {
        console.tell_missing(run.recording());
    }
    Ok(runs)
}

fn check_outputs(args: &Args, runs: &[Run], apart: &impl Fn(usize) -> PathBuf) -> anyhow::Result<()> {
    let names = std::iter::once(args.output.clone()).chain((1..runs.len()).map(apart));
    for name in names.chain(args.loops.iter().cloned()) {
        for input in runs.iter().flat_map(|run| run.recording().paths()) {
            check_not_input(&name, ".active", input)?;
        }
        check_free(&name, args.force)?;
    }
    Ok(())
}

/// Reads the scans that are kept.
pub fn read(runs: &[Run], params: &LoopParams, console: &Console) -> anyhow::Result<Vec<Trail>> {
    let mut trails = Vec::new();
    for run in runs {
        let _spinner = console.spinner(format!("reading {}", run.path().display()));
        let poses = run.poses()?;
        console.tell_mountings(run.recording(), &poses);
        let trail = Trail::read(run, &poses, &params.trail)?;
        if trail.nodes.is_empty() {
            bail!("no scan of {} has a pose", run.path().display());
        }
        trails.push(trail);
    }
    Ok(trails)
}

/// What was found before the last stop, if it belongs to the same inputs: the same names, sizes and times of change.
pub fn checkpoint(
    path: &Path,
    runs: &[Run],
    params: &LoopParams,
    console: &Console,
) -> anyhow::Result<Checkpoint> {
    let mut inputs = Vec::new();
    for file in runs.iter().flat_map(|run| run.recording().paths()) {
        let found = std::fs::metadata(file).with_context(|| format!("cannot read {}", file.display()))?;
        let changed_ns = found
            .modified()
            .ok()
            .and_then(|time| time.duration_since(UNIX_EPOCH).ok())
            .map(|age| age.as_nanos());
        inputs.push((file.display().to_string(), found.len(), changed_ns.map(|ns| ns.to_string())));
    }
    let job = serde_json::to_string(&(env!("CARGO_PKG_VERSION"), inputs, params.spoilt_share))?;
    let checkpoint =
        Checkpoint::open(path, &job).with_context(|| format!("cannot write {}", path.display()))?;
    if !checkpoint.is_empty() {
        console.note(format!("{}: going on after {} searches", path.display(), checkpoint.len()));
    }
    Ok(checkpoint)
}

/// Optimises, and shows how far it is.
pub fn work(
    trails: &[Trail],
    params: &LoopParams,
    checkpoint: &mut Checkpoint,
    console: &Console,
) -> Optimised {
    let spinner = console.spinner("stretches");
    loops::optimise(trails, params, checkpoint, &mut |progress| {
        spinner.say(match progress {
            Progress::Stretches(scans) => format!("stretches of {scans} scans"),
            Progress::Searched(pairs, loops) => format!("{pairs} pairs searched, {loops} loops"),
            Progress::Joint(round, rounds) => format!("all scans among all, round {} of {rounds}", round + 1),
        });
    })
}

/// The files to write, and the recordings in each: the first one's company in the output, others apart.
fn files(groups: &[usize], output: &Path, apart: &impl Fn(usize) -> PathBuf) -> Vec<(PathBuf, Vec<usize>)> {
    let mut files: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (number, group) in groups.iter().enumerate() {
        files.entry(*group).or_default().push(number);
    }
    let name = |group: usize| if group == 0 { output.to_owned() } else { apart(group) };
    files.into_iter().map(|(group, members)| (name(group), members)).collect()
}

fn told(runs: &[Run], optimised: &Optimised) -> BTreeMap<String, String> {
    let inputs: Vec<String> = runs
        .iter()
        .filter_map(|run| run.path().file_name().map(|name| name.to_string_lossy().into_owned()))
        .collect();
    BTreeMap::from([
        ("recordings".to_owned(), inputs.join(", ")),
        ("loops".to_owned(), optimised.counts.loops.to_string()),
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
    ])
}

fn report(
    runs: &[Run],
    trails: &[Trail],
    optimised: &Optimised,
    (output, apart): (&Path, &impl Fn(usize) -> PathBuf),
    moment: &Moment,
) -> Report {
    let (wall_s, cpu_s) = moment.elapsed_s();
    let groups = &optimised.groups;
    let recordings = runs.iter().zip(groups).enumerate().map(|(number, (run, group))| {
        let (shared_stretches, shared_agreement) = shared(number, trails, &optimised.loops);
        RecordingReport {
            path: run.path().display().to_string(),
            scans: trails[number].scans.len(),
            output: if *group == 0 { output.to_owned() } else { apart(*group) }.display().to_string(),
            joined: groups.iter().filter(|other| *other == group).count() > 1,
            shared_stretches,
            shared_agreement,
        }
    });
    Report {
        recordings: recordings.collect(),
        counts: optimised.counts,
        wall_s,
        cpu_s,
        peak_memory_bytes: biplane_clock::peak_memory_bytes(),
    }
}

fn tell(args: &Args, report: &Report, console: &Console) -> anyhow::Result<()> {
    let output = args.output.display().to_string();
    for recording in report.recordings.iter().filter(|_| report.recordings.len() > 1) {
        if recording.output != output {
            // Said even when quiet: it is not in what was asked for.
            say(&format!(
                "biplane: {} saw no place that the others saw; it stays apart, in {}",
                recording.path, recording.output
            ));
        }
    }
    for recording in report.recordings.iter().filter(|recording| recording.joined) {
        console.note(format!(
            "{}: {} stretches of its way are in other recordings, {:.0} % of their points alike",
            recording.path,
            recording.shared_stretches,
            100.0 * recording.shared_agreement
        ));
    }
    console.note(format!(
        "{output}: {} loops between {} stretches of the way, {} scans moved, {:.1} s",
        report.counts.loops,
        report.counts.stretches,
        report.recordings.iter().map(|recording| recording.scans).sum::<usize>(),
        report.wall_s
    ));
    if args.json {
        crate::evaluate::print_json(report)?;
    }
    Ok(())
}
