//! Captures of three real SICK lasers (LMS111, LMS511, TiM871S) through the engine: every scan is kept, and
//! its stamp follows the device's own clock.
//!
//! The captures are not part of the sources: `BIPLANE_DATA`, or the folder beside them.

use std::fs;
use std::path::PathBuf;

use biplane_matcher::TrackerParams;
use biplane_onboard::{Engine, EngineOptions, Feed, Health, Sink};
use biplane_recording::messages::{LaserScan, Message};
use biplane_recording::rig::Base;
use biplane_recording::{Port, Rig, Topic};
use biplane_wire::cola::{Kind, Scan, Telegram};

#[derive(Default)]
struct Scans(Vec<LaserScan>);

impl Sink for Scans {
    fn message(&mut self, topic: Topic, _: i64, _: i64, cdr: &[u8]) {
        if topic == Topic::ScanHorizontal {
            self.0.push(LaserScan::decode(cdr).unwrap());
        }
    }

    fn health(&mut self, _: i64, _: &Health) {}

    fn dropped(&self) -> u64 {
        0
    }
}

fn capture(name: &str) -> Option<Vec<(i64, Vec<u8>)>> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let data = std::env::var_os("BIPLANE_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    let text = fs::read_to_string(data.join(format!("cola/{name}.txt"))).ok()?;
    let byte = |hex: &[u8]| u8::from_str_radix(std::str::from_utf8(hex).unwrap(), 16).unwrap();
    let telegram = |line: &str| {
        let mut words = line.split(' ');
        let (time_s, way, hex) = (words.next()?, words.next()?, words.next()?);
        let time_ns = (time_s.parse::<f64>().unwrap() * 1e9).round() as i64;
        (way == "s2c").then(|| (time_ns, hex.as_bytes().chunks(2).map(byte).collect()))
    };
    Some(text.lines().filter_map(telegram).collect())
}

/// The device's own times of the scans of a capture, microseconds; repeated telegrams once.
fn device_us(telegrams: &[(i64, Vec<u8>)]) -> Vec<i64> {
    let mut times = Vec::new();
    for (_, bytes) in telegrams {
        let telegram = Telegram::parse(bytes).unwrap();
        if telegram.kind == Kind::Event && telegram.name == Scan::NAME {
            times.push(i64::from(Scan::parse(&telegram).unwrap().head.scan_us));
        }
    }
    times.dedup();
    times
}

/// RMS and largest distance of stamps from a straight line over the device's times, milliseconds.
fn scatter_ms(stamps_ns: &[i64], device_us: &[i64]) -> [f64; 2] {
    let points: Vec<[f64; 2]> = stamps_ns
        .iter()
        .zip(device_us)
        .map(|(stamp, us)| [(us - device_us[0]) as f64 * 1e-3, (stamp - stamps_ns[0]) as f64 * 1e-6])
        .collect();
    let count = points.len() as f64;
    let mean = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / count);
    let sum = |of: fn([f64; 2]) -> f64| {
        points.iter().map(|point| of([point[0] - mean[0], point[1] - mean[1]])).sum::<f64>()
    };
    let slope = sum(|[x, y]| x * y) / sum(|[x, _]| x * x);
    let rest = |point: &[f64; 2]| point[1] - mean[1] - slope * (point[0] - mean[0]);
    let rms = (points.iter().map(|point| rest(point).powi(2)).sum::<f64>() / count).sqrt();
    [rms, points.iter().map(|point| rest(point).abs()).fold(0.0, f64::max)]
}

#[test]
fn every_scan_of_three_real_lasers_is_kept_and_stamped_by_the_devices_clock() {
    for (name, scans, beams, first_deg) in
        [("lms111", 172, 541, -135.0), ("lms511", 174, 1141, -95.0), ("tim871s", 150, 811, -135.0)]
    {
        let Some(telegrams) = capture(name) else { return };
        let mut rig = Rig { vertical: None, base: Base::none(), ..Rig::default() };
        rig.horizontal = rig.horizontal.at_address("192.168.0.1:2112");
        let options =
            EngineOptions { rig, matcher: TrackerParams::default(), feed: Feed::Recorded, raw: false };
        let mut engine = Engine::new(&options, Scans::default(), 0);
        for (time_ns, bytes) in &telegrams {
            for piece in bytes.chunks(1460) {
                engine.bytes(*time_ns, Port::Horizontal, piece);
            }
        }
        let (report, Scans(found)) = engine.finish(telegrams.last().unwrap().0);
        assert_eq!(
            (found.len(), report.losses.lost, report.arrival.damaged, report.arrival.skipped_bytes),
            (scans, 0, 0, 0),
            "{name}"
        );
        assert_eq!((report.arrival.lost_telegrams, report.arrival.backward_stamps), (0, 0), "{name}");
        for scan in &found {
            assert_eq!(scan.ranges_m.len(), beams, "{name}");
            assert!((f64::from(scan.angle_min_rad).to_degrees() - first_deg).abs() < 1e-3, "{name}");
            assert!(
                (scan.angle_min_rad + scan.angle_max_rad).abs() < 1e-4,
                "{name}: straight ahead is the middle"
            );
        }
        let stamps_ns: Vec<i64> = found.iter().map(|scan| scan.stamp_ns).collect();
        let [rms_ms, worst_ms] = scatter_ms(&stamps_ns, &device_us(&telegrams));
        println!("{name}: {scans} scans, stamps RMS {rms_ms:.3} ms, worst {worst_ms:.3} ms");
        assert!(rms_ms <= 0.5, "{name}: {rms_ms} ms");
    }
}
