//! Replays of small files: what goes in must come out, what is wrong must be told, nothing may be
//! overwritten.

use std::fs;

use biplane_recording::messages::{LaserScan, Message, PoseWithCovarianceStamped};
use biplane_recording::{Direction, Port, Reader, Topic, WriteError, Writer};

use super::*;
use crate::engine::synthetic;

/// A folder of its own for one test, removed when it ends well.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("biplane-replay-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn write_capture(path: &Path, seconds: i64, with_rig: bool) {
    let mut writer = Writer::create(path, &WriterOptions::default()).unwrap();
    if with_rig {
        let rig = synthetic::rig().to_toml();
        writer.attach("rig.toml", "application/toml", rig.as_bytes()).unwrap();
    }
    for read in synthetic::drive(seconds, 60) {
        writer.write_serial(read.port, Direction::Rx, read.time_ns, &read.bytes).unwrap();
    }
    writer.finish().unwrap();
}

fn options(input: PathBuf, output: PathBuf) -> ReplayOptions {
    ReplayOptions::new(input, output)
}

fn run(options: &ReplayOptions) -> Result<RunReport, OnboardError> {
    replay(options, &AtomicBool::new(false))
}

fn messages(path: &Path, topic: Topic) -> Vec<Vec<u8>> {
    let reader = Reader::open(path).unwrap();
    let entries = reader.messages().map(Result::unwrap);
    entries.filter(|entry| entry.topic == Some(topic)).map(|entry| entry.bytes).collect()
}

#[test]
fn a_capture_replayed_twice_gives_the_same_bytes_and_keeps_every_telegram() {
    let folder = Folder::new("twice");
    write_capture(&folder.file("capture.mcap"), 3, true);
    let first = run(&options(folder.file("capture.mcap"), folder.file("first.mcap"))).unwrap();
    let second = run(&options(folder.file("capture.mcap"), folder.file("second.mcap"))).unwrap();
    assert_eq!(
        (
            first.recorded.scans_horizontal,
            first.recorded.scans_vertical,
            first.recorded.odometry,
            first.losses.lost
        ),
        (28, 28, 30, 0)
    );
    assert_eq!((first.recorded.poses, first.recorded.poses_vertical, first.exit_code()), (28, 28, 0));
    let unnamed = |report| RunReport { output: PathBuf::new(), parts: Vec::new(), ..report };
    assert_eq!(unnamed(first), unnamed(second));
    assert!(fs::read(folder.file("first.mcap")).unwrap() == fs::read(folder.file("second.mcap")).unwrap());
    let reader = Reader::open(&folder.file("first.mcap")).unwrap();
    assert_eq!(reader.rig().unwrap(), Some(synthetic::rig()));
    let words = &reader.metadata().unwrap()["biplane"];
    assert!(words.contains_key("start_time") && !words.contains_key("rig"), "{words:?}");
}

#[test]
fn a_recording_replayed_keeps_its_scans_and_odometry_and_finds_its_poses_again() {
    let folder = Folder::new("again");
    let (first, second) = (folder.file("first.mcap"), folder.file("second.mcap"));
    write_capture(&folder.file("capture.mcap"), 3, true);
    run(&options(folder.file("capture.mcap"), first.clone())).unwrap();
    let report = run(&options(first.clone(), second.clone())).unwrap();
    assert_eq!((report.recorded.poses, report.recorded.poses_vertical, report.losses.lost), (28, 28, 0));
    for topic in [Topic::ScanHorizontal, Topic::ScanVertical, Topic::Odom] {
        assert!(messages(&first, topic) == messages(&second, topic), "{topic:?}");
    }
    let poses = |path: &Path, topic| -> Vec<PoseWithCovarianceStamped> {
        messages(path, topic).iter().map(|bytes| Message::decode(bytes).unwrap()).collect()
    };
    for topic in [Topic::Pose, Topic::PoseVertical] {
        for (first, second) in poses(&first, topic).iter().zip(&poses(&second, topic)) {
            assert_eq!(first.stamp_ns, second.stamp_ns);
            let moved_m = (first.position_m[0] - second.position_m[0])
                .hypot(first.position_m[1] - second.position_m[1]);
            assert!(moved_m < 0.002, "{topic:?}: {moved_m} m");
        }
    }
}

/// The same drive, written by a computer whose clock was set back by an hour after 3 s, and ahead by ten
/// minutes after 6 s.
fn write_stepped_capture(path: &Path, seconds: i64) {
    let mut writer =
        Writer::create(path, &WriterOptions { in_order: false, ..WriterOptions::default() }).unwrap();
    writer.attach("rig.toml", "application/toml", synthetic::rig().to_toml().as_bytes()).unwrap();
    let reads = synthetic::drive(seconds, 60);
    let (second_ns, start_ns) = (1_000_000_000, reads[0].time_ns);
    for read in reads {
        let step_s = match (read.time_ns - start_ns) / second_ns {
            ..3 => 0,
            3..6 => -3600,
            _ => -3000,
        };
        let time_ns = read.time_ns + step_s * second_ns;
        writer.write_serial(read.port, Direction::Rx, time_ns, &read.bytes).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_capture_whose_clock_was_set_loses_nothing_and_its_matcher_goes_on() {
    let folder = Folder::new("stepped");
    write_capture(&folder.file("steady.mcap"), 9, true);
    write_stepped_capture(&folder.file("stepped.mcap"), 9);
    let steady = run(&options(folder.file("steady.mcap"), folder.file("steady-run.mcap"))).unwrap();
    let stepped = run(&options(folder.file("stepped.mcap"), folder.file("run.mcap"))).unwrap();
    assert_eq!((steady.arrival.clock_steps, stepped.arrival.clock_steps), (0, 1));
    let counts =
        |report: &RunReport| (report.recorded.clone(), report.losses.lost, report.arrival.backward_stamps);
    assert_eq!(counts(&stepped), counts(&steady));
    assert_eq!((stepped.recorded.unmatched, stepped.exit_code()), (0, 0));
    let last = |name: &str| -> PoseWithCovarianceStamped {
        Message::decode(messages(&folder.file(name), Topic::Pose).last().unwrap()).unwrap()
    };
    let (steady, stepped) = (last("steady-run.mcap"), last("run.mcap"));
    assert!((steady.position_m[0] - stepped.position_m[0]).abs() < 0.02, "{steady:?} {stepped:?}");
    // The hour back is left out of the run's time, the ten minutes ahead are not.
    let later_s = (stepped.stamp_ns - steady.stamp_ns) as f64 * 1e-9;
    assert!((later_s - 600.0).abs() < 0.1, "{later_s} s");
}

#[test]
fn what_is_wrong_with_the_input_is_one_sentence_that_names_it_and_leaves_no_output() {
    let folder = Folder::new("wrong");
    write_capture(&folder.file("whole.mcap"), 1, true);
    write_capture(&folder.file("no-rig.mcap"), 1, false);
    let whole = fs::read(folder.file("whole.mcap")).unwrap();
    fs::write(folder.file("cut.mcap"), &whole[..whole.len() / 2]).unwrap();
    fs::write(folder.file("text.mcap"), "not an MCAP file").unwrap();
    Writer::create(&folder.file("empty.mcap"), &WriterOptions::default()).unwrap().finish().unwrap();
    let table = [
        ("missing.mcap", "does not exist"),
        ("cut.mcap", "biplane recover"),
        ("text.mcap", "is not an MCAP file"),
        ("no-rig.mcap", "--rig"),
    ];
    for (name, part) in table {
        let error = run(&options(folder.file(name), folder.file("out.mcap"))).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains(name) && !error.contains('\n'), "{error}");
    }
    let mut without_rig = options(folder.file("empty.mcap"), folder.file("out.mcap"));
    without_rig.rig = Some(synthetic::rig());
    let error = run(&without_rig).unwrap_err().to_string();
    assert!(error.contains("nothing to replay"), "{error}");
    assert!(!folder.file("out.mcap").exists() && !folder.file("out.mcap.active").exists());
}

#[test]
fn an_output_that_exists_is_kept_unless_told_otherwise() {
    let folder = Folder::new("kept");
    let (input, output) = (folder.file("capture.mcap"), folder.file("out.mcap"));
    write_capture(&input, 1, true);
    fs::write(&output, "precious").unwrap();
    let refused = run(&options(input.clone(), output.clone())).unwrap_err().to_string();
    assert!(refused.contains("out.mcap") && refused.contains("exists"), "{refused}");
    assert_eq!(fs::read_to_string(&output).unwrap(), "precious");
    run(&ReplayOptions { overwrite: true, ..options(input.clone(), output.clone()) }).unwrap();
    assert!(Reader::open(&output).is_ok());
    let itself = ReplayOptions { overwrite: true, ..options(input.clone(), input.clone()) };
    assert!(matches!(run(&itself), Err(OnboardError::Write(WriteError::IsInput { .. }))));
    assert!(Reader::open(&input).is_ok());
}

#[test]
fn an_input_named_as_the_unfinished_output_survives() {
    let folder = Folder::new("active");
    write_capture(&folder.file("capture.mcap"), 1, true);
    let input = folder.file("run.mcap.active");
    fs::rename(folder.file("capture.mcap"), &input).unwrap();
    let before = fs::read(&input).unwrap();
    let forced = ReplayOptions { overwrite: true, ..options(input.clone(), folder.file("run.mcap")) };
    let error = run(&forced).unwrap_err();
    assert!(matches!(error, OnboardError::Write(WriteError::IsInput { .. })), "{error}");
    assert!(fs::read(&input).unwrap() == before && !folder.file("run.mcap").exists());
}

#[test]
fn a_replay_without_a_pose_fails_and_keeps_what_there_was() {
    let folder = Folder::new("no-pose");
    let (input, output) = (folder.file("capture.mcap"), folder.file("out.mcap"));
    let mut writer = Writer::create(&input, &WriterOptions::default()).unwrap();
    writer.attach("rig.toml", "application/toml", synthetic::rig().to_toml().as_bytes()).unwrap();
    for read in synthetic::drive(1, 60).into_iter().filter(|read| read.port != Port::Horizontal) {
        writer.write_serial(read.port, Direction::Rx, read.time_ns, &read.bytes).unwrap();
    }
    writer.finish().unwrap();
    let error = run(&options(input, output.clone())).unwrap_err();
    assert!(matches!(error, OnboardError::NoPoses { .. }), "{error}");
    assert!(!messages(&output, Topic::ScanVertical).is_empty());
}

#[test]
fn a_message_that_is_none_is_named_with_its_file_and_nothing_stays_behind() {
    let folder = Folder::new("undecodable");
    let input = folder.file("capture.mcap");
    let mut writer = Writer::create(&input, &WriterOptions::default()).unwrap();
    writer.attach("rig.toml", "application/toml", synthetic::rig().to_toml().as_bytes()).unwrap();
    writer.write_encoded(Topic::ScanHorizontal, 7, 7, &[0, 1, 0, 0, 9]).unwrap();
    writer.finish().unwrap();
    let error = run(&options(input, folder.file("out.mcap"))).unwrap_err().to_string();
    assert!(error.contains("capture.mcap: message on /scan"), "{error}");
    assert!(!folder.file("out.mcap").exists() && !folder.file("out.mcap.active").exists());
}

#[test]
fn vertical_data_without_a_vertical_laser_in_the_rig_is_left_out_and_counted() {
    let folder = Folder::new("no-vertical");
    let (capture, whole) = (folder.file("capture.mcap"), folder.file("whole.mcap"));
    write_capture(&capture, 1, true);
    let scans = run(&options(capture.clone(), whole.clone())).unwrap().recorded.scans_vertical;
    let rig = Some(Rig { vertical: None, ..synthetic::rig() });
    let decoded = run(&ReplayOptions { rig: rig.clone(), ..options(whole, folder.file("a.mcap")) }).unwrap();
    assert_eq!(
        (decoded.losses.scans_without_laser, decoded.losses.lost, decoded.exit_code()),
        (scans, scans, 3)
    );
    assert_eq!((decoded.recorded.scans_vertical, decoded.recorded.poses_vertical), (0, 0));
    assert!(messages(&folder.file("a.mcap"), Topic::ScanVertical).is_empty());
    let serial = run(&ReplayOptions { rig, ..options(capture, folder.file("b.mcap")) }).unwrap();
    assert_eq!((serial.losses.not_understood, serial.exit_code()), (0, 3));
    assert!(serial.losses.reads_without_laser > 0 && serial.losses.reads_without_laser == serial.losses.lost);
}

#[test]
fn what_of_a_rig_is_assumed_is_kept_with_it_and_goes_where_another_is_given() {
    let folder = Folder::new("assumed");
    let path = folder.file("capture.mcap");
    let mut writer = Writer::create(&path, &WriterOptions::default()).unwrap();
    writer.attach("rig.toml", "application/toml", synthetic::rig().to_toml().as_bytes()).unwrap();
    writer.metadata("biplane", &[("rig".to_owned(), "all assumed".to_owned())].into()).unwrap();
    for read in synthetic::drive(1, 60) {
        writer.write_serial(read.port, Direction::Rx, read.time_ns, &read.bytes).unwrap();
    }
    writer.finish().unwrap();
    let assumed = |rig, name: &str| {
        run(&ReplayOptions { rig, ..options(path.clone(), folder.file(name)) }).unwrap();
        let mut metadata = Reader::open(&folder.file(name)).unwrap().metadata().unwrap();
        metadata.get_mut("biplane").unwrap().remove("rig")
    };
    assert_eq!(assumed(None, "kept.mcap").as_deref(), Some("all assumed"));
    assert_eq!(assumed(Some(synthetic::rig()), "given.mcap"), None);
}

#[test]
fn a_rig_given_replaces_the_inputs_own() {
    let folder = Folder::new("rig");
    write_capture(&folder.file("capture.mcap"), 1, false);
    let mut rig = synthetic::rig();
    rig.horizontal.delay_ms = 5.0;
    let mut late = options(folder.file("capture.mcap"), folder.file("late.mcap"));
    late.rig = Some(rig);
    run(&late).unwrap();
    let mut prompt = options(folder.file("capture.mcap"), folder.file("prompt.mcap"));
    prompt.rig = Some(synthetic::rig());
    run(&prompt).unwrap();
    let first = |path: &Path| LaserScan::decode(&messages(path, Topic::ScanHorizontal)[0]).unwrap().stamp_ns;
    assert_eq!(first(&folder.file("prompt.mcap")) - first(&folder.file("late.mcap")), 5_000_000);
}

#[test]
fn at_a_given_speed_a_replay_takes_its_time() {
    let folder = Folder::new("speed");
    write_capture(&folder.file("capture.mcap"), 2, true);
    let before_ns = biplane_clock::monotonic_ns();
    let mut slow = options(folder.file("capture.mcap"), folder.file("out.mcap"));
    slow.speed = Speed::Times(10.0);
    run(&slow).unwrap();
    assert!(biplane_clock::monotonic_ns() - before_ns > 180_000_000);
    for (text, speed) in
        [("max", Ok(Speed::Max)), ("2.5", Ok(Speed::Times(2.5))), ("0", Err(())), ("fast", Err(()))]
    {
        assert_eq!(text.parse::<Speed>().map_err(|_| ()), speed);
    }
}

#[test]
fn a_stop_ends_the_replay_with_a_whole_file() {
    let folder = Folder::new("stop");
    write_capture(&folder.file("capture.mcap"), 1, true);
    let options = options(folder.file("capture.mcap"), folder.file("out.mcap"));
    let report = replay(&options, &AtomicBool::new(true)).unwrap();
    assert_eq!((report.recorded.scans_horizontal, report.recorded.poses), (0, 0));
    assert_eq!((report.end, report.exit_code()), (RunEnd::Interrupted, 3));
    assert!(Reader::open(&folder.file("out.mcap")).is_ok());
}

#[test]
fn a_replay_into_parts_and_out_of_parts_has_the_poses_of_the_whole() {
    let folder = Folder::new("parts");
    write_capture(&folder.file("capture.mcap"), 4, true);
    let rotation = Rotation { span_ns: Some(900_000_000), bytes: None };
    let whole = run(&options(folder.file("capture.mcap"), folder.file("whole.mcap"))).unwrap();
    let in_parts = options(folder.file("capture.mcap"), folder.file("run.mcap"));
    let parted = run(&ReplayOptions { rotation, ..in_parts }).unwrap();
    assert_eq!((parted.parts.len(), parted.recorded.poses, parted.losses.lost), (5, whole.recorded.poses, 0));
    assert_eq!(parted.output, folder.file("run_0.mcap"));
    let poses = |paths: &[PathBuf]| -> Vec<Vec<u8>> {
        let entries = Recording::open(paths).unwrap();
        let entries = entries.messages().map(Result::unwrap);
        entries.filter(|entry| entry.topic == Some(Topic::Pose)).map(|entry| entry.bytes).collect()
    };
    assert!(poses(&parted.parts) == poses(&[folder.file("whole.mcap")]));
    // Out of parts: the scans and odometry of all of them, under the name of the whole.
    let again = run(&options(folder.file("whole.mcap"), folder.file("again.mcap"))).unwrap();
    let joined = run(&options(folder.file("run.mcap"), folder.file("joined.mcap"))).unwrap();
    assert_eq!(
        (joined.recorded.scans_horizontal, joined.recorded.odometry),
        (again.recorded.scans_horizontal, again.recorded.odometry)
    );
    assert!(poses(&[folder.file("joined.mcap")]) == poses(&[folder.file("again.mcap")]));
}

#[test]
fn the_journal_has_the_iterations_of_every_match_and_changes_no_pose() {
    let folder = Folder::new("journal");
    write_capture(&folder.file("capture.mcap"), 3, true);
    run(&options(folder.file("capture.mcap"), folder.file("plain.mcap"))).unwrap();
    let journal = folder.file("journal.csv");
    let with_journal = ReplayOptions {
        journal: Some(journal.clone()),
        ..options(folder.file("capture.mcap"), folder.file("kept.mcap"))
    };
    run(&with_journal).unwrap();
    assert!(
        messages(&folder.file("plain.mcap"), Topic::Pose) == messages(&folder.file("kept.mcap"), Topic::Pose)
    );
    let text = fs::read_to_string(journal).unwrap();
    let begun: Vec<&str> = text.lines().filter(|line| line.split(',').nth(1) == Some("0")).collect();
    let scans = messages(&folder.file("plain.mcap"), Topic::ScanHorizontal);
    for bytes in &scans[1..] {
        let stamp_us = LaserScan::decode(bytes).unwrap().stamp_ns / 1000;
        let stamp = format!("{}.{:06},", stamp_us / 1_000_000, stamp_us % 1_000_000);
        assert!(begun.iter().any(|line| line.starts_with(&stamp)), "{stamp}");
    }
}
