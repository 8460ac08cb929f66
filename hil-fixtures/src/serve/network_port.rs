//! One device behind a TCP port of this machine: the loop that moves bytes between the two, each at its time.
//! One client at a time; another one is hung up on.

use super::clock::VirtualClock;
use super::{LinkName, PortReport};
use crate::devices::device::Device;
use crate::devices::run::Run;
use crate::faults::episodes::Episode;
use crate::line::Channel;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// A loop looks at least this often whether it shall stop; wall time.
const LONGEST_WAIT_NS: i64 = 5_000_000;
const NS_PER_S: i64 = 1_000_000_000;

/// A device and its listening port.
pub(super) struct NetworkPort {
    /// Name of the link.
    pub name: LinkName,
    /// Place in the run's list of devices.
    pub place: usize,
    /// The device.
    pub device: Box<dyn Device>,
    /// Faults on the bytes from the device.
    pub to_host: Channel,
    /// Faults on the bytes to the device.
    pub from_host: Channel,
    /// While its plug is out.
    pub unplugged: Vec<Episode>,
    listener: TcpListener,
    client: Option<TcpStream>,
    /// The file that says where it listens.
    address_file: PathBuf,
    lost_bytes: u64,
}

impl NetworkPort {
    /// Listens on a free port of this machine, and says which in `NAME.address` of the folder.
    pub(super) fn open(
        name: LinkName,
        place: usize,
        device: Box<dyn Device>,
        channels: [Channel; 2],
        links: &Path,
    ) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        listener.set_nonblocking(true)?;
        let address_file = links.join(format!("{}.address", name.name()));
        std::fs::write(&address_file, format!("{}\n", listener.local_addr()?))?;
        let [to_host, from_host] = channels;
        Ok(Self {
            name,
            place,
            device,
            to_host,
            from_host,
            unplugged: Vec::new(),
            listener,
            client: None,
            address_file,
            lost_bytes: 0,
        })
    }

    /// Runs until `stop`.
    pub(super) fn run(mut self, clock: VirtualClock, run: &Run, stop: &AtomicBool) -> PortReport {
        let (mut out, mut was_out) = (Vec::new(), false);
        while !stop.load(Ordering::Relaxed) {
            let now_ns = clock.now_ns();
            // A cable that is pulled is silence; the connection does not outlive it.
            let is_out = self.unplugged.iter().any(|out| out.holds(now_ns));
            if std::mem::replace(&mut was_out, is_out) && !is_out {
                self.hang_up(now_ns);
            }
            if is_out {
                out.clear();
                let due_ns = self.device.poll(now_ns, &mut out);
                self.lost_bytes += out.len() as u64;
                let wait_ns = clock.wall_between_ns(now_ns, due_ns);
                biplane_clock::sleep_ns(wait_ns.clamp(0, LONGEST_WAIT_NS));
                continue;
            }
            self.accept(now_ns);
            self.listen(now_ns);
            out.clear();
            let due_ns = self.device.poll(now_ns, &mut out);
            run.report(self.place, self.device.is_streaming(), now_ns);
            let due_ns = self.speak(now_ns, &out, due_ns);
            let wait_ns = clock.wall_between_ns(clock.now_ns(), due_ns);
            self.wait(wait_ns.clamp(0, LONGEST_WAIT_NS));
        }
        let _ = std::fs::remove_file(&self.address_file);
        PortReport {
            name: self.name,
            device: self.device.counts(),
            lost_bytes: self.lost_bytes,
            faulted_bytes: self.to_host.changed_bytes() + self.from_host.changed_bytes(),
        }
    }

    fn accept(&mut self, now_ns: i64) {
        let takes = self.device.takes_connection(now_ns);
        if !takes && self.client.is_some() {
            self.hang_up(now_ns);
        }
        let Ok((stream, _)) = self.listener.accept() else { return };
        if takes && self.client.is_none() && stream.set_nonblocking(true).is_ok() {
            // Without it, short answers wait for more.
            let _ = stream.set_nodelay(true);
            self.device.connected(now_ns);
            self.client = Some(stream);
        }
    }

    fn hang_up(&mut self, now_ns: i64) {
        self.client = None;
        self.device.disconnected(now_ns);
    }

    fn listen(&mut self, now_ns: i64) {
        let mut buffer = [0; 1024];
        let count = match self.client.as_mut().map(|client| client.read(&mut buffer)) {
            Some(Ok(0)) => return self.hang_up(now_ns),
            Some(Ok(count)) => count,
            Some(Err(error)) if !is_passing(&error) => return self.hang_up(now_ns),
            _ => 0,
        };
        if count == 0 && !self.from_host.holds_bytes() {
            return;
        }
        self.from_host.push(now_ns, &buffer[..count]);
        let mut received = Vec::new();
        self.from_host.take(now_ns, &mut received);
        self.device.handle(now_ns, &received);
    }

    fn speak(&mut self, now_ns: i64, out: &[u8], due_ns: i64) -> i64 {
        if !out.is_empty() {
            self.to_host.push(now_ns, out);
        }
        let mut bytes = Vec::new();
        self.to_host.take(now_ns, &mut bytes);
        self.send(now_ns, &bytes);
        let held = [self.to_host.next_due_ns(), self.from_host.next_due_ns()];
        held.into_iter().flatten().fold(due_ns, i64::min)
    }

    /// A client that takes nothing for as long as the kernel keeps for it is hung up on, as a stream must not
    /// have holes.
    fn send(&mut self, now_ns: i64, bytes: &[u8]) {
        let mut rest = bytes;
        while let (false, Some(client)) = (rest.is_empty(), &mut self.client) {
            match client.write(rest) {
                Ok(count) => rest = &rest[count..],
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => self.hang_up(now_ns),
            }
        }
        self.lost_bytes += rest.len() as u64;
    }

    fn wait(&self, wait_ns: i64) {
        let timeout = Timespec { tv_sec: wait_ns / NS_PER_S, tv_nsec: wait_ns % NS_PER_S };
        let mut polled = vec![PollFd::new(&self.listener, PollFlags::IN)];
        polled.extend(self.client.iter().map(|client| PollFd::new(client, PollFlags::IN)));
        // A wait that fails is a short one.
        let _ = poll(&mut polled, Some(&timeout));
    }
}

fn is_passing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}
