//! Where the scans of a Hokuyo laser come from: measured as its mirror turns, or from elsewhere.

use biplane_wire::scip::ScanRequest;

use super::model::ScipParams;
use super::turns::Turns;
use crate::rig::fan::FanSource;

/// Scans of a laser, one a turn of its mirror, and its clock.
pub trait ScipScans: Send {
    /// Whether there are such scans, whatever number of them is asked for.
    fn has(&self, _request: &ScanRequest) -> bool {
        true
    }

    /// The device's clock, ms.
    fn clock_ms(&self, now_ns: i64) -> u32;

    /// The clock begins anew.
    fn reset_clock(&mut self, now_ns: i64);

    /// The first turn whose scan can be sent when it is asked for at this time.
    fn turn_from(&self, at_ns: i64) -> i64;

    /// When the scan of a turn leaves; never, for one that is not known.
    fn sent_ns(&self, params: &ScipParams, request: &ScanRequest, turn: i64) -> i64;

    /// The reply with the scan of a turn; `tag` is the client's own text in its request.
    fn reply(&mut self, params: &ScipParams, request: &ScanRequest, turn: i64, tag: Option<&[u8]>)
    -> Vec<u8>;

    /// A scan is left out when the line stays busy for longer than this.
    fn waits_ns(&self) -> i64 {
        0
    }
}

/// Scans that are measured as they are sent.
pub(super) struct MeasuredScans {
    turns: Turns,
    source: FanSource,
}

impl MeasuredScans {
    pub(super) fn new(params: &ScipParams, source: FanSource) -> Self {
        Self { turns: Turns::of(params), source }
    }
}

impl ScipScans for MeasuredScans {
    fn clock_ms(&self, now_ns: i64) -> u32 {
        self.turns.clock_ms(now_ns)
    }

    fn reset_clock(&mut self, now_ns: i64) {
        self.turns.reset_clock(now_ns);
    }

    fn turn_from(&self, at_ns: i64) -> i64 {
        self.turns.turn_from(at_ns)
    }

    fn sent_ns(&self, params: &ScipParams, request: &ScanRequest, turn: i64) -> i64 {
        self.turns.sent_ns(params, request, turn)
    }

    fn reply(
        &mut self,
        params: &ScipParams,
        request: &ScanRequest,
        turn: i64,
        tag: Option<&[u8]>,
    ) -> Vec<u8> {
        self.turns.reply(params, request, turn, tag, &mut self.source)
    }
}
