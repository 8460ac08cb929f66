//! What goes away on a robot, and comes back by itself: adapters under another name, devices that fall
//! silent.
//!
//! How fast is a matter of the simulated rig, whose time does not depend on what else the machine does. Here
//! a run goes on until what must come has come, and a line counts as disturbed when it was started again
//! though its own bytes kept coming.

use std::fs;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use biplane_mock::devices::pty::Pty;
use biplane_onboard::test_support::Tty;
use biplane_onboard::{OnboardError, RecordOptions, RunReport, record};
use biplane_recording::messages::{DiagnosticArray, Imu, LaserScan};
use biplane_recording::{Direction, Port, Reader, Rig, Topic};
use rustix::pty::{OpenptFlags, grantpt, openpt, unlockpt};

use crate::in_time::in_time;
use crate::mock::{Mock, all, with_inertial_unit};

/// Gaps between stamps that are longer than half a second, milliseconds.
fn gaps_ms(stamps_ns: impl IntoIterator<Item = i64>) -> Vec<i64> {
    let stamps_ns: Vec<_> = stamps_ns.into_iter().collect();
    let gaps = stamps_ns.windows(2).map(|pair| (pair[1] - pair[0]) / 1_000_000);
    gaps.filter(|&gap_ms| gap_ms > 500).collect()
}

/// What diagnostics said of a device, each message once, in order.
fn reported(run: &Path, device: &str) -> Vec<String> {
    let arrays = all::<DiagnosticArray>(run, Topic::Diagnostics);
    let statuses = arrays.into_iter().flat_map(|array| array.status);
    let mut reported: Vec<_> =
        statuses.filter(|status| status.hardware_id == device).map(|s| s.message).collect();
    reported.dedup();
    reported
}

/// How often a device was started again, as diagnostics counted it.
fn restarts(run: &Path, device: &str) -> usize {
    let arrays = all::<DiagnosticArray>(run, Topic::Diagnostics);
    let mut statuses = arrays.into_iter().flat_map(|array| array.status);
    let last = statuses.rfind(|status| status.hardware_id == device).unwrap();
    let restarts = last.values.iter().find(|value| value.key == "restarts").unwrap();
    restarts.value.parse().unwrap()
}

/// How often nothing came from a device for so long that it had to be started again: a mock on a busy
/// machine.
fn silences(run: &Path, port: Port) -> usize {
    let reader = Reader::open(run).unwrap();
    let received = biplane_recording::capture::serial(&reader).map(Result::unwrap);
    let received = received.filter(|bytes| (bytes.port, bytes.direction) == (port, Direction::Rx));
    let times_ns: Vec<_> = received.map(|bytes| bytes.time_ns).collect();
    assert!(times_ns.len() > 20, "{port:?}");
    times_ns.windows(2).filter(|pair| pair[1] - pair[0] > 800_000_000).count()
}

/// The lines of these devices were left alone: none was started again while its bytes came.
fn assert_undisturbed(run: &Path, lines: &[(Port, &str)]) {
    for &(port, device) in lines {
        let (restarts, silences) = (restarts(run, device), silences(run, port));
        assert!(restarts <= silences, "{device}: started again {restarts} times, silent {silences} times");
    }
}

/// Records in a thread until it is told to stop; 60 s at most.
struct Recording {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Result<RunReport, OnboardError>>,
}

impl Recording {
    fn start(options: RecordOptions) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        Self { stop, thread: thread::spawn(move || record(&options, &flag)) }
    }

    fn stop(self) -> RunReport {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap().unwrap()
    }
}

/// Bare names of the devices, as `/dev/ttyUSB0`: where the mock's links lead to now.
fn bare(rig: &Rig) -> Rig {
    let name = |port: &str| fs::canonicalize(port).unwrap().to_string_lossy().into_owned();
    let mut bare = rig.clone();
    bare.horizontal.port = name(&rig.horizontal.port);
    if let Some(vertical) = &mut bare.vertical {
        vertical.port = name(&vertical.port);
    }
    bare.base.port = name(&rig.base.port);
    bare
}

/// Terminals of somebody else's, which take the names that are free.
fn squatters(count: usize) -> Vec<OwnedFd> {
    let squatter = |_| {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        master
    };
    (0..count).map(squatter).collect()
}

#[test]
fn adapters_that_come_back_under_other_names_are_found_by_their_links_and_not_by_their_old_names() {
    in_time(|| {
        let mut mock = Mock::start("moved", |options| options.links = options.links.join("by-id"));
        let rig = bare(&mock.rig_in("by-id"));
        let options =
            RecordOptions { serial_links: mock.folder.join("links"), ..mock.options(rig.clone(), 9.5) };
        let output = options.output.clone();
        let recording = thread::spawn(move || record(&options, &AtomicBool::new(false)));
        thread::sleep(Duration::from_millis(3500));
        mock.end();
        // The recorder holds the old terminals until it has noticed; then the names are free for others.
        thread::sleep(Duration::from_millis(300));
        let taken = squatters(6);
        mock.serve(|options| options.links = options.links.join("by-id"));
        let moved = bare(&mock.rig_in("by-id"));
        assert!(moved.horizontal.port != rig.horizontal.port && moved.base.port != rig.base.port);
        let report = recording.join().unwrap().unwrap();
        drop(taken);
        assert_eq!(report.losses.lost, 0, "{report:?}");
        let scans = all::<LaserScan>(&output, Topic::ScanHorizontal);
        let gaps_ms = gaps_ms(scans.iter().map(|scan| scan.stamp_ns));
        assert!(gaps_ms.len() == 1 && gaps_ms[0] < 4000, "{gaps_ms:?}");
        let reported = reported(&output, "laser_horizontal");
        let [.., gone, back, streams] = &reported[..] else { panic!("{reported:?}") };
        assert_eq!((gone.as_str(), streams.as_str()), ("its port is gone", "streams"), "{reported:?}");
        assert_eq!(back, "streams again; it was: its port is gone");
    });
}

/// A line that can be cut: hands bytes on between the recorder and a device of the mock.
struct Relay {
    link: PathBuf,
    cut: Arc<AtomicBool>,
    /// Bytes that came from the device and were handed on.
    passed: Arc<AtomicUsize>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Relay {
    fn start(device: &Path, link: &Path) -> Self {
        let (cut, stop) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let passed = Arc::new(AtomicUsize::new(0));
        let counter = Arc::clone(&passed);
        let device = Tty::open(device, 38400).unwrap();
        let mut pty = Pty::open(38400).unwrap();
        pty.publish(link).unwrap();
        let flags = (Arc::clone(&cut), Arc::clone(&stop));
        let thread = thread::spawn(move || {
            let mut baud = 38400;
            let mut buffer = [0; 4096];
            while !flags.1.load(Ordering::Relaxed) {
                pty.wait(1_000_000);
                let up = pty.read(&mut buffer);
                if let Some(wanted) = pty.client_baud().filter(|&wanted| wanted != baud) {
                    device.set_baud(wanted).unwrap();
                    baud = wanted;
                }
                let is_cut = flags.0.load(Ordering::Relaxed);
                if !is_cut {
                    device.write_all(&buffer[..up]).unwrap();
                }
                if let Ok(Some(down)) = device.read(&mut buffer, 0)
                    && !is_cut
                {
                    pty.write(&buffer[..down]);
                    counter.fetch_add(down, Ordering::Relaxed);
                }
            }
        });
        Self { link: link.to_owned(), cut, passed, stop, thread: Some(thread) }
    }

    fn path(&self) -> String {
        self.link.to_string_lossy().into_owned()
    }

    /// Until so many further bytes of the device have come through: scans, and answers before them.
    fn pass(&self, bytes: usize) {
        let wanted = self.passed.load(Ordering::Relaxed) + bytes;
        for _ in 0..6000 {
            if self.passed.load(Ordering::Relaxed) >= wanted {
                return;
            }
            thread::sleep(Duration::from_millis(10));
        }
        panic!("{bytes} bytes did not come in a minute");
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Bytes of a scan of the mock's lasers: 181 values and what is around them.
const SCAN_BYTES: usize = 372;

#[test]
fn a_laser_that_falls_silent_streams_again_and_the_other_lines_are_not_disturbed() {
    in_time(|| {
        let mock = Mock::start("silent", |_| {});
        let mut rig = mock.rig();
        let vertical = rig.vertical.as_mut().unwrap();
        let relay = Relay::start(Path::new(&vertical.port), &mock.folder.join("relay"));
        vertical.port = relay.path();
        let options = mock.options(rig, 60.0);
        let output = options.output.clone();
        let recording = Recording::start(options);
        relay.pass(20 * SCAN_BYTES);
        relay.cut.store(true, Ordering::Relaxed);
        thread::sleep(Duration::from_millis(2200));
        relay.cut.store(false, Ordering::Relaxed);
        relay.pass(30 * SCAN_BYTES);
        let report = recording.stop();
        assert_eq!(report.losses.lost, 0, "{report:?}");
        let scans = all::<LaserScan>(&output, Topic::ScanVertical);
        let gaps = gaps_ms(scans.iter().map(|scan| scan.stamp_ns));
        assert!(
            scans.len() > 30 && gaps.iter().any(|&gap_ms| gap_ms > 2000),
            "{} scans, {gaps:?}",
            scans.len()
        );
        assert_undisturbed(&output, &[(Port::Horizontal, "laser_horizontal"), (Port::Base, "base")]);
        let reported = reported(&output, "laser_vertical");
        // A telegram that was cut may make it garbled rather than silent.
        let faults = ["silent", "no intact telegram"];
        assert!(reported.iter().any(|message| faults.contains(&message.as_str())), "{reported:?}");
        assert!(reported.last().unwrap().starts_with("streams"), "{reported:?}");
    });
}

#[test]
fn one_adapter_that_is_pulled_and_put_back_leaves_the_other_lines_alone() {
    in_time(|| {
        let mock = Mock::start("pulled", |_| {});
        let mut rig = mock.rig();
        let (device, link) = (PathBuf::from(&rig.horizontal.port), mock.folder.join("relay"));
        let relay = Relay::start(&device, &link);
        rig.horizontal.port = relay.path();
        let options = mock.options(rig, 60.0);
        let output = options.output.clone();
        let recording = Recording::start(options);
        relay.pass(20 * SCAN_BYTES);
        drop(relay);
        thread::sleep(Duration::from_millis(1200));
        let relay = Relay::start(&device, &link);
        relay.pass(30 * SCAN_BYTES);
        let report = recording.stop();
        assert_eq!(report.losses.lost, 0, "{report:?}");
        let scans = all::<LaserScan>(&output, Topic::ScanHorizontal);
        let gaps = gaps_ms(scans.iter().map(|scan| scan.stamp_ns));
        assert!(
            scans.len() > 30 && gaps.iter().any(|&gap_ms| gap_ms > 1000),
            "{} scans, {gaps:?}",
            scans.len()
        );
        assert_undisturbed(&output, &[(Port::Vertical, "laser_vertical"), (Port::Base, "base")]);
        assert_eq!(report.recorded.poses, report.recorded.scans_horizontal);
        println!("pulled for 1.2 s: a gap of {} ms", gaps[0]);
    });
}

/// Bytes of a measurement of the mock's inertial unit.
const SAMPLE_BYTES: usize = 54;

#[test]
fn an_inertial_unit_that_is_pulled_twice_leaves_lasers_and_base_alone_and_is_told_of_at_the_end() {
    in_time(|| {
        let mock = Mock::start("imu-pulled", with_inertial_unit);
        let mut rig = mock.rig_with_inertial_unit();
        let unit = rig.imu.as_mut().unwrap();
        let (device, link) = (PathBuf::from(&unit.port), mock.folder.join("relay"));
        let relay = Relay::start(&device, &link);
        unit.port = relay.path();
        let options = mock.options(rig, 60.0);
        let output = options.output.clone();
        let recording = Recording::start(options);
        relay.pass(300 * SAMPLE_BYTES);
        drop(relay);
        thread::sleep(Duration::from_millis(2200));
        let relay = Relay::start(&device, &link);
        relay.pass(200 * SAMPLE_BYTES);
        drop(relay);
        thread::sleep(Duration::from_millis(4500));
        let report = recording.stop();
        assert_eq!((report.losses.lost, report.exit_code()), (0, 0), "{report:?}");
        let samples = all::<Imu>(&output, Topic::Imu);
        let gaps = gaps_ms(samples.iter().map(|sample| sample.stamp_ns));
        assert!(samples.len() > 400 && gaps.iter().any(|&gap_ms| gap_ms > 2000), "{gaps:?}");
        let reported = reported(&output, "imu");
        let gone = reported.iter().filter(|message| *message == "its port is gone").count();
        let back = reported.iter().any(|message| message == "streams again; it was: its port is gone");
        assert!(gone == 2 && back, "{reported:?}");
        let [uncovered] = &report.uncovered[..] else { panic!("{:?}", report.uncovered) };
        assert!(uncovered.device == "inertial unit" && uncovered.at_end_s > 3.0, "{uncovered:?}");
        let others = [
            (Port::Horizontal, "laser_horizontal"),
            (Port::Vertical, "laser_vertical"),
            (Port::Base, "base"),
        ];
        assert_undisturbed(&output, &others);
        assert_eq!(report.recorded.poses, report.recorded.scans_horizontal);
    });
}

#[test]
fn a_run_can_wait_for_its_ports_and_can_be_stopped_while_it_waits() {
    in_time(|| {
        let mut mock = Mock::start("wait", |_| {});
        let mut rig = mock.rig();
        let (device, link) = (PathBuf::from(&rig.horizontal.port), mock.folder.join("relay"));
        rig.horizontal.port = link.to_string_lossy().into_owned();
        mock.end();
        let missing = record(&mock.options(rig.clone(), 3.0), &AtomicBool::new(false)).unwrap_err();
        assert!(matches!(missing, OnboardError::Ports { .. }), "{missing}");
        let options = RecordOptions { wait: true, ..mock.options(rig, 60.0) };
        let stopped = record(&options, &AtomicBool::new(true)).unwrap_err();
        assert!(matches!(stopped, OnboardError::StoppedWaiting { .. }), "{stopped}");
        assert!(!options.output.exists());
        let recording = Recording::start(options);
        thread::sleep(Duration::from_millis(600));
        mock.serve(|_| {});
        let relay = Relay::start(&device, &link);
        relay.pass(20 * SCAN_BYTES);
        let report = recording.stop();
        assert!(report.recorded.scans_horizontal > 10, "{report:?}");
    });
}
