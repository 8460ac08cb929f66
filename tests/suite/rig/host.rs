//! The host's side of the lines as it is in a live run: the kernel's buffers, a reading thread a port, the
//! loop; and what holds them up.
//!
//! As `link/reader.rs` and `record/acquisition.rs` do it: a reader asks for 512 bytes, waits 5 ms for them at
//! most, and rests for 2 ms behind a read; it says how far it has listened. The loop is woken by a read,
//! looks around every 5 ms, and tells the engine of time 3 ms late. Between the two stands the kernel: 4 KiB
//! a port less one (Linux's n_tty), and what comes when they are full is lost. Nanoseconds.

use std::collections::VecDeque;

use biplane_mock::rng::Rng;
use biplane_onboard::test_support::during;
use biplane_onboard::{Engine, Sink};

use super::MS;
use crate::rig::PORTS;
use crate::rig::line::tape::Tape;

/// Bytes that the kernel keeps of a port.
const KERNEL_BYTES: usize = 4095;
/// Bytes of one read.
const READ_BYTES: usize = 512;
/// A read without bytes returns after so long.
const READ_TIMEOUT_NS: i64 = 5 * MS;
/// A reader rests so long behind a read.
const COLLECT_NS: i64 = 2 * MS;
/// The loop looks around at least so often, and not more often than that.
const PARK_NS: [i64; 2] = [MS / 20, 5 * MS];
/// The loop tells the engine of time so much later.
const UNDER_WAY_NS: i64 = 3 * MS;
/// Bytes lie in a kernel's buffer for so long at most.
const LONGEST_HELD_NS: i64 = 62_000 * MS;
/// Threads: a reader a port, and the loop.
pub(crate) const THREADS: usize = PORTS.len() + 1;
const LOOP: usize = PORTS.len();

/// When a thread does not run: from, to, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stalls(VecDeque<(i64, i64)>);

impl Stalls {
    /// One stretch.
    #[must_use]
    pub(crate) fn one(from_ns: i64, to_ns: i64) -> Self {
        Self([(from_ns, to_ns)].into())
    }

    /// By chance between two times: so long each, at pauses of so long on average, milliseconds.
    #[must_use]
    pub(crate) fn by_chance(
        (from_ns, to_ns): (i64, i64),
        [shortest_ms, longest_ms, pause_ms]: [f64; 3],
        rng: &mut Rng,
    ) -> Self {
        let mut stalls = VecDeque::new();
        let mut at_ns = from_ns;
        while at_ns < to_ns {
            let begin_ns = at_ns + (rng.exponential(pause_ms) * MS as f64) as i64;
            at_ns = begin_ns + (rng.between(shortest_ms, longest_ms) * MS as f64) as i64;
            stalls.push_back((begin_ns, at_ns));
        }
        Self(stalls)
    }

    /// Adds what comes later.
    pub(crate) fn extend(&mut self, later: Self) {
        self.0.extend(later.0);
    }

    /// The first time from `at_ns` on at which the thread runs.
    fn free_ns(&self, at_ns: i64) -> i64 {
        let begun = self.0.iter().take_while(|(from_ns, _)| *from_ns <= at_ns);
        begun.fold(at_ns, |at_ns, (_, to_ns)| at_ns.max(*to_ns))
    }

    /// Whether the thread runs then.
    #[must_use]
    pub(crate) fn is_free(&self, at_ns: i64) -> bool {
        self.free_ns(at_ns) <= at_ns
    }

    /// Forgets what is over.
    pub(crate) fn forget(&mut self, now_ns: i64) {
        while self.0.front().is_some_and(|(_, to_ns)| *to_ns <= now_ns) {
            self.0.pop_front();
        }
    }
}

/// News of a port for the loop.
enum News {
    Bytes(Vec<u8>),
    Lost,
    Back,
}

/// A port and the thread that reads it.
#[derive(Default)]
struct Reader {
    kernel: VecDeque<u8>,
    /// The read under way began then.
    begun_ns: i64,
    received_ns: i64,
    /// Reads, each with how far was listened before it.
    chunks: VecDeque<(i64, i64, News)>,
    /// What reads have returned.
    delivered: Tape,
    lost_bytes: u64,
}

impl Reader {
    fn due_ns(&self, now_ns: i64) -> i64 {
        match self.kernel.is_empty() {
            true => self.begun_ns + READ_TIMEOUT_NS,
            false => self.begun_ns.max(now_ns),
        }
    }
}

/// The host.
pub(crate) struct Host {
    /// Whether what was read is kept; it grows with time.
    pub keeps_tapes: bool,
    readers: [Reader; PORTS.len()],
    stalls: [Stalls; THREADS],
    loop_ns: i64,
    next_ns: i64,
    longest_queue: [usize; 2],
}

impl Host {
    /// A host whose threads are held up so: those of the ports in their order, and the loop.
    #[must_use]
    pub(crate) fn new(stalls: [Stalls; THREADS]) -> Self {
        let mut readers: [Reader; PORTS.len()] = Default::default();
        readers.iter_mut().for_each(|reader| reader.delivered.held_ns = LONGEST_HELD_NS);
        Self { keeps_tapes: true, readers, stalls, loop_ns: 0, next_ns: 0, longest_queue: [0; 2] }
    }

    /// Holds its threads up some more, later.
    pub(crate) fn stall(&mut self, later: [Stalls; THREADS]) {
        for (stalls, later) in self.stalls.iter_mut().zip(later) {
            stalls.extend(later);
        }
    }

    /// What the reads of a port have returned.
    #[must_use]
    pub(crate) fn delivered(&self, place: usize) -> &Tape {
        &self.readers[place].delivered
    }

    /// Forgets what reads returned before.
    pub(crate) fn forget_before(&mut self, at_ns: i64) {
        self.readers.iter_mut().for_each(|reader| reader.delivered.forget_before(at_ns));
    }

    /// Bytes that the kernel had no room for.
    #[must_use]
    pub(crate) fn lost_bytes(&self) -> u64 {
        self.readers.iter().map(|reader| reader.lost_bytes).sum()
    }

    /// Most bytes in a port's kernel buffer and most reads before the loop so far.
    #[must_use]
    pub(crate) fn longest_queues(&self) -> [usize; 2] {
        self.longest_queue
    }

    /// When one of its threads has something to do.
    #[must_use]
    pub(crate) fn next_ns(&self) -> i64 {
        self.next_ns
    }

    /// Bytes have come to the computer.
    pub(crate) fn arrived(&mut self, now_ns: i64, place: usize, bytes: &[u8]) {
        let reader = &mut self.readers[place];
        let room = KERNEL_BYTES - reader.kernel.len();
        reader.kernel.extend(&bytes[..bytes.len().min(room)]);
        reader.lost_bytes += bytes.len().saturating_sub(room) as u64;
        self.longest_queue[0] = self.longest_queue[0].max(reader.kernel.len());
        self.plan(now_ns);
    }

    /// The port has gone, or is back.
    pub(crate) fn port(&mut self, now_ns: i64, place: usize, is_there: bool) {
        let reader = &mut self.readers[place];
        reader.kernel.clear();
        reader.delivered.interrupt();
        reader.chunks.push_back((now_ns, now_ns, if is_there { News::Back } else { News::Lost }));
        self.loop_ns = self.loop_ns.min(now_ns);
        self.plan(now_ns);
    }

    /// Whatever is due of the readers; whether it is the loop's turn now.
    pub(crate) fn run(&mut self, now_ns: i64) -> bool {
        self.stalls.iter_mut().for_each(|stalls| stalls.forget(now_ns));
        for place in 0..self.readers.len() {
            let due_ns = self.readers[place].due_ns(now_ns);
            if due_ns <= now_ns && self.stalls[place].free_ns(due_ns.max(now_ns)) <= now_ns {
                self.read(now_ns, place);
            }
        }
        let is_due = self.loop_ns <= now_ns && self.stalls[LOOP].free_ns(now_ns) <= now_ns;
        self.plan(now_ns);
        is_due
    }

    fn read(&mut self, now_ns: i64, place: usize) {
        let reader = &mut self.readers[place];
        let count = reader.kernel.len().min(READ_BYTES);
        let received_ns = reader.received_ns;
        if count < READ_BYTES {
            reader.received_ns = reader.begun_ns;
        }
        reader.begun_ns = now_ns;
        if count == 0 {
            return;
        }
        reader.begun_ns += COLLECT_NS;
        let bytes: Vec<u8> = reader.kernel.drain(..count).collect();
        if self.keeps_tapes {
            reader.delivered.push(now_ns, &bytes);
        }
        reader.chunks.push_back((now_ns, received_ns, News::Bytes(bytes)));
        self.longest_queue[1] = self.longest_queue[1].max(reader.chunks.len());
        self.loop_ns = self.loop_ns.min(now_ns);
    }

    /// The loop's turn: reads in the order of their times, then how far was listened, then the time. Returns
    /// allocations of the engine; `serve` does what it wants done.
    pub(crate) fn turn<K: Sink>(
        &mut self,
        now_ns: i64,
        engine: &mut Engine<K>,
        mut serve: impl FnMut(&mut Engine<K>),
    ) -> u64 {
        let received_ns: [i64; PORTS.len()] = std::array::from_fn(|place| self.readers[place].received_ns);
        let mut allocations = 0;
        while let Some((place, read_ns, received_ns, news)) = self.earliest() {
            let port = PORTS[place];
            let ((), allocated) = during(|| match &news {
                News::Bytes(bytes) => {
                    engine.read_watermark(port, received_ns);
                    engine.bytes(read_ns, port, bytes);
                }
                News::Lost => engine.port_lost(read_ns, port),
                News::Back => engine.port_back(read_ns, port),
            });
            allocations += allocated.unwrap_or_default();
            serve(engine);
        }
        let ((), allocated) = during(|| {
            for (port, up_to_ns) in PORTS.into_iter().zip(received_ns) {
                engine.read_watermark(port, up_to_ns);
            }
            engine.advance(now_ns - UNDER_WAY_NS);
        });
        serve(engine);
        let due_ns = engine.wake_ns().saturating_add(UNDER_WAY_NS);
        self.loop_ns = now_ns + (due_ns.saturating_sub(now_ns)).clamp(PARK_NS[0], PARK_NS[1]);
        self.plan(now_ns);
        allocations + allocated.unwrap_or_default()
    }

    fn earliest(&mut self) -> Option<(usize, i64, i64, News)> {
        let first = |reader: &Reader| reader.chunks.front().map_or(i64::MAX, |(at_ns, ..)| *at_ns);
        let place = (0..PORTS.len()).min_by_key(|place| first(&self.readers[*place]))?;
        self.readers[place]
            .chunks
            .pop_front()
            .map(|(at_ns, received_ns, news)| (place, at_ns, received_ns, news))
    }

    fn plan(&mut self, now_ns: i64) {
        let mut next_ns = self.stalls[LOOP].free_ns(self.loop_ns.max(now_ns));
        for (reader, stalls) in self.readers.iter().zip(&self.stalls) {
            next_ns = next_ns.min(stalls.free_ns(reader.due_ns(now_ns).max(now_ns)));
        }
        self.next_ns = next_ns;
    }
}
