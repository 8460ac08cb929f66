//! Writes a small recording with every topic and type, for readers outside Biplane to be tried on:
//! `cargo run -p biplane-recording --example write_sample -- SAMPLE.mcap`.

use biplane_recording::{Reader, Topic, WriterOptions};

#[path = "../tests/files/samples.rs"]
mod samples;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: write_sample SAMPLE.mcap")?;
    let path = std::path::Path::new(&path);
    let report = samples::write_run(path, 100, &WriterOptions::default())?.finish()?;
    let scans = Reader::open(path)?
        .messages()
        .filter(|entry| entry.as_ref().is_ok_and(|entry| entry.topic == Some(Topic::ScanHorizontal)))
        .count();
    assert_eq!(scans, 100);
    println!("{}: {} messages in {} chunks", path.display(), report.messages, report.chunks);
    Ok(())
}
