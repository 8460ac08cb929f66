//! One serial port: 8 data bits, no parity, one stop bit, nobody else on it.

use std::io::{self, Write};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use biplane_recording::Port;
use serialport::{ClearBuffer, SerialPort, TTYPort};

use crate::error::OnboardError;
use crate::ports::device_name;

/// A read without bytes returns after so long, so that its thread notices a stop.
const READ_TIMEOUT: Duration = Duration::from_millis(50);

/// Opens a port at a rate in bits per second, for one user alone.
///
/// # Errors
/// What the system says, in words that name it.
pub fn open(path: &str, baud: u32) -> io::Result<TTYPort> {
    let port = serialport::new(path, baud).timeout(READ_TIMEOUT).exclusive(true).open_native()?;
    // Whatever came before at another rate is noise.
    let _ = port.clear(ClearBuffer::Input);
    Ok(port)
}

/// A port shared by the thread that reads it and the loop that writes to it. It may be lost and found again.
#[derive(Debug)]
pub struct Link {
    /// Which device is on it.
    pub device: Port,
    /// Its path.
    pub path: String,
    baud: AtomicU32,
    writer: Mutex<Option<TTYPort>>,
}

impl Link {
    /// Opens the port of a device; also returns the handle to read from.
    ///
    /// # Errors
    /// A sentence that names port and device.
    pub fn open(device: Port, path: &str, baud: u32) -> Result<(Self, TTYPort), OnboardError> {
        let refused = |source: io::Error| OnboardError::Port {
            port: path.to_owned(),
            device: device_name(device),
            reason: source.to_string(),
        };
        let writer = open(path, baud).map_err(refused)?;
        let reader = writer.try_clone_native().map_err(|error| refused(error.into()))?;
        let writer = Mutex::new(Some(writer));
        Ok((Self { device, path: path.to_owned(), baud: AtomicU32::new(baud), writer }, reader))
    }

    /// Opens the port again after it was lost, at the rate that was set last.
    ///
    /// # Errors
    /// What the system says.
    pub fn reopen(&self) -> io::Result<TTYPort> {
        let writer = open(&self.path, self.baud.load(Ordering::Relaxed))?;
        let reader = writer.try_clone_native()?;
        *self.writer() = Some(writer);
        Ok(reader)
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
        self.writer().as_mut().map_or(Ok(()), |port| port.write_all(bytes))
    }

    /// Changes the rate and drops what was received at the old one.
    ///
    /// # Errors
    /// What the system says, for example of a rate that the port does not have.
    pub fn set_baud(&self, baud: u32) -> io::Result<()> {
        self.baud.store(baud, Ordering::Relaxed);
        if let Some(port) = self.writer().as_mut() {
            port.set_baud_rate(baud)?;
            port.clear(ClearBuffer::Input)?;
        }
        Ok(())
    }

    fn writer(&self) -> MutexGuard<'_, Option<TTYPort>> {
        // A thread that died while it held the port left it as usable as before.
        self.writer.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
