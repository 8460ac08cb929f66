//! Writes that the system refuses.

use super::error::explain;
use super::{WriteError, Writer, WriterOptions};
use crate::topics::{Direction, Port};
use std::io;
use std::path::Path;
use std::sync::Arc;

#[test]
fn a_full_disk_is_a_typed_error() {
    let error = explain(Path::new("run.mcap"), io::Error::from(io::ErrorKind::StorageFull).into());
    assert!(matches!(error, WriteError::DiskFull { .. }), "{error}");
}

#[test]
fn after_a_write_that_failed_nothing_more_is_written_and_the_file_gets_no_name() {
    let folder = std::env::temp_dir().join(format!("biplane-refused-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (path, active) = (folder.join("run.mcap"), folder.join("run.mcap.active"));
    std::fs::write(&active, b"").unwrap();
    // Opened for reading: every write is refused.
    let file = Arc::new(std::fs::File::open(&active).unwrap());
    let mut writer = Writer::start(&path, active.clone(), file, &WriterOptions::default(), "ros2").unwrap();
    let bytes = vec![0x5A; 5000];
    let mut errors = Vec::new();
    for number in 0..40 {
        let written = writer.write_serial(Port::Base, Direction::Rx, number * 500_000_000, &bytes);
        errors.extend(written.err());
    }
    assert!(matches!(errors.first(), Some(WriteError::Io { .. })), "{:?}", errors.first());
    assert!(matches!(errors.last(), Some(WriteError::Failed { .. })), "{:?}", errors.last());
    assert!(writer.finish().is_err());
    assert!(!path.exists());
    std::fs::remove_dir_all(folder).unwrap();
}
