//! What a laser on a network is when it is switched on, and when its mirror passes which direction.

use biplane_wire::cola::{Dialect, Family, OutputRange, ScanConfig, ScanDataConfig};

use crate::rig::fan::Fan;

const MS: i64 = 1_000_000;
const TURN_E4DEG: f64 = 3_600_000.0;
/// A turn begins at the rear; 90 degrees is straight ahead.
const REAR_E4DEG: f64 = -900_000.0;
const AHEAD_E4DEG: f64 = 900_000.0;

/// A laser as it leaves the factory, and how it differs from its paper.
#[derive(Clone, Debug, PartialEq)]
pub struct ColaParams {
    /// What it is.
    pub family: Family,
    /// How it calls itself.
    pub name: String,
    /// Its firmware.
    pub version: String,
    /// Its serial number.
    pub serial: u32,
    /// The only dialect that it answers; `None` answers as it is asked.
    pub dialect: Option<Dialect>,
    /// From a request to its answer.
    pub latency_ns: i64,
    /// From power-on until it answers; it takes connections before.
    pub boot_ns: i64,
    /// Its clock at time 0, microseconds.
    pub first_us: u32,
    /// Its count of telegrams at time 0.
    pub first_counter: u16,
    /// By how many millionths its clock is fast.
    pub clock_ppm: f64,
    /// By how many millionths its mirror turns slower than it says.
    pub slow_ppm: f64,
    /// Where its mirror is at time 0, nanoseconds of a turn.
    pub phase_ns: i64,
    /// Rate and step.
    pub scan: ScanConfig,
    /// What its telegrams hold.
    pub data: ScanDataConfig,
    /// Which part of the fan it sends.
    pub range: OutputRange,
}

impl ColaParams {
    /// A laser of this type: `LMS111`, `LMS511`, `TIM561`, `TIM781` or another name of these families.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Family::of_name(name.as_bytes()).map(|family| Self::new(family, name))
    }

    /// A laser of this family that calls itself so.
    #[must_use]
    pub fn new(family: Family, name: &str) -> Self {
        let [start_e4deg, stop_e4deg] = family.fan_e4deg();
        let (rate_chz, step_e4deg, slow_ppm) = match family {
            Family::Lms1xx => (5000, 5000, 5000.0),
            Family::Lms5xx => (2500, 3333, 10.0),
            Family::Tim5xx | Family::Tim7xx => (1500, 3333, 20.0),
        };
        Self {
            family,
            name: name.to_owned(),
            version: "V1.80.2".to_owned(),
            serial: 18_090_362,
            dialect: None,
            latency_ns: MS,
            boot_ns: 2_000 * MS,
            first_us: 1_949_193_277,
            first_counter: 63_355,
            clock_ppm: 12.0,
            slow_ppm,
            phase_ns: 0,
            scan: ScanConfig { rate_chz, sectors: 1, step_e4deg, start_e4deg, stop_e4deg },
            data: ScanDataConfig { channels: [1, 0], clock: true, every: 1, ..ScanDataConfig::default() },
            range: OutputRange { step_e4deg, start_e4deg, stop_e4deg },
        }
    }

    /// One turn of the mirror, nanoseconds.
    #[must_use]
    pub fn turn_ns(&self, scan: &ScanConfig) -> i64 {
        let nominal_ns = 1e11 / f64::from(scan.rate_chz.max(1));
        (nominal_ns * (1.0 + self.slow_ppm * 1e-6)).round() as i64
    }

    /// When the mirror passes a direction, from the beginning of its turn, nanoseconds.
    fn passes_ns(direction_e4deg: f64, turn_ns: i64) -> i64 {
        ((direction_e4deg - REAR_E4DEG) / TURN_E4DEG * turn_ns as f64).round() as i64
    }

    /// What the time of a scan in its telegram marks, from the beginning of its turn: the index in front of
    /// the scan on an LMS5xx, the end of the fan on the others (as measured on three devices).
    #[must_use]
    pub fn mark_ns(&self, turn_ns: i64) -> i64 {
        let mark_e4deg = match self.family {
            Family::Lms5xx => -140_000.0,
            _ => 2_250_000.0,
        };
        Self::passes_ns(mark_e4deg, turn_ns)
    }

    /// From that time to the transmission.
    #[must_use]
    pub fn processing_ns(&self, turn_ns: i64) -> i64 {
        match self.family {
            Family::Lms1xx => 3_110_000,
            Family::Lms5xx => turn_ns + 670_000,
            Family::Tim5xx | Family::Tim7xx => 6_460_000,
        }
    }

    /// The beams of a turn that begins at `turn_at_ns`.
    #[must_use]
    pub fn fan(&self, range: &OutputRange, turn_at_ns: i64, turn_ns: i64) -> Fan {
        let [first, last] = self.family.fan_e4deg();
        let start = f64::from(range.start_e4deg.clamp(first, last));
        let stop = f64::from(range.stop_e4deg.clamp(first, last));
        // Thirds of a degree are sent rounded and measured exactly.
        let step = 20_000.0 / (20_000.0 / f64::from(range.step_e4deg.max(1))).round().max(1.0);
        Fan {
            first_beam_ns: turn_at_ns + Self::passes_ns(start, turn_ns),
            beam_ns: step / TURN_E4DEG * turn_ns as f64,
            first_rad: ((start - AHEAD_E4DEG) / 1e4).to_radians(),
            step_rad: (step / 1e4).to_radians(),
            count: (((stop - start) / step + 1e-6).floor() as u16).saturating_add(1),
        }
    }
}

impl Default for ColaParams {
    /// An LMS111.
    fn default() -> Self {
        Self::new(Family::Lms1xx, "LMS111")
    }
}
