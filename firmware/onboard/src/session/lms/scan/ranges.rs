//! A scan telegram as ranges in meters, in the laser's own frame (x along the middle beam, y to the left).
//!
//! What is no range stays told apart as REP 117 wants it: no echo and beyond range are `+inf`, everything
//! else that is not valid (dazzled, overflow, read error) is NaN. Source: SICK telegram listing 8007954,
//! replies B0, C4, F5 and the table of overflow codes.

use std::fmt;

use biplane_wire::lms::{
    MeasuringMode, PairsView, S14View, ScanView, Selection, Unit, Value, decode as decode_value,
};

use crate::session::lms::scan::scan_geometry::ScanGeometry;

/// Most beams of an LMS: 100 degrees in steps of a quarter.
pub(crate) const MAX_LMS_BEAMS: usize = 401;

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
    pub geometry: ScanGeometry,
    /// Longest range that the telegram can say, meters.
    pub range_max_m: f32,
    /// Ranges in meters, `+inf` for nothing in range, NaN for invalid.
    pub ranges_m: heapless::Vec<f32, MAX_LMS_BEAMS>,
    /// Remission, one a beam, device units; empty where the telegram has none.
    pub intensities: heapless::Vec<u16, MAX_LMS_BEAMS>,
    /// Where the scan and its telegram stand in the device's count, when the device says so.
    pub index: Option<ScanIndex>,
    /// Values whose receiver was dazzled.
    pub dazzled: u16,
}

/// Any telegram with measured values.
#[derive(Copy, Clone, Debug)]
pub(crate) enum Measured<'a> {
    /// B0, B6, B7, BF.
    Scan(ScanView<'a>),
    /// F5.
    Pairs(PairsView<'a>),
    /// C4.
    S14(S14View<'a>),
}

/// Why measured values cannot be published as a scan.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Unpublished {
    /// B6, BF: means of several scans, taken at no one time.
    MeanValues,
    /// B7, or F5 whose parts leave gaps: a part of a scan.
    PartOfScan,
    /// So many values, which no variant of the device has.
    Count(u16),
    /// The measuring mode's words are no ranges.
    NoRanges(MeasuringMode),
    /// BE, F6: values in a form that is not understood.
    Form(u8),
}

impl fmt::Display for Unpublished {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MeanValues => f.write_str("means of several scans"),
            Self::PartOfScan => f.write_str("parts of a scan"),
            Self::Count(count) => write!(f, "scans of {count} values, which no LMS has"),
            Self::NoRanges(mode) => write!(f, "values in {mode}"),
            Self::Form(code) => write!(f, "values in telegrams {code:02X}h"),
        }
    }
}

impl Measured<'_> {
    /// The two index bytes.
    pub(crate) fn index(&self) -> Option<ScanIndex> {
        let index = match self {
            Self::Scan(scan) => scan.index(),
            Self::Pairs(pairs) => pairs.index(),
            Self::S14(scan) => scan.index(),
        };
        index.map(|(scan, telegram)| ScanIndex { scan, telegram })
    }

    /// Number of values.
    pub(crate) fn count(&self) -> usize {
        match self {
            Self::Scan(scan) => scan.count(),
            Self::Pairs(pairs) => pairs.parts().map(|part| part.count()).sum(),
            Self::S14(scan) => scan.values().len(),
        }
    }

    /// Unit of the ranges; that of the first part where there are several.
    pub(crate) fn unit(&self) -> Unit {
        match self {
            Self::Scan(scan) => scan.unit(),
            Self::Pairs(pairs) => pairs.parts().next().map_or(Unit::Cm, |part| part.unit),
            Self::S14(scan) => scan.unit,
        }
    }

    /// Decodes the values; an error when they cannot be published as a scan.
    pub(crate) fn decode(
        &self,
        offset: u64,
        length: usize,
        mode: MeasuringMode,
        is_s14: bool,
    ) -> Result<ScanReading, Unpublished> {
        let max_range = mode.max_range().ok_or(Unpublished::NoRanges(mode))?;
        let meters = self.unit().meters();
        let mut reading = ScanReading {
            offset,
            length,
            geometry: self.geometry(is_s14)?,
            range_max_m: (f64::from(max_range) * meters) as f32,
            ranges_m: heapless::Vec::new(),
            intensities: heapless::Vec::new(),
            index: self.index(),
            dazzled: 0,
        };
        match self {
            Self::Scan(scan) => scan.values().for_each(|raw| reading.push(raw, mode, meters)),
            Self::S14(scan) => {
                scan.values().for_each(|raw| reading.push(raw, mode, meters));
                // Remissions of a part of the fan have no place in a message that has one a beam or none.
                if scan.span.first == 1 && scan.remissions().len() == reading.ranges_m.len() {
                    reading.intensities.extend(scan.remissions().iter().copied().map(u16::from));
                }
            }
            Self::Pairs(pairs) => {
                for (raw, remission) in pairs.parts().flat_map(|part| part.pairs()) {
                    reading.push(raw, mode, meters);
                    let _ = reading.intensities.push(remission);
                }
            }
        }
        Ok(reading)
    }

    fn geometry(&self, is_s14: bool) -> Result<ScanGeometry, Unpublished> {
        let count = self.count();
        let geometry = match self {
            Self::Scan(scan) => match scan.selection() {
                Selection::All => match scan.partial_offset_quarters() {
                    None => ScanGeometry::of_count(count, is_s14),
                    Some(quarter) => ScanGeometry::of_partial(count, quarter),
                },
                Selection::Mean { .. } | Selection::MeanSubRange { .. } => {
                    return Err(Unpublished::MeanValues);
                }
                Selection::SubRange { .. } => return Err(Unpublished::PartOfScan),
            },
            Self::Pairs(pairs) => {
                return whole(pairs)
                    .and_then(|count| ScanGeometry::of_count(count, is_s14))
                    .ok_or(Unpublished::PartOfScan);
            }
            Self::S14(_) => ScanGeometry::of_count(count, true),
        };
        geometry.ok_or(Unpublished::Count(count as u16))
    }
}

/// Number of values when the parts cover the fan from its first value on, one behind the other, in one unit.
fn whole(pairs: &PairsView<'_>) -> Option<usize> {
    let unit = pairs.parts().next()?.unit;
    let mut next = 1;
    for part in pairs.parts() {
        let count = part.count();
        let ends = usize::from(part.span.last) + 1 == next + count;
        if usize::from(part.span.first) != next || !ends || part.unit != unit {
            return None;
        }
        next += count;
    }
    Some(next - 1)
}

impl ScanReading {
    fn push(&mut self, raw: u16, mode: MeasuringMode, meters: f64) {
        let measurement = decode_value(raw, mode);
        self.dazzled += u16::from(measurement.value == Value::Dazzled || measurement.flags.dazzle);
        let range_m = match measurement.value {
            Value::Range(units) => (f64::from(units) * meters) as f32,
            Value::NoEcho | Value::BeyondRange => f32::INFINITY,
            _ => f32::NAN,
        };
        // A telegram cannot hold more values than fit here.
        let _ = self.ranges_m.push(range_m);
    }
}
