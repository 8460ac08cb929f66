//! A whole measurement on scans whose poses to one another are known: a scan and itself.

use std::fs;

use biplane_matcher::Method;
use biplane_recording::messages::{LaserScan, Message};
use biplane_recording::{Direction, Reader, Topic, Writer, WriterOptions};

use super::*;
use crate::engine::synthetic;
use crate::replay::basin::summary::Summary;
use crate::replay::{ReplayOptions, replay};

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A folder with a capture, and a list that pairs two of its scans with themselves.
fn folder(name: &str) -> Folder {
    let folder = std::env::temp_dir().join(format!("biplane-basin-{name}-{}", std::process::id()));
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

fn options(folder: &Folder, method: Method) -> BasinOptions {
    BasinOptions {
        inputs: vec![folder.0.join("log.mcap")],
        rig: None,
        pairs: folder.0.join("pairs.txt"),
        matcher: TrackerParams::for_method(method),
        journal: Some(folder.0.join("journal.csv")),
        overwrite: false,
    }
}

#[test]
fn a_scan_is_found_in_itself_from_all_52_starts() {
    let folder = folder("itself");
    let basin = measure(&options(&folder, Method::Map)).unwrap();
    assert_eq!((basin.trials.len(), basin.prepare_ns.len()), (104, 2));
    let summary = Summary::new("map", &basin);
    assert_eq!((summary.all.success_percent, summary.ambiguous_pairs), (100.0, 0), "{summary:?}");
    let no_log = BasinOptions { inputs: vec![folder.0.join("pairs.txt")], ..options(&folder, Method::Map) };
    assert!(measure(&no_log).is_err());
}

#[test]
fn the_journal_follows_the_first_start_of_each_pair() {
    let folder = folder("journal");
    measure(&options(&folder, Method::Gradient)).unwrap();
    let text = fs::read_to_string(folder.0.join("journal.csv")).unwrap();
    let starts: Vec<&str> = text.lines().filter(|line| line.split(',').nth(1) == Some("0")).collect();
    assert_eq!(starts.len(), 2, "{text}");
    for start in starts {
        // 10 cm off both ways and 30 degrees to the right, by hand.
        assert!(start.contains(",0,0.100000,0.100000,-0.5235988,"), "{start}");
    }
}
