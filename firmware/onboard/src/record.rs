//! `record`: the onboard process on a robot.
//!
//! Threads: one a port reads and stamps; this one runs the engine (sessions, matcher); one writes the file. Between them
//! are bounded queues that count what they must drop. The engine's thread takes the reads of all ports in the order of their times.

mod clock;
mod queue;
mod writing;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use biplane_matcher::Method;
use biplane_recording::{Port, Rig, Writer, WriterOptions};

pub use clock::RunClock;

use crate::engine::{Command, Engine, EngineOptions, Feed};
use crate::error::OnboardError;
use crate::link::{self, Link, Reader};
use crate::ports::{self, device_name};
use crate::provenance;
use crate::report::RunReport;
use queue::QueueSink;
use writing::Writing;

/// The loop looks around at least so often, nanoseconds.
const LONGEST_PARK_NS: i64 = 20_000_000;
/// Time that has come is told to the engine this much later, nanoseconds, so that a read that is just under way is not overtaken.
const READ_UNDER_WAY_NS: i64 = 3_000_000;
/// Devices get this long to be left idle, nanoseconds.
const STOP_NS: i64 = 3_000_000_000;

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
}

/// Records until the duration is over or `stop` is set, then leaves the devices idle and closes the file.
///
/// # Errors
/// What is wrong with rig, ports or output; also when the whole run brought no scan to localise with.
pub fn record(options: &RecordOptions, stop: &AtomicBool) -> Result<RunReport, OnboardError> {
    ports::check(&options.rig)?;
    let writer_options =
        WriterOptions { overwrite: options.overwrite, sync: true, ..WriterOptions::default() };
    Writer::check(&options.output, &writer_options)?;
    let clock = RunClock::start();
    let lines = Lines::open(&options.rig, clock)?;
    let mut writer = Writer::create(&options.output, &writer_options)?;
    let start_ns = clock.now_ns();
    provenance::write(&mut writer, &options.rig, options.matcher, "biplane-onboard record", start_ns)?;
    let (sink, source) = queue::queue(Arc::clone(&lines.dropped));
    let writing = Writing::start(writer, source, folder_of(&options.output))?;
    let engine_options = EngineOptions {
        rig: options.rig.clone(),
        matcher: options.matcher,
        feed: Feed::Live,
        raw: options.raw,
    };
    let engine = Engine::new(&engine_options, sink, start_ns);
    let end_ns = options.duration.map_or(i64::MAX, |duration| {
        start_ns.saturating_add(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX))
    });
    let mut acquisition = Acquisition { engine, lines, clock };
    acquisition.run(end_ns, stop, &writing);
    let report = acquisition.finish();
    let written = writing.finish()?;
    if report.scans_horizontal == 0 {
        let port = options.rig.horizontal.port.clone();
        return Err(OnboardError::NoScans { port, output: written.path });
    }
    Ok(RunReport { output: written.path, ..report })
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// The open ports and their reading threads.
struct Lines {
    lines: Vec<(Arc<Link>, Reader)>,
    stop: Arc<AtomicBool>,
    dropped: Arc<AtomicU64>,
}

impl Lines {
    /// Opens all ports of a rig before anything is read: a missing one is told before a file is begun.
    fn open(rig: &Rig, clock: RunClock) -> Result<Self, OnboardError> {
        let mut opened = Vec::new();
        for (device, path, baud) in ports::of_rig(rig) {
            opened.push(Link::open(device, path, baud)?);
        }
        let (stop, dropped) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let mut lines = Vec::new();
        for (link, port) in opened {
            let link = Arc::new(link);
            let shared = link::Shared {
                clock,
                wake: thread::current(),
                stop: Arc::clone(&stop),
                dropped: Arc::clone(&dropped),
            };
            let reader = link::spawn(Arc::clone(&link), port, shared)?;
            lines.push((link, reader));
        }
        Ok(Self { lines, stop, dropped })
    }

    /// The line whose next read is the earliest.
    fn earliest(&mut self) -> Option<&mut (Arc<Link>, Reader)> {
        let waiting = self.lines.iter_mut().filter_map(|line| {
            let time_ns = line.1.chunks.peek().ok()?.time_ns;
            Some((time_ns, line))
        });
        waiting.min_by_key(|(time_ns, _)| *time_ns).map(|(_, line)| line)
    }

    fn link(&self, port: Port) -> Option<&Link> {
        self.lines.iter().map(|(link, _)| link.as_ref()).find(|link| link.device == port)
    }
}

/// Also when a run fails before it has begun, the threads end.
impl Drop for Lines {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for (_, reader) in self.lines.drain(..) {
            reader.join();
        }
    }
}

/// The loop: reads in, commands out.
struct Acquisition {
    engine: Engine<QueueSink>,
    lines: Lines,
    clock: RunClock,
}

impl Acquisition {
    /// Runs until it is told to stop, then until the devices are idle.
    fn run(&mut self, end_ns: i64, stop: &AtomicBool, writing: &Writing) {
        self.serve_engine();
        let mut give_up_ns = i64::MAX;
        loop {
            self.take_reads();
            let now_ns = self.clock.now_ns();
            self.engine.advance(now_ns - READ_UNDER_WAY_NS);
            self.serve_engine();
            let is_over = stop.load(Ordering::Relaxed) || now_ns >= end_ns || writing.has_failed();
            if is_over && give_up_ns == i64::MAX {
                give_up_ns = now_ns.saturating_add(STOP_NS);
                self.engine.stop(now_ns);
                self.serve_engine();
            }
            if give_up_ns != i64::MAX && (self.engine.is_stopped() || now_ns >= give_up_ns) {
                return;
            }
            self.wait();
        }
    }

    fn take_reads(&mut self) {
        while let Some((link, reader)) = self.lines.earliest() {
            let device = link.device;
            let Ok(chunk) = reader.chunks.pop() else { return };
            self.engine.bytes(chunk.time_ns, device, &chunk.bytes);
            self.serve_engine();
        }
    }

    /// Sends what the sessions want sent, says what they say.
    fn serve_engine(&mut self) {
        while let Some((port, command)) = self.engine.next_command() {
            let Some(link) = self.lines.link(port) else { continue };
            let result = match command {
                Command::Write(bytes) => link.write(&bytes),
                Command::SetBaud(baud) => link.set_baud(baud),
            };
            if let Err(error) = result {
                tracing::debug!("{} ({}): {error}", device_name(port), link.path);
            }
        }
        while let Some((port, event)) = self.engine.next_event() {
            let device = device_name(port);
            if event.is_warning() {
                tracing::warn!("{device}: {event}");
            } else {
                tracing::info!("{device}: {event}");
            }
        }
    }

    /// Until a read wakes it or something is due.
    fn wait(&self) {
        let due_ns = self.engine.wake_ns().saturating_add(READ_UNDER_WAY_NS);
        let park_ns = due_ns.saturating_sub(self.clock.now_ns()).clamp(0, LONGEST_PARK_NS);
        thread::park_timeout(Duration::from_nanos(park_ns.unsigned_abs()));
    }

    fn finish(self) -> RunReport {
        drop(self.lines);
        let (report, _) = self.engine.finish(self.clock.now_ns());
        // The sink is gone now: the writing thread sees that nothing more comes.
        report
    }
}
