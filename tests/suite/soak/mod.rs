//! A long run at full rate: both lasers at 75 Hz, 500000 Bd, one degree, and an inertial unit at 400 Hz; no
//! scan and no sample lost, nothing allocated, memory flat.
//!
//! In a process of its own, whose memory nothing else grows. First live in simulated time (acquisition and
//! matcher), while what the reads return is written as a capture; then the capture is replayed into a
//! recording in parts. `BIPLANE_SOAK_S=3600` runs the whole hour (`.ci/run faults`), otherwise it is half a
//! minute.

pub(crate) mod fault_soak;
pub(crate) mod own_process;
pub(crate) mod quiet_run;

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use biplane_mock::faults::Faults;
use biplane_onboard::{Health, ReplayOptions, Sink, replay};
use biplane_recording::mcap::read::RIG_ATTACHMENT;
use biplane_recording::{Direction, Rotation, Topic, Writer, WriterOptions};

use crate::accuracy::recorded::folder;
use crate::rig::devices::{idle_lines, rig_at, with_inertial_unit};
use crate::rig::plan::Plan;
use crate::rig::{S, SimRig};
use crate::soak::own_process::{memory_bytes, quarters};

const BAUD: u32 = 500_000;
/// The inertial unit's line, and its measurements a second: the most that it makes.
const UNIT: (u32, u16) = (230_400, 400);
/// After so long everything has been used once.
const WARM_NS: i64 = 10 * S;
/// Memory that a flat run may gain from its first to its last quarter; an unbounded map, index or queue gains
/// more in an hour.
const FLAT_BYTES: i64 = 16 << 20;
/// A shorter replay is still filling its buffers.
const MEANINGFUL_S: i64 = 600;
/// Parts of the replayed recording.
const PART_NS: i64 = 600 * S;

/// Counts, and keeps nothing.
#[derive(Debug, Default)]
struct Counter {
    horizontal: u64,
    vertical: u64,
    odometry: u64,
    inertial: u64,
    poses: u64,
    poses_vertical: u64,
}

impl Sink for Counter {
    fn message(&mut self, topic: Topic, _: i64, _: i64, _: &[u8]) {
        match topic {
            Topic::ScanHorizontal => self.horizontal += 1,
            Topic::ScanVertical => self.vertical += 1,
            Topic::Odom => self.odometry += 1,
            Topic::Imu => self.inertial += 1,
            Topic::Pose => self.poses += 1,
            Topic::PoseVertical => self.poses_vertical += 1,
            _ => {}
        }
    }

    fn health(&mut self, _: i64, _: &Health) {}

    fn dropped(&self) -> u64 {
        0
    }
}

fn length_s() -> i64 {
    own_process::length_s("BIPLANE_SOAK_S", 30)
}

/// How much more memory was in use in the last quarter than in the second.
fn growth_bytes(samples: &[i64]) -> i64 {
    let [second, last] = quarters(samples);
    last - second
}

/// What a live run came to.
struct Live {
    sent: [u64; 2],
    sent_samples: u64,
    recorded: Counter,
    skipped: u64,
    allocations: u64,
    growth_bytes: i64,
}

fn live(capture: &Path, length_ns: i64) -> Live {
    let rig = with_inertial_unit(rig_at(BAUD), UNIT.0, UNIT.1);
    let mut writer =
        Writer::create(capture, &WriterOptions { overwrite: true, ..WriterOptions::default() }).unwrap();
    writer.attach(RIG_ATTACHMENT, "application/toml", rig.to_toml().as_bytes()).unwrap();
    let mut lines = idle_lines(&rig, 1, &Faults::default(), &[]);
    lines.iter_mut().flatten().for_each(|line| line.keeps_tapes = false);
    let mut sim = SimRig::new(&rig, lines, Plan::default(), Counter::default());
    let writer = Rc::new(RefCell::new(writer));
    let shared = Rc::clone(&writer);
    sim.tap = Some(Box::new(move |port, at_ns, bytes| {
        shared.borrow_mut().write_serial(port, Direction::Rx, at_ns, bytes).unwrap();
    }));
    sim.run(WARM_NS, |_| false);
    let warm = sim.engine_allocations;
    assert!(warm > 0, "the counter counts");
    let mut samples = Vec::new();
    for step in 1..=40 {
        sim.run(WARM_NS + (length_ns - WARM_NS) * step / 40, |_| false);
        samples.push(memory_bytes());
    }
    sim.tap = None;
    Rc::into_inner(writer).unwrap().into_inner().finish().unwrap();
    let counts = |place: usize| sim.lines[place].as_ref().unwrap().device_counts();
    Live {
        sent: [counts(0).telegrams, counts(1).telegrams],
        sent_samples: counts(3).telegrams,
        skipped: counts(0).skipped + counts(1).skipped,
        allocations: sim.engine_allocations - warm,
        growth_bytes: growth_bytes(&samples),
        recorded: std::mem::take(sim.engine.sink()),
    }
}

#[test]
fn at_full_rate_no_scan_is_lost_nothing_is_allocated_and_memory_stays_flat() {
    own_process::run("soak::alone");
}

#[test]
#[ignore = "run by the test above in a process of its own"]
fn alone() {
    let folder = folder("soak");
    let (capture, output) = (folder.join("capture.mcap"), folder.join("run.mcap"));
    let length_ns = length_s() * S;
    let live = live(&capture, length_ns);
    println!(
        "| live, {} s simulated | scans sent {:?}, recorded {} + {}, poses {} + {} | samples sent {}, recorded {} | skipped {} | allocations {} | memory grew {} kB |",
        length_s(),
        live.sent,
        live.recorded.horizontal,
        live.recorded.vertical,
        live.recorded.poses,
        live.recorded.poses_vertical,
        live.sent_samples,
        live.recorded.inertial,
        live.skipped,
        live.allocations,
        live.growth_bytes >> 10
    );
    for (sent, recorded) in live.sent.into_iter().zip([live.recorded.horizontal, live.recorded.vertical]) {
        // A mirror turn is 13.32 ms; the last scan may still be on its way.
        assert!(sent as f64 > (length_s() - 2) as f64 / 0.01332, "{sent} scans sent");
        assert!(recorded + 1 >= sent && recorded <= sent, "{recorded} of {sent}");
    }
    let (sent, recorded) = (live.sent_samples, live.recorded.inertial);
    assert!(
        sent > 400 * (length_s() - 2) as u64 && (sent - 1..=sent).contains(&recorded),
        "{recorded} of {sent}"
    );
    assert_eq!((live.skipped, live.allocations), (0, 0));
    assert!(live.growth_bytes < FLAT_BYTES);
    replayed(&capture, &output, &live.recorded);
    std::fs::remove_dir_all(folder).unwrap();
}

/// Replays the capture in parts, and watches the memory meanwhile.
fn replayed(capture: &Path, output: &Path, live: &Counter) {
    let is_over = Arc::new(AtomicBool::new(false));
    let watch = {
        let is_over = Arc::clone(&is_over);
        std::thread::spawn(move || {
            let mut samples = Vec::new();
            while !is_over.load(Ordering::Relaxed) {
                samples.push(memory_bytes());
                std::thread::sleep(Duration::from_millis(200));
            }
            samples
        })
    };
    let rotation = Rotation { span_ns: Some(PART_NS), ..Rotation::default() };
    let options = ReplayOptions { overwrite: true, rotation, ..ReplayOptions::new(capture, output) };
    let report = replay(&options, &AtomicBool::new(false)).unwrap();
    is_over.store(true, Ordering::Relaxed);
    let growth_bytes = growth_bytes(&watch.join().unwrap());
    println!(
        "| replayed in {} parts | recorded {} + {}, poses {} + {} | lost {} | damaged {} | memory grew {} kB |",
        report.parts.len(),
        report.recorded.scans_horizontal,
        report.recorded.scans_vertical,
        report.recorded.poses,
        report.recorded.poses_vertical,
        report.losses.lost,
        report.arrival.damaged,
        growth_bytes >> 10
    );
    // A replay hears no reply that tells it when the device was set up: it takes what streams from the first
    // scan on.
    assert_eq!(report.recorded.scans_horizontal, live.horizontal);
    assert_eq!(report.recorded.scans_vertical, live.vertical);
    assert_eq!(report.recorded.inertial, live.inertial);
    assert_eq!((report.losses.lost, report.losses.dropped), (0, 0));
    // The capture's end may cut a telegram a line.
    assert!(report.arrival.damaged <= 4);
    assert_eq!(report.recorded.poses, report.recorded.scans_horizontal);
    assert!(growth_bytes < FLAT_BYTES || length_s() < MEANINGFUL_S);
}
