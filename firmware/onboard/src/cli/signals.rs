//! Signals as flags.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};

use crate::error::OnboardError;

fn refused(source: std::io::Error) -> OnboardError {
    OnboardError::System { what: "catch signals", source }
}

/// A flag that SIGINT and SIGTERM set; the second signal ends the process at once.
pub(super) fn stop() -> Result<Arc<AtomicBool>, OnboardError> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register_conditional_default(signal, Arc::clone(&stop)).map_err(refused)?;
        signal_hook::flag::register(signal, Arc::clone(&stop)).map_err(refused)?;
    }
    Ok(stop)
}

/// A flag that SIGUSR1 sets.
pub(super) fn rotate() -> Result<Arc<AtomicBool>, OnboardError> {
    let rotate = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(SIGUSR1, Arc::clone(&rotate)).map_err(refused)?;
    Ok(rotate)
}

/// The process goes on when its terminal goes away (SIGHUP).
pub(super) fn outlive_terminal() -> Result<(), OnboardError> {
    signal_hook::flag::register(SIGHUP, Arc::default()).map_err(refused)?;
    Ok(())
}
