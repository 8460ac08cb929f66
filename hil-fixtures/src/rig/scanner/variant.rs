//! The variants of an LMS 2xx: field of view and step, and with them the directions and times of the beams.

use super::TURN_NS;

/// Field of view and step of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    fov_deg: u16,
    resolution_cdeg: u16,
}

impl Variant {
    /// 100 or 180 degrees in steps of 100, 50 or 25 hundredths of a degree; 180 degrees in quarters do not
    /// exist. An S14 has 90 degrees in halves.
    #[must_use]
    pub fn new(fov_deg: u16, resolution_cdeg: u16) -> Option<Self> {
        match (fov_deg, resolution_cdeg) {
            (100, 25 | 50 | 100) | (180, 50 | 100) | (90, 50) => Some(Self { fov_deg, resolution_cdeg }),
            _ => None,
        }
    }

    /// Field of view in degrees.
    #[must_use]
    pub fn fov_deg(self) -> u16 {
        self.fov_deg
    }

    /// Step between beams in hundredths of a degree.
    #[must_use]
    pub fn resolution_cdeg(self) -> u16 {
        self.resolution_cdeg
    }

    /// Mirror turns a scan takes. An S14 fires at half degrees, the others at whole ones.
    #[must_use]
    pub fn turns(self) -> u16 {
        if self.fov_deg == 90 { 1 } else { 100 / self.resolution_cdeg }
    }

    /// Values in a scan.
    #[must_use]
    pub fn beam_count(self) -> u16 {
        self.fov_deg * (100 / self.resolution_cdeg) + 1
    }

    /// Direction of a beam in the laser's frame, radians.
    #[must_use]
    pub fn beam_angle_rad(self, beam: u16) -> f64 {
        let steps = f64::from(beam) * f64::from(self.resolution_cdeg) / 100.0;
        (steps - 0.5 * f64::from(self.fov_deg)).to_radians()
    }

    /// When a beam is taken, after the first one.
    #[must_use]
    pub fn beam_delay_ns(self, beam: u16) -> i64 {
        let turns = i64::from(beam % self.turns()) * TURN_NS;
        turns + i64::from(beam) * i64::from(self.resolution_cdeg) * TURN_NS / 36_000
    }

    /// From the first beam to the telegram's first byte.
    #[must_use]
    pub fn duration_ns(self) -> i64 {
        i64::from(self.turns()) * TURN_NS
    }
}

#[cfg(test)]
mod tests {
    use super::{TURN_NS, Variant};

    #[test]
    fn beams_are_taken_turn_by_turn() {
        // SICK telegram listing 8007954: whole degrees in the first turn, halves in the second; 37.0 us a
        // degree.
        for (fov, step, beam, delay_ns) in [
            (180, 100, 0, 0),
            (180, 100, 90, 3_330_000),
            (180, 100, 180, 6_660_000),
            (180, 50, 1, TURN_NS + 18_500),
            (180, 50, 2, 37_000),
            (180, 50, 360, 6_660_000),
            (100, 25, 3, 3 * TURN_NS + 27_750),
            (100, 25, 400, 3_700_000),
            (90, 50, 1, 18_500),
        ] {
            assert_eq!(
                Variant::new(fov, step).expect("a variant").beam_delay_ns(beam),
                delay_ns,
                "{fov} {step} {beam}"
            );
        }
        let counts = [(180, 100), (180, 50), (100, 100), (100, 50), (100, 25)]
            .map(|(f, s)| Variant::new(f, s).map_or(0, Variant::beam_count));
        assert_eq!(counts, [181, 361, 101, 201, 401]);
        assert_eq!([Variant::new(180, 25), Variant::new(90, 100), Variant::new(180, 0)], [None; 3]);
    }
}
