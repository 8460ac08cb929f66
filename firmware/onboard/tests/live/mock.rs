//! A mock rig in a folder of its own, and what was recorded of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use biplane_mock::rig::simulated::SimulationParams;
use biplane_mock::serve::{ServeOptions, Source, serve};
use biplane_mock::world::World;
use biplane_onboard::{OnboardError, RecordOptions, RunReport, record};
use biplane_recording::messages::Message;
use biplane_recording::rig::InertialUnit;
use biplane_recording::{Reader, Rig, Topic};

/// A mock rig in a folder of its own.
pub(crate) struct Mock {
    pub folder: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Mock {
    pub(crate) fn start(name: &str, change: impl FnOnce(&mut ServeOptions)) -> Self {
        let folder = std::env::temp_dir().join(format!("biplane-record-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let mut mock = Self { folder, stop: Arc::default(), thread: None };
        mock.serve(change);
        mock
    }

    /// Serves the corridor, until [`Mock::end`].
    pub(crate) fn serve(&mut self, change: impl FnOnce(&mut ServeOptions)) {
        let world = World::named("corridor").unwrap();
        let path = world.paths[0].clone();
        let source = Source::World {
            world: Box::new(world),
            path: Box::new(path),
            rig: Box::new(Rig::default()),
            params: SimulationParams::default(),
        };
        let mut options = ServeOptions::new(source, self.folder.join("links"));
        options.truth = Some(self.folder.join("truth"));
        options.overwrite = true;
        change(&mut options);
        self.stop = Arc::default();
        let (ready, is_ready) = mpsc::channel();
        let stop = Arc::clone(&self.stop);
        self.thread = Some(thread::spawn(move || {
            serve(&options, &stop, move |_| ready.send(()).unwrap()).unwrap();
        }));
        is_ready.recv_timeout(Duration::from_secs(30)).expect("the mock is ready");
    }

    pub(crate) fn rig(&self) -> Rig {
        self.rig_in("")
    }

    /// The rig, its links in a folder of the mock's folder of links.
    pub(crate) fn rig_in(&self, folder: &str) -> Rig {
        let links = self.folder.join("links").join(folder);
        let port = |name: &str| links.join(name).to_string_lossy().into_owned();
        let mut rig = Rig::default();
        rig.horizontal.port = port("lms-horizontal");
        rig.vertical.as_mut().unwrap().port = port("lms-vertical");
        rig.base.port = port("base");
        rig
    }

    /// The rig of a mock that was changed by [`with_inertial_unit`].
    pub(crate) fn rig_with_inertial_unit(&self) -> Rig {
        let port = self.folder.join("links/imu");
        Rig { imu: Some(InertialUnit::xsens(&port.to_string_lossy())), ..self.rig() }
    }

    pub(crate) fn options(&self, rig: Rig, seconds: f64) -> RecordOptions {
        RecordOptions {
            duration: Some(Duration::from_secs_f64(seconds)),
            raw: true,
            ..RecordOptions::new(rig, self.folder.join("run.mcap"))
        }
    }

    pub(crate) fn record(&self, rig: Rig, seconds: f64) -> Result<RunReport, OnboardError> {
        record(&self.options(rig, seconds), &AtomicBool::new(false))
    }

    /// Ends the mock, so that its truth is written.
    pub(crate) fn end(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

impl Drop for Mock {
    fn drop(&mut self) {
        self.end();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Puts an inertial unit on the robot.
pub(crate) fn with_inertial_unit(options: &mut ServeOptions) {
    if let Source::World { rig, .. } = &mut options.source {
        rig.imu = Some(InertialUnit::xsens("imu"));
    }
}

/// All messages of a topic.
pub(crate) fn all<M: Message>(path: &Path, topic: Topic) -> Vec<M> {
    let reader = Reader::open(path).unwrap();
    let entries = reader.messages().map(Result::unwrap).filter(|entry| entry.topic == Some(topic));
    entries.map(|entry| M::decode(&entry.bytes).unwrap()).collect()
}
