//! The turns of a laser's mirror, and the telegram of each. Nanoseconds on the caller's clock; microseconds
//! on the device's own.

use biplane_wire::cola::{Dialect, Head, Kind, OutputRange, ScanConfig, Width};

use super::model::ColaParams;
use super::requests::Settings;
use super::telegram::{self, Measured};
use crate::rig::fan::Fan;

/// A caller that is late by less than this finds the scans that have left meanwhile.
const LATEST_NS: i64 = 500_000_000;
/// Remission of an echo, and of none.
const REMISSION: [u16; 2] = [180, 0];

/// When scans are sent, and how they are counted.
#[derive(Clone, Debug)]
pub(super) struct Turns {
    turn_ns: i64,
    /// From a turn's beginning to its telegram.
    sent_after_ns: i64,
    mark_ns: i64,
    /// When turn 0 begins.
    origin_ns: i64,
    next: i64,
    counter: u16,
    scan_counter: u16,
    /// The device's clock at `clock_at_ns`.
    clock_us: u32,
    clock_at_ns: i64,
    ppm: f64,
}

impl Turns {
    pub(super) fn of(params: &ColaParams) -> Self {
        let mut turns = Self {
            turn_ns: 1,
            sent_after_ns: 0,
            mark_ns: 0,
            origin_ns: params.phase_ns,
            next: 0,
            counter: params.first_counter,
            scan_counter: 3,
            clock_us: params.first_us,
            clock_at_ns: 0,
            ppm: params.clock_ppm,
        };
        turns.set(params, &params.scan, params.phase_ns);
        turns
    }

    /// The mirror turns at another rate from now on.
    pub(super) fn set(&mut self, params: &ColaParams, scan: &ScanConfig, now_ns: i64) {
        self.turn_ns = params.turn_ns(scan);
        self.mark_ns = params.mark_ns(self.turn_ns);
        self.sent_after_ns = self.mark_ns + params.processing_ns(self.turn_ns);
        self.origin_ns = now_ns;
        self.next = 0;
    }

    /// The device was switched on: clock and counters begin at zero.
    pub(super) fn power_on(&mut self, now_ns: i64) {
        (self.counter, self.scan_counter) = (0, 0);
        (self.clock_us, self.clock_at_ns) = (0, now_ns);
        self.begin_at(now_ns);
    }

    /// Nothing that was measured before is sent.
    pub(super) fn begin_at(&mut self, now_ns: i64) {
        let begun = (now_ns - self.sent_after_ns - self.origin_ns).div_euclid(self.turn_ns) + 1;
        self.skip_to(begun);
    }

    /// Turns that are not sent are counted all the same by the scan counter alone.
    fn skip_to(&mut self, turn: i64) {
        self.scan_counter = self.scan_counter.wrapping_add((turn - self.next) as u16);
        self.next = turn;
    }

    pub(super) fn next_ns(&self) -> i64 {
        self.origin_ns + self.next * self.turn_ns + self.sent_after_ns
    }

    /// The next turn whose telegram has left by now.
    pub(super) fn next_before(&mut self, now_ns: i64) -> Option<i64> {
        if now_ns - self.next_ns() > LATEST_NS {
            let turn = self.next;
            self.begin_at(now_ns - LATEST_NS);
            self.counter = self.counter.wrapping_add((self.next - turn) as u16);
        }
        (self.next_ns() <= now_ns).then(|| {
            self.next += 1;
            self.next - 1
        })
    }

    pub(super) fn fan(&self, params: &ColaParams, range: &OutputRange, turn: i64) -> Fan {
        params.fan(range, self.origin_ns + turn * self.turn_ns, self.turn_ns)
    }

    /// The device's clock.
    fn clock_us(&self, at_ns: i64) -> u32 {
        let passed_us = (at_ns - self.clock_at_ns) as f64 * (1e-3 + self.ppm * 1e-9);
        self.clock_us.wrapping_add(passed_us.round() as i64 as u32)
    }

    /// The telegram of a turn with these ranges, as an event or an answer.
    pub(super) fn telegram(
        &self,
        params: &ColaParams,
        settings: &Settings,
        form: (Kind, Dialect),
        turn: i64,
        words: &[u16],
    ) -> Vec<u8> {
        let turn_at_ns = self.origin_ns + turn * self.turn_ns;
        let head = Head {
            version: 1,
            device: 1,
            serial: params.serial,
            telegram_counter: self.counter,
            scan_counter: self.scan_counter,
            scan_us: self.clock_us(turn_at_ns + self.mark_ns),
            sent_us: self.clock_us(turn_at_ns + self.sent_after_ns),
            scan_frequency_chz: settings.scan.rate_chz,
            shot_frequency_100hz: 36 * settings.scan.rate_chz / settings.scan.step_e4deg.max(1),
            ..Head::default()
        };
        let remissions: Vec<u16> = words.iter().map(|word| REMISSION[usize::from(*word == 0)]).collect();
        let wide = if settings.data.is_remission_wide { Width::Word } else { Width::Byte };
        let measured = Measured {
            start_e4deg: settings.range.start_e4deg,
            step_e4deg: settings.range.step_e4deg as u16,
            scale: 1.0,
            words,
            remissions: settings.data.remission.then_some((wide, &remissions)),
            has_clock: settings.data.clock,
        };
        telegram::of_scan(head, &measured, form)
    }

    /// A turn was sent.
    pub(super) fn count(&mut self) {
        self.counter = self.counter.wrapping_add(1);
        self.scan_counter = self.scan_counter.wrapping_add(1);
    }
}
