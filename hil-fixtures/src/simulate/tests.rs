//! The capture as others see it: deframed with `biplane-wire`, timed by the figures of the SICK telegram
//! listing.

use super::{SimulateOptions, SimulateReport, run};
use crate::capture::source::Capture;
use crate::faults::{Faults, Preset};
use biplane_recording::capture::serial;
use biplane_recording::{Port, Reader};
use biplane_wire::framing::Item;
use biplane_wire::{lms, p2os};
use std::path::{Path, PathBuf};

/// A directory that goes away with the test.
pub(super) struct Scratch(pub(super) PathBuf);

impl Scratch {
    pub(super) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("biplane-simulate-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a scratch directory");
        Self(path)
    }

    pub(super) fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).expect("written");
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn rig_text(baud: u32, resolution_deg: f64) -> String {
    format!(
        "[horizontal]\nport = \"a\"\nbaud = {baud}\nresolution_deg = {resolution_deg}\n[vertical]\nport = \"b\"\nbaud = {baud}\n\
         resolution_deg = {resolution_deg}\n[base]\nport = \"c\"\n"
    )
}

/// A few seconds of the corridor.
fn short(scratch: &Scratch, name: &str, rig: &str, seed: u64) -> (SimulateReport, PathBuf) {
    let path = scratch.file("path.toml", "waypoints_m = [[0, 0], [1, 0]]\nspeed_m_s = 0.5\n");
    let options = SimulateOptions {
        path: Some(path.display().to_string()),
        rig: Some(scratch.file("rig.toml", rig)),
        seed,
        output: scratch.0.join(name),
        truth: Some(scratch.0.join("truth")),
        overwrite: true,
        ..SimulateOptions::default()
    };
    (run(&options).expect("simulates"), options.output)
}

/// Frames of a laser, and the arrival time of each one's last byte.
fn frames(capture: &Path, port: Port) -> Vec<(i64, Vec<u8>)> {
    let reader = Reader::open(capture).expect("a capture");
    let mut deframer = lms::DeviceDeframer::new();
    let mut frames = Vec::new();
    for read in serial(&reader).map(|read| read.expect("serial bytes")).filter(|read| read.port == port) {
        deframer.feed(&read.bytes, |item| match item {
            Item::Frame { bytes, .. } => frames.push((read.time_ns, bytes.to_vec())),
            Item::Control { byte: lms::ACK, .. } => {}
            other => panic!("only whole telegrams expected: {other:?}"),
        });
    }
    frames
}

fn truth_times_ns(scratch: &Scratch, name: &str) -> Vec<i64> {
    let text = std::fs::read_to_string(scratch.0.join("truth").join(name)).expect("truth");
    text.lines()
        .map(|line| line.split(' ').next().unwrap_or("").replace('.', "").parse().expect("digits"))
        .collect()
}

#[test]
fn the_bytes_deframe_to_every_scan_at_the_period_of_the_line() {
    for (baud, resolution, bytes, period_ns, transfer_ns) in [
        (38_400, 1.0, 372, 106_560_000, 96_875_000),
        (38_400, 0.5, 732, 213_120_000, 190_625_000),
        (500_000, 0.5, 732, 26_640_000, 17_800_000),
    ] {
        let scratch = Scratch::new("deframe");
        let (report, capture) = short(&scratch, "c.mcap", &rig_text(baud, resolution), 4);
        let turns = if resolution < 1.0 { 2 } else { 1 };
        for (port, name, count) in [
            (Port::Horizontal, "scans_horizontal.txt", report.scans_horizontal),
            (Port::Vertical, "scans_vertical.txt", report.scans_vertical),
        ] {
            let frames = frames(&capture, port);
            let first_beams = truth_times_ns(&scratch, name);
            assert_eq!((frames.len(), first_beams.len()), (count, count));
            assert!(first_beams.windows(2).all(|pair| pair[1] - pair[0] == period_ns));
            assert!(count as f64 > report.duration_s / (period_ns as f64 * 1e-9) - 3.0, "{count}");
            for ((arrived_ns, frame), t0_ns) in frames.iter().zip(first_beams) {
                let due_ns = t0_ns + turns * 13_320_000 + transfer_ns;
                assert_eq!(frame.len(), bytes);
                assert!(
                    (due_ns..due_ns + 20_000_000).contains(arrived_ns),
                    "{baud}: {}",
                    arrived_ns - due_ns
                );
            }
        }
    }
}

#[test]
fn the_base_reports_ten_times_a_second_and_ends_near_the_end_of_the_way() {
    let scratch = Scratch::new("base");
    let (report, capture) = short(&scratch, "c.mcap", &rig_text(38_400, 1.0), 4);
    let mut deframer = p2os::Deframer::new();
    let mut last = None;
    let mut packets = 0;
    for read in serial(&Reader::open(&capture).expect("a capture")).map(|read| read.expect("bytes")) {
        if read.port == Port::Base {
            deframer.feed(&read.bytes, |item| {
                if let Item::Frame { bytes, .. } = item {
                    let packet = p2os::Packet::parse(bytes).expect("a packet");
                    if let Ok(p2os::Report::Sip(sip)) = packet.report() {
                        last = Some(sip);
                        packets += 1;
                    }
                }
            });
        }
    }
    assert_eq!(packets, report.odometry);
    assert!((report.duration_s / 0.1 - packets as f64).abs() <= 2.0, "{packets}");
    let x_mm = i32::from(last.expect("packets").x_raw);
    assert!((x_mm - 1010).abs() < 40, "one meter, counted 1 % too long: {x_mm}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let scratch = Scratch::new("seed");
    let rig = rig_text(38_400, 1.0);
    let bytes = |name: &str, seed| std::fs::read(short(&scratch, name, &rig, seed).1).expect("a file");
    let first = bytes("a.mcap", 4);
    assert!(first == bytes("b.mcap", 4));
    assert!(first != bytes("c.mcap", 5));
}

#[test]
fn bases_that_count_are_captured_together_with_what_they_were_asked() {
    let scratch = Scratch::new("counting");
    let path = scratch.file("path.toml", "waypoints_m = [[0, 0], [4, 0]]\nspeed_m_s = 0.5\n");
    // Counts of a meter of way of the first counter, which the mock base believes to be 1 % longer.
    let bases = [
        (
            "protocol = \"roboclaw\"\nmetres_per_count_left = 0.0001\nmetres_per_count_right = 0.0001",
            10_000.0,
        ),
        ("protocol = \"rflex\"\nmodel = \"b21r\"", 101_230.0),
    ];
    for (base, per_m) in bases {
        let rig = format!("[horizontal]\nport = \"a\"\n[base]\nport = \"c\"\n{base}\n");
        let options = SimulateOptions {
            path: Some(path.display().to_string()),
            rig: Some(scratch.file("r.toml", &rig)),
            output: scratch.0.join("c.mcap"),
            overwrite: true,
            start_up: true,
            ..SimulateOptions::default()
        };
        let report = run(&options).expect("simulates");
        let track = Capture::read(&options.output).expect("reads").base.expect("a base");
        assert_eq!(track.counts.len(), report.odometry, "{base}");
        let driven_m = f64::from(track.counts.last().expect("counts").1[0]) / per_m;
        assert!((driven_m / report.driven_m - 1.01).abs() < 0.03, "{base}: {driven_m} m");
        assert!(track.skipped_bytes == 0, "{base}: {}", track.skipped_bytes);
    }
}

#[test]
fn a_rig_or_option_that_cannot_be_simulated_is_refused_by_name() {
    let scratch = Scratch::new("refuse");
    let base = SimulateOptions { output: scratch.0.join("x.mcap"), ..SimulateOptions::default() };
    let cases = [
        (SimulateOptions { world: "castle".to_owned(), ..base.clone() }, "castle"),
        (SimulateOptions { path: Some("moat".to_owned()), ..base.clone() }, "moat"),
        (SimulateOptions { path: Some("nowhere.toml".to_owned()), ..base.clone() }, "nowhere.toml"),
        (SimulateOptions { stand_s: -1.0, ..base.clone() }, "stand_s"),
        (SimulateOptions { speed_m_s: Some(0.0), ..base.clone() }, "speed_m_s"),
    ];
    for (options, word) in cases {
        let message = run(&options).expect_err(word).to_string();
        assert!(message.contains(word), "{message}");
        assert!(!options.output.exists());
    }
}

#[test]
fn a_truth_that_cannot_be_written_or_is_there_already_is_found_before_the_capture_is_begun() {
    let scratch = Scratch::new("truth");
    let (file, folder) = (scratch.file("file", "no folder"), scratch.0.join("truth"));
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("poses.tum"), "precious").expect("written");
    for truth in [file, folder.clone()] {
        let output = scratch.0.join("s.mcap");
        let options = SimulateOptions { output, truth: Some(truth), ..SimulateOptions::default() };
        let message = run(&options).expect_err("refused").to_string();
        assert!(message.contains("truth"), "{message}");
        let begun = std::fs::read_dir(&scratch.0).expect("a folder").count();
        assert_eq!(begun, 2, "the file and the folder, no capture");
    }
    assert_eq!(std::fs::read_to_string(folder.join("poses.tum")).ok().as_deref(), Some("precious"));
}

/// The corridor with faults; the reads of the localizing laser.
fn faulty(name: &str, faults: &[Preset]) -> Vec<(i64, Vec<u8>)> {
    let scratch = Scratch::new(name);
    let path = scratch.file("path.toml", "waypoints_m = [[0, 0], [9, 0]]\nspeed_m_s = 0.5\n");
    let options = SimulateOptions {
        path: Some(path.display().to_string()),
        output: scratch.0.join("c.mcap"),
        faults: Faults::new(faults, 5),
        ..SimulateOptions::default()
    };
    run(&options).expect("simulates");
    let reader = Reader::open(&options.output).expect("a capture");
    let reads = serial(&reader).map(|read| read.expect("serial bytes"));
    reads.filter(|read| read.port == Port::Horizontal).map(|read| (read.time_ns, read.bytes)).collect()
}

#[test]
fn the_hosts_clock_steps_away_and_back_and_the_bytes_stay() {
    let (plain, stepped) = (faulty("steady", &[]), faulty("clock-step", &[Preset::ClockStep]));
    assert_eq!(plain.len(), stepped.len());
    let mut offsets: Vec<i64> = Vec::new();
    for ((time_ns, bytes), (shown_ns, same)) in plain.iter().zip(&stepped) {
        assert_eq!(bytes, same);
        offsets.push(shown_ns - time_ns);
    }
    offsets.dedup();
    assert!(offsets.len() >= 3 && offsets[0] == 0 && offsets[2] == 0, "{offsets:?}");
    assert!(offsets.len() < 20, "{offsets:?}");
    assert!(offsets[1].abs() >= 1_000_000_000, "{offsets:?}");
}

#[test]
fn faults_of_the_measurement_and_of_the_lines_are_in_a_capture() {
    let telegrams = |reads: &[(i64, Vec<u8>)]| {
        let bytes: Vec<u8> = reads.iter().flat_map(|(_, bytes)| bytes.clone()).collect();
        let (mut deframer, mut whole) = (lms::DeviceDeframer::new(), Vec::new());
        deframer.feed(&bytes, |item| {
            if let Item::Frame { bytes, .. } = item {
                whole.push(bytes.to_vec());
            }
        });
        whole
    };
    let plain = telegrams(&faulty("no-faults", &[]));
    let spoiled = telegrams(&faulty("spoilt", &[Preset::Dazzle, Preset::WindowDirty]));
    assert_eq!(plain.len(), spoiled.len());
    let status = |telegram: &Vec<u8>| telegram[telegram.len() - 3];
    for bit in [0x40, 0x80] {
        let set = spoiled.iter().filter(|telegram| status(telegram) & bit != 0).count();
        assert!((1..plain.len()).contains(&set), "{bit:02x}: {set} of {}", plain.len());
    }
    assert!(plain.iter().zip(&spoiled).all(|(a, b)| (a == b) == (status(b) == 0x10)));
    let torn = telegrams(&faulty("torn", &[Preset::LooseConnector, Preset::BitNoise, Preset::UsbStall]));
    assert!(torn.len() < plain.len() && torn.len() > plain.len() / 2, "{} of {}", torn.len(), plain.len());
}

#[test]
fn a_fault_that_needs_a_client_is_refused() {
    let options =
        SimulateOptions { faults: Faults::new(&[Preset::PowerCycle], 1), ..SimulateOptions::default() };
    let error = run(&options).expect_err("refused").to_string();
    assert!(error.contains("power-cycle") && error.contains("serve"), "{error}");
}

/// Whole telegrams of the localizing laser on a rig with these keys; the truth's first beams.
fn of_rig(name: &str, keys: &str, change: impl FnOnce(&mut SimulateOptions)) -> (Vec<Vec<u8>>, Vec<i64>) {
    let scratch = Scratch::new(name);
    let rig = format!("[horizontal]\nport = \"a\"\n{keys}\n[base]\nport = \"c\"\n");
    let path = scratch.file("path.toml", "waypoints_m = [[0, 0], [1, 0]]\nspeed_m_s = 0.5\n");
    let mut options = SimulateOptions {
        path: Some(path.display().to_string()),
        rig: Some(scratch.file("rig.toml", &rig)),
        output: scratch.0.join("c.mcap"),
        truth: Some(scratch.0.join("truth")),
        ..SimulateOptions::default()
    };
    change(&mut options);
    run(&options).expect("simulates");
    let frames = frames(&options.output, Port::Horizontal).into_iter().map(|(_, frame)| frame).collect();
    (frames, truth_times_ns(&scratch, "scans_horizontal.txt"))
}

#[test]
fn an_s14_sends_181_values_a_turn() {
    let (frames, t0_ns) = of_rig("s14", "fov_deg = 90\nbaud = 500000", |_| {});
    assert!(frames.len() > 200 && frames.iter().all(|frame| frame[2..7] == [0x6E, 0x01, 0xB0, 0xB5, 0x00]));
    assert!(t0_ns.windows(2).all(|pair| pair[1] - pair[0] == 13_320_000));
}

#[test]
fn index_bytes_count_turns_and_telegrams() {
    let keys = "index_bytes = true\nresolution_deg = 0.5\nbaud = 38400";
    let (frames, _) = of_rig("indices", keys, |_| {});
    assert!(frames.len() > 5);
    let index = |frame: &Vec<u8>| (frame[frame.len() - 5], frame[frame.len() - 4]);
    for pair in frames.windows(2) {
        let (before, after) = (index(&pair[0]), index(&pair[1]));
        assert_eq!(
            (pair[0].len(), after.0.wrapping_sub(before.0), after.1.wrapping_sub(before.1)),
            (734, 16, 1)
        );
    }
}

#[test]
fn remission_comes_in_pairs_or_in_the_s14s_own_telegram() {
    for (keys, code, bytes) in [("", 0xF5, 740), ("fov_deg = 90", 0xC4, 559)] {
        let mut kept = None;
        let scratch = Scratch::new("remission-capture");
        let (frames, _) = of_rig("remission", &format!("remission = true\n{keys}"), |options| {
            options.output = scratch.0.join("c.mcap");
            kept = Some(options.output.clone());
        });
        assert!(frames.len() > 5 && frames.iter().all(|frame| (frame[4], frame.len()) == (code, bytes)));
        // And the capture can be served: its ranges are scans like others.
        let capture = Capture::read(&kept.expect("changed")).expect("a capture");
        let laser = capture.horizontal.expect("a laser");
        let track = laser.lms().expect("an LMS 2xx");
        assert_eq!((track.scans.len(), track.other_scans), (frames.len(), 0));
        let fov_deg = if code == 0xC4 { 90 } else { 180 };
        assert_eq!(track.variant().map(|variant| variant.fov_deg), Some(fov_deg));
    }
}

#[test]
fn a_longer_range_has_more_bits_and_the_start_up_says_so() {
    let keys = "units = \"mm\"\nrange_max_m = 32";
    let (frames, _) = of_rig("far", keys, |options| options.start_up = true);
    let config = frames.iter().find(|frame| frame[4] == 0xF4).expect("a configuration");
    assert_eq!(config[5 + 5..5 + 7], [6, 1]);
    let scan = frames.iter().find(|frame| frame[4] == 0xB0).expect("a scan");
    // The corridor's end, 12.3 m away straight ahead: more than 13 bits hold.
    let ahead = u16::from_le_bytes([scan[7 + 180], scan[8 + 180]]);
    assert!((12_000..12_600).contains(&ahead), "{ahead}");
}

#[test]
fn a_mirror_that_drifts_takes_the_truth_along() {
    let (_, steady) = of_rig("steady-mirror", "baud = 500000", |_| {});
    let (_, slow) =
        of_rig("slow-mirror", "baud = 500000", |options| options.lasers.mirror_ppm = [100.0, 0.0]);
    let turn = |t0_ns: &[i64]| (t0_ns[t0_ns.len() - 1] - t0_ns[0]) as f64 / (t0_ns.len() - 1) as f64;
    assert!((turn(&steady) - 13_320_000.0).abs() < 1e-6);
    assert!((turn(&slow) - 13_321_332.0).abs() < 1e-6, "{}", turn(&slow));
}
