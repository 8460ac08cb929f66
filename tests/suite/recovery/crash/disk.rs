//! A disk that remembers all that was asked of it, in simulated time, and what a power cut at any moment may
//! leave of it.
//!
//! What was synced stays. Of the rest a cut leaves what it likes: of a file's bytes any of its pages, whole,
//! in sectors, or as they were between two writes; zeros or other bytes where the file grew and its data did
//! not come; of the folder's names any of the changes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use biplane_mock::rng::Rng;
use biplane_recording::Disk;
use biplane_recording::mcap::write::{Storage, StoredFile};

const PAGE: usize = 4096;
const SECTOR: usize = 512;

/// Files by their names.
pub(super) type Files = BTreeMap<String, Vec<u8>>;

/// What a disk refuses.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) enum Refusal {
    /// The n-th thing asked fails so, and all after it.
    From(usize, ErrorKind),
    /// Every other write is interrupted by a signal, every other takes a few bytes only.
    Stutter,
}

#[derive(Clone, Debug)]
enum Asked {
    Create { file: usize, name: String },
    Append { file: usize, to: usize },
    Sync { file: usize },
    Rename { from: String, to: String },
    Remove { name: String },
    SyncFolder,
}

#[derive(Clone, Debug)]
struct Done {
    start_ns: i64,
    end_ns: i64,
    asked: Asked,
}

#[derive(Debug)]
struct State {
    now_ns: i64,
    /// How long a sync takes at least, and how much longer at most.
    sync_ns: (i64, i64),
    rng: Rng,
    refusal: Option<Refusal>,
    asked: usize,
    /// What was on the disk from the start: names and bytes.
    before: Files,
    files: Vec<Vec<u8>>,
    done: Vec<Done>,
}

/// The disk; the files stand in a real folder besides, for whoever reads them back.
#[derive(Clone, Debug)]
pub(super) struct SimDisk(Arc<Mutex<State>>);

impl SimDisk {
    /// A disk with what is in `folder`, at a time, whose syncs take so long.
    pub(super) fn over(folder: &Path, now_ns: i64, sync_ns: (i64, i64), seed: u64) -> Self {
        Self(Arc::new(Mutex::new(State {
            now_ns,
            sync_ns,
            rng: Rng::new(seed, 0xD15C, 0),
            refusal: None,
            asked: 0,
            before: read_folder(folder),
            files: Vec::new(),
            done: Vec::new(),
        })))
    }

    /// The same as a writer takes it.
    pub(super) fn disk(&self) -> Disk {
        Disk::of(Arc::new(self.clone()))
    }

    pub(super) fn refuse(&self, refusal: Refusal) {
        self.state().refusal = Some(refusal);
    }

    pub(super) fn now_ns(&self) -> i64 {
        self.state().now_ns
    }

    pub(super) fn wait_until(&self, ns: i64) {
        let mut state = self.state();
        state.now_ns = state.now_ns.max(ns);
    }

    /// How many things were asked of it.
    pub(super) fn asked(&self) -> usize {
        self.state().asked
    }

    /// What a cut at `at_ns` leaves, one of the many possibilities.
    pub(super) fn cut(&self, at_ns: i64, rng: &mut Rng) -> Files {
        self.state().cut(at_ns, rng)
    }

    /// What the end of the process alone leaves at `at_ns`: all that it had handed to the system.
    pub(super) fn killed(&self, at_ns: i64) -> Files {
        self.state().killed(at_ns)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap()
    }
}

/// The files in a folder.
pub(super) fn read_folder(folder: &Path) -> Files {
    let entries = std::fs::read_dir(folder).unwrap().map(Result::unwrap);
    entries.map(|entry| (name_of(&entry.path()), std::fs::read(entry.path()).unwrap())).collect()
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap().to_str().unwrap().to_owned()
}

/// A number below another.
pub(super) fn below(rng: &mut Rng, limit: usize) -> usize {
    (rng.bits() % limit.max(1) as u64) as usize
}

impl State {
    /// Time passes, what was asked is noted; or it is refused.
    fn ask(&mut self, took_ns: i64, asked: Asked) -> io::Result<()> {
        self.asked += 1;
        if let Some(Refusal::From(number, kind)) = self.refusal
            && self.asked > number
        {
            return Err(kind.into());
        }
        let start_ns = self.now_ns;
        self.now_ns += took_ns;
        self.done.push(Done { start_ns, end_ns: self.now_ns, asked });
        Ok(())
    }

    fn sync_takes_ns(&mut self) -> i64 {
        let (minimum, more) = self.sync_ns;
        minimum + (self.rng.unit() * more as f64) as i64
    }

    fn cut(&self, at_ns: i64, rng: &mut Rng) -> Files {
        let mut synced = vec![0; self.files.len()];
        // Lengths that each file had after its writes since the last sync.
        let mut lengths: Vec<Vec<usize>> = vec![vec![0]; self.files.len()];
        let (mut names, mut pending) = (Vec::new(), Vec::new());
        for done in self.done.iter().take_while(|done| done.start_ns <= at_ns) {
            let is_over = done.end_ns <= at_ns;
            match &done.asked {
                Asked::Append { file, to } => {
                    let from = lengths[*file].last().copied().unwrap_or(0);
                    let end = if is_over { *to } else { from + below(rng, to - from + 1) };
                    lengths[*file].push(end);
                }
                Asked::Sync { file } if is_over => {
                    let length = lengths[*file].last().copied().unwrap_or(0);
                    synced[*file] = length;
                    lengths[*file] = vec![length];
                }
                Asked::SyncFolder if is_over => names.append(&mut pending),
                Asked::Sync { .. } | Asked::SyncFolder => {}
                change => pending.push(change.clone()),
            }
        }
        let kept = below(rng, pending.len() + 1);
        let some_of_them = rng.bits().is_multiple_of(2);
        for (number, change) in pending.into_iter().enumerate() {
            let keep = if some_of_them { rng.bits().is_multiple_of(2) } else { number < kept };
            if keep {
                names.push(change);
            }
        }
        let garbage = rng.bits().is_multiple_of(4);
        let mut content =
            |file: usize| left_of(&self.files[file], synced[file], &lengths[file], garbage, rng);
        let mut left = self.before.clone();
        for change in names {
            match change {
                Asked::Create { file, name } => drop(left.insert(name, content(file))),
                Asked::Rename { from, to } => {
                    let file = self.file_named(&from, at_ns);
                    let moved = left.remove(&from);
                    let bytes = moved.or_else(|| file.map(&mut content));
                    left.extend(bytes.map(|bytes| (to, bytes)));
                }
                Asked::Remove { name } => drop(left.remove(&name)),
                _ => {}
            }
        }
        left
    }

    fn killed(&self, at_ns: i64) -> Files {
        let mut left = self.before.clone();
        let mut names = BTreeMap::new();
        for done in self.done.iter().take_while(|done| done.end_ns <= at_ns) {
            match &done.asked {
                Asked::Create { file, name } => {
                    names.insert(*file, name.clone());
                    left.insert(name.clone(), Vec::new());
                }
                Asked::Append { file, to } => {
                    let name = names.get(file).cloned().unwrap();
                    left.insert(name, self.files[*file][..*to].to_vec());
                }
                Asked::Rename { from, to } => {
                    names.values_mut().filter(|name| *name == from).for_each(|name| name.clone_from(to));
                    let bytes = left.remove(from).unwrap();
                    left.insert(to.clone(), bytes);
                }
                Asked::Remove { name } => drop(left.remove(name)),
                Asked::Sync { .. } | Asked::SyncFolder => {}
            }
        }
        left
    }

    /// The file that was created under a name, if it was here.
    fn file_named(&self, wanted: &str, at_ns: i64) -> Option<usize> {
        let before = self.done.iter().rev().skip_while(|done| done.start_ns > at_ns);
        before.into_iter().find_map(|done| match &done.asked {
            Asked::Create { file, name } if name == wanted => Some(*file),
            _ => None,
        })
    }
}

/// What a cut leaves of a file's bytes: those that were synced, and of the rest some.
fn left_of(bytes: &[u8], synced: usize, lengths: &[usize], garbage: bool, rng: &mut Rng) -> Vec<u8> {
    let written = lengths.last().copied().unwrap_or(synced);
    let length = match rng.bits() % 4 {
        0 => synced + below(rng, written - synced + 1),
        1 => (synced + below(rng, written - synced + 1)).next_multiple_of(PAGE).min(written),
        _ => written,
    };
    let mut left = bytes[..synced].to_vec();
    let stale = |rng: &mut Rng| if garbage { rng.bits() as u8 } else { 0 };
    left.extend((synced..length).map(|_| stale(rng)));
    let whole_pages = rng.bits() % 8;
    for page in (synced / PAGE * PAGE..length).step_by(PAGE) {
        let end = (page + PAGE).min(length);
        // As the page was between two writes, or as it is.
        let version = lengths[below(rng, lengths.len())].clamp(synced, end);
        match rng.bits() % 8 {
            choice if choice < whole_pages => copy(&mut left, bytes, page.max(synced), end),
            5 => copy(&mut left, bytes, page.max(synced).min(version), version),
            6 => {
                for sector in
                    (page..end).step_by(SECTOR).filter(|_| rng.bits().is_multiple_of(2)).collect::<Vec<_>>()
                {
                    copy(&mut left, bytes, sector.max(synced), (sector + SECTOR).min(end));
                }
            }
            _ => {}
        }
    }
    left
}

fn copy(to: &mut [u8], from: &[u8], start: usize, end: usize) {
    if start < end {
        to[start..end].copy_from_slice(&from[start..end]);
    }
}

impl Storage for SimDisk {
    fn create(&self, path: &Path) -> io::Result<Arc<dyn StoredFile>> {
        let mut state = self.state();
        let file = state.files.len();
        state.ask(100_000, Asked::Create { file, name: name_of(path) })?;
        state.files.push(Vec::new());
        let real = File::options().write(true).create_new(true).open(path)?;
        real.try_lock()?;
        Ok(Arc::new(SimFile { disk: self.clone(), file, real }))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.state().ask(100_000, Asked::Rename { from: name_of(from), to: name_of(to) })?;
        std::fs::rename(from, to)
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        // What is not there cannot be removed, and nothing is asked of the disk.
        path.symlink_metadata()?;
        self.state().ask(100_000, Asked::Remove { name: name_of(path) })?;
        std::fs::remove_file(path)
    }

    fn sync_folder(&self, _folder: &Path) -> io::Result<()> {
        let mut state = self.state();
        let took_ns = state.sync_takes_ns();
        state.ask(took_ns, Asked::SyncFolder)
    }
}

struct SimFile {
    disk: SimDisk,
    file: usize,
    real: File,
}

impl StoredFile for SimFile {
    fn append(&self, bytes: &[u8]) -> io::Result<usize> {
        let mut state = self.disk.state();
        let mut taken = bytes.len();
        if state.refusal == Some(Refusal::Stutter) {
            match state.rng.bits() % 3 {
                0 => return Err(ErrorKind::Interrupted.into()),
                1 => taken = taken.min(1 + below(&mut state.rng, 300)),
                _ => {}
            }
        }
        let to = state.files[self.file].len() + taken;
        state.ask(30_000, Asked::Append { file: self.file, to })?;
        state.files[self.file].extend_from_slice(&bytes[..taken]);
        (&mut &self.real).write_all(&bytes[..taken])?;
        Ok(taken)
    }

    fn sync(&self) -> io::Result<()> {
        let mut state = self.disk.state();
        let took_ns = state.sync_takes_ns();
        state.ask(took_ns, Asked::Sync { file: self.file })
    }

    fn size(&self) -> io::Result<u64> {
        Ok(self.real.metadata()?.len())
    }
}

/// A folder that goes away.
pub(super) struct Folder(pub PathBuf);

impl Folder {
    pub(super) fn new(name: &str) -> Self {
        Self(crate::accuracy::recorded::folder(name))
    }

    /// Empties it and puts these files there.
    pub(super) fn fill(&self, files: &Files) {
        let _ = std::fs::remove_dir_all(&self.0);
        std::fs::create_dir_all(&self.0).unwrap();
        for (name, bytes) in files {
            std::fs::write(self.0.join(name), bytes).unwrap();
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
