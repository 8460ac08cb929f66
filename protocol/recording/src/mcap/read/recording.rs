//! A recording that may lie in several files: parts of one run, read as if they were one file.
//!
//! One rule for every program: files that are given together are the parts of one recording, in the order of
//! their numbers, whatever order a shell gave them; a single file is itself; and a name that no file has, but
//! parts have (`RUN.mcap` for `RUN_0.mcap`, `RUN_1.mcap`, ...), means all of these.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::{Entry, ReadError, Reader};
use crate::mcap::write::{active_path, part_of, part_path, parts_on_disk};
use crate::rig::Rig;
use crate::topics::Topic;

/// An open recording, in one file or in parts.
#[derive(Debug)]
pub struct Recording {
    /// Never empty.
    parts: Vec<Reader>,
    numbers: Vec<u32>,
    unfinished: Vec<PathBuf>,
}

impl Recording {
    /// Opens the files that are meant.
    ///
    /// # Errors
    /// As [`Reader::open`]; [`ReadError::NotOneRecording`] for several files that are no parts of one
    /// recording.
    pub fn open(paths: &[PathBuf]) -> Result<Self, ReadError> {
        let (named, unfinished) = meant(paths)?;
        let parts: Vec<_> = named.iter().map(|(_, path)| Reader::open(path)).collect::<Result<_, _>>()?;
        check_one_run(&parts)?;
        let numbers = named.into_iter().filter_map(|(number, _)| number).collect();
        Ok(Self { parts, numbers, unfinished })
    }

    /// Parts that belong to it by their names and are not read, because they were never finished: they are
    /// being written, or were when the power went.
    #[must_use]
    pub fn unfinished(&self) -> &[PathBuf] {
        &self.unfinished
    }

    /// The files, in order.
    #[must_use]
    pub fn parts(&self) -> &[Reader] {
        &self.parts
    }

    /// The first file's name.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.first().path()
    }

    /// The first file; the others are like it in everything but their messages.
    #[must_use]
    pub fn first(&self) -> &Reader {
        &self.parts[0]
    }

    /// The names of all files, in order.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.parts.iter().map(Reader::path)
    }

    /// The size of all files together, bytes.
    #[must_use]
    pub fn size(&self) -> u64 {
        self.parts.iter().map(Reader::size).sum()
    }

    /// Numbers of parts that should be between the first and the last one here, and are not.
    #[must_use]
    pub fn missing(&self) -> Vec<u32> {
        let here: BTreeSet<_> = self.numbers.iter().copied().collect();
        let (Some(&first), Some(&last)) = (here.first(), here.last()) else { return Vec::new() };
        (first..last).filter(|number| !here.contains(number)).collect()
    }

    /// The rig that the recording was made with; `None` when it carries none.
    ///
    /// # Errors
    /// As [`Reader::rig`].
    pub fn rig(&self) -> Result<Option<Rig>, ReadError> {
        self.first().rig()
    }

    /// All messages, part after part, each in file order. What a part repeats of the one before
    /// (`/tf_static`) comes once. May be called several times.
    pub fn messages(&self) -> impl Iterator<Item = Result<Entry, ReadError>> + '_ {
        let mut latched: BTreeMap<Topic, Vec<u8>> = BTreeMap::new();
        let mut is_new = move |entry: &Entry| match entry.topic.filter(|topic| topic.is_latched()) {
            Some(topic) => latched.insert(topic, entry.bytes.clone()).as_ref() != Some(&entry.bytes),
            None => true,
        };
        let one = self.parts.len() < 2;
        let entries = self.parts.iter().flat_map(Reader::messages);
        entries.filter(move |entry| one || entry.as_ref().map_or(true, &mut is_new))
    }
}

/// Files with their numbers as parts.
type Named = Vec<(Option<u32>, PathBuf)>;

/// The files that are meant, and parts that were never finished.
fn meant(paths: &[PathBuf]) -> Result<(Named, Vec<PathBuf>), ReadError> {
    if let [path] = paths {
        let numbers = if path.exists() { Vec::new() } else { parts_on_disk(path) };
        let parts = numbers.into_iter().map(|number| (Some(number), part_path(path, number)));
        let (finished, begun): (Named, Named) = parts.partition(|(_, part)| part.exists());
        if let ([], Some((_, part))) = (&finished[..], begun.first()) {
            return Err(ReadError::Unfinished { path: path.clone(), unfinished: active_path(part) });
        }
        if finished.is_empty() {
            return Ok((vec![(None, path.clone())], Vec::new()));
        }
        return Ok((finished, begun.iter().map(|(_, part)| active_path(part)).collect()));
    }
    if paths.is_empty() {
        return Err(ReadError::Missing { path: PathBuf::new() });
    }
    let mut parts = BTreeMap::new();
    let mut whole = None;
    for path in paths {
        let Some((name, number)) = part_of(path) else { return Err(not_one(paths, path)) };
        if *whole.get_or_insert_with(|| name.clone()) != name {
            return Err(not_one(paths, path));
        }
        parts.insert(number, path.clone());
    }
    Ok((parts.into_iter().map(|(number, path)| (Some(number), path)).collect(), Vec::new()))
}

/// Parts of one recording tell the same start of their run. Those that tell none may belong to any.
fn check_one_run(parts: &[Reader]) -> Result<(), ReadError> {
    if parts.len() < 2 {
        return Ok(());
    }
    let reported: Vec<_> = parts.iter().filter_map(|part| Some((part, part.run_began()?))).collect();
    match reported.windows(2).find(|pair| pair[0].1 != pair[1].1) {
        Some(pair) => Err(ReadError::NotOneRecording {
            path: pair[1].0.path().to_owned(),
            other: pair[0].0.path().to_owned(),
        }),
        None => Ok(()),
    }
}

fn not_one(paths: &[PathBuf], odd: &Path) -> ReadError {
    let other = paths.iter().find(|path| *path != odd).map_or_else(|| odd.to_owned(), PathBuf::clone);
    ReadError::NotOneRecording { path: odd.to_owned(), other }
}
