//! Bit noise: single bits flip now and then, as on a long line without shielding.

use crate::line::{Arrival, Fault};
use crate::rng::Rng;
use std::collections::VecDeque;

/// How noisy the line is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BitNoiseParams {
    /// Probability that a byte has one bit wrong. At 1e-4 one scan of 372 bytes in 27 is damaged; larger
    /// damages more.
    pub byte_error_rate: f64,
}

impl Default for BitNoiseParams {
    fn default() -> Self {
        Self { byte_error_rate: 1e-4 }
    }
}

/// The fault.
#[derive(Debug)]
pub struct BitNoise {
    params: BitNoiseParams,
    rng: Rng,
}

impl BitNoise {
    /// Noise from its own stream of random numbers.
    #[must_use]
    pub fn new(params: BitNoiseParams, rng: Rng) -> Self {
        Self { params, rng }
    }
}

impl Fault for BitNoise {
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64 {
        let mut bytes = bytes.to_vec();
        let mut touched = 0;
        for byte in &mut bytes {
            if self.rng.unit() < self.params.byte_error_rate {
                *byte ^= 1 << (self.rng.bits() & 7);
                touched += 1;
            }
        }
        arrivals.push_back(Arrival { at_ns: now_ns, bytes });
        touched
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_in_ten_thousand_has_exactly_one_bit_wrong() {
        let mut noise = BitNoise::new(BitNoiseParams::default(), Rng::new(1, 1, 1));
        let mut arrivals = VecDeque::new();
        let touched = noise.pass(0, &vec![0; 1_000_000], &mut arrivals);
        assert!((60..140).contains(&touched), "{touched}");
        let flipped: u32 = arrivals[0].bytes.iter().map(|byte| byte.count_ones()).sum();
        assert_eq!(u64::from(flipped), touched);
    }
}
