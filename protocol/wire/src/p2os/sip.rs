//! The standard information packet (Pioneer 3 manual, "standard SIP contents").
//!
//! Positions are in the base's own units: x and y count 15 bits around (see [`super::wrap15`]), an angle unit
//! is 2 pi / 4096, and the factors to meters belong to the subclass. Newer bases append fields; they are kept
//! as bytes.

use heapless::Vec;

use super::emit::{self, BODY_OFFSET};
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// Bytes behind the number of sonar readings, at most.
pub const MAX_SIP_EXTRA: usize = 233;

/// Type byte of the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum MotorState {
    /// 31h: no motor power.
    NoPower,
    /// 32h: standing.
    #[default]
    Stopped,
    /// 33h: moving.
    Moving,
}

impl MotorState {
    pub(crate) fn from_kind(kind: u8) -> Option<Self> {
        match kind {
            0x31 => Some(MotorState::NoPower),
            0x32 => Some(MotorState::Stopped),
            0x33 => Some(MotorState::Moving),
            _ => None,
        }
    }

    fn kind(self) -> u8 {
        match self {
            MotorState::NoPower => 0x31,
            MotorState::Stopped => 0x32,
            MotorState::Moving => 0x33,
        }
    }
}

/// One sonar's reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SonarReading {
    /// Which sonar.
    pub index: u8,
    /// Range in device units.
    pub range_raw: u16,
}

/// A standard information packet.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Sip {
    /// Type of the packet.
    pub state: MotorState,
    /// Position forward at start, device units; 15 bits count, the word is kept as sent.
    pub x_raw: u16,
    /// Position to the left, likewise.
    pub y_raw: u16,
    /// Heading, counter-clockwise, 4096 units a turn.
    pub theta_raw: i16,
    /// Left wheel speed in device units (mm/s on most bases).
    pub left_raw: i16,
    /// Right wheel speed.
    pub right_raw: i16,
    /// Battery in tenths of a volt.
    pub battery_dv: u8,
    /// Left stall (bit 0) and bumpers (bits 1-7).
    pub left_bumpers: u8,
    /// Right stall (bit 0) and bumpers (bits 1-7).
    pub right_bumpers: u8,
    /// Heading setpoint, angle units.
    pub control_raw: i16,
    /// Bit 0 motors on, 1-4 sonar banks, 5-6 stop buttons, 7-8 ledge sensors, 9 joystick, 10 charger.
    pub flags: u16,
    /// Compass, 2 degrees a unit.
    pub compass: u8,
    /// Number of sonar readings at the front of [`Sip::extra`].
    pub sonar_count: u8,
    /// Sonar readings (3 bytes each), then whatever the base appends.
    pub extra: Vec<u8, MAX_SIP_EXTRA>,
}

impl Sip {
    pub(crate) fn parse(state: MotorState, data: &[u8]) -> Result<Self, WireError> {
        let mut reader = Reader::new(data, BODY_OFFSET + 1);
        let mut sip = Sip {
            state,
            x_raw: reader.u16()?,
            y_raw: reader.u16()?,
            theta_raw: reader.i16()?,
            left_raw: reader.i16()?,
            right_raw: reader.i16()?,
            battery_dv: reader.u8()?,
            left_bumpers: reader.u8()?,
            right_bumpers: reader.u8()?,
            control_raw: reader.i16()?,
            flags: reader.u16()?,
            compass: reader.u8()?,
            sonar_count: reader.u8()?,
            extra: Vec::new(),
        };
        let (offset, found) = (reader.offset(), reader.remaining());
        let needed = 3 * usize::from(sip.sonar_count);
        if found < needed {
            return Err(WireError::TooShort { needed: offset + needed, found: offset + found });
        }
        let field = "sonar readings and tail";
        sip.extra = Vec::from_slice(reader.rest()).map_err(|_| WireError::Capacity {
            field,
            limit: MAX_SIP_EXTRA,
            found,
            offset,
        })?;
        Ok(sip)
    }

    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(self.state.kind());
        writer.u16(self.x_raw);
        writer.u16(self.y_raw);
        for word in [self.theta_raw, self.left_raw, self.right_raw] {
            writer.i16(word);
        }
        writer.bytes(&[self.battery_dv, self.left_bumpers, self.right_bumpers]);
        writer.i16(self.control_raw);
        writer.u16(self.flags);
        writer.bytes(&[self.compass, self.sonar_count]);
        writer.bytes(&self.extra);
    }

    /// Whether the base says that it moves.
    pub fn motors_moving(&self) -> bool {
        self.state == MotorState::Moving
    }

    /// Flag bit 0: motors enabled.
    pub fn motors_enabled(&self) -> bool {
        self.flags & 1 != 0
    }

    /// A wheel is stalled.
    pub fn stalled(&self) -> bool {
        (self.left_bumpers | self.right_bumpers) & 1 != 0
    }

    /// Sonar readings, as many as there are.
    pub fn sonar(&self) -> impl Iterator<Item = SonarReading> + '_ {
        let (readings, _) = self.extra.as_chunks::<3>();
        let count = usize::from(self.sonar_count);
        readings
            .iter()
            .take(count)
            .map(|&[index, low, high]| SonarReading { index, range_raw: u16::from_le_bytes([low, high]) })
    }

    /// What stands behind the sonar readings: gripper, analog port, analog value, digital in, digital out; on
    /// newer bases battery (word, 0.1 V), charge state, rotation speed and more. Any length, also empty.
    pub fn tail(&self) -> &[u8] {
        self.extra.get(3 * usize::from(self.sonar_count)..).unwrap_or(&[])
    }

    /// Bytes of the whole packet.
    pub fn encoded_len(&self) -> usize {
        emit::framed_len(|writer| self.write(writer))
    }

    /// Writes the whole packet and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        emit::emit(out, |writer| self.write(writer))
    }
}
