//! Names that are taken, disks that are full, files that are none, and what an unfinished run leaves behind.

use crate::folder::Folder;
use crate::samples::{odometry, write_run};
use biplane_recording::mcap::write::{active_path, part_path};
use biplane_recording::{
    Direction, PartsWriter, Port, ReadError, Reader, RecoverError, Rotation, Topic, WriteError, Writer,
    WriterOptions, recover, recover_over,
};
use std::path::Path;

fn create(path: &Path, overwrite: bool) -> Result<Writer, WriteError> {
    Writer::create(path, &WriterOptions { overwrite, ..WriterOptions::default() })
}

#[test]
fn nothing_is_overwritten_unless_asked() {
    let folder = Folder::new("overwrite");
    let path = folder.file("run.mcap");
    std::fs::write(&path, b"mine").unwrap();
    assert!(matches!(create(&path, false), Err(WriteError::Exists { .. })));
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
    assert_eq!(folder.names(), ["run.mcap"]);
    create(&path, true).unwrap().finish().unwrap();
    assert_eq!(Reader::open(&path).unwrap().messages().count(), 0);

    // An unfinished run of that name.
    let active = folder.file("other.mcap.active");
    std::fs::write(&active, b"yesterday's").unwrap();
    let error = create(&folder.file("other.mcap"), false).unwrap_err();
    assert!(matches!(&error, WriteError::Unfinished { path } if *path == active), "{error}");
    assert!(error.to_string().contains("biplane recover"), "{error}");
    assert_eq!(std::fs::read(&active).unwrap(), b"yesterday's");
}

#[test]
fn what_another_process_is_writing_is_replaced_by_no_program_and_no_flag() {
    let folder = Folder::new("live");
    let path = folder.file("run.mcap");
    let mut live = write_run(&path, 3, &WriterOptions::default()).unwrap();
    live.flush().unwrap();
    let is_refused = |path: &Path, overwrite: bool| {
        let options = WriterOptions { overwrite, ..WriterOptions::default() };
        let parts = Rotation { span_ns: Some(1), bytes: None };
        let results = [
            Writer::create(path, &options).map(drop),
            PartsWriter::check(path, &options, Rotation::default()),
            PartsWriter::create(path, &options, parts).map(drop),
        ];
        results.iter().all(|result| matches!(result, Err(WriteError::BeingWritten { .. })))
    };
    let other = folder.file("other.mcap");
    write_run(&other, 5, &WriterOptions::default()).unwrap().finish().unwrap();
    for overwrite in [false, true] {
        assert!(is_refused(&path, overwrite), "overwrite {overwrite}");
        assert!(is_refused(&active_path(&path), overwrite), "overwrite {overwrite}");
        let recovered = recover_over(&other, &path, overwrite).unwrap_err();
        assert!(matches!(recovered, RecoverError::Write(WriteError::BeingWritten { .. })), "{recovered}");
        let itself = recover_over(&active_path(&path), &path, overwrite).unwrap_err();
        assert!(matches!(itself, RecoverError::Write(WriteError::BeingWritten { .. })), "{itself}");
    }
    PartsWriter::remove_begun(&path, &WriterOptions::default(), Rotation::default());
    assert_eq!(folder.names(), ["other.mcap", "run.mcap.active"]);
    live.write_serial(Port::Base, Direction::Rx, 9_000_000_000, b"on it goes").unwrap();
    live.finish().unwrap();
    let last = Reader::open(&path).unwrap().messages().last().unwrap().unwrap();
    assert!(last.bytes.ends_with(b"on it goes"), "{last:?}");
}

#[test]
fn of_a_recording_in_parts_that_is_being_written_no_part_is_replaced() {
    let folder = Folder::new("live-parts");
    let path = folder.file("run.mcap");
    let part = Writer::create(&part_path(&path, 3), &WriterOptions::default()).unwrap();
    let overwrite = WriterOptions { overwrite: true, ..WriterOptions::default() };
    let whole = PartsWriter::create(&path, &overwrite, Rotation::default());
    assert!(matches!(whole, Err(WriteError::BeingWritten { .. })), "{whole:?}");
    assert_eq!(folder.names(), ["run_3.mcap.active"]);
    drop(part);
    // Of a run that was cut off: what is left may go when it is asked for.
    PartsWriter::create(&path, &overwrite, Rotation::default()).unwrap();
}

#[test]
fn a_link_to_what_is_not_there_is_not_replaced_unless_asked() {
    let folder = Folder::new("dangling");
    let path = folder.file("z.mcap");
    std::os::unix::fs::symlink("/nowhere/z.mcap", &path).unwrap();
    assert!(matches!(create(&path, false), Err(WriteError::Exists { .. })));
    assert!(path.is_symlink());
    create(&path, true).unwrap().finish().unwrap();
    assert!(!path.is_symlink());
    assert_eq!(Reader::open(&path).unwrap().messages().count(), 0);
}

#[test]
fn a_file_that_appears_while_we_write_is_kept_and_so_is_ours() {
    let folder = Folder::new("race");
    let path = folder.file("run.mcap");
    let writer = write_run(&path, 3, &WriterOptions::default()).unwrap();
    std::fs::write(&path, b"mine").unwrap();
    assert!(matches!(writer.finish(), Err(WriteError::Exists { .. })));
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
    assert!(Reader::open(&folder.file("run.mcap.active")).unwrap().messages().count() > 0);
}

#[test]
fn a_writer_that_is_dropped_leaves_the_active_file_and_no_other() {
    let folder = Folder::new("dropped");
    let writer = write_run(&folder.file("run.mcap"), 40, &WriterOptions::default()).unwrap();
    assert_eq!(folder.names(), ["run.mcap.active"]);
    drop(writer);
    assert_eq!(folder.names(), ["run.mcap.active"]);
}

#[test]
fn what_was_flushed_is_on_file_while_the_run_goes_on() {
    let folder = Folder::new("flushed");
    let options = WriterOptions { sync: true, ..WriterOptions::default() };
    let mut writer = Writer::create(&folder.file("run.mcap"), &options).unwrap();
    let seen = || {
        let reader = Reader::open_unfinished(&folder.file("run.mcap.active")).unwrap();
        let (mut messages, mut end) = (0, None);
        for entry in reader.messages() {
            match entry {
                Ok(_) => messages += 1,
                Err(error) => end = Some(error),
            }
        }
        assert!(matches!(end, Some(ReadError::Truncated { .. })), "{end:?}");
        messages
    };
    writer.write(Topic::Odom, 0, 0, &odometry(0)).unwrap();
    writer.write(Topic::Odom, 899_999_999, 0, &odometry(0)).unwrap();
    writer.flush().unwrap();
    assert_eq!(seen(), 2);
    // Without being asked: a chunk is closed before the message that is 0.9 s after its first.
    let start = 5_000_000_000;
    for (log_time, on_file) in [(start, 2), (start + 899_999_999, 2), (start + 900_000_000, 4)] {
        writer.write(Topic::Odom, log_time, 0, &odometry(0)).unwrap();
        assert_eq!(seen(), on_file, "{log_time}");
    }
}

#[test]
fn an_input_is_replaced_under_no_name_even_when_told_to_overwrite() {
    let folder = Folder::new("input");
    write_run(&folder.file("in.mcap"), 3, &WriterOptions::default()).unwrap().finish().unwrap();
    let input = folder.file("run.mcap.active");
    std::fs::rename(folder.file("in.mcap"), &input).unwrap();
    std::fs::hard_link(&input, folder.file("link.mcap")).unwrap();
    let before = std::fs::read(&input).unwrap();
    for overwrite in [false, true] {
        let options = WriterOptions { overwrite, inputs: vec![input.clone()], ..WriterOptions::default() };
        for output in ["run.mcap", "run.mcap.active", "link.mcap"] {
            let error = Writer::create(&folder.file(output), &options).unwrap_err();
            assert!(matches!(error, WriteError::IsInput { .. }), "{output}: {error}");
            assert!(error.to_string().matches("run.mcap.active").count() >= 1, "{error}");
        }
    }
    // Recovery writes to another name.
    let broken = folder.file("new.mcap.recovering");
    std::fs::rename(&input, &broken).unwrap();
    let error = recover(&broken, &folder.file("new.mcap")).unwrap_err();
    assert!(matches!(error, RecoverError::Write(WriteError::IsInput { .. })), "{error}");
    assert_eq!(std::fs::read(&broken).unwrap(), before);
    let error = recover(&folder.file("link.mcap"), &folder.file("link.mcap")).unwrap_err();
    assert!(matches!(error, RecoverError::Write(WriteError::IsInput { .. })), "{error}");
    // Nor is a recovery of somebody else taken over.
    std::fs::write(folder.file("else.mcap.recovering"), b"theirs").unwrap();
    let error = recover(&broken, &folder.file("else.mcap")).unwrap_err();
    assert!(matches!(error, RecoverError::Write(WriteError::Recovering { .. })), "{error}");
    assert_eq!(std::fs::read(folder.file("else.mcap.recovering")).unwrap(), b"theirs");
}

#[test]
fn an_unfinished_recording_is_replaced_when_told_to_but_nothing_else_of_that_name() {
    let folder = Folder::new("in-the-way");
    let active = folder.file("run.mcap.active");
    std::fs::write(&active, b"PARAM robot").unwrap();
    let error = create(&folder.file("run.mcap"), true).unwrap_err();
    assert!(matches!(error, WriteError::InTheWay { .. }), "{error}");
    assert_eq!(std::fs::read(&active).unwrap(), b"PARAM robot");
    for unfinished in [b"\x89MCAP0\r\n\x01".as_slice(), b"", &[0; 600]] {
        std::fs::write(&active, unfinished).unwrap();
        create(&folder.file("run.mcap"), true).unwrap().finish().unwrap();
        assert_eq!(folder.names(), ["run.mcap"]);
    }
}

#[test]
fn what_is_no_regular_file_is_not_replaced() {
    let folder = Folder::new("irregular");
    std::fs::create_dir(folder.file("folder.mcap")).unwrap();
    std::fs::create_dir(folder.file("other.mcap.active")).unwrap();
    let _socket = std::os::unix::net::UnixListener::bind(folder.file("socket.mcap")).unwrap();
    std::os::unix::fs::symlink(folder.file("socket.mcap"), folder.file("linked.mcap.active")).unwrap();
    let names = folder.names();
    for output in ["folder.mcap", "other.mcap", "socket.mcap", "linked.mcap"] {
        for overwrite in [false, true] {
            let error = create(&folder.file(output), overwrite).unwrap_err();
            assert!(matches!(error, WriteError::NotAFile { .. }), "{output}: {error}");
            assert!(error.to_string().contains(output), "{error}");
        }
    }
    assert_eq!(folder.names(), names);
}

#[test]
fn a_folder_that_is_not_there_is_named() {
    let error = create(Path::new("/nowhere/run.mcap"), false).unwrap_err().to_string();
    assert!(error.contains("/nowhere/run.mcap.active") && error.contains("No such file"), "{error}");
}

#[test]
fn what_is_no_recording_is_refused_in_words() {
    let folder = Folder::new("none");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.file(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let table = [
        (folder.file("missing.mcap"), "does not exist"),
        (folder.file(""), "is a folder, not an MCAP file"),
        (write("empty.mcap", b""), "is not an MCAP file: it is empty"),
        (write("short.mcap", b"\x89MC"), "is not an MCAP file: it begins with 89 4d 43"),
        (
            write("text.mcap", b"PARAM robot"),
            "is not an MCAP file: it is a CARMEN log (`biplane import carmen` reads it)",
        ),
        (
            write("magic.mcap", b"\x89MCAP0\r\n"),
            "is cut off: the record at byte 8 is not whole, the file ends at byte 8",
        ),
        (write("twice.mcap", b"\x89MCAP0\r\n\x89MCAP0\r\n"), "is cut off: the record at byte 8 is not whole"),
        (
            write("zeros.mcap", &[b"\x89MCAP0\r\n".as_slice(), &[0; 600]].concat()),
            "is damaged at byte 8: zeros where a record should be",
        ),
        (
            write("huge.mcap", b"\x89MCAP0\r\n\x01\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF"),
            "is cut off: the record at byte 8",
        ),
    ];
    for (path, words) in table {
        let error = Reader::open(&path).expect_err(words).to_string();
        assert!(error.contains(words), "{error}\nshould say: {words}");
        assert!(error.starts_with(path.to_str().unwrap()), "{error}");
    }
}

#[test]
fn a_rig_or_message_that_is_none_is_named() {
    let folder = Folder::new("no-rig");
    let path = folder.file("run.mcap");
    let mut writer = create(&path, false).unwrap();
    writer.attach("rig.toml", "application/toml", b"[horizontal]\nprot = 1\n[base]\n").unwrap();
    writer.write_encoded(Topic::Odom, 7, 7, &[0, 1, 0, 0, 9]).unwrap();
    writer.finish().unwrap();
    let reader = Reader::open(&path).unwrap();
    let error = reader.rig().unwrap_err().to_string();
    assert!(error.contains("run.mcap: 3 faults:\n  line 1: missing key `horizontal.port`"), "{error}");
    let entry = reader.messages().next().unwrap().unwrap();
    let error = entry.decode().unwrap_err().to_string();
    assert!(
        error.contains("message on /odom at log time 7 ns cannot be decoded: message ends early"),
        "{error}"
    );
}
