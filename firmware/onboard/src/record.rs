//! `record`: the onboard process on a robot.
//!
//! Threads: one a port reads and stamps; this one runs the engine (sessions, matcher); one writes the file. Between them
//! are bounded queues that count what they must drop. The engine's thread takes the reads of all ports in the order of their times.

mod acquisition;
mod clock;
mod lines;
mod queue;
pub mod realtime;
mod writing;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use biplane_matcher::Method;
use biplane_recording::{PartsWriter, Rig, Rotation, WriterOptions};

pub use clock::RunClock;

use crate::engine::{Engine, EngineOptions, Feed};
use crate::error::OnboardError;
use crate::link::SERIAL_LINKS;
use crate::ports;
use crate::provenance;
use crate::report::RunReport;
use acquisition::Acquisition;
use lines::Lines;
use writing::Writing;

/// What to record.
#[derive(Clone, PartialEq, Debug)]
pub struct RecordOptions {
    /// The robot.
    pub rig: Rig,
    /// The recording to make.
    pub output: PathBuf,
    /// How long; until stopped when `None`.
    pub duration: Option<Duration>,
    /// Record the serial bytes as well.
    pub raw: bool,
    /// How scans are matched.
    pub matcher: Method,
    /// Replace an existing output.
    pub overwrite: bool,
    /// When the output's next part begins.
    pub rotation: Rotation,
    /// Wait for ports that are not there yet, instead of failing.
    pub wait: bool,
    /// Ask for real-time priority and locked memory.
    pub realtime: bool,
    /// Where links are that follow an adapter, in `by-id` and `by-path`: usually [`SERIAL_LINKS`].
    pub serial_links: PathBuf,
}

impl RecordOptions {
    /// Until stopped, with the default matcher, into one file that must not exist.
    #[must_use]
    pub fn new(rig: Rig, output: impl Into<PathBuf>) -> Self {
        Self {
            rig,
            output: output.into(),
            duration: None,
            raw: false,
            matcher: Method::default(),
            overwrite: false,
            rotation: Rotation::default(),
            wait: false,
            realtime: false,
            serial_links: PathBuf::from(SERIAL_LINKS),
        }
    }
}

/// Records until the duration is over or `stop` is set, then leaves the devices idle and closes the file.
///
/// # Errors
/// What is wrong with rig, ports or output; also when the whole run brought no scan to localise with.
pub fn record(options: &RecordOptions, stop: &AtomicBool) -> Result<RunReport, OnboardError> {
    ports::check(&options.rig)?;
    let writer_options =
        WriterOptions { overwrite: options.overwrite, sync: true, ..WriterOptions::default() };
    PartsWriter::check(&options.output, &writer_options, options.rotation)?;
    let clock = RunClock::start();
    let lines = Lines::open(options, clock, stop)?;
    let mut writer = PartsWriter::create(&options.output, &writer_options, options.rotation)?;
    let start_ns = clock.now_ns();
    provenance::write(&mut writer, &options.rig, options.matcher, "biplane-onboard record", start_ns)?;
    let (sink, source) = queue::queue(Arc::clone(lines.dropped()));
    let writing = Writing::start(writer, source, folder_of(&options.output))?;
    let engine_options = EngineOptions {
        rig: options.rig.clone(),
        matcher: options.matcher,
        feed: Feed::Live,
        raw: options.raw,
    };
    let engine = Engine::new(&engine_options, sink, start_ns);
    if options.realtime {
        realtime::lock_memory();
        realtime::raise_priority("loop", realtime::LOOP_PRIORITY);
    }
    let end_ns = options.duration.map_or(i64::MAX, |duration| {
        start_ns.saturating_add(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX))
    });
    let mut acquisition = Acquisition { engine, lines, clock };
    acquisition.run(end_ns, stop, &writing);
    let report = acquisition.finish();
    let report = report.with_files(&writing.finish()?);
    if report.scans_horizontal == 0 {
        let port = options.rig.horizontal.port.clone();
        return Err(OnboardError::NoScans { port, output: report.output });
    }
    Ok(report)
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}
