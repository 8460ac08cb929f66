//! What goes away on a robot, and comes back by itself: adapters under another name, devices that fall silent.

use std::fs;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use biplane_mock::pty::Pty;
use biplane_onboard::OnboardError;
use biplane_onboard::link::Tty;
use biplane_onboard::record::{RecordOptions, record};
use biplane_recording::msg::{DiagnosticArray, LaserScan, Odometry};
use biplane_recording::{Rig, Topic};
use rustix::pty::{OpenptFlags, grantpt, openpt, unlockpt};

use crate::mock::{Mock, all};

/// Gaps between stamps that are longer than half a second, milliseconds.
fn gaps_ms(stamps_ns: impl IntoIterator<Item = i64>) -> Vec<i64> {
    let stamps_ns: Vec<_> = stamps_ns.into_iter().collect();
    let gaps = stamps_ns.windows(2).map(|pair| (pair[1] - pair[0]) / 1_000_000);
    gaps.filter(|&gap_ms| gap_ms > 500).collect()
}

/// What diagnostics said of a device, each message once, in order.
fn said(run: &Path, device: &str) -> Vec<String> {
    let arrays = all::<DiagnosticArray>(run, Topic::Diagnostics);
    let statuses = arrays.into_iter().flat_map(|array| array.status);
    let mut said: Vec<_> =
        statuses.filter(|status| status.hardware_id == device).map(|s| s.message).collect();
    said.dedup();
    said
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
    let mut mock = Mock::start("moved", |options| options.links = options.links.join("by-id"));
    let rig = bare(&mock.rig_in("by-id"));
    let options = RecordOptions { serial_links: mock.folder.join("links"), ..mock.options(rig.clone(), 9.5) };
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
    assert_eq!(report.lost, 0, "{report:?}");
    let scans = all::<LaserScan>(&output, Topic::ScanHorizontal);
    let gaps_ms = gaps_ms(scans.iter().map(|scan| scan.stamp_ns));
    assert!(gaps_ms.len() == 1 && gaps_ms[0] < 4000, "{gaps_ms:?}");
    let said = said(&output, "laser_horizontal");
    let [.., gone, back, streams] = &said[..] else { panic!("{said:?}") };
    assert_eq!((gone.as_str(), streams.as_str()), ("its port is gone", "streams"), "{said:?}");
    assert_eq!(back, "streams again; it was: its port is gone");
}

/// A line that can be cut: hands bytes on between the recorder and a device of the mock.
struct Relay {
    link: PathBuf,
    cut: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Relay {
    fn start(device: &Path, link: &Path) -> Self {
        let (cut, stop) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
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
                }
            }
        });
        Self { link: link.to_owned(), cut, stop, thread: Some(thread) }
    }

    fn path(&self) -> String {
        self.link.to_string_lossy().into_owned()
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

#[test]
fn a_laser_that_falls_silent_streams_again_and_the_other_lines_are_not_disturbed() {
    let mock = Mock::start("silent", |_| {});
    let mut rig = mock.rig();
    let vertical = rig.vertical.as_mut().unwrap();
    let relay = Relay::start(Path::new(&vertical.port), &mock.folder.join("relay"));
    vertical.port = relay.path();
    let options = mock.options(rig, 10.0);
    let output = options.output.clone();
    let recording = thread::spawn(move || record(&options, &AtomicBool::new(false)));
    thread::sleep(Duration::from_millis(3500));
    relay.cut.store(true, Ordering::Relaxed);
    thread::sleep(Duration::from_millis(2200));
    relay.cut.store(false, Ordering::Relaxed);
    let report = recording.join().unwrap().unwrap();
    assert_eq!(report.lost, 0, "{report:?}");
    let stamps = |topic| all::<LaserScan>(&output, topic).into_iter().map(|scan| scan.stamp_ns);
    let gaps = gaps_ms(stamps(Topic::ScanVertical));
    assert!(gaps.len() == 1 && gaps[0] < 2200 + 2500, "{gaps:?}");
    let horizontal = gaps_ms(stamps(Topic::ScanHorizontal));
    let odometry = gaps_ms(all::<Odometry>(&output, Topic::Odom).into_iter().map(|odom| odom.stamp_ns));
    assert!(horizontal.is_empty() && odometry.is_empty(), "{horizontal:?} {odometry:?}");
    let said = said(&output, "laser_vertical");
    // A telegram that was cut may make it garbled rather than silent.
    let faults = ["silent", "no intact telegram"];
    assert!(said.iter().any(|message| faults.contains(&message.as_str())), "{said:?}");
    assert_eq!(said.last().unwrap(), "streams", "{said:?}");
}

#[test]
fn one_adapter_that_is_pulled_and_put_back_leaves_the_other_lines_alone() {
    let mock = Mock::start("pulled", |_| {});
    let mut rig = mock.rig();
    let (device, link) = (PathBuf::from(&rig.horizontal.port), mock.folder.join("relay"));
    let relay = Relay::start(&device, &link);
    rig.horizontal.port = relay.path();
    let options = mock.options(rig, 8.0);
    let output = options.output.clone();
    let recording = thread::spawn(move || record(&options, &AtomicBool::new(false)));
    thread::sleep(Duration::from_millis(3500));
    drop(relay);
    thread::sleep(Duration::from_millis(1200));
    let _relay = Relay::start(&device, &link);
    let report = recording.join().unwrap().unwrap();
    assert_eq!(report.lost, 0, "{report:?}");
    let stamps = |topic| all::<LaserScan>(&output, topic).into_iter().map(|scan| scan.stamp_ns);
    let gaps = gaps_ms(stamps(Topic::ScanHorizontal));
    // Within 2 s of the port's return.
    assert!(gaps.len() == 1 && gaps[0] < 1200 + 250 + 2000, "{gaps:?}");
    let vertical = gaps_ms(stamps(Topic::ScanVertical));
    let odometry = gaps_ms(all::<Odometry>(&output, Topic::Odom).into_iter().map(|odom| odom.stamp_ns));
    assert!(vertical.is_empty() && odometry.is_empty(), "{vertical:?} {odometry:?}");
    assert_eq!(report.poses, report.scans_horizontal);
    println!("pulled for 1.2 s: a gap of {} ms", gaps[0]);
}

#[test]
fn a_run_can_wait_for_its_ports_and_can_be_stopped_while_it_waits() {
    let mut mock = Mock::start("wait", |_| {});
    let rig = mock.rig();
    mock.end();
    let missing = record(&mock.options(rig.clone(), 3.0), &AtomicBool::new(false)).unwrap_err();
    assert!(matches!(missing, OnboardError::Port { .. }), "{missing}");
    let options = RecordOptions { wait: true, ..mock.options(rig, 4.0) };
    let stopped = record(&options, &AtomicBool::new(true)).unwrap_err();
    assert!(matches!(stopped, OnboardError::StoppedWaiting { .. }), "{stopped}");
    assert!(!options.output.exists());
    let recording = thread::spawn(move || record(&options, &AtomicBool::new(false)));
    thread::sleep(Duration::from_millis(600));
    mock.serve(|_| {});
    let report = recording.join().unwrap().unwrap();
    assert!(report.scans_horizontal > 10, "{report:?}");
}
