//! Files cut, torn and flipped at many places: nothing intact is lost, nothing damaged is kept, and the
//! report says which.

use crate::folder::Folder;
use crate::samples::write_run;
use biplane_recording::mcap::recover::Problem;
use biplane_recording::recover;
use biplane_recording::{Entry, ReadError, Reader, RecoverError, RecoverReport, WriterOptions, recover_over};
use std::path::{Path, PathBuf};

/// A whole file, what is in it, and where its parts end.
struct Whole {
    bytes: Vec<u8>,
    entries: Vec<Entry>,
    /// Where each chunk begins and ends, and how many messages are in it.
    chunks: Vec<(usize, usize, usize)>,
    /// Where the end of the data stands.
    data_end: usize,
}

/// What a message is, apart from where it stands.
fn key(entry: &Entry) -> (&str, &str, i64, i64, u32, &[u8]) {
    let Entry { topic_name, type_name, log_time_ns, publish_time_ns, sequence, bytes, .. } = entry;
    (topic_name, type_name, *log_time_ns, *publish_time_ns, *sequence, bytes)
}

fn entries(path: &Path) -> Vec<Entry> {
    Reader::open(path).unwrap().messages().collect::<Result<_, _>>().unwrap()
}

/// Finds the parts by the `mcap` crate's index, not by our own walk.
fn whole(folder: &Folder, steps: u32) -> Whole {
    let path = folder.file("whole.mcap");
    let options = WriterOptions { overwrite: true, ..WriterOptions::default() };
    write_run(&path, steps, &options).unwrap().finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let mut chunks = Vec::new();
    let mut data_end = 0;
    for index in &summary.chunk_indexes {
        let end = (index.chunk_start_offset + index.chunk_length) as usize;
        let messages = summary.stream_chunk(&bytes, index).unwrap().count();
        chunks.push((index.chunk_start_offset as usize, end, messages));
        data_end = end + index.message_index_length as usize;
    }
    assert_eq!(bytes[data_end], 0x0F, "the end of the data follows the last chunk's index");
    Whole { entries: entries(&path), bytes, chunks, data_end }
}

struct Recovered {
    report: RecoverReport,
    entries: Vec<Entry>,
    attachments: Vec<String>,
}

fn salvage(folder: &Folder, bytes: &[u8]) -> Recovered {
    let (input, output) = (folder.file("broken.mcap"), folder.file("saved.mcap"));
    std::fs::write(&input, bytes).unwrap();
    let _ = std::fs::remove_file(&output);
    let report = recover(&input, &output).unwrap();
    assert_eq!(std::fs::read(&input).unwrap(), bytes, "the input was touched");
    let entries = entries(&output);
    assert_eq!(entries.len() as u64, report.messages);
    let attachments = Reader::open(&output).unwrap().attachment_names().unwrap();
    Recovered { report, entries, attachments }
}

/// Every recovered message is one of the whole file's, in its order. Gives how many are missing.
fn missing(whole: &Whole, recovered: &[Entry]) -> usize {
    let mut left = whole.entries.iter();
    for entry in recovered {
        assert!(left.any(|original| key(original) == key(entry)), "not in the original: {entry:?}");
    }
    whole.entries.len() - recovered.len()
}

fn cut_places(whole: &Whole) -> Vec<usize> {
    let mut places: Vec<usize> = (40..whole.bytes.len()).step_by(97).collect();
    let borders = whole
        .chunks
        .iter()
        .flat_map(|(start, end, _)| [*start, *end])
        .chain([whole.data_end, whole.bytes.len()]);
    places.extend(borders.flat_map(|border| border.saturating_sub(10)..(border + 14).min(whole.bytes.len())));
    places
}

#[test]
fn a_file_cut_anywhere_keeps_every_message_of_its_whole_chunks_and_says_so() {
    let folder = Folder::new("cut");
    let whole = whole(&folder, 75);
    // The end of the data: prefix and checksum.
    let data_ends = whole.data_end + 9 + 4;
    let mut more_than_whole_chunks = 0;
    for place in cut_places(&whole) {
        let recovered = salvage(&folder, &whole.bytes[..place]);
        let promised: usize =
            whole.chunks.iter().filter(|(_, end, _)| *end <= place).map(|(_, _, messages)| messages).sum();
        missing(&whole, &recovered.entries);
        assert!(recovered.entries.len() >= promised, "cut at {place}: {}", recovered.report);
        more_than_whole_chunks += recovered.entries.len() - promised;
        let expected = if place >= data_ends { 0 } else { 3 };
        assert_eq!(recovered.report.exit_code(), expected, "cut at {place}: {}", recovered.report);
        assert!(recovered.report.index_missing(), "cut at {place}");
        if promised > 0 {
            assert_eq!(recovered.attachments, ["rig.toml"]);
            assert_eq!(recovered.report.metadata, 1);
        }
    }
    assert!(more_than_whole_chunks > 0, "nothing was taken out of a chunk that was cut");
}

#[test]
fn a_cut_file_is_refused_by_the_reader_with_the_place_where_it_breaks() {
    let folder = Folder::new("refused");
    let whole = whole(&folder, 60);
    let path = folder.file("cut.mcap");
    for place in cut_places(&whole) {
        std::fs::write(&path, &whole.bytes[..place]).unwrap();
        match Reader::open(&path) {
            Err(error @ ReadError::Truncated { offset, size, .. }) => {
                assert!(offset <= place as u64 && size == place as u64, "{error}");
                assert!(error.to_string().contains("biplane recover"), "{error}");
                let cut_chunk = whole.chunks.iter().find(|(start, end, _)| *start < place && place < *end);
                if let Some((start, _, _)) = cut_chunk {
                    assert_eq!(offset, *start as u64, "cut at {place}");
                }
            }
            other => panic!("cut at {place}: {other:?}"),
        }
    }
}

#[test]
fn an_intact_file_comes_through_whole_and_without_findings() {
    let folder = Folder::new("intact");
    let whole = whole(&folder, 60);
    let recovered = salvage(&folder, &whole.bytes);
    assert_eq!(missing(&whole, &recovered.entries), 0);
    assert_eq!(recovered.report.findings, []);
    assert_eq!(
        (recovered.report.exit_code(), recovered.report.attachments, recovered.report.metadata),
        (0, 1, 1)
    );
}

#[test]
fn a_damaged_index_is_told_and_rebuilt() {
    let folder = Folder::new("index");
    let whole = whole(&folder, 20);
    // Behind the end of the data (13 bytes): a byte in the middle of the index.
    let place = usize::midpoint(whole.data_end + 13, whole.bytes.len() - 37);
    let mut bytes = whole.bytes.clone();
    bytes[place] ^= 0x40;
    let recovered = salvage(&folder, &bytes);
    assert_eq!(recovered.entries.len(), whole.entries.len());
    assert_eq!((recovered.report.exit_code(), recovered.report.index_missing()), (0, true));
    assert!(recovered.report.findings.iter().any(|finding| finding.problem == Problem::DamagedIndex));
    assert!(recovered.report.to_string().contains("the index was damaged and is rebuilt"));
}

/// Places to damage: a spread over the file, and every byte of the records' fronts.
fn flip_places(whole: &Whole) -> Vec<usize> {
    let mut places: Vec<usize> = (0..whole.bytes.len()).step_by(127).collect();
    let borders = whole.chunks.iter().flat_map(|(start, end, _)| [*start, *end]).chain([8, whole.data_end]);
    places.extend(borders.flat_map(|border| border..border + 50));
    places.retain(|place| *place < whole.bytes.len());
    places
}

#[test]
fn a_flipped_byte_gives_an_error_or_the_same_messages() {
    let folder = Folder::new("flip-read");
    let whole = whole(&folder, 60);
    let path = folder.file("flipped.mcap");
    let mut errors = 0;
    for (number, place) in flip_places(&whole).into_iter().enumerate() {
        let mut bytes = whole.bytes.clone();
        bytes[place] ^= [0x01, 0x80, 0xFF, 0x10][number % 4];
        std::fs::write(&path, &bytes).unwrap();
        let Ok(reader) = Reader::open(&path) else {
            errors += 1;
            continue;
        };
        let read: Vec<_> = reader.messages().collect();
        let good = read.iter().map_while(|entry| entry.as_ref().ok());
        let same = good.zip(&whole.entries).filter(|(entry, original)| key(entry) == key(original)).count();
        let failed = matches!(read.last(), Some(Err(_)));
        assert_eq!(same, read.len() - usize::from(failed), "flipped at {place}");
        assert!(
            failed || same == whole.entries.len(),
            "flipped at {place}: messages are gone without an error"
        );
        errors += usize::from(failed);
    }
    assert!(errors > 100, "{errors}");
}

#[test]
fn a_flipped_byte_never_lets_a_damaged_message_through_and_loses_one_chunk_at_most() {
    let folder = Folder::new("flip-recover");
    let whole = whole(&folder, 80);
    let largest = whole.chunks.iter().map(|(_, _, messages)| *messages).max().unwrap();
    for (number, place) in flip_places(&whole).into_iter().enumerate() {
        let mut bytes = whole.bytes.clone();
        bytes[place] ^= [0x01, 0x80, 0xFF, 0x10][number % 4];
        let recovered = salvage(&folder, &bytes);
        let missing = missing(&whole, &recovered.entries);
        assert!(missing <= largest, "flipped at {place}: {missing} messages lost\n{}", recovered.report);
        if missing > 0 {
            assert_eq!(recovered.report.exit_code(), 3, "flipped at {place}: {}", recovered.report);
        }
    }
}

#[test]
fn sectors_that_were_never_written_cost_the_messages_behind_them_in_their_chunk_only() {
    let folder = Folder::new("torn");
    let whole = whole(&folder, 80);
    let mut saved_of_torn = 0;
    for sector in 1..whole.bytes.len() / 512 {
        let hole = sector * 512..(sector + 2) * 512;
        if hole.end > whole.data_end {
            break;
        }
        let mut bytes = whole.bytes.clone();
        bytes[hole.clone()].fill(0);
        let recovered = salvage(&folder, &bytes);
        let touched = |(start, end, _): &&(usize, usize, usize)| *start < hole.end && hole.start < *end;
        let at_risk: usize = whole.chunks.iter().filter(touched).map(|(_, _, messages)| messages).sum();
        let missing = missing(&whole, &recovered.entries);
        assert!(missing <= at_risk, "hole at {hole:?}: {missing} lost\n{}", recovered.report);
        assert_eq!(recovered.report.exit_code(), 3, "hole at {hole:?}: {}", recovered.report);
        saved_of_torn += at_risk - missing;
    }
    assert!(saved_of_torn > 0);
}

#[test]
fn channels_defined_in_a_lost_chunk_are_taken_from_the_index() {
    let folder = Folder::new("orphans");
    let whole = whole(&folder, 80);
    let (start, end, messages) = whole.chunks[0];
    let mut bytes = whole.bytes.clone();
    bytes[start..end].fill(0xEE);
    let recovered = salvage(&folder, &bytes);
    assert_eq!(missing(&whole, &recovered.entries), messages);
    assert_eq!(recovered.entries[0].encoding(), "cdr");
    // Without the index nothing says what the messages are.
    let recovered = salvage(&folder, &bytes[..whole.data_end]);
    assert_eq!(recovered.entries.len(), 0);
    assert_eq!(recovered.report.lost_messages() as usize, whole.entries.len() - messages);
}

#[test]
fn a_damaged_chunk_is_counted_by_its_index() {
    let folder = Folder::new("counted");
    let whole = whole(&folder, 80);
    let (start, end, messages) = whole.chunks[1];
    let mut bytes = whole.bytes.clone();
    bytes[usize::midpoint(start, end)] ^= 0x20;
    let report = salvage(&folder, &bytes).report;
    assert_eq!(report.lost_messages() as usize, messages, "{report}");
    assert!(matches!(report.findings[0].problem, Problem::DamagedChunk { .. }), "{report}");
    assert_eq!(report.findings[0].offset, start as u64);
}

#[test]
fn a_recording_that_was_killed_is_recovered_under_its_own_name() {
    let folder = Folder::new("killed");
    let path = folder.file("run.mcap");
    let mut writer = write_run(&path, 50, &WriterOptions::default()).unwrap();
    writer.flush().unwrap();
    let written = writer.messages();
    let active = folder.file("run.mcap.active");
    let on_disk = std::fs::read(&active).unwrap();
    drop(writer);
    // As after a kill: what was on the disk, without what the end of the process added.
    std::fs::write(&active, &on_disk).unwrap();
    let report = recover(&active, &path).unwrap();
    assert_eq!(report.messages, written);
    assert_eq!(report.exit_code(), 3, "{report}");
    assert_eq!(folder.names(), ["run.mcap", "run.mcap.active"]);
    assert_eq!(entries(&path).len() as u64, written);
}

#[test]
fn what_is_no_recording_is_refused_and_nothing_is_overwritten() {
    let folder = Folder::new("no-recording");
    let output = folder.file("saved.mcap");
    let text = folder.file("notes.txt");
    std::fs::write(&text, b"not a recording at all, but long enough to be one").unwrap();
    let refused = |input: PathBuf| recover(&input, &output).unwrap_err();
    assert!(matches!(refused(text.clone()), RecoverError::Read(ReadError::NotMcap { .. })));
    assert!(matches!(refused(folder.file("none")), RecoverError::Read(ReadError::Missing { .. })));
    assert!(matches!(refused(folder.file("")), RecoverError::Read(ReadError::Directory { .. })));
    assert_eq!(folder.names(), ["notes.txt"]);
    let whole = whole(&folder, 5);
    std::fs::write(&output, b"mine").unwrap();
    let refused = recover(&folder.file("whole.mcap"), &output).unwrap_err();
    assert!(refused.to_string().contains("exists already"), "{refused}");
    assert_eq!(std::fs::read(&output).unwrap(), b"mine");
    assert!(!whole.entries.is_empty());
    let input = folder.file("whole.mcap");
    assert!(recover_over(&input, &input, true).is_err(), "never the input");
    assert!(!recover_over(&input, &output, true).unwrap().lost());
    assert!(std::fs::read(&output).unwrap() != b"mine");
}
