//! What an optimized file says of the recordings in it, and of what was added to their times.

use std::collections::BTreeMap;

use super::report::Report;
use crate::cli::terminal::console::Console;
use crate::recordings::run::Run;
use crate::slam::rewrite_recording::one_by_one::NS_PER_S;

/// The metadata record `optimize` of a file with these recordings, by number, and so many loops.
pub(super) fn reported(
    runs: &[Run],
    members: &[usize],
    delays_ns: &[i64],
    loops: usize,
) -> BTreeMap<String, String> {
    let name = |run: &Run| run.path().file_name().map(|name| name.to_string_lossy().into_owned());
    let names: Vec<String> = members.iter().filter_map(|&number| name(&runs[number])).collect();
    let delays_ns: Vec<i64> = members.iter().map(|&number| delays_ns[number]).collect();
    let mut all = BTreeMap::from([
        ("recordings".to_owned(), names.join(", ")),
        ("loops".to_owned(), loops.to_string()),
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
