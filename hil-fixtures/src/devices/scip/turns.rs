//! The turns of a laser's mirror, and the scan of each. Nanoseconds on the caller's clock; milliseconds on
//! the device's own.

use biplane_wire::scip::{
    Block, CLOCK_ROUND_MS, Command, Delivery, MAX_BLOCK_BYTES, Reading, Request, Scan, ScanRequest, Status,
    Values,
};
use std::f64::consts::TAU;

use super::model::ScipParams;
use crate::rig::fan::{Fan, FanSource};

/// Intensity of an echo.
const INTENSITY: u32 = 1_800;
const NS_PER_MS: f64 = 1e6;
/// From the last step of a scan to its first byte.
const PROCESSING_NS: i64 = 50_000;

/// When scans are taken, and what the device's clock says.
#[derive(Clone, Debug)]
pub(super) struct Turns {
    turn_ns: i64,
    /// When turn 0 begins.
    origin_ns: i64,
    /// The device's clock at `clock_at_ns`.
    clock_ms: f64,
    clock_at_ns: i64,
    ppm: f64,
    waits_for_tick: bool,
}

impl Turns {
    pub(super) fn of(params: &ScipParams) -> Self {
        Self {
            turn_ns: params.turn_ns(),
            origin_ns: params.phase_ns,
            clock_ms: f64::from(params.first_ms),
            clock_at_ns: 0,
            ppm: params.clock_ppm,
            waits_for_tick: params.waits_for_tick,
        }
    }

    /// The device was switched on or reset: its clock begins at zero.
    pub(super) fn reset_clock(&mut self, now_ns: i64) {
        (self.clock_ms, self.clock_at_ns) = (0.0, now_ns);
    }

    fn exact_ms(&self, at_ns: i64) -> f64 {
        self.clock_ms + (at_ns - self.clock_at_ns) as f64 / NS_PER_MS * (1.0 + self.ppm * 1e-6)
    }

    /// The device's clock.
    pub(super) fn clock_ms(&self, at_ns: i64) -> u32 {
        (self.exact_ms(at_ns).floor() as i64).rem_euclid(i64::from(CLOCK_ROUND_MS)) as u32
    }

    /// The first turn that begins at this time or later.
    pub(super) fn turn_from(&self, at_ns: i64) -> i64 {
        (at_ns - self.origin_ns + self.turn_ns - 1).div_euclid(self.turn_ns)
    }

    fn begin_ns(&self, turn: i64) -> i64 {
        self.origin_ns + turn * self.turn_ns
    }

    fn step_ns(&self, params: &ScipParams) -> f64 {
        self.turn_ns as f64 / f64::from(params.parameters.steps_per_turn)
    }

    /// When the scan of a turn leaves.
    pub(super) fn sent_ns(&self, params: &ScipParams, request: &ScanRequest, turn: i64) -> i64 {
        let last_ns = f64::from(request.last_step) * self.step_ns(params);
        let done_ns = self.begin_ns(turn) + last_ns.round() as i64 + PROCESSING_NS;
        if !self.waits_for_tick {
            return done_ns;
        }
        let ms = self.exact_ms(done_ns);
        done_ns + ((ms.ceil() - ms) * NS_PER_MS / (1.0 + self.ppm * 1e-6)).round() as i64
    }

    /// All steps of a turn that are asked for.
    fn fan(&self, params: &ScipParams, request: &ScanRequest, turn: i64) -> Fan {
        let step_rad = TAU / f64::from(params.parameters.steps_per_turn);
        let from_front = f64::from(request.first_step) - f64::from(params.parameters.front_step);
        let first_ns = f64::from(request.first_step) * self.step_ns(params);
        Fan {
            first_beam_ns: self.begin_ns(turn) + first_ns.round() as i64,
            beam_ns: self.step_ns(params),
            first_rad: from_front * step_rad,
            step_rad,
            count: request.last_step - request.first_step + 1,
        }
    }

    /// The reply with the scan of a turn; `echo` is the request as the client has written it.
    pub(super) fn reply(
        &self,
        params: &ScipParams,
        request: &ScanRequest,
        turn: i64,
        tag: Option<&[u8]>,
        source: &mut FanSource,
    ) -> Vec<u8> {
        let words = source(&self.fan(params, request, turn));
        let valid = |word: u16| {
            let range_mm = u32::from(word);
            (params.parameters.min_mm..=params.parameters.max_mm).contains(&range_mm).then_some(range_mm)
        };
        let readings: Vec<Reading> = words
            .chunks(usize::from(request.steps_per_value()))
            .map(|group| {
                let nearest = group.iter().filter_map(|&word| valid(word)).min();
                let intensity = if nearest.is_some() { INTENSITY } else { 0 };
                Reading {
                    is_further: false,
                    range_mm: nearest.unwrap_or(params.no_echo),
                    intensity: request.with_intensity.then_some(intensity),
                }
            })
            .collect();
        let clock_ms = self.clock_ms(self.begin_ns(turn));
        scan_reply(request, clock_ms, tag, &readings)
    }
}

/// The reply with a scan; `tag` is the client's own text in its request.
#[must_use]
pub fn scan_reply(request: &ScanRequest, clock_ms: u32, tag: Option<&[u8]>, readings: &[Reading]) -> Vec<u8> {
    let scan = Scan { request: *request, clock_ms, values: Values::Numbers(readings) };
    let mut lines = vec![0; MAX_BLOCK_BYTES];
    // The longest scan fits.
    let length = scan.emit_lines(&mut lines).unwrap_or_default();
    scan_block(request, tag, lines.get(..length).unwrap_or_default())
}

/// The reply with these lines of a scan.
fn scan_block(request: &ScanRequest, tag: Option<&[u8]>, lines: &[u8]) -> Vec<u8> {
    let status = match request.delivery {
        Delivery::Once => Status::OK,
        Delivery::Stream { .. } => Status::STREAMED,
    };
    let request = Request { command: Command::Scans(*request), tag };
    let block = Block { request, status, lines };
    let mut bytes = vec![0; block.encoded_len()];
    // The buffer is as long as the reply says.
    let _ = block.emit(&mut bytes);
    bytes
}
