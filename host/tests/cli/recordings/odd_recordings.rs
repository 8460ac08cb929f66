//! Recordings with numbers that no robot records: a result or a sentence each, never a panic, a hang or
//! memory for what is not there.
//!
//! A drive through a room is read, two things in it are made odd, and it goes through every command.
//! `BIPLANE_SEEDS=200` tries so many recordings instead of a few, `BIPLANE_SEED=17` one.

use std::path::Path;
use std::process::Command;

use biplane_recording::messages::{LaserScan, Odometry, PoseWithCovarianceStamped};
use biplane_recording::{AnyMessage, Reader, Topic, Writer, WriterOptions};

use crate::room::{Content, record};
use crate::run::Folder;

/// Recordings of a plain run, so many that each oddity comes once.
const FEW: u64 = ODDITIES / 2;
/// Kinds of oddity, in [`odd_scan`], [`odd_pose`], [`odd_stamp`] and [`is_left_out`].
const ODDITIES: u64 = 40;
/// Seconds and kilobytes of address space that a command may take.
const LONGEST_S: u32 = 60;
const MAX_KB: u32 = 3_000_000;
const YEAR_NS: i64 = 31_557_600_000_000_000;

/// What a laser says.
fn odd_scan(kind: u64, number: i64, scan: &mut LaserScan) {
    let third = number % 3 == 0;
    match kind {
        0 => scan.ranges_m.fill(f32::NAN),
        1 => scan.ranges_m.fill(f32::INFINITY),
        2 => scan.ranges_m.fill(-5.0),
        3 => scan.ranges_m.fill(1e30),
        4 => scan.ranges_m.iter_mut().step_by(7).for_each(|range| *range = f32::NEG_INFINITY),
        5 => scan.ranges_m.clear(),
        6 if number == 3 => scan.ranges_m = vec![2.0; 1_000_000],
        7 => scan.ranges_m.truncate(number as usize % 180),
        8 => scan.angle_increment_rad = 0.0,
        9 => scan.angle_increment_rad = f32::NAN,
        10 => scan.angle_increment_rad = -scan.angle_increment_rad,
        11 => scan.angle_increment_rad = f32::MAX,
        12 => scan.angle_min_rad = f32::INFINITY,
        13 => (scan.range_max_m, scan.range_min_m) = (f32::NAN, f32::NAN),
        14 => (scan.range_max_m, scan.range_min_m) = (0.0, 1e9),
        15 => scan.time_increment_s = if third { f32::NAN } else { 1e30 },
        16 => scan.time_increment_s = -1.0,
        17 => scan.ranges_m.fill(0.0),
        _ => {}
    }
}

/// Where the robot is said to be.
fn odd_pose(kind: u64, number: i64, position_m: &mut [f64; 3], orientation_xyzw: &mut [f64; 4]) {
    let third = number % 3 == 0;
    match kind {
        18 => position_m[0] = f64::NAN,
        19 if third => position_m[1] = f64::INFINITY,
        20 if number == 11 => position_m[0] = 1e9,
        21 => position_m.iter_mut().for_each(|v| *v += 1e7),
        22 => position_m[0] += if third { 1e6 } else { -1e6 },
        23 => position_m[1] = 1e308 * (number as f64 - 10.0).signum(),
        24 => *orientation_xyzw = [0.0; 4],
        25 if third => *orientation_xyzw = [f64::NAN; 4],
        26 => *orientation_xyzw = [0.0, 0.0, 1e300, 1e300],
        27 => position_m[0] += 100.0 * number as f64,
        _ => {}
    }
}

/// When it is said to have been.
fn odd_stamp(kind: u64, number: i64, stamp_ns: i64) -> i64 {
    match kind {
        28 => 0,
        29 => -stamp_ns,
        30 => i64::MAX,
        31 => i64::MIN,
        32 => stamp_ns + number * YEAR_NS / 4,
        33 if number % 5 == 0 => stamp_ns - 20 * YEAR_NS,
        34 => 1_700_000_000_000_000_000,
        35 => 3_400_000_000_000_000_000 - stamp_ns,
        _ => stamp_ns,
    }
}

fn is_left_out(kind: u64, number: i64, topic: Topic) -> bool {
    match kind {
        36 => topic == Topic::ScanHorizontal && number > 0,
        37 => topic == Topic::Odom,
        38 => matches!(topic, Topic::Pose | Topic::PoseVertical) && number > 1,
        39 => matches!(topic, Topic::ScanHorizontal | Topic::ScanVertical) && number != 4,
        _ => false,
    }
}

/// Copies the recording with what these kinds make of it.
fn make_odd(from: &Path, to: &Path, kinds: &[u64]) {
    let options = WriterOptions { overwrite: true, in_order: false, ..WriterOptions::default() };
    let mut writer = Writer::create(to, &options).unwrap();
    let reader = Reader::open(from).unwrap();
    let rig = reader.rig().unwrap().unwrap();
    writer.attach("rig.toml", "application/toml", rig.to_toml().as_bytes()).unwrap();
    let mut numbers = std::collections::BTreeMap::new();
    for entry in reader.messages().map(Result::unwrap) {
        let Some(topic) = entry.topic else { continue };
        let number = numbers.entry(topic.name()).or_insert(-1);
        *number += 1;
        if *number > 30 || kinds.iter().any(|kind| is_left_out(*kind, *number, topic)) {
            continue;
        }
        let stamp_ns = kinds.iter().fold(entry.publish_time_ns, |at, kind| odd_stamp(*kind, *number, at));
        let log_ns = stamp_ns.max(0);
        let written = match entry.decode().unwrap() {
            AnyMessage::Scan(mut scan) => {
                kinds.iter().for_each(|kind| odd_scan(*kind, *number, &mut scan));
                writer.write(topic, log_ns, stamp_ns, &LaserScan { stamp_ns, ..scan })
            }
            AnyMessage::Pose(mut pose) => {
                kinds.iter().for_each(|kind| {
                    odd_pose(*kind, *number, &mut pose.position_m, &mut pose.orientation_xyzw);
                });
                writer.write(topic, log_ns, stamp_ns, &PoseWithCovarianceStamped { stamp_ns, ..pose })
            }
            AnyMessage::Odometry(mut odometry) => {
                kinds.iter().for_each(|kind| {
                    odd_pose(*kind, *number, &mut odometry.position_m, &mut odometry.orientation_xyzw);
                });
                writer.write(topic, log_ns, stamp_ns, &Odometry { stamp_ns, ..odometry })
            }
            _ => Ok(()),
        };
        written.unwrap();
    }
    writer.finish().unwrap();
}

/// Runs a command within bounds; what was wrong.
fn bounded(folder: &Folder, arguments: &str) -> Option<String> {
    let program = env!("CARGO_BIN_EXE_biplane");
    let command = format!("ulimit -v {MAX_KB}; exec timeout {LONGEST_S} {program} {arguments}");
    let output = Command::new("sh").args(["-c", &command]).current_dir(folder.path("")).output().unwrap();
    let reported = String::from_utf8_lossy(&output.stderr);
    let sensible = matches!(output.status.code(), Some(0 | 1 | 3)) && !reported.contains("panicked");
    let has_words = output.status.success() || !reported.trim().is_empty();
    let last: Vec<&str> = reported.lines().rev().take(6).collect();
    (!sensible || !has_words).then(|| format!("biplane {arguments}: {:?}: {last:#?}", output.status.code()))
}

fn seeds() -> std::ops::RangeInclusive<u64> {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    match (number("BIPLANE_SEED"), number("BIPLANE_SEEDS")) {
        (Some(seed), _) => seed..=seed,
        (None, many) => 1..=many.unwrap_or(FEW),
    }
}

#[test]
fn odd_recordings_give_a_result_or_a_sentence_in_every_command() {
    let folder = Folder::new("odd-recordings");
    record(&folder.path("room.mcap"), Content { poses: true, vertical: true });
    let mut wrong = Vec::new();
    for seed in seeds() {
        // The first seeds go through all oddities in pairs, later ones through other pairs.
        let first = 2 * (seed - 1) % ODDITIES;
        let second = (first + 1 + 7 * ((seed - 1) / FEW)) % ODDITIES;
        let kinds = [first, second];
        make_odd(&folder.path("room.mcap"), &folder.path("odd.mcap"), &kinds);
        for command in [
            "info odd.mcap",
            "traj odd.mcap -o odd.tum --force",
            "map odd.mcap -o odd --force",
            "build odd.mcap -o plain --no-optimize --force",
            "optimize odd.mcap -o opt.mcap --force",
            "build odd.mcap -o model --force",
            "evaluate trajectory room.mcap odd.mcap",
            "evaluate map odd.mcap",
            "render model -o model.png --force",
        ] {
            wrong.extend(
                bounded(&folder, command).map(|what| format!("BIPLANE_SEED={seed} {kinds:?}: {what}")),
            );
        }
    }
    assert!(wrong.is_empty(), "{} commands went wrong:\n{}", wrong.len(), wrong.join("\n"));
}
