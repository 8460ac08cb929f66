//! Sessions with a mobile base: one driver a protocol behind one trait, each from bytes to the base's own
//! odometry.
//!
//! - [`p2os`]: Pioneer bases; they report a pose by themselves.
//! - [`roboclaw`]: home-made bases; wheel counts are asked for again and again.
//! - [`rflex`]: B21r, ATRV, Magellan; they report way and bearing by themselves. Never tried on hardware.
//!
//! No driver ever enables a motor or commands a speed other than zero: the operator drives. Frame of the
//! odometry: the base's own (`odom`); it goes on where it was when a base starts to count anew. Units:
//! meters, radians, nanoseconds.

pub(crate) mod absent;
pub(crate) mod contact;
pub(crate) mod counted;
pub(crate) mod driver;
pub(crate) mod motion;
pub(crate) mod p2os;
pub(crate) mod packets;
pub(crate) mod reading;
pub(crate) mod rflex;
pub(crate) mod roboclaw;

use biplane_recording::rig::{self, BaseProtocol};
use biplane_wire::Counts;

use crate::session::base::driver::BaseDriver;
use crate::session::base::driver::Purpose;
use crate::session::base::packets::PacketSession;
use crate::session::base::reading::BaseInfo;
use crate::session::device_session::{Input, Output, Session};

/// What the rig says of the base.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct BaseSettings {
    /// Rate of the line, bits per second.
    pub baud: u32,
    /// What it speaks, and what its counts are worth.
    pub protocol: BaseProtocol,
}

impl From<&rig::Base> for BaseSettings {
    fn from(base: &rig::Base) -> Self {
        Self { baud: base.baud, protocol: base.protocol }
    }
}

/// A session with one base, whatever it speaks.
#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // one a robot, and no heap in the acquisition path
pub enum BaseSession {
    /// No base.
    Absent(absent::AbsentBase),
    /// P2OS, ARCOS.
    P2os(PacketSession<p2os::machine::Machine>),
    /// RoboClaw.
    RoboClaw(roboclaw::RoboClaw),
    /// rFLEX.
    Rflex(PacketSession<rflex::machine::Machine>),
}

impl BaseSession {
    /// A session that opens the base and keeps it reporting.
    #[must_use]
    pub fn streaming(settings: BaseSettings, now_ns: i64) -> Self {
        Self::new(settings, Purpose::Stream, now_ns)
    }

    /// A session that asks the base who it is, leaves it as it was, and is done.
    #[must_use]
    pub fn probing(settings: BaseSettings, now_ns: i64) -> Self {
        Self::new(settings, Purpose::Probe, now_ns)
    }

    /// A session that only listens to what once came from a base, and to what was sent to it.
    #[must_use]
    pub fn listening(settings: BaseSettings, now_ns: i64) -> Self {
        Self::new(settings, Purpose::Listen, now_ns)
    }

    fn new(settings: BaseSettings, purpose: Purpose, now_ns: i64) -> Self {
        let baud = settings.baud;
        match settings.protocol {
            BaseProtocol::None => Self::Absent(absent::AbsentBase::default()),
            BaseProtocol::P2os { metres_per_tick } => {
                let machine = p2os::machine::Machine::new(baud, metres_per_tick, purpose, now_ns);
                Self::P2os(PacketSession::new(machine, purpose))
            }
            BaseProtocol::RoboClaw {
                address,
                wheel_base_m,
                metres_per_count_left,
                metres_per_count_right,
            } => {
                let wheels =
                    roboclaw::wheels::Wheels { wheel_base_m, metres_per_count_left, metres_per_count_right };
                Self::RoboClaw(roboclaw::RoboClaw::new(baud, address, wheels, purpose, now_ns))
            }
            BaseProtocol::Rflex { counts_per_m, counts_per_rad } => {
                let scale = rflex::scale::Scale { counts_per_m, counts_per_rad };
                let machine = rflex::machine::Machine::new(baud, scale, purpose, now_ns);
                Self::Rflex(PacketSession::new(machine, purpose))
            }
        }
    }

    /// What is known of the base.
    #[must_use]
    pub fn info(&self) -> &BaseInfo {
        self.driver().info()
    }

    /// What a unit of its position was last taken as, of a base with such units, meters.
    #[must_use]
    pub(crate) fn metres_per_tick(&self) -> Option<f64> {
        self.driver().metres_per_tick()
    }

    /// Intact packets that could not be read.
    #[must_use]
    pub fn not_kept(&self) -> u64 {
        self.driver().not_kept()
    }

    /// Whether odometry flows.
    #[must_use]
    pub fn is_streaming(&self) -> bool {
        self.driver().is_streaming()
    }

    /// A recording's next write to the base, at its time: what the next bytes answer. See
    /// `BaseDriver::host_sent`.
    pub fn host_sent(&mut self, now_ns: i64, bytes: &[u8]) {
        self.driver_mut().host_sent(now_ns, bytes);
    }

    /// What was due is done later than at its time: see `BaseDriver::watchdog_missed`.
    pub fn watchdog_missed(&mut self) {
        self.driver_mut().watchdog_missed();
    }

    /// The input ends: what is held of an unfinished packet is let go. Drain [`Session::poll`] afterwards.
    pub fn finish(&mut self) {
        self.driver_mut().finish();
    }

    fn driver(&self) -> &dyn BaseDriver {
        match self {
            Self::Absent(driver) => driver,
            Self::P2os(driver) => driver,
            Self::RoboClaw(driver) => driver,
            Self::Rflex(driver) => driver,
        }
    }

    fn driver_mut(&mut self) -> &mut dyn BaseDriver {
        match self {
            Self::Absent(driver) => driver,
            Self::P2os(driver) => driver,
            Self::RoboClaw(driver) => driver,
            Self::Rflex(driver) => driver,
        }
    }
}

impl Session for BaseSession {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.driver_mut().handle(now_ns, input);
    }

    fn poll(&mut self) -> Output {
        self.driver_mut().poll()
    }

    fn is_done(&self) -> bool {
        self.driver().is_done()
    }

    fn baud(&self) -> u32 {
        self.driver().baud()
    }

    fn counts(&self) -> Counts {
        self.driver().counts()
    }

    fn overflowed(&self) -> u64 {
        self.driver().overflowed()
    }
}
