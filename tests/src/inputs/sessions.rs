//! Sessions with devices on a line that does what the input says: whatever comes when, a session comes to
//! rest after every input, loses nothing of what it wanted to say, and has accounted for what came.
//!
//! A mock device is at the other end, so that a script of a few bytes reaches every state. First byte: which
//! session. Then one byte an operation: what in its low three bits, how much in the others.

use biplane_mock::devices::base::counters::{CountScale, SourceCounts};
use biplane_mock::devices::base::feed::CycleFeed;
use biplane_mock::devices::base::rflex::{RflexDevice, RflexParams};
use biplane_mock::devices::base::roboclaw::{RoboClawDevice, RoboClawParams};
use biplane_mock::devices::base::{BaseDevice, BaseParams};
use biplane_mock::devices::device::Device;
use biplane_mock::devices::lms::scans::feed::{MirrorFeed, Timeline};
use biplane_mock::devices::lms::settings::Variant;
use biplane_mock::devices::lms::{LmsDevice, LmsParams};
use biplane_mock::rig::source::{OdometrySample, OdometrySource, ScanSource, ScanWords};
use biplane_onboard::{
    BaseSession, BaseSettings, Input, LaserSession, LaserSettings, MAX_INPUT_BYTES, Output, Session,
};
use biplane_recording::rig::{BaseProtocol, Laser};

const MS: i64 = 1_000_000;
/// Outputs in answer to one input, at most: more is a session that does not come to rest.
const MAX_OUTPUTS: usize = 1000;
/// Operations that are carried out: more say nothing new.
const MAX_OPERATIONS: usize = 2000;

struct World;

impl Timeline for World {
    fn world_ns(&self, device_ns: i64) -> i64 {
        device_ns
    }
}

impl ScanSource for World {
    fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, _mm: bool) -> Option<ScanWords> {
        let count = u32::from(fov_deg) * 100 / u32::from(resolution_cdeg.max(1)) + 1;
        Some((0..count.min(401)).map(|beam| 200 + (beam as i64 * 7 + t0_ns / MS) as u16 % 600).collect())
    }
}

impl OdometrySource for World {
    fn sample(&mut self, t_ns: i64) -> OdometrySample {
        let path_mm = t_ns / MS / 4;
        OdometrySample {
            x_raw: (path_mm & 0x7FFF) as u16,
            path_um: path_mm * 1000,
            moving: true,
            ..OdometrySample::default()
        }
    }
}

/// A session with a laser.
pub(super) fn laser(input: &[u8]) {
    let Some((how, script)) = input.split_first() else { return };
    const RATES: [u32; 4] = [9600, 19_200, 38_400, 500_000];
    let rate = |bits: u8| RATES[usize::from(bits & 3)];
    let asked =
        Laser { baud: rate(how >> 2), index_bytes: (how & 0x40 != 0).then_some(true), ..Laser::horizontal() };
    let settings = LaserSettings::from(&asked);
    let params = LmsParams { baud: rate(how >> 4), variant: Variant::of(100, 50), ..LmsParams::default() };
    let device = LmsDevice::new(params, Box::new(MirrorFeed::new(Box::new(World), Box::new(World))));
    let mut session = match how & 3 {
        0 => LaserSession::probing(settings, 0),
        1 => LaserSession::listening(settings, 0),
        _ => LaserSession::streaming(settings, 0),
    };
    Line::new(Box::new(device)).run(&mut session, script);
    session.finish();
    let _ = (session.info().differs(&settings), session.health(), session.truncated());
}

/// A session with a base.
pub(super) fn base(input: &[u8]) {
    let Some((how, script)) = input.split_first() else { return };
    let protocol = match how & 3 {
        0 => BaseProtocol::RoboClaw {
            address: 0x80,
            wheel_base_m: 0.4,
            metres_per_count_left: 0.0001,
            metres_per_count_right: 0.0001,
        },
        1 => BaseProtocol::Rflex { counts_per_m: 100_000.0, counts_per_rad: 30_000.0 },
        _ => BaseProtocol::P2os { metres_per_tick: None },
    };
    let baud = protocol.default_baud();
    let settings = BaseSettings { baud, protocol };
    let mut session = match how >> 2 & 3 {
        0 => BaseSession::probing(settings, 0),
        1 => BaseSession::listening(settings, 0),
        _ => BaseSession::streaming(settings, 0),
    };
    Line::new(device_of(&protocol, baud)).run(&mut session, script);
    session.finish();
    let _ = (session.info(), session.not_kept());
}

fn device_of(protocol: &BaseProtocol, baud: u32) -> Box<dyn Device> {
    let Some(scale) = CountScale::of(protocol) else {
        let feed = CycleFeed::new(Box::new(World), Box::new(World), 100 * MS);
        return Box::new(BaseDevice::new(BaseParams { baud, ..BaseParams::default() }, Box::new(feed)));
    };
    let feed = Box::new(SourceCounts::new(Box::new(World), Box::new(World), scale));
    match protocol {
        BaseProtocol::RoboClaw { address, .. } => Box::new(RoboClawDevice::new(
            RoboClawParams { address: *address, baud, ..RoboClawParams::default() },
            feed,
        )),
        _ => Box::new(RflexDevice::new(RflexParams { baud, ..RflexParams::default() }, feed)),
    }
}

/// A line between a session and a device, in simulated time.
struct Line {
    device: Box<dyn Device>,
    now_ns: i64,
    /// When session and device want to be asked again.
    session_ns: i64,
    device_ns: i64,
    /// What the device has sent and the session has not got yet.
    waiting: Vec<u8>,
    delivered: u64,
    baud: u32,
}

impl Line {
    fn new(device: Box<dyn Device>) -> Self {
        let waiting = Vec::new();
        Self { device, now_ns: 0, session_ns: 0, device_ns: 0, waiting, delivered: 0, baud: 0 }
    }

    fn run(&mut self, session: &mut dyn Session, script: &[u8]) {
        self.baud = session.baud();
        self.drain(session);
        let mut script = script.iter().copied();
        for _ in 0..MAX_OPERATIONS {
            let Some(operation) = script.next() else { break };
            self.operate(session, operation & 7, usize::from(operation >> 3), &mut script);
            assert_eq!(session.overflowed(), 0, "outputs were lost");
            assert!(session.counts().bytes() <= self.delivered, "bytes were made up");
        }
    }

    fn operate(
        &mut self,
        session: &mut dyn Session,
        what: u8,
        count: usize,
        script: &mut impl Iterator<Item = u8>,
    ) {
        let place = count * self.waiting.len() / 32;
        match what {
            // Time passes: to whatever is due next, or by powers of two up to half an hour.
            0 => self.advance(session, self.session_ns.min(self.device_ns).min(self.now_ns + 20 * MS)),
            1 => self.advance(session, self.now_ns + (MS << count.min(21))),
            2 => self.deliver(session, place.max(1)),
            3 => self.deliver(session, self.waiting.len()),
            4 => {
                if let Some(byte) = self.waiting.get_mut(place) {
                    *byte ^= script.next().unwrap_or(1);
                }
            }
            5 => drop(self.waiting.drain(place..(place + 1 + count / 4).min(self.waiting.len()).max(place))),
            6 => {
                let made_up: Vec<u8> = script.take(count).collect();
                self.waiting.splice(place..place, made_up);
            }
            _ => self.happen(session, count),
        }
    }

    fn happen(&mut self, session: &mut dyn Session, which: usize) {
        match which {
            0..=3 => session.handle(self.now_ns, Input::PortBack),
            4..=7 => session.handle(self.now_ns, Input::RateRefused(self.baud)),
            8..=11 => session.handle(self.now_ns, Input::Stop),
            12..=15 => self.device.power_on(self.now_ns),
            16..=19 => self.waiting.extend_from_within(..),
            20..=23 => self.waiting.reverse(),
            _ => self.waiting.clear(),
        }
        self.waiting.truncate(4096);
        self.drain(session);
    }

    fn advance(&mut self, session: &mut dyn Session, to_ns: i64) {
        self.now_ns = to_ns.max(self.now_ns + 1);
        let before = self.waiting.len();
        let same = self.device.baud() == self.baud;
        self.device_ns = self.device.poll(self.now_ns, &mut self.waiting);
        // At another rate the bytes are not those that were sent.
        self.waiting
            .iter_mut()
            .skip(if same { usize::MAX } else { before })
            .for_each(|byte| *byte = byte.rotate_left(3) ^ 0x5A);
        self.waiting.truncate(4096);
        session.handle(self.now_ns, Input::Time);
        self.drain(session);
    }

    fn deliver(&mut self, session: &mut dyn Session, count: usize) {
        let bytes: Vec<u8> = self.waiting.drain(..count.min(self.waiting.len())).collect();
        for piece in bytes.chunks(MAX_INPUT_BYTES) {
            self.delivered += piece.len() as u64;
            session.handle(self.now_ns, Input::Bytes(piece));
            self.drain(session);
        }
    }

    /// Does what the session wants, until it waits.
    fn drain(&mut self, session: &mut dyn Session) {
        for _ in 0..MAX_OUTPUTS {
            match session.poll() {
                Output::WaitUntil(until_ns) => {
                    self.session_ns = until_ns;
                    return;
                }
                Output::SetBaud(baud) => self.baud = baud,
                Output::Write(bytes) if self.device.baud() == self.baud => {
                    self.device.handle(self.now_ns, &bytes);
                }
                Output::Write(bytes) => self.device.handle_noise(self.now_ns, bytes.len()),
                Output::Scan(_)
                | Output::TimedScan
                | Output::Reconnect
                | Output::Odometry(_)
                | Output::Inertial(_)
                | Output::Event(_) => {}
            }
        }
        panic!("a session does not come to rest");
    }
}
