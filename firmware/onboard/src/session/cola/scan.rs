//! A scan of a laser on a network as ranges in meters, in the laser's own frame (x straight ahead, y to the
//! left), with the times that the device states.

use biplane_wire::cola::{Channel, FIRST_RANGE, Family, Scan};

/// Most beams of a scan: an LMS5xx at a sixth of a degree.
pub(crate) const MAX_COLA_BEAMS: usize = 1141;
/// Straight ahead, degrees.
const AHEAD_DEG: f64 = 90.0;
/// A step this near to a fraction of two degrees is that fraction, degrees: it is sent rounded.
const ROUNDED_DEG: f64 = 6e-5;
/// Raw value of no echo.
const NO_ECHO: u16 = 0;
/// Raw value of a dazzled receiver.
const DAZZLED: u16 = 1;

/// A scan, decoded.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct ColaScan {
    /// Index of the telegram's first byte in the stream.
    pub offset: u64,
    /// Bytes of the telegram.
    pub length: usize,
    /// The device's count of telegrams.
    pub telegram_counter: u16,
    /// The device's time of the scan, microseconds; wraps.
    pub scan_us: u32,
    /// The device's time of the transmission, microseconds; wraps.
    pub sent_us: u32,
    /// From the device's time of the scan to its first beam, seconds.
    pub first_beam_s: f64,
    /// Direction of the first beam, degrees from straight ahead, counter-clockwise.
    pub first_deg: f64,
    /// From beam to beam, degrees.
    pub step_deg: f64,
    /// Scans a second.
    pub rate_hz: f64,
    /// Longest range that the telegram can say, meters.
    pub range_max_m: f32,
    /// Ranges in meters, `+inf` for no echo, NaN for invalid.
    pub ranges_m: heapless::Vec<f32, MAX_COLA_BEAMS>,
    /// Remission, one a beam, device units; empty where the telegram has none.
    pub intensities: heapless::Vec<u16, MAX_COLA_BEAMS>,
    /// Values whose receiver was dazzled.
    pub dazzled: u16,
}

impl ColaScan {
    /// Takes over a scan of a device of this family; false when it has no ranges, or too many.
    pub(crate) fn take(&mut self, scan: &Scan<'_>, family: Option<Family>) -> bool {
        let named = |name: &[u8; 5]| scan.channels.iter().find(|channel| channel.name == *name);
        let Some(ranges) = named(b"DIST1").filter(|channel| is_usable(channel)) else { return false };
        if scan.head.scan_frequency_chz == 0 {
            return false;
        }
        self.telegram_counter = scan.head.telegram_counter;
        (self.scan_us, self.sent_us) = (scan.head.scan_us, scan.head.sent_us);
        self.rate_hz = f64::from(scan.head.scan_frequency_chz) / 100.0;
        let first_deg = f64::from(ranges.start_e4deg) / 1e4;
        self.step_deg = exact_step_deg(f64::from(ranges.step_e4deg) / 1e4);
        self.first_deg = first_deg - AHEAD_DEG;
        let steps = ranges.values.len().saturating_sub(1) as f64;
        let sweep_s = steps * self.step_deg / 360.0 / self.rate_hz;
        self.first_beam_s = (first_deg - self.mark_deg(family, sweep_s)) / 360.0 / self.rate_hz;
        self.take_ranges(ranges);
        self.intensities.clear();
        let fits = |channel: &&Channel<'_>| {
            (channel.start_e4deg, channel.step_e4deg) == (ranges.start_e4deg, ranges.step_e4deg)
                && channel.values.len() == ranges.values.len()
        };
        if let Some(remissions) = named(b"RSSI1").filter(fits) {
            self.intensities.extend(remissions.values.iter());
        }
        true
    }

    fn take_ranges(&mut self, ranges: &Channel<'_>) {
        let unit_m = f64::from(ranges.scale) * 1e-3;
        self.range_max_m = (f64::from(u16::MAX) * unit_m) as f32;
        self.ranges_m.clear();
        self.dazzled = 0;
        for raw in ranges.values.iter() {
            self.dazzled += u16::from(raw == DAZZLED);
            // There is room: the count was checked.
            let _ = self.ranges_m.push(match raw {
                FIRST_RANGE.. => (f64::from(raw) * unit_m) as f32,
                NO_ECHO => f32::INFINITY,
                _ => f32::NAN,
            });
        }
    }

    /// The direction at the device's time of the scan. A device that has not said what it is has sent a
    /// telegram sooner than its beams could sweep the fan, so that this time lies behind them; or later.
    fn mark_deg(&self, family: Option<Family>, sweep_s: f64) -> f64 {
        let is_soon = f64::from(self.sent_us.wrapping_sub(self.scan_us)) * 1e-6 < sweep_s;
        let alike = if is_soon { Family::Lms1xx } else { Family::Lms5xx };
        f64::from(family.unwrap_or(alike).clock_mark_e4deg()) / 1e4
    }
}

fn is_usable(channel: &Channel<'_>) -> bool {
    let count = channel.values.len();
    (1..=MAX_COLA_BEAMS).contains(&count)
        && channel.step_e4deg > 0
        && channel.scale.is_finite()
        && channel.scale > 0.0
}

/// The step before it was rounded to 1/10000 degree.
fn exact_step_deg(sent_deg: f64) -> f64 {
    let exact_deg = 2.0 / (2.0 / sent_deg).round();
    if (exact_deg - sent_deg).abs() <= ROUNDED_DEG { exact_deg } else { sent_deg }
}
