//! A scan telegram as ranges in metres, in the laser's own frame (x along the middle beam, y to the left).
//!
//! What is no range stays told apart as REP 117 wants it: no echo and beyond range are `+inf`, everything else that is
//! not valid (dazzled, overflow, read error) is NaN. Source: SICK telegram listing, B0 reply; `lms2xx.md` sections 6 and 7.

use biplane_wire::lms::{MeasuringMode, ScanView, Selection, Value, decode as decode_value};

/// Most beams of an LMS: 100 degrees in steps of a quarter.
pub const MAX_LMS_BEAMS: usize = 401;

/// Directions and turns of a scan's beams.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct Fan {
    /// Direction of the first beam, hundredths of a degree from the middle, counter-clockwise.
    pub first_cdeg: i32,
    /// From beam to beam, hundredths of a degree.
    pub step_cdeg: u16,
    /// Number of beams.
    pub beams: u16,
    /// Mirror turns that the scan took: beam i belongs to turn `i % turns`.
    pub turns: u8,
}

impl Fan {
    /// The fan of a full scan of so many values; `None` for a count that no variant has. Every variant has its own count, but
    /// for an S14 (90 degrees in steps of a half, in one turn) beside 180 degrees in whole ones.
    #[must_use]
    pub fn of_count(count: usize, is_s14: bool) -> Option<Self> {
        let (fov_deg, step_cdeg, turns) = match count {
            181 if is_s14 => (90, 50, 1),
            101 => (100, 100, 1),
            201 => (100, 50, 2),
            401 => (100, 25, 4),
            181 => (180, 100, 1),
            361 => (180, 50, 2),
            _ => return None,
        };
        Some(Self { first_cdeg: -fov_deg * 50, step_cdeg, beams: count as u16, turns })
    }

    /// The fan of one turn of an interlaced scan (20 2A): always 180 degrees in whole steps, from an offset in quarters of a
    /// degree; 181 values from 0.00, 180 from the others.
    #[must_use]
    pub fn of_partial(count: usize, quarter: u8) -> Option<Self> {
        let expected = if quarter == 0 { 181 } else { 180 };
        let first_cdeg = -9000 + 25 * i32::from(quarter);
        (count == expected).then_some(Self { first_cdeg, step_cdeg: 100, beams: count as u16, turns: 1 })
    }

    /// Field of view, degrees.
    #[must_use]
    pub fn fov_deg(&self) -> u16 {
        (self.beams.saturating_sub(1)).saturating_mul(self.step_cdeg) / 100
    }
}

/// The two index bytes of a scan telegram, sent when bit 1 of the configuration's availability byte is set.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct ScanIndex {
    /// +1 a turn of the mirror, modulo 256: +k from a scan of k turns to the next.
    pub scan: u8,
    /// +1 a telegram sent, modulo 256.
    pub telegram: u8,
}

/// A scan, decoded.
#[derive(Clone, PartialEq, Debug)]
pub struct ScanReading {
    /// Index of the telegram's first byte in the stream.
    pub offset: u64,
    /// Bytes of the telegram.
    pub length: usize,
    /// Directions of the beams.
    pub fan: Fan,
    /// Longest range that the telegram can say, metres.
    pub range_max_m: f32,
    /// Ranges in metres, `+inf` for nothing in range, NaN for invalid.
    pub ranges_m: heapless::Vec<f32, MAX_LMS_BEAMS>,
    /// Remission, one a beam, device units; empty where the telegram has none.
    pub intensities: heapless::Vec<u16, MAX_LMS_BEAMS>,
    /// Where the scan and its telegram stand in the device's count, when the device says so.
    pub index: Option<ScanIndex>,
}

/// Decodes a scan's values; `None` when the number of values fits no variant of the device.
#[must_use]
pub fn decode(
    offset: u64,
    length: usize,
    view: &ScanView<'_>,
    mode: MeasuringMode,
    is_s14: bool,
) -> Option<ScanReading> {
    if view.selection() != Selection::All {
        return None;
    }
    let fan = match view.partial_offset_quarters() {
        None => Fan::of_count(view.count(), is_s14)?,
        Some(quarter) => Fan::of_partial(view.count(), quarter)?,
    };
    let metres = |units: u16| (f64::from(units) * view.unit().metres()) as f32;
    let mut ranges_m = heapless::Vec::new();
    for raw in view.values() {
        let range_m = match decode_value(raw, mode).value {
            Value::Range(units) => metres(units),
            Value::NoEcho | Value::BeyondRange => f32::INFINITY,
            _ => f32::NAN,
        };
        ranges_m.push(range_m).ok()?;
    }
    Some(ScanReading {
        offset,
        length,
        fan,
        range_max_m: metres(mode.max_range()?),
        ranges_m,
        intensities: heapless::Vec::new(),
        index: view.index().map(|(scan, telegram)| ScanIndex { scan, telegram }),
    })
}
