//! A recording in parts: `RUN_0.mcap`, `RUN_1.mcap`, ..., each whole and readable alone, so that neither the
//! index in memory nor what a broken disk can take grows with the hours.
//!
//! A part repeats attachments, metadata and what is told once for all (`/tf_static`); every other message
//! stands in exactly one part. Log times and message numbers go on from part to part.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::saving::Pace;
use super::target::{self, active_path, is_being_written};
use super::writer::ResumePoint;
use super::{TakenAway, Whereabouts, WriteError, WriteReport, Writer, WriterOptions};
use crate::messages::Message;
use crate::topics::Topic;

/// When the next part begins. Without any bound there is one file, under the plain name.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct Rotation {
    /// A part spans at most so much log time, nanoseconds.
    pub span_ns: Option<i64>,
    /// A part ends when it is this large, bytes; it may be larger by one chunk and the index.
    pub bytes: Option<u64>,
}

impl Rotation {
    /// Whether there are parts at all.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.span_ns.is_some() || self.bytes.is_some()
    }
}

/// The name of a part: `RUN.mcap` and 3 give `RUN_3.mcap`.
#[must_use]
pub fn part_path(path: &Path, number: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("_{number}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// The number in a part's name, and the name that all parts share.
pub(crate) fn part_of(path: &Path) -> Option<(PathBuf, u32)> {
    let (stem, digits) = path.file_stem()?.to_str()?.rsplit_once('_')?;
    let number: u32 = digits.parse().ok()?;
    let mut name = stem.to_owned();
    if let Some(extension) = path.extension() {
        name.push('.');
        name.push_str(extension.to_str()?);
    }
    let whole = path.with_file_name(name);
    // `RUN_03` or `RUN_+3` are names of somebody else's.
    (part_path(&whole, number) == path).then_some((whole, number))
}

/// The numbers of the parts of `path` in its folder, finished or not, in their order.
pub(crate) fn parts_on_disk(path: &Path) -> Vec<u32> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let number = |name: std::ffi::OsString| {
        let name = name.to_str()?;
        let finished = name.strip_suffix(".active").unwrap_or(name);
        part_of(&path.with_file_name(finished)).filter(|(whole, _)| whole == path).map(|(_, number)| number)
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let numbers: BTreeSet<_> = entries.filter_map(|entry| number(entry.file_name())).collect();
    numbers.into_iter().collect()
}

/// What a finished recording holds.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct PartsReport {
    /// The files, in order; one without rotation.
    pub parts: Vec<WriteReport>,
    /// Messages in files that somebody removed while they were written.
    pub removed_messages: u64,
}

/// Writes a recording, in one file or in parts.
#[derive(Debug)]
pub struct PartsWriter {
    path: PathBuf,
    options: WriterOptions,
    rotation: Rotation,
    /// None after a failure between two parts.
    writer: Option<Writer>,
    number: u32,
    start_ns: Option<i64>,
    attachments: Vec<(String, String, Vec<u8>)>,
    metadata: Vec<(String, BTreeMap<String, String>)>,
    /// The last message of each topic that is told once for all: its stamp and its bytes.
    latched: BTreeMap<Topic, (i64, Vec<u8>)>,
    finished: Vec<WriteReport>,
    removed_messages: u64,
    /// Whether the file was taken away, and no other could be begun.
    is_astray: bool,
    pace: Pace,
    scratch: Vec<u8>,
}

impl PartsWriter {
    /// Starts the first file.
    ///
    /// # Errors
    /// As [`PartsWriter::check`], or what the system refuses.
    pub fn create(path: &Path, options: &WriterOptions, rotation: Rotation) -> Result<Self, WriteError> {
        Self::check(path, options, rotation)?;
        let first = if rotation.is_on() { part_path(path, 0) } else { path.to_owned() };
        Ok(Self {
            path: path.to_owned(),
            options: options.clone(),
            rotation,
            writer: Some(Writer::create(&first, options)?),
            number: 0,
            start_ns: None,
            attachments: Vec::new(),
            metadata: Vec::new(),
            latched: BTreeMap::new(),
            finished: Vec::new(),
            removed_messages: 0,
            is_astray: false,
            pace: Pace::default(),
            scratch: Vec::new(),
        })
    }

    /// Whether [`PartsWriter::create`] would begin; nothing is created. Every file of that name that is there
    /// already counts as an existing output, parts and whole file alike: two runs must not be taken for one
    /// recording.
    ///
    /// # Errors
    /// As [`Writer::check`].
    pub fn check(path: &Path, options: &WriterOptions, rotation: Rotation) -> Result<(), WriteError> {
        Writer::check(path, options)?;
        if rotation.is_on() {
            Writer::check(&part_path(path, 0), options)?;
        }
        parts_on_disk(path)
            .into_iter()
            .try_for_each(|number| Writer::check(&part_path(path, number), options))
    }

    /// Removes what a run that failed has begun, so that it does not stand in the way of the next attempt:
    /// what is unfinished, and, where nothing was to be overwritten, so that every part is of that run, the
    /// finished parts. What another process is writing stays.
    pub fn remove_begun(path: &Path, options: &WriterOptions, rotation: Rotation) {
        let remove_unfinished = |path: &Path| {
            if !is_being_written(path) {
                let _ = options.disk.storage().remove(path);
            }
        };
        if !rotation.is_on() {
            remove_unfinished(&active_path(path));
            return;
        }
        for part in parts_on_disk(path).into_iter().map(|number| part_path(path, number)) {
            remove_unfinished(&active_path(&part));
            if !options.overwrite {
                let _ = options.disk.storage().remove(&part);
            }
        }
    }

    /// The file that is being written will have this name.
    #[must_use]
    pub fn current_path(&self) -> PathBuf {
        if self.rotation.is_on() { part_path(&self.path, self.number) } else { self.path.clone() }
    }

    /// Adds a file to the file, and to every later part.
    ///
    /// # Errors
    /// As [`Writer::attach`].
    pub fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> Result<(), WriteError> {
        self.attachments.push((name.to_owned(), media_type.to_owned(), data.to_vec()));
        self.writer()?.attach(name, media_type, data)
    }

    /// Adds named words, here and in every later part.
    ///
    /// # Errors
    /// As [`Writer::metadata`].
    pub fn metadata(&mut self, name: &str, values: &BTreeMap<String, String>) -> Result<(), WriteError> {
        self.metadata.push((name.to_owned(), values.clone()));
        self.writer()?.metadata(name, values)
    }

    /// Writes a message; times as for [`Writer::write`].
    ///
    /// # Errors
    /// As [`PartsWriter::write_encoded`].
    pub fn write<M: Message>(
        &mut self,
        topic: Topic,
        log_time_ns: i64,
        publish_time_ns: i64,
        message: &M,
    ) -> Result<(), WriteError> {
        let mut bytes = std::mem::take(&mut self.scratch);
        message.encode(&mut bytes);
        let result = self.write_encoded(topic, log_time_ns, publish_time_ns, &bytes);
        self.scratch = bytes;
        result
    }

    /// Writes a message that is encoded already, into the next part when this one is full.
    ///
    /// # Errors
    /// As [`Writer::write`], and as [`Writer::finish`] and [`Writer::create`] between two parts. After an
    /// error nothing more is written.
    pub fn write_encoded(
        &mut self,
        topic: Topic,
        log_time_ns: i64,
        publish_time_ns: i64,
        cdr: &[u8],
    ) -> Result<(), WriteError> {
        if self.is_full(log_time_ns)? {
            self.rotate()?;
        }
        if topic.is_latched() {
            self.latched.insert(topic, (publish_time_ns, cdr.to_vec()));
        }
        self.start_ns.get_or_insert(log_time_ns);
        self.writer()?.write_encoded(topic, log_time_ns, publish_time_ns, cdr)
    }

    fn is_full(&mut self, log_time_ns: i64) -> Result<bool, WriteError> {
        let Some(start_ns) = self.start_ns else { return Ok(false) };
        let rotation = self.rotation;
        let span_ns = log_time_ns.saturating_sub(start_ns);
        let bytes = self.writer()?.flushed_bytes();
        Ok(rotation.span_ns.is_some_and(|limit| span_ns >= limit)
            || rotation.bytes.is_some_and(|limit| bytes >= limit))
    }

    /// Ends the part and begins the next one, unless nothing is in this one yet; false where there are no
    /// parts.
    ///
    /// # Errors
    /// As [`Writer::finish`] and [`Writer::create`].
    pub fn rotate_now(&mut self) -> Result<bool, WriteError> {
        if self.rotation.is_on() && self.start_ns.is_some() {
            self.rotate()?;
        }
        Ok(self.rotation.is_on())
    }

    fn rotate(&mut self) -> Result<(), WriteError> {
        let writer = self.writer.take().ok_or_else(|| WriteError::Failed { path: self.current_path() })?;
        let resume_point = writer.resume_point();
        self.finished.push(writer.finish()?);
        self.number += 1;
        self.writer = Some(self.begin_next(resume_point)?);
        Ok(())
    }

    /// Begins the file that goes on where another one ended.
    fn begin_next(&mut self, resume_point: ResumePoint) -> Result<Writer, WriteError> {
        let log_time_ns = resume_point.0;
        self.start_ns = None;
        let mut next = Writer::create(&self.current_path(), &self.options)?;
        next.resume(resume_point);
        for (name, media_type, data) in &self.attachments {
            next.attach(name, media_type, data)?;
        }
        for (name, values) in &self.metadata {
            next.metadata(name, values)?;
        }
        for (&topic, (publish_time_ns, cdr)) in &self.latched {
            next.write_encoded(topic, log_time_ns, *publish_time_ns, cdr)?;
        }
        next.is_repeated();
        Ok(next)
    }

    /// Looks whether the file is still where it was begun. When somebody has removed or moved it, the
    /// recording goes on in a new file, in a folder made anew where that is gone: with the next number in a
    /// recording in parts, under the same name in one without.
    ///
    /// # Errors
    /// Of a file that failed before.
    pub fn look_for_file(&mut self) -> Result<Option<TakenAway>, WriteError> {
        let path = active_path(&self.current_path());
        let writer = self.writer()?;
        let whereabouts = writer.whereabouts();
        if whereabouts == Whereabouts::InPlace || self.is_astray {
            return Ok(None);
        }
        let is_removed = whereabouts == Whereabouts::Removed;
        let (messages, resume_point) = (self.writer()?.messages(), self.writer()?.resume_point());
        let number = self.number;
        self.number += u32::from(self.rotation.is_on());
        if let Some(folder) = path.parent() {
            // Where that fails, so does the file in it.
            let _ = std::fs::create_dir_all(folder);
        }
        let Ok(next) = self.begin_next(resume_point) else {
            (self.number, self.is_astray) = (number, true);
            return Ok(Some(TakenAway { path, is_removed, messages, goes_on_in: None }));
        };
        if let Some(old) = self.writer.replace(next).filter(|_| !is_removed) {
            // All messages are in it: without an index it can still be recovered.
            let _ = old.end();
        }
        self.removed_messages += if is_removed { messages } else { 0 };
        Ok(Some(TakenAway { path, is_removed, messages, goes_on_in: Some(self.current_path()) }))
    }

    /// Brings everything so far to the file.
    ///
    /// # Errors
    /// As [`Writer::flush`].
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.writer()?.flush()
    }

    /// Brings everything so far to the disk when the first message that is not there yet becomes so old that
    /// it could be more than [`PROMISED_NS`](super::PROMISED_NS) when it is there; true when that was done.
    /// Log times must be those of `clock`.
    ///
    /// Whoever records live calls this often, and whenever there is nothing more to write for the moment:
    /// then a disk that is slower than the promise takes all that has come meanwhile at once, and falls no
    /// further behind.
    ///
    /// # Errors
    /// As [`PartsWriter::flush`].
    pub fn save_if_due(&mut self, clock: &dyn Fn() -> i64) -> Result<bool, WriteError> {
        let Some(since_ns) = self.writer()?.unsaved_since_ns() else { return Ok(false) };
        let start_ns = clock();
        if start_ns.saturating_sub(since_ns) < self.pace.patience_ns() {
            return Ok(false);
        }
        self.flush()?;
        let end_ns = clock();
        self.pace.saved(end_ns - start_ns, end_ns - since_ns);
        Ok(true)
    }

    /// What a power cut would have cost in the worst moment since this was last asked, ns: the greatest age
    /// that a message came to before it was on the disk, so far as [`PartsWriter::save_if_due`] brought it
    /// there.
    pub fn take_worst_age_ns(&mut self) -> i64 {
        self.pace.take_worst_ns()
    }

    fn writer(&mut self) -> Result<&mut Writer, WriteError> {
        match &mut self.writer {
            Some(writer) => Ok(writer),
            None => Err(WriteError::Failed { path: part_path(&self.path, self.number) }),
        }
    }

    /// Ends the last file. Files of an earlier recording of that name that this one has not replaced are
    /// removed, parts or the whole file: it was told to overwrite that recording.
    ///
    /// # Errors
    /// As [`Writer::finish`].
    pub fn finish(mut self) -> Result<PartsReport, WriteError> {
        let writer = self.writer.take().ok_or_else(|| WriteError::Failed { path: self.current_path() })?;
        self.finished.push(writer.finish()?);
        if self.options.overwrite {
            self.remove_replaced()?;
        }
        Ok(PartsReport { parts: self.finished, removed_messages: self.removed_messages })
    }

    fn remove_replaced(&self) -> Result<(), WriteError> {
        let is_own = |number: u32| self.rotation.is_on() && number <= self.number;
        for number in parts_on_disk(&self.path).into_iter().filter(|&number| !is_own(number)) {
            target::remove_replaced(&part_path(&self.path, number), &self.options)?;
        }
        if self.rotation.is_on() {
            target::remove_replaced(&self.path, &self.options)?;
        }
        Ok(())
    }
}
