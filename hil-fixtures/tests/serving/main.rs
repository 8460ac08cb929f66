//! The mock on real pseudo-terminals: links, speeds, clients that come and go, worlds with their truth,
//! captures to the last scan.

mod captures;
mod client;
mod fixtures;
mod ports;
mod worlds;

use biplane_mock::serve::{ServeError, ServeOptions, ServeReport, serve};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;

/// A folder of one test's own.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("biplane-serving-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    folder
}

/// Serves while `client` runs, then stops.
fn serving(options: &ServeOptions, client: impl FnOnce(&Path)) -> Result<ServeReport, ServeError> {
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (ready, is_ready) = mpsc::channel();
        let server =
            scope.spawn(|| serve(options, &stop, move |_| ready.send(()).expect("the client waits")));
        is_ready.recv().expect("links appear");
        let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| client(&options.links)));
        stop.store(true, Ordering::Relaxed);
        let report = server.join().expect("the mock does not panic");
        if let Err(panic) = ended {
            std::panic::resume_unwind(panic);
        }
        report
    })
}
