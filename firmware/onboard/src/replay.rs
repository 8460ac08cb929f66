//! `replay`: the onboard process fed from a file, deterministic and as fast as it can be.
//!
//! The input is a capture (serial bytes), or a recording with scans and odometry, whose poses are found anew. Simulated time is
//! the input's `log_time`; nothing is answered to what the sessions would send.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};

use biplane_matcher::TrackerParams;
use biplane_recording::msg::{ByteArray, LaserScan, Message, Odometry};
use biplane_recording::rig::BaseProtocol;
use biplane_recording::{
    Direction, Entry, PartsWriter, Port, ReadError, Recording, Rig, Rotation, Topic, WriteError,
    WriterOptions,
};

use crate::engine::{Engine, EngineOptions, Feed};
use crate::error::OnboardError;
use crate::provenance;
use crate::report::{RunEnd, RunReport};
use crate::sink::DirectSink;

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
pub struct NotASpeed {
    /// What was given.
    pub found: String,
}

impl FromStr for Speed {
    type Err = NotASpeed;

    fn from_str(text: &str) -> Result<Self, NotASpeed> {
        let error = || NotASpeed { found: text.to_owned() };
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
    /// How scans are matched.
    pub matcher: TrackerParams,
    /// Replace an existing output.
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
            matcher: TrackerParams::default(),
            overwrite: false,
            rotation: Rotation::default(),
        }
    }
}

/// What an input holds.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum Content {
    Serial,
    Decoded,
}

/// Replays until the input ends, or `stop` is set: then the file is closed with what was replayed, and the report says
/// [`RunEnd::Interrupted`], with poses or without.
///
/// # Errors
/// What is wrong with input, output or rig. The input is read through once before the output is begun, so that nothing is made from a
/// file that is damaged.
pub fn replay(options: &ReplayOptions, stop: &AtomicBool) -> Result<RunReport, OnboardError> {
    let input = Recording::open(&options.inputs)?;
    if let Some(path) = input.paths().find(|path| same_file(path, &options.output)) {
        return Err(OnboardError::OutputIsInput { path: path.to_owned() });
    }
    let writer_options = WriterOptions {
        overwrite: options.overwrite,
        inputs: input.paths().map(Path::to_owned).collect(),
        ..WriterOptions::default()
    };
    PartsWriter::check(&options.output, &writer_options, options.rotation)?;
    let rig = match &options.rig {
        Some(rig) => rig.clone(),
        None => input.rig()?.ok_or_else(|| OnboardError::NoRig { path: input.path().to_owned() })?,
    };
    let (content, start_ns) = survey(&input, &rig)?;
    let writer = PartsWriter::create(&options.output, &writer_options, options.rotation)?;
    let made = run_into(writer, options, rig, (&input, content, start_ns), stop);
    if made.is_err() {
        // What this run itself began: left there, it would only stand in the way of the next attempt.
        PartsWriter::remove_begun(&options.output, &writer_options, options.rotation);
    }
    let report = made?;
    if report.poses == 0 && report.end == RunEnd::InputOver {
        return Err(OnboardError::NoPoses { input: input.path().to_owned(), output: report.output });
    }
    Ok(report)
}

/// The replay itself, from a begun output to a finished one.
fn run_into(
    mut writer: PartsWriter,
    options: &ReplayOptions,
    rig: Rig,
    (input, content, start_ns): (&Recording, Content, i64),
    stop: &AtomicBool,
) -> Result<RunReport, OnboardError> {
    provenance::write(&mut writer, &rig, &options.matcher, "biplane-onboard replay", start_ns)?;
    let engine_options = EngineOptions { rig, matcher: options.matcher, feed: Feed::Recorded, raw: false };
    let engine = Engine::new(&engine_options, DirectSink::new(writer), start_ns);
    let mut run = Run { engine, content, end_ns: start_ns };
    let end = run.feed(input, &Pace::new(options.speed, start_ns), stop)?;
    let (report, mut sink) = run.engine.finish(run.end_ns);
    sink.check()?;
    let written = sink.into_writer().finish()?;
    Ok(RunReport { end, ..report.with_files(&written) })
}

fn same_file(input: &Path, output: &Path) -> bool {
    match (input.canonicalize(), output.canonicalize()) {
        (Ok(input), Ok(output)) => input == output,
        _ => false,
    }
}

/// Whether the file holds serial bytes or decoded scans, and the time of its first message. Serial bytes go first: a recording made with
/// `--raw` has both. What a RoboClaw answered is refused without what it was asked: its answers have no header to know them by.
fn survey(input: &Recording, rig: &Rig) -> Result<(Content, i64), OnboardError> {
    let (mut serial, mut decoded, mut start_ns) = (false, false, None);
    let (mut answers, mut questions) = (false, false);
    for entry in input.messages() {
        let entry = entry?;
        if let Some(Topic::Serial(Port::Base, direction)) = entry.topic {
            answers |= direction == Direction::Rx;
            questions |= direction == Direction::Tx;
        }
        match entry.topic {
            Some(Topic::Serial(_, Direction::Rx)) => serial = true,
            Some(Topic::ScanHorizontal | Topic::ScanVertical) => decoded = true,
            Some(Topic::Odom) => {}
            _ => continue,
        }
        start_ns.get_or_insert(entry.log_time_ns);
    }
    if matches!(rig.base.protocol, BaseProtocol::RoboClaw { .. }) && answers && !questions {
        let (path, protocol) = (input.path().to_owned(), rig.base.protocol.name());
        return Err(OnboardError::NoQuestions { path, protocol });
    }
    let content = match (serial, decoded) {
        (true, _) => Content::Serial,
        (false, true) => Content::Decoded,
        (false, false) => {
            return Err(OnboardError::NothingToReplay { path: input.path().to_owned() });
        }
    };
    Ok((content, start_ns.unwrap_or_default()))
}

struct Run {
    engine: Engine<DirectSink>,
    content: Content,
    end_ns: i64,
}

impl Run {
    fn feed(&mut self, input: &Recording, pace: &Pace, stop: &AtomicBool) -> Result<RunEnd, OnboardError> {
        for entry in input.messages() {
            let entry = entry?;
            pace.wait_for(entry.log_time_ns, stop);
            if stop.load(Ordering::Relaxed) {
                return Ok(RunEnd::Interrupted);
            }
            self.take(&entry).map_err(|error| error.in_file(input.path()))?;
            self.say_events();
            self.check()?;
        }
        Ok(RunEnd::InputOver)
    }

    fn take(&mut self, entry: &Entry) -> Result<(), ReadError> {
        let now_ns = entry.log_time_ns;
        match (self.content, entry.topic) {
            (Content::Serial, Some(Topic::Serial(port, Direction::Rx))) => {
                let bytes: ByteArray = decode(entry)?;
                self.engine.bytes(now_ns, port, &bytes.data);
            }
            (Content::Serial, Some(Topic::Serial(port, Direction::Tx))) => {
                let bytes: ByteArray = decode(entry)?;
                self.engine.host_sent(now_ns, port, &bytes.data);
            }
            (Content::Decoded, Some(Topic::ScanHorizontal)) => {
                self.engine.decoded_scan(now_ns, Port::Horizontal, &decode::<LaserScan>(entry)?);
            }
            (Content::Decoded, Some(Topic::ScanVertical)) => {
                self.engine.decoded_scan(now_ns, Port::Vertical, &decode::<LaserScan>(entry)?);
            }
            (Content::Decoded, Some(Topic::Odom)) => {
                self.engine.decoded_odometry(now_ns, &decode::<Odometry>(entry)?);
            }
            _ => return Ok(()),
        }
        self.end_ns = self.end_ns.max(now_ns);
        Ok(())
    }

    fn say_events(&mut self) {
        while let Some((port, event)) = self.engine.next_event() {
            tracing::debug!("{}: {event}", port.name());
        }
        while self.engine.next_command().is_some() {}
    }

    fn check(&mut self) -> Result<(), WriteError> {
        self.engine.sink().check()
    }
}

fn decode<M: Message>(entry: &Entry) -> Result<M, ReadError> {
    M::decode(&entry.bytes).map_err(|source| ReadError::Message {
        path: None,
        topic: entry.topic_name.clone(),
        log_time_ns: entry.log_time_ns,
        source,
    })
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

#[cfg(test)]
mod tests;
