//! Scans of a SICK laser on a network: telegrams with the times of its own clock.

use super::{OwnClock, not_sent, opening};
use crate::capture::encode::busy_line::BusyLine;
use crate::capture::encode::{EncodeError, EncodeOptions, EncodeReport};
use crate::devices::cola::telegram::{Measured, of_scan};
use crate::devices::cola::{ColaDevice, ColaParams};
use crate::line::SerialRead;
use biplane_recording::Topic;
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::Laser;
use biplane_wire::cola::{Dialect, FIRST_RANGE, Head, Kind, Telegram, Width};

const NS_PER_S: f64 = 1e9;
const NS_PER_US: i64 = 1_000;
/// Most beams of a scan: an LMS5xx at a sixth of a degree.
const MAX_BEAMS: usize = 1141;
/// Straight ahead.
const AHEAD_DEG: f64 = 90.0;
/// Beyond what 16 bits of millimeters say, two millimeters are counted, in m.
const MAX_MM_M: f32 = 65.535;
/// Raw values of no echo, and of a value that is no range.
const NO_ECHO: u16 = 0;
const INVALID: u16 = 2;
const EXPECTED: &str = "1 to 1141 beams, counter-clockwise, in steps of at most 6.5 degrees";

/// A laser's scans on their connection.
pub(crate) struct ColaLine {
    pub(crate) line: BusyLine,
    pub(crate) asked: Vec<SerialRead>,
    params: ColaParams,
    topic: Topic,
    sent: u64,
    clock: OwnClock,
}

impl ColaLine {
    pub(crate) fn new(options: &EncodeOptions, topic: Topic, line: u64) -> Self {
        let options = EncodeOptions { reads: options.reads.on_network(), ..options.clone() };
        Self {
            line: BusyLine::new(&options, line),
            asked: Vec::new(),
            params: options.network_laser,
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
        let first_deg = f64::from(scan.angle_min_rad).to_degrees() + AHEAD_DEG;
        let step_e4deg = (f64::from(scan.angle_increment_rad).to_degrees() * 1e4).round();
        let is_sent = (1..=MAX_BEAMS).contains(&scan.ranges_m.len())
            && (1.0..=f64::from(u16::MAX)).contains(&step_e4deg)
            && first_deg.abs() <= 360.0;
        if !is_sent {
            return Err(not_sent("SICK network laser", self.topic, self.sent, scan, EXPECTED));
        }
        let rate_chz = self.rate_chz(scan, laser);
        let rate_hz = f64::from(rate_chz) / 100.0;
        let mark_deg = f64::from(self.params.family.clock_mark_e4deg()) / 1e4;
        let first_beam_s = (first_deg - mark_deg) / 360.0 / rate_hz;
        let true_mark_ns = scan.stamp_ns - (first_beam_s * NS_PER_S).round() as i64;
        let mark_ns = self.clock.mark_ns(true_mark_ns, NS_PER_US);
        let sent_ns = mark_ns + self.params.processing_ns((NS_PER_S / rate_hz) as i64);
        let delay_ns = (laser.delay_ms * 1e6).round() as i64;
        if self.sent == 0 {
            self.open(sent_ns + delay_ns)?;
        }
        let head = Head {
            version: 1,
            device: 1,
            serial: self.params.serial,
            telegram_counter: self.params.first_counter.wrapping_add(self.sent as u16),
            scan_counter: self.sent as u16,
            scan_us: self.clock_us(mark_ns),
            sent_us: self.clock_us(sent_ns),
            scan_frequency_chz: rate_chz,
            shot_frequency_100hz: 36 * rate_chz / step_e4deg as u32,
            ..Head::default()
        };
        let remissions: Vec<u16> = scan.intensities.iter().map(|&value| value as u16).collect();
        let scale = if scan.range_max_m > MAX_MM_M { 2.0 } else { 1.0 };
        let measured = Measured {
            start_e4deg: (first_deg * 1e4).round() as i32,
            step_e4deg: step_e4deg as u16,
            scale,
            words: &words(&scan.ranges_m, scale, report),
            remissions: (remissions.len() == scan.ranges_m.len()).then_some((Width::Word, &remissions)),
            has_clock: self.params.data.clock,
        };
        let bytes = of_scan(head, &measured, (Kind::Event, Dialect::B));
        let wait_ns = self.line.send(&bytes, sent_ns + delay_ns, 0, |_| 0);
        self.line.count(scan.stamp_ns, mark_ns - true_mark_ns + wait_ns, report);
        self.sent += 1;
        Ok(())
    }

    /// Scans a second, in hundredths: as recorded, else as the rig or the device is set.
    fn rate_chz(&self, scan: &LaserScan, laser: &Laser) -> u32 {
        let recorded_hz = (scan.scan_time_s > 0.0).then(|| 1.0 / f64::from(scan.scan_time_s));
        let set_hz = laser.cola().and_then(|cola| cola.scan_hz);
        let rate_hz = recorded_hz.or(set_hz).map_or(0, |rate_hz| (rate_hz * 100.0).round() as u32);
        if rate_hz == 0 { self.params.scan.rate_chz } else { rate_hz }
    }

    /// It says who it is.
    fn open(&mut self, first_ns: i64) -> Result<(), EncodeError> {
        self.clock.begin(first_ns);
        let ask = Telegram { dialect: Dialect::B, kind: Kind::Read, name: b"DeviceIdent", data: None };
        let mut request = vec![0; ask.encoded_len()];
        ask.emit(&mut request)?;
        let mut device = ColaDevice::new(self.params.clone(), Box::new(|_| Vec::new()));
        let (asked, answers) = opening(&mut device, &[request], first_ns);
        self.asked = asked;
        for (at_ns, bytes) in answers {
            self.line.send(&bytes, at_ns, 0, |_| 0);
        }
        Ok(())
    }

    fn clock_us(&self, at_ns: i64) -> u32 {
        let passed_us = (at_ns - self.clock.begun_ns + NS_PER_US / 2).div_euclid(NS_PER_US);
        self.params.first_us.wrapping_add(passed_us as u32)
    }
}

/// Raw values.
fn words(ranges_m: &[f32], scale: f32, report: &mut EncodeReport) -> Vec<u16> {
    let mut word = |range_m: f32| {
        let raw = (f64::from(range_m) * 1e3 / f64::from(scale)).round();
        if range_m == f32::INFINITY {
            NO_ECHO
        } else if raw > f64::from(u16::MAX) {
            report.beyond_range += 1;
            NO_ECHO
        } else if raw >= f64::from(FIRST_RANGE) {
            raw as u16
        } else {
            INVALID
        }
    };
    ranges_m.iter().map(|&range_m| word(range_m)).collect()
}
