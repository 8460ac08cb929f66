//! Files that others wrote: packed otherwise or not at all, without index, with topics and encodings that we
//! do not know.

use crate::folder::Folder;
use biplane_recording::capture::serial;
use biplane_recording::recover;
use biplane_recording::{AnyMessage, Direction, Entry, Port, Reader, Topic, Writer, WriterOptions};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::path::Path;

const COUNT: u32 = 300;

/// A bag as another program would write it: two foreign topics, and `/odom` of another type than ours.
fn write_foreign(path: &Path, options: WriteOptions) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut writer = options.profile("other").create(file).unwrap();
    let schema = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n").unwrap();
    let words = BTreeMap::from([("who".to_owned(), "somebody".to_owned())]);
    let chatter = writer.add_channel(schema, "/chatter", "cdr", &words).unwrap();
    let odom = writer.add_channel(schema, "/odom", "cdr", &words).unwrap();
    let raw = writer.add_channel(0, "/raw", "json", &BTreeMap::new()).unwrap();
    for number in 0..COUNT {
        let channel_id = [chatter, odom, raw][number as usize % 3];
        // Log times go back now and then, as they do in bags of several publishers.
        let log_time = u64::from(number) * 10_000_000 - u64::from(number % 5) * 3_000_000 + 20_000_000;
        let header = MessageHeader { channel_id, sequence: number + 7, log_time, publish_time: log_time + 1 };
        writer.write_to_known_channel(&header, format!("{{\"number\": {number}}}").as_bytes()).unwrap();
    }
    writer.finish().unwrap();
}

fn entries(path: &Path) -> Vec<Entry> {
    Reader::open(path).unwrap().messages().collect::<Result<_, _>>().unwrap()
}

fn kinds() -> Vec<(&'static str, WriteOptions)> {
    let plain = WriteOptions::new().chunk_size(Some(1000)).compression_threads(0);
    vec![
        ("zstd", plain.clone().compression(Some(Compression::Zstd))),
        ("lz4", plain.clone().compression(Some(Compression::Lz4))),
        ("unpacked", plain.clone().compression(None)),
        ("unchunked", plain.clone().use_chunks(false)),
        (
            "no-index",
            plain.clone().emit_summary_records(false).emit_message_indexes(false).emit_summary_offsets(false),
        ),
        ("no-sums", plain.calculate_chunk_crcs(false).calculate_data_section_crc(false)),
    ]
}

#[test]
fn every_way_of_packing_is_read() {
    let folder = Folder::new("packing");
    for (name, options) in kinds() {
        let path = folder.file(name);
        write_foreign(&path, options);
        let entries = entries(&path);
        assert_eq!(entries.len(), COUNT as usize, "{name}");
        for (number, entry) in (0..COUNT).zip(&entries) {
            assert_eq!(entry.topic_name, ["/chatter", "/odom", "/raw"][number as usize % 3]);
            assert_eq!(
                entry.type_name,
                ["std_msgs/msg/String", "std_msgs/msg/String", ""][number as usize % 3]
            );
            // A name of ours with another type is not ours.
            assert_eq!(entry.topic, None);
            assert_eq!(entry.sequence, number + 7);
            assert_eq!(entry.publish_time_ns, entry.log_time_ns + 1);
            assert_eq!(entry.bytes, format!("{{\"number\": {number}}}").as_bytes());
            assert_eq!(entry.decode().unwrap(), AnyMessage::Other);
        }
        assert_eq!(Reader::open(&path).unwrap().profile(), "other");
    }
}

#[test]
fn foreign_messages_are_salvaged_exactly() {
    let folder = Folder::new("exactly");
    for (name, options) in kinds() {
        let path = folder.file(name);
        write_foreign(&path, options);
        let saved = folder.file(&format!("{name}.saved"));
        let report = recover(&path, &saved).unwrap();
        assert_eq!(report.exit_code(), 0, "{name}: {report}");
        let (before, after) = (entries(&path), entries(&saved));
        assert_eq!(before, after, "{name}");
        assert_eq!(Reader::open(&saved).unwrap().profile(), "other");
    }
}

#[test]
fn a_cut_foreign_file_is_salvaged() {
    let folder = Folder::new("cut-foreign");
    for (name, options) in kinds() {
        let path = folder.file(name);
        write_foreign(&path, options);
        let before = entries(&path);
        let bytes = std::fs::read(&path).unwrap();
        let mut maximum = 0;
        for place in (200..bytes.len()).step_by(211) {
            let cut = folder.file("cut");
            std::fs::write(&cut, &bytes[..place]).unwrap();
            let saved = folder.file("saved");
            let _ = std::fs::remove_file(&saved);
            recover(&cut, &saved).unwrap();
            let after = entries(&saved);
            assert_eq!(after[..], before[..after.len()], "{name} cut at {place}");
            assert!(after.len() >= maximum, "{name} cut at {place}: fewer messages than from a shorter file");
            maximum = after.len();
        }
        assert!(maximum > 200, "{name}: {maximum}");
    }
}

#[test]
fn a_chunk_that_was_being_written_in_place_is_salvaged() {
    // The `mcap` crate's usual writer puts a placeholder for the length of the chunk that it writes.
    let folder = Folder::new("placeholder");
    let path = folder.file("bag.mcap");
    let options = WriteOptions::new().compression(None).chunk_size(None).profile("ros2");
    let file = std::fs::File::create(&path).unwrap();
    let mut writer = options.create(file).unwrap();
    let channel = writer.add_channel(0, "/raw", "json", &BTreeMap::new()).unwrap();
    for number in 0..50 {
        let header = MessageHeader { channel_id: channel, sequence: number, log_time: 5, publish_time: 5 };
        writer.write_to_known_channel(&header, b"{}").unwrap();
    }
    let bytes = std::fs::read(&path).unwrap();
    drop(writer);
    let cut = folder.file("cut.mcap");
    std::fs::write(&cut, &bytes).unwrap();
    let report = recover(&cut, &folder.file("saved.mcap")).unwrap();
    assert_eq!((report.messages, report.exit_code()), (50, 3), "{report}");
}

#[test]
fn messages_are_copied_beside_own_ones() {
    let folder = Folder::new("copied");
    let (input, output) = (folder.file("bag.mcap"), folder.file("run.mcap"));
    write_foreign(&input, WriteOptions::new());
    let mut writer = Writer::create(&output, &WriterOptions::default()).unwrap();
    for entry in entries(&input) {
        writer.copy(&entry).unwrap();
    }
    writer.write_serial(Port::Base, Direction::Rx, i64::MAX, b"end").unwrap();
    writer.finish().unwrap();
    let (before, after) = (entries(&input), entries(&output));
    assert_eq!(after.len(), before.len() + 1);
    for (copy, original) in after.iter().zip(&before) {
        assert_eq!((&copy.channel, &copy.bytes), (&original.channel, &original.bytes));
        assert_eq!(copy.publish_time_ns, original.publish_time_ns);
    }
    assert!(after.is_sorted_by_key(|entry| entry.log_time_ns));
    assert_eq!(after.last().unwrap().topic, Some(Topic::Serial(Port::Base, Direction::Rx)));
    let serial: Vec<_> = serial(&Reader::open(&output).unwrap()).collect::<Result<_, _>>().unwrap();
    assert_eq!(serial.len(), 1);
    assert_eq!((serial[0].port, serial[0].bytes.as_slice()), (Port::Base, b"end".as_slice()));
}
