//! What bytes come and go on: a serial port, or a connection to a device on a network. Either is read by one
//! thread and written by another.

pub(crate) mod adapter;
pub(crate) mod connection;
pub(crate) mod open_error;
pub(crate) mod tty;

use std::io;
use std::path::Path;

use crate::io::line::connection::Connection;
use crate::io::line::tty::Tty;

/// A line that is open.
#[derive(Debug)]
pub(crate) enum OpenLine {
    /// A serial port.
    Serial(Tty),
    /// A connection.
    Network(Connection),
}

impl OpenLine {
    /// Opens a serial port at a rate, bits per second.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn serial(path: &Path, baud: u32) -> io::Result<Self> {
        Tty::open(path, baud).map(Self::Serial)
    }

    /// Connects to a device.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn network(address: &str) -> io::Result<Self> {
        Connection::open(address).map(Self::Network)
    }

    /// Reads what has come, after waiting for it so long; `None` when nothing came.
    ///
    /// # Errors
    /// The line has gone.
    pub(crate) fn read(&self, buffer: &mut [u8], timeout_ns: i64) -> io::Result<Option<usize>> {
        match self {
            Self::Serial(tty) => tty.read(buffer, timeout_ns),
            Self::Network(connection) => connection.read(buffer, timeout_ns),
        }
    }

    /// Sends bytes, all of them or none.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn write_all(&self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Serial(tty) => tty.write_all(bytes),
            Self::Network(connection) => connection.write_all(bytes),
        }
    }

    /// Changes the rate of a serial port; a network has none.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn set_baud(&self, baud: u32) -> io::Result<()> {
        match self {
            Self::Serial(tty) => tty.set_baud(baud),
            Self::Network(_) => Ok(()),
        }
    }

    /// Ends a connection, so that whoever reads it makes it anew; a serial port stays as it is.
    pub(crate) fn hang_up(&self) {
        if let Self::Network(connection) = self {
            connection.hang_up();
        }
    }

    /// Whether behind a full read there may be more at once.
    pub(crate) fn is_network(&self) -> bool {
        matches!(self, Self::Network(_))
    }
}
