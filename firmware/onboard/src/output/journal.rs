//! `--journal`: what each iteration of each match did, as a table (CSV) beside the recording, for plots.
//!
//! A replay writes it at once. In a live run a thread of its own writes; the loop hands over rows through a
//! queue of fixed size, never waits, and counts what does not fit. Frame: `map`. Units: seconds, meters,
//! radians; the cost is the method's own.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};

use biplane_matcher::Iteration;
use biplane_recording::mcap::write::check_outputs;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::types::error::OnboardError;

/// Rows that may wait for the disk: two seconds and more of the fastest laser.
const QUEUE_ROWS: usize = 16_384;
/// How long the thread sleeps when there is nothing to write, nanoseconds.
const IDLE_NS: i64 = 20_000_000;
/// The first line.
const HEADER: &str = "stamp_s,iteration,x_m,y_m,theta_rad,cost,step_m,step_rad,used";

/// The table being written. The first error is kept; nothing is written after it.
#[derive(Debug)]
pub(crate) struct JournalFile {
    path: PathBuf,
    out: BufWriter<File>,
    failed: Option<io::Error>,
    /// Rows that found no room before they came here.
    dropped: u64,
}

impl JournalFile {
    /// Begins a table; a file that is there is replaced only when asked.
    ///
    /// # Errors
    /// When it cannot be made.
    pub(crate) fn create(path: &Path, overwrite: bool) -> Result<Self, OnboardError> {
        check_outputs(&[path], &[], overwrite)?;
        let place = |source| OnboardError::Place { path: path.to_owned(), source };
        let mut out = BufWriter::new(File::create(path).map_err(place)?);
        writeln!(out, "{HEADER}").map_err(place)?;
        Ok(Self { path: path.to_owned(), out, failed: None, dropped: 0 })
    }

    /// The iterations of one scan.
    pub(crate) fn write(&mut self, stamp_ns: i64, iterations: &[Iteration]) {
        for iteration in iterations {
            if self.failed.is_none() {
                self.failed = row(&mut self.out, stamp_ns, iteration).err();
            }
        }
    }

    /// So many more rows are missing.
    pub(crate) fn missing(&mut self, rows: u64) {
        self.dropped += rows;
    }

    /// Ends the table; what is missing in it is said.
    ///
    /// # Errors
    /// That of the first row that could not be written.
    pub(crate) fn finish(mut self) -> Result<(), OnboardError> {
        let failed = self.failed.take().or_else(|| self.out.flush().err());
        if self.dropped > 0 {
            tracing::warn!("{}: {} iterations found no room", self.path.display(), self.dropped);
        }
        failed.map_or(Ok(()), |source| Err(OnboardError::Place { path: self.path, source }))
    }
}

fn row(out: &mut impl Write, stamp_ns: i64, row: &Iteration) -> io::Result<()> {
    let (sign, us) = (if stamp_ns < 0 { "-" } else { "" }, stamp_ns.unsigned_abs() / 1000);
    let (s, us) = (us / 1_000_000, us % 1_000_000);
    let Iteration { iteration, pose, cost, step_m, step_rad, used } = row;
    writeln!(
        out,
        "{sign}{s}.{us:06},{iteration},{:.6},{:.6},{:.7},{cost:.4},{step_m:.6},{step_rad:.7},{used}",
        pose.x_m, pose.y_m, pose.theta_rad
    )
}

/// The loop's end of the queue.
#[derive(Debug)]
pub(crate) struct JournalQueue {
    rows: Producer<(i64, Iteration)>,
    dropped: Producer<u64>,
    lost: u64,
}

impl JournalQueue {
    /// Hands over the iterations of one scan.
    pub(crate) fn push(&mut self, stamp_ns: i64, iterations: &[Iteration]) {
        for iteration in iterations {
            self.lost += u64::from(self.rows.push((stamp_ns, *iteration)).is_err());
        }
        if self.lost > 0 && self.dropped.push(self.lost).is_ok() {
            self.lost = 0;
        }
    }
}

/// The thread that writes the table of a live run.
#[derive(Debug)]
pub(crate) struct JournalThread {
    thread: JoinHandle<Result<(), OnboardError>>,
}

impl JournalThread {
    /// Begins the table and the thread.
    ///
    /// # Errors
    /// When the file cannot be made, or the thread not be started.
    pub(crate) fn start(path: &Path, overwrite: bool) -> Result<(JournalQueue, Self), OnboardError> {
        let file = JournalFile::create(path, overwrite)?;
        let (queue, source) = queue(QUEUE_ROWS);
        let thread = thread::Builder::new()
            .name("journal".to_owned())
            .spawn(move || run(file, source))
            .map_err(|source| OnboardError::System { what: "start the journal's thread", source })?;
        Ok((queue, Self { thread }))
    }

    /// Waits until everything is written; the loop's end of the queue must be gone.
    ///
    /// # Errors
    /// The write that failed.
    pub(crate) fn finish(self) -> Result<(), OnboardError> {
        self.thread.join().unwrap_or_else(|_| {
            let source = io::Error::other("the journal's thread panicked");
            Err(OnboardError::System { what: "write the journal", source })
        })
    }
}

/// The thread's end of the queue.
struct Source {
    rows: Consumer<(i64, Iteration)>,
    dropped: Consumer<u64>,
}

fn queue(rows: usize) -> (JournalQueue, Source) {
    let (row_in, rows) = RingBuffer::new(rows);
    let (dropped_in, dropped) = RingBuffer::new(16);
    (JournalQueue { rows: row_in, dropped: dropped_in, lost: 0 }, Source { rows, dropped })
}

fn run(mut file: JournalFile, mut source: Source) -> Result<(), OnboardError> {
    loop {
        // Asked before the queue is emptied: what was added before the loop went is then still written.
        let is_over = source.rows.is_abandoned();
        while let Ok((stamp_ns, iteration)) = source.rows.pop() {
            file.write(stamp_ns, &[iteration]);
        }
        while let Ok(rows) = source.dropped.pop() {
            file.missing(rows);
        }
        if is_over {
            return file.finish();
        }
        biplane_clock::sleep_ns(IDLE_NS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_matcher::Pose2;

    fn path(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("biplane-journal-{name}-{}.csv", std::process::id()))
    }

    fn step(iteration: u32) -> Iteration {
        let pose = Pose2::new(1.5, -0.25, 0.125);
        Iteration { iteration, pose, cost: 12.5, step_m: 0.01, step_rad: 0.002, used: 170 }
    }

    #[test]
    fn a_row_is_what_the_header_says_also_before_1970() {
        let path = path("row");
        let mut file = JournalFile::create(&path, false).unwrap();
        file.write(976_052_857_337_532_000, &[step(0), step(1)]);
        file.write(-1_000, &[step(2)]);
        file.finish().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let expected = format!(
            "{HEADER}\n\
             976052857.337532,0,1.500000,-0.250000,0.1250000,12.5000,0.010000,0.0020000,170\n\
             976052857.337532,1,1.500000,-0.250000,0.1250000,12.5000,0.010000,0.0020000,170\n\
             -0.000001,2,1.500000,-0.250000,0.1250000,12.5000,0.010000,0.0020000,170\n"
        );
        assert_eq!(text, expected);
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn what_the_loop_hands_over_is_written_when_the_loop_has_gone() {
        let path = path("thread");
        let (mut queue, thread) = JournalThread::start(&path, false).unwrap();
        for scan in 0..50 {
            queue.push(scan, &[step(0), step(1)]);
        }
        drop(queue);
        thread.finish().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 101);
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_full_queue_drops_rows_and_counts_them() {
        let (mut queue, mut source) = queue(3);
        queue.push(1, &[step(0), step(1), step(2), step(3), step(4)]);
        queue.push(2, &[step(0)]);
        let kept = std::iter::from_fn(|| source.rows.pop().ok()).count();
        let lost: u64 = std::iter::from_fn(|| source.dropped.pop().ok()).sum();
        assert_eq!((kept, lost), (3, 3));
    }

    #[test]
    fn a_disk_that_takes_nothing_is_told() {
        let path = path("read-only");
        std::fs::write(&path, "").unwrap();
        let out = BufWriter::new(File::open(&path).unwrap());
        let mut file = JournalFile { path: path.clone(), out, failed: None, dropped: 0 };
        file.write(0, &[step(0)]);
        assert!(file.finish().unwrap_err().to_string().contains("read-only"));
        assert!(JournalFile::create(Path::new("/nowhere/j.csv"), false).is_err());
        std::fs::remove_file(path).unwrap();
    }
}
