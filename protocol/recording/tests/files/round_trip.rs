//! What is written is read back, in order, by our reader and by the `mcap` crate's.

use crate::folder::Folder;
use crate::samples::{STEP_NS, odometry, scan, write_run};
use biplane_recording::{AnyMessage, Entry, Reader, Rig, Topic, Writer, WriterOptions};
use std::path::Path;

fn read(path: &Path) -> Vec<Entry> {
    Reader::open(path).unwrap().messages().collect::<Result<_, _>>().unwrap()
}

#[test]
fn a_run_comes_back_message_by_message() {
    let folder = Folder::new("round-trip");
    let path = folder.file("run.mcap");
    let report = write_run(&path, 100, &WriterOptions::default()).unwrap().finish().unwrap();
    assert_eq!(folder.names(), ["run.mcap"]);
    assert_eq!(report.bytes, std::fs::metadata(&path).unwrap().len());
    let entries = read(&path);
    assert_eq!(entries.len() as u64, report.messages);
    let scans: Vec<&Entry> =
        entries.iter().filter(|entry| entry.topic == Some(Topic::ScanHorizontal)).collect();
    assert_eq!(scans.len(), 100);
    for (number, entry) in (0u32..).zip(&scans) {
        let expected = scan(number, "laser_horizontal");
        assert_eq!(entry.publish_time_ns, expected.stamp_ns);
        assert_eq!(entry.log_time_ns, expected.stamp_ns + 20_000_000);
        assert_eq!(entry.sequence, number);
        assert_eq!(entry.decode().unwrap(), AnyMessage::Scan(expected));
    }
    let reader = Reader::open(&path).unwrap();
    assert_eq!(reader.rig().unwrap(), Some(Rig::default()));
    assert_eq!(reader.metadata().unwrap()["run"]["biplane"], "test");
    assert_eq!(reader.attachment("none").unwrap(), None);
    assert_eq!(reader.profile(), "ros2");
}

#[test]
fn log_time_never_decreases_and_publish_time_is_kept() {
    let folder = Folder::new("log-time");
    let path = folder.file("run.mcap");
    let mut writer = Writer::create(&path, &WriterOptions::default()).unwrap();
    let times = [(5, 50), (3, 30), (9, 10), (-4, -7), (9, 90)];
    for (log, publish) in times {
        writer.write(Topic::Odom, log, publish, &odometry(0)).unwrap();
    }
    writer.finish().unwrap();
    let found: Vec<(i64, i64)> =
        read(&path).iter().map(|entry| (entry.log_time_ns, entry.publish_time_ns)).collect();
    assert_eq!(found, [(5, 50), (5, 30), (9, 10), (9, 0), (9, 90)]);
}

#[test]
fn the_same_calls_give_the_same_bytes() {
    let folder = Folder::new("same-bytes");
    let bytes = |name: &str| {
        let path = folder.file(name);
        write_run(&path, 60, &WriterOptions::default()).unwrap().finish().unwrap();
        std::fs::read(path).unwrap()
    };
    assert_eq!(bytes("a.mcap"), bytes("b.mcap"));
}

#[test]
fn a_chunk_spans_less_than_a_second() {
    let folder = Folder::new("chunks");
    let path = folder.file("run.mcap");
    let steps = 200;
    let report = write_run(&path, steps, &WriterOptions::default()).unwrap().finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    for index in &summary.chunk_indexes {
        assert!(index.message_end_time - index.message_start_time < 1_000_000_000);
        assert_eq!(index.compression, "zstd");
    }
    let seconds = i64::from(steps) * STEP_NS / 1_000_000_000;
    assert!(report.chunks >= seconds as u64, "{report:?}");
    assert_eq!(summary.stats.unwrap().message_count, report.messages);
}
