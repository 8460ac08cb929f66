//! The inertial unit in `rig.toml`: where it sits, and how its samples come.

use super::Mount;
use super::table::Table;

/// Rates that an Xsens unit may run at, in Bd.
const BAUDS: [f64; 9] =
    [9600.0, 19200.0, 38400.0, 57600.0, 115_200.0, 230_400.0, 460_800.0, 921_600.0, 2_000_000.0];
const DEFAULT_BAUD: u32 = 115_200;
/// Samples a second: parts of the 400 that units take; an MTi-1 ends at 100.
const RATES_HZ: [f64; 5] = [25.0, 50.0, 100.0, 200.0, 400.0];
const DEFAULT_RATE_HZ: u16 = 100;
/// Bytes of a message with count, time, accelerations, turn rates and flags in 32 bits each.
const SAMPLE_BYTES: u32 = 54;
/// Bits of a byte on the line.
const BYTE_BITS: u32 = 10;

/// An inertial unit: turn rates and accelerations.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct InertialUnit {
    /// How its samples come.
    pub protocol: InertialProtocol,
    /// The serial port; empty where samples come with the recording.
    pub port: String,
    /// The line's rate, in Bd; 0 without a line.
    pub baud: u32,
    /// Samples a second that it is asked for; 0 without a line.
    pub rate_hz: u16,
    /// Where it sits. Its own axes: x forward, y left, z up, as those of the base, when nothing is said.
    pub mount: Mount,
}

/// How the samples of an inertial unit come.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum InertialProtocol {
    /// With the recording, as `/imu`: of an imported bag, or of a simulated drive.
    #[default]
    None,
    /// On a serial line, as messages of an Xsens MTi. Written after its documentation, never tried on
    /// hardware.
    Xsens,
}

impl InertialProtocol {
    /// The word in `rig.toml`: `none` or `xsens`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Xsens => "xsens",
        }
    }
}

impl InertialUnit {
    /// An Xsens unit on this port, as it is when nothing else is said.
    #[must_use]
    pub fn xsens(port: &str) -> Self {
        Self {
            protocol: InertialProtocol::Xsens,
            port: port.to_owned(),
            baud: DEFAULT_BAUD,
            rate_hz: DEFAULT_RATE_HZ,
            mount: Mount::default(),
        }
    }

    /// Whether it is on a serial line of the robot.
    #[must_use]
    pub fn is_serial(&self) -> bool {
        self.protocol != InertialProtocol::None
    }

    pub(crate) fn parse(table: &Table, mount_of: impl Fn(&Table, Mount) -> Mount) -> Self {
        let placed = Self { mount: mount_of(table, Mount::default()), ..Self::default() };
        match table.word("protocol", "none", &["none", "xsens"]) {
            Some("xsens") => return xsens(table, placed.mount),
            Some(_) => table.only(&["protocol", "mount"]),
            // Which other keys it has depends on what it speaks.
            None => {}
        }
        placed
    }
}

fn xsens(table: &Table, mount: Mount) -> InertialUnit {
    table.only(&["protocol", "port", "baud", "rate_hz", "mount"]);
    let unit = InertialUnit {
        baud: table.one_of("baud", f64::from(DEFAULT_BAUD), &BAUDS) as u32,
        rate_hz: table.one_of("rate_hz", f64::from(DEFAULT_RATE_HZ), &RATES_HZ) as u16,
        mount,
        ..InertialUnit::xsens(&table.text("port"))
    };
    let bits = SAMPLE_BYTES * BYTE_BITS;
    if u32::from(unit.rate_hz) * bits > unit.baud && table.are_sound(&["baud", "rate_hz"]) {
        match table.has("rate_hz") {
            true => {
                let allowed =
                    format!("{} or less at {} Bd: a sample has {bits} bits", unit.baud / bits, unit.baud);
                table.refuse("rate_hz", &allowed);
            }
            false => table.refuse("baud", &format!("{} or more for 100 samples a second", 100 * bits)),
        }
    }
    unit
}
