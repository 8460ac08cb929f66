//! What the rig asks of a laser's configuration, and what is to be written for it: nothing where nothing
//! differs, and nothing that was not asked for, because each write wears the EEPROM.

use std::fmt;

use biplane_wire::lms::{Availability, Config, MeasuringMode, Unit};

use crate::session::lms::setup::settings::LaserSettings;

/// Bit 0 of the availability byte: goes on measuring when dazzled.
const DAZZLE_TOLERANT: u8 = 0x01;
/// Bit 1 of the availability byte: index bytes.
const INDEX_BYTES: u8 = 0x02;

/// What differs between a configuration and what the rig asks: as it is, as it shall be.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct ConfigChange {
    /// Unit of the measured values; `None` where the present one has no meaning.
    pub unit: Option<(Option<Unit>, Unit)>,
    /// Measuring mode.
    pub mode: Option<(MeasuringMode, MeasuringMode)>,
    /// Availability byte.
    pub availability: Option<(u8, u8)>,
}

impl ConfigChange {
    /// Whether nothing differs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What differs between a device's configuration and the rig.
    #[must_use]
    pub fn between(config: &Config, settings: &LaserSettings, is_s14: bool) -> Self {
        let unit = (config.unit() != Some(settings.unit)).then_some((config.unit(), settings.unit));
        let mode = config.measuring_mode().unwrap_or_default();
        let wanted = wanted_mode(mode, settings, is_s14);
        let availability = config.availability().map_or(0, |availability| availability.0);
        let asked = with_bit(availability, DAZZLE_TOLERANT, settings.dazzle_tolerant);
        let asked = with_bit(asked, INDEX_BYTES, settings.index_bytes);
        Self {
            unit,
            mode: (wanted != mode).then_some((mode, wanted)),
            availability: (asked != availability).then_some((availability, asked)),
        }
    }

    /// The configuration with what differs as it shall be; as long as it was.
    #[must_use]
    pub fn applied_to(&self, config: &Config) -> Config {
        let mut config = config.clone();
        if let Some((_, availability)) = self.availability {
            config.set_availability(Availability(availability));
        }
        if let Some((_, mode)) = self.mode {
            config.set_measuring_mode(mode);
        }
        if let Some((_, unit)) = self.unit {
            config.set_unit(unit);
        }
        config
    }
}

/// The mode in force where it will do: among those of one number of bits, the flags are the owner's choice.
fn wanted_mode(mode: MeasuringMode, settings: &LaserSettings, is_s14: bool) -> MeasuringMode {
    // Two drivers in the field ask an LMS for remission in these modes only; an S14 sends it in any.
    if settings.remission && !is_s14 {
        let has_remission = matches!(mode, MeasuringMode::NormalizedRemission | MeasuringMode::RawRemission);
        return if has_remission { mode } else { MeasuringMode::NormalizedRemission };
    }
    let (bits, plain) = match settings.range_max_m {
        None => return mode,
        Some(8 | 80) => (13, MeasuringMode::FieldsAbDazzle),
        Some(16 | 160) => (14, MeasuringMode::FieldsAb),
        Some(_) => (15, MeasuringMode::FieldA),
    };
    if mode.range_bits() == Some(bits) { mode } else { plain }
}

fn with_bit(byte: u8, bit: u8, asked: Option<bool>) -> u8 {
    match asked {
        None => byte,
        Some(true) => byte | bit,
        Some(false) => byte & !bit,
    }
}

impl fmt::Display for ConfigChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut gap = "";
        if let Some((is, asked)) = self.unit {
            match is {
                Some(is) => write!(f, "units {asked} instead of {is}")?,
                None => write!(f, "units {asked}")?,
            }
            gap = ", ";
        }
        if let Some((is, asked)) = self.mode {
            write!(f, "{gap}{asked} instead of {:02X}h", is.byte())?;
            gap = ", ";
        }
        if let Some((is, asked)) = self.availability {
            write!(f, "{gap}availability {asked:02X}h instead of {is:02X}h")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::lms::tests::HALF as CM;

    /// The bytes of a configuration after what differs is changed; the first eight are compared.
    fn changed(bytes: &[u8], settings: LaserSettings, is_s14: bool) -> (Vec<u8>, String) {
        let config = Config::from_bytes(bytes).unwrap();
        let change = ConfigChange::between(&config, &settings, is_s14);
        (change.applied_to(&config).as_bytes().to_vec(), change.to_string())
    }

    #[test]
    fn only_what_is_asked_for_is_changed() {
        let block = [0, 0, 70, 3, 0x04, 0x01, 0x01, 9];
        let mm = LaserSettings { unit: Unit::Mm, ..CM };
        let table: [(LaserSettings, bool, [u8; 3], &str); 9] = [
            (mm, false, [0x04, 0x01, 1], ""),
            (CM, false, [0x04, 0x01, 0], "units cm instead of mm"),
            (
                LaserSettings { index_bytes: Some(true), ..mm },
                false,
                [0x06, 0x01, 1],
                "availability 06h instead of 04h",
            ),
            (LaserSettings { index_bytes: Some(false), ..mm }, false, [0x04, 0x01, 1], ""),
            (
                LaserSettings { dazzle_tolerant: Some(true), ..mm },
                false,
                [0x05, 0x01, 1],
                "availability 05h instead of 04h",
            ),
            (LaserSettings { range_max_m: Some(8), ..mm }, false, [0x04, 0x01, 1], ""),
            (
                LaserSettings { range_max_m: Some(16), ..mm },
                false,
                [0x04, 0x04, 1],
                "measuring mode 04h (14 bits of range, fields A and B) instead of 01h",
            ),
            (
                LaserSettings { remission: true, ..mm },
                false,
                [0x04, 0x0D, 1],
                "measuring mode 0Dh (13 bits of range, normalized remission) instead of 01h",
            ),
            (LaserSettings { remission: true, ..mm }, true, [0x04, 0x01, 1], ""),
        ];
        for (settings, is_s14, [availability, mode, unit], words) in table {
            let (bytes, reported) = changed(&block, settings, is_s14);
            assert_eq!(bytes, [0, 0, 70, 3, availability, mode, unit, 9], "{settings:?}");
            assert_eq!(reported, words);
        }
    }

    #[test]
    fn a_mode_with_remission_of_either_kind_will_do() {
        let settings = LaserSettings { remission: true, ..CM };
        for mode in [0x0D, 0x0E] {
            let (bytes, reported) = changed(&[0, 0, 70, 0, 0, mode, 0], settings, false);
            assert_eq!((bytes[5], reported.as_str()), (mode, ""));
        }
    }

    #[test]
    fn each_range_has_its_bits_in_both_units() {
        for (ranges, mode) in [([8, 80], 0x00), ([16, 160], 0x04), ([32, 320], 0x06)] {
            for range_max_m in ranges {
                let settings = LaserSettings { range_max_m: Some(range_max_m), ..CM };
                assert_eq!(changed(&[0, 0, 0, 0, 0, 0x3F, 0], settings, false).0[5], mode, "{range_max_m}");
            }
        }
    }

    #[test]
    fn an_old_firmware_s_shorter_block_keeps_its_length() {
        let settings = LaserSettings { unit: Unit::Mm, ..CM };
        assert_eq!(changed(&[0; 32], settings, false).0.len(), 32);
        assert_eq!(changed(&[0; 7], settings, false).0, [0, 0, 0, 0, 0, 0, 1]);
    }
}
