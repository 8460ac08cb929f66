//! Files of other programs: CARMEN logs, bags, trajectories, relations.

use biplane::evaluate::{RelationsParams, read_relations, relation_errors, relations_report};
use biplane::files::{BagOptions, import_bag, import_carmen};
use biplane::files::{TrajectoryFormat, read_poses, write_poses};
use biplane_recording::{Reader, Topic, WriterOptions};

use crate::inputs::making::memory_file::{MemoryFile, Scratch};

/// A log with a scan becomes a recording that reads whole, with as many scans and odometry messages as the
/// report says.
pub(super) fn carmen(input: &[u8]) {
    let (log, recording) = (MemoryFile::of(input), Scratch::new());
    let options = WriterOptions { overwrite: true, ..WriterOptions::default() };
    let Ok(report) = import_carmen(&log.path(), &recording.0, &options) else { return };
    let entries: Vec<_> = Reader::open(&recording.0)
        .expect("a whole file")
        .messages()
        .map(|entry| entry.expect("a whole file").topic_name)
        .collect();
    let count = |topic: Topic| entries.iter().filter(|name| **name == topic.name()).count();
    assert_eq!(count(Topic::ScanHorizontal), report.scans);
    assert_eq!(count(Topic::Odom), report.odometry);
}

/// A bag with a scan becomes a recording that reads whole, with as many messages as the report says.
pub(super) fn bag(input: &[u8]) {
    let (bag, recording) = (MemoryFile::of(input), Scratch::new());
    let mut options = BagOptions::default();
    options.writer.overwrite = true;
    let Ok(report) = import_bag(&[bag.path()], &recording.0, &options) else { return };
    let mut counts = [0; 4];
    for entry in Reader::open(&recording.0).expect("a whole file").messages() {
        let entry = entry.expect("a whole file");
        let topics = [Topic::ScanHorizontal, Topic::ScanVertical, Topic::Odom, Topic::Imu];
        if let Some(place) = topics.iter().position(|topic| topic.name() == entry.topic_name) {
            counts[place] += 1;
            entry.decode().expect("what is written decodes");
        }
    }
    assert_eq!(counts, [report.scans[0], report.scans[1], report.odometry, report.imu]);
}

/// Poses are written and read back: stamps to the nanosecond, places to the micrometer.
pub(super) fn poses(input: &[u8]) {
    let Ok(poses) = read_poses(input) else { return };
    for format in [TrajectoryFormat::Tum, TrajectoryFormat::XyTheta] {
        let mut text = Vec::new();
        write_poses(&mut text, &poses, format).expect("memory takes it");
        let again = read_poses(text.as_slice()).expect("what is written reads");
        assert_eq!(again.len(), poses.len());
        for (a, b) in again.iter().zip(&poses) {
            assert_eq!(a.stamp_ns, b.stamp_ns);
            assert!((a.x_m - b.x_m).abs() < 1e-6 && (a.y_m - b.y_m).abs() < 1e-6, "{a:?} {b:?}");
        }
    }
}

/// Relations that read can be held against poses, those of a robot that stands still among them.
pub(super) fn relations(input: &[u8]) {
    let Ok(relations) = read_relations(input) else { return };
    let poses = read_poses(&b"0 0 0 0\n1 1 0 0\n2 1e6 -1e6 3\n"[..]).expect("three poses");
    let (errors, found) = relation_errors(&relations, &poses, &RelationsParams::default());
    assert!(errors.len() <= relations.len());
    let _ = relations_report(&errors, found);
}
