//! Differences of counters that wrap around.
//!
//! x and y of the base count 15 bits. Known drivers lose a unit at every wrap or mask a wrong bit; a
//! sign-extended 15-bit difference is exact as long as the base moves less than 16384 units between two
//! packets.

/// Angle units of one turn.
pub const ANGLE_UNITS_PER_TURN: i32 = 4096;

/// Signed difference `now - previous` of two 15-bit counters, -16384 to 16383. Bit 15 of either is ignored.
pub fn wrap15(previous: u16, now: u16) -> i32 {
    // Shifting the 15 bits to the top lets the 16-bit subtraction wrap, and the shift back extends the sign.
    let difference = (now << 1).wrapping_sub(previous << 1) as i16;
    i32::from(difference >> 1)
}

/// Signed difference `now - previous` of two headings in angle units, the short way round: -2048 to 2047.
pub fn wrap_angle_units(previous: i16, now: i16) -> i32 {
    let half = ANGLE_UNITS_PER_TURN / 2;
    (i32::from(now) - i32::from(previous) + half).rem_euclid(ANGLE_UNITS_PER_TURN) - half
}

#[cfg(test)]
mod tests {
    use super::{wrap_angle_units, wrap15};

    #[test]
    fn steps_across_the_15_bit_border_are_exact_both_ways() {
        assert_eq!(wrap15(32_767, 0), 1);
        assert_eq!(wrap15(0, 32_767), -1);
        assert_eq!(wrap15(32_600, 100), 268);
        assert_eq!(wrap15(100, 32_600), -268);
        assert_eq!(wrap15(5, 5), 0);
        assert_eq!(wrap15(0x8005, 0x0006), 1); // bit 15 does not count
    }

    #[test]
    fn every_difference_of_15_bits_agrees_with_long_division() {
        for now in 0..0x8000u16 {
            let expected = (i32::from(now) - 20_000 + 16_384).rem_euclid(32_768) - 16_384;
            assert_eq!(wrap15(20_000, now), expected);
        }
    }

    #[test]
    fn headings_take_the_short_way_round() {
        assert_eq!(wrap_angle_units(4095, 0), 1);
        assert_eq!(wrap_angle_units(-2048, 2047), -1);
        assert_eq!(wrap_angle_units(0, 2048), -2048);
        assert_eq!(wrap_angle_units(i16::MAX, i16::MIN), 1);
    }
}
