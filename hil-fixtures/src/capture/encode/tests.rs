//! A recording encoded to bytes and read back with `biplane-wire`.

use super::laser::variant_of_scan;
use super::{EncodeError, EncodeOptions, EncodeReport, run};
use crate::line::ReadParams;
use biplane_recording::capture::serial;
use biplane_recording::messages::{Imu, LaserScan, Odometry};
use biplane_recording::{AnyMessage, Port, Reader, Topic, Writer, WriterOptions};
use biplane_wire::framing::Item;
use biplane_wire::{lms, p2os};
use std::path::PathBuf;

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("biplane-encode-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a scratch directory");
        Self(path)
    }

    fn options(&self) -> EncodeOptions {
        // One byte a read: the arrival of each byte is seen.
        let reads = ReadParams { max_bytes: 1, ..EncodeOptions::default().reads };
        EncodeOptions {
            input: self.0.join("in.mcap"),
            output: self.0.join("out.mcap"),
            overwrite: true,
            reads,
            ..EncodeOptions::default()
        }
    }

    /// Encodes on the lines of the given rig, whatever the stamps.
    fn encode_on(
        &self,
        rig: &str,
        scans: &[LaserScan],
        odometry: &[Odometry],
    ) -> Result<EncodeReport, EncodeError> {
        let file = self.0.join("rig.toml");
        std::fs::write(&file, rig).expect("written");
        self.write(scans, odometry);
        run(&EncodeOptions { rig: Some(file), ..self.options() })
    }

    /// Encodes without a rig.
    fn encode(&self, scans: &[LaserScan], odometry: &[Odometry]) -> Result<EncodeReport, EncodeError> {
        self.write(scans, odometry);
        run(&self.options())
    }

    fn write(&self, scans: &[LaserScan], odometry: &[Odometry]) {
        let options = WriterOptions { overwrite: true, ..WriterOptions::default() };
        let mut writer = Writer::create(&self.0.join("in.mcap"), &options).expect("a file");
        for scan in scans {
            writer.write(Topic::ScanHorizontal, scan.stamp_ns, scan.stamp_ns, scan).expect("written");
        }
        for odometry in odometry {
            writer.write(Topic::Odom, odometry.stamp_ns, odometry.stamp_ns, odometry).expect("written");
        }
        writer.finish().expect("finished");
    }

    /// Scans with the time of the telegram's first byte.
    fn scans(&self) -> Vec<(i64, Vec<u16>)> {
        let reader = Reader::open(&self.0.join("out.mcap")).expect("a capture");
        let mut deframer = lms::DeviceDeframer::new();
        let (mut times, mut scans) = (Vec::new(), Vec::new());
        for read in
            serial(&reader).map(|read| read.expect("bytes")).filter(|read| read.port == Port::Horizontal)
        {
            times.push(read.time_ns);
            deframer.feed(&read.bytes, |item| {
                let Item::Frame { offset, bytes } = item else { panic!("only telegrams: {item:?}") };
                let telegram = lms::Telegram::parse(bytes).expect("a telegram");
                let Ok(lms::Reply::Scan(scan)) = telegram.reply() else { panic!("only scans") };
                scans.push((times[offset as usize], scan.values().collect()));
            });
        }
        scans
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const SECOND: i64 = 1_000_000_000;

fn scan(stamp_ns: i64, ranges_m: Vec<f32>, step_deg: f32) -> LaserScan {
    LaserScan {
        stamp_ns,
        angle_min_rad: (-90.0_f32).to_radians(),
        angle_increment_rad: step_deg.to_radians(),
        ranges_m,
        ..LaserScan::default()
    }
}

#[test]
fn ranges_and_codes_come_out_as_the_device_would_say_them() {
    let scratch = Scratch::new("codes");
    let mut ranges = vec![2.5_f32; 180];
    (ranges[0], ranges[1], ranges[2], ranges[3]) = (f32::INFINITY, f32::NAN, 81.9, 1.004);
    let report = scratch.encode(&[scan(10 * SECOND, ranges, 1.0)], &[]).expect("encodes");
    assert_eq!((report.scans_horizontal, report.beyond_range), (1, 1));
    let scans = scratch.scans();
    let words = &scans[0].1;
    // 180 beams of a log are 181 on the wire; the last one has no echo.
    assert_eq!((words.len(), &words[..5], words[180]), (181, &[8191, 8186, 8183, 100, 250][..], 8191));
}

#[test]
fn the_first_byte_leaves_k_turns_after_the_stamp() {
    for (beams, step, turns) in [(181, 1.0, 1), (361, 0.5, 2)] {
        let scratch = Scratch::new("time");
        scratch.encode(&[scan(10 * SECOND, vec![1.0; beams], step)], &[]).expect("encodes");
        // The read returns when the byte's ten bits have arrived: 260.4 us at 38400 Bd.
        assert_eq!(scratch.scans()[0].0, 10 * SECOND + turns * 13_320_000 + 260_416);
    }
}

#[test]
fn stamps_that_step_back_or_crowd_only_delay_the_line() {
    let scratch = Scratch::new("back");
    let stamps = [10 * SECOND, 10 * SECOND - 5_000_000, 10 * SECOND + 20_000_000, 11 * SECOND];
    let scans: Vec<LaserScan> = stamps.iter().map(|stamp| scan(*stamp, vec![1.0; 181], 1.0)).collect();
    let report = scratch.encode_on(crate::rig::named::RIGS[0].1, &scans, &[]).expect("encodes");
    assert_eq!((report.scans_horizontal, report.delayed, report.backward_stamps), (4, 2, 1));
    // The third is due 20 ms after the first, which takes 96.875 ms, as does the second.
    assert!((report.longest_delay_ms - 173.75).abs() < 1e-6, "{}", report.longest_delay_ms);
    let starts: Vec<i64> = scratch.scans().iter().map(|scan| scan.0).collect();
    assert!(starts.windows(2).all(|pair| pair[1] - pair[0] >= 96_875_000));
    assert_eq!(starts[3], 11 * SECOND + 13_320_000 + 260_416);
}

#[test]
fn crowded_lines_are_raised_unless_the_rig_is_given() {
    let scratch = Scratch::new("raise");
    // 20 ms apart: too close for 96.875 ms at 38400 Bd, not for 7.44 ms at 500000 Bd.
    let scans: Vec<LaserScan> =
        (0..50).map(|k| scan(10 * SECOND + k * 20_000_000, vec![1.0; 181], 1.0)).collect();
    let free = scratch.encode(&scans, &[]).expect("encodes");
    assert_eq!((free.raised, free.delayed), (vec![(Port::Horizontal, 500_000)], 0));
    let rig = Reader::open(&scratch.0.join("out.mcap"))
        .expect("a capture")
        .rig()
        .expect("reads")
        .expect("attached");
    assert_eq!(rig.horizontal.baud, 500_000);
    let bound = scratch.encode_on(crate::rig::named::RIGS[0].1, &scans, &[]).expect("encodes");
    assert_eq!((bound.raised, bound.delayed), (Vec::new(), 49));
}

#[test]
fn odometry_becomes_ticks_and_angle_steps() {
    let scratch = Scratch::new("odometry");
    let at = |stamp_ns| Odometry {
        stamp_ns,
        position_m: [-0.25, 1.5, 0.0],
        orientation_xyzw: [0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()],
        linear_m_s: [0.3, 0.0, 0.0],
        ..Odometry::default()
    };
    // At 9600 Bd a packet takes 26 ms: of samples every 5 ms the line carries every fifth or so.
    let samples: Vec<Odometry> = (0..40).map(|k| at(10 * SECOND + k * 5_000_000)).collect();
    let one = [scan(10 * SECOND, vec![1.0; 181], 1.0)];
    let report = scratch.encode_on(crate::rig::named::RIGS[0].1, &one, &samples).expect("encodes");
    assert_eq!(report.odometry + report.odometry_skipped, 40);
    assert!(report.odometry >= 6 && report.longest_delay_ms < 60.0, "{report:?}");
    let reader = Reader::open(&scratch.0.join("out.mcap")).expect("a capture");
    let mut deframer = p2os::Deframer::new();
    let mut seen = 0;
    for read in serial(&reader).map(|read| read.expect("bytes")).filter(|read| read.port == Port::Base) {
        deframer.feed(&read.bytes, |item| {
            let Item::Frame { bytes, .. } = item else { panic!("only packets") };
            let Ok(p2os::Report::Sip(sip)) = p2os::Packet::parse(bytes).expect("a packet").report() else {
                panic!("SIP")
            };
            assert_eq!((sip.x_raw, sip.y_raw, sip.theta_raw, sip.left_raw), (32768 - 250, 1500, 1024, 300));
            assert!(sip.motors_moving());
            seen += 1;
        });
    }
    assert_eq!(seen, report.odometry);
}

#[test]
fn odometry_whose_stamp_steps_back_is_sent_late_but_sent() {
    let scratch = Scratch::new("late");
    let stamps = [10 * SECOND, 11 * SECOND, 10 * SECOND + 200_000_000, 12 * SECOND];
    let samples = stamps.map(|stamp_ns| Odometry { stamp_ns, ..Odometry::default() });
    let one = [scan(10 * SECOND, vec![1.0; 181], 1.0)];
    let report = scratch.encode_on(crate::rig::named::RIGS[0].1, &one, &samples).expect("encodes");
    assert_eq!(
        (report.odometry, report.odometry_skipped, report.delayed, report.backward_stamps),
        (4, 0, 1, 1)
    );
    assert!((report.longest_delay_ms - 800.0 - 26.04).abs() < 0.1, "{}", report.longest_delay_ms);
}

#[test]
fn scans_that_no_lms_takes_are_refused() {
    let scratch = Scratch::new("refuse");
    let error = scratch.encode(&[scan(0, vec![1.0; 720], 0.375)], &[]).expect_err("no LMS").to_string();
    assert!(error.contains("/scan/horizontal") && error.contains("720 beams"), "{error}");
    let mixed = [scan(0, vec![1.0; 181], 1.0), scan(SECOND, vec![1.0; 361], 0.5)];
    let error = scratch.encode(&mixed, &[]).expect_err("two variants").to_string();
    assert!(error.contains("scan 1") && error.contains("180 degrees in steps of 1"), "{error}");
    assert!(matches!(scratch.encode(&[], &[]), Err(EncodeError::NoScans { .. })));
    let turned = LaserScan { angle_min_rad: 0.0, ..scan(0, vec![1.0; 181], 1.0) };
    assert_eq!(variant_of_scan(&turned), None);
}

#[test]
fn samples_of_an_inertial_unit_are_kept() {
    let scratch = Scratch::new("imu");
    let options = WriterOptions { overwrite: true, ..WriterOptions::default() };
    let mut writer = Writer::create(&scratch.0.join("in.mcap"), &options).expect("a file");
    let turns = |k: i64| [0.0, 0.0, k as f64];
    let stamp_ns = |k| 10 * SECOND + k * 10_000_000;
    let sample = |k| Imu { stamp_ns: stamp_ns(k), angular_rad_s: turns(k), ..Imu::default() };
    let samples: Vec<Imu> = (0..10).map(sample).collect();
    for sample in &samples {
        writer.write(Topic::Imu, sample.stamp_ns, sample.stamp_ns, sample).expect("written");
    }
    let scan = scan(10 * SECOND, vec![1.0; 181], 1.0);
    writer.write(Topic::ScanHorizontal, scan.stamp_ns, scan.stamp_ns, &scan).expect("written");
    writer.finish().expect("finished");
    let report = run(&scratch.options()).expect("encodes");
    // The scan's last byte arrives 110.2 ms after its stamp: all samples came before.
    assert_eq!(report.inertial, 10);
    let reader = Reader::open(&scratch.0.join("out.mcap")).expect("a capture");
    let entries = reader.messages().map(|entry| entry.expect("an entry").decode());
    let kept = entries.filter_map(|message| match message {
        Ok(AnyMessage::Imu(sample)) => Some(sample),
        _ => None,
    });
    assert_eq!(kept.collect::<Vec<Imu>>(), samples);
}

/// Rigs of one laser of today.
const COLA_RIG: &str = r#"
[horizontal]
protocol = "cola"
address = "192.168.0.1:2112"
[base]
protocol = "none"
"#;
const SCIP_RIG: &str = r#"
[horizontal]
protocol = "scip"
address = "192.168.0.10:10940"
[base]
protocol = "none"
"#;

#[test]
fn the_clock_of_a_laser_of_today_never_steps_back() {
    let stamps = [10 * SECOND, 10 * SECOND - 5_000_000, 10 * SECOND + 20_000_000, 11 * SECOND];
    let scans: Vec<LaserScan> = stamps.iter().map(|stamp| scan(*stamp, vec![1.0; 181], 1.0)).collect();
    for (name, rig, wait_ms) in [("cola-clock", COLA_RIG, 5.001), ("scip-clock", SCIP_RIG, 6.0)] {
        let scratch = Scratch::new(name);
        let report = scratch.encode_on(rig, &scans, &[]).expect("encodes");
        assert_eq!((report.scans_horizontal, report.delayed, report.backward_stamps), (4, 1, 1), "{name}");
        assert!((report.longest_delay_ms - wait_ms).abs() < 1e-6, "{name}: {}", report.longest_delay_ms);
    }
}

#[test]
fn scans_that_no_laser_of_today_takes_are_refused_by_its_name() {
    let scratch = Scratch::new("refuse-fan");
    let refused = |rig: &str, step_deg: f32, beams: usize| {
        let scans = [scan(0, vec![1.0; beams], step_deg)];
        scratch.encode_on(rig, &scans, &[]).expect_err("refused").to_string()
    };
    let error = refused(SCIP_RIG, 0.375, 480);
    assert!(error.contains("480 beams") && error.contains("no Hokuyo scan"), "{error}");
    // A UST looks 135 degrees to each side.
    assert!(refused(SCIP_RIG, 0.25, 905).contains("field of view"));
    let error = refused(COLA_RIG, 0.1, 1142);
    assert!(error.contains("no SICK network laser scan") && error.contains("1141"), "{error}");
}
