//! The drive of the demo: mock devices on one side of three pseudo-terminals, the onboard process on the
//! other.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::thread::Builder;

use anyhow::{Context, anyhow};
use biplane_mock::rig::drive::Drive as PlannedDrive;
use biplane_mock::rig::simulated::SimulationParams;
use biplane_mock::serve::{LinkName, ServeOptions, Source, serve};
use biplane_mock::world::World;
use biplane_mock::world::path::Path as DrivePath;
use biplane_onboard::{RecordOptions, RunReport, record};
use biplane_recording::Rig;

use crate::cli::terminal::console::Console;

const WORLD: &str = "corridor";
const SEED: u64 = 1;
/// The recording goes on so long after the drive's end, seconds: the robot stands.
const AFTER_S: f64 = 0.5;
/// How often the main thread looks at the others, nanoseconds.
const LOOK_NS: i64 = 50_000_000;
/// Devices that do not stream by then never will, seconds.
const PATIENCE_S: f64 = 30.0;

/// See the module's text.
pub(super) struct Drive {
    world: World,
    path: DrivePath,
    rig: Rig,
    duration_s: f64,
    whole_s: f64,
    length_m: f64,
    links: PathBuf,
    truth: PathBuf,
    output: PathBuf,
}

impl Drive {
    /// Plans the drive and writes the rig's file. It ends after `limit_s`, or at its end.
    pub(super) fn new(folder: &Path, limit_s: Option<f64>) -> anyhow::Result<Self> {
        let world = World::named(WORLD).ok_or_else(|| anyhow!("there is no world {WORLD}"))?;
        let path = world.path(None).ok_or_else(|| anyhow!("world {WORLD} has no path"))?.clone();
        let planned = PlannedDrive::new(&path, SEED)?;
        let links = folder.join("rig");
        let port = |name: LinkName| links.join(name.name()).display().to_string();
        let mut rig = Rig::default();
        rig.horizontal.port = port(LinkName::Horizontal);
        if let Some(vertical) = &mut rig.vertical {
            vertical.port = port(LinkName::Vertical);
        }
        rig.base.port = port(LinkName::Base);
        let rig_path = folder.join("rig.toml");
        fs::write(&rig_path, rig.to_toml())
            .with_context(|| format!("cannot write {}", rig_path.display()))?;
        Ok(Self {
            world,
            path,
            rig,
            duration_s: limit_s.map_or(planned.duration_s(), |limit| limit.min(planned.duration_s())),
            whole_s: planned.duration_s(),
            length_m: planned.length_m(),
            truth: folder.join("truth"),
            output: folder.join("run.mcap"),
            links,
        })
    }

    /// The drive in words.
    pub(super) fn describe(&self) -> String {
        if self.duration_s < self.whole_s {
            format!("the first {:.0} s of the drive, in real time", self.duration_s)
        } else {
            format!("{:.1} m take {:.0} s, in real time", self.length_m, self.duration_s)
        }
    }

    /// Lets the devices drive and records them.
    pub(super) fn record(&self, console: &Console) -> anyhow::Result<RunReport> {
        let serving = self.serve_options();
        let recording = RecordOptions::new(self.rig.clone(), &self.output);
        let (stop_mock, stop_record, ready) =
            (AtomicBool::new(false), AtomicBool::new(false), AtomicBool::new(false));
        thread::scope(|scope| {
            let refused = || format!("cannot start a thread: {}", biplane_cli::memory::advice());
            let work = || serve(&serving, &stop_mock, |_| ready.store(true, Ordering::Release));
            let mock = Builder::new().spawn_scoped(scope, work).with_context(refused)?;
            wait_until(|| ready.load(Ordering::Acquire) || mock.is_finished());
            let work = || record(&recording, &stop_record);
            let onboard =
                Builder::new().spawn_scoped(scope, work).with_context(refused).inspect_err(|_| {
                    stop_mock.store(true, Ordering::Release);
                })?;
            let spinner = console.spinner("recording");
            self.wait(|| mock.is_finished() || onboard.is_finished());
            drop(spinner);
            stop_record.store(true, Ordering::Release);
            let report = onboard.join().map_err(|_| anyhow!("the onboard process failed"));
            stop_mock.store(true, Ordering::Release);
            let served = mock.join().map_err(|_| anyhow!("the mock rig failed"))?;
            served.context("the mock rig failed")?;
            // The mock has taken its links away.
            let _ = fs::remove_dir(&self.links);
            Ok(report??)
        })
    }

    fn serve_options(&self) -> ServeOptions {
        let source = Source::World {
            world: Box::new(self.world.clone()),
            path: Box::new(self.path.clone()),
            rig: Box::new(self.rig.clone()),
            params: SimulationParams::default(),
        };
        let mut options = ServeOptions::new(source, self.links.clone());
        options.seed = SEED;
        options.truth = Some(self.truth.clone());
        options
    }

    /// Waits until the drive is over: its truth appears when it begins.
    fn wait(&self, broken: impl Fn() -> bool) {
        let begun = self.truth.join("trajectory.tum");
        let since_s = |start_ns: i64| (biplane_clock::monotonic_ns() - start_ns) as f64 / 1e9;
        let start_ns = biplane_clock::monotonic_ns();
        wait_until(|| broken() || begun.exists() || since_s(start_ns) > PATIENCE_S);
        let drive_ns = biplane_clock::monotonic_ns();
        wait_until(|| broken() || since_s(drive_ns) > self.duration_s + AFTER_S);
    }
}

fn wait_until(done: impl Fn() -> bool) {
    while !done() {
        biplane_clock::sleep_ns(LOOK_NS);
    }
}
