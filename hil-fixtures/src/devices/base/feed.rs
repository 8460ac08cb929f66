//! Where a mock base's packets come from: a world's odometry at the base's own pace, or a capture played
//! back.
//!
//! Raw units: x and y 15-bit ticks that wrap, heading 4096 a turn. Times are nanoseconds on the device's
//! clock.

use crate::devices::lms::scans::feed::Timeline;
use crate::rig::source::{OdometrySample, OdometrySource};

/// A server information packet to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sip {
    /// Odometry, to be written by the base.
    Odometry(OdometrySample),
    /// A recorded packet's body, to be sent as it is.
    Recorded(Vec<u8>),
}

/// A feed's answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SipAnswer {
    /// Send this now.
    Now(Sip),
    /// Nothing before this time.
    Later(i64),
    /// Nothing any more.
    Ended,
}

/// Gives a mock base its packets.
pub trait SipFeed: Send {
    /// The packet that leaves at `now_ns`, if one does.
    fn next(&mut self, now_ns: i64) -> SipAnswer;

    /// Where the base is, without a packet; `None` where only packets are known.
    fn place(&mut self, _now_ns: i64) -> Option<OdometrySample> {
        None
    }
}

/// A feed that samples a world's odometry once a cycle, at the moment a packet leaves.
pub struct CycleFeed {
    source: Box<dyn OdometrySource>,
    timeline: Box<dyn Timeline>,
    cycle_ns: i64,
    next_ns: Option<i64>,
}

impl CycleFeed {
    /// A packet each `cycle_ns` from the first question on.
    #[must_use]
    pub fn new(source: Box<dyn OdometrySource>, timeline: Box<dyn Timeline>, cycle_ns: i64) -> Self {
        Self { source, timeline, cycle_ns: cycle_ns.max(1), next_ns: None }
    }
}

impl SipFeed for CycleFeed {
    fn next(&mut self, now_ns: i64) -> SipAnswer {
        // A base that was closed for a while takes its pace up anew instead of catching up.
        let due_ns = self.next_ns.filter(|next_ns| now_ns - next_ns < self.cycle_ns).unwrap_or(now_ns);
        if now_ns < due_ns {
            return SipAnswer::Later(due_ns);
        }
        self.next_ns = Some(due_ns + self.cycle_ns);
        SipAnswer::Now(Sip::Odometry(self.source.sample(self.timeline.world_ns(now_ns))))
    }

    fn place(&mut self, now_ns: i64) -> Option<OdometrySample> {
        Some(self.source.sample(self.timeline.world_ns(now_ns)))
    }
}
