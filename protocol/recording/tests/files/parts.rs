//! A recording in parts: each part whole, no message lost or doubled, the same bytes each time.

use biplane_recording::mcap::write::part_path;
use biplane_recording::{
    Entry, PartsWriter, ReadError, Reader, Recording, Rig, Rotation, Topic, WriteError, Writer, WriterOptions,
};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::folder::Folder;

const BY_TIME: Rotation = Rotation { span_ns: Some(2_500_000_000), bytes: None };

/// Ten seconds of two topics, ten messages a second each, that do not compress.
fn write(path: &Path, options: &WriterOptions, rotation: Rotation) -> Vec<PathBuf> {
    let mut writer = PartsWriter::create(path, options, rotation).unwrap();
    writer.attach("rig.toml", "application/toml", Rig::default().to_toml().as_bytes()).unwrap();
    writer.metadata("biplane", &BTreeMap::from([("matcher".to_owned(), "best".to_owned())])).unwrap();
    writer.write_encoded(Topic::TfStatic, 0, 0, b"\0\x01\0\0static").unwrap();
    let mut noise = 1_u64;
    for number in 0..100_i64 {
        for topic in [Topic::ScanHorizontal, Topic::Odom] {
            let bytes: Vec<u8> = (0..1000)
                .map(|_| {
                    noise =
                        noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (noise >> 56) as u8
                })
                .collect();
            writer.write_encoded(topic, number * 100_000_000, number, &bytes).unwrap();
        }
    }
    writer.finish().unwrap().parts.into_iter().map(|part| part.path).collect()
}

fn entries(path: &Path) -> Vec<Entry> {
    Reader::open(path).unwrap().messages().map(Result::unwrap).collect()
}

fn moving(entries: Vec<Entry>) -> Vec<(String, u32, i64, i64, Vec<u8>)> {
    let entries = entries.into_iter().filter(|entry| entry.topic != Some(Topic::TfStatic));
    entries
        .map(|entry| {
            (entry.topic_name, entry.sequence, entry.log_time_ns, entry.publish_time_ns, entry.bytes)
        })
        .collect()
}

#[test]
fn parts_hold_each_message_once_with_its_number_and_each_part_stands_alone() {
    let folder = Folder::new("parts");
    let whole = write(&folder.file("whole.mcap"), &WriterOptions::default(), Rotation::default());
    assert_eq!(whole, [folder.file("whole.mcap")]);
    let parts = write(&folder.file("run.mcap"), &WriterOptions::default(), BY_TIME);
    assert_eq!(parts, (0..4).map(|number| folder.file(&format!("run_{number}.mcap"))).collect::<Vec<_>>());
    let joined: Vec<_> = parts.iter().flat_map(|part| moving(entries(part))).collect();
    assert!(joined == moving(entries(&whole[0])));
    for part in &parts {
        let reader = Reader::open(part).unwrap();
        assert_eq!(reader.rig().unwrap(), Some(Rig::default()));
        assert_eq!(reader.metadata().unwrap()["biplane"]["matcher"], "best");
        let first = entries(part).remove(0);
        assert_eq!((first.topic, &first.bytes[4..]), (Some(Topic::TfStatic), b"static".as_slice()));
    }
}

#[test]
fn parts_by_size_are_about_as_large_as_told_and_the_same_each_time() {
    let folder = Folder::new("parts-size");
    let rotation = Rotation { span_ns: None, bytes: Some(60_000) };
    let first = write(&folder.file("first.mcap"), &WriterOptions::default(), rotation);
    let second = write(&folder.file("second.mcap"), &WriterOptions::default(), rotation);
    let sizes: Vec<_> = first.iter().map(|part| fs::metadata(part).unwrap().len()).collect();
    let (last, full) = sizes.split_last().unwrap();
    // A chunk of 0.9 s holds 18 kB; the index and the schemas come on top.
    assert!(full.len() >= 2 && full.iter().all(|size| (60_000..85_000).contains(size)), "{sizes:?}");
    assert!(*last > 0);
    assert_eq!(first.len(), second.len());
    for (first, second) in first.iter().zip(&second) {
        assert!(fs::read(first).unwrap() == fs::read(second).unwrap());
    }
}

#[test]
fn parts_of_an_earlier_run_are_never_mixed_with_new_ones() {
    let folder = Folder::new("parts-old");
    let path = folder.file("run.mcap");
    let old = write(&path, &WriterOptions::default(), Rotation { span_ns: Some(1_000_000_000), bytes: None });
    assert_eq!(old.len(), 10);
    fs::remove_file(part_path(&path, 0)).unwrap();
    let refused = PartsWriter::create(&path, &WriterOptions::default(), BY_TIME).unwrap_err();
    assert!(matches!(&refused, WriteError::Exists { path } if path.ends_with("run_1.mcap")), "{refused}");
    let forced = WriterOptions { overwrite: true, ..WriterOptions::default() };
    assert_eq!(write(&path, &forced, BY_TIME).len(), 4);
    let left: Vec<_> = (0..12).filter(|&number| part_path(&path, number).exists()).collect();
    assert_eq!(left, [0, 1, 2, 3]);
}

#[test]
fn a_whole_file_and_parts_of_one_name_are_never_mixed_either() {
    let folder = Folder::new("parts-and-whole");
    let forced = WriterOptions { overwrite: true, ..WriterOptions::default() };
    let path = folder.file("run.mcap");
    write(&path, &WriterOptions::default(), BY_TIME);
    let refused = PartsWriter::create(&path, &WriterOptions::default(), Rotation::default()).unwrap_err();
    assert!(matches!(&refused, WriteError::Exists { path } if path.ends_with("run_0.mcap")), "{refused}");
    write(&path, &forced, Rotation::default());
    assert_eq!(folder.names(), ["run.mcap"]);
    let refused = PartsWriter::create(&path, &WriterOptions::default(), BY_TIME).unwrap_err();
    assert!(matches!(&refused, WriteError::Exists { path } if path.ends_with("run.mcap")), "{refused}");
    write(&path, &forced, BY_TIME);
    assert_eq!(folder.names(), ["run_0.mcap", "run_1.mcap", "run_2.mcap", "run_3.mcap"]);
}

#[test]
fn an_input_among_old_parts_is_not_replaced_and_a_foreign_name_is_no_part() {
    let folder = Folder::new("parts-input");
    let path = folder.file("run.mcap");
    let mut input = Writer::create(&part_path(&path, 7), &WriterOptions::default()).unwrap();
    input.write_encoded(Topic::Odom, 1, 1, b"\0\x01\0\0").unwrap();
    input.finish().unwrap();
    fs::write(folder.file("run_07.mcap"), "somebody else's").unwrap();
    let forced =
        WriterOptions { overwrite: true, inputs: vec![part_path(&path, 7)], ..WriterOptions::default() };
    let refused = PartsWriter::create(&path, &forced, BY_TIME).unwrap_err();
    assert!(matches!(refused, WriteError::IsInput { .. }), "{refused}");
    let unrelated = WriterOptions { overwrite: true, ..WriterOptions::default() };
    write(&path, &unrelated, BY_TIME);
    assert!(!part_path(&path, 7).exists() && folder.file("run_07.mcap").exists());
}

#[test]
fn a_part_ends_when_asked() {
    let folder = Folder::new("parts-now");
    let path = folder.file("run.mcap");
    let rotation = Rotation { span_ns: Some(i64::MAX), bytes: None };
    let mut writer = PartsWriter::create(&path, &WriterOptions::default(), rotation).unwrap();
    assert!(
        writer.rotate_now().unwrap() && writer.current_path() == part_path(&path, 0),
        "nothing is in it yet"
    );
    writer.write_encoded(Topic::Odom, 5, 5, b"\0\x01\0\0").unwrap();
    assert!(writer.rotate_now().unwrap());
    writer.write_encoded(Topic::Odom, 3, 3, b"\0\x01\0\0").unwrap();
    writer.finish().unwrap();
    let last = entries(&part_path(&path, 1)).remove(0);
    assert_eq!((last.sequence, last.log_time_ns), (1, 5), "numbers and times go on");
}

#[test]
fn parts_are_read_as_one_recording_in_the_order_of_their_numbers() {
    let folder = Folder::new("parts-read");
    let whole = write(&folder.file("whole.mcap"), &WriterOptions::default(), Rotation::default());
    let path = folder.file("run.mcap");
    let rotation = Rotation { span_ns: Some(800_000_000), bytes: None };
    let mut parts = write(&path, &WriterOptions::default(), rotation);
    assert!(parts.len() > 10);
    // As a shell sorts names: 10 before 2.
    parts.sort();
    assert!(parts[2].ends_with("run_10.mcap"));
    let read = |paths: &[PathBuf]| -> Vec<_> {
        let entries: Vec<_> = Recording::open(paths).unwrap().messages().map(Result::unwrap).collect();
        assert_eq!(entries.iter().filter(|entry| entry.topic == Some(Topic::TfStatic)).count(), 1);
        moving(entries)
    };
    let expected = moving(entries(&whole[0]));
    assert!(read(&parts) == expected, "a list");
    assert!(read(std::slice::from_ref(&path)) == expected, "the name of the whole");
    assert!(read(&whole) == expected, "one file");
    let one = Recording::open(&parts[2..3]).unwrap();
    assert_eq!((one.parts().len(), one.path(), one.missing()), (1, parts[2].as_path(), vec![]));
    let holes = Recording::open(&[part_path(&path, 4), part_path(&path, 1)]).unwrap();
    assert_eq!((holes.missing(), holes.path()), (vec![2, 3], part_path(&path, 1).as_path()));
    assert_eq!(holes.rig().unwrap(), Some(Rig::default()));
    for odd in [&whole[0], &folder.file("other_1.mcap")] {
        let refused = Recording::open(&[parts[0].clone(), odd.clone()]).unwrap_err();
        assert!(matches!(refused, ReadError::NotOneRecording { .. }), "{refused}");
    }
    let missing = Recording::open(&[folder.file("nothing.mcap")]).unwrap_err();
    assert!(matches!(missing, ReadError::Missing { .. }), "{missing}");
}

#[test]
fn a_part_that_was_never_finished_is_named_and_no_other_of_the_folder() {
    let folder = Folder::new("parts-unfinished");
    let parts = write(&folder.file("run.mcap"), &WriterOptions::default(), BY_TIME);
    assert!(Recording::open(&[folder.file("run.mcap")]).unwrap().unfinished().is_empty());
    let active = folder.file("run_3.mcap.active");
    fs::rename(&parts[3], &active).unwrap();
    fs::write(folder.file("other_4.mcap.active"), "x").unwrap();
    let recording = Recording::open(&[folder.file("run.mcap")]).unwrap();
    assert_eq!((recording.parts().len(), recording.unfinished()), (3, &[active][..]));
    assert!(recording.missing().is_empty());
}

#[test]
fn parts_of_two_runs_are_no_recording_whatever_they_are_called() {
    let folder = Folder::new("parts-of-two");
    let begun = |path: &Path, start_time_ns: &str| {
        let mut writer = Writer::create(path, &WriterOptions::default()).unwrap();
        let values = BTreeMap::from([("start_time_ns".to_owned(), start_time_ns.to_owned())]);
        writer.metadata("biplane", &values).unwrap();
        writer.write_encoded(Topic::Odom, 5, 5, b"\0\x01\0\0odom").unwrap();
        writer.finish().unwrap();
    };
    for (number, start_time_ns) in ["7", "7", "8"].iter().enumerate() {
        begun(&part_path(&folder.file("run.mcap"), number as u32), start_time_ns);
    }
    let both = [folder.file("run_0.mcap"), folder.file("run_1.mcap")];
    assert_eq!(Recording::open(&both).unwrap().parts().len(), 2);
    let refused = Recording::open(&[folder.file("run.mcap")]);
    assert!(
        matches!(refused, Err(ReadError::NotOneRecording { path, .. }) if path == folder.file("run_2.mcap"))
    );
}
