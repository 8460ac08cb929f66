//! Scans of a Hokuyo laser: replies with the milliseconds of its own clock.

use super::{OwnClock, not_sent, opening};
use crate::capture::encode::busy_line::BusyLine;
use crate::capture::encode::{EncodeError, EncodeOptions, EncodeReport};
use crate::devices::scip::{ScipDevice, ScipLink, ScipParams, ScipState, scan_reply};
use crate::line::{SerialRead, transfer_ns};
use biplane_recording::Topic;
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::Laser;
use biplane_wire::scip::{CLOCK_ROUND_MS, Delivery, Reading, ScanRequest};

const NS_PER_MS: i64 = 1_000_000;
/// From the last step of a scan to its first byte.
const PROCESSING_NS: i64 = 50_000;
/// Steps may differ by this share, and the first direction by this share of a step: they are rounded.
const STEP_TOLERANCE: f64 = 0.01;
const FIRST_TOLERANCE: f64 = 0.1;
/// Most steps that are joined to one value, and most turns that are left out between two scans.
const MAX_CLUSTER: f64 = 99.0;
const MAX_SKIP: f64 = 9.0;
/// The largest number of three characters.
const MAX_INTENSITY: f32 = 262_143.0;
/// The code of a value that is no range, for every model.
const INVALID: u32 = 2;
const EXPECTED: &str = "steps of the laser of --hokuyo, or up to 99 of them joined, within its field of view";

/// A laser's scans on their line.
pub(crate) struct ScipLine {
    pub(crate) line: BusyLine,
    pub(crate) asked: Vec<SerialRead>,
    params: ScipParams,
    topic: Topic,
    sent: u64,
    clock: OwnClock,
}

impl ScipLine {
    pub(crate) fn new(options: &EncodeOptions, topic: Topic, laser: &Laser, line: u64) -> Self {
        let params = options.hokuyo.clone().on_line(laser.address().is_some(), laser.baud);
        let reads = if params.link == ScipLink::Network { options.reads.on_network() } else { options.reads };
        Self {
            line: BusyLine::new(&EncodeOptions { reads, ..options.clone() }, line),
            asked: Vec::new(),
            params: ScipParams { state: ScipState::Idle, ..params },
            topic,
            sent: 0,
            clock: OwnClock::NOT_BEGUN,
        }
    }

    pub(crate) fn send(
        &mut self,
        scan: &LaserScan,
        laser: &Laser,
        report: &mut EncodeReport,
    ) -> Result<(), EncodeError> {
        let Some(request) = request_for(scan, &self.params) else {
            return Err(not_sent("Hokuyo", self.topic, self.sent, scan, EXPECTED));
        };
        let of = &self.params.parameters;
        let after_step_0_ns = |step: u16| (f64::from(step) * of.step_ns()).round() as i64;
        let true_step_0_ns = scan.stamp_ns - after_step_0_ns(request.first_step);
        let step_0_ns = self.clock.mark_ns(true_step_0_ns, NS_PER_MS);
        let done_ns = step_0_ns + after_step_0_ns(request.last_step) + PROCESSING_NS;
        if self.sent == 0 {
            self.open(done_ns);
        }
        let to_tick_ns = if self.params.waits_for_tick {
            (self.clock.begun_ns - done_ns).rem_euclid(NS_PER_MS)
        } else {
            0
        };
        let due_ns = done_ns + to_tick_ns + (laser.delay_ms * 1e6).round() as i64;
        let passed_ms =
            (step_0_ns - self.clock.begun_ns).div_euclid(NS_PER_MS) + i64::from(self.params.first_ms);
        let clock_ms = passed_ms.rem_euclid(i64::from(CLOCK_ROUND_MS)) as u32;
        let bytes = scan_reply(&request, clock_ms, None, &readings(scan, &self.params, report));
        let wait_ns = self.put(&bytes, due_ns);
        self.line.count(scan.stamp_ns, step_0_ns - true_step_0_ns + wait_ns, report);
        self.sent += 1;
        Ok(())
    }

    /// It says who it is and how it measures.
    fn open(&mut self, first_ns: i64) {
        self.clock.begin(first_ns);
        let mut device = ScipDevice::new(self.params.clone(), Box::new(|_| Vec::new()));
        let requests = [b"VV\n".to_vec(), b"PP\n".to_vec()];
        let (asked, answers) = opening(&mut device, &requests, first_ns);
        self.asked = asked;
        for (at_ns, bytes) in answers {
            self.put(&bytes, at_ns);
        }
    }

    /// Puts bytes on the line; how long they had to wait for it.
    fn put(&mut self, bytes: &[u8], due_ns: i64) -> i64 {
        match self.params.link {
            ScipLink::Serial(baud) => {
                self.line.send(bytes, due_ns, transfer_ns(1, baud), |index| transfer_ns(index + 1, baud))
            }
            ScipLink::Usb | ScipLink::Network => self.line.send(bytes, due_ns, 0, |_| 0),
        }
    }
}

/// What such a laser is asked to send such scans; `None` when it does not.
fn request_for(scan: &LaserScan, params: &ScipParams) -> Option<ScanRequest> {
    let of = &params.parameters;
    let ratio = f64::from(scan.angle_increment_rad).to_degrees() / of.step_deg();
    let cluster = ratio.round();
    let first = f64::from(of.front_step) + f64::from(scan.angle_min_rad).to_degrees() / of.step_deg();
    let is_on_steps = (1.0..=MAX_CLUSTER).contains(&cluster)
        && (ratio - cluster).abs() <= STEP_TOLERANCE * cluster
        && (first - first.round()).abs() <= FIRST_TOLERANCE
        && first.round() >= f64::from(of.first_step)
        && !scan.ranges_m.is_empty();
    let count = u32::try_from(scan.ranges_m.len()).ok()?;
    // The steps behind the last value's first one are joined to it, where there are any.
    let last_begins = first.round() + f64::from(count - 1) * cluster;
    if !is_on_steps || last_begins > f64::from(of.last_step) {
        return None;
    }
    let last = (last_begins + cluster - 1.0).min(f64::from(of.last_step));
    let turns = f64::from(scan.scan_time_s) * 1e9 / of.turn_ns();
    let skip = (turns.round() - 1.0).clamp(0.0, MAX_SKIP) as u8;
    Some(ScanRequest {
        delivery: Delivery::Stream { skip, count: 0 },
        all_echoes: false,
        with_intensity: params.has_intensity && scan.intensities.len() == scan.ranges_m.len(),
        first_step: first.round() as u16,
        last_step: last as u16,
        cluster: cluster as u8,
    })
}

/// Values of the steps.
fn readings(scan: &LaserScan, params: &ScipParams, report: &mut EncodeReport) -> Vec<Reading> {
    let of = &params.parameters;
    let mut range_mm = |range_m: f32| {
        let range_mm = (f64::from(range_m) * 1e3).round();
        if range_m == f32::INFINITY {
            params.no_echo
        } else if range_mm > f64::from(of.max_mm) {
            report.beyond_range += 1;
            params.no_echo
        } else if range_mm >= f64::from(of.min_mm) {
            range_mm as u32
        } else {
            INVALID
        }
    };
    let has_all = params.has_intensity && scan.intensities.len() == scan.ranges_m.len();
    let intensity = |beam| {
        let value: Option<&f32> = scan.intensities.get(beam).filter(|_| has_all);
        value.map(|value| value.clamp(0.0, MAX_INTENSITY) as u32)
    };
    let ranges = scan.ranges_m.iter().enumerate();
    ranges
        .map(|(beam, &range_m)| Reading {
            is_further: false,
            range_mm: range_mm(range_m),
            intensity: intensity(beam),
        })
        .collect()
}
