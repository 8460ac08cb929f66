//! The line of one device: its port, which may be lost and found again, shared by the thread that reads it and the loop that
//! writes to it.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use biplane_recording::Port;

use super::adapter::{self, Adapter};
use super::{Place, Tty};
use crate::error::OnboardError;
use crate::ports::device_name;

/// A line.
#[derive(Debug)]
pub struct Link {
    /// Which device is on it.
    pub device: Port,
    place: Place,
    baud: AtomicU32,
    writer: Mutex<Option<Arc<Tty>>>,
}

impl Link {
    /// Opens the port of a device, and remembers which links in `serial_links` lead to it; also returns the handle to read from.
    ///
    /// # Errors
    /// A sentence that names port and device.
    pub fn open(
        device: Port,
        path: &str,
        baud: u32,
        serial_links: &Path,
    ) -> Result<(Self, Arc<Tty>), OnboardError> {
        let mut place = Place::new(path);
        let tty = Tty::open(Path::new(path), baud).map(Arc::new).map_err(|source| OnboardError::Port {
            port: path.to_owned(),
            device: device_name(device),
            reason: reason(&source),
        })?;
        place.remember(serial_links);
        let device_word = device_name(device);
        match adapter::prepare(&*tty) {
            Adapter::Prompt => tracing::info!("{device_word}: {path} hands bytes on at once (low latency)"),
            Adapter::AsItIs => {
                tracing::info!("{device_word}: the driver of {path} does not offer low latency");
            }
            Adapter::None => {}
        }
        for link in place.candidates().filter(|link| *link != Path::new(path)) {
            tracing::info!("{device_word}: {path} is {}, should it move", link.display());
        }
        let writer = Mutex::new(Some(Arc::clone(&tty)));
        Ok((Self { device, place, baud: AtomicU32::new(baud), writer }, tty))
    }

    /// The port's name in the rig.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.place.configured()
    }

    /// Opens the port again after it was lost, at the rate that was set last, wherever it is now; returns where.
    ///
    /// # Errors
    /// What the system says of the last place that was tried.
    pub fn reopen(&self) -> io::Result<(Arc<Tty>, PathBuf)> {
        let mut result = Err(io::ErrorKind::NotFound.into());
        for path in self.place.candidates() {
            match Tty::open(path, self.baud.load(Ordering::Relaxed)) {
                Ok(tty) => {
                    let tty = Arc::new(tty);
                    adapter::prepare(&*tty);
                    *self.writer() = Some(Arc::clone(&tty));
                    // The loop may have changed the rate while the port was not there to be told.
                    tty.set_baud(self.baud.load(Ordering::Relaxed))?;
                    return Ok((tty, path.to_owned()));
                }
                Err(error) => result = Err(error),
            }
        }
        result
    }

    /// Closes the port that was lost, so that it can be opened again.
    pub fn close(&self) {
        *self.writer() = None;
    }

    /// Sends bytes. While the port is lost they are dropped: the session will notice the silence.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, bytes: &[u8]) -> io::Result<()> {
        self.tty().map_or(Ok(()), |tty| tty.write_all(bytes))
    }

    /// Changes the rate and drops what was received at the old one.
    ///
    /// # Errors
    /// What the system says, for example of a rate that the port does not have.
    pub fn set_baud(&self, baud: u32) -> io::Result<()> {
        self.baud.store(baud, Ordering::Relaxed);
        self.tty().map_or(Ok(()), |tty| tty.set_baud(baud))
    }

    /// The port, for a call that may take a moment: the reading thread can close it meanwhile.
    fn tty(&self) -> Option<Arc<Tty>> {
        self.writer().clone()
    }

    fn writer(&self) -> MutexGuard<'_, Option<Arc<Tty>>> {
        // A thread that died while it held the port left it as usable as before.
        self.writer.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the system said, in words for whoever set the robot up.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::ResourceBusy => "another program has it open".to_owned(),
        io::ErrorKind::PermissionDenied => format!("{error}: users of serial ports are in the group dialout"),
        _ => error.to_string(),
    }
}
