//! When each beam of a scan was taken (LMS 2xx time model).
//!
//! The mirror turns once in T = 13.32 ms. A scan of k turns (k = 1, 2, 4 for 1, 0.5, 0.25 degrees) interlaces them: beam i was
//! taken in turn i mod k, when the mirror had come to its angle: t0 + (i mod k) T + (i resolution / 360 degrees) T. The first byte
//! of the scan's telegram leaves the device at t0 + k T + `delay_ms`. t0 is the scan's `header.stamp`.

use super::Laser;

/// One turn of the mirror, in ns (75 a second).
pub const MIRROR_TURN_NS: i64 = 13_320_000;

const NS_PER_S: f64 = 1e9;
const NS_PER_MS: f64 = 1e6;

impl Laser {
    /// Mirror turns of a scan: 1, 2 or 4. An S14 (90 degrees) takes one.
    #[must_use]
    pub fn turns(&self) -> u32 {
        match self.resolution_deg {
            _ if self.fov_deg == 90 => 1,
            fine if fine <= 0.25 => 4,
            half if half <= 0.5 => 2,
            _ => 1,
        }
    }

    /// Beams of a scan: 101, 181, 201, 361 or 401.
    #[must_use]
    pub fn beam_count(&self) -> usize {
        (f64::from(self.fov_deg) / self.resolution_deg).round() as usize + 1
    }

    /// Direction of a beam in the laser's frame, in rad: 0 is the middle beam, the first is on the right (negative).
    #[must_use]
    pub fn beam_angle_rad(&self, beam: usize) -> f64 {
        (beam as f64 * self.resolution_deg - f64::from(self.fov_deg) / 2.0).to_radians()
    }

    /// When a beam was taken, in ns after the scan's stamp.
    #[must_use]
    pub fn beam_delay_ns(&self, beam: usize) -> i64 {
        let turn = beam as i64 % i64::from(self.turns());
        let sweep = beam as f64 * self.resolution_deg / 360.0 * MIRROR_TURN_NS as f64;
        turn * MIRROR_TURN_NS + sweep.round() as i64
    }

    /// When the first byte of a scan's telegram leaves the device, in ns after the scan's stamp.
    #[must_use]
    pub fn first_byte_delay_ns(&self) -> i64 {
        self.scan_time_ns() + (self.delay_ms * NS_PER_MS).round() as i64
    }

    /// From a scan to the next, in ns.
    #[must_use]
    pub fn scan_time_ns(&self) -> i64 {
        i64::from(self.turns()) * MIRROR_TURN_NS
    }

    /// From a beam to the next of the same turn, divided by the turns of a scan, in s: `time_increment` of a recorded scan.
    #[must_use]
    pub fn time_increment_s(&self) -> f64 {
        self.resolution_deg / 360.0 * MIRROR_TURN_NS as f64 / NS_PER_S
    }
}

#[cfg(test)]
mod tests {
    use super::super::Laser;

    fn laser(fov_deg: u16, resolution_deg: f64) -> Laser {
        Laser { fov_deg, resolution_deg, ..Laser::horizontal() }
    }

    #[test]
    fn counts_turns_and_directions_follow_from_fov_and_resolution() {
        // fov, resolution, beams, turns, first beam in degrees
        let table = [
            (180, 1.0, 181, 1, -90.0),
            (180, 0.5, 361, 2, -90.0),
            (100, 1.0, 101, 1, -50.0),
            (100, 0.5, 201, 2, -50.0),
            (100, 0.25, 401, 4, -50.0),
            (90, 0.5, 181, 1, -45.0),
        ];
        for (fov, resolution, beams, turns, first_deg) in table {
            let laser = laser(fov, resolution);
            assert_eq!((laser.beam_count(), laser.turns()), (beams, turns), "{fov} {resolution}");
            assert!((laser.beam_angle_rad(0).to_degrees() - first_deg).abs() < 1e-12);
            assert!((laser.beam_angle_rad(beams - 1).to_degrees() + first_deg).abs() < 1e-12);
            assert!(laser.beam_angle_rad(beams / 2).abs() < 1e-12);
        }
    }

    #[test]
    fn beam_times_are_those_worked_out_by_hand() {
        // 1 degree of 360 takes 13.32 ms / 360 = 37 us; half of it 18.5 us; a quarter 9.25 us.
        let one = laser(180, 1.0);
        assert_eq!([0, 1, 90, 180].map(|i| one.beam_delay_ns(i)), [0, 37_000, 3_330_000, 6_660_000]);
        let half = laser(180, 0.5);
        assert_eq!(
            [0, 1, 2, 3, 360].map(|i| half.beam_delay_ns(i)),
            [0, 13_320_000 + 18_500, 37_000, 13_320_000 + 55_500, 6_660_000]
        );
        let quarter = laser(100, 0.25);
        assert_eq!(
            [1, 2, 3, 4, 400].map(|i| quarter.beam_delay_ns(i)),
            [13_329_250, 26_640_000 + 18_500, 39_960_000 + 27_750, 37_000, 3_700_000]
        );
        assert_eq!([one.time_increment_s(), half.time_increment_s()], [37.0e-6, 18.5e-6]);
    }

    #[test]
    fn the_first_byte_leaves_after_all_turns_and_the_correction() {
        assert_eq!(laser(180, 1.0).first_byte_delay_ns(), 13_320_000);
        assert_eq!(laser(180, 0.5).first_byte_delay_ns(), 26_640_000);
        assert_eq!(laser(100, 0.25).first_byte_delay_ns(), 53_280_000);
        let late = Laser { delay_ms: -1.25, ..laser(180, 1.0) };
        assert_eq!(late.first_byte_delay_ns(), 12_070_000);
        assert_eq!(late.scan_time_ns(), 13_320_000);
    }
}
