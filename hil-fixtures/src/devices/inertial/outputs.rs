//! What a mock unit is set to send, and how it writes it.

use crate::rig::inertial::InertialSample;

/// With every measurement.
const EVERY: u16 = 0xFFFF;
/// Measurements a second where no output says how many.
const DEFAULT_HZ: u16 = 100;
/// The self-test was passed.
const SELF_TEST: u32 = 1;

/// Identifiers with their rates, in the order of sending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outputs(Vec<(u16, u16)>);

impl Outputs {
    /// As it left the factory: counter, time, orientation as Euler angles, flags.
    #[must_use]
    pub fn factory() -> Self {
        Self(vec![(0x1020, EVERY), (0x1060, EVERY), (0x2030, 100), (0xE020, EVERY)])
    }

    /// Counter, time, accelerations and turn rates so many times a second, and flags.
    #[must_use]
    pub fn whole(rate_hz: u16) -> Self {
        Self(vec![(0x1020, EVERY), (0x1060, EVERY), (0x4020, rate_hz), (0x8020, rate_hz), (0xE020, EVERY)])
    }

    /// What a client asks, as the unit takes it: no more than so many a second.
    #[must_use]
    pub fn parse(data: &[u8], fastest_hz: u16) -> Self {
        let word = |pair: &[u8]| u16::from_be_bytes([pair[0], pair[1]]);
        let output = |four: &[u8]| {
            let asked_hz = word(&four[2..]);
            (word(four), if asked_hz == EVERY { EVERY } else { asked_hz.min(fastest_hz) })
        };
        Self(data.chunks_exact(4).map(output).collect())
    }

    /// As its answer says them.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        let words = self.0.iter().flat_map(|(identifier, rate_hz)| [*identifier, *rate_hz]);
        words.flat_map(u16::to_be_bytes).collect()
    }

    /// From a measurement to the next.
    #[must_use]
    pub fn period_ns(&self) -> i64 {
        let rates_hz = self.0.iter().map(|(_, rate_hz)| *rate_hz);
        let rate_hz = rates_hz.filter(|rate_hz| !matches!(*rate_hz, 0 | EVERY)).max();
        1_000_000_000 / i64::from(rate_hz.unwrap_or(DEFAULT_HZ))
    }

    /// The items of a measurement.
    #[must_use]
    pub fn items(&self, counter: u16, ticks: u32, sample: &InertialSample) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (identifier, rate_hz) in &self.0 {
            let item = match (identifier & 0xFFF0, rate_hz) {
                (_, 0) => continue,
                (0x1020, _) => counter.to_be_bytes().to_vec(),
                (0x1060, _) => ticks.to_be_bytes().to_vec(),
                (0x1070, _) => (ticks / 10_000).to_be_bytes().to_vec(),
                (0x4020, _) => vector(sample.force_m_s2, identifier & 3),
                (0x8020, _) => vector(sample.turn_rad_s, identifier & 3),
                (0xE020, _) => SELF_TEST.to_be_bytes().to_vec(),
                _ => vector([0.0; 3], identifier & 3),
            };
            bytes.extend(identifier.to_be_bytes());
            bytes.push(item.len() as u8);
            bytes.extend(item);
        }
        bytes
    }
}

fn vector(numbers: [f64; 3], precision: u16) -> Vec<u8> {
    let write = |number: f64| -> Vec<u8> {
        match precision {
            0 => (number as f32).to_be_bytes().to_vec(),
            1 => ((number * f64::from(1 << 20)).round() as i32).to_be_bytes().to_vec(),
            2 => {
                let counts = (number * 2_f64.powi(32)).round() as i64;
                [&(counts as u32).to_be_bytes()[..], &((counts >> 32) as i16).to_be_bytes()].concat()
            }
            _ => number.to_be_bytes().to_vec(),
        }
    };
    numbers.into_iter().flat_map(write).collect()
}
