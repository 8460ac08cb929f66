//! A served capture: every scan and packet of it, in order, unchanged.

use crate::client::{Client, hex};
use crate::{folder, serving};
use biplane_mock::capture::source::{Capture, CaptureError, CapturedLaser};
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::serve::{ServeOptions, Source};
use biplane_mock::simulate::{SimulateOptions, run};
use biplane_recording::{Writer, WriterOptions};
use biplane_wire::framing::Item;
use biplane_wire::lms::{DeviceDeframer, Reply, Telegram};
use std::path::{Path, PathBuf};

fn capture(folder: &Path) -> PathBuf {
    let output = folder.join("corridor.mcap");
    let options =
        SimulateOptions { output: output.clone(), speed_m_s: Some(1.0), ..SimulateOptions::default() };
    run(&options).expect("simulates");
    output
}

fn options(capture: &Path, folder: &Path) -> ServeOptions {
    let capture = Box::new(Capture::read(capture).expect("a capture"));
    let mut options = ServeOptions::new(Source::Capture { capture }, folder.join("links"));
    options.laser.baud = 38_400;
    options.once = true;
    options
}

fn scans(bytes: &[u8]) -> Vec<Vec<u16>> {
    let mut scans = Vec::new();
    DeviceDeframer::new().feed(bytes, |item| {
        if let Item::Frame { bytes, .. } = item
            && let Ok(Reply::Scan(scan)) = Telegram::parse(bytes).and_then(|telegram| telegram.reply())
        {
            scans.push(scan.values().collect());
        }
    });
    scans
}

/// Starts both lasers, opens the base, and reads all three until they fall silent.
fn listen(links: &Path) -> [Vec<u8>; 3] {
    let base = Client::open(&links.join("base"), 9600);
    let lasers = ["lms-horizontal", "lms-vertical"].map(|name| Client::open(&links.join(name), 38_400));
    for sync in ["fa fb 03 00 00 00", "fa fb 03 01 00 01"] {
        base.ask(sync, sync);
    }
    base.ask("fa fb 03 02 00 02", "fa fb");
    base.write(&hex("fa fb 06 01 3b 01 00 02 3b"));
    lasers.iter().for_each(|laser| laser.write(&hex("02 00 02 00 20 24 34 08")));
    let [horizontal, vertical] = lasers;
    std::thread::scope(|scope| {
        let readers = [horizontal, vertical, base]
            .map(|client| scope.spawn(move || client.read_until(20_000, |_| false)));
        readers.map(|reader| reader.join().expect("reads"))
    })
}

#[test]
fn a_capture_is_played_to_its_last_scan_and_the_mock_ends() {
    let folder = folder("capture");
    let file = capture(&folder);
    let held = Capture::read(&file).expect("a capture");
    let options = ServeOptions { speed: 5.0, ..options(&file, &folder) };
    let mut received = [Vec::new(), Vec::new(), Vec::new()];
    serving(&options, |links| received = listen(links)).expect("served");
    let [horizontal, vertical, base] = received;
    for (bytes, track) in [(horizontal, held.horizontal), (vertical, held.vertical)] {
        let track = track.as_ref().and_then(CapturedLaser::lms).expect("both lasers");
        let expected: Vec<Vec<u16>> = track.scans.iter().map(|scan| scan.words.to_vec()).collect();
        let found = scans(&bytes);
        let first = found.iter().zip(&expected).take_while(|(a, b)| a == b).count();
        assert!(
            found == expected,
            "{} scans of {}, the first {first} are right",
            found.len(),
            expected.len()
        );
    }
    let track = held.base.expect("a base");
    let last = &track.packets.last().expect("packets").body;
    assert!(base.windows(last.len()).any(|window| window == last.as_slice()));
}

#[test]
fn a_fault_damages_scans_and_says_how_many_bytes_it_touched() {
    let folder = folder("faults");
    let file = capture(&folder);
    let faults = Faults::new(&[Preset::BitNoise, Preset::UsbStall], 3);
    let options = ServeOptions { speed: 10.0, faults, seed: 3, ..options(&file, &folder) };
    let mut received = [Vec::new(), Vec::new(), Vec::new()];
    let report = serving(&options, |links| {
        let laser = Client::open(&links.join("lms-horizontal"), 38_400);
        laser.write(&hex("02 00 02 00 20 24 34 08"));
        received[0] = laser.read_until(20_000, |_| false);
    })
    .expect("served");
    let whole = scans(&received[0]).len() as u64;
    assert!(whole > 50 && whole < report.ports[0].device.telegrams, "{whole}");
    assert!(report.ports[0].faulted_bytes > 0);
}

#[test]
fn files_without_serial_bytes_are_refused_in_words() {
    let folder = folder("empty");
    let file = folder.join("empty.mcap");
    Writer::create(&file, &WriterOptions::default()).expect("a file").finish().expect("written");
    let error = Capture::read(&file).expect_err("refused");
    assert!(matches!(error, CaptureError::NoSerialBytes { .. }), "{error}");
    assert!(error.to_string().contains("--raw"));
    assert!(Capture::read(&folder.join("none.mcap")).is_err());
}
