//! `biplane optimize`: loop closing and pose-graph optimization of recordings.

mod breaks_found;
mod loops_found;
mod recorded_times;
pub(crate) mod report;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use crate::formats::output::check_free;
use crate::formats::output::check_not_input;
use crate::formats::output::unfinished::Unfinished;
use crate::recordings::run::Run;
use crate::slam;
use crate::slam::corrected_poses::Corrected;
use crate::slam::keyframes::Keyframes;
use crate::slam::loop_closure::checkpoint::Checkpoint;
use crate::slam::refinement::spatial;
use crate::slam::rewrite_recording::Member;
use crate::slam::rewrite_recording::one_by_one;
use crate::slam::{LoopParams, Optimized, Progress, rewrite_recording};
use anyhow::{Context, bail};

use crate::cli::terminal::console::Console;
use crate::cli::terminal::dry_run::Plan;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::stopwatch::Stopwatch;
use crate::cli::terminal::threads::Threads;
use biplane_cli::Outcome;
use biplane_recording::mcap::write::{active_path, check_apart, is_being_written, with_suffix};
use report::Done;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane optimize office.mcap -o closed.mcap\n  \
    biplane optimize monday.mcap tuesday.mcap -o both.mcap\n\n\
    Several recordings are put into one frame where they saw the same places. Neither their starts nor their order need to be \
    known: the recording that begins first gives the frame. Parts of one recording (RUN_0.mcap, RUN_1.mcap) count as one. \
    Where not all join, those with the longest way go to OPT.mcap; others are written apart, as OPT.apart-N.mcap, and that is \
    reported.\n\
    After Ctrl-C the same command goes on where it was (OPT.mcap.loops).")]
pub(crate) struct Args {
    /// Posed recordings
    #[arg(required = true, value_name = "RUN.mcap")]
    recordings: Vec<PathBuf>,
    /// The recording to write: the same messages with better poses
    #[arg(long, short, value_name = "OPT.mcap")]
    output: PathBuf,
    /// Leave the poses in the plane: do not seek height, roll and pitch (of a single recording)
    #[arg(long)]
    planar: bool,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
    /// Say what would be read, done and written, and do none of it
    #[arg(long)]
    dry_run: bool,
    /// Print what was found as JSON; with --dry-run, what would be done
    #[arg(long)]
    json: bool,
    /// Write the loops found, a line each: where, how sure, and whether believed
    #[arg(long, value_name = "LOOPS.csv")]
    loops: Option<PathBuf>,
    #[command(flatten)]
    threads: Threads,
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let stopwatch = Stopwatch::now();
    args.threads.take()?;
    let runs = open(&args.recordings, console)?;
    let apart = |number: usize| args.output.with_extension(format!("apart-{}.mcap", number + 1));
    check_outputs(args, &runs, &apart)?;
    if args.dry_run {
        let plan = Plan {
            reads: runs.iter().flat_map(|run| run.recording().paths()).collect(),
            steps: vec!["read", "optimize", "write"],
            writes: vec![args.output.display().to_string()],
            takes: None,
        };
        return plan.print_result(args.json);
    }
    let params = LoopParams::default();
    let all_keyframes = read(&runs, &params, console)?;
    let kept = with_suffix(&args.output, ".loops");
    let mut checkpoint = checkpoint(&kept, &runs, console)?;
    let _searches = Unfinished::with_checkpoint(&kept, &kept);
    let optimized = work(&all_keyframes, &params, &mut checkpoint, console);
    let is_resumed = !checkpoint.is_empty();
    drop(checkpoint);
    // Bad input, no memory, a full disk: a command that fails leaves nothing behind.
    let given_up = |error: anyhow::Error| {
        let _ = std::fs::remove_file(&kept);
        error
    };
    let spinner = console.spinner("every scan");
    let mut corrected = slam::poses_of_scans(&runs, &all_keyframes, &optimized, &params)
        .map_err(|error| given_up(error.into()))?;
    drop(spinner);
    if let ([run], [corrected], false) = (&runs[..], &mut corrected[..], args.planar) {
        in_six_directions(run, corrected, console).map_err(given_up)?;
    }
    let spinner = console.spinner(format!("writing {}", args.output.display()));
    let delays_ns =
        one_by_one::delays_ns(&runs, &optimized.groups).map_err(|error| given_up(error.into()))?;
    let main = optimized.largest_group();
    let output_of = |group: usize| if group == main { args.output.clone() } else { apart(group) };
    for (group, members) in files(&optimized.groups) {
        let path = output_of(group);
        let reported = recorded_times::reported(&runs, &members, &delays_ns, optimized.loops_in(group));
        let member = |&number: &usize| Member {
            run: &runs[number],
            corrected: &corrected[number],
            delay_ns: delays_ns[number],
        };
        let members: Vec<Member<'_>> = members.iter().map(member).collect();
        let begun = active_path(&path);
        if is_resumed && !is_being_written(&begun) {
            // Begun by the run that was killed: the searches beside it are of this very job.
            let _ = std::fs::remove_file(&begun);
        }
        let _begun = (!begun.exists()).then(|| Unfinished::new(&begun));
        rewrite_recording::write(&path, &members, args.force, &reported)
            .map_err(|error| given_up(error.into()))?;
    }
    drop(spinner);
    if let Some(path) = &args.loops {
        loops_found::write(path, &all_keyframes, &optimized.loops)
            .with_context(|| format!("cannot write {}", path.display()))
            .map_err(given_up)?;
    }
    // What was kept to go on with is of no use any more.
    let _ = std::fs::remove_file(kept);
    let done = Done { runs: &runs, keyframes: &all_keyframes, optimized: &optimized, corrected: &corrected };
    let report = done.report(&delays_ns, output_of, &stopwatch);
    recorded_times::note(&report, console);
    report.say(&args.output, optimized.loops_in(main), console);
    if args.json {
        print_json(&report)?;
    }
    Ok(Outcome::Done)
}

/// Seeks height, roll and pitch of a single recording's poses.
fn in_six_directions(run: &Run, corrected: &mut Corrected, console: &Console) -> anyhow::Result<()> {
    let _spinner = console.spinner("six directions");
    let trajectory = corrected.trajectory(&run.poses()?.vertical_poses);
    corrected.refined = spatial::refine_run(run, &trajectory)?;
    corrected.refined.iter().for_each(|refined| console.note(refined.words()));
    Ok(())
}

/// Opens recordings; parts of one count as one. They come in the order in which they begin (those that begin
/// together by their names), so that the order of the arguments changes nothing.
pub(crate) fn open(paths: &[PathBuf], console: &Console) -> anyhow::Result<Vec<Run>> {
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
        console.report_missing(run.recording());
    }
    in_order(runs)
}

fn in_order(runs: Vec<Run>) -> anyhow::Result<Vec<Run>> {
    let begin = |run: Run| -> anyhow::Result<_> {
        let first = run.recording().messages().next().transpose()?;
        Ok((first.map(|entry| entry.log_time_ns), run))
    };
    let mut runs: Vec<_> = runs.into_iter().map(begin).collect::<Result<_, _>>()?;
    let name = |run: &Run| run.path().file_name().map(OsStr::to_owned);
    runs.sort_by_cached_key(|(begin, run)| (*begin, name(run), run.path().to_owned()));
    Ok(runs.into_iter().map(|(_, run)| run).collect())
}

fn check_outputs(args: &Args, runs: &[Run], apart: &impl Fn(usize) -> PathBuf) -> anyhow::Result<()> {
    let recordings = std::iter::once(args.output.clone())
        .chain((0..runs.len()).map(apart).skip(usize::from(runs.len() == 1)));
    let names: Vec<PathBuf> = recordings.chain(args.loops.iter().cloned()).collect();
    // What is kept to go on with is removed in the end.
    let kept = with_suffix(&args.output, ".loops");
    check_apart(&names.iter().chain([&kept]).map(PathBuf::as_path).collect::<Vec<_>>())?;
    for name in names {
        for input in runs.iter().flat_map(|run| run.recording().paths()) {
            check_not_input(&name, ".active", input)?;
        }
        check_free(&name, args.force)?;
    }
    Ok(())
}

/// Reads the scans that are kept.
pub(crate) fn read(runs: &[Run], params: &LoopParams, console: &Console) -> anyhow::Result<Vec<Keyframes>> {
    let mut all_keyframes = Vec::new();
    for run in runs {
        let _spinner = console.spinner(format!("reading {}", run.path().display()));
        let poses = run.poses()?;
        console.report_poses(run.recording(), &poses);
        if rewrite_recording::is_optimized(run)? {
            let shown = run.path().display();
            console.note(format!("{shown} is optimized already: its optimized poses are where this begins"));
        }
        let keyframes = Keyframes::read(run, &poses, &params.keyframes)?;
        if keyframes.nodes.is_empty() {
            bail!("no scan of {} has a pose", run.path().display());
        }
        all_keyframes.push(keyframes);
    }
    Ok(all_keyframes)
}

/// What was found before the last stop, if it belongs to the same inputs: the same names, sizes and times of
/// change.
pub(crate) fn checkpoint(path: &Path, runs: &[Run], console: &Console) -> anyhow::Result<Checkpoint> {
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
    let job = serde_json::to_string(&(env!("CARGO_PKG_VERSION"), inputs))?;
    let checkpoint =
        Checkpoint::open(path, &job).with_context(|| format!("cannot write {}", path.display()))?;
    if !checkpoint.is_empty() {
        console.note(format!("{}: going on after {} searches", path.display(), checkpoint.len()));
    }
    Ok(checkpoint)
}

/// Optimizes, and shows how far it is.
pub(crate) fn work(
    all_keyframes: &[Keyframes],
    params: &LoopParams,
    checkpoint: &mut Checkpoint,
    console: &Console,
) -> Optimized {
    let spinner = console.spinner("stretches");
    let optimized = slam::optimize(all_keyframes, params, checkpoint, &mut |progress| {
        spinner.say(match progress {
            Progress::Submaps(scans) => format!("stretches of {scans} scans"),
            Progress::Searched(pairs, loops) => format!("{pairs} pairs searched, {loops} loops"),
            Progress::Joint(round, rounds) => format!("all scans among all, round {} of {rounds}", round + 1),
        });
    });
    drop(spinner);
    if let Some(words) = breaks_found::words(&optimized.counts) {
        console.warn(words);
    }
    if optimized.counts.not_better > 0 {
        console.warn(
            "biplane: the loops that were found draw a worse map than the recorded poses; they are not closed",
        );
    }
    optimized
}

/// The recordings of each file, by group.
fn files(groups: &[usize]) -> BTreeMap<usize, Vec<usize>> {
    let mut files: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (number, group) in groups.iter().enumerate() {
        files.entry(*group).or_default().push(number);
    }
    files
}
