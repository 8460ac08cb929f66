//! Which way the beams of a scan point, and in which turn of the mirror each was taken.

/// Directions and turns of a scan's beams.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct ScanGeometry {
    /// Direction of the first beam, hundredths of a degree from the middle, counter-clockwise.
    pub first_cdeg: i32,
    /// From beam to beam, hundredths of a degree.
    pub step_cdeg: u16,
    /// Number of beams.
    pub beams: u16,
    /// Mirror turns that the scan took: beam i belongs to turn `i % turns`.
    pub turns: u8,
}

impl ScanGeometry {
    /// The fan of a full scan of so many values; `None` for a count that no variant has. Every variant has
    /// its own count, but for an S14 (90 degrees in steps of a half, in one turn) beside 180 degrees in whole
    /// ones.
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

    /// The fan of one turn of an interlaced scan (20 2A): always 180 degrees in whole steps, from an offset
    /// in quarters of a degree; 181 values from 0.00, 180 from the others.
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
