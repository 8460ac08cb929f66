//! A TCP connection to a device: made within a second or not at all, sends at once, and is never waited for
//! while it is written.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::sockopt;

const NS_PER_S: i64 = 1_000_000_000;
/// A device that does not take a connection in this time is not there, or its network is not. Larger: a
/// device that comes back is found later.
const CONNECT: Duration = Duration::from_secs(1);
/// A request is short; a connection that does not take it in this time is dead, nanoseconds.
const WRITE_NS: i64 = 20_000_000;
/// The kernel asks a silent device so often whether it is still there.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// An open connection.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: TcpStream,
}

impl Connection {
    /// Connects to `host:port`, at the first of its addresses that answers.
    ///
    /// # Errors
    /// What the system says of the last address.
    pub(crate) fn open(address: &str) -> io::Result<Self> {
        let mut failed = io::Error::new(io::ErrorKind::NotFound, "this name has no address");
        for address in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(stream) => return Self::prepared(stream),
                Err(error) => failed = error,
            }
        }
        Err(failed)
    }

    fn prepared(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_nonblocking(true)?;
        sockopt::set_socket_keepalive(&stream, true)?;
        sockopt::set_tcp_keepidle(&stream, KEEP_ALIVE)?;
        sockopt::set_tcp_keepintvl(&stream, KEEP_ALIVE)?;
        Ok(Self { stream })
    }

    /// Reads what has come, after waiting for it so long; `None` when nothing came.
    ///
    /// # Errors
    /// The connection has gone: [`io::ErrorKind::UnexpectedEof`] when the device has closed it.
    pub(crate) fn read(&self, buffer: &mut [u8], timeout_ns: i64) -> io::Result<Option<usize>> {
        if !self.wait(PollFlags::IN, timeout_ns)? {
            return Ok(None);
        }
        match (&self.stream).read(buffer) {
            Ok(0) if !buffer.is_empty() => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => Ok(Some(count)),
            Err(error) if is_passing(&error) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Sends bytes.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::TimedOut`] when the other side takes nothing.
    pub(crate) fn write_all(&self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match (&self.stream).write(bytes) {
                Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
                Err(error) if is_passing(&error) => {
                    if !self.wait(PollFlags::OUT, WRITE_NS)? {
                        return Err(io::ErrorKind::TimedOut.into());
                    }
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Ends the connection: whoever reads it is told.
    pub(crate) fn hang_up(&self) {
        // One that is gone already needs no end.
        let _ = self.stream.shutdown(Shutdown::Both);
    }

    fn wait(&self, flags: PollFlags, timeout_ns: i64) -> io::Result<bool> {
        let timeout_ns = timeout_ns.max(0);
        let timeout = Timespec { tv_sec: timeout_ns / NS_PER_S, tv_nsec: timeout_ns % NS_PER_S };
        let mut polled = [PollFd::new(&self.stream, flags)];
        match poll(&mut polled, Some(&timeout)) {
            Ok(ready) => Ok(ready > 0),
            Err(Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }
}

fn is_passing(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    const MS: i64 = 1_000_000;

    #[test]
    fn bytes_pass_both_ways_and_the_end_of_a_connection_is_an_error() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let connection = Connection::open(&listener.local_addr().unwrap().to_string()).unwrap();
        let (mut device, _) = listener.accept().unwrap();
        let mut buffer = [0; 8];
        assert_eq!(connection.read(&mut buffer, MS).unwrap(), None);
        connection.write_all(b"ask").unwrap();
        device.read_exact(&mut buffer[..3]).unwrap();
        device.write_all(&buffer[..3]).unwrap();
        assert_eq!(connection.read(&mut buffer, 1000 * MS).unwrap(), Some(3));
        assert_eq!(&buffer[..3], b"ask");
        drop(device);
        let end = connection.read(&mut buffer, 1000 * MS).unwrap_err();
        assert_eq!(end.kind(), io::ErrorKind::UnexpectedEof);
    }

    #[test]
    fn who_hangs_up_reads_the_end() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let connection = Connection::open(&listener.local_addr().unwrap().to_string()).unwrap();
        let _device = listener.accept().unwrap();
        connection.hang_up();
        assert!(connection.read(&mut [0; 8], 1000 * MS).is_err());
    }

    #[test]
    fn a_device_that_takes_nothing_is_not_waited_for() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let connection = Connection::open(&listener.local_addr().unwrap().to_string()).unwrap();
        let _device = listener.accept().unwrap();
        let error = connection.write_all(&vec![0; 64 << 20]).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        drop(listener);
        assert!(Connection::open("127.0.0.1:1").is_err());
    }
}
