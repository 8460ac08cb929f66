//! A pseudo-terminal as the host's end of a serial line: clients open a symbolic link as they would open
//! `/dev/ttyUSB0`.
//!
//! The crate `serialport` makes the pair, and the mock holds the master. The client's line speed is read
//! back from its terminal settings, so that a client at the wrong rate is not understood, as on a real
//! line. Bytes sent while no client has the port open are lost, as they are there.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::{Errno, FdFlags, fcntl_getfd, fcntl_setfd};
use rustix::pty::{OpenptFlags, ioctl_tiocgptpeer};
use rustix::termios::{QueueSelector, tcflush, tcgetattr};
use serialport::{SerialPort, TTYPort};
use std::collections::VecDeque;
use std::fs;
use std::os::fd::{FromRawFd, IntoRawFd, OwnedFd};
use std::path::{Path, PathBuf};

/// How often a port that no client has open is looked at.
const UNOPENED_NS: i64 = 2_000_000;

/// What Linux keeps of a serial line for a program that reads late. A pseudo-terminal has room for a sixth of
/// it, and a mock that was held up itself writes more than that at once.
const DRIVER_BYTES: usize = 65_536;

const NS_PER_S: i64 = 1_000_000_000;

/// Why a pseudo-terminal could not be had.
#[derive(Debug, thiserror::Error)]
pub enum PtyError {
    /// The system gave no pseudo-terminal.
    #[error("no pseudo-terminal: {source}")]
    Open {
        /// What the system said.
        source: std::io::Error,
    },
    /// The link could not be made.
    #[error("{}: cannot make this link: {source}", link.display())]
    Link {
        /// The link.
        link: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Something that is no symbolic link is in the way.
    #[error("{}: something that is not a link stands here; nothing was changed", link.display())]
    InTheWay {
        /// The path.
        link: PathBuf,
    },
}

impl From<serialport::Error> for PtyError {
    fn from(error: serialport::Error) -> Self {
        Self::Open { source: error.into() }
    }
}

impl From<Errno> for PtyError {
    fn from(errno: Errno) -> Self {
        Self::Open { source: errno.into() }
    }
}

/// A pseudo-terminal and the link to it.
#[derive(Debug)]
pub struct Pty {
    master: OwnedFd,
    slave_path: PathBuf,
    link: Option<PathBuf>,
    has_client: bool,
    /// Sent, and not yet taken by the terminal.
    waiting: VecDeque<u8>,
    /// Bytes that nobody received: no client, or one that does not read.
    pub lost_bytes: u64,
}

/// The master, and the path of the terminal in raw mode. The slave is closed again: from then on the terminal
/// reports whether a client has it open.
fn open_pair(baud: u32) -> Result<(OwnedFd, PathBuf), PtyError> {
    let (master, mut slave) = TTYPort::pair()?;
    slave.set_baud_rate(baud)?;
    let slave_path = PathBuf::from(slave.name().ok_or(Errno::NODEV)?);
    // SAFETY: `into_raw_fd` gives up the descriptor, and nothing else has it.
    let master = unsafe { OwnedFd::from_raw_fd(master.into_raw_fd()) };
    fcntl_setfd(&master, fcntl_getfd(&master)? | FdFlags::CLOEXEC)?;
    fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
    Ok((master, slave_path))
}

impl Pty {
    /// A new pseudo-terminal in raw mode, its speed set to `baud` until a client sets another.
    pub fn open(baud: u32) -> Result<Self, PtyError> {
        let (master, slave_path) = open_pair(baud)?;
        let waiting = VecDeque::new();
        Ok(Self { master, slave_path, link: None, has_client: false, waiting, lost_bytes: 0 })
    }

    /// Makes `link` point to the terminal; a link that is there already is replaced, anything else is left
    /// alone.
    pub fn publish(&mut self, link: &Path) -> Result<(), PtyError> {
        let failed = |source| PtyError::Link { link: link.to_owned(), source };
        if let Ok(found) = fs::symlink_metadata(link)
            && !found.is_symlink()
        {
            return Err(PtyError::InTheWay { link: link.to_owned() });
        }
        let mut fresh = link.as_os_str().to_owned();
        fresh.push(".new");
        let fresh = PathBuf::from(fresh);
        let _ = fs::remove_file(&fresh);
        std::os::unix::fs::symlink(&self.slave_path, &fresh).map_err(failed)?;
        fs::rename(&fresh, link).map_err(failed)?;
        self.link = Some(link.to_owned());
        Ok(())
    }

    /// The terminal's own path.
    #[must_use]
    pub fn slave_path(&self) -> &Path {
        &self.slave_path
    }

    /// Whether there is a link to it.
    #[must_use]
    pub fn is_published(&self) -> bool {
        self.link.is_some()
    }

    /// Whether a client has the port open, as of the last [`Pty::wait`].
    #[must_use]
    pub fn has_client(&self) -> bool {
        self.has_client
    }

    /// Line speed that the client has set, in Bd; `None` when the system does not tell.
    #[must_use]
    pub fn client_baud(&self) -> Option<u32> {
        tcgetattr(&self.master).ok().map(|settings| settings.output_speed())
    }

    /// Bytes that the client has written; 0 when there are none.
    pub fn read(&mut self, buffer: &mut [u8]) -> usize {
        rustix::io::read(&self.master, buffer).unwrap_or(0)
    }

    /// Hands bytes to the client, as many as it has room for, and keeps what a driver would keep; the others
    /// are lost, and so are all without a client.
    pub fn write(&mut self, bytes: &[u8]) {
        let kept = if self.has_client { bytes.len() } else { 0 };
        self.lost_bytes += (bytes.len() - kept) as u64;
        self.waiting.extend(&bytes[..kept]);
        self.flush();
        let over = self.waiting.len().saturating_sub(DRIVER_BYTES);
        self.waiting.truncate(DRIVER_BYTES);
        self.lost_bytes += over as u64;
    }

    /// Hands on what the terminal has room for by now.
    fn flush(&mut self) {
        while !self.waiting.is_empty() {
            match rustix::io::write(&self.master, self.waiting.as_slices().0) {
                Ok(written) if written > 0 => drop(self.waiting.drain(..written)),
                _ => break,
            }
        }
    }

    /// Waits until the client writes, or `timeout_ns` is over, or it is time to look for a client again.
    pub fn wait(&mut self, timeout_ns: i64) {
        let timeout_ns = timeout_ns.max(0);
        if !self.has_client {
            biplane_clock::sleep_ns(timeout_ns.min(UNOPENED_NS));
        }
        let timeout_ns = if self.has_client { timeout_ns } else { 0 };
        let timeout = Timespec { tv_sec: timeout_ns / NS_PER_S, tv_nsec: timeout_ns % NS_PER_S };
        self.flush();
        let mut ports = [PollFd::new(&self.master, PollFlags::IN)];
        let open = match poll(&mut ports, Some(&timeout)) {
            Ok(_) => !ports[0].revents().contains(PollFlags::HUP),
            Err(_) => self.has_client,
        };
        if self.has_client && !open {
            self.client_left();
        }
        self.has_client = open;
    }

    /// What the last client left unread must not reach the next one. A client that asked for exclusive use
    /// and is not the superuser would lock everybody out of a terminal whose master stays open, so that one
    /// is replaced.
    fn client_left(&mut self) {
        self.lost_bytes += self.waiting.len() as u64;
        self.waiting.clear();
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        match ioctl_tiocgptpeer(&self.master, flags) {
            Ok(slave) => {
                let _ = rustix::termios::ioctl_tiocnxcl(&slave);
                let _ = tcflush(&slave, QueueSelector::IFlush);
            }
            Err(_) => {
                let baud = self.client_baud().unwrap_or(9600);
                if let Ok((master, slave_path)) = open_pair(baud) {
                    self.master = master;
                    self.slave_path = slave_path;
                    if let Some(link) = self.link.take() {
                        let _ = self.publish(&link);
                    }
                }
            }
        }
    }

    /// Takes the link away, if it still points here.
    pub fn withdraw(&mut self) {
        if let Some(link) = self.link.take()
            && fs::read_link(&link).is_ok_and(|target| target == self.slave_path)
        {
            let _ = fs::remove_file(link);
        }
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        self.withdraw();
    }
}
