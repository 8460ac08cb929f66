//! Recordings of lasers of today, made into bytes again: what `encode` writes is replayed, and served to
//! `record`. All three must hold the same scans.

use std::path::{Path, PathBuf};

use biplane_mock::capture::encode::{self, EncodeOptions};
use biplane_mock::devices::cola::ColaParams;
use biplane_mock::devices::scip::ScipParams;
use biplane_mock::simulate::{self, LaserOptions, SimulateOptions};
use biplane_recording::mcap::read::RIG_ATTACHMENT;
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::{Base, Laser};
use biplane_recording::{Direction, Port, Reader, Rig, Topic, Writer, WriterOptions};

use crate::accuracy::captures::{replayed, served_and_recorded};
use crate::accuracy::fan_lasers::scans;
use crate::accuracy::recorded::folder;

const TOPICS: [Topic; 2] = [Topic::ScanHorizontal, Topic::ScanVertical];
/// A device's clock is found anew: in the first seconds the line under its arrivals may rise by 200
/// millionths of a second's readings. A Hokuyo laser also states whole milliseconds.
const COLA_STAMP_NS: i64 = 250_000;
const SCIP_STAMP_NS: i64 = 1_500_000;
/// A recorder that a busy machine holds up may miss the first scans of a capture.
const MIN_SERVED_PERCENT: usize = 98;

/// A few meters of corridor with lasers of this rig, recorded.
fn recording(work: &Path, rig: &Path, lasers: &LaserOptions) -> PathBuf {
    let (path, capture, run) = (work.join("path.toml"), work.join("capture.mcap"), work.join("run.mcap"));
    std::fs::write(&path, "waypoints_m = [[0, 0], [3, 0]]\nspeed_m_s = 1.0\n").unwrap();
    let options = SimulateOptions {
        path: Some(path.display().to_string()),
        rig: Some(rig.to_owned()),
        output: capture.clone(),
        lasers: lasers.clone(),
        ..SimulateOptions::default()
    };
    simulate::run(&options).unwrap();
    replayed(&capture, &run);
    run
}

/// Geometry and values of a scan to the last bit, and its intensities.
fn measured(scan: &LaserScan) -> (Vec<u32>, Vec<u32>) {
    let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<u32>>();
    let geometry = [scan.angle_min_rad, scan.angle_increment_rad, scan.time_increment_s, scan.scan_time_s];
    ([bits(&geometry), bits(&scan.ranges_m)].concat(), bits(&scan.intensities))
}

/// What differs between the scans of two recordings; the largest difference of their stamps.
fn compare(name: &str, [first, second]: [&Path; 2]) -> i64 {
    let mut apart_ns = 0;
    for topic in TOPICS {
        let [first, second] = [scans(first, topic), scans(second, topic)];
        assert!(first.len() > 40, "{name}: {} scans", first.len());
        assert_eq!(first.len(), second.len(), "{name}: {}", topic.name());
        for (number, (one, other)) in first.iter().zip(&second).enumerate() {
            assert!(measured(one) == measured(other), "{name}: scan {number} of {}", topic.name());
            apart_ns = apart_ns.max((one.stamp_ns - other.stamp_ns).abs());
        }
    }
    apart_ns
}

/// How many scans of the first recording are in the second, in order and whole.
fn found(first: &[LaserScan], second: &[LaserScan]) -> usize {
    let (mut rest, mut count) = (second, 0);
    for scan in first {
        if let Some(at) = rest.iter().position(|other| measured(other) == measured(scan)) {
            (rest, count) = (&rest[at + 1..], count + 1);
        }
    }
    count
}

/// Serves a capture whose replay is `run`, and records from its lasers. Serial lasers are judged by the
/// captures of serial lines.
fn serve_and_judge(name: &str, capture: &Path, run: &Path, work: &Path) {
    let served = work.join("served.mcap");
    let rig = Reader::open(capture).unwrap().rig().unwrap().unwrap();
    served_and_recorded(capture, &rig, work, &served);
    let lasers = TOPICS.into_iter().zip([Some(&rig.horizontal), rig.vertical.as_ref()]);
    for (topic, laser) in lasers {
        if laser.is_none_or(Laser::is_lms2xx) {
            continue;
        }
        let (first, second) = (scans(run, topic), scans(&served, topic));
        let (count, all) = (found(&first, &second), first.len());
        println!("{name}: {count} of {all} scans of {} were served and recorded", topic.name());
        assert!(all > 40 && 100 * count >= MIN_SERVED_PERCENT * all, "{name}");
    }
}

#[test]
fn what_is_encoded_replays_to_the_same_scans_and_is_served_whole() {
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../hil-fixtures/rigs");
    for (name, stamp_ns) in [
        ("lms111", COLA_STAMP_NS),
        ("tim781", COLA_STAMP_NS),
        ("ust20lx", SCIP_STAMP_NS),
        ("mixed", SCIP_STAMP_NS),
    ] {
        let work = folder(&format!("encoded-{name}"));
        let network_laser = ColaParams::of_name(name).unwrap_or_default();
        let lasers = LaserOptions { network_laser: network_laser.clone(), ..LaserOptions::default() };
        let run = recording(&work, &rigs.join(format!("{name}.toml")), &lasers);
        let (capture, again) = (work.join("encoded.mcap"), work.join("again.mcap"));
        let options = EncodeOptions {
            input: run.clone(),
            output: capture.clone(),
            network_laser,
            hokuyo: ScipParams::default(),
            ..EncodeOptions::default()
        };
        let report = encode::run(&options).unwrap();
        assert_eq!((report.delayed, report.beyond_range), (0, 0), "{name}");
        replayed(&capture, &again);
        let apart_ns = compare(name, [&run, &again]);
        assert!(apart_ns <= stamp_ns, "{name}: {apart_ns} ns");
        println!("{name}: all scans again, stamps {:.3} ms apart at most", apart_ns as f64 * 1e-6);
        serve_and_judge(name, &capture, &run, &work);
    }
}

/// A capture of a real laser: lines of seconds, direction and bytes.
fn real_capture(name: &str, work: &Path) -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
    let data = std::env::var_os("BIPLANE_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    let text = std::fs::read_to_string(data.join(format!("cola/{name}.txt"))).ok()?;
    let capture = work.join("capture.mcap");
    let mut rig = Rig { vertical: None, base: Base::none(), ..Rig::default() };
    rig.horizontal = rig.horizontal.at_address("192.168.0.1:2112");
    let mut writer = Writer::create(&capture, &WriterOptions::default()).unwrap();
    writer.attach(RIG_ATTACHMENT, "application/toml", rig.to_toml().as_bytes()).unwrap();
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        if words.get(1) == Some(&"s2c") {
            let time_ns = (words[0].parse::<f64>().unwrap() * 1e9).round() as i64;
            let byte = |at| u8::from_str_radix(&words[2][at..at + 2], 16).unwrap();
            let bytes: Vec<u8> = (0..words[2].len()).step_by(2).map(byte).collect();
            writer.write_serial(Port::Horizontal, Direction::Rx, time_ns, &bytes).unwrap();
        }
    }
    writer.finish().unwrap();
    Some(capture)
}

#[test]
fn captures_of_real_lasers_on_a_network_are_served_whole() {
    for name in ["lms111", "lms511", "tim871s"] {
        let work = folder(&format!("served-{name}"));
        let Some(capture) = real_capture(name, &work) else { return };
        let run = work.join("run.mcap");
        replayed(&capture, &run);
        serve_and_judge(name, &capture, &run, &work);
    }
}
