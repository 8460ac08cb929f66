//! Random numbers from a seed and nothing else.
//!
//! Every draw belongs to a named stream (`seed`, `stream`, `number`), so that scan 17 of the vertical laser
//! has the same noise whether scan 16 was asked for or not. The generator is SplitMix64 (Steele, Lea, Flood
//! 2014).

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Rng {
    state: u64,
    spare_normal: Option<f64>,
}

impl Rng {
    /// The stream `stream` of `seed`, at `number` (a scan, a step, a tree).
    #[must_use]
    pub fn new(seed: u64, stream: u64, number: i64) -> Self {
        let mut state = mix(seed.wrapping_add(0x9E37_79B9_7F4A_7C15));
        state = mix(state ^ stream.wrapping_mul(0xD1B5_4A32_D192_ED03));
        state = mix(state ^ number.cast_unsigned().wrapping_mul(0x8CB9_2BA7_2F3D_8DD7));
        Self { state, spare_normal: None }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        mix(self.state)
    }

    /// A stream of its own that depends on this one's present state: what is drawn from one does not shift
    /// the other.
    #[must_use]
    pub fn branch(&mut self) -> Self {
        Self { state: mix(self.bits()), spare_normal: None }
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare_normal.take() {
            return spare;
        }
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        let angle = std::f64::consts::TAU * self.unit();
        self.spare_normal = Some(radius * angle.sin());
        radius * angle.cos()
    }

    /// Exponential with the given mean.
    pub fn exponential(&mut self, mean: f64) -> f64 {
        -mean * (1.0 - self.unit()).ln()
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::Rng;

    #[test]
    fn the_generator_gives_the_published_numbers() {
        // SplitMix64 from state 0 (reference implementation by Vigna).
        let mut rng = Rng { state: 0, spare_normal: None };
        assert_eq!(rng.bits(), 0xE220_A839_7B1D_CDAF);
        assert_eq!(rng.bits(), 0x6E78_9E6A_A1B9_65F4);
    }

    #[test]
    fn normal_and_exponential_numbers_have_their_moments() {
        let n = 200_000;
        let mut rng = Rng::new(1, 2, 3);
        let normal: Vec<f64> = (0..n).map(|_| rng.normal()).collect();
        let mean = normal.iter().sum::<f64>() / n as f64;
        let variance = normal.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n as f64;
        assert!(mean.abs() < 0.01 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
        let late = (0..n).map(|_| rng.exponential(0.3)).sum::<f64>() / n as f64;
        assert!((late - 0.3).abs() < 0.005, "{late}");
    }

    #[test]
    fn neighboring_numbers_of_a_stream_are_independent() {
        let n = 10_000;
        let product: f64 =
            (0..n).map(|k| (Rng::new(5, 1, k).unit() - 0.5) * (Rng::new(5, 1, k + 1).unit() - 0.5)).sum();
        assert!((product / n as f64).abs() < 0.003, "{product}");
    }
}
