//! `rig.toml`: which devices a robot carries, where they sit, and how their time is counted.
//!
//! Lengths in metres, angles in degrees (as people measure them); mounts are `base_from_laser`. Everything but ports has a
//! default; `base_link` lies on the floor (z = 0). The text is read by [`Rig::parse`] and written by [`Rig::to_toml`].

mod base;
mod error;
mod mount;
mod parse;
mod print;
mod table;
#[cfg(test)]
mod tests;
mod time;

pub use base::{Base, BaseProtocol, RflexModel};
pub use error::RigError;
pub use mount::Mount;
pub use time::MIRROR_TURN_NS;

/// A robot: two lasers and a base.
#[derive(Clone, PartialEq, Debug)]
pub struct Rig {
    /// The laser that localises.
    pub horizontal: Laser,
    /// The laser that sees the building; a robot without one only maps in 2D.
    pub vertical: Option<Laser>,
    /// The mobile base.
    pub base: Base,
}

/// A laser of the LMS 2xx family: its line, its settings, its place.
#[derive(Clone, PartialEq, Debug)]
pub struct Laser {
    /// The serial port.
    pub port: String,
    /// The rate to run at, in Bd: 9600, 19200, 38400 or 500000. A higher rate lets more scans through.
    pub baud: u32,
    /// Field of view, in degrees: 100 or 180, or 90 for an LMS with "S14" in its type.
    pub fov_deg: u16,
    /// From a beam to the next, in degrees: 0.25 (100 degrees only), 0.5 or 1 (not with 90 degrees). Finer takes more mirror
    /// turns a scan, except on an S14.
    pub resolution_deg: f64,
    /// What the device counts in. Millimetres resolve finer and reach less far.
    pub units: Units,
    /// How far the device shall measure at least, in m: 8, 16 or 32 in millimetres, 80, 160 or 320 in centimetres. Farther leaves
    /// fewer flag bits beside a range. `None`: whatever the device is set to.
    pub range_max_m: Option<u16>,
    /// Whether telegrams shall carry index bytes, by which lost scans are counted. `None`: as the device is set.
    pub index_bytes: Option<bool>,
    /// Whether remission is asked for and recorded. Doubles the bytes of a scan, so that a slow line carries half as many.
    pub remission: bool,
    /// Whether the device shall go on measuring when it is dazzled. `None`: as the device is set.
    pub dazzle_tolerant: Option<bool>,
    /// Where the laser sits on the base.
    pub mount: Mount,
    /// Correction to the time model, in ms: how much later than modelled a scan's first byte leaves the device. Too large puts
    /// scans too early.
    pub delay_ms: f64,
}

/// What a laser counts ranges in.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Units {
    /// Centimetres.
    Cm,
    /// Millimetres.
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
    pub const fn metres(self) -> f64 {
        match self {
            Self::Cm => 0.01,
            Self::Mm => 0.001,
        }
    }
}

impl Laser {
    /// The localising laser of the template rig.
    #[must_use]
    pub fn horizontal() -> Self {
        Self {
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
}

impl Default for Rig {
    /// The template rig: both lasers on a Pioneer.
    fn default() -> Self {
        Self { horizontal: Laser::horizontal(), vertical: Some(Laser::vertical()), base: Base::default() }
    }
}
