//! Times the stages of a build and says each as it ends; shows which one runs and which are to come.

use biplane::pipeline::{Observer, Stage};
use biplane::summary::{StageFigures, Summary};

use super::ahead::Pace;
use super::stage_list::StageList;
use crate::console::Console;
use crate::moment::Moment;

/// See the module's text.
pub struct Stages<'a> {
    console: &'a Console,
    start: Moment,
    current: Option<Moment>,
    list: StageList<'a>,
    pace: Pace,
    done: Vec<StageFigures>,
}

impl<'a> Stages<'a> {
    /// Starts the clocks. `steps` are the stages in their order.
    pub fn new(console: &'a Console, steps: &[&'static str]) -> Self {
        Self {
            console,
            start: Moment::now(),
            current: None,
            list: StageList::new(console, steps),
            pace: Pace::new(steps),
            done: Vec::new(),
        }
    }

    /// Runs a stage that returns what it made and how many of it.
    pub fn time<T>(
        &mut self,
        name: &'static str,
        stage: impl FnOnce() -> anyhow::Result<(T, usize)>,
    ) -> anyhow::Result<T> {
        self.time_telling(name, |_| stage())
    }

    /// [`Stages::time`] of a stage that tells which share of its work is done, 0 to 1.
    pub fn time_telling<T>(
        &mut self,
        name: &'static str,
        stage: impl FnOnce(&dyn Fn(f64)) -> anyhow::Result<(T, usize)>,
    ) -> anyhow::Result<T> {
        self.begin(name);
        let (made, count) = stage(&|share| self.list.at(share))?;
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
        self.list.begin(name, self.pace.ahead(name));
        self.current = Some(Moment::now());
    }

    fn end(&mut self, name: &str, count: usize) {
        let Some(moment) = self.current.take() else { return };
        let (wall_s, cpu_s) = moment.elapsed_s();
        self.list.end();
        self.pace.took(name, wall_s);
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

    fn goes_on(&mut self, _stage: Stage, share: f64) {
        self.list.at(share);
    }

    fn ended(&mut self, stage: Stage, count: usize) {
        self.end(stage.name(), count);
    }
}
