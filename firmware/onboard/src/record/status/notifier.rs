//! The thread that talks: log, status, service manager. A terminal that is held up holds up nobody but this
//! thread, and the loop allocates nothing for words.

use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle, Thread};
use std::time::Duration;

use biplane_recording::Port;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::engine::out::health::Health;
use crate::record::recorder::disk;
use crate::record::status::Status;
use crate::record::status::rates::Rates;
use crate::record::status::service::Service;
use crate::session::event::Event;
use crate::types::device_name::device_name;
use crate::types::error::OnboardError;

/// Events that may wait to be told.
const QUEUE_EVENTS: usize = 256;
/// States that may wait to be told; the latest counts.
const QUEUE_HEALTHS: usize = 16;
/// The thread looks for states so often; for events it is woken.
const LOOK: Duration = Duration::from_millis(50);
/// Where nobody watches, a line of state is written so often, nanoseconds.
const PLAIN_NS: i64 = 60_000_000_000;
/// The service manager hears that the loop is alive so often, nanoseconds.
const ALIVE_NS: i64 = 1_000_000_000;
/// Width of a terminal that does not tell its own.
const COLUMNS: usize = 80;

/// How the state of a run is shown.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum StatusMode {
    /// Not at all.
    #[default]
    Silent,
    /// On stderr: one line that is rewritten every second on a terminal, elsewhere a line a minute.
    Line,
    /// On stdout: one JSON object a second.
    Json,
}

/// Where the states of a run go in, with their times.
pub(crate) type States = Producer<(i64, Health)>;

/// What the loop tells with.
#[derive(Debug)]
pub(crate) struct EventNotifier {
    events: Producer<(Port, Event)>,
    unreported: Arc<AtomicU64>,
    thread: Thread,
    beat: Arc<AtomicU64>,
}

impl EventNotifier {
    /// Tells of an event. One that does not fit is not told, and counted: the log has enough to say then.
    pub(crate) fn say(&mut self, port: Port, event: Event) {
        if self.events.push((port, event)).is_err() {
            self.unreported.fetch_add(1, Ordering::Relaxed);
        }
        self.thread.unpark();
    }

    /// Counts what was not told.
    #[must_use]
    pub(crate) fn unreported(&self) -> &Arc<AtomicU64> {
        &self.unreported
    }

    /// The loop is alive.
    pub(crate) fn beat(&self) {
        self.beat.fetch_add(1, Ordering::Relaxed);
    }
}

/// What is told of, and to whom.
#[derive(Clone, Debug)]
pub(crate) struct StatusPrinter {
    /// How the state is shown.
    pub mode: StatusMode,
    /// The service manager.
    pub service: Service,
    /// The recording's name.
    pub output: PathBuf,
    /// Its folder.
    pub folder: PathBuf,
    /// Files that were removed or moved away while they were written.
    pub files_taken_away: Arc<AtomicU64>,
    /// When the run began, nanoseconds UTC.
    pub start_ns: i64,
}

/// The thread, seen from the run.
#[derive(Debug)]
pub(crate) struct StatusThread {
    over: Arc<AtomicBool>,
    closing: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl StatusThread {
    /// Starts to tell. Returns the loop's end, and where the states go in.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(crate) fn start(
        status_printer: StatusPrinter,
    ) -> Result<(Self, EventNotifier, States), OnboardError> {
        let (event_in, events) = RingBuffer::new(QUEUE_EVENTS);
        let (health_in, healths) = RingBuffer::new(QUEUE_HEALTHS);
        let (over, closing) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let beat = Arc::new(AtomicU64::new(0));
        let is_terminal = io::stderr().is_terminal();
        let worker = Worker {
            status_printer,
            events,
            healths,
            over: Arc::clone(&over),
            closing: Arc::clone(&closing),
            beat: Arc::clone(&beat),
            seen_beat: 0,
            alive_ns: i64::MIN,
            plain_ns: i64::MIN,
            is_terminal,
            rates: Rates::default(),
            shown: String::new(),
        };
        let thread = thread::Builder::new()
            .name("tell".to_owned())
            .spawn(move || worker.run())
            .map_err(|source| OnboardError::System { what: "start the telling thread", source })?;
        let event_notifier = EventNotifier {
            events: event_in,
            unreported: Arc::default(),
            thread: thread.thread().clone(),
            beat,
        };
        Ok((Self { over, closing, thread }, event_notifier, health_in))
    }

    /// The loop has ended, and the file is being closed.
    pub(crate) fn closing(&self) {
        self.closing.store(true, Ordering::Relaxed);
    }

    /// Tells the rest, and ends.
    pub(crate) fn finish(self) {
        self.over.store(true, Ordering::Relaxed);
        self.thread.thread().unpark();
        let _ = self.thread.join();
    }
}

struct Worker {
    status_printer: StatusPrinter,
    events: Consumer<(Port, Event)>,
    healths: Consumer<(i64, Health)>,
    over: Arc<AtomicBool>,
    closing: Arc<AtomicBool>,
    beat: Arc<AtomicU64>,
    seen_beat: u64,
    alive_ns: i64,
    plain_ns: i64,
    is_terminal: bool,
    rates: Rates,
    /// The line that stands on the terminal.
    shown: String,
}

impl Worker {
    fn run(mut self) {
        loop {
            // Asked first: what was said before the end is still told.
            let is_over = self.over.load(Ordering::Relaxed);
            self.print_events();
            self.print_state();
            self.notify_alive();
            if is_over {
                self.clear();
                return;
            }
            thread::park_timeout(LOOK);
        }
    }

    fn print_events(&mut self) {
        if self.events.is_empty() {
            return;
        }
        self.clear();
        while let Ok((port, event)) = self.events.pop() {
            let device = device_name(port);
            if event.is_warning() {
                tracing::warn!("{device}: {event}");
            } else {
                tracing::info!("{device}: {event}");
            }
        }
        self.draw();
    }

    fn print_state(&mut self) {
        let mut latest = None;
        while let Ok((time_ns, health)) = self.healths.pop() {
            let smooth = self.rates.smooth(time_ns, &health);
            // Machines make their own means.
            latest =
                Some((time_ns, if self.status_printer.mode == StatusMode::Json { health } else { smooth }));
        }
        let Some((time_ns, health)) = latest else { return };
        let StatusPrinter { mode, output, folder, files_taken_away, start_ns, service } =
            &self.status_printer;
        let status = Status::new(
            *start_ns,
            time_ns,
            &health,
            output,
            disk::free_bytes(folder),
            files_taken_away.load(Ordering::Relaxed),
        );
        service.status(&status.line(usize::MAX));
        match mode {
            StatusMode::Silent => {}
            StatusMode::Json => print_json(&status),
            StatusMode::Line if self.is_terminal => {
                self.clear();
                self.shown = status.line(columns().saturating_sub(1));
                self.draw();
            }
            StatusMode::Line => self.print_plain(&status),
        }
    }

    fn print_plain(&mut self, status: &Status) {
        if status.time_ns >= self.plain_ns {
            // The first one after a minute too: at its start a run has events to tell.
            if self.plain_ns != i64::MIN {
                write_stderr(&format!("{}\n", status.line(usize::MAX)));
            }
            self.plain_ns = status.time_ns.saturating_add(PLAIN_NS);
        }
    }

    fn notify_alive(&mut self) {
        let now_ns = biplane_clock::monotonic_ns();
        let beat = self.beat.load(Ordering::Relaxed);
        let is_alive = beat != self.seen_beat || self.closing.load(Ordering::Relaxed);
        if is_alive && now_ns.saturating_sub(self.alive_ns) >= ALIVE_NS {
            self.status_printer.service.alive();
            self.seen_beat = beat;
            self.alive_ns = now_ns;
        }
    }

    /// Takes the line away, so that a line of the log does not run into it.
    fn clear(&self) {
        if !self.shown.is_empty() {
            write_stderr("\r\x1b[K");
        }
    }

    fn draw(&self) {
        if !self.shown.is_empty() {
            write_stderr(&self.shown);
        }
    }
}

/// A terminal that has gone is no failure of the run.
fn write_stderr(text: &str) {
    let mut stderr = io::stderr().lock();
    let _ = stderr.write_all(text.as_bytes()).and_then(|()| stderr.flush());
}

/// An object on stdout, in one line. A reader that has gone is no failure of the run.
pub(crate) fn print_json(status: &impl serde::Serialize) {
    if let Ok(text) = serde_json::to_string(status) {
        let mut stdout = io::stdout().lock();
        let _ = stdout.write_all(format!("{text}\n").as_bytes()).and_then(|()| stdout.flush());
    }
}

fn columns() -> usize {
    match rustix::termios::tcgetwinsize(rustix::stdio::stderr()) {
        Ok(size) if size.ws_col > 0 => usize::from(size.ws_col),
        _ => COLUMNS,
    }
}
