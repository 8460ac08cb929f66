//! The four ways in which a unit writes numbers.

use crate::WireError;
use crate::cursor::{Reader, Writer};

/// How numbers are written: bits 0 and 1 of an item's identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Precision {
    /// IEEE 754, 32 bits.
    #[default]
    Float32,
    /// Fixed point, 12 bits in front of the point and 20 behind it.
    Fp1220,
    /// Fixed point, 16 bits in front of the point and 32 behind it; the latter stand first.
    Fp1632,
    /// IEEE 754, 64 bits.
    Float64,
}

const ONE_1220: f64 = (1 << 20) as f64;
const ONE_1632: f64 = (1_u64 << 32) as f64;

impl Precision {
    /// All of them, in the order of their bits.
    pub const ALL: [Self; 4] = [Self::Float32, Self::Fp1220, Self::Fp1632, Self::Float64];

    /// That of an item with this identifier.
    pub fn of(identifier: u16) -> Self {
        match identifier & 0b11 {
            0 => Self::Float32,
            1 => Self::Fp1220,
            2 => Self::Fp1632,
            _ => Self::Float64,
        }
    }

    /// Its bits in an identifier.
    pub const fn bits(self) -> u16 {
        match self {
            Self::Float32 => 0,
            Self::Fp1220 => 1,
            Self::Fp1632 => 2,
            Self::Float64 => 3,
        }
    }

    /// Bytes of a number.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Float32 | Self::Fp1220 => 4,
            Self::Fp1632 => 6,
            Self::Float64 => 8,
        }
    }

    pub(super) fn read(self, reader: &mut Reader<'_>) -> Result<f64, WireError> {
        Ok(match self {
            Self::Float32 => f64::from(f32::from_be_bytes(reader.array()?)),
            Self::Fp1220 => f64::from(reader.be_i32()?) / ONE_1220,
            Self::Fp1632 => {
                let fraction = reader.be_u32()?;
                let whole = i16::from_be_bytes(reader.array()?);
                f64::from(whole) + f64::from(fraction) / ONE_1632
            }
            Self::Float64 => f64::from_be_bytes(reader.array()?),
        })
    }

    /// Writes the nearest number that there is; fixed points end at their largest and smallest.
    pub(super) fn write(self, number: f64, writer: &mut Writer<'_>) {
        match self {
            Self::Float32 => writer.bytes(&(number as f32).to_be_bytes()),
            Self::Fp1220 => writer.bytes(&(nearest(number * ONE_1220) as i32).to_be_bytes()),
            Self::Fp1632 => {
                let limit = 1_i64 << 47;
                let counts = (nearest(number * ONE_1632) as i64).clamp(-limit, limit - 1);
                writer.bytes(&(counts as u32).to_be_bytes());
                writer.bytes(&((counts >> 32) as i16).to_be_bytes());
            }
            Self::Float64 => writer.bytes(&number.to_be_bytes()),
        }
    }
}

/// Half away from zero; a cast cuts the rest off.
fn nearest(number: f64) -> f64 {
    if number < 0.0 { number - 0.5 } else { number + 0.5 }
}
