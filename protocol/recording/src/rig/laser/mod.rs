//! A laser of the rig, and when each beam of its scans was taken (LMS 2xx time model).
//!
//! The mirror turns once in T = 13.32 ms. A scan of k turns (k = 1, 2, 4 for 1, 0.5, 0.25 degrees) interlaces
//! them: beam i was taken in turn i mod k, when the mirror had come to its angle: t0 + (i mod k) T + (i
//! resolution / 360 degrees) T. The first byte of the scan's telegram leaves the device at t0 + k T +
//! `delay_ms`. t0 is the scan's `header.stamp`.

pub(crate) mod cola;
pub(crate) mod scip;
#[cfg(test)]
mod tests;

pub use cola::ColaLaser;
pub use scip::ScipLaser;

use super::Mount;

/// One turn of the mirror, in ns (75 a second).
pub const MIRROR_TURN_NS: i64 = 13_320_000;

const NS_PER_S: f64 = 1e9;
const NS_PER_MS: f64 = 1e6;

/// What a laser speaks, with what only that protocol needs.
#[derive(Clone, PartialEq, Debug, Default)]
pub enum LaserProtocol {
    /// SICK LMS 2xx on a serial line.
    #[default]
    Lms2xx,
    /// SICK LMS1xx, LMS5xx, TiM over TCP. Of the keys of an LMS 2xx only `mount` and `delay_ms` count.
    Cola(ColaLaser),
    /// Hokuyo URG, UTM, UST and the like. Of the keys of an LMS 2xx only `port`, `baud`, `mount` and
    /// `delay_ms` count.
    Scip(ScipLaser),
}

/// A laser: its line, its settings, its place.
#[derive(Clone, PartialEq, Debug)]
pub struct Laser {
    /// What it speaks.
    pub protocol: LaserProtocol,
    /// The serial port; empty for a laser on a network.
    pub port: String,
    /// The rate to run at, in Bd: 9600, 19200, 38400 or 500000. A higher rate lets more scans through.
    pub baud: u32,
    /// Field of view, in degrees: 100 or 180, or 90 for an LMS with "S14" in its type.
    pub fov_deg: u16,
    /// From a beam to the next, in degrees: 0.25 (100 degrees only), 0.5 or 1 (not with 90 degrees). Finer
    /// takes more mirror turns a scan, except on an S14.
    pub resolution_deg: f64,
    /// What the device counts in. Millimeters resolve finer and reach less far.
    pub units: Units,
    /// How far the device shall measure at least, in m: 8, 16 or 32 in millimeters, 80, 160 or 320 in
    /// centimeters. Farther leaves fewer flag bits beside a range. `None`: whatever the device is set to.
    pub range_max_m: Option<u16>,
    /// Whether telegrams shall carry index bytes, by which lost scans are counted. `None`: as the device is
    /// set.
    pub index_bytes: Option<bool>,
    /// Whether remission is asked for and recorded. Doubles the bytes of a scan, so that a slow line carries
    /// half as many.
    pub remission: bool,
    /// Whether the device shall go on measuring when it is dazzled. `None`: as the device is set.
    pub dazzle_tolerant: Option<bool>,
    /// Where the laser sits on the base.
    pub mount: Mount,
    /// Correction to the time model, in ms: how much later than modeled a scan's first byte leaves the
    /// device. Too large puts scans too early.
    pub delay_ms: f64,
}

/// What a laser counts ranges in.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Units {
    /// Centimeters.
    Cm,
    /// Millimeters.
    Mm,
}

impl Units {
    /// The word in `rig.toml`: `cm` or `mm`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cm => "cm",
            Self::Mm => "mm",
        }
    }

    /// The length of one unit, in m.
    #[must_use]
    pub const fn meters(self) -> f64 {
        match self {
            Self::Cm => 0.01,
            Self::Mm => 0.001,
        }
    }
}

impl Laser {
    /// The localizing laser of the template rig.
    #[must_use]
    pub fn horizontal() -> Self {
        Self {
            protocol: LaserProtocol::Lms2xx,
            port: "/dev/lms-horizontal".to_owned(),
            baud: 38400,
            fov_deg: 180,
            resolution_deg: 1.0,
            units: Units::Cm,
            range_max_m: None,
            index_bytes: None,
            remission: false,
            dazzle_tolerant: None,
            mount: Mount { x: 0.2, z: 0.3, ..Mount::default() },
            delay_ms: 0.0,
        }
    }

    /// The building-facing laser of the template rig: its fan's middle beam points up.
    #[must_use]
    pub fn vertical() -> Self {
        Self {
            port: "/dev/lms-vertical".to_owned(),
            mount: Mount { x: 0.05, z: 0.45, pitch: -90.0, ..Mount::default() },
            ..Self::horizontal()
        }
    }

    /// Such a laser at an address on the network, with nothing asked of it.
    #[must_use]
    pub fn at_address(self, address: impl Into<String>) -> Self {
        let cola = ColaLaser { address: address.into(), ..ColaLaser::default() };
        Self { protocol: LaserProtocol::Cola(cola), port: String::new(), ..self }
    }

    /// A Hokuyo laser at an address on the network, with nothing asked of it.
    #[must_use]
    pub fn scip_at_address(self, address: impl Into<String>) -> Self {
        let scip = ScipLaser { address: Some(address.into()), ..ScipLaser::default() };
        Self { protocol: LaserProtocol::Scip(scip), port: String::new(), ..self }
    }

    /// What a SICK laser on a network needs; `None` for others.
    #[must_use]
    pub fn cola(&self) -> Option<&ColaLaser> {
        match &self.protocol {
            LaserProtocol::Cola(cola) => Some(cola),
            LaserProtocol::Lms2xx | LaserProtocol::Scip(_) => None,
        }
    }

    /// What a Hokuyo laser needs; `None` for others.
    #[must_use]
    pub fn scip(&self) -> Option<&ScipLaser> {
        match &self.protocol {
            LaserProtocol::Scip(scip) => Some(scip),
            LaserProtocol::Lms2xx | LaserProtocol::Cola(_) => None,
        }
    }

    /// Host and port of a laser on a network; `None` for one on a serial line.
    #[must_use]
    pub fn address(&self) -> Option<&str> {
        match &self.protocol {
            LaserProtocol::Lms2xx => None,
            LaserProtocol::Cola(cola) => Some(&cola.address),
            LaserProtocol::Scip(scip) => scip.address.as_deref(),
        }
    }

    /// Whether it is an LMS 2xx, whose scans follow from the rig.
    #[must_use]
    pub fn is_lms2xx(&self) -> bool {
        self.protocol == LaserProtocol::Lms2xx
    }

    /// Mirror turns of a scan: 1, 2 or 4. An S14 (90 degrees) takes one, and so do lasers of today.
    #[must_use]
    pub fn turns(&self) -> u32 {
        match self.resolution_deg {
            _ if self.fov_deg == 90 || !self.is_lms2xx() => 1,
            fine if fine <= 0.25 => 4,
            half if half <= 0.5 => 2,
            _ => 1,
        }
    }

    /// Beams of a scan: 101, 181, 201, 361 or 401; 0 for a laser whose scans say it themselves.
    #[must_use]
    pub fn beam_count(&self) -> usize {
        if !self.is_lms2xx() {
            return 0;
        }
        (f64::from(self.fov_deg) / self.resolution_deg).round() as usize + 1
    }

    /// Direction of a beam in the laser's frame, in rad: 0 is the middle beam, the first is on the right
    /// (negative).
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

    /// From a beam to the next of the same turn, divided by the turns of a scan, in s: `time_increment` of a
    /// recorded scan.
    #[must_use]
    pub fn time_increment_s(&self) -> f64 {
        self.resolution_deg / 360.0 * MIRROR_TURN_NS as f64 / NS_PER_S
    }
}

#[cfg(test)]
mod beam_tests {
    use super::Laser;

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
