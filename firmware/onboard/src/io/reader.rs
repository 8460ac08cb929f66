//! The thread that reads one port: bytes with the time at which the read returned, over a bounded queue.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::thread::{self, JoinHandle, Thread};

use rtrb::{Consumer, Producer, RingBuffer};

use crate::io::clock::RunClock;
use crate::io::line::OpenLine;
use crate::io::realtime;
use crate::io::serial::Link;
use crate::types::error::OnboardError;

/// Bytes that one read returns at most; at 500,000 Bd they take 10 ms.
const READ_BYTES: usize = 512;
/// Reads that may wait for the loop: 4 s at one read every 2 ms.
const QUEUE_READS: usize = 2048;
/// A read without bytes returns after so long, nanoseconds, so that it is known that the line was still until
/// then. Larger: what waits for an answer in vain notices that later by as much.
const READ_TIMEOUT_NS: i64 = 5_000_000;
/// Between two reads the port collects bytes, nanoseconds. That makes no stamp later: it is computed from all
/// bytes of a read. Larger: fewer reads, an answer is seen later.
const COLLECT_NS: i64 = 2_000_000;
/// A lost port is looked for so often, nanoseconds.
const REOPEN_NS: i64 = 250_000_000;
/// The loop is behind: the news of a port waits so long before it is told again, nanoseconds.
const RETRY_NS: i64 = 10_000_000;

/// The bytes of one read.
pub(crate) type ChunkBytes = heapless::Vec<u8, READ_BYTES>;

/// What a reading thread has to tell.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // No heap in the acquisition path: bytes are handed on by value.
pub(crate) enum News {
    /// A read returned these bytes.
    Bytes(ChunkBytes),
    /// The port has gone.
    Lost,
    /// The port is there again and open.
    Back,
}

/// One read, or what became of the port.
#[derive(Clone, Debug)]
pub(crate) struct Chunk {
    /// When it returned, nanoseconds.
    pub time_ns: i64,
    /// What came before this is among the reads before, nanoseconds.
    pub received_ns: i64,
    /// What it returned.
    pub news: News,
}

/// What all reading threads of a run share.
#[derive(Clone, Debug)]
pub(crate) struct Shared {
    /// The run's time.
    pub clock: RunClock,
    /// The loop's thread, unparked after each read.
    pub wake: Thread,
    /// Ends the threads when set.
    pub stop: Arc<AtomicBool>,
    /// Reads that found their queue full and were dropped.
    pub dropped: Arc<AtomicU64>,
    /// Whether the threads ask for real-time priority.
    pub realtime: bool,
}

/// The loop's end of a reading thread.
#[derive(Debug)]
pub(crate) struct Reader {
    /// Reads, in order.
    pub chunks: Consumer<Chunk>,
    received_ns: Arc<AtomicI64>,
    thread: JoinHandle<()>,
}

impl Reader {
    /// What came before this time is among the reads, or has been taken from there. Ask this first, then take
    /// the reads.
    #[must_use]
    pub(crate) fn received_ns(&self) -> i64 {
        self.received_ns.load(Ordering::Acquire)
    }

    /// Waits for the thread to end; it does so soon after the stop flag is set.
    pub(crate) fn join(self) {
        // A reader that panicked has said so already.
        let _ = self.thread.join();
    }
}

/// Starts reading.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn spawn(link: Arc<Link>, port: Arc<OpenLine>, shared: Shared) -> Result<Reader, OnboardError> {
    let (producer, chunks) = RingBuffer::new(QUEUE_READS);
    let name = format!("read {}", link.device.name());
    let received_ns = Arc::new(AtomicI64::new(shared.clock.now_ns()));
    let worker = Worker { link, shared, producer, received_ns: Arc::clone(&received_ns) };
    let thread = thread::Builder::new()
        .name(name)
        .spawn(move || worker.run(port))
        .map_err(|source| OnboardError::System { what: "start a reading thread", source })?;
    Ok(Reader { chunks, received_ns, thread })
}

struct Worker {
    link: Arc<Link>,
    shared: Shared,
    producer: Producer<Chunk>,
    received_ns: Arc<AtomicI64>,
}

impl Worker {
    fn run(mut self, port: Arc<OpenLine>) {
        if self.shared.realtime {
            realtime::raise_priority(self.link.device.name(), realtime::READER_PRIORITY);
        }
        let mut port = Some(port);
        while !self.shared.stop.load(Ordering::Relaxed) {
            port = match port {
                Some(open) => self.read(open),
                None => self.look_for_port(),
            };
        }
    }

    fn read(&mut self, port: Arc<OpenLine>) -> Option<Arc<OpenLine>> {
        let mut buffer = [0; READ_BYTES];
        let before_ns = self.shared.clock.now_ns();
        match port.read(&mut buffer, READ_TIMEOUT_NS) {
            Ok(Some(count)) => {
                self.hand_on(buffer.get(..count).unwrap_or_default());
                // Behind a full read there may be more that is as old.
                if count < READ_BYTES {
                    self.received_ns.store(before_ns, Ordering::Release);
                }
                // A network brings telegrams of several reads at once.
                if count < READ_BYTES || !port.is_network() {
                    biplane_clock::sleep_ns(COLLECT_NS);
                }
                Some(port)
            }
            Ok(None) => {
                self.received_ns.store(before_ns, Ordering::Release);
                Some(port)
            }
            Err(error) => {
                drop(port);
                self.lost(&error);
                None
            }
        }
    }

    fn hand_on(&mut self, bytes: &[u8]) {
        let time_ns = self.shared.clock.now_ns();
        let bytes = ChunkBytes::from_slice(bytes).unwrap_or_default();
        let received_ns = self.received_ns.load(Ordering::Relaxed);
        if self.producer.push(Chunk { time_ns, received_ns, news: News::Bytes(bytes) }).is_err() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
        self.shared.wake.unpark();
    }

    fn lost(&mut self, error: &io::Error) {
        // The session says that the port is lost; why is for whoever looks closer.
        tracing::debug!("{}: {error}", self.link.path().display());
        self.link.close();
        self.notify(&News::Lost);
    }

    fn look_for_port(&mut self) -> Option<Arc<OpenLine>> {
        biplane_clock::sleep_ns(REOPEN_NS);
        let (port, path) = self.link.reopen().ok()?;
        tracing::debug!("{} is back as {}", self.link.path().display(), path.display());
        self.notify(&News::Back);
        Some(port)
    }

    /// News of the port itself are never dropped.
    fn notify(&mut self, news: &News) {
        let time_ns = self.shared.clock.now_ns();
        while self.producer.push(Chunk { time_ns, received_ns: time_ns, news: news.clone() }).is_err()
            && !self.shared.stop.load(Ordering::Relaxed)
        {
            biplane_clock::sleep_ns(RETRY_NS);
        }
        self.shared.wake.unpark();
    }
}
