//! `record`: the onboard process on a robot.
//!
//! Threads: one a port reads and stamps; this one runs the engine (sessions, matcher); one writes the file;
//! one talks. Between them are bounded queues that count what they must drop. The engine's thread takes the
//! reads of all ports in the order of their times.

pub(crate) mod acquisition;
pub(crate) mod lines;
pub(crate) mod opening;
pub(crate) mod recorder;
pub(crate) mod status;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use biplane_matcher::TrackerParams;
use biplane_recording::{PartsWriter, Rig, Rotation, WriterOptions};

use crate::engine::Engine;
use crate::engine::options::{EngineOptions, Feed};
use crate::io::clock::RunClock;
use crate::io::port_location::SERIAL_LINKS;
use crate::io::{port_check, realtime};
use crate::live;
use crate::live::LiveView;
use crate::output::journal::JournalThread;
use crate::output::provenance;
use crate::record::acquisition::Acquisition;
use crate::record::acquisition::Controls;
use crate::record::lines::Lines;
use crate::record::recorder::queue::QueueSink;
use crate::record::recorder::writer::{FileToWrite, Writing};
use crate::record::status::notifier::StatusMode;
use crate::record::status::notifier::{StatusPrinter, StatusThread};
use crate::record::status::service::Service;
use crate::types::error::OnboardError;
use crate::types::live_address::LiveAddress;
use crate::types::run_report::{RunEnd, RunReport};
use crate::types::web_origin::WebOrigin;

/// Room on the disk that is waited for is looked for so often, nanoseconds.
const LOOK_NS: i64 = 250_000_000;

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
    pub matcher: TrackerParams,
    /// A table of the iterations of all matches, to be made besides.
    pub journal: Option<PathBuf>,
    /// Replace existing outputs.
    pub overwrite: bool,
    /// When the output's next part begins.
    pub rotation: Rotation,
    /// Wait for ports that are not there yet, and for room on the disk, instead of failing.
    pub wait: bool,
    /// Ask for real-time priority and locked memory.
    pub realtime: bool,
    /// Where links are that follow an adapter, in `by-id` and `by-path`: usually `SERIAL_LINKS`.
    pub serial_links: PathBuf,
    /// Where to serve a live view, if anywhere.
    pub live: Option<LiveAddress>,
    /// Web pages that may look at it, beside those that the viewer's own machine serves.
    pub allowed_origins: Vec<WebOrigin>,
    /// How the state is shown while it records.
    pub status: StatusMode,
    /// With less room on the disk than this, bytes, the run ends while it can still be closed; usually
    /// `crate::record::recorder::disk::STOP_BYTES`.
    pub stop_free_bytes: u64,
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
            matcher: TrackerParams::default(),
            journal: None,
            overwrite: false,
            rotation: Rotation::default(),
            wait: false,
            realtime: false,
            serial_links: PathBuf::from(SERIAL_LINKS),
            live: None,
            allowed_origins: Vec::new(),
            status: StatusMode::Silent,
            stop_free_bytes: recorder::disk::STOP_BYTES,
        }
    }
}

/// Records until the duration is over or `stop` is set, then leaves the devices idle and closes the file.
///
/// # Errors
/// As `record_with`.
pub fn record(options: &RecordOptions, stop: &AtomicBool) -> Result<RunReport, OnboardError> {
    record_with(options, Controls { stop, rotate: &AtomicBool::new(false) })
}

/// The same, with all that can be told to a run.
///
/// # Errors
/// What is wrong with rig, ports, disk or output; also when the whole run brought no scan to localize with,
/// unless it was stopped before.
pub(crate) fn record_with(
    options: &RecordOptions,
    controls: Controls<'_>,
) -> Result<RunReport, OnboardError> {
    port_check::check(&options.rig)?;
    port_check::warn(&options.rig);
    let writer_options =
        WriterOptions { overwrite: options.overwrite, sync: true, ..WriterOptions::default() };
    PartsWriter::check(&options.output, &writer_options, options.rotation)?;
    let folder = folder_of(&options.output);
    check_folder(&folder)?;
    let service = Service::find();
    find_room(options, &folder, service, controls.stop)?;
    // A service that would be started again and again shall record all the same.
    let listener = live::open(options.live, &options.allowed_origins, options.wait)?;
    let opened = opening::open_ports(options, service, controls.stop)?;
    // Not before: a machine that waits for its devices may not have had its time set.
    let clock = RunClock::start();
    let start_ns = clock.now_ns();
    let mut writer = PartsWriter::create(&options.output, &writer_options, options.rotation)?;
    provenance::write(&mut writer, &options.rig, None, &options.matcher, "biplane-onboard record", start_ns)?;
    let files_taken_away = Arc::new(AtomicU64::new(0));
    let status_printer = StatusPrinter {
        mode: options.status,
        service,
        output: options.output.clone(),
        folder: folder.clone(),
        files_taken_away: Arc::clone(&files_taken_away),
        start_ns,
    };
    let (status_thread, event_notifier, reported) = StatusThread::start(status_printer)?;
    let has_priority = options.realtime && realtime::is_allowed();
    let lines = Lines::start(opened, clock, has_priority)?;
    let (sink, source) = recorder::queue::queue(
        Arc::clone(lines.dropped()),
        reported,
        Arc::clone(event_notifier.unreported()),
    );
    let (tap, view) = live::start(listener, &options.rig)?;
    let file = FileToWrite { writer, folder, stop_bytes: options.stop_free_bytes, files_taken_away };
    let writing = Writing::start(file, source, clock, tap)?;
    let begin_journal = |path: &Path| JournalThread::start(path, options.overwrite);
    let (journal_in, journal) = options.journal.as_deref().map(begin_journal).transpose()?.unzip();
    let engine = engine(options, sink.with_journal(journal_in), start_ns);
    if options.realtime {
        realtime::lock_memory();
    }
    if has_priority {
        realtime::raise_priority("loop", realtime::LOOP_PRIORITY);
    }
    service.ready();
    let end_ns = end_ns(options, start_ns);
    let mut acquisition = Acquisition { engine, lines, clock, event_notifier };
    let end = acquisition.run(end_ns, controls, &writing);
    service.stopping();
    status_thread.closing();
    let report = acquisition.finish();
    let free_bytes_at_end = writing.ended_with_bytes();
    let written = writing.finish();
    status_thread.finish();
    let (files, delays) = written?;
    let live = view.map(LiveView::finish);
    let report =
        RunReport { end, free_bytes_at_end, live, pose_delays: Some(delays), ..report.with_files(&files) };
    journal.map_or(Ok(()), JournalThread::finish)?;
    // Who stops a run while its devices are still started has what was asked for, if not much.
    if report.recorded.scans_horizontal == 0 && report.end != RunEnd::Stopped {
        let port =
            port_check::of_rig(&options.rig).first().map_or_else(String::new, |port| port.path.to_owned());
        return Err(OnboardError::NoScans { port, output: report.output });
    }
    Ok(report)
}

fn engine(options: &RecordOptions, sink: QueueSink, start_ns: i64) -> Engine<QueueSink> {
    let engine_options = EngineOptions {
        rig: options.rig.clone(),
        matcher: options.matcher,
        feed: Feed::Live,
        raw: options.raw,
    };
    let mut engine = Engine::new(&engine_options, sink, start_ns);
    if options.journal.is_some() {
        engine.keep_journal();
    }
    engine
}

fn end_ns(options: &RecordOptions, start_ns: i64) -> i64 {
    options.duration.map_or(i64::MAX, |duration| {
        start_ns.saturating_add(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX))
    })
}

/// A recording needs a folder on something that stores.
fn check_folder(folder: &Path) -> Result<(), OnboardError> {
    if !folder.is_dir() {
        return Err(OnboardError::NoFolder { folder: folder.to_owned() });
    }
    match recorder::disk::is_disk(folder) {
        Some(false) => Err(OnboardError::NoDisk { folder: folder.to_owned() }),
        _ => Ok(()),
    }
}

/// Sees to it that there is room to begin. With `wait` it is waited for, and there must be twice what a run
/// ends at: a service shall neither begin a run that ends at once nor be started again and again.
fn find_room(
    options: &RecordOptions,
    folder: &Path,
    service: Service,
    stop: &AtomicBool,
) -> Result<(), OnboardError> {
    let needed_bytes = options.stop_free_bytes.saturating_mul(if options.wait { 2 } else { 1 });
    let mut reported = false;
    while let Some(free_bytes) = recorder::disk::free_bytes(folder).filter(|&free| free < needed_bytes) {
        let low = OnboardError::DiskLow { folder: folder.to_owned(), free_bytes, needed_bytes };
        if !options.wait {
            return Err(low);
        }
        if stop.load(Ordering::Relaxed) {
            return Err(OnboardError::StoppedWaitingForRoom { folder: folder.to_owned() });
        }
        if !std::mem::replace(&mut reported, true) {
            tracing::warn!("{low}; waiting for room");
            service.status(&format!("waiting for room: {low}"));
            // Up as far as it can be: the rest is for whoever makes room.
            service.ready();
        }
        service.alive();
        biplane_clock::sleep_ns(LOOK_NS);
    }
    Ok(())
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    #[test]
    fn a_place_where_nothing_can_be_recorded_is_refused_in_words() {
        let refused = |output: &str| {
            record(&RecordOptions::new(Rig::default(), output), &AtomicBool::new(false)).unwrap_err()
        };
        assert!(matches!(refused("/proc/run.mcap"), OnboardError::NoDisk { .. }));
        let missing = refused("/nowhere/at/all/run.mcap");
        assert!(missing.to_string().contains("mkdir -p /nowhere/at/all"), "{missing}");
    }

    #[test]
    fn without_room_for_a_recording_none_is_begun() {
        let mut options =
            RecordOptions::new(Rig::default(), std::env::temp_dir().join("biplane-no-room.mcap"));
        options.stop_free_bytes = u64::MAX;
        let refused = record(&options, &AtomicBool::new(false)).unwrap_err();
        assert!(matches!(refused, OnboardError::DiskLow { .. }), "{refused}");
        // A service waits for room, and can be stopped meanwhile.
        options.wait = true;
        let stop = AtomicBool::new(false);
        let stopped = thread::scope(|scope| {
            let recording = scope.spawn(|| record(&options, &stop));
            biplane_clock::sleep_ns(LOOK_NS);
            assert!(!recording.is_finished());
            stop.store(true, Ordering::Relaxed);
            recording.join().unwrap().unwrap_err()
        });
        assert!(matches!(stopped, OnboardError::StoppedWaitingForRoom { .. }), "{stopped}");
        assert!(!options.output.exists());
    }
}
