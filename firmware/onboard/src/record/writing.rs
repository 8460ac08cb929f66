//! The thread that writes the recording, so that the disk never holds up the loop.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use biplane_recording::msg::{DiagnosticStatus, KeyValue, Message};
use biplane_recording::write::PROMISED_NS;
use biplane_recording::{PartsReport, PartsWriter, Topic, WriteError};

use super::RunClock;
use super::clock::clock_status;
use super::delays::{Delays, PoseDelays};
use super::disk;
use super::queue::QueueSource;
use crate::diagnostics;
use crate::error::OnboardError;
use crate::live::Tap;
use crate::message_ring::Head;

/// How long the thread sleeps when there is nothing to write, nanoseconds.
const IDLE_NS: i64 = 2_000_000;

/// The writing thread, seen from the loop.
#[derive(Debug)]
pub struct Writing {
    failed: Arc<AtomicBool>,
    disk_low: Arc<AtomicBool>,
    rotate: Arc<AtomicBool>,
    thread: JoinHandle<Result<(PartsReport, PoseDelays), WriteError>>,
}

impl Writing {
    /// Starts to write what comes out of the queue; `folder` is where the file lies. With less than `stop_bytes` of room left there,
    /// [`Writing::is_disk_low`] says so. What is in the file goes to the tap of a live view as well.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(
        writer: PartsWriter,
        source: QueueSource,
        folder: PathBuf,
        stop_bytes: u64,
        clock: RunClock,
        tap: Option<Tap>,
    ) -> Result<Self, OnboardError> {
        let [failed, disk_low, rotate] = std::array::from_fn(|_| Arc::new(AtomicBool::new(false)));
        let worker = Worker {
            writer,
            source,
            folder,
            stop_bytes,
            clock,
            disk_low: Arc::clone(&disk_low),
            rotate: Arc::clone(&rotate),
            cdr: Vec::new(),
            delays: Delays::default(),
            is_slow: false,
            tap,
        };
        let flag = Arc::clone(&failed);
        let thread = thread::Builder::new()
            .name("write".to_owned())
            .spawn(move || {
                let result = worker.run();
                flag.store(result.is_err(), Ordering::Relaxed);
                result
            })
            .map_err(|source| OnboardError::System { what: "start the writing thread", source })?;
        Ok(Self { failed, disk_low, rotate, thread })
    }

    /// Whether writing has failed: nothing more is recorded.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// Whether the disk has so little room that the run must end.
    #[must_use]
    pub fn is_disk_low(&self) -> bool {
        self.disk_low.load(Ordering::Relaxed)
    }

    /// Asks for the next part, where there are parts.
    pub fn rotate(&self) {
        self.rotate.store(true, Ordering::Relaxed);
    }

    /// Waits until everything is written and the file has its name; says how long poses took into it.
    ///
    /// # Errors
    /// The write that failed.
    pub fn finish(self) -> Result<(PartsReport, PoseDelays), OnboardError> {
        match self.thread.join() {
            Ok(result) => Ok(result?),
            Err(_) => Err(OnboardError::System {
                what: "write the recording",
                source: std::io::Error::other("the writing thread panicked"),
            }),
        }
    }
}

struct Worker {
    writer: PartsWriter,
    source: QueueSource,
    folder: PathBuf,
    stop_bytes: u64,
    clock: RunClock,
    disk_low: Arc<AtomicBool>,
    rotate: Arc<AtomicBool>,
    cdr: Vec<u8>,
    delays: Delays,
    /// Whether the disk has been told to be slow.
    is_slow: bool,
    tap: Option<Tap>,
}

impl Worker {
    fn run(mut self) -> Result<(PartsReport, PoseDelays), WriteError> {
        loop {
            // Asked before the queue is emptied: what was added before the loop went is then still written.
            let is_over = self.source.is_over();
            let mut is_idle = true;
            while let Some(head) = self.source.next_message(&mut self.cdr) {
                is_idle = false;
                self.writer.write_encoded(head.topic, head.log_time_ns, head.publish_time_ns, &self.cdr)?;
                self.delays.written(self.clock.now_ns(), &head);
                self.show(&head);
            }
            while let Some((now_ns, health)) = self.source.next_health() {
                let free_bytes = disk::free_bytes(&self.folder);
                if free_bytes.is_some_and(|free| free < self.stop_bytes) {
                    self.disk_low.store(true, Ordering::Relaxed);
                }
                let mut message = diagnostics::message(now_ns, &health);
                message.status.push(disk_status(free_bytes, self.at_risk()));
                message.status.push(self.delays.status());
                message.status.push(clock_status(self.clock.utc_offset_ns()));
                message.encode(&mut self.cdr);
                let head = Head { topic: Topic::Diagnostics, log_time_ns: now_ns, publish_time_ns: now_ns };
                self.writer.write_encoded(head.topic, now_ns, now_ns, &self.cdr)?;
                self.show(&head);
            }
            if self.rotate.swap(false, Ordering::Relaxed) && !self.writer.rotate_now()? {
                tracing::warn!(
                    "asked for the next part of the recording, but it has none (--rotate-minutes, --rotate-mb)"
                );
            }
            if is_over {
                let delays = self.delays.report();
                return Ok((self.writer.finish()?, delays));
            }
            let saved = self.writer.save_if_due(&|| self.clock.now_ns())?;
            if is_idle && !saved {
                biplane_clock::sleep_ns(IDLE_NS);
            }
        }
    }
}

impl Worker {
    /// What a power cut would have cost at worst since the last time, ns. When it begins to be more than promised it is told.
    fn at_risk(&mut self) -> i64 {
        let at_risk_ns = self.writer.take_worst_age_ns();
        let is_slow = at_risk_ns > PROMISED_NS;
        if is_slow && !self.is_slow {
            let at_risk_s = at_risk_ns as f64 / 1e9;
            tracing::warn!("the disk is slow: a power cut would now cost the last {at_risk_s:.1} s");
        }
        self.is_slow = is_slow;
        at_risk_ns
    }

    /// The message in hand, which is in the file, to the live view.
    fn show(&mut self, head: &Head) {
        if let Some(tap) = &mut self.tap {
            tap.message(head.topic, head.log_time_ns, head.publish_time_ns, &self.cdr);
        }
    }
}

/// Room on the recording's disk, and what a power cut would have cost.
fn disk_status(free: Option<u64>, at_risk_ns: i64) -> DiagnosticStatus {
    let (level, message) = match free {
        Some(free) if free < disk::LOW_BYTES => (DiagnosticStatus::WARN, "little room left"),
        _ if at_risk_ns > PROMISED_NS => {
            (DiagnosticStatus::WARN, "slow: a power cut would cost more than a second")
        }
        Some(_) => (DiagnosticStatus::OK, "room left"),
        None => (DiagnosticStatus::STALE, "room not known"),
    };
    let value = |key: &str, value: String| KeyValue { key: key.to_owned(), value };
    let free = free.map(|free| value("free_bytes", free.to_string()));
    let at_risk = value("at_risk_ms", (at_risk_ns / 1_000_000).to_string());
    DiagnosticStatus {
        level,
        name: "biplane: disk".to_owned(),
        message: message.to_owned(),
        hardware_id: "disk".to_owned(),
        values: free.into_iter().chain([at_risk]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::health::Health;
    use crate::record::queue::queue;
    use crate::sink::Sink;
    use biplane_recording::{Rotation, WriterOptions};
    use rtrb::RingBuffer;
    use std::sync::atomic::AtomicU64;

    #[test]
    fn a_disk_with_too_little_room_is_told_and_the_file_is_closed() {
        for (stop_bytes, is_low) in [(u64::MAX, true), (0, false)] {
            let folder = std::env::temp_dir().join(format!("biplane-low-{is_low}-{}", std::process::id()));
            let _ = std::fs::remove_dir_all(&folder);
            std::fs::create_dir_all(&folder).unwrap();
            let path = folder.join("run.mcap");
            let writer = PartsWriter::create(&path, &WriterOptions::default(), Rotation::default()).unwrap();
            let (mut sink, source) =
                queue(Arc::new(AtomicU64::new(0)), (RingBuffer::new(4).0, Arc::default()));
            let writing =
                Writing::start(writer, source, folder.clone(), stop_bytes, RunClock::start(), None).unwrap();
            assert!(!writing.is_disk_low());
            sink.health(1, &Health::default());
            drop(sink);
            let disk_low = Arc::clone(&writing.disk_low);
            assert_eq!(writing.finish().unwrap().0.parts[0].messages, 1);
            assert_eq!(disk_low.load(Ordering::Relaxed), is_low);
            std::fs::remove_dir_all(folder).unwrap();
        }
    }
}
