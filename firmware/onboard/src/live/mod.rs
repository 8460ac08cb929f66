//! The live view: what is recorded, shown while it is recorded, over the Foxglove WebSocket protocol.
//!
//! ```text
//! loop -> queue -> writing thread -> file
//!                        |
//!                        +-> tap: a ring that drops -> live thread -> viewers
//! ```
//! The loop does not know of it: the tap sits behind the file, in the thread that writes (in a replay: that replays), and never
//! waits. The live thread alone serves everybody, with the lowest usual priority, in bounded memory: a viewer that does not keep
//! up misses messages, which are counted. Only with the feature `live` (on by default); without it the words are there and say so.

mod address;
mod report;
mod tap;

#[cfg(feature = "live")]
mod channel;
#[cfg(feature = "live")]
mod client;
#[cfg(feature = "live")]
mod grid;
#[cfg(feature = "live")]
mod messages;
#[cfg(feature = "live")]
mod protocol;
#[cfg(feature = "live")]
mod scene;
#[cfg(feature = "live")]
mod server;
#[cfg(feature = "live")]
mod sheet;
#[cfg(feature = "live")]
mod waiting_room;

#[cfg(not(feature = "live"))]
mod absent;
#[cfg(not(feature = "live"))]
use absent as server;

pub use address::{LiveAddress, NotAnAddress};
#[cfg(feature = "live")]
pub use protocol::{Request, Subscription, request};
pub use report::LiveReport;
pub use server::{Door, LiveView};
pub use tap::Tap;

use crate::error::OnboardError;
use biplane_recording::Rig;

/// Opens the door that viewers come in by, if there shall be one; nobody is let in yet. Of a run that must not fail for it (`lenient`:
/// a service, that would be started again and again) an address that cannot be had takes the view and no more.
///
/// # Errors
/// [`OnboardError::LiveView`] when the address cannot be had.
pub fn open(address: Option<LiveAddress>, lenient: bool) -> Result<Option<Door>, OnboardError> {
    let Some(address) = address else { return Ok(None) };
    match Door::open(address) {
        Ok(door) => Ok(Some(door)),
        Err(error) if lenient => {
            tracing::error!("{error}; recording without a live view");
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// Starts to serve, if there is a door. Messages go in at the tap.
///
/// # Errors
/// When no thread can be started.
pub fn start(door: Option<Door>, rig: &Rig) -> Result<(Option<Tap>, Option<LiveView>), OnboardError> {
    let Some(door) = door else { return Ok((None, None)) };
    let (tap, view) = door.start(rig)?;
    Ok((Some(tap), Some(view)))
}
