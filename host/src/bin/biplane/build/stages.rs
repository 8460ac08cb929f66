//! Times the stages of a build and says each as it ends.

use biplane::pipeline::{Observer, Stage};
use biplane::summary::{StageFigures, Summary};

use crate::console::{Console, Spinner};
use crate::moment::Moment;

/// See the module's text.
pub struct Stages<'a> {
    console: &'a Console,
    start: Moment,
    current: Option<(Moment, Spinner)>,
    done: Vec<StageFigures>,
}

impl<'a> Stages<'a> {
    /// Starts the clocks.
    pub fn new(console: &'a Console) -> Self {
        Self { console, start: Moment::now(), current: None, done: Vec::new() }
    }

    /// Runs a stage that returns what it made and how many of it.
    pub fn time<T>(
        &mut self,
        name: &'static str,
        stage: impl FnOnce() -> anyhow::Result<(T, usize)>,
    ) -> anyhow::Result<T> {
        self.begin(name);
        let (made, count) = stage()?;
        self.end(name, count);
        Ok(made)
    }

    /// Puts the figures into a summary.
    pub fn finish(self, summary: &mut Summary) {
        (summary.wall_s, summary.cpu_s) = self.start.elapsed_s();
        summary.peak_memory_bytes = biplane_clock::peak_memory_bytes();
        summary.stages = self.done;
    }

    fn begin(&mut self, name: &'static str) {
        self.current = Some((Moment::now(), self.console.spinner(name)));
    }

    fn end(&mut self, name: &str, count: usize) {
        let Some((moment, spinner)) = self.current.take() else { return };
        drop(spinner);
        let (wall_s, cpu_s) = moment.elapsed_s();
        let peak_memory_bytes = biplane_clock::peak_memory_bytes();
        self.console.note(format!("  {name:<10} {count:>9} {:<10} {wall_s:>7.2} s", unit(name)));
        self.done.push(StageFigures { stage: name.to_owned(), count, wall_s, cpu_s, peak_memory_bytes });
    }
}

/// What a stage counts.
fn unit(stage: &str) -> &'static str {
    match stage {
        "read" => "scans",
        "load" => "triangles",
        "map" => "cells",
        "optimize" => "loops",
        "cloud" => "points",
        "mesh" | "leftovers" => "triangles",
        "planes" => "planes",
        "polygons" => "polygons",
        "write" | "report" => "files",
        _ => "",
    }
}

impl Observer for Stages<'_> {
    fn begins(&mut self, stage: Stage) {
        self.begin(stage.name());
    }

    fn ended(&mut self, stage: Stage, count: usize) {
        self.end(stage.name(), count);
    }
}
