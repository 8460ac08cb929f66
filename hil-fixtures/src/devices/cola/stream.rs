//! Where the scans of a laser on a network come from: measured as its mirror turns, or from elsewhere.

use biplane_wire::cola::{Dialect, Kind, ScanConfig};

use super::model::ColaParams;
use super::requests::Settings;
use super::scans::Turns;
use crate::rig::fan::FanSource;

/// In which forms a scan is wanted, and how the laser is set.
#[derive(Clone, Copy, Debug)]
pub struct Telegrams<'a> {
    /// The laser.
    pub params: &'a ColaParams,
    /// How it is set.
    pub settings: &'a Settings,
    /// A telegram for each of these.
    pub forms: &'a [(Kind, Dialect)],
}

/// Scans of a laser in order of time.
pub trait ColaScans: Send {
    /// What left before `now_ns` is not sent.
    fn begin_at(&mut self, now_ns: i64);

    /// When the next scan leaves, or is worth looking for.
    fn next_ns(&self, now_ns: i64) -> i64;

    /// Appends the next scan that has left by `now_ns` in each form; false when there is none.
    fn send(&mut self, now_ns: i64, telegrams: &Telegrams<'_>, out: &mut Vec<u8>) -> bool;

    /// They were recorded, so that nothing can be set.
    fn are_recorded(&self) -> bool {
        false
    }

    /// The mirror was set to another rate.
    fn set(&mut self, _params: &ColaParams, _scan: &ScanConfig, _now_ns: i64) {}

    /// The laser was switched on.
    fn power_on(&mut self, now_ns: i64) {
        self.begin_at(now_ns);
    }
}

/// Scans that are measured as they are sent.
pub(super) struct MeasuredScans {
    turns: Turns,
    source: FanSource,
}

impl MeasuredScans {
    pub(super) fn new(params: &ColaParams, source: FanSource) -> Self {
        Self { turns: Turns::of(params), source }
    }
}

impl ColaScans for MeasuredScans {
    fn begin_at(&mut self, now_ns: i64) {
        self.turns.begin_at(now_ns);
    }

    fn next_ns(&self, _now_ns: i64) -> i64 {
        self.turns.next_ns()
    }

    fn send(&mut self, now_ns: i64, telegrams: &Telegrams<'_>, out: &mut Vec<u8>) -> bool {
        let Some(turn) = self.turns.next_before(now_ns) else { return false };
        let Telegrams { params, settings, forms } = *telegrams;
        let words = (self.source)(&self.turns.fan(params, &settings.range, turn));
        for form in forms {
            out.extend(self.turns.telegram(params, settings, *form, turn, &words));
        }
        self.turns.count();
        true
    }

    fn set(&mut self, params: &ColaParams, scan: &ScanConfig, now_ns: i64) {
        self.turns.set(params, scan, now_ns);
    }

    fn power_on(&mut self, now_ns: i64) {
        self.turns.power_on(now_ns);
    }
}
