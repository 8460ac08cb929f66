//! The serial lines of a run: their ports, and the threads that read them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use biplane_recording::Port;

use crate::io::clock::RunClock;
use crate::io::line::OpenLine;
use crate::io::reader;
use crate::io::reader::Reader;
use crate::io::serial::Link;
use crate::types::error::OnboardError;

/// The open ports and their reading threads.
pub(crate) struct Lines {
    lines: Vec<(Arc<Link>, Reader)>,
    stop: Arc<AtomicBool>,
    dropped: Arc<AtomicU64>,
}

impl Lines {
    /// Starts to read the ports.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(crate) fn start(
        opened: Vec<(Link, Arc<OpenLine>)>,
        clock: RunClock,
        realtime: bool,
    ) -> Result<Self, OnboardError> {
        let (stop, dropped) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let mut lines = Self { lines: Vec::new(), stop, dropped };
        for (link, port) in opened {
            let link = Arc::new(link);
            let shared = reader::Shared {
                clock,
                wake: thread::current(),
                stop: Arc::clone(&lines.stop),
                dropped: Arc::clone(&lines.dropped),
                realtime,
            };
            let reader = reader::spawn(Arc::clone(&link), port, shared)?;
            lines.lines.push((link, reader));
        }
        Ok(lines)
    }

    /// Reads that were dropped because the loop did not take them in time.
    pub(crate) fn dropped(&self) -> &Arc<AtomicU64> {
        &self.dropped
    }

    /// Up to when each line was read; to be asked before its reads are taken.
    pub(crate) fn received_ns(&self) -> heapless::Vec<(Port, i64), { Port::ALL.len() }> {
        self.lines.iter().map(|(link, reader)| (link.device, reader.received_ns())).collect()
    }

    /// The line whose next read is the earliest.
    pub(crate) fn earliest(&mut self) -> Option<&mut (Arc<Link>, Reader)> {
        let waiting = self.lines.iter_mut().filter_map(|line| {
            let time_ns = line.1.chunks.peek().ok()?.time_ns;
            Some((time_ns, line))
        });
        waiting.min_by_key(|(time_ns, _)| *time_ns).map(|(_, line)| line)
    }

    /// The line of a device.
    pub(crate) fn link(&self, port: Port) -> Option<&Link> {
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
