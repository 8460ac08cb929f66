//! A serial client as plain as can be: opens a link, sets its speed, writes and reads.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::os::fd::OwnedFd;
use std::path::Path;

pub(crate) struct Client {
    port: OwnedFd,
}

impl Client {
    pub(crate) fn open(link: &Path, baud: u32) -> Self {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK;
        let client = Self { port: open(link, flags, Mode::empty()).expect("the link can be opened") };
        client.set_baud(baud);
        client
    }

    pub(crate) fn set_baud(&self, baud: u32) {
        let mut settings = tcgetattr(&self.port).expect("a terminal");
        settings.make_raw();
        settings.set_speed(baud).expect("a speed");
        tcsetattr(&self.port, OptionalActions::Now, &settings).expect("a terminal");
    }

    pub(crate) fn write(&self, bytes: &[u8]) {
        assert_eq!(rustix::io::write(&self.port, bytes), Ok(bytes.len()));
    }

    /// Reads until `enough` says so or the time is over.
    pub(crate) fn read_until(&self, wait_ms: i64, enough: impl Fn(&[u8]) -> bool) -> Vec<u8> {
        let end_ns = biplane_clock::monotonic_ns() + wait_ms * 1_000_000;
        let mut received = Vec::new();
        while !enough(&received) && biplane_clock::monotonic_ns() < end_ns {
            let mut ports = [PollFd::new(&self.port, PollFlags::IN)];
            let _ = poll(&mut ports, Some(&Timespec { tv_sec: 0, tv_nsec: 20_000_000 }));
            let mut buffer = [0; 4096];
            match rustix::io::read(&self.port, &mut buffer) {
                Ok(0) => break,
                Ok(count) => received.extend_from_slice(&buffer[..count]),
                Err(rustix::io::Errno::AGAIN) => {}
                Err(_) => break,
            }
        }
        received
    }

    /// Says a request and waits for this answer.
    pub(crate) fn ask(&self, request: &str, answer: &str) {
        self.write(&hex(request));
        let answer = hex(answer);
        let received = self.read_until(5000, |received| ends(received, &answer));
        assert!(ends(&received, &answer), "{request} was answered with {received:02x?}");
    }
}

fn ends(received: &[u8], answer: &[u8]) -> bool {
    received.windows(answer.len()).any(|window| window == answer)
}

pub(crate) fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("hex in a test")).collect()
}
