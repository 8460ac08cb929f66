//! The live view: what is recorded, shown while it is recorded, over the Foxglove WebSocket protocol.
//!
//! ```text
//! loop -> queue -> writing thread -> file
//!                        |
//!                        +-> tap: a ring that drops -> live thread -> viewers
//! ```
//! The loop does not know of it: the tap sits behind the file, in the thread that writes (in a replay: that
//! replays), and never waits. The live thread alone serves everybody, with the lowest usual priority, in
//! bounded memory: a viewer that does not keep up misses messages, which are counted. Only with the feature
//! `live` (on by default); without it the words are there and say so.

#[cfg(not(feature = "live"))]
pub(crate) mod absent;
#[cfg(feature = "live")]
pub(crate) mod scene;
#[cfg(feature = "live")]
pub(crate) mod server;

#[cfg(not(feature = "live"))]
use absent as server;

pub(crate) use server::{Listener, LiveView};

use crate::output::tap::Tap;
use crate::types::error::OnboardError;
use crate::types::live_address::LiveAddress;
use crate::types::web_origin::WebOrigin;
use biplane_cli::plain_error;
use biplane_recording::Rig;

/// Opens the door that viewers come in by, if there shall be one; nobody is let in yet, and web pages later
/// only from the viewer's own machine and `allowed_origins`. Of a run that must not fail for it (`lenient`: a
/// service, that would be started again and again) an address that cannot be had takes the view and no more.
///
/// # Errors
/// [`OnboardError::LiveView`] when the address cannot be had.
pub(crate) fn open(
    address: Option<LiveAddress>,
    allowed_origins: &[WebOrigin],
    lenient: bool,
) -> Result<Option<Listener>, OnboardError> {
    let Some(address) = address else { return Ok(None) };
    match Listener::open(address, allowed_origins) {
        Ok(listener) => Ok(Some(listener)),
        Err(error) if lenient => {
            tracing::error!("{}; recording without a live view", plain_error(&error.to_string()));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// Starts to serve, if there is a door. Messages go in at the tap.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn start(
    listener: Option<Listener>,
    rig: &Rig,
) -> Result<(Option<Tap>, Option<LiveView>), OnboardError> {
    let Some(listener) = listener else { return Ok((None, None)) };
    let (tap, view) = listener.start(rig)?;
    Ok((Some(tap), Some(view)))
}
