//! Captures of every kind of base, simulated, encoded and replayed: the same drive gives the same odometry
//! whatever the base speaks.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use biplane_mock::capture::encode;
use biplane_mock::capture::encode::EncodeOptions;
use biplane_mock::simulate::{self, SimulateOptions};
use biplane_onboard::{OnboardError, ReplayOptions, RunReport, replay};
use biplane_recording::{AnyMessage, Direction, Reader, Topic, Writer, WriterOptions};

const RIG: &str = "[horizontal]\nport = \"a\"\n[base]\nport = \"c\"\n";
const BASES: [(&str, &str); 3] = [
    ("p2os", "protocol = \"p2os\"\n"),
    (
        "roboclaw",
        "protocol = \"roboclaw\"\nwheel_base_m = 0.4\nmetres_per_count_left = 0.00005\nmetres_per_count_right = -0.00004\n",
    ),
    ("rflex", "protocol = \"rflex\"\nmodel = \"atrv-jr\"\n"),
];

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("biplane-bases-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// A drive of 4 m with a bend, the base of this kind.
    fn capture(&self, name: &str, base: &str) -> PathBuf {
        let path = self.write("path.toml", "waypoints_m = [[0, 0], [3, 0], [4, 0.3]]\nspeed_m_s = 0.5\n");
        let options = SimulateOptions {
            path: Some(path.display().to_string()),
            rig: Some(self.write(&format!("{name}.toml"), &format!("{RIG}{base}"))),
            output: self.0.join(format!("{name}.mcap")),
            start_up: true,
            seed: 7,
            ..SimulateOptions::default()
        };
        simulate::run(&options).expect("simulates");
        options.output
    }

    fn replay(&self, input: &Path) -> Result<(RunReport, Vec<Sample>), OnboardError> {
        let name = input.file_stem().unwrap().to_str().unwrap();
        let output = self.0.join(format!("{name}-run.mcap"));
        let report = replay(&ReplayOptions::new(input, &output), &AtomicBool::new(false))?;
        Ok((report, odometry(&output)))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Stamp, x, y, heading.
type Sample = (i64, [f64; 3]);

fn odometry(run: &Path) -> Vec<Sample> {
    let reader = Reader::open(run).unwrap();
    let entries = reader.messages().map(Result::unwrap).filter(|entry| entry.topic == Some(Topic::Odom));
    let samples = entries.map(|entry| match entry.decode().unwrap() {
        AnyMessage::Odometry(odometry) => {
            let [_, _, z, w] = odometry.orientation_xyzw;
            (odometry.stamp_ns, [odometry.position_m[0], odometry.position_m[1], 2.0 * z.atan2(w)])
        }
        other => panic!("{other:?}"),
    });
    samples.collect()
}

/// The pose at a time, between two samples.
fn at(samples: &[Sample], stamp_ns: i64) -> Option<[f64; 3]> {
    let next = samples.partition_point(|(ns, _)| *ns < stamp_ns);
    let (before, after) = (samples.get(next.checked_sub(1)?)?, samples.get(next)?);
    let u = (stamp_ns - before.0) as f64 / (after.0 - before.0) as f64;
    Some([0, 1, 2].map(|i| before.1[i] + u * (after.1[i] - before.1[i])))
}

/// Largest distance and turn between two odometries at the second one's stamps.
fn furthest(reference: &[Sample], samples: &[Sample]) -> (f64, f64) {
    let apart = samples.iter().filter_map(|(stamp_ns, pose)| {
        let other = at(reference, *stamp_ns)?;
        Some(((pose[0] - other[0]).hypot(pose[1] - other[1]), (pose[2] - other[2]).abs()))
    });
    apart.fold((0.0, 0.0), |maximum, apart| (maximum.0.max(apart.0), maximum.1.max(apart.1)))
}

#[test]
fn one_drive_is_the_same_odometry_over_every_protocol_at_the_same_stamps() {
    let folder = Folder::new("same");
    let mut reference: Vec<Sample> = Vec::new();
    for (name, base) in BASES {
        let (report, samples) = folder.replay(&folder.capture(name, base)).expect("replays");
        assert!(report.recorded.odometry > 80 && report.arrival.damaged == 0, "{name}: {report:?}");
        // Sampled on a grid of 50 or 100 ms when the first byte left: stamps are on it but for what the
        // adapter adds.
        let period_ns = if name == "roboclaw" { 50_000_000 } else { 100_000_000 };
        let off = samples.iter().map(|(stamp_ns, _)| {
            (stamp_ns - samples[0].0 + period_ns / 2).rem_euclid(period_ns) - period_ns / 2
        });
        let spread_ns = off.clone().max().unwrap() - off.min().unwrap();
        assert!(spread_ns < 3_000_000, "{name}: stamps {spread_ns} ns off the grid");
        if reference.is_empty() {
            reference = samples;
            continue;
        }
        // A Pioneer tells whole millimeters and 4096ths of a turn; 0.5 m/s for the spread of stamps is 1.5
        // mm.
        let (off_m, off_rad) = furthest(&reference, &samples);
        assert!(off_m < 0.006 && off_rad < 0.006, "{name}: {off_m} m, {off_rad} rad");
        let (end, reference_end) = (samples.last().unwrap().1, reference.last().unwrap().1);
        println!(
            "{name}: at most {off_m:.4} m and {off_rad:.4} rad from p2os; ends {end:?}, {reference_end:?}"
        );
    }
}

#[test]
fn a_recording_encoded_for_another_base_replays_to_the_same_odometry() {
    let folder = Folder::new("encode");
    let (_, reference) = folder.replay(&folder.capture("p2os", BASES[0].1)).expect("replays");
    for (name, base) in [BASES[1], BASES[2]] {
        let options = EncodeOptions {
            input: folder.0.join("p2os-run.mcap"),
            output: folder.0.join(format!("{name}-encoded.mcap")),
            rig: Some(folder.write(&format!("{name}.toml"), &format!("{RIG}{base}"))),
            ..EncodeOptions::default()
        };
        let report = encode::run(&options).expect("encodes");
        assert_eq!(report.odometry_skipped, 0, "{name}: {report:?}");
        let (_, samples) = folder.replay(&options.output).expect("replays");
        assert_eq!(samples.len(), reference.len(), "{name}");
        let (off_m, off_rad) = furthest(&reference, &samples);
        assert!(off_m < 0.01 && off_rad < 0.006, "{name}: {off_m} m, {off_rad} rad");
    }
}

#[test]
fn answers_without_their_questions_are_refused_and_no_bytes_of_the_base_are_not() {
    let folder = Folder::new("refuse");
    let whole = folder.capture("roboclaw", BASES[1].1);
    let copy = |name: &str, keeps: fn(&str, Direction) -> bool| {
        let reader = Reader::open(&whole).unwrap();
        let path = folder.0.join(name);
        let mut writer = Writer::create(&path, &WriterOptions::default()).unwrap();
        let rig = reader.rig().unwrap().unwrap().to_toml();
        writer.attach("rig.toml", "application/toml", rig.as_bytes()).unwrap();
        for read in biplane_recording::capture::serial(&reader).map(Result::unwrap) {
            if keeps(read.port.name(), read.direction) {
                writer.write_serial(read.port, read.direction, read.time_ns, &read.bytes).unwrap();
            }
        }
        writer.finish().unwrap();
        path
    };
    let mute = copy("mute.mcap", |_, direction| direction == Direction::Rx);
    let error = folder.replay(&mute).expect_err("refused").to_string();
    assert!(error.contains("roboclaw") && error.contains("/serial/base/tx"), "{error}");
    assert!(!folder.0.join("mute-run.mcap").exists());
    let lasers = copy("lasers.mcap", |port, _| port != "base");
    let (report, samples) = folder.replay(&lasers).expect("replays");
    assert!(report.recorded.poses > 0 && samples.is_empty());
}
