//! Devices that do not belong on a port: what somebody plugs in by mistake.
//!
//! Times are nanoseconds on the rig's clock.

use biplane_mock::devices::base::BaseParams;
use biplane_mock::devices::device::{Device, DeviceCounts};
use biplane_mock::devices::lms::LmsParams;
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::line::transfer_ns;
use biplane_onboard::ForeignProtocol;
use biplane_recording::{Port, rig};

use crate::rig::devices;
use crate::rig::devices::{idle_laser, laser, rflex_base, roboclaw_base};
use crate::rig::{MS, S};

/// What a satellite receiver says every second.
const SENTENCES: &[u8] = b"$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n\
$GPGSA,A,3,10,07,05,02,29,04,08,13,,,,,1.72,1.03,1.38*0A\r\n\
$GPRMC,092751.000,A,5321.6802,N,00630.3371,W,0.06,31.66,280511,,,A*45\r\n";
/// What a modem makes of what it does not know.
const COMPLAINT: &[u8] = b"\r\nERROR\r\n";
/// What it says by itself.
const CHATTER: &[u8] = b"\r\nRING\r\n\r\nNO CARRIER\r\n";

/// Who is on a port instead of the device that belongs there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ForeignDevice {
    /// A laser that streams at this rate.
    Laser(u32),
    /// A Pioneer that reports.
    Pioneer,
    /// An rFLEX base that reports, at this rate.
    Rflex(u32),
    /// A RoboClaw at this rate, which says nothing unasked.
    RoboClaw(u32),
    /// An inertial unit that measures, at this rate.
    Inertial(u32),
    /// A satellite receiver at 9600 Bd.
    Receiver,
    /// A modem at 9600 Bd.
    Modem,
    /// Whatever is sent comes back.
    Echo,
}

impl ForeignDevice {
    /// What it is called.
    #[must_use]
    pub(crate) fn name(self) -> String {
        match self {
            Self::Laser(baud) => format!("a laser at {baud} Bd"),
            Self::Pioneer => "a Pioneer".to_owned(),
            Self::Rflex(baud) => format!("an rFLEX base at {baud} Bd"),
            Self::RoboClaw(baud) => format!("a RoboClaw at {baud} Bd"),
            Self::Inertial(baud) => format!("an inertial unit at {baud} Bd"),
            Self::Receiver => "a satellite receiver".to_owned(),
            Self::Modem => "a modem".to_owned(),
            Self::Echo => "an echo".to_owned(),
        }
    }

    /// What the port of a device whose line runs at this rate can hear of it; a laser's runs at all of a
    /// laser's.
    #[must_use]
    pub(crate) fn received_by(self, port: Port, baud: u32) -> Option<ForeignProtocol> {
        let is_laser = matches!(port, Port::Horizontal | Port::Vertical);
        let listens = |at: u32| baud == at || (is_laser && matches!(at, 9600 | 19_200 | 38_400 | 500_000));
        let (foreign_protocol, at) = match self {
            Self::Laser(at) => (ForeignProtocol::Laser, at),
            Self::Pioneer => (ForeignProtocol::Pioneer, 9600),
            Self::Rflex(at) => (ForeignProtocol::Rflex, at),
            Self::RoboClaw(_) => return None,
            Self::Inertial(at) => (ForeignProtocol::Inertial, at),
            Self::Receiver => (ForeignProtocol::Receiver, 9600),
            Self::Modem => (ForeignProtocol::Text, 9600),
            Self::Echo => (ForeignProtocol::Echo, baud),
        };
        listens(at).then_some(foreign_protocol)
    }

    /// The device, which has been at work for a while.
    #[must_use]
    pub(crate) fn device(self, seed: u64, stream: u64) -> Box<dyn Device> {
        let left = Faults::new(&[Preset::LeftStreaming], seed);
        let open = |base: rig::Base| devices::base(&base, &left);
        match self {
            Self::Laser(baud) => streaming_laser(baud, seed, stream + 7),
            Self::Pioneer => open(rig::Base { baud: BaseParams::default().baud, ..rig::Base::default() }),
            Self::Rflex(baud) => open(rig::Base { baud, ..rflex_base() }),
            Self::RoboClaw(baud) => open(rig::Base { baud, ..roboclaw_base() }),
            Self::Inertial(baud) => {
                let unit = rig::InertialUnit { baud, ..rig::InertialUnit::xsens("imu") };
                devices::inertial_unit(&unit, &left, seed)
            }
            Self::Receiver => Box::new(Talker::new(SENTENCES, S, b"")),
            Self::Modem => Box::new(Talker::new(CHATTER, 2 * S, COMPLAINT)),
            Self::Echo => Box::new(Echo::default()),
        }
    }
}

/// A laser that streams as the rig wants it, but for its rate.
#[must_use]
pub(crate) fn streaming_laser(baud: u32, seed: u64, stream: u64) -> Box<dyn Device> {
    let params = LmsParams { left_streaming: true, ..idle_laser(baud) };
    laser(params, &Faults::default(), seed, stream)
}

/// Bytes on their way out, each at its time.
#[derive(Default)]
struct ByteQueue {
    waiting: std::collections::VecDeque<(i64, u8)>,
    free_ns: i64,
}

impl ByteQueue {
    fn say(&mut self, now_ns: i64, bytes: &[u8], baud: u32) {
        self.free_ns = self.free_ns.max(now_ns);
        for &byte in bytes {
            self.free_ns += transfer_ns(1, baud);
            self.waiting.push_back((self.free_ns, byte));
        }
    }

    fn take(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        while self.waiting.front().is_some_and(|(at_ns, _)| *at_ns <= now_ns) {
            out.extend(self.waiting.pop_front().map(|(_, byte)| byte));
        }
        self.waiting.front().map_or(i64::MAX, |(at_ns, _)| *at_ns)
    }
}

/// Says the same again and again at 9600 Bd, and something else whenever it is spoken to.
struct Talker {
    words: &'static [u8],
    every_ns: i64,
    next_ns: i64,
    answer: &'static [u8],
    byte_queue: ByteQueue,
}

impl Talker {
    fn new(words: &'static [u8], every_ns: i64, answer: &'static [u8]) -> Self {
        Self { words, every_ns, next_ns: i64::MIN, answer, byte_queue: ByteQueue::default() }
    }
}

impl Device for Talker {
    fn handle(&mut self, now_ns: i64, _: &[u8]) {
        if self.byte_queue.waiting.is_empty() {
            self.byte_queue.say(now_ns + 20 * MS, self.answer, self.baud());
        }
    }

    fn handle_noise(&mut self, _: i64, _: usize) {}

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        if self.next_ns <= now_ns {
            self.byte_queue.say(now_ns, self.words, self.baud());
            self.next_ns = now_ns + self.every_ns;
        }
        self.byte_queue.take(now_ns, out).min(self.next_ns)
    }

    fn power_on(&mut self, _: i64) {}

    fn baud(&self) -> u32 {
        9600
    }

    fn is_streaming(&self) -> bool {
        true
    }

    fn counts(&self) -> DeviceCounts {
        DeviceCounts::default()
    }
}

/// A plug with two pins joined: what is sent comes back, at whatever rate it was sent.
#[derive(Default)]
struct Echo {
    byte_queue: ByteQueue,
}

impl Device for Echo {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        self.byte_queue.say(now_ns, bytes, 500_000);
    }

    fn handle_noise(&mut self, _: i64, _: usize) {}

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        self.byte_queue.take(now_ns, out)
    }

    fn power_on(&mut self, _: i64) {}

    fn baud(&self) -> u32 {
        0
    }

    fn is_streaming(&self) -> bool {
        false
    }

    fn counts(&self) -> DeviceCounts {
        DeviceCounts::default()
    }
}
