//! Messages of a bag as structs, whichever encoding and layout they came in.

pub(crate) mod multi_echo;
pub(crate) mod odometry;
pub(crate) mod scans;

use biplane_recording::CdrError;
use biplane_recording::messages::cdr::Decoder;
use biplane_recording::messages::{Imu, LaserScan, Message, Odometry, TfMessage};

use super::container::{Encoding, Kind, RawMessage};
use super::options::Echo;

/// A message.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "one at a time passes by")]
pub(crate) enum BagMessage {
    Scan {
        scan: LaserScan,
        /// Beams that came back more than once, of a device that tells.
        several_echoes: Option<usize>,
    },
    Odometry(Odometry),
    Tf(TfMessage),
    Imu(Imu),
    Other,
}

impl BagMessage {
    /// Of the bytes in a bag.
    pub(crate) fn decode(raw: &RawMessage<'_>, echo: Echo) -> Result<Self, CdrError> {
        let mut decoder = match raw.channel.encoding {
            Encoding::Ros1 => Decoder::ros1(raw.bytes),
            Encoding::Cdr if raw.channel.kind == Kind::Other => return Ok(Self::Other),
            Encoding::Cdr => Decoder::new(raw.bytes)?,
        };
        let message = match raw.channel.kind {
            Kind::Scan => Self::Scan { scan: LaserScan::read(&mut decoder)?, several_echoes: None },
            Kind::MultiEchoScan => {
                let (scan, several) = multi_echo::read(&mut decoder, echo)?;
                Self::Scan { scan, several_echoes: Some(several) }
            }
            Kind::Odometry => Self::Odometry(Odometry::read(&mut decoder)?),
            Kind::Tf => Self::Tf(TfMessage::read(&mut decoder)?),
            Kind::Imu => Self::Imu(Imu::read(&mut decoder)?),
            Kind::Other => return Ok(Self::Other),
        };
        decoder.finish()?;
        Ok(message)
    }
}
