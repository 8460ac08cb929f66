//! One device on one pseudo-terminal: the loop that moves bytes between the two, each at its time.

use super::LinkName;
use super::client_rate::ClientRate;
use super::clock::VirtualClock;
use crate::devices::device::{Device, DeviceCounts};
use crate::devices::pty::Pty;
use crate::devices::run::Run;
use crate::faults::episodes::Episode;
use crate::line::{Channel, garble};
use crate::rng::Rng;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// A loop looks at least this often whether it shall stop, and which speed its client has set; wall time.
const LONGEST_WAIT_NS: i64 = 5_000_000;

/// A device, its terminal and its place in the rig.
pub(super) struct Port {
    /// Name of the link.
    pub name: LinkName,
    /// Place in the run's list of devices.
    pub place: usize,
    /// The device.
    pub device: Box<dyn Device>,
    /// Its terminal.
    pub pty: Pty,
    /// Where its link stands.
    pub link: PathBuf,
    /// While its plug is out.
    pub unplugged: Vec<Episode>,
    /// Faults on the bytes from the device.
    pub to_host: Channel,
    /// Faults on the bytes to the device.
    pub from_host: Channel,
    /// Noise of a line at two rates.
    pub noise: Rng,
    /// Whether the client's rate is not looked at.
    pub any_baud: bool,
    /// The rate at which the client wrote.
    pub client_rate: ClientRate,
}

/// What a port has done, for the summary.
#[derive(Clone, Copy, Debug)]
pub struct PortReport {
    /// Name of the link.
    pub name: LinkName,
    /// What the device counted.
    pub device: DeviceCounts,
    /// Bytes that no client received.
    pub lost_bytes: u64,
    /// Bytes that faults changed, dropped or added.
    pub faulted_bytes: u64,
}

impl Port {
    /// Runs until `stop`.
    pub(super) fn run(mut self, clock: VirtualClock, run: &Run, stop: &AtomicBool) -> PortReport {
        let mut out = Vec::new();
        while !stop.load(Ordering::Relaxed) {
            let now_ns = clock.now_ns();
            if self.is_out(now_ns) {
                out.clear();
                let due_ns = self.device.poll(now_ns, &mut out);
                self.pty.lost_bytes += out.len() as u64;
                run.report(self.place, self.device.is_streaming(), now_ns);
                self.pty.wait(clock.wall_between_ns(now_ns, due_ns).min(LONGEST_WAIT_NS));
                continue;
            }
            self.listen(now_ns, clock.wall_between_ns(0, now_ns));
            out.clear();
            let baud = self.device.baud();
            let due_ns = self.device.poll(now_ns, &mut out);
            run.report(self.place, self.device.is_streaming(), now_ns);
            let due_ns = self.speak(now_ns, baud, &out, due_ns);
            let wait_ns = clock.wall_between_ns(clock.now_ns(), due_ns);
            self.pty.wait(wait_ns.min(LONGEST_WAIT_NS));
        }
        self.pty.withdraw();
        PortReport {
            name: self.name,
            device: self.device.counts(),
            lost_bytes: self.pty.lost_bytes,
            faulted_bytes: self.to_host.changed_bytes() + self.from_host.changed_bytes(),
        }
    }

    /// Whether the plug is out. As with a USB adapter that is pulled, the link is gone and a client is hung
    /// up on; put back, it is another terminal behind the same link.
    fn is_out(&mut self, now_ns: i64) -> bool {
        let is_out = self.unplugged.iter().any(|out| out.holds(now_ns));
        if is_out && self.pty.is_published() {
            let lost_bytes = self.pty.lost_bytes;
            // Without another terminal the plug stays in.
            let Ok(fresh) = Pty::open(self.pty.client_baud().unwrap_or(9600)) else { return false };
            self.pty = fresh;
            self.pty.lost_bytes = lost_bytes;
            self.client_rate = ClientRate::default();
        } else if !is_out && !self.unplugged.is_empty() && !self.pty.is_published() {
            let _ = self.pty.publish(&self.link);
        }
        is_out
    }

    /// The rate that the client has set, when it is not the device's.
    fn wrong_baud(&self, baud: u32) -> Option<u32> {
        self.pty.client_baud().filter(|&client| client != baud && !self.any_baud && baud != 0)
    }

    /// Takes what the client has written; `now_ns` is virtual time.
    fn listen(&mut self, now_ns: i64, wall_ns: i64) {
        let mut buffer = [0; 1024];
        // What is read is read before the look at the speed: a change between the two must not be missed.
        let count = self.pty.read(&mut buffer);
        let written_at = self.pty.client_baud().map(|baud| self.client_rate.at_writing(wall_ns, baud));
        if count == 0 && !self.from_host.holds_bytes() {
            return;
        }
        let needed = self.device.baud();
        if !self.any_baud && needed != 0 && written_at.is_some_and(|baud| baud != needed) {
            self.device.handle_noise(now_ns, count);
            return;
        }
        self.from_host.push(now_ns, &buffer[..count]);
        let mut received = Vec::new();
        self.from_host.take(now_ns, &mut received);
        self.device.handle(now_ns, &received);
    }

    fn speak(&mut self, now_ns: i64, baud: u32, out: &[u8], due_ns: i64) -> i64 {
        if !out.is_empty() {
            match self.wrong_baud(baud) {
                Some(client) => {
                    let noise = garble(out, baud, client, &mut self.noise);
                    self.to_host.push(now_ns, &noise);
                }
                None => self.to_host.push(now_ns, out),
            }
        }
        let mut bytes = Vec::new();
        self.to_host.take(now_ns, &mut bytes);
        if !bytes.is_empty() {
            self.pty.write(&bytes);
        }
        let held = [self.to_host.next_due_ns(), self.from_host.next_due_ns()];
        held.into_iter().flatten().fold(due_ns, i64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::bench::{Same, hex};
    use crate::devices::lms::scans::feed::MirrorFeed;
    use crate::devices::lms::{LmsDevice, LmsParams};
    use crate::rig::source::{ScanSource, ScanWords};
    use rustix::fs::{Mode, OFlags};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
    use std::os::fd::OwnedFd;

    const MS: i64 = 1_000_000;

    struct Nothing;

    impl ScanSource for Nothing {
        fn scan(&mut self, _: i64, _: u16, _: u16, _: bool) -> Option<ScanWords> {
            None
        }

        fn turn(&mut self, _: i64, _: u8, _: bool) -> Option<ScanWords> {
            None
        }
    }

    /// A laser at 9600 Bd, and a client that has its port open at that speed.
    fn laser() -> (Port, OwnedFd) {
        let feed = MirrorFeed::new(Box::new(Nothing), Box::new(Same));
        let pty = Pty::open(9600).expect("a pseudo-terminal");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let client = rustix::fs::open(pty.slave_path(), flags, Mode::empty()).expect("it opens");
        let port = Port {
            name: LinkName::Horizontal,
            place: 0,
            device: Box::new(LmsDevice::new(LmsParams::default(), Box::new(feed))),
            pty,
            link: PathBuf::new(),
            unplugged: Vec::new(),
            to_host: Channel::default(),
            from_host: Channel::default(),
            noise: Rng::new(1, 0, 0),
            any_baud: false,
            client_rate: ClientRate::default(),
        };
        (port, client)
    }

    fn set_speed(client: &OwnedFd, baud: u32) {
        let mut settings = tcgetattr(client).expect("a terminal");
        settings.set_speed(baud).expect("a speed");
        tcsetattr(client, OptionalActions::Now, &settings).expect("it is set");
    }

    #[test]
    fn a_late_mock_takes_a_request_at_the_speed_at_which_it_was_written() {
        // When the mock looks, and whether the client's speed was already another one when it wrote.
        for (late_ms, is_wrong, requests) in [(50, false, 1), (3, true, 0)] {
            let (mut port, client) = laser();
            port.listen(0, 0);
            let to_38400 = hex("02 00 02 00 20 40 50 08");
            if is_wrong {
                set_speed(&client, 38_400);
            }
            assert_eq!(rustix::io::write(&client, &to_38400).expect("it is written"), to_38400.len());
            set_speed(&client, 38_400);
            port.listen(late_ms * MS, late_ms * MS);
            let counts = port.device.counts();
            assert_eq!(counts.requests, requests, "{late_ms} ms late");
            assert_eq!(counts.noise_bytes, (1 - requests) * 8, "{late_ms} ms late");
        }
    }

    /// A client does as AriaCoda: it writes, changes its speed 20 ms later, and asks 300 ms after that. The
    /// mock looks every few milliseconds, but for the times that it is held up. Whether it hears both.
    fn hears_both(seed: u64) -> bool {
        let mut rng = Rng::new(seed, 0xA21A, 0);
        let mut ms = |low: f64, high: f64| (rng.between(low, high) * MS as f64) as i64;
        let written_ns = ms(20.0, 40.0);
        // It may be held up around each of the two, so that it sees the speed only behind it.
        let held_up = [written_ns - ms(0.0, 5.0), written_ns + 320 * MS - ms(0.0, 5.0)];
        // By more than a fifth of a second and the device has not changed its rate when it is asked.
        let late_ns = [ms(0.0, 200.0), ms(0.0, 280.0)];
        let status = hex("02 00 01 00 31 15 12");
        let to_38400 = hex("02 00 02 00 20 40 50 08");
        let (mut port, client) = laser();
        let mut does = [(0, Some(&to_38400)), (20, None), (320, Some(&status))].into_iter().peekable();
        let (mut now_ns, mut held) = (0, held_up.into_iter().zip(late_ns).peekable());
        while now_ns < written_ns + 1000 * MS {
            while let Some((_, request)) = does.next_if(|(at_ms, _)| written_ns + at_ms * MS <= now_ns) {
                match request {
                    Some(bytes) => drop(rustix::io::write(&client, bytes).expect("it is written")),
                    None => set_speed(&client, 38_400),
                }
            }
            port.listen(now_ns, now_ns);
            port.device.poll(now_ns, &mut Vec::new());
            let pause_ns = ms(0.5, 5.0);
            now_ns += held
                .next_if(|(at_ns, _)| *at_ns <= now_ns + pause_ns)
                .map_or(pause_ns, |(_, late)| late.max(pause_ns));
        }
        (port.device.counts().requests, port.device.counts().noise_bytes) == (2, 0)
    }

    #[test]
    fn a_mock_held_up_by_a_fifth_of_a_second_hears_a_client_that_changes_its_speed_behind_a_request() {
        let asked = std::env::var("BIPLANE_SEEDS").ok().and_then(|text| text.parse().ok());
        let seeds = 1..=asked.unwrap_or(20);
        let deaf: Vec<u64> = seeds.clone().filter(|seed| !hears_both(*seed)).collect();
        println!("{} runs", seeds.count());
        assert!(deaf.is_empty(), "both requests are not heard with the seeds {deaf:?}");
    }
}
