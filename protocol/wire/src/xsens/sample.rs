//! What a measurement says of time, turn rates and accelerations.

use super::items::{Item, Items, ItemsWriter};
use super::number::Precision;
use super::quantity;
use crate::WireError;
use crate::cursor::Reader;

/// One measurement, as far as its items go.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Sample {
    /// Count of messages.
    pub packet_counter: Option<u16>,
    /// The moment of the sample, ten-thousandths of a second of the unit's own clock.
    pub time_fine: Option<u32>,
    /// The same, whole seconds.
    pub time_coarse_s: Option<u32>,
    /// With gravity, in the unit's axes.
    pub acceleration_m_s2: Option<[f64; 3]>,
    /// In the unit's axes.
    pub turn_rad_s: Option<[f64; 3]>,
    /// Flags: see [`super::status`].
    pub status_word: Option<u32>,
}

impl Sample {
    /// What these items say; of a quantity that stands there twice, the last.
    ///
    /// # Errors
    /// An item of a known quantity has another length than that quantity.
    pub fn of(items: &Items<'_>) -> Result<Self, WireError> {
        let mut sample = Self::default();
        items.iter().try_for_each(|item| sample.take(&item))?;
        Ok(sample)
    }

    /// Takes over an item; one of a quantity that is not known here is passed over.
    fn take(&mut self, item: &Item<'_>) -> Result<(), WireError> {
        let mut reader = Reader::new(item.bytes, item.offset);
        match item.identifier & quantity::MASK {
            quantity::PACKET_COUNTER => self.packet_counter = Some(reader.be_u16()?),
            quantity::SAMPLE_TIME_FINE => self.time_fine = Some(reader.be_u32()?),
            quantity::SAMPLE_TIME_COARSE => self.time_coarse_s = Some(reader.be_u32()?),
            quantity::ACCELERATION => self.acceleration_m_s2 = Some(three(&mut reader, item)?),
            quantity::RATE_OF_TURN => self.turn_rad_s = Some(three(&mut reader, item)?),
            quantity::STATUS_WORD => self.status_word = Some(reader.be_u32()?),
            _ => return Ok(()),
        }
        reader.end_with(())
    }

    /// Writes what is there, in the order in which units send it.
    ///
    /// # Errors
    /// There is no room.
    pub fn write(&self, precision: Precision, out: &mut ItemsWriter) -> Result<(), WireError> {
        let words = [
            (quantity::SAMPLE_TIME_FINE, self.time_fine),
            (quantity::SAMPLE_TIME_COARSE, self.time_coarse_s),
        ];
        let vectors =
            [(quantity::ACCELERATION, self.acceleration_m_s2), (quantity::RATE_OF_TURN, self.turn_rad_s)];
        if let Some(counter) = self.packet_counter {
            out.push(quantity::PACKET_COUNTER, |writer| writer.bytes(&counter.to_be_bytes()))?;
        }
        for (identifier, word) in words {
            let Some(word) = word else { continue };
            out.push(identifier, |writer| writer.bytes(&word.to_be_bytes()))?;
        }
        for (identifier, vector) in vectors {
            let Some(vector) = vector else { continue };
            out.push(identifier | precision.bits(), |writer| {
                vector.into_iter().for_each(|number| precision.write(number, writer));
            })?;
        }
        if let Some(word) = self.status_word {
            out.push(quantity::STATUS_WORD, |writer| writer.bytes(&word.to_be_bytes()))?;
        }
        Ok(())
    }
}

fn three(reader: &mut Reader<'_>, item: &Item<'_>) -> Result<[f64; 3], WireError> {
    let precision = Precision::of(item.identifier);
    Ok([precision.read(reader)?, precision.read(reader)?, precision.read(reader)?])
}
