//! What a person at the terminal sees besides results: notes and progress, on stderr only.

use std::borrow::Cow;
use std::io::IsTerminal;

use biplane_recording::Recording;
use indicatif::{ProgressBar, ProgressStyle};

/// Where notes go.
#[derive(Debug)]
pub struct Console {
    quiet: bool,
    terminal: bool,
}

impl Console {
    /// On stderr, or nowhere when quiet.
    pub fn new(quiet: bool) -> Self {
        Self { quiet, terminal: std::io::stderr().is_terminal() }
    }

    /// Says a line.
    pub fn note(&self, text: impl AsRef<str>) {
        if !self.quiet {
            eprintln!("{}", text.as_ref());
        }
    }

    /// Says which parts of a recording were not given.
    pub fn tell_missing(&self, recording: &Recording) {
        let missing: Vec<String> = recording.missing().iter().map(u32::to_string).collect();
        if !missing.is_empty() {
            self.note(format!(
                "{}: part {} is not among the parts",
                recording.path().display(),
                missing.join(", ")
            ));
        }
    }

    /// A bar that fills as work is done, when a person looks on; gone when it is dropped.
    pub fn bar(&self, whole: u64, text: impl Into<Cow<'static, str>>) -> Bar {
        if self.quiet || !self.terminal {
            return Bar(ProgressBar::hidden());
        }
        let bar = ProgressBar::new(whole).with_message(text);
        if let Ok(style) =
            ProgressStyle::with_template("{wide_bar} {human_pos}/{human_len} {msg} ({elapsed})")
        {
            bar.set_style(style);
        }
        bar.enable_steady_tick(std::time::Duration::from_millis(120));
        Bar(bar)
    }

    /// A turning sign with a text, when a person looks on; gone when it is dropped.
    pub fn spinner(&self, text: impl Into<Cow<'static, str>>) -> Spinner {
        if self.quiet || !self.terminal {
            return Spinner(ProgressBar::hidden());
        }
        let bar = ProgressBar::new_spinner().with_message(text);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(std::time::Duration::from_millis(120));
        Spinner(bar)
    }
}

/// See [`Console::bar`].
pub struct Bar(ProgressBar);

impl Bar {
    /// So much is done.
    pub fn at(&self, done: u64) {
        self.0.set_position(done);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// See [`Console::spinner`].
pub struct Spinner(ProgressBar);

impl Spinner {
    /// Another text.
    pub fn say(&self, text: impl Into<Cow<'static, str>>) {
        self.0.set_message(text);
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
