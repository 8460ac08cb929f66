//! The stages that run and are to come, a line each, where a person looks on; those that are done stand above
//! as notes.

use std::cell::Cell;
use std::collections::VecDeque;
use std::fmt::Write;
use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};

use crate::cli::terminal::console::{Console, tick};
use crate::cli::terminal::stages::time_left::Ahead;

/// Steps of a bar.
const STEPS: u64 = 1000;
/// Less of a stage's work done tells nothing of its time yet.
const MIN_SHARE: f64 = 0.05;

/// See the module's text.
pub(super) struct StageList<'a> {
    console: &'a Console,
    /// The stage that runs, and whether it said how far it is.
    running: Option<(ProgressBar, Cell<bool>)>,
    to_come: VecDeque<(&'static str, ProgressBar)>,
    /// The last line: the time that everything still takes.
    whole: ProgressBar,
}

impl<'a> StageList<'a> {
    /// All of them are to come.
    pub(super) fn new(console: &'a Console, steps: &[&'static str]) -> Self {
        let plain = |name: &'static str| {
            let bar = console.line(ProgressBar::new(STEPS));
            bar.set_style(style("  {msg:.dim}"));
            bar.set_message(name);
            bar.tick();
            (name, bar)
        };
        let to_come = steps.iter().copied().map(plain).collect();
        let whole = console.line(ProgressBar::new(STEPS));
        whole.set_style(style("{whole}").with_key("whole", |_: &ProgressState, _: &mut dyn Write| ()));
        tick(&whole);
        Self { console, running: None, to_come, whole }
    }

    /// A stage begins; those before it that never did are over.
    pub(super) fn begin(&mut self, name: &'static str, ahead: Ahead) {
        if let Some(place) = self.to_come.iter().position(|(step, _)| *step == name) {
            self.to_come.drain(..=place).for_each(|(_, bar)| bar.finish_and_clear());
        }
        self.console.keep_below(self.to_come.len() + 1);
        let bar = self.console.line(ProgressBar::new(STEPS));
        bar.set_style(style("{spinner} {msg:<10} {elapsed}"));
        bar.set_message(name);
        tick(&bar);
        self.running = Some((bar, Cell::new(false)));
        self.whole.set_position(0);
        self.whole.reset_elapsed();
        let left = move |state: &ProgressState, out: &mut dyn Write| {
            let known = (state.pos() > 0).then(|| f64::from(state.fraction()));
            if let Some(left_s) = ahead.left_s(state.elapsed().as_secs_f64(), known) {
                let _ = write!(out, "  about {} left in all", words(left_s));
            }
        };
        self.whole.set_style(style("{whole}").with_key("whole", left));
    }

    /// This share of the running stage's work is done.
    pub(super) fn at(&self, share: f64) {
        let Some((bar, is_known)) = &self.running else { return };
        if !is_known.replace(true) {
            bar.set_style(
                style("{spinner} {msg:<10} {bar:30} {percent:>3} %  {elapsed}{left}").with_key("left", left),
            );
        }
        let steps = (share * STEPS as f64) as u64;
        bar.set_position(steps);
        self.whole.set_position(steps);
    }

    /// The running stage is done.
    pub(super) fn end(&mut self) {
        self.running.take().into_iter().for_each(|(bar, _)| bar.finish_and_clear());
    }
}

impl Drop for StageList<'_> {
    fn drop(&mut self) {
        self.end();
        self.to_come.drain(..).for_each(|(_, bar)| bar.finish_and_clear());
        self.whole.finish_and_clear();
        self.console.keep_below(0);
    }
}

/// The time that a stage takes until it is done.
fn left(state: &ProgressState, out: &mut dyn Write) {
    let share = f64::from(state.fraction());
    if (MIN_SHARE..1.0).contains(&share) {
        let left_s = state.elapsed().as_secs_f64() * (1.0 - share) / share;
        let _ = write!(out, ", {} left", words(left_s));
    }
}

fn words(seconds: f64) -> String {
    format!("{:#}", HumanDuration(Duration::from_secs_f64(seconds.max(1.0).round())))
}

/// Templates are ours, so they are right.
fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_spinner())
}
