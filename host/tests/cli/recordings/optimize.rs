//! `biplane optimize`: loops closed, recordings joined, everything else left as it was.

use std::fs;
use std::path::Path;

use biplane::loops::{Checkpoint, Corrected, Keyframes, LoopParams, Optimized, optimize};
use biplane::{Run, StampedPose};
use biplane_matcher::Pose2;
use biplane_recording::{AnyMessage, Reader, Topic, Writer, WriterOptions};
use serde_json::{Value, json};

use crate::ring::{Drive, pose_at, record};
use crate::run::Folder;

/// The poses that `traj` writes.
fn poses(folder: &Folder, name: &str) -> Vec<Pose2> {
    let text = folder.expect(&format!("traj {name} -o - --format xytheta"), 0, &[]).stdout;
    let pose = |line: &str| {
        let values: Vec<f64> = line.split(' ').map(|value| value.parse().unwrap()).collect();
        Pose2::new(values[1], values[2], values[3])
    };
    text.lines().map(pose).collect()
}

/// Root mean square of the positions' errors, meters; both begin at the same pose.
fn error_m(poses: &[Pose2], truth: &[Pose2]) -> f64 {
    assert_eq!(poses.len(), truth.len());
    let squared =
        |(pose, truth): (&Pose2, &Pose2)| (pose.x_m - truth.x_m).powi(2) + (pose.y_m - truth.y_m).powi(2);
    (poses.iter().zip(truth).map(squared).sum::<f64>() / poses.len() as f64).sqrt()
}

/// All messages of a topic, as bytes with their stamps.
fn messages(path: &Path, topic: Topic) -> Vec<(i64, Vec<u8>)> {
    let reader = Reader::open(path).unwrap();
    let entries = reader.messages().map(Result::unwrap).filter(|entry| entry.topic == Some(topic));
    entries.map(|entry| (entry.publish_time_ns, entry.bytes)).collect()
}

#[test]
fn two_rounds_that_drift_apart_come_together_and_all_else_stays() {
    let folder = Folder::new("optimize");
    let truth = record(&folder.path("run.mcap"), Drive::default());
    let before_m = error_m(&poses(&folder, "run.mcap"), &truth);
    folder.expect(
        "optimize run.mcap -o opt.mcap --threads 1",
        0,
        &["opt.mcap: ", " loops, ", " scans moved"],
    );
    let after_m = error_m(&poses(&folder, "opt.mcap"), &truth);
    assert!(before_m > 0.8 && after_m < 0.03, "{before_m} m before, {after_m} m after");
    for topic in [Topic::ScanHorizontal, Topic::Odom] {
        assert_eq!(messages(&folder.path("run.mcap"), topic), messages(&folder.path("opt.mcap"), topic));
    }
    let old = messages(&folder.path("run.mcap"), Topic::Pose);
    assert_eq!(old, messages(&folder.path("opt.mcap"), Topic::PoseIncremental));
    let rig = |name: &str| Reader::open(&folder.path(name)).unwrap().attachment("rig.toml").unwrap();
    assert_eq!(rig("run.mcap"), rig("opt.mcap"));
    frames_give_the_poses(&folder.path("opt.mcap"));
    assert_eq!(folder.names(), ["opt.mcap", "run.mcap"]);
    folder.expect("optimize run.mcap -o opt.mcap", 1, &["opt.mcap exists already", "--force"]);
    folder.expect("optimize run.mcap -o run.mcap --force", 1, &["run.mcap is read: name another output"]);
    // Once more: what it was at the very first stays.
    folder.expect("optimize opt.mcap -o again.mcap", 0, &[]);
    assert_eq!(old, messages(&folder.path("again.mcap"), Topic::PoseIncremental));
}

/// `map` -> `odom` -> `base_link` is `/pose`.
fn frames_give_the_poses(path: &Path) {
    let reader = Reader::open(path).unwrap();
    let mut frames = Vec::new();
    let mut poses = Vec::new();
    let planar = |at: [f64; 3], q: [f64; 4]| Pose2::new(at[0], at[1], 2.0 * q[2].atan2(q[3]));
    for entry in reader.messages().map(Result::unwrap) {
        match (entry.topic, entry.decode().unwrap()) {
            (Some(Topic::Pose), AnyMessage::Pose(pose)) => {
                poses.push(planar(pose.position_m, pose.orientation_xyzw));
            }
            (Some(Topic::Tf), AnyMessage::Tf(tf)) => {
                let [map, odom] = &tf.transforms[..] else { panic!("{tf:?}") };
                let [map, odom] = [map, odom].map(|frame| planar(frame.translation_m, frame.rotation_xyzw));
                frames.push(map * odom);
            }
            _ => {}
        }
    }
    assert_eq!(frames.len(), poses.len());
    assert!(error_m(&frames, &poses) < 1e-9);
}

#[test]
fn the_bytes_are_the_same_on_any_number_of_threads_and_after_a_stop() {
    let folder = Folder::new("optimize-same");
    record(&folder.path("run.mcap"), Drive { rounds: 1.4, ..Drive::default() });
    folder.expect("optimize run.mcap -o one.mcap --threads 1", 0, &[]);
    folder.expect("optimize run.mcap -o two.mcap --threads 2", 0, &[]);
    let one = fs::read(folder.path("one.mcap")).unwrap();
    assert!(one == fs::read(folder.path("two.mcap")).unwrap(), "one and two threads differ");
    // A stop leaves the searches done so far, the last one cut off: here none, then a line of another job.
    folder.write("three.mcap.loops", "another job\n[1,2,3]\n");
    folder.expect("optimize run.mcap -o three.mcap", 0, &[]);
    assert!(one == fs::read(folder.path("three.mcap")).unwrap(), "another job's searches were used");
    assert!(!folder.path("three.mcap.loops").exists());
}

#[test]
fn two_recordings_that_began_at_different_places_come_into_one_frame_and_a_stranger_stays_apart() {
    let folder = Folder::new("optimize-join");
    let drive = Drive { rounds: 1.2, ..Drive::default() };
    let mut truth = record(&folder.path("a.mcap"), drive);
    let other = record(&folder.path("b.mcap"), Drive { from_m: 31.0, seed: 2, ..drive });
    record(&folder.path("c.mcap"), Drive { elsewhere: true, rounds: 0.5, seed: 3, ..drive });
    let words = ["c.mcap saw no place that a.mcap saw; it stays apart, in opt.apart-3.mcap"];
    folder.expect("--quiet optimize a.mcap b.mcap c.mcap -o opt.mcap", 0, &words);
    assert_eq!(folder.names(), ["a.mcap", "b.mcap", "c.mcap", "opt.apart-3.mcap", "opt.mcap"]);
    // A model has no place for it: what it has seen is lost.
    folder.expect("build a.mcap b.mcap c.mcap -o model --no-report", 3, &["c.mcap saw no place", "left out"]);
    // The second one's truth in the first one's frame: it began half a ring away, on the long side opposite,
    // going back.
    let began = pose_at(0.0).between(&pose_at(31.0));
    truth.extend(other.iter().map(|pose| began * *pose));
    let found = poses(&folder, "opt.mcap");
    assert!(error_m(&found, &truth) < 0.08, "{} m", error_m(&found, &truth));
}

/// Scans, and the poses that the recording has for them, in file order.
fn scans_and_poses(path: &Path) -> (Vec<i64>, Vec<i64>) {
    let stamps = |topic| messages(path, topic).into_iter().map(|(stamp_ns, _)| stamp_ns).collect();
    (stamps(Topic::ScanHorizontal), stamps(Topic::Pose))
}

#[test]
fn recordings_that_overlap_in_time_follow_each_other_in_one_file_and_draw_the_map_of_both() {
    let folder = Folder::new("optimize-overlap");
    let drive = Drive { rounds: 0.9, ..Drive::default() };
    record(&folder.path("a.mcap"), drive);
    record(&folder.path("b.mcap"), Drive { from_m: 31.0, seed: 2, ..drive });
    // 390 scans, 0.2 s each: the last one is at 77.8 s.
    let words = ["b.mcap overlaps in time with a recording ahead of it in both.mcap: 80 s are added"];
    let ran = folder.expect("--quiet optimize a.mcap b.mcap -o both.mcap --json", 0, &words);
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    let added: Vec<_> = (0..2).map(|at| &report["recordings"][at]["added_s"]).collect();
    assert_eq!(added, [&json!(0), &json!(80)]);
    let metadata = Reader::open(&folder.path("both.mcap")).unwrap().metadata().unwrap();
    assert_eq!(metadata.iter().find(|(name, _)| *name == "optimize").unwrap().1["added_s"], "0, 80");

    let (scans, poses) = scans_and_poses(&folder.path("both.mcap"));
    let (alone, _) = scans_and_poses(&folder.path("b.mcap"));
    assert!(scans == poses && scans.is_sorted_by(|a, b| a < b), "{scans:?}");
    assert!(scans[alone.len()..].iter().zip(&alone).all(|(new, old)| new - old == 80_000_000_000));
    // What is inside of the messages agrees with their times.
    for entry in Reader::open(&folder.path("both.mcap")).unwrap().messages().map(Result::unwrap) {
        let stamp_ns = entry.decode().unwrap().stamp_ns().unwrap();
        assert_eq!(stamp_ns, entry.publish_time_ns, "{}", entry.topic_name);
    }
    frames_give_the_poses(&folder.path("both.mcap"));
    // Of scans that got each other's poses the walls are a cloud: the map is as sharp as that of one drive.
    let bits = |name: &str| {
        let ran = folder.expect(&format!("evaluate map {name} --json"), 0, &[]);
        serde_json::from_str::<Value>(&ran.stdout).unwrap()["total_bits"].as_f64().unwrap()
    };
    folder.expect("optimize a.mcap -o one.mcap", 0, &[]);
    assert!(bits("both.mcap") < 1.2 * bits("one.mcap"), "{} {}", bits("both.mcap"), bits("one.mcap"));
    // One by one in time already: nothing is changed.
    let ran = folder.expect("optimize both.mcap -o again.mcap", 0, &[]);
    assert!(!ran.stderr.contains("overlaps"), "{}", ran.stderr);
}

#[test]
fn of_a_file_whose_poses_step_back_in_time_all_that_look_poses_up_say_so() {
    let folder = Folder::new("optimize-step-back");
    let drive = Drive { rounds: 0.3, ..Drive::default() };
    for (name, seed) in [("a.mcap", 1), ("b.mcap", 2)] {
        record(&folder.path(name), Drive { seed, ..drive });
    }
    // As a version before this one joined them.
    let mut writer = Writer::create(&folder.path("both.mcap"), &WriterOptions::default()).unwrap();
    let first = Reader::open(&folder.path("a.mcap")).unwrap();
    writer.attach("rig.toml", "application/toml", &first.attachment("rig.toml").unwrap().unwrap()).unwrap();
    for name in ["a.mcap", "b.mcap"] {
        for entry in Reader::open(&folder.path(name)).unwrap().messages() {
            writer.copy(&entry.unwrap()).unwrap();
        }
    }
    writer.finish().unwrap();
    let words = ["both.mcap: the times of its poses step back by up to 26 s"];
    for command in ["map both.mcap -o floor", "build both.mcap -o model --no-optimize", "traj both.mcap -o -"]
    {
        folder.expect(&format!("--quiet {command}"), 0, &words);
    }
    folder.expect("calibrate both.mcap", 1, &["nothing can be determined", "step back by up to 26 s"]);
    let ran = folder.expect("map a.mcap -o alone", 0, &[]);
    assert!(!ran.stderr.contains("step back"), "{}", ran.stderr);
}

#[test]
fn the_order_in_which_recordings_are_named_changes_no_byte() {
    let folder = Folder::new("optimize-order");
    let drive = Drive { rounds: 0.9, ..Drive::default() };
    for (name, from_m, seed) in [("b", 0.0, 1), ("a", 31.0, 2), ("c", 12.0, 3)] {
        record(&folder.path(&format!("{name}.mcap")), Drive { from_m, seed, ..drive });
    }
    folder.expect("optimize a.mcap b.mcap c.mcap -o one.mcap", 0, &[]);
    let one = fs::read(folder.path("one.mcap")).unwrap();
    for names in ["c.mcap b.mcap a.mcap", "b.mcap c.mcap a.mcap"] {
        folder.expect(&format!("optimize {names} -o other.mcap --force"), 0, &[]);
        assert!(one == fs::read(folder.path("other.mcap")).unwrap(), "{names} differ from a b c");
    }
}

/// What `summary.json` says of the poses.
fn poses_reported(folder: &Folder, model: &str) -> (Value, Value) {
    let bytes = fs::read(folder.path(&format!("{model}/summary.json"))).unwrap();
    let summary: Value = serde_json::from_slice(&bytes).unwrap();
    (summary["poses_from"].clone(), summary["loops"].clone())
}

#[test]
fn a_model_is_made_with_loops_closed_unless_its_recording_has_none_or_it_is_not_wanted() {
    let folder = Folder::new("optimize-build");
    let truth = record(&folder.path("run.mcap"), Drive::default());
    let trajectory =
        |model: &str| fs::read_to_string(folder.path(&format!("{model}/trajectory.tum"))).unwrap();
    let recorded = |run: &str| folder.expect(&format!("traj {run} -o -"), 0, &[]).stdout;
    folder.expect("build run.mcap -o model", 0, &["loops closed, all poses optimized"]);
    let found = trajectory("model");
    let pose = |line: &str| {
        let values: Vec<f64> = line.split(' ').map(|value| value.parse().unwrap()).collect();
        Pose2::new(values[1], values[2], 2.0 * values[6].atan2(values[7]))
    };
    let poses: Vec<Pose2> = found.lines().map(pose).collect();
    assert!(error_m(&poses, &truth) < 0.03, "{} m", error_m(&poses, &truth));
    let (from, loops) = poses_reported(&folder, "model");
    assert!(from == "optimized" && loops.as_u64() > Some(0), "{from} {loops}");

    folder.expect("build run.mcap -o recorded --no-optimize", 0, &[]);
    assert_eq!(trajectory("recorded"), recorded("run.mcap"));
    assert_eq!(poses_reported(&folder, "recorded"), (json!("recorded"), Value::Null));

    folder.expect("optimize run.mcap -o opt.mcap", 0, &[]);
    folder.expect("build opt.mcap -o again", 0, &["the recording is optimized already: its poses stay"]);
    assert_eq!(trajectory("again"), found);
    assert_eq!(poses_reported(&folder, "again"), (json!("optimized_before"), Value::Null));

    record(&folder.path("part.mcap"), Drive { rounds: 0.3, ..Drive::default() });
    folder.expect("build part.mcap -o open", 0, &["no loop found: the poses stay as they were recorded"]);
    assert_eq!(trajectory("open"), recorded("part.mcap"));
    assert_eq!(poses_reported(&folder, "open"), (json!("recorded"), json!(0)));
}

#[test]
fn a_drive_without_loops_is_not_said_to_move() {
    let folder = Folder::new("optimize-none");
    record(&folder.path("part.mcap"), Drive { rounds: 0.3, ..Drive::default() });
    let words = ["opt.mcap: no loop found: the poses stay as they were recorded"];
    let ran = folder.expect("optimize part.mcap -o opt.mcap --json", 0, &words);
    assert!(!ran.stderr.contains("moved"), "{}", ran.stderr);
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(report["recordings"][0]["moved"], json!(false));
    let way = |name: &str| folder.expect(&format!("traj {name} -o -"), 0, &[]).stdout;
    assert_eq!(way("part.mcap"), way("opt.mcap"));
}

#[test]
fn of_recordings_that_do_not_join_the_longest_way_is_kept_and_its_loops_alone_count() {
    let folder = Folder::new("optimize-apart");
    // The one that begins first, and the shorter one, has the loops of none.
    let drive = Drive { elsewhere: true, rounds: 0.4, seed: 3, ..Drive::default() };
    record(&folder.path("a.mcap"), drive);
    record(&folder.path("b.mcap"), Drive::default());
    let words = ["a.mcap saw no place that b.mcap saw", "opt.apart-1.mcap", "opt.mcap: ", " loops, "];
    folder.expect("optimize a.mcap b.mcap -o opt.mcap", 0, &words);
    let loops_of = |name: &str| {
        let metadata = Reader::open(&folder.path(name)).unwrap().metadata().unwrap();
        let optimize = &metadata.iter().find(|(name, _)| *name == "optimize").unwrap().1;
        (optimize["recordings"].clone(), optimize["loops"].parse::<usize>().unwrap())
    };
    assert_eq!(loops_of("opt.apart-1.mcap"), ("a.mcap".to_owned(), 0));
    let (recordings, loops) = loops_of("opt.mcap");
    assert!(recordings == "b.mcap" && loops > 0, "{recordings} {loops}");
    let words = ["a.mcap saw no place that b.mcap saw; it is left out", "loops closed"];
    folder.expect("build a.mcap b.mcap -o model --no-report", 3, &words);
    let bytes = fs::read(folder.path("model/summary.json")).unwrap();
    let summary: Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(summary["recordings"], json!(["b.mcap"]));
    assert_eq!(summary["recordings_left_out"], json!(["a.mcap"]));
    // The other way round: the long one has no loop, and those of the short one are not its own.
    record(&folder.path("long.mcap"), Drive { rounds: 0.8, ..drive });
    record(&folder.path("short.mcap"), Drive { rounds: 0.3, ..Drive::default() });
    folder.expect("build long.mcap short.mcap -o other --no-report", 3, &["no loop found: the poses stay"]);
    assert_eq!(poses_reported(&folder, "other"), (json!("recorded"), json!(0)));
}

/// The nodes of a recording, and its loops as far as `path` has them.
fn closed(keyframes: &Keyframes, path: &Path) -> Optimized {
    let mut checkpoint = Checkpoint::open(path, "false loops").unwrap();
    optimize(std::slice::from_ref(keyframes), &LoopParams::default(), &mut checkpoint, &mut |_| ())
}

/// Every third loop among the answers that a search has left is moved by two meters and half a radian.
/// Returns how many.
fn make_false(path: &Path) -> usize {
    let mut loops = 0;
    let text = fs::read_to_string(path).unwrap();
    let moved = |line: &str| {
        let Ok(mut numbers) = serde_json::from_str::<Vec<u64>>(line) else { return line.to_owned() };
        // A question has eight numbers; an answer that is a loop begins with its pose.
        let [x, y, turn, ..] = &mut numbers[8..] else { return line.to_owned() };
        loops += 1;
        if loops % 3 == 0 {
            for (value, by) in [(x, 2.0), (y, -2.0), (turn, 0.5)] {
                *value = (f64::from_bits(*value) + by).to_bits();
            }
        }
        serde_json::to_string(&numbers).unwrap()
    };
    let lines: Vec<String> = text.lines().map(moved).collect();
    fs::write(path, lines.join("\n") + "\n").unwrap();
    loops / 3
}

#[test]
fn a_third_of_the_loops_made_false_changes_nothing() {
    let folder = Folder::new("optimize-spoilt");
    let truth = record(&folder.path("run.mcap"), Drive::default());
    let run = Run::open(&[folder.path("run.mcap")]).unwrap();
    let keyframes = Keyframes::read(&run, &run.poses().unwrap(), &LoopParams::default().keyframes).unwrap();
    let path = folder.path("loops");
    let clean = closed(&keyframes, &path);
    assert!(make_false(&path) > 3 && clean.counts.loops > 10, "{:?}", clean.counts);
    let spoiled = closed(&keyframes, &path);
    let [clean_m, spoiled_m] = [clean, spoiled].map(|found| {
        let corrected = Corrected::new(&keyframes, &found.poses[0], &found.breaks[0]);
        let poses: Vec<Pose2> = corrected.scans.iter().flatten().map(StampedPose::pose).collect();
        error_m(&poses, &truth)
    });
    assert!(spoiled_m < 1.1 * clean_m + 0.002, "{spoiled_m} m with false loops, {clean_m} m without");
}
