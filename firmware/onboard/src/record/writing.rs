//! The thread that writes the recording, so that the disk never holds up the loop.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use biplane_recording::msg::{DiagnosticStatus, KeyValue};
use biplane_recording::{PartsReport, PartsWriter, Topic, WriteError};

use super::queue::QueueSource;
use crate::diagnostics;
use crate::error::OnboardError;

/// How long the thread sleeps when there is nothing to write, nanoseconds.
const IDLE_NS: i64 = 5_000_000;
/// With less room left on the disk, diagnostics warn, bytes: 3 hours of a usual run.
const LOW_DISK_BYTES: u64 = 500 << 20;

/// The writing thread, seen from the loop.
#[derive(Debug)]
pub struct Writing {
    failed: Arc<AtomicBool>,
    thread: JoinHandle<Result<PartsReport, WriteError>>,
}

impl Writing {
    /// Starts to write what comes out of the queue; `folder` is where the file lies.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(writer: PartsWriter, source: QueueSource, folder: PathBuf) -> Result<Self, OnboardError> {
        let failed = Arc::new(AtomicBool::new(false));
        let worker = Worker { writer, source, folder, cdr: Vec::new() };
        let flag = Arc::clone(&failed);
        let thread = thread::Builder::new()
            .name("write".to_owned())
            .spawn(move || {
                let result = worker.run();
                flag.store(result.is_err(), Ordering::Relaxed);
                result
            })
            .map_err(|source| OnboardError::System { what: "start the writing thread", source })?;
        Ok(Self { failed, thread })
    }

    /// Whether writing has failed: nothing more is recorded.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// Waits until everything is written and the file has its name.
    ///
    /// # Errors
    /// The write that failed.
    pub fn finish(self) -> Result<PartsReport, OnboardError> {
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
    cdr: Vec<u8>,
}

impl Worker {
    fn run(mut self) -> Result<PartsReport, WriteError> {
        loop {
            // Asked before the queue is emptied: what was added before the loop went is then still written.
            let is_over = self.source.is_over();
            let mut is_idle = true;
            while let Some(head) = self.source.next_message(&mut self.cdr) {
                is_idle = false;
                self.writer.write_encoded(head.topic, head.log_time_ns, head.publish_time_ns, &self.cdr)?;
            }
            while let Some((now_ns, health)) = self.source.next_health() {
                let mut message = diagnostics::message(now_ns, &health);
                message.status.push(disk(&self.folder));
                self.writer.write(Topic::Diagnostics, now_ns, now_ns, &message)?;
            }
            if is_over {
                return self.writer.finish();
            }
            if is_idle {
                biplane_clock::sleep_ns(IDLE_NS);
            }
        }
    }
}

/// Room on the recording's disk.
fn disk(folder: &std::path::Path) -> DiagnosticStatus {
    let free = rustix::fs::statvfs(folder).ok().map(|stat| stat.f_bavail.saturating_mul(stat.f_frsize));
    let (level, message) = match free {
        Some(free) if free < LOW_DISK_BYTES => (DiagnosticStatus::WARN, "little room left"),
        Some(_) => (DiagnosticStatus::OK, "room left"),
        None => (DiagnosticStatus::STALE, "room not known"),
    };
    let values = free.map(|free| KeyValue { key: "free_bytes".to_owned(), value: free.to_string() });
    DiagnosticStatus {
        level,
        name: "biplane: disk".to_owned(),
        message: message.to_owned(),
        hardware_id: "disk".to_owned(),
        values: values.into_iter().collect(),
    }
}
