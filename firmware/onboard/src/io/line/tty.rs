//! A serial port: 8 data bits, no parity, one stop bit, any rate, nobody else on it.
//!
//! The crate `serialport` opens and configures it, pseudo-terminals too. Here is what that crate does not
//! have, on its file descriptor: a read that waits in `poll` and allocates nothing, a write that never
//! blocks, no hang-up at the close, the rate compared with what the driver's divisor really gives, and a
//! refusal that leaves the port to whoever has it.

use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd, RawFd};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{FlockOperation, Mode, OFlags, fcntl_getfl, fcntl_setfl, flock, open};
use rustix::io::Errno;
use rustix::termios::{ControlModes, OptionalActions, tcgetattr, tcsetattr};
use serialport::{ClearBuffer, DataBits, FlowControl, Parity, SerialPort, StopBits, TTYPort};

const NS_PER_S: i64 = 1_000_000_000;
/// A request is short; a port that does not take it in this time has a dead adapter, nanoseconds.
const WRITE_NS: i64 = 20_000_000;
/// Rates further off than this are no rates of the line: sender and receiver may differ by 5 % in all.
const RATE_TOLERANCE: f64 = 0.03;

/// An open port.
#[derive(Debug)]
pub struct Tty {
    /// Locked to set the rate, which needs it alone.
    port: Mutex<TTYPort>,
    /// That of `port`: a read may wait in it while another thread sets the rate.
    fd: RawFd,
}

impl Tty {
    /// Opens a port for one user alone, at a rate in bits per second where the adapter has it:
    /// [`Tty::set_baud`] tells of one that has not. Bytes that came before are dropped: at another rate they
    /// are noise.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::ResourceBusy`] when somebody else has it.
    pub fn open(path: &Path, baud: u32) -> io::Result<Self> {
        // Held until the end: on some adapters the close of the last user would pull DTR down.
        let first_look = look_at(path)?;
        // Opened at the rate that it has: one that the adapter lacks would not let it be opened at all.
        let baud_now = Some(tcgetattr(&first_look)?.output_speed()).filter(|baud| *baud > 0);
        let name = path.to_str().ok_or(io::ErrorKind::InvalidFilename)?;
        let port = serialport::new(name, baud_now.unwrap_or(baud))
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None);
        let port = TTYPort::open(&port).map_err(in_words_of_the_system)?;
        let tty = Self { fd: port.as_raw_fd(), port: Mutex::new(port) };
        tty.keep_line_up()?;
        match tty.set_baud(baud) {
            // The port is there, and has other rates: whoever needs this one is told when it asks for it.
            Err(error) if error.kind() == io::ErrorKind::Unsupported => {}
            result => result?,
        }
        tty.port().clear(ClearBuffer::Input)?;
        Ok(tty)
    }

    /// No hang-up at the close: some adapters feed the line from DTR, some boards restart when it falls. And
    /// no call waits, whatever the port does.
    fn keep_line_up(&self) -> io::Result<()> {
        let mut settings = tcgetattr(self)?;
        settings.control_modes -= ControlModes::HUPCL;
        tcsetattr(self, OptionalActions::Now, &settings)?;
        Ok(fcntl_setfl(self, fcntl_getfl(self)? | OFlags::NONBLOCK)?)
    }

    /// Changes the rate, bits per second. What was received at the old one can still be read: it arrived
    /// intact.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::Unsupported`] when the port does not run at this rate.
    pub fn set_baud(&self, baud: u32) -> io::Result<()> {
        if self.baud()? == baud {
            return Ok(());
        }
        let set = self.port().set_baud_rate(baud);
        // The crate's error does not tell a rate that the driver refuses from a port that is gone: this does.
        let in_force = self.baud()?;
        set.map_err(|error| io::Error::new(io::ErrorKind::Unsupported, error))?;
        if (f64::from(in_force) - f64::from(baud)).abs() > RATE_TOLERANCE * f64::from(baud) {
            return Err(io::Error::new(
                io::ErrorKind::Unsupported,
                format!("the adapter runs at {in_force} Bd when asked for {baud} Bd"),
            ));
        }
        Ok(())
    }

    /// The rate in force, bits per second, as the driver tells it.
    ///
    /// # Errors
    /// What the system says.
    pub fn baud(&self) -> io::Result<u32> {
        let baud = tcgetattr(self)?.output_speed();
        #[cfg(test)]
        let baud = baud.min(tests::fastest_baud());
        Ok(baud)
    }

    fn port(&self) -> MutexGuard<'_, TTYPort> {
        // A thread that died while it held the port left it as usable as before.
        self.port.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Bytes, as soon as there are any; `None` when none come within the time, nanoseconds, or a signal came.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::UnexpectedEof`] when the device has gone.
    pub fn read(&self, buffer: &mut [u8], timeout_ns: i64) -> io::Result<Option<usize>> {
        if !self.wait(PollFlags::IN, timeout_ns)? {
            return Ok(None);
        }
        match rustix::io::read(self, buffer) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => Ok(Some(count)),
            Err(Errno::AGAIN | Errno::INTR) => Ok(None),
            Err(errno) => Err(errno.into()),
        }
    }

    /// Sends bytes. It never waits for long, whatever the port does.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::TimedOut`] when the port does not take them all.
    pub fn write_all(&self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match rustix::io::write(self, bytes) {
                Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => {
                    if !self.wait(PollFlags::OUT, WRITE_NS)? {
                        return Err(io::ErrorKind::TimedOut.into());
                    }
                }
                Err(errno) => return Err(errno.into()),
            }
        }
        Ok(())
    }

    /// Whether something happened in time: also a hang-up, which the read or write then tells.
    fn wait(&self, what: PollFlags, timeout_ns: i64) -> io::Result<bool> {
        let timeout = Timespec { tv_sec: timeout_ns / NS_PER_S, tv_nsec: timeout_ns % NS_PER_S };
        match poll(&mut [PollFd::new(self, what)], Some(&timeout)) {
            Ok(count) => Ok(count > 0),
            Err(Errno::INTR) => Ok(false),
            Err(errno) => Err(errno.into()),
        }
    }
}

impl AsFd for Tty {
    fn as_fd(&self) -> BorrowedFd<'_> {
        // SAFETY: the descriptor is the port's, which is open as long as `self` is borrowed.
        unsafe { BorrowedFd::borrow_raw(self.fd) }
    }
}

/// The port, opened for a moment without touching anything on it. The crate's own refusal would take the
/// exclusive use away from whoever has the port, and its errors say less than the system's.
fn look_at(path: &Path) -> io::Result<OwnedFd> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let port = open(path, flags, Mode::empty())?;
    flock(&port, FlockOperation::NonBlockingLockExclusive).map_err(|errno| match errno {
        Errno::WOULDBLOCK => io::Error::from(io::ErrorKind::ResourceBusy),
        other => other.into(),
    })?;
    // The crate locks it next, through a descriptor of its own.
    flock(&port, FlockOperation::Unlock)?;
    Ok(port)
}

/// The crate says that there is no such device where somebody has it.
fn in_words_of_the_system(error: serialport::Error) -> io::Error {
    match error.kind {
        serialport::ErrorKind::NoDevice => io::ErrorKind::ResourceBusy.into(),
        _ => error.into(),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::cell::Cell;

    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::InputModes;

    thread_local! {
        static FASTEST_BAUD: Cell<u32> = const { Cell::new(u32::MAX) };
    }

    /// The adapters of this thread run at this rate when asked for a higher one. A pseudo-terminal runs at
    /// every rate.
    pub(crate) fn set_fastest_baud(baud: u32) {
        FASTEST_BAUD.set(baud);
    }

    pub(crate) fn fastest_baud() -> u32 {
        FASTEST_BAUD.get()
    }

    /// The other end of a line, and the path of ours.
    pub(crate) fn line() -> (OwnedFd, std::path::PathBuf) {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let path = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
        (master, path.into())
    }

    fn is_exclusive(tty: &Tty) -> bool {
        let mut exclusive = 0;
        // SAFETY: the kernel writes one int.
        let result = unsafe { libc::ioctl(tty.fd, libc::TIOCGEXCL, &raw mut exclusive) };
        assert_eq!(result, 0);
        exclusive != 0
    }

    /// What the kernel holds, asked by its own name.
    fn termios2(tty: &Tty) -> libc::termios2 {
        // SAFETY: the kernel fills all of the structure, which is plain numbers.
        unsafe {
            let mut settings: libc::termios2 = std::mem::zeroed();
            assert_eq!(libc::ioctl(tty.as_fd().as_raw_fd(), libc::TCGETS2, &raw mut settings), 0);
            settings
        }
    }

    #[test]
    fn every_rate_is_set_as_it_is_and_the_line_is_raw_8n1_without_hang_up() {
        let (_master, path) = line();
        // As another program may have left it.
        let before = open(&path, OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).unwrap();
        let mut settings = tcgetattr(&before).unwrap();
        settings.control_modes |= ControlModes::HUPCL | ControlModes::CSTOPB | ControlModes::CRTSCTS;
        settings.input_modes |= InputModes::IXON | InputModes::IXOFF;
        tcsetattr(&before, OptionalActions::Now, &settings).unwrap();
        let tty = Tty::open(&path, 9600).unwrap();
        for baud in [9600, 19200, 38400, 500_000, 123_456] {
            tty.set_baud(baud).unwrap();
            let settings = termios2(&tty);
            assert_eq!((settings.c_ispeed, settings.c_ospeed), (baud, baud));
            assert_eq!(tty.baud().unwrap(), baud);
        }
        let settings = termios2(&tty);
        assert_eq!(settings.c_cflag & libc::CSIZE, libc::CS8);
        let off = libc::CSTOPB | libc::PARENB | libc::CRTSCTS | libc::HUPCL;
        assert_eq!(settings.c_cflag & (off | libc::CLOCAL | libc::CREAD), libc::CLOCAL | libc::CREAD);
        assert_eq!(settings.c_lflag & (libc::ICANON | libc::ECHO | libc::ISIG), 0);
        assert_eq!(settings.c_iflag & (libc::IXON | libc::IXOFF | libc::ICRNL | libc::ISTRIP), 0);
        assert_eq!(settings.c_oflag & libc::OPOST, 0);
    }

    #[test]
    fn a_port_opens_also_at_a_rate_that_it_does_not_have_and_tells_so_when_it_is_set() {
        let (_master, path) = line();
        set_fastest_baud(115_200);
        let tty = Tty::open(&path, 500_000).unwrap();
        assert_eq!(tty.set_baud(500_000).unwrap_err().kind(), io::ErrorKind::Unsupported);
        tty.set_baud(38400).unwrap();
        assert_eq!(tty.baud().unwrap(), 38400);
    }

    #[test]
    fn bytes_go_both_ways_unchanged_and_nothing_is_no_error() {
        let (master, path) = line();
        let tty = Tty::open(&path, 500_000).unwrap();
        let all: Vec<u8> = (0..=255).collect();
        let mut buffer = [0; 512];
        assert_eq!(tty.read(&mut buffer, 1_000_000).unwrap(), None);
        rustix::io::write(&master, &all).unwrap();
        assert_eq!(tty.read(&mut buffer, 1_000_000_000).unwrap(), Some(256));
        assert_eq!(&buffer[..256], &all[..]);
        tty.write_all(&all).unwrap();
        assert_eq!(rustix::io::read(&master, &mut buffer).unwrap(), 256);
        assert_eq!(&buffer[..256], &all[..]);
    }

    #[test]
    fn what_came_before_the_port_was_opened_is_dropped_and_what_came_before_its_rate_changed_is_not() {
        let (master, path) = line();
        let before = open(&path, OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).unwrap();
        rustix::io::write(&master, b"old").unwrap();
        let tty = Tty::open(&path, 38400).unwrap();
        drop(before);
        let mut buffer = [0; 8];
        assert_eq!(tty.read(&mut buffer, 20_000_000).unwrap(), None);
        for baud in [38400, 9600] {
            rustix::io::write(&master, b"scan").unwrap();
            assert!(tty.wait(PollFlags::IN, 1_000_000_000).unwrap());
            tty.set_baud(baud).unwrap();
            assert_eq!(tty.read(&mut buffer, 20_000_000).unwrap(), Some(4), "{baud} Bd");
        }
    }

    #[test]
    fn a_device_that_goes_is_told_at_once_and_a_port_in_use_is_busy() {
        let (master, path) = line();
        let tty = Tty::open(&path, 38400).unwrap();
        assert_eq!(Tty::open(&path, 38400).unwrap_err().kind(), io::ErrorKind::ResourceBusy);
        assert!(is_exclusive(&tty), "the refused one has not taken it away");
        drop(master);
        let before_ns = biplane_clock::monotonic_ns();
        assert!(tty.read(&mut [0; 8], 5_000_000_000).is_err());
        assert!(biplane_clock::monotonic_ns() - before_ns < 1_000_000_000);
        assert!(Tty::open(Path::new("/dev/null"), 38400).is_err(), "no terminal");
    }

    #[test]
    fn a_port_that_takes_nothing_holds_nobody_up() {
        let (_master, path) = line();
        let tty = Tty::open(&path, 38400).unwrap();
        let before_ns = biplane_clock::monotonic_ns();
        let result = tty.write_all(&[0; 1 << 20]);
        assert_eq!(result.unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!(biplane_clock::monotonic_ns() - before_ns < 1_000_000_000);
    }
}
