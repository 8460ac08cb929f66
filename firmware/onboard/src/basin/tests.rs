//! A whole measurement on scans whose poses to one another are known: a scan and itself.

use std::fs;

use biplane_matcher::Method;
use biplane_recording::msg::{LaserScan, Message};
use biplane_recording::{Direction, Reader, Topic, Writer, WriterOptions};

use super::*;
use crate::engine::synthetic;
use crate::replay::{ReplayOptions, replay};

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A folder with a capture, and a list that pairs two of its scans with themselves.
fn folder() -> Folder {
    let folder = std::env::temp_dir().join(format!("biplane-basin-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let capture = folder.join("log.mcap");
    let mut writer = Writer::create(&capture, &WriterOptions::default()).unwrap();
    writer.attach("rig.toml", "application/toml", synthetic::rig().to_toml().as_bytes()).unwrap();
    for read in synthetic::drive(3, 60) {
        writer.write_serial(read.port, Direction::Rx, read.time_ns, &read.bytes).unwrap();
    }
    writer.finish().unwrap();
    let run = folder.join("run.mcap");
    replay(&ReplayOptions::new(capture, &run), &std::sync::atomic::AtomicBool::new(false)).unwrap();
    let reader = Reader::open(&run).unwrap();
    let entries = reader.messages().map(Result::unwrap);
    let scans = entries.filter(|entry| entry.topic == Some(Topic::ScanHorizontal));
    let stamps: Vec<f64> =
        scans.map(|entry| LaserScan::decode(&entry.bytes).unwrap().stamp_ns as f64 * 1e-9).collect();
    let pair = |stamp: f64| format!("{stamp:.6} {stamp:.6} 0 0 0\n");
    fs::write(folder.join("pairs.txt"), pair(stamps[3]) + &pair(stamps[20])).unwrap();
    Folder(folder)
}

#[test]
fn a_scan_is_found_in_itself_from_all_52_starts_and_the_journal_follows_the_first() {
    let folder = folder();
    let journal = folder.0.join("journal.csv");
    let options = BasinOptions {
        inputs: vec![folder.0.join("log.mcap")],
        rig: None,
        pairs: folder.0.join("pairs.txt"),
        matcher: TrackerParams::for_method(Method::Map),
        journal: Some(journal.clone()),
    };
    let basin = measure(&options).unwrap();
    assert_eq!((basin.trials.len(), basin.prepare_ns.len()), (104, 2));
    let summary = Summary::new("map", &basin);
    assert!(summary.all.success_percent > 99.0 && summary.ambiguous_pairs == 0, "{summary:?}");
    let text = fs::read_to_string(journal).unwrap();
    let starts = text.lines().filter(|line| line.split(',').nth(1) == Some("0"));
    assert!(starts.clone().count() >= 2);
    // 10 cm off both ways and 30 degrees to the right, by hand.
    assert!(starts.clone().next().unwrap().contains(",0,0.100000,0.100000,-0.5235988,"), "{text}");
    let missing = BasinOptions { inputs: vec![folder.0.join("pairs.txt")], ..options };
    assert!(measure(&missing).is_err());
}
