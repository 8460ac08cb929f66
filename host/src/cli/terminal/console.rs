//! What a person at the terminal sees besides results: notes and progress, on stderr only.

use std::borrow::Cow;
use std::cell::Cell;
use std::io::IsTerminal;
use std::path::Path;

use crate::cli::terminal::heartbeat::{HEARTBEAT, Heartbeat};
use crate::recordings::run::RunPoses;
use crate::recordings::step_back;
use crate::view::floor_map::map_image::Coarsened;
pub(crate) use biplane_cli::say;
use biplane_recording::Recording;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// Where notes go.
#[derive(Debug)]
pub(crate) struct Console {
    quiet: bool,
    verbose: bool,
    /// Lines that change, where a person looks on.
    lines: Option<Lines>,
}

#[derive(Debug)]
struct Lines {
    all: MultiProgress,
    /// So many of them stay at the bottom, below what comes and goes.
    below: Cell<usize>,
}

impl Console {
    /// On stderr, or nowhere when quiet; with more to say when verbose.
    pub(crate) fn new(quiet: bool, verbose: bool) -> Self {
        let is_seen = !quiet && std::io::stderr().is_terminal();
        let lines = is_seen.then(|| Lines { all: MultiProgress::new(), below: Cell::new(0) });
        Self { quiet, verbose, lines }
    }

    /// Whether notes go where nobody looks on: a file, another program.
    pub(crate) fn is_log(&self) -> bool {
        !self.quiet && self.lines.is_none()
    }

    /// Says a line.
    pub(crate) fn note(&self, text: impl AsRef<str>) {
        if !self.quiet {
            self.warn(text);
        }
    }

    /// Says a line that only those want who asked for more.
    pub(crate) fn detail(&self, text: impl FnOnce() -> String) {
        if self.verbose {
            self.warn(text());
        }
    }

    /// Says which files a finished folder holds, and how large they are, to those who asked for more.
    pub(crate) fn detail_files(&self, folder: &Path) {
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        let mut files: Vec<_> = entries
            .flatten()
            .filter_map(|entry| {
                Some((entry.file_name(), entry.metadata().ok().filter(|file| file.is_file())?))
            })
            .collect();
        files.sort_by(|(a, _), (b, _)| a.cmp(b));
        for (name, file) in files {
            self.detail(|| format!("  {:>12} bytes  {}", file.len(), folder.join(name).display()));
        }
    }

    /// Says the parameters, all of them, to those who asked for more.
    pub(crate) fn detail_parameters(&self, parameters: &impl serde::Serialize) {
        self.detail(|| format!("parameters: {}", serde_json::to_string(parameters).unwrap_or_default()));
    }

    /// Says a line, also when quiet.
    pub(crate) fn warn(&self, text: impl AsRef<str>) {
        let say = || say(text.as_ref());
        match &self.lines {
            // Lines that change make way for it.
            Some(lines) => lines.all.suspend(say),
            None => say(),
        }
    }

    /// Puts a line that changes above those that stay at the bottom; hidden where nobody looks on.
    pub(crate) fn line(&self, bar: ProgressBar) -> ProgressBar {
        match &self.lines {
            Some(lines) => lines.all.insert_from_back(lines.below.get(), bar),
            None => ProgressBar::hidden(),
        }
    }

    /// The last so many lines stay at the bottom from now on.
    pub(crate) fn keep_below(&self, count: usize) {
        if let Some(lines) = &self.lines {
            lines.below.set(count);
        }
    }

    /// Says which parts of a recording were not given.
    pub(crate) fn report_missing(&self, recording: &Recording) {
        for unfinished in recording.unfinished() {
            // Said even when quiet: it may hold data.
            self.warn(format!(
                "biplane: {}: a part that is not finished is left out; where nothing records it any more, `biplane-onboard salvage` makes it whole",
                unfinished.display()
            ));
        }
        let missing: Vec<String> = recording.missing().iter().map(u32::to_string).collect();
        if !missing.is_empty() {
            self.note(format!(
                "{}: part {} is not among the parts",
                recording.path().display(),
                missing.join(", ")
            ));
        }
    }

    /// Says how many poses of a file were left out, where there were any.
    pub(crate) fn report_wild_poses(&self, path: &Path, count: usize) {
        if count > 0 {
            self.warn(format!(
                "biplane: {}: poses left out because no motion explains them: {count} (their scans are placed between their neighbors)",
                path.display()
            ));
        }
    }

    /// Says that poses cannot be found by their times.
    pub(crate) fn report_step_back(&self, path: &Path, step_back_ns: i64) {
        if let Some(words) = step_back::words(step_back_ns) {
            self.warn(format!("biplane: {}: {words}", path.display()));
        }
    }

    /// Says that a map is drawn with larger cells than it should have.
    pub(crate) fn report_coarsened(&self, coarsened: Option<&Coarsened>) {
        if let Some(Coarsened { size: [columns, rows], asked_m, drawn_m }) = coarsened {
            self.warn(format!(
                "biplane: the places seen lie so far apart that a map would have {columns} x {rows} cells of {asked_m} m; it is drawn with cells of {drawn_m} m"
            ));
        }
    }

    /// Says what is wrong with the poses of a recording, also when quiet: those that are left out, and what
    /// the robot itself has said against how its lasers sit.
    pub(crate) fn report_poses(&self, recording: &Recording, poses: &RunPoses) {
        self.report_wild_poses(recording.path(), poses.wild_poses);
        self.report_step_back(recording.path(), poses.step_back_ns);
        for mounting in &poses.mountings {
            self.warn(format!(
                "biplane: {}: the recording says of itself: {mounting} (docs/recording.md)",
                recording.path().display()
            ));
        }
    }

    /// A bar that fills as work is done, when a person looks on; gone when it is dropped.
    pub(crate) fn bar(&self, whole: u64, text: impl Into<Cow<'static, str>>) -> Bar {
        let bar = self.line(ProgressBar::new(whole)).with_message(text);
        if let Ok(style) =
            ProgressStyle::with_template("{wide_bar} {human_pos}/{human_len} {msg} ({elapsed})")
        {
            bar.set_style(style);
        }
        tick(&bar);
        Bar(bar)
    }

    /// A turning sign with a text, when a person looks on; gone when it is dropped. Where stderr is no
    /// terminal the text is a line from time to time instead.
    pub(crate) fn spinner(&self, text: impl Into<Cow<'static, str>>) -> Spinner {
        let text = text.into();
        let is_seen = self.lines.is_some() || self.quiet;
        let heartbeat = (!is_seen).then(|| Heartbeat::new(HEARTBEAT, &text, say));
        let bar = self.line(ProgressBar::new_spinner()).with_message(text);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            bar.set_style(style);
        }
        tick(&bar);
        Spinner { bar, heartbeat }
    }
}

/// Draws a line anew from time to time, unless nobody sees it.
pub(crate) fn tick(bar: &ProgressBar) {
    if !bar.is_hidden() {
        bar.enable_steady_tick(std::time::Duration::from_millis(120));
    }
}

/// See [`Console::bar`].
pub(crate) struct Bar(ProgressBar);

impl Bar {
    /// So much is done.
    pub(crate) fn at(&self, done: u64) {
        self.0.set_position(done);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// See [`Console::spinner`].
pub(crate) struct Spinner {
    bar: ProgressBar,
    heartbeat: Option<Heartbeat>,
}

impl Spinner {
    /// Another text.
    pub(crate) fn say(&self, text: impl Into<Cow<'static, str>>) {
        let text = text.into();
        if let Some(heartbeat) = &self.heartbeat {
            heartbeat.set(&text);
        }
        self.bar.set_message(text);
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
