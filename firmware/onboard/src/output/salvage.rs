//! Recordings that a power cut or a crash left unfinished in a folder: made whole before the next one is
//! begun.
//!
//! `NAME.mcap.active` becomes `NAME.mcap` with all that is intact in it. A file that was only cut short goes
//! then, because nothing else was in it; one that is damaged elsewhere stays as `NAME.mcap.damaged`. One that
//! is being written is left alone.
//!
//! The power may go again at any moment: the new file is on the disk itself before the old one goes, and what
//! a salvage that was cut off left behind stops none of the next ones.

use std::fs::{File, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use biplane_recording::mcap::recover::Problem;
use biplane_recording::{Disk, ReadError, RecoverError, RecoverReport, WriterOptions, recover_with};

/// What became of one unfinished recording.
#[derive(Debug)]
#[non_exhaustive]
pub enum Salvaged {
    /// All that was in it stands in the new file.
    Whole,
    /// All that was whole in it stands in the new file; so many bytes at its end were cut short, and as many
    /// more are missing as they announce.
    Cut {
        /// Bytes that cannot be used.
        unusable_bytes: u64,
        /// Bytes that the file announces and does not have.
        missing_bytes: u64,
    },
    /// What is intact stands in the new file, the rest in the file at this path.
    Damaged(PathBuf),
    /// Nothing had reached the disk; it is gone.
    Empty,
    /// It is no recording, and is now called so.
    NotOurs(PathBuf),
    /// A program is writing it.
    BeingWritten,
    /// The name that it would get is taken.
    NameTaken,
    /// Nothing was changed.
    Failed(RecoverError),
}

/// One unfinished recording, the recording it became (or would have), what became of it, and how much was
/// kept.
#[derive(Debug)]
pub struct Leftover {
    /// The unfinished file.
    pub unfinished: PathBuf,
    /// The name without `.active`.
    pub recording: PathBuf,
    /// What became of it.
    pub outcome: Salvaged,
    /// Messages kept.
    pub messages: u64,
}

/// Salvages every unfinished recording in `folder`, in the order of their names.
///
/// # Errors
/// When the folder cannot be listed or a leftover cannot be renamed or removed.
pub(crate) fn salvage(folder: &Path) -> io::Result<Vec<Leftover>> {
    salvage_on(&Disk::default(), folder)
}

/// The same, on a disk of a test's own.
///
/// # Errors
/// As `salvage`.
pub fn salvage_on(disk: &Disk, folder: &Path) -> io::Result<Vec<Leftover>> {
    let mut unfinished = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.as_os_str().as_encoded_bytes().ends_with(b".mcap.active") && path.is_file() {
            unfinished.push(path);
        }
    }
    unfinished.sort();
    unfinished.into_iter().map(|unfinished| leftover(disk, unfinished)).collect()
}

fn leftover(disk: &Disk, unfinished: PathBuf) -> io::Result<Leftover> {
    let recording = unfinished.with_extension("");
    let (outcome, messages) = one(disk, &unfinished, &recording)?;
    Ok(Leftover { unfinished, recording, outcome, messages })
}

fn one(disk: &Disk, unfinished: &Path, recording: &Path) -> io::Result<(Salvaged, u64)> {
    let file = File::open(unfinished)?;
    // The writer holds this lock as long as it lives.
    if let Err(TryLockError::WouldBlock) = file.try_lock() {
        return Ok((Salvaged::BeingWritten, 0));
    }
    let size = file.metadata()?.len();
    // A file may have grown on the disk without its data.
    if is_zeros(&file)? {
        disk.storage().remove(unfinished)?;
        return Ok((Salvaged::Empty, 0));
    }
    // The recovery looks for the lock again: ours would stop it.
    drop(file);
    if recording.symlink_metadata().is_ok() {
        return name_taken(disk, unfinished, recording);
    }
    clear_stale(disk, recording)?;
    let options = WriterOptions { disk: disk.clone(), ..WriterOptions::default() };
    match recover_with(unfinished, recording, &options) {
        Ok(report) => put_away(disk, unfinished, recording, size, &report),
        Err(RecoverError::Read(ReadError::NotMcap { .. })) => {
            Ok((Salvaged::NotOurs(set_aside(disk, unfinished, recording)?), 0))
        }
        Err(error) => Ok((Salvaged::Failed(error), 0)),
    }
}

/// Removes the half copy of an earlier salvage, whatever the disk has made of its bytes, unless that one
/// still goes on.
fn clear_stale(disk: &Disk, recording: &Path) -> io::Result<()> {
    let mut name = recording.as_os_str().to_owned();
    name.push(".recovering");
    match File::open(&name) {
        Ok(file) if file.try_lock().is_ok() => disk.storage().remove(Path::new(&name)),
        _ => Ok(()),
    }
}

/// What is left of the unfinished file goes when nothing else was in it, and else stays beside the recording.
fn put_away(
    disk: &Disk,
    unfinished: &Path,
    recording: &Path,
    size: u64,
    report: &RecoverReport,
) -> io::Result<(Salvaged, u64)> {
    if only_cut(report, size) {
        disk.storage().remove(unfinished)?;
        return Ok((whole_or_cut(report), report.messages));
    }
    Ok((Salvaged::Damaged(set_aside(disk, unfinished, recording)?), report.messages))
}

fn whole_or_cut(report: &RecoverReport) -> Salvaged {
    let is_cut =
        |problem: &Problem| matches!(problem, Problem::CutChunk | Problem::TornChunk | Problem::NoRecord);
    match report.findings.iter().any(|finding| is_cut(&finding.problem)) {
        true => Salvaged::Cut { unusable_bytes: report.lost_bytes(), missing_bytes: report.missing_bytes() },
        false => Salvaged::Whole,
    }
}

/// The recording may be what an earlier salvage made of this very file, before the power went again: then it
/// ends what that one began.
fn name_taken(disk: &Disk, unfinished: &Path, recording: &Path) -> io::Result<(Salvaged, u64)> {
    let mut name = recording.as_os_str().to_owned();
    name.push(".again");
    let again = PathBuf::from(name);
    clear_stale(disk, &again)?;
    let options = WriterOptions { disk: disk.clone(), overwrite: true, ..WriterOptions::default() };
    let Ok(report) = recover_with(unfinished, &again, &options) else {
        return Ok((Salvaged::NameTaken, 0));
    };
    let same = is_same(&File::open(&again)?, &File::open(recording)?)?;
    disk.storage().remove(&again)?;
    if !same {
        return Ok((Salvaged::NameTaken, 0));
    }
    let size = unfinished.metadata()?.len();
    put_away(disk, unfinished, recording, size, &report)
}

/// Whether nothing but zeros is in a file.
fn is_zeros(file: &File) -> io::Result<bool> {
    let mut buffer = vec![0; 1 << 16];
    let mut file = file;
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(true),
            count if buffer.iter().take(count).any(|byte| *byte != 0) => return Ok(false),
            _ => {}
        }
    }
}

fn is_same(one: &File, other: &File) -> io::Result<bool> {
    if one.metadata()?.len() != other.metadata()?.len() {
        return Ok(false);
    }
    let (one, other) = (io::BufReader::new(one).bytes(), io::BufReader::new(other).bytes());
    for (one, other) in one.zip(other) {
        if one? != other? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// True when the file merely ends early: what cannot be used of it reaches to its end and was never whole.
fn only_cut(report: &RecoverReport, size: u64) -> bool {
    report.findings.iter().all(|finding| match finding.problem {
        // A cut chunk is the last of the file; what is whole of it was kept.
        Problem::NoEnd | Problem::NoIndex | Problem::DamagedIndex | Problem::CutChunk => true,
        Problem::TornChunk | Problem::NoRecord => finding.offset + finding.bytes >= size,
        _ => false,
    })
}

fn set_aside(disk: &Disk, unfinished: &Path, recording: &Path) -> io::Result<PathBuf> {
    let mut name = recording.as_os_str().to_owned();
    name.push(".damaged");
    let aside = PathBuf::from(name);
    disk.storage().rename(unfinished, &aside)?;
    Ok(aside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_recording::{Direction, Port, Reader, Writer, WriterOptions};
    use std::fs;

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("biplane-salvage-{name}-{}", std::process::id()));
            let _ = fs::remove_dir_all(&path);
            fs::create_dir(&path).unwrap();
            Self(path)
        }

        fn names(&self) -> Vec<String> {
            let mut names: Vec<_> = fs::read_dir(&self.0)
                .unwrap()
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .collect();
            names.sort();
            names
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    const STEPS: i64 = 50;

    /// The bytes of a recording of one chunk each second, finished.
    fn recording_bytes(folder: &Path) -> Vec<u8> {
        let path = folder.join("made.mcap");
        let mut writer = Writer::create(&path, &WriterOptions::default()).unwrap();
        for step in 0..STEPS {
            let stamp_ns = step * 1_000_000_000;
            let bytes: Vec<u8> = (0..200).map(|byte| (byte * 7 + step * 13) as u8).collect();
            writer.write_serial(Port::Base, Direction::Rx, stamp_ns, &bytes).unwrap();
        }
        writer.finish().unwrap();
        let bytes = fs::read(&path).unwrap();
        fs::remove_file(path).unwrap();
        bytes
    }

    fn only(leftovers: Vec<Leftover>) -> Leftover {
        assert_eq!(leftovers.len(), 1);
        leftovers.into_iter().next().unwrap()
    }

    #[test]
    fn a_recording_that_was_cut_anywhere_becomes_whole_and_leaves_nothing_behind() {
        let folder = Folder::new("cut");
        let bytes = recording_bytes(&folder.0);
        let data = bytes.len() * 2 / 3;
        for length in [data, data + 1, data + 7, data + 100, data + 231] {
            let unfinished = folder.0.join("run_2.mcap.active");
            fs::write(&unfinished, &bytes[..length]).unwrap();
            let leftover = only(salvage(&folder.0).unwrap());
            assert!(matches!(leftover.outcome, Salvaged::Cut { .. }), "{length}: {leftover:?}");
            assert!((10..STEPS as u64).contains(&leftover.messages), "{length}: {}", leftover.messages);
            assert_eq!(folder.names(), ["run_2.mcap"], "{length}");
            let read = Reader::open(&folder.0.join("run_2.mcap")).unwrap().messages().count() as u64;
            assert_eq!(read, leftover.messages);
            fs::remove_file(folder.0.join("run_2.mcap")).unwrap();
        }
    }

    #[test]
    fn one_that_was_cut_in_a_chunk_of_which_a_part_can_be_read_is_cut_and_not_damaged() {
        let folder = Folder::new("cut-large");
        let path = folder.0.join("made.mcap");
        let mut writer = Writer::create(&path, &WriterOptions::default()).unwrap();
        // A second of 400 reads that cannot be packed: several blocks of zstd.
        let mut noise = 1_u32;
        for step in 0..400 {
            let mut byte = || {
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (noise >> 24) as u8
            };
            let bytes: Vec<u8> = (0..2000).map(|_| byte()).collect();
            writer.write_serial(Port::Base, Direction::Rx, step * 1_000_000, &bytes).unwrap();
        }
        writer.finish().unwrap();
        let bytes = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        fs::write(folder.0.join("run.mcap.active"), &bytes[..bytes.len() / 2]).unwrap();
        let leftover = only(salvage(&folder.0).unwrap());
        assert!(matches!(leftover.outcome, Salvaged::Cut { missing_bytes: 100_000.., .. }), "{leftover:?}");
        assert!((100..300).contains(&leftover.messages), "{leftover:?}");
        assert_eq!(folder.names(), ["run.mcap"]);
    }

    #[test]
    fn one_that_is_damaged_in_the_middle_is_kept_beside_what_was_saved() {
        let folder = Folder::new("damaged");
        let mut bytes = recording_bytes(&folder.0);
        let middle = bytes.len() / 3;
        for byte in &mut bytes[middle..middle + 40] {
            *byte ^= 0x55;
        }
        fs::write(folder.0.join("run.mcap.active"), &bytes[..bytes.len() * 2 / 3]).unwrap();
        let leftover = only(salvage(&folder.0).unwrap());
        assert!(matches!(leftover.outcome, Salvaged::Damaged(_)), "{leftover:?}");
        assert_eq!(folder.names(), ["run.mcap", "run.mcap.damaged"]);
        assert!(salvage(&folder.0).unwrap().is_empty());
    }

    #[test]
    fn what_is_empty_goes_and_what_is_no_recording_is_called_so() {
        let folder = Folder::new("others");
        fs::write(folder.0.join("a.mcap.active"), "").unwrap();
        fs::write(folder.0.join("b.mcap.active"), "a letter").unwrap();
        fs::write(folder.0.join("c.txt.active"), "").unwrap();
        let outcomes: Vec<_> = salvage(&folder.0).unwrap().into_iter().map(|one| one.outcome).collect();
        assert!(matches!(outcomes[..], [Salvaged::Empty, Salvaged::NotOurs(_)]), "{outcomes:?}");
        assert_eq!(folder.names(), ["b.mcap.damaged", "c.txt.active"]);
    }

    #[test]
    fn one_that_is_being_written_and_one_whose_name_is_taken_stay_as_they_are() {
        let folder = Folder::new("busy");
        let bytes = recording_bytes(&folder.0);
        fs::write(folder.0.join("a.mcap"), "old").unwrap();
        fs::write(folder.0.join("a.mcap.active"), &bytes).unwrap();
        let writer = Writer::create(&folder.0.join("b.mcap"), &WriterOptions::default()).unwrap();
        let outcomes: Vec<_> = salvage(&folder.0).unwrap().into_iter().map(|one| one.outcome).collect();
        assert!(matches!(outcomes[..], [Salvaged::NameTaken, Salvaged::BeingWritten]), "{outcomes:?}");
        assert_eq!(folder.names(), ["a.mcap", "a.mcap.active", "b.mcap.active"]);
        assert_eq!(fs::read(folder.0.join("a.mcap")).unwrap(), b"old");
        drop(writer);
        let outcomes: Vec<_> = salvage(&folder.0).unwrap().into_iter().map(|one| one.outcome).collect();
        assert!(!matches!(outcomes[1], Salvaged::BeingWritten), "{outcomes:?}");
    }
}
