//! `replay`: the onboard process fed from a file, deterministic and as fast as it can be.
//!
//! The input is a capture (serial bytes), or a recording with scans and odometry, whose poses are found anew.
//! Simulated time is the input's `log_time`; nothing is answered to what the sessions would send.

pub(crate) mod basin;
pub(crate) mod bench;
pub(crate) mod feeding;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};

use biplane_matcher::TrackerParams;
use biplane_recording::mcap::read::RIG_ASSUMED;
use biplane_recording::mcap::write::check_outputs;
use biplane_recording::{PartsWriter, Recording, Rig, Rotation, WriterOptions};

use crate::engine::Engine;
use crate::engine::options::{EngineOptions, Feed};
use crate::engine::out::sink::Sink;
use crate::live;
use crate::live::{Listener, LiveView};
use crate::output::file_sink::DirectSink;
use crate::output::journal::JournalFile;
use crate::output::provenance;
use crate::replay::feeding::{Content, Feeding, survey};
use crate::types::error::OnboardError;
use crate::types::live_address::LiveAddress;
use crate::types::run_report::{RunEnd, RunReport};
use crate::types::web_origin::WebOrigin;

/// While waiting for simulated time, a request to stop is noticed so often, nanoseconds.
const STOP_LOOK_NS: i64 = 50_000_000;

/// How fast time passes.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub enum Speed {
    /// As fast as it can be done.
    #[default]
    Max,
    /// So many times as fast as it was recorded.
    Times(f64),
}

/// A speed that is none.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("expected `max` or a number greater than 0, found \"{found}\"")]
pub struct InvalidSpeed {
    /// What was given.
    pub found: String,
}

impl FromStr for Speed {
    type Err = InvalidSpeed;

    fn from_str(text: &str) -> Result<Self, InvalidSpeed> {
        let error = || InvalidSpeed { found: text.to_owned() };
        if text == "max" {
            return Ok(Self::Max);
        }
        let times: f64 = text.parse().map_err(|_| error())?;
        if times.is_finite() && times > 0.0 { Ok(Self::Times(times)) } else { Err(error()) }
    }
}

/// What to replay.
#[derive(Clone, PartialEq, Debug)]
pub struct ReplayOptions {
    /// A capture, or a recording with scans and odometry: one file, or its parts (see [`Recording`]).
    pub inputs: Vec<PathBuf>,
    /// The recording to make.
    pub output: PathBuf,
    /// The rig; the input's own when `None`.
    pub rig: Option<Rig>,
    /// How fast.
    pub speed: Speed,
    /// Where to serve a live view, if anywhere.
    pub live: Option<LiveAddress>,
    /// Web pages that may look at it, beside those that the viewer's own machine serves.
    pub allowed_origins: Vec<WebOrigin>,
    /// How scans are matched.
    pub matcher: TrackerParams,
    /// A table of the iterations of all matches, to be made besides.
    pub journal: Option<PathBuf>,
    /// Replace existing outputs.
    pub overwrite: bool,
    /// When the output's next part begins.
    pub rotation: Rotation,
}

impl ReplayOptions {
    /// The input's own rig, the default matcher, as fast as it can be, into one file that must not exist.
    #[must_use]
    pub fn new(input: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            inputs: vec![input.into()],
            output: output.into(),
            rig: None,
            speed: Speed::Max,
            live: None,
            allowed_origins: Vec::new(),
            matcher: TrackerParams::default(),
            journal: None,
            overwrite: false,
            rotation: Rotation::default(),
        }
    }
}

/// Replays until the input ends, or `stop` is set: then the file is closed with what was replayed, and the
/// report says [`RunEnd::Interrupted`], with poses or without.
///
/// # Errors
/// What is wrong with input, output or rig. The input is read through once before the output is begun, so
/// that nothing is made from a file that is damaged.
pub fn replay(options: &ReplayOptions, stop: &AtomicBool) -> Result<RunReport, OnboardError> {
    let input = Recording::open(&options.inputs)?;
    let inputs: Vec<PathBuf> = input.paths().map(Path::to_owned).collect();
    let outputs: Vec<&Path> = [Some(&options.output), options.journal.as_ref()]
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
        .collect();
    check_outputs(&outputs, &inputs, options.overwrite)?;
    let writer_options = WriterOptions { overwrite: options.overwrite, inputs, ..WriterOptions::default() };
    PartsWriter::check(&options.output, &writer_options, options.rotation)?;
    let rig = match &options.rig {
        Some(rig) => rig.clone(),
        None => input.rig()?.ok_or_else(|| OnboardError::NoRig { path: input.path().to_owned() })?,
    };
    let (content, start_ns) = survey(&input, &rig)?;
    let listener = live::open(options.live, &options.allowed_origins, false)?;
    let writer = PartsWriter::create(&options.output, &writer_options, options.rotation)?;
    let output = Output { writer, listener };
    let made = run_into(output, options, rig, Input { recording: &input, content, start_ns }, stop);
    if made.is_err() {
        // What this run itself began: left there, it would only stand in the way of the next attempt.
        PartsWriter::remove_begun(&options.output, &writer_options, options.rotation);
    }
    let report = made?;
    if report.recorded.poses == 0 && report.end == RunEnd::InputOver {
        return Err(OnboardError::NoPoses { input: input.path().to_owned(), output: report.output });
    }
    Ok(report)
}

/// What is replayed.
struct Input<'a> {
    recording: &'a Recording,
    /// What is in it.
    content: Content,
    /// Its first time, nanoseconds.
    start_ns: i64,
}

/// Where it goes.
struct Output {
    writer: PartsWriter,
    /// That of the live view.
    listener: Option<Listener>,
}

/// The replay itself, from a begun output to a finished one.
fn run_into(
    Output { mut writer, listener }: Output,
    options: &ReplayOptions,
    rig: Rig,
    Input { recording, content, start_ns }: Input<'_>,
    stop: &AtomicBool,
) -> Result<RunReport, OnboardError> {
    let assumed = match options.rig {
        Some(_) => None,
        None => {
            recording.first().metadata()?.remove("biplane").and_then(|mut words| words.remove(RIG_ASSUMED))
        }
    };
    provenance::write(&mut writer, &rig, assumed, &options.matcher, "biplane-onboard replay", start_ns)?;
    let (tap, view) = live::start(listener, &rig)?;
    let engine_options = EngineOptions { rig, matcher: options.matcher, feed: Feed::Recorded, raw: false };
    let begin_journal = |path: &Path| JournalFile::create(path, options.overwrite);
    let journal = options.journal.as_deref().map(begin_journal).transpose()?;
    let keeps_journal = journal.is_some();
    let mut engine = Engine::new(&engine_options, DirectSink::new(writer, journal, tap), start_ns);
    if keeps_journal {
        engine.keep_journal();
    }
    let mut feeding = Feeding::new(engine, content, start_ns);
    let pace = Pace::new(options.speed, start_ns);
    let end = feeding.feed(recording, |log_time_ns| pace.wait_for(log_time_ns, stop), stop)?;
    let (report, mut sink) = feeding.finish();
    sink.check()?;
    // The tap goes with it: the live view sees that nothing more comes.
    let (writer, journal) = sink.into_files();
    let written = writer.finish()?;
    journal.map_or(Ok(()), JournalFile::finish)?;
    Ok(RunReport { end, live: view.map(LiveView::finish), ..report.with_files(&written) })
}

/// Lets simulated time pass as fast as asked.
struct Pace {
    speed: Speed,
    wall_start_ns: i64,
    log_start_ns: i64,
}

impl Pace {
    fn new(speed: Speed, log_start_ns: i64) -> Self {
        Self { speed, wall_start_ns: biplane_clock::monotonic_ns(), log_start_ns }
    }

    fn wait_for(&self, log_time_ns: i64, stop: &AtomicBool) {
        let Speed::Times(times) = self.speed else { return };
        let due_ns = (log_time_ns.saturating_sub(self.log_start_ns) as f64 / times) as i64;
        loop {
            let left_ns = due_ns.saturating_sub(biplane_clock::monotonic_ns() - self.wall_start_ns);
            if left_ns <= 0 || stop.load(Ordering::Relaxed) {
                return;
            }
            biplane_clock::sleep_ns(left_ns.min(STOP_LOOK_NS));
        }
    }
}
