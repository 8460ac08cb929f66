//! How a mock laser is made: its name, what an earlier client left, its mirror and its patience.

use super::model::Model;
use super::request::Latency;
use super::settings::{CONFIG_BYTES, ConfigBlock, Variant};
use crate::devices::lms::scans::feed::Mirror;

const MS: i64 = 1_000_000;

/// How a mock laser is made and how it takes its time.
#[derive(Clone, Debug)]
pub struct LmsParams {
    /// Text of the type reply; its last part is the firmware.
    pub type_text: String,
    /// Own address; requests to 00 are heard too.
    pub address: u8,
    /// Rate at the start, in Bd; another one than 9600 is a device that an earlier client left so.
    pub baud: u32,
    /// Highest rate that it changes to, in Bd; it refuses any above.
    pub max_baud: u32,
    /// Whether it streams whole scans from the start, as an earlier client left it.
    pub left_streaming: bool,
    /// Whether it says 90h at the start, as after power-on.
    pub power_on_message: bool,
    /// Variant at the start.
    pub variant: Variant,
    /// Configuration in the EEPROM.
    pub config: ConfigBlock,
    /// Bytes of it that this firmware has: 34, or 32 in an old one.
    pub config_bytes: usize,
    /// The list of faults (32h): type and number of each. Type 1 info, 2 warning, 3 error, 4 fatal, + 80h for
    /// one that is over. A reset clears it.
    pub errors: Vec<(u8, u8)>,
    /// The mirror; two lasers turn independently.
    pub mirror: Mirror,
    /// Delays of replies.
    pub latency: Latency,
    /// Bytes of a request further apart than this are dropped. A real device allows 6 ms; a pseudo-terminal's
    /// client may be held up for longer by the scheduler, so larger is kinder and smaller stricter.
    pub request_gap_ns: i64,
    /// From the reply to a rate command to the new rate.
    pub baud_switch_ns: i64,
    /// From a reset to the power-on message: up to 60 s on a real device.
    pub boot_ns: i64,
}

impl Default for LmsParams {
    fn default() -> Self {
        Self {
            type_text: "LMS291;S05;X01.27 ".to_owned(),
            address: 0,
            baud: 9600,
            max_baud: 500_000,
            left_streaming: false,
            power_on_message: false,
            variant: Variant::of(180, 50),
            config: ConfigBlock::default(),
            config_bytes: CONFIG_BYTES,
            errors: Vec::new(),
            mirror: Mirror { phase_ns: 0, turn_ns: Mirror::TURN_NS },
            latency: Latency::default(),
            request_gap_ns: 6 * MS,
            baud_switch_ns: 20 * MS,
            boot_ns: 2_000 * MS,
        }
    }
}

impl LmsParams {
    /// A laser of the type that a text names, as it leaves the factory.
    #[must_use]
    pub fn of_type(type_text: &str) -> Self {
        let model = Model::of_text(type_text);
        let (variant, config) = (model.variant(), model.config());
        Self { type_text: type_text.to_owned(), variant, config, ..Self::default() }
    }
}
