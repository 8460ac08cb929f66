//! The line of one device: its port or connection, which may be lost and found again, shared by the thread
//! that reads it and the loop that writes to it.

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use biplane_recording::Port;

use crate::io::line::OpenLine;
use crate::io::line::adapter;
use crate::io::line::adapter::Adapter;
use crate::io::line::open_error::reason;
use crate::io::line::tty::Tty;
use crate::io::port_check::NeededPort;
use crate::io::port_location::Place;
use crate::types::device_name::device_name;
use crate::types::error::PortRefused;

/// A line.
#[derive(Debug)]
pub(crate) struct Link {
    /// Which device is on it.
    pub device: Port,
    place: Place,
    /// Rate of a serial port; 0 of a connection.
    baud: AtomicU32,
    is_network: bool,
    writer: Mutex<Option<Arc<OpenLine>>>,
}

impl Link {
    /// Opens the port of a device, and remembers which links in `serial_links` lead to it; or connects to the
    /// device. Also returns the handle to read from.
    ///
    /// # Errors
    /// A sentence that names port and device.
    pub(crate) fn open(
        needed: &NeededPort<'_>,
        serial_links: &Path,
    ) -> Result<(Self, Arc<OpenLine>), PortRefused> {
        let NeededPort { device, path, baud } = *needed;
        let mut place = Place::new(path);
        let line = needed.open().map(Arc::new).map_err(|source| PortRefused {
            port: path.to_owned(),
            device: device_name(device),
            reason: reason(&source),
        })?;
        if let OpenLine::Serial(tty) = &*line {
            place.remember(serial_links);
            say_adapter(tty, device, path);
        }
        if place.now() != Path::new(path) {
            tracing::info!("{}: {path} is {}, should it move", device_name(device), place.now().display());
        }
        let writer = Mutex::new(Some(Arc::clone(&line)));
        let link = Self {
            device,
            place,
            baud: AtomicU32::new(baud.unwrap_or_default()),
            is_network: baud.is_none(),
            writer,
        };
        Ok((link, line))
    }

    /// The port's name in the rig.
    #[must_use]
    pub(crate) fn path(&self) -> &Path {
        self.place.configured()
    }

    /// Opens the port again after it was lost, wherever it is now, at the rate that was set last if it has
    /// it; returns where.
    ///
    /// # Errors
    /// What the system says. The port is closed then, so that it can be tried again.
    pub(crate) fn reopen(&self) -> io::Result<(Arc<OpenLine>, &Path)> {
        if self.is_network {
            return self.reconnect();
        }
        let path = self.place.now();
        let tty = Tty::open(path, self.baud.load(Ordering::Relaxed))?;
        adapter::prepare(&tty);
        let line = Arc::new(OpenLine::Serial(tty));
        *self.writer() = Some(Arc::clone(&line));
        // The loop may have changed the rate while the port was not there to be told; of one that the port
        // does not have, it hears when the session sets it again.
        match line.set_baud(self.baud.load(Ordering::Relaxed)) {
            Err(error) if error.kind() != io::ErrorKind::Unsupported => {
                self.close();
                Err(error)
            }
            _ => Ok((line, path)),
        }
    }

    /// Connects to the device again.
    fn reconnect(&self) -> io::Result<(Arc<OpenLine>, &Path)> {
        let address = self.path();
        let line = Arc::new(OpenLine::network(&address.to_string_lossy())?);
        *self.writer() = Some(Arc::clone(&line));
        Ok((line, address))
    }

    /// Ends a connection that seems dead: the thread that reads it finds it lost, and makes it anew.
    pub(crate) fn hang_up(&self) {
        if let Some(line) = self.line() {
            line.hang_up();
        }
    }

    /// Closes the port that was lost, so that it can be opened again.
    pub(crate) fn close(&self) {
        *self.writer() = None;
    }

    /// Sends bytes. While the port is lost they are dropped: the session will notice the silence.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn write(&self, bytes: &[u8]) -> io::Result<()> {
        self.line().map_or(Ok(()), |line| line.write_all(bytes))
    }

    /// Changes the rate and drops what was received at the old one.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::Unsupported`] of a rate that the port does not have.
    pub(crate) fn set_baud(&self, baud: u32) -> io::Result<()> {
        self.baud.store(baud, Ordering::Relaxed);
        self.line().map_or(Ok(()), |line| line.set_baud(baud))
    }

    /// The port, for a call that may take a moment: the reading thread can close it meanwhile.
    fn line(&self) -> Option<Arc<OpenLine>> {
        self.writer().clone()
    }

    fn writer(&self) -> MutexGuard<'_, Option<Arc<OpenLine>>> {
        // A thread that died while it held the port left it as usable as before.
        self.writer.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Asks the driver of a serial port to hand bytes on at once, and says what came of it.
fn say_adapter(tty: &Tty, device: Port, path: &str) {
    let device_word = device_name(device);
    match adapter::prepare(tty) {
        Adapter::Prompt => tracing::info!("{device_word}: {path} hands bytes on at once (low latency)"),
        Adapter::AsItIs => {
            tracing::info!("{device_word}: the driver of {path} does not offer low latency");
        }
        Adapter::None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::line::tty::tests::line;
    use crate::io::line::tty::tests::set_fastest_baud;

    fn link(path: &Path) -> (Link, Arc<OpenLine>) {
        let path = path.to_str().unwrap();
        let needed = NeededPort { device: Port::Horizontal, path, baud: Some(38400) };
        Link::open(&needed, Path::new("/nowhere")).unwrap()
    }

    fn baud(line: &OpenLine) -> u32 {
        let OpenLine::Serial(tty) = line else { panic!("a serial port") };
        tty.baud().unwrap()
    }

    #[test]
    fn a_port_comes_back_also_when_the_last_rate_is_none_of_its_own() {
        let (_master, path) = line();
        set_fastest_baud(115_200);
        let (link, tty) = link(&path);
        assert_eq!(link.set_baud(500_000).unwrap_err().kind(), io::ErrorKind::Unsupported);
        drop(tty);
        link.close();
        let (tty, at) = link.reopen().unwrap();
        assert_eq!(at, path);
        link.set_baud(9600).unwrap();
        assert_eq!(baud(&tty), 9600);
    }

    #[test]
    fn a_port_that_could_not_be_opened_again_is_not_kept_from_the_next_try() {
        let (_master, path) = line();
        let (link, tty) = link(&path);
        drop(tty);
        link.close();
        let somebody = Tty::open(&path, 9600).unwrap();
        assert_eq!(link.reopen().unwrap_err().kind(), io::ErrorKind::ResourceBusy);
        drop(somebody);
        assert_eq!(baud(&link.reopen().unwrap().0), 38400);
    }
}
