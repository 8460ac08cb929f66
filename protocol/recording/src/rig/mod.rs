//! `rig.toml`: which devices a robot carries, where they sit, and how their time is counted.
//!
//! Lengths in metres, angles in degrees (as people measure them); mounts are `base_from_laser`. Everything but ports has a
//! default; `base_link` lies on the floor (z = 0). The text is read by [`Rig::parse`] and written by [`Rig::to_toml`].

mod error;
mod mount;
mod parse;
mod print;
mod table;
#[cfg(test)]
mod tests;
mod time;

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

/// The mobile base: its line and its odometry.
#[derive(Clone, PartialEq, Debug)]
pub struct Base {
    /// What it speaks.
    pub protocol: BaseProtocol,
    /// The serial port.
    pub port: String,
    /// The line's rate, in Bd.
    pub baud: u32,
    /// Distance of one odometry unit, in m (`p2os` and `rflex`). Too large makes the robot seem to drive too far. The unit of its
    /// angle is 2 pi / 4096.
    pub metres_per_tick: f64,
}

/// What a base speaks, with what only that protocol needs.
#[derive(Copy, Clone, PartialEq, Debug)]
pub enum BaseProtocol {
    /// P2OS and ARCOS: Pioneer and its kin.
    P2os,
    /// RoboClaw packet serial: home-made bases with two driven wheels.
    RoboClaw {
        /// The controller's address, 128 to 135.
        address: u8,
        /// Between the wheels' tracks, in m. Too large makes the robot seem to turn too little.
        wheel_base_m: f64,
        /// Distance of one encoder count of the left wheel, in m; negative when it counts backwards.
        metres_per_count_left: f64,
        /// The same of the right wheel.
        metres_per_count_right: f64,
    },
    /// rFLEX: B21r, ATRV, Magellan.
    Rflex,
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

impl BaseProtocol {
    /// The word in `rig.toml`: `p2os`, `roboclaw` or `rflex`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::P2os => "p2os",
            Self::RoboClaw { .. } => "roboclaw",
            Self::Rflex => "rflex",
        }
    }

    /// The rate that such a base runs at unless told otherwise, in Bd.
    #[must_use]
    pub const fn default_baud(self) -> u32 {
        match self {
            Self::P2os => 9600,
            Self::RoboClaw { .. } => 38400,
            Self::Rflex => 115_200,
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

impl Default for Base {
    /// A Pioneer.
    fn default() -> Self {
        Self {
            protocol: BaseProtocol::P2os,
            port: "/dev/base".to_owned(),
            baud: BaseProtocol::P2os.default_baud(),
            metres_per_tick: 0.001,
        }
    }
}

impl Default for Rig {
    /// The template rig: both lasers on a Pioneer.
    fn default() -> Self {
        Self { horizontal: Laser::horizontal(), vertical: Some(Laser::vertical()), base: Base::default() }
    }
}
