//! What a host commands (Pioneer 3 manual, "client commands").
//!
//! A body is the command's number and at most one argument: `3B` + word, `1B` + word for its negative, or
//! `2B` + length + bytes.

use heapless::Vec;

use super::emit;
use crate::WireError;
use crate::cursor::Writer;

/// Bytes of a body behind the command's number, at most.
pub const MAX_ARGUMENT_BYTES: usize = 252;

const POSITIVE: u8 = 0x3B;
const NEGATIVE: u8 = 0x1B;
const STRING: u8 = 0x2B;

/// Numbers of the commands that a host may meet.
pub mod number {
    /// Nothing but a sign of life.
    pub const PULSE: u8 = 0;
    /// Starts the information packets.
    pub const OPEN: u8 = 1;
    /// Ends the session.
    pub const CLOSE: u8 = 2;
    /// Motors on or off.
    pub const ENABLE: u8 = 4;
    /// Sets the odometry to zero.
    pub const SETO: u8 = 7;
    /// Translation speed in mm/s.
    pub const VEL: u8 = 11;
    /// Asks for the configuration.
    pub const CONFIG: u8 = 18;
    /// Encoder packets: 0 stop, 1 one, 2 stream.
    pub const ENCODER: u8 = 19;
    /// Rotation speed in deg/s, positive counter-clockwise.
    pub const RVEL: u8 = 21;
    /// Sonars on or off.
    pub const SONAR: u8 = 28;
    /// Stops the motors.
    pub const STOP: u8 = 29;
    /// Line rate: 0 to 4 = 9600, 19 200, 38 400, 57 600, 115 200.
    pub const HOSTBAUD: u8 = 50;
}

/// A command. The three steps of opening look like [`Command::Pulse`], [`Command::Open`] and
/// [`Command::Close`] on the line; which is meant, only the base's state tells. Reading gives the latter
/// three.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(clippy::large_enum_variant)] // there is no heap to put the raw form on
pub enum Command {
    /// SYNC0, SYNC1, SYNC2: `Sync(0)` to `Sync(2)`.
    Sync(u8),
    /// OPEN without an argument.
    Open,
    /// CLOSE without an argument.
    Close,
    /// PULSE: keeps the base awake, commands nothing.
    Pulse,
    /// ENABLE: motors on or off.
    Enable(bool),
    /// STOP: to standstill.
    Stop,
    /// SETO: the base's odometry becomes 0, 0, 0.
    SetOrigin,
    /// SONAR: on or off.
    Sonar(bool),
    /// CONFIG 1: asks for the configuration packet.
    Config,
    /// ENCODER: 0 stop, 1 one packet, 2 stream.
    Encoder(u8),
    /// VEL: translation speed.
    Velocity {
        /// Millimeters per second, forward positive.
        mm_s: i16,
    },
    /// RVEL: rotation speed.
    RotationVelocity {
        /// Degrees per second, counter-clockwise positive.
        deg_s: i16,
    },
    /// HOSTBAUD: 0 to 4 = 9600, 19 200, 38 400, 57 600, 115 200.
    HostBaud(u8),
    /// Any other command or form, as sent.
    Raw(RawCommand),
}

/// A command as sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawCommand {
    /// First byte of the body.
    pub number: u8,
    /// The rest of the body.
    pub rest: Vec<u8, MAX_ARGUMENT_BYTES>,
}

/// The argument of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument<'a> {
    /// None.
    None,
    /// A number, -65535 to 65535.
    Int(i32),
    /// A string of bytes.
    Bytes(&'a [u8]),
    /// Bytes that are no argument, such as a type without a value. Real drivers send them.
    Malformed(&'a [u8]),
}

impl<'a> Argument<'a> {
    /// Reads what stands behind the command's number.
    pub fn parse(rest: &'a [u8]) -> Self {
        match *rest {
            [] => Argument::None,
            [POSITIVE, low, high] => Argument::Int(i32::from(u16::from_le_bytes([low, high]))),
            [NEGATIVE, low, high] => Argument::Int(-i32::from(u16::from_le_bytes([low, high]))),
            [STRING, length, ref bytes @ ..] if bytes.len() == usize::from(length) => Argument::Bytes(bytes),
            _ => Argument::Malformed(rest),
        }
    }
}

impl Command {
    pub(crate) fn parse(number: u8, rest: &[u8]) -> Self {
        use Argument::{Int, None};
        let command = match (number, Argument::parse(rest)) {
            (number::PULSE, None) => Command::Pulse,
            (number::OPEN, None) => Command::Open,
            (number::CLOSE, None) => Command::Close,
            (number::ENABLE, Int(on @ (0 | 1))) => Command::Enable(on == 1),
            (number::STOP, None) => Command::Stop,
            (number::SETO, None) => Command::SetOrigin,
            (number::SONAR, Int(on @ (0 | 1))) => Command::Sonar(on == 1),
            (number::CONFIG, Int(1)) => Command::Config,
            (number::ENCODER, Int(how @ 0..=255)) => Command::Encoder(how as u8),
            (number::VEL, Int(speed)) => match i16::try_from(speed) {
                Ok(mm_s) => Command::Velocity { mm_s },
                Err(_) => Command::raw(number, rest),
            },
            (number::RVEL, Int(speed)) => match i16::try_from(speed) {
                Ok(deg_s) => Command::RotationVelocity { deg_s },
                Err(_) => Command::raw(number, rest),
            },
            (number::HOSTBAUD, Int(rate @ 0..=255)) => Command::HostBaud(rate as u8),
            _ => return Command::raw(number, rest),
        };
        // A negative zero means the same but is other bytes.
        if rest == [NEGATIVE, 0, 0] { Command::raw(number, rest) } else { command }
    }

    fn raw(number: u8, rest: &[u8]) -> Self {
        let kept = rest.get(..MAX_ARGUMENT_BYTES).unwrap_or(rest);
        Command::Raw(RawCommand { number, rest: Vec::from_slice(kept).unwrap_or_default() })
    }

    /// A command with a number as its argument, for those without a form of their own. Beyond -65535 to 65535
    /// the value is held at that limit.
    pub fn with_int(number: u8, value: i32) -> Self {
        Command::raw(number, &int_argument(value))
    }

    /// The command's number: what a base acts on, whatever the form.
    pub fn number(&self) -> u8 {
        match self {
            Command::Sync(step) => *step,
            Command::Pulse => number::PULSE,
            Command::Open => number::OPEN,
            Command::Close => number::CLOSE,
            Command::Enable(_) => number::ENABLE,
            Command::Stop => number::STOP,
            Command::SetOrigin => number::SETO,
            Command::Sonar(_) => number::SONAR,
            Command::Config => number::CONFIG,
            Command::Encoder(_) => number::ENCODER,
            Command::Velocity { .. } => number::VEL,
            Command::RotationVelocity { .. } => number::RVEL,
            Command::HostBaud(_) => number::HOSTBAUD,
            Command::Raw(raw) => raw.number,
        }
    }

    /// The command's argument, whatever the form.
    pub fn argument(&self) -> Argument<'_> {
        match self {
            Command::Raw(raw) => Argument::parse(&raw.rest),
            other => other.int().map_or(Argument::None, Argument::Int),
        }
    }

    fn int(&self) -> Option<i32> {
        match self {
            Command::Enable(on) | Command::Sonar(on) => Some(i32::from(*on)),
            Command::Config => Some(1),
            Command::Encoder(value) | Command::HostBaud(value) => Some(i32::from(*value)),
            Command::Velocity { mm_s } => Some(i32::from(*mm_s)),
            Command::RotationVelocity { deg_s } => Some(i32::from(*deg_s)),
            _ => None,
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(self.number());
        if let Command::Raw(raw) = self {
            writer.bytes(&raw.rest);
        } else if let Some(value) = self.int() {
            writer.bytes(&int_argument(value));
        }
    }

    /// Bytes of the whole packet.
    pub fn encoded_len(&self) -> usize {
        emit::framed_len(|writer| self.write(writer))
    }

    /// Writes the whole packet and returns its length.
    ///
    /// # Errors
    /// `out` is too small, or the command is a `Sync` that does not exist.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        if let Command::Sync(step @ 3..) = self {
            let field = "step of opening";
            return Err(WireError::Value { field, found: u32::from(*step), offset: emit::BODY_OFFSET });
        }
        emit::emit(out, |writer| self.write(writer))
    }
}

fn int_argument(value: i32) -> [u8; 3] {
    let kind = if value < 0 { NEGATIVE } else { POSITIVE };
    let [low, high] = u16::try_from(value.unsigned_abs()).unwrap_or(u16::MAX).to_le_bytes();
    [kind, low, high]
}
