//! What the 16 bits of a measured value mean (telegram listing, configuration block D).
//!
//! The measuring mode of the configuration divides a value word into a range and flags. The top of the
//! range's bits is kept for codes that say why there is no range; the same raw numbers in centimeters and
//! millimeters.

/// How value words are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum MeasuringMode {
    /// 00: 13 bits of range, fields A and B, dazzle. The default.
    #[default]
    FieldsAbDazzle,
    /// 01: 13 bits, reflector level 0 to 7.
    Reflector8,
    /// 02: 13 bits, fields A, B and C.
    FieldsAbc,
    /// 03: 14 bits, reflector level 0 to 3.
    Reflector4,
    /// 04: 14 bits, fields A and B.
    FieldsAb,
    /// 05: 15 bits, reflector yes or no.
    Reflector2,
    /// 06: 15 bits, field A.
    FieldA,
    /// 0D: 13 bits, 8 or 80 m with normalized remission.
    NormalizedRemission,
    /// 0E: 13 bits, 8 or 80 m with raw remission.
    RawRemission,
    /// 0F: 16 bits of range, no flags.
    Immediate,
    /// 3F: energy instead of range.
    Energy,
    /// A mode that the listing does not name.
    Other(u8),
}

impl MeasuringMode {
    /// All modes that have a name.
    pub const ALL: [MeasuringMode; 11] = [
        MeasuringMode::FieldsAbDazzle,
        MeasuringMode::Reflector8,
        MeasuringMode::FieldsAbc,
        MeasuringMode::Reflector4,
        MeasuringMode::FieldsAb,
        MeasuringMode::Reflector2,
        MeasuringMode::FieldA,
        MeasuringMode::NormalizedRemission,
        MeasuringMode::RawRemission,
        MeasuringMode::Immediate,
        MeasuringMode::Energy,
    ];

    /// The mode of a configuration byte.
    pub fn from_byte(byte: u8) -> Self {
        Self::ALL.into_iter().find(|mode| mode.byte() == byte).unwrap_or(MeasuringMode::Other(byte))
    }

    /// The configuration byte.
    pub const fn byte(self) -> u8 {
        match self {
            MeasuringMode::FieldsAbDazzle => 0x00,
            MeasuringMode::Reflector8 => 0x01,
            MeasuringMode::FieldsAbc => 0x02,
            MeasuringMode::Reflector4 => 0x03,
            MeasuringMode::FieldsAb => 0x04,
            MeasuringMode::Reflector2 => 0x05,
            MeasuringMode::FieldA => 0x06,
            MeasuringMode::NormalizedRemission => 0x0D,
            MeasuringMode::RawRemission => 0x0E,
            MeasuringMode::Immediate => 0x0F,
            MeasuringMode::Energy => 0x3F,
            MeasuringMode::Other(byte) => byte,
        }
    }

    /// Bits that hold the range; `None` when the words are no ranges, or unknown.
    pub const fn range_bits(self) -> Option<u32> {
        match self {
            MeasuringMode::FieldsAbDazzle
            | MeasuringMode::Reflector8
            | MeasuringMode::FieldsAbc
            | MeasuringMode::NormalizedRemission
            | MeasuringMode::RawRemission => Some(13),
            MeasuringMode::Reflector4 | MeasuringMode::FieldsAb => Some(14),
            MeasuringMode::Reflector2 | MeasuringMode::FieldA => Some(15),
            MeasuringMode::Immediate => Some(16),
            MeasuringMode::Energy | MeasuringMode::Other(_) => None,
        }
    }

    /// Largest range in device units: 8182, 16374, 32758. `None` as in [`MeasuringMode::range_bits`].
    pub const fn max_range(self) -> Option<u16> {
        match self.range_bits() {
            Some(bits) => Some(top(bits) - FIRST_CODE_BELOW_TOP - 1),
            None => None,
        }
    }
}

/// Largest number of that many bits.
const fn top(bits: u32) -> u16 {
    u16::MAX >> (16 - bits)
}

/// The lowest code, "beyond the maximum range", stands this far below the top: 8183, 16375, 32759.
const FIRST_CODE_BELOW_TOP: u16 = 8;

/// What a value word says about the distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Value {
    /// A distance in device units (see [`crate::lms::Unit`]).
    Range(u16),
    /// No echo came back (8191, 16383, 32767).
    NoEcho,
    /// The receiver was dazzled (8190 ...).
    Dazzled,
    /// Arithmetic overflow (8189 ...).
    Overflow,
    /// The signal was too small against the noise (8187 ...).
    LowSignal,
    /// Channel 1 could not be read (8186 ...).
    ReadError,
    /// An echo beyond the largest range (8183, 16375, 32759).
    BeyondRange,
    /// One of the codes between these, which the listing does not name: the range bits.
    Reserved(u16),
    /// Energy of the echo, not a range.
    Energy(u16),
    /// A word in a mode whose meaning is not known.
    Undefined(u16),
}

/// The flag bits of a value word. Flags that the mode does not have are false or 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Flags {
    /// In field A.
    pub field_a: bool,
    /// In field B.
    pub field_b: bool,
    /// In field C.
    pub field_c: bool,
    /// Dazzled.
    pub dazzle: bool,
    /// Reflector level, 0 = none; up to 7, 3 or 1 by mode.
    pub reflector: u8,
}

/// A value word, taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Measurement {
    /// What it says about the distance.
    pub value: Value,
    /// What it says besides.
    pub flags: Flags,
}

/// Takes a value word apart.
#[inline]
pub fn decode(raw: u16, mode: MeasuringMode) -> Measurement {
    let Some(bits) = mode.range_bits() else {
        let value = match mode {
            MeasuringMode::Energy => Value::Energy(raw),
            _ => Value::Undefined(raw),
        };
        return Measurement { value, flags: Flags::default() };
    };
    let top = top(bits);
    let range = raw & top;
    let value = match top - range {
        0 => Value::NoEcho,
        1 => Value::Dazzled,
        2 => Value::Overflow,
        4 => Value::LowSignal,
        5 => Value::ReadError,
        8 => Value::BeyondRange,
        3 | 6 | 7 => Value::Reserved(range),
        _ => Value::Range(range),
    };
    Measurement { value, flags: Flags::from_bits(u32::from(raw) >> bits, mode) }
}

/// Puts a value word together; `None` when it cannot be said in this mode: a range above
/// [`MeasuringMode::max_range`], or a flag that the mode does not have.
pub fn encode(measurement: Measurement, mode: MeasuringMode) -> Option<u16> {
    let Some(bits) = mode.range_bits() else {
        return match (measurement.value, mode) {
            (Value::Energy(raw), MeasuringMode::Energy) => Some(raw),
            (Value::Undefined(raw), MeasuringMode::Other(_)) => Some(raw),
            _ => None,
        };
    };
    let top = top(bits);
    let range = match measurement.value {
        Value::Range(range) if Some(range) <= mode.max_range() => range,
        Value::NoEcho => top,
        Value::Dazzled => top - 1,
        Value::Overflow => top - 2,
        Value::LowSignal => top - 4,
        Value::ReadError => top - 5,
        Value::BeyondRange => top - FIRST_CODE_BELOW_TOP,
        Value::Reserved(code) if code <= top && matches!(top - code, 3 | 6 | 7) => code,
        Value::Range(_) | Value::Reserved(_) | Value::Energy(_) | Value::Undefined(_) => return None,
    };
    let word = u32::from(range) | measurement.flags.to_bits(mode)? << bits;
    u16::try_from(word).ok()
}

impl Flags {
    /// `bits` are those above the range, shifted down.
    #[inline]
    fn from_bits(bits: u32, mode: MeasuringMode) -> Self {
        let bit = |index: u32| bits >> index & 1 == 1;
        let none = Flags::default();
        match mode {
            MeasuringMode::FieldsAbDazzle => {
                Flags { field_a: bit(0), field_b: bit(1), dazzle: bit(2), ..none }
            }
            MeasuringMode::FieldsAbc => Flags { field_a: bit(0), field_b: bit(1), field_c: bit(2), ..none },
            MeasuringMode::FieldsAb => Flags { field_a: bit(0), field_b: bit(1), ..none },
            MeasuringMode::FieldA => Flags { field_a: bit(0), ..none },
            MeasuringMode::Reflector8 | MeasuringMode::Reflector4 | MeasuringMode::Reflector2 => {
                Flags { reflector: bits as u8, ..none }
            }
            _ => none,
        }
    }

    /// The reverse; `None` when a flag is set that the mode does not have.
    fn to_bits(self, mode: MeasuringMode) -> Option<u32> {
        let fields = u32::from(self.field_a) | u32::from(self.field_b) << 1;
        let bits = match mode {
            MeasuringMode::FieldsAbDazzle => fields | u32::from(self.dazzle) << 2,
            MeasuringMode::FieldsAbc => fields | u32::from(self.field_c) << 2,
            MeasuringMode::FieldsAb => fields,
            MeasuringMode::FieldA => u32::from(self.field_a),
            MeasuringMode::Reflector8 | MeasuringMode::Reflector4 | MeasuringMode::Reflector2 => {
                u32::from(self.reflector)
            }
            _ => 0,
        };
        (Flags::from_bits(bits, mode) == self).then_some(bits)
    }
}

#[cfg(test)]
mod tests {
    use super::{Flags, Measurement, MeasuringMode, Value, decode, encode};

    #[test]
    fn codes_are_told_apart_in_13_14_15_and_16_bits() {
        let table = [
            ([8191, 16383, 32767, 65535], Value::NoEcho),
            ([8190, 16382, 32766, 65534], Value::Dazzled),
            ([8189, 16381, 32765, 65533], Value::Overflow),
            ([8187, 16379, 32763, 65531], Value::LowSignal),
            ([8186, 16378, 32762, 65530], Value::ReadError),
            ([8183, 16375, 32759, 65527], Value::BeyondRange),
        ];
        let modes = [
            MeasuringMode::FieldsAbDazzle,
            MeasuringMode::FieldsAb,
            MeasuringMode::FieldA,
            MeasuringMode::Immediate,
        ];
        for (words, value) in table {
            for (word, mode) in words.into_iter().zip(modes) {
                assert_eq!(decode(word, mode), Measurement { value, flags: Flags::default() });
            }
        }
        for (word, mode) in [8182, 16374, 32758, 65526].into_iter().zip(modes) {
            assert_eq!(decode(word, mode).value, Value::Range(word));
            assert_eq!(mode.max_range(), Some(word));
        }
        assert_eq!(decode(8188, modes[0]).value, Value::Reserved(8188));
    }

    #[test]
    fn flags_stand_above_the_range() {
        let flags = |raw, mode| {
            let measurement = decode(raw, mode);
            assert_eq!(measurement.value, Value::Range(100));
            measurement.flags
        };
        let none = Flags::default();
        let all = MeasuringMode::FieldsAbDazzle;
        assert_eq!(flags(0x2000 | 100, all), Flags { field_a: true, ..none });
        assert_eq!(flags(0x4000 | 100, all), Flags { field_b: true, ..none });
        assert_eq!(flags(0x8000 | 100, all), Flags { dazzle: true, ..none });
        assert_eq!(flags(0x8000 | 100, MeasuringMode::FieldsAbc), Flags { field_c: true, ..none });
        assert_eq!(flags(0xC000 | 100, MeasuringMode::Reflector8), Flags { reflector: 6, ..none });
        assert_eq!(flags(0xC000 | 100, MeasuringMode::Reflector4), Flags { reflector: 3, ..none });
        assert_eq!(flags(0x8000 | 100, MeasuringMode::FieldsAb), Flags { field_b: true, ..none });
        assert_eq!(flags(0x8000 | 100, MeasuringMode::Reflector2), Flags { reflector: 1, ..none });
        assert_eq!(flags(0x8000 | 100, MeasuringMode::FieldA), Flags { field_a: true, ..none });
    }

    #[test]
    fn every_word_of_every_mode_comes_back() {
        for mode in MeasuringMode::ALL.into_iter().chain([MeasuringMode::Other(0x20)]) {
            let unused = match mode {
                MeasuringMode::NormalizedRemission | MeasuringMode::RawRemission => 0xE000,
                _ => 0,
            };
            for raw in 0..=u16::MAX {
                assert_eq!(encode(decode(raw, mode), mode), Some(raw & !unused), "{mode:?} {raw:04X}");
            }
        }
    }

    #[test]
    fn what_a_mode_cannot_say_is_refused() {
        let measurement = |value, flags| Measurement { value, flags };
        let none = Flags::default();
        let mode = MeasuringMode::FieldsAb;
        assert_eq!(encode(measurement(Value::Range(16_375), none), mode), None);
        assert_eq!(encode(measurement(Value::Range(5), Flags { dazzle: true, ..none }), mode), None);
        assert_eq!(encode(measurement(Value::Range(5), Flags { reflector: 1, ..none }), mode), None);
        assert_eq!(encode(measurement(Value::Energy(5), none), mode), None);
        assert_eq!(encode(measurement(Value::Reserved(5), none), mode), None);
        let reflector = Flags { reflector: 4, ..none };
        assert_eq!(encode(measurement(Value::Range(5), reflector), MeasuringMode::Reflector4), None);
    }

    #[test]
    fn every_mode_byte_comes_back() {
        for byte in 0..=255 {
            assert_eq!(MeasuringMode::from_byte(byte).byte(), byte);
        }
        assert_eq!(MeasuringMode::from_byte(4), MeasuringMode::FieldsAb);
    }
}
