//! The configuration block: commands 74h and 77h, replies F4h and F7h (telegram listing, section 7.22).
//!
//! Current firmware has 34 bytes, older 32, and hosts may write fewer; so the block keeps the bytes it was
//! given, as many as there were, and unknown ones behind them. Offsets count from the first byte behind the
//! code (F7h: behind the accepted byte).

use heapless::Vec;

use crate::WireError;
use crate::lms::scan::Unit;
use crate::lms::settings::measuring::MeasuringMode;

const BLANKING: usize = 0;
const THRESHOLD: usize = 2;
const SENSITIVITY: usize = 3;
const AVAILABILITY: usize = 4;
const MEASURING_MODE: usize = 5;
const UNIT: usize = 6;
const MULTIPLE_EVALUATION: usize = 9;
const RESTART: usize = 10;

/// The configuration of a device, 0 to [`Config::MAX_BYTES`] bytes of it.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Config {
    bytes: Vec<u8, { Config::MAX_BYTES }>,
}

/// Byte 4 of the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Availability(
    /// The byte as sent.
    pub u8,
);

impl Availability {
    /// Bit 0: availability level 3, goes on measuring when dazzled.
    pub fn level_3(self) -> bool {
        self.0 & 0x01 != 0
    }

    /// Bit 1: scan telegrams carry the two index bytes.
    pub fn index_bytes(self) -> bool {
        self.0 & 0x02 != 0
    }

    /// Bit 2: dazzle does not switch the outputs.
    pub fn dazzle_ignored(self) -> bool {
        self.0 & 0x04 != 0
    }
}

impl Config {
    /// Bytes kept at most; more are refused.
    pub const MAX_BYTES: usize = 64;
    /// Bytes of a complete block in current firmware.
    pub const BYTES: usize = 34;

    /// The factory setting of the telegram listing: LMS 200, millimeters, 8 m.
    pub const FACTORY: [u8; Config::BYTES] = [
        0x00, 0x00, 0x46, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x02, 0x02, 0x02, 0x00, 0x00, 0x0A, 0x0A, 0x50,
        0x64, 0x00, 0x0A, 0x0A, 0x50, 0x64, 0x00, 0x0A, 0x0A, 0x50, 0x64, 0x00, 0x00, 0x00, 0x00, 0x02, 0x00,
    ];

    /// A complete block as delivered.
    pub fn factory() -> Self {
        Self { bytes: Vec::from_array(Self::FACTORY) }
    }

    /// A block of just these bytes.
    ///
    /// # Errors
    /// More than [`Config::MAX_BYTES`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WireError> {
        Self::parse(bytes, 0)
    }

    pub(crate) fn parse(bytes: &[u8], offset: usize) -> Result<Self, WireError> {
        let bytes = Vec::from_slice(bytes).map_err(|_| WireError::Capacity {
            field: "configuration",
            limit: Self::MAX_BYTES,
            found: bytes.len(),
            offset,
        })?;
        Ok(Self { bytes })
    }

    /// The bytes as received or to be sent.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// What a device holds after being sent `written`, which may be shorter than its own block.
    #[must_use]
    pub fn overlaid_with(&self, written: &Config) -> Config {
        let mut result = self.clone();
        for (own, new) in result.bytes.iter_mut().zip(&written.bytes) {
            *own = *new;
        }
        result
    }

    fn byte(&self, offset: usize) -> Option<u8> {
        self.bytes.get(offset).copied()
    }

    /// Sets one byte; a block too short for it is filled up from the factory setting.
    fn set(&mut self, offset: usize, byte: u8) {
        while self.bytes.len() <= offset {
            let filler = Self::FACTORY.get(self.bytes.len()).copied().unwrap_or(0);
            if self.bytes.push(filler).is_err() {
                return;
            }
        }
        if let Some(slot) = self.bytes.get_mut(offset) {
            *slot = byte;
        }
    }

    /// Bytes 0 and 1: nothing nearer than this is measured, in centimeters.
    pub fn blanking_cm(&self) -> Option<u16> {
        Some(u16::from_le_bytes([self.byte(BLANKING)?, self.byte(BLANKING + 1)?]))
    }

    /// Byte 2: stop threshold in millivolts (LMS 200 and 220).
    pub fn threshold_mv(&self) -> Option<u8> {
        self.byte(THRESHOLD)
    }

    /// Byte 3: peak threshold (LMS 200, 220) or sensitivity (LMS 211, 221, 291: 0 standard, 1 medium, 2 low,
    /// 3 high).
    pub fn sensitivity(&self) -> Option<u8> {
        self.byte(SENSITIVITY)
    }

    /// Byte 4.
    pub fn availability(&self) -> Option<Availability> {
        self.byte(AVAILABILITY).map(Availability)
    }

    /// Byte 5: what the bits of a measured value mean.
    pub fn measuring_mode(&self) -> Option<MeasuringMode> {
        self.byte(MEASURING_MODE).map(MeasuringMode::from_byte)
    }

    /// Byte 6: unit of the measured values; `None` also for a byte without a meaning.
    pub fn unit(&self) -> Option<Unit> {
        self.byte(UNIT).and_then(Unit::from_byte)
    }

    /// Byte 9: scans in a row that must agree before an output switches.
    pub fn multiple_evaluation(&self) -> Option<u8> {
        self.byte(MULTIPLE_EVALUATION)
    }

    /// Byte 10: restart behavior.
    pub fn restart(&self) -> Option<u8> {
        self.byte(RESTART)
    }

    /// Sets byte 3.
    pub fn set_sensitivity(&mut self, sensitivity: u8) {
        self.set(SENSITIVITY, sensitivity);
    }

    /// Sets byte 4.
    pub fn set_availability(&mut self, availability: Availability) {
        self.set(AVAILABILITY, availability.0);
    }

    /// Sets byte 5.
    pub fn set_measuring_mode(&mut self, mode: MeasuringMode) {
        self.set(MEASURING_MODE, mode.byte());
    }

    /// Sets byte 6.
    pub fn set_unit(&mut self, unit: Unit) {
        self.set(UNIT, unit.byte());
    }
}

#[cfg(test)]
mod tests {
    use super::{Availability, Config};
    use crate::lms::{MeasuringMode, Unit};

    #[test]
    fn a_real_lms_200_block_reads_as_the_listing_says() {
        // As a driver's log shows it for an LMS 200 in 16 m mode, index bytes off.
        let mut bytes = [0; Config::BYTES];
        bytes[..11].copy_from_slice(&[0x00, 0x00, 0x70, 0x00, 0x00, 0x04, 0x01, 0x00, 0x00, 0x02, 0x02]);
        bytes[32] = 0x02;
        let config = Config::from_bytes(&bytes).unwrap();
        assert_eq!(config.threshold_mv(), Some(112));
        assert_eq!(config.measuring_mode(), Some(MeasuringMode::FieldsAb));
        assert_eq!(config.unit(), Some(Unit::Mm));
        assert_eq!(config.availability().map(Availability::index_bytes), Some(false));
        assert_eq!(config.as_bytes(), bytes);
    }

    #[test]
    fn a_short_write_changes_only_its_own_bytes() {
        let written = Config::from_bytes(&[0, 0, 0x46, 0, 2, 1, 0]).unwrap();
        let held = Config::factory().overlaid_with(&written);
        assert_eq!(held.as_bytes().len(), Config::BYTES);
        assert_eq!(&held.as_bytes()[..7], [0, 0, 0x46, 0, 2, 1, 0]);
        assert_eq!(&held.as_bytes()[7..], &Config::FACTORY[7..]);
        assert_eq!(written.multiple_evaluation(), None);
    }

    #[test]
    fn setting_a_field_fills_a_short_block_from_the_factory_setting() {
        let mut config = Config::default();
        config.set_unit(Unit::Cm);
        assert_eq!(config.as_bytes(), [0, 0, 0x46, 0, 0, 0, 0]);
        config.set_availability(Availability(2));
        config.set_measuring_mode(MeasuringMode::FieldA);
        config.set_sensitivity(3);
        assert_eq!(config.as_bytes(), [0, 0, 0x46, 3, 2, 6, 0]);
    }

    #[test]
    fn a_block_that_cannot_be_kept_is_refused() {
        assert!(Config::from_bytes(&[0; Config::MAX_BYTES]).is_ok());
        assert!(Config::from_bytes(&[0; Config::MAX_BYTES + 1]).is_err());
    }
}
