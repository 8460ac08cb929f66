//! The session of a laser, whatever it speaks.

use biplane_recording::rig::{self, LaserProtocol};
use biplane_wire::Counts;

use crate::engine::options::Feed;
use crate::session::cola::ColaSession;
use crate::session::cola::settings::ColaSettings;
use crate::session::device_session::{Input, Output, Session};
use crate::session::lms::LaserSession;
use crate::session::lms::health::LaserHealth;
use crate::session::lms::setup::settings::LaserSettings;
use crate::session::lms::streaming::self_truncated::TruncationCounts;
use crate::session::scip::ScipSession;
use crate::session::scip::settings::ScipSettings;

/// A laser.
#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // two a robot, and no heap in the acquisition path
pub(crate) enum LaserDevice {
    /// A SICK laser on a serial line.
    Lms(LaserSession),
    /// A SICK laser on a network.
    Cola(ColaSession),
    /// A Hokuyo laser on either.
    Scip(ScipSession),
}

impl LaserDevice {
    /// The laser of a rig, whose session begins at `now_ns`.
    pub(crate) fn new(laser: &rig::Laser, feed: Feed, now_ns: i64) -> Self {
        match (&laser.protocol, feed) {
            (LaserProtocol::Lms2xx, Feed::Live) => {
                Self::Lms(LaserSession::streaming(LaserSettings::from(laser), now_ns))
            }
            (LaserProtocol::Lms2xx, Feed::Recorded) => {
                Self::Lms(LaserSession::listening(LaserSettings::from(laser), now_ns))
            }
            (LaserProtocol::Cola(cola), Feed::Live) => {
                Self::Cola(ColaSession::streaming(ColaSettings::from(cola), now_ns))
            }
            (LaserProtocol::Cola(cola), Feed::Recorded) => {
                Self::Cola(ColaSession::listening(ColaSettings::from(cola), now_ns))
            }
            (LaserProtocol::Scip(_), Feed::Live) => {
                Self::Scip(ScipSession::streaming(ScipSettings::from(laser), now_ns))
            }
            (LaserProtocol::Scip(_), Feed::Recorded) => {
                Self::Scip(ScipSession::listening(ScipSettings::from(laser), now_ns))
            }
        }
    }

    /// Whether its scans state when they were taken, by a clock of its own.
    pub(crate) fn states_its_time(&self) -> bool {
        !matches!(self, Self::Lms(_))
    }

    /// What it has seen of its device.
    pub(crate) fn health(&self) -> &LaserHealth {
        match self {
            Self::Lms(session) => session.health(),
            Self::Cola(session) => session.health(),
            Self::Scip(session) => session.health(),
        }
    }

    /// Intact telegrams that could not be published.
    pub(crate) fn not_kept(&self) -> u64 {
        self.health().not_kept
    }

    /// Telegrams that were cut because we stopped the laser.
    pub(crate) fn truncated(&self) -> TruncationCounts {
        match self {
            Self::Lms(session) => session.truncated(),
            Self::Cola(session) => session.truncated(),
            Self::Scip(session) => session.truncated(),
        }
    }

    /// Whether scans flow.
    pub(crate) fn is_streaming(&self) -> bool {
        match self {
            Self::Lms(session) => session.is_streaming(),
            Self::Cola(session) => session.is_streaming(),
            Self::Scip(session) => session.is_streaming(),
        }
    }

    /// Whether the device may be at work on its memory.
    pub(crate) fn is_writing(&self) -> bool {
        match self {
            Self::Lms(session) => session.is_writing(),
            Self::Cola(_) | Self::Scip(_) => false,
        }
    }

    /// In a recording: something was sent to the laser at this time.
    pub(crate) fn host_sent(&mut self, now_ns: i64) {
        match self {
            Self::Lms(session) => session.host_sent(now_ns),
            Self::Cola(session) => session.host_sent(now_ns),
            Self::Scip(session) => session.host_sent(now_ns),
        }
    }

    /// The input ends.
    pub(crate) fn finish(&mut self) {
        match self {
            Self::Lms(session) => session.finish(),
            Self::Cola(session) => session.finish(),
            Self::Scip(session) => session.finish(),
        }
    }

    fn session(&self) -> &dyn Session {
        match self {
            Self::Lms(session) => session,
            Self::Cola(session) => session,
            Self::Scip(session) => session,
        }
    }

    fn session_mut(&mut self) -> &mut dyn Session {
        match self {
            Self::Lms(session) => session,
            Self::Cola(session) => session,
            Self::Scip(session) => session,
        }
    }
}

impl Session for LaserDevice {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.session_mut().handle(now_ns, input);
    }

    fn poll(&mut self) -> Output {
        self.session_mut().poll()
    }

    fn is_done(&self) -> bool {
        self.session().is_done()
    }

    fn baud(&self) -> u32 {
        self.session().baud()
    }

    fn counts(&self) -> Counts {
        self.session().counts()
    }

    fn overflowed(&self) -> u64 {
        self.session().overflowed()
    }
}
