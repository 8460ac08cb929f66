//! The thread that writes the recording, so that the disk never holds up the loop.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};

use biplane_recording::mcap::write::PROMISED_NS;
use biplane_recording::messages::{DiagnosticStatus, KeyValue, Message};
use biplane_recording::{PartsReport, PartsWriter, Topic, WriteError};

use crate::io::clock::RunClock;
use crate::io::clock::clock_status;
use crate::output::diagnostics;
use crate::output::message_ring::Head;
use crate::output::tap::Tap;
use crate::record::recorder::delays::Delays;
use crate::record::recorder::disk;
use crate::record::recorder::queue::QueueSource;
use crate::types::error::OnboardError;
use crate::types::pose_delays::PoseDelays;
use biplane_cli::counted;

/// How long the thread sleeps when there is nothing to write, nanoseconds.
const IDLE_NS: i64 = 2_000_000;

/// Of a disk with room enough.
const ROOM_LEFT: u64 = u64::MAX;

/// The writing thread, seen from the loop.
#[derive(Debug)]
pub(crate) struct Writing {
    failed: Arc<AtomicBool>,
    ended_with: Arc<AtomicU64>,
    rotate: Arc<AtomicBool>,
    thread: JoinHandle<Result<(PartsReport, PoseDelays), WriteError>>,
}

/// What is written, and where.
#[derive(Debug)]
pub(crate) struct FileToWrite {
    pub(crate) writer: PartsWriter,
    /// Where the file lies.
    pub(crate) folder: PathBuf,
    /// With less room left there, bytes, [`Writing::ended_with_bytes`] says so.
    pub(crate) stop_bytes: u64,
    /// Counts the files that were removed or moved away while they were written.
    pub(crate) files_taken_away: Arc<AtomicU64>,
}

impl Writing {
    /// Starts to write what comes out of the queue. What is in the file goes to the tap of a live view as
    /// well.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(crate) fn start(
        file: FileToWrite,
        source: QueueSource,
        clock: RunClock,
        tap: Option<Tap>,
    ) -> Result<Self, OnboardError> {
        let [failed, rotate] = std::array::from_fn(|_| Arc::new(AtomicBool::new(false)));
        let ended_with = Arc::new(AtomicU64::new(ROOM_LEFT));
        let worker = Worker {
            file,
            source,
            clock,
            ended_with: Arc::clone(&ended_with),
            rotate: Arc::clone(&rotate),
            cdr: Vec::new(),
            delays: Delays::default(),
            is_slow: false,
            is_low: false,
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
        Ok(Self { failed, ended_with, rotate, thread })
    }

    /// Whether writing has failed: nothing more is recorded.
    #[must_use]
    pub(crate) fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// What is left on a disk with so little room that the run must end, bytes.
    #[must_use]
    pub(crate) fn ended_with_bytes(&self) -> Option<u64> {
        Some(self.ended_with.load(Ordering::Relaxed)).filter(|bytes| *bytes != ROOM_LEFT)
    }

    /// Asks for the next part, where there are parts.
    pub(crate) fn rotate(&self) {
        self.rotate.store(true, Ordering::Relaxed);
    }

    /// Waits until everything is written and the file has its name; says how long poses took into it.
    ///
    /// # Errors
    /// The write that failed.
    pub(crate) fn finish(self) -> Result<(PartsReport, PoseDelays), OnboardError> {
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
    file: FileToWrite,
    source: QueueSource,
    clock: RunClock,
    ended_with: Arc<AtomicU64>,
    rotate: Arc<AtomicBool>,
    cdr: Vec<u8>,
    delays: Delays,
    /// Whether the disk has been told to be slow.
    is_slow: bool,
    /// Whether the disk has been told to be nearly full.
    is_low: bool,
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
                self.file.writer.write_encoded(
                    head.topic,
                    head.log_time_ns,
                    head.publish_time_ns,
                    &self.cdr,
                )?;
                self.delays.written(self.clock.now_ns(), &head);
                self.show(&head);
            }
            while let Some((now_ns, health)) = self.source.next_health() {
                let free_bytes = disk::free_bytes(&self.file.folder);
                free_bytes.iter().for_each(|free| self.look_at_room(*free));
                let mut message = diagnostics::message(now_ns, &health);
                message.status.push(disk_status(free_bytes, self.at_risk()));
                message.status.push(self.delays.status());
                message.status.push(clock_status(self.clock.utc_offset_ns()));
                message.encode(&mut self.cdr);
                let head = Head { topic: Topic::Diagnostics, log_time_ns: now_ns, publish_time_ns: now_ns };
                self.file.writer.write_encoded(head.topic, now_ns, now_ns, &self.cdr)?;
                self.show(&head);
            }
            if self.rotate.swap(false, Ordering::Relaxed) && !self.file.writer.rotate_now()? {
                tracing::warn!(
                    "asked for the next part of the recording, but it has none (--rotate-minutes, --rotate-mb)"
                );
            }
            if is_over {
                let delays = self.delays.report();
                return Ok((self.file.writer.finish()?, delays));
            }
            if self.file.writer.save_if_due(&|| self.clock.now_ns())? {
                self.look_for_file()?;
            } else if is_idle {
                biplane_clock::sleep_ns(IDLE_NS);
            }
        }
    }

    /// Says so when somebody has taken the file away: a write into it tells nothing of that.
    fn look_for_file(&mut self) -> Result<(), WriteError> {
        let Some(taken) = self.file.writer.look_for_file()? else { return Ok(()) };
        self.file.files_taken_away.fetch_add(1, Ordering::Relaxed);
        let (path, messages) = (taken.path.display(), counted(taken.messages, "message"));
        let what = match taken.is_removed {
            true => format!("{path} was removed while it was written: {messages} lost"),
            false => format!("{path} is no longer there: {messages} in it, wherever it is now"),
        };
        match taken.goes_on_in {
            Some(next) => tracing::error!("{what}; the recording goes on in {}", next.display()),
            None => {
                tracing::error!(
                    "{what}; no new file could be begun, so the recording goes on in the old one"
                );
            }
        }
        Ok(())
    }
}

impl Worker {
    /// Says once that room gets short, and ends the run where there is too little.
    fn look_at_room(&mut self, free_bytes: u64) {
        let (free_mb, folder) = (free_bytes / 1_000_000, self.file.folder.display());
        let stop_bytes = self.file.stop_bytes;
        if free_bytes < stop_bytes {
            if self.ended_with.swap(free_bytes, Ordering::Relaxed) == ROOM_LEFT {
                tracing::error!(
                    "only {free_mb} MB are left on the disk of {folder}: the recording ends while it can be closed"
                );
            }
        } else if free_bytes < disk::LOW_BYTES && !self.is_low {
            let stop_mb = stop_bytes / 1_000_000;
            tracing::warn!(
                "only {free_mb} MB are left on the disk of {folder}: the recording ends at {stop_mb} MB"
            );
        }
        self.is_low |= free_bytes < disk::LOW_BYTES;
    }

    /// What a power cut would have cost at worst since the last time, ns. When it begins to be more than
    /// promised it is told.
    fn at_risk(&mut self) -> i64 {
        let at_risk_ns = self.file.writer.take_worst_age_ns();
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
    use crate::engine::out::health::Health;
    use crate::engine::out::sink::Sink;
    use crate::record::recorder::queue::queue;
    use biplane_recording::{Reader, Rotation, WriterOptions};
    use rtrb::RingBuffer;
    use std::path::Path;

    #[test]
    fn a_disk_with_too_little_room_is_reported_and_the_file_is_closed() {
        for (stop_bytes, is_low) in [(u64::MAX, true), (0, false)] {
            let folder = std::env::temp_dir().join(format!("biplane-low-{is_low}-{}", std::process::id()));
            let _ = std::fs::remove_dir_all(&folder);
            std::fs::create_dir_all(&folder).unwrap();
            let path = folder.join("run.mcap");
            let writer = PartsWriter::create(&path, &WriterOptions::default(), Rotation::default()).unwrap();
            let (mut sink, source) = queue(Arc::new(AtomicU64::new(0)), RingBuffer::new(4).0, Arc::default());
            let file =
                FileToWrite { writer, folder: folder.clone(), stop_bytes, files_taken_away: Arc::default() };
            let writing = Writing::start(file, source, RunClock::start(), None).unwrap();
            assert_eq!(writing.ended_with_bytes(), None);
            sink.health(1, &Health::default());
            drop(sink);
            let ended_with = Arc::clone(&writing.ended_with);
            assert_eq!(writing.finish().unwrap().0.parts[0].messages, 1);
            assert_eq!(ended_with.load(Ordering::Relaxed) != ROOM_LEFT, is_low);
            std::fs::remove_dir_all(folder).unwrap();
        }
    }
    /// A recording from which its file is taken after some messages, by `take`; the messages in what is left
    /// in the folders afterwards, by file, and how many are told as lost.
    fn taken(name: &str, rotation: Rotation, take: impl Fn(&Path)) -> (Vec<(String, usize)>, u64) {
        let home = std::env::temp_dir().join(format!("biplane-taken-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&home);
        let folder = home.join("runs");
        std::fs::create_dir_all(&folder).unwrap();
        let options = WriterOptions { sync: true, ..WriterOptions::default() };
        let writer = PartsWriter::create(&folder.join("run.mcap"), &options, rotation).unwrap();
        let (mut sink, source) = queue(Arc::new(AtomicU64::new(0)), RingBuffer::new(4).0, Arc::default());
        let files_taken_away = Arc::new(AtomicU64::new(0));
        let counted = Arc::clone(&files_taken_away);
        let file = FileToWrite { writer, folder: folder.clone(), stop_bytes: 0, files_taken_away };
        let clock = RunClock::start();
        let writing = Writing::start(file, source, clock, None).unwrap();
        let mut send = |messages: usize| {
            for _ in 0..messages {
                sink.message(Topic::Odom, clock.now_ns(), clock.now_ns(), &[0; 8]);
            }
        };
        let wait_for = |what: &dyn Fn() -> bool| {
            let start_ns = clock.now_ns();
            while !what() && clock.now_ns() - start_ns < 10_000_000_000 {
                biplane_clock::sleep_ns(IDLE_NS);
            }
            assert!(what());
        };
        send(3);
        let is_saved = || {
            std::fs::read_dir(&folder).unwrap().any(|entry| entry.unwrap().metadata().unwrap().len() > 200)
        };
        wait_for(&is_saved);
        take(&home);
        // The next save finds it out.
        send(4);
        wait_for(&|| counted.load(Ordering::Relaxed) == 1);
        send(5);
        drop(sink);
        let lost = writing.finish().unwrap().0.removed_messages;
        let mut left = Vec::new();
        for folder in std::fs::read_dir(&home).unwrap() {
            for entry in std::fs::read_dir(folder.unwrap().path()).unwrap() {
                let path = entry.unwrap().path();
                let messages = Reader::open(&path).unwrap().messages().map(Result::unwrap).count();
                left.push((path.strip_prefix(&home).unwrap().display().to_string(), messages));
            }
        }
        left.sort();
        std::fs::remove_dir_all(home).unwrap();
        (left, lost)
    }

    #[test]
    fn a_recording_whose_file_is_removed_goes_on_in_a_new_one_and_tells_what_is_lost() {
        let remove = |home: &Path| std::fs::remove_file(home.join("runs/run.mcap.active")).unwrap();
        let is_reported = |name: &str, rotation: Rotation, remove: &dyn Fn(&Path), goes_on_in: &str| {
            let (left, lost) = taken(name, rotation, remove);
            assert_eq!(left, [(goes_on_in.to_owned(), 12 - lost as usize)]);
            // With the first save after it, or with the one that was under way.
            assert!([3, 7].contains(&lost), "{lost}");
        };
        is_reported("removed", Rotation::default(), &remove, "runs/run.mcap");
        let in_parts = Rotation { span_ns: None, bytes: Some(1 << 30) };
        let remove = |home: &Path| std::fs::remove_file(home.join("runs/run_0.mcap.active")).unwrap();
        is_reported("parts", in_parts, &remove, "runs/run_1.mcap");
    }

    #[test]
    fn a_recording_whose_folder_is_renamed_goes_on_where_it_was_and_loses_nothing() {
        let rename = |home: &Path| std::fs::rename(home.join("runs"), home.join("yesterday")).unwrap();
        let (left, lost) = taken("moved", Rotation::default(), rename);
        let names: Vec<_> = left.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["runs/run.mcap", "yesterday/run.mcap.active"]);
        assert_eq!((left.iter().map(|(_, messages)| messages).sum::<usize>(), lost), (12, 0));
    }
}
