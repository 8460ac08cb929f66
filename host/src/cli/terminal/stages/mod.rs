//! Times the stages of a build and says each as it ends; shows which one runs and which are to come.

mod stage_list;
mod time_left;

use std::cell::Cell;

use crate::pipeline::summary::{StageFigures, Summary};
use crate::pipeline::{Observer, Stage};

use crate::cli::terminal::console::{Console, say};
use crate::cli::terminal::heartbeat::{HEARTBEAT, Heartbeat};
use crate::cli::terminal::needs;
use crate::cli::terminal::stages::stage_list::StageList;
use crate::cli::terminal::stages::time_left::Pace;
use crate::cli::terminal::stopwatch::Stopwatch;

/// See the module's text.
pub(crate) struct Stages<'a> {
    console: &'a Console,
    start: Stopwatch,
    current: Option<Stopwatch>,
    list: StageList<'a>,
    /// Whether a line from time to time says which stage runs: where no person looks on.
    is_log: bool,
    heartbeat: Option<RunningStage>,
    pace: Pace,
    done: Vec<StageFigures>,
}

/// The stage that runs, in a log.
struct RunningStage {
    name: &'static str,
    percent: Cell<u32>,
    heartbeat: Heartbeat,
}

impl RunningStage {
    fn new(name: &'static str) -> Self {
        Self { name, percent: Cell::new(0), heartbeat: Heartbeat::new(HEARTBEAT, name, say) }
    }

    /// This share of its work is done, 0 to 1.
    fn at(&self, share: f64) {
        let percent = (share.clamp(0.0, 1.0) * 100.0) as u32;
        if self.percent.replace(percent) != percent {
            self.heartbeat.set(&format!("{}, {percent} % done", self.name));
        }
    }
}

impl<'a> Stages<'a> {
    /// Starts the clocks. `steps` are the stages in their order.
    pub(crate) fn new(console: &'a Console, steps: &[&'static str]) -> Self {
        Self {
            console,
            start: Stopwatch::now(),
            current: None,
            list: StageList::new(console, steps),
            is_log: console.is_log(),
            heartbeat: None,
            pace: Pace::new(steps),
            done: Vec::new(),
        }
    }

    /// Runs a stage that returns what it made and how many of it.
    pub(crate) fn time<T>(
        &mut self,
        name: &'static str,
        stage: impl FnOnce() -> anyhow::Result<(T, usize)>,
    ) -> anyhow::Result<T> {
        self.time_with_progress(name, |_| stage())
    }

    /// [`Stages::time`] of a stage that tells which share of its work is done, 0 to 1.
    pub(crate) fn time_with_progress<T>(
        &mut self,
        name: &'static str,
        stage: impl FnOnce(&dyn Fn(f64)) -> anyhow::Result<(T, usize)>,
    ) -> anyhow::Result<T> {
        self.begin(name);
        let (made, count) = stage(&|share| self.at(share))?;
        self.end(name, count);
        Ok(made)
    }

    /// Puts the figures into a summary.
    pub(crate) fn finish(self, summary: &mut Summary) {
        (summary.cost.wall_s, summary.cost.cpu_s) = self.start.elapsed_s();
        summary.cost.peak_memory_bytes = biplane_clock::peak_memory_bytes();
        summary.stages = self.done;
    }

    fn at(&self, share: f64) {
        self.list.at(share);
        self.heartbeat.iter().for_each(|heartbeat| heartbeat.at(share));
    }

    fn begin(&mut self, name: &'static str) {
        self.heartbeat = self.is_log.then(|| RunningStage::new(name));
        self.list.begin(name, self.pace.ahead(name));
        self.current = Some(Stopwatch::now());
    }

    fn end(&mut self, name: &str, count: usize) {
        let Some(moment) = self.current.take() else { return };
        let (wall_s, cpu_s) = moment.elapsed_s();
        self.list.end();
        self.pace.took(name, wall_s);
        let peak_memory_bytes = biplane_clock::peak_memory_bytes();
        self.console.note(format!("  {name:<10} {count:>9} {:<10} {wall_s:>7.2} s", unit(name, count)));
        self.console.detail(|| {
            let peak =
                peak_memory_bytes.map_or(String::new(), |bytes| format!(", peak {} MB", bytes / 1_000_000));
            format!("  {:<10} {cpu_s:>7.2} s of processor time{peak}", "")
        });
        self.done.push(StageFigures { stage: name.to_owned(), count, wall_s, cpu_s, peak_memory_bytes });
    }
}

/// What a stage counts, one or several.
fn unit(stage: &str, count: usize) -> &'static str {
    let units = units(stage);
    if count == 1 { units.strip_suffix('s').unwrap_or(units) } else { units }
}

/// What a stage counts.
fn units(stage: &str) -> &'static str {
    match stage {
        "read" => "scans",
        "load" => "triangles",
        "map" => "cells",
        "optimize" => "loops",
        "cloud" => "points",
        "mesh" | "leftovers" => "triangles",
        "planes" => "planes",
        "tiles" => "tiles",
        "polygons" => "polygons",
        "rooms" => "rooms",
        "write" | "report" => "files",
        _ => "",
    }
}

impl Observer for Stages<'_> {
    fn begins(&mut self, stage: Stage) {
        self.begin(stage.name());
    }

    fn goes_on(&mut self, _stage: Stage, share: f64) {
        self.at(share);
    }

    fn first_views(&mut self, points: usize) -> Result<(), String> {
        needs::expect_first_views(points)
    }

    fn ended(&mut self, stage: Stage, count: usize) {
        self.end(stage.name(), count);
    }
}
