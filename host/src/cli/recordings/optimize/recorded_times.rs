//! What an optimized file says of the recordings in it, and of what was added to their times.

use std::collections::BTreeMap;

use super::Report;
use crate::cli::terminal::console::Console;
use crate::recordings::run::Run;
use crate::slam::Optimized;
use crate::slam::rewrite_recording::one_by_one::NS_PER_S;

/// The metadata record `optimize`.
pub(super) fn reported(runs: &[Run], optimized: &Optimized, delays_ns: &[i64]) -> BTreeMap<String, String> {
    let name = |run: &Run| run.path().file_name().map(|name| name.to_string_lossy().into_owned());
    let names: Vec<String> = runs.iter().filter_map(name).collect();
    let mut all = BTreeMap::from([
        ("recordings".to_owned(), names.join(", ")),
        ("loops".to_owned(), optimized.counts.loops.to_string()),
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
    ]);
    if delays_ns.iter().any(|delay_ns| *delay_ns != 0) {
        let added: Vec<String> = delays_ns.iter().map(|delay_ns| (delay_ns / NS_PER_S).to_string()).collect();
        all.insert("added_s".to_owned(), added.join(", "));
    }
    all
}

/// Says of which recordings the times were changed, also when quiet.
pub(super) fn note(report: &Report, console: &Console) {
    for recording in report.recordings.iter().filter(|recording| recording.added_s != 0) {
        console.warn(format!(
            "biplane: {} overlaps in time with a recording ahead of it in {}: {} s are added to its times there",
            recording.path, recording.output, recording.added_s
        ));
    }
}
