//! `LMDscandata`: a scan with its counters and times, one block of values a channel.

use heapless::Vec;

use super::fields::{FieldWriter, Fields};
use super::telegram::{Dialect, Telegram};
use crate::WireError;

/// Channels that a scan can have: five echoes, each with its remission.
pub const MAX_CHANNELS: usize = 10;
/// Encoders that a scan can have.
pub const MAX_ENCODERS: usize = 4;

/// What stands in front of the channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Head {
    /// Of the layout; 0 and 1 are the same.
    pub version: u16,
    /// Number of the device.
    pub device: u16,
    /// Serial number.
    pub serial: u32,
    /// Bits: 1 error, 2 pollution warning, 4 pollution error. The low byte first.
    pub status: [u8; 2],
    /// Counts telegrams, and wraps.
    pub telegram_counter: u16,
    /// Counts scans, and wraps; restarts when the device begins to measure.
    pub scan_counter: u16,
    /// Time since power-on of the scan, in us; wraps after 71.6 minutes. Which moment of the scan it is
    /// differs from family to family.
    pub scan_us: u32,
    /// Time since power-on of the transmission, in us.
    pub sent_us: u32,
    /// Digital inputs, the low byte first.
    pub inputs: [u8; 2],
    /// Digital outputs, the low byte first.
    pub outputs: [u8; 2],
    /// Angle of the layer; 0 with one layer.
    pub layer_angle: u16,
    /// Scans a second, in 1/100 Hz, as set: the true rate is some parts in a thousand off.
    pub scan_frequency_chz: u32,
    /// Shots a second, in 100 Hz; of no use where several are averaged.
    pub shot_frequency_100hz: u32,
}

/// An encoder's count at the scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Encoder {
    /// Counts.
    pub position: u32,
    /// Counts a time.
    pub speed: u16,
}

/// Bits of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Width {
    /// 8.
    Byte,
    /// 16.
    Word,
}

/// Values of a channel, as they came or to be sent.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Of a telegram.
    Received {
        /// How they are written.
        dialect: Dialect,
        /// Their bits.
        width: Width,
        /// How many.
        count: u16,
        /// Their bytes or text.
        bytes: &'a [u8],
    },
    /// To be sent.
    Numbers(&'a [u16]),
}

impl<'a> Values<'a> {
    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Received { count, .. } => usize::from(*count),
            Self::Numbers(numbers) => numbers.len(),
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One by one.
    pub fn iter(&self) -> impl Iterator<Item = u16> + 'a {
        let (mut fields, width, numbers): (_, _, &[u16]) = match *self {
            Self::Received { dialect, width, bytes, .. } => (Fields::new(dialect, bytes, 0), width, &[]),
            Self::Numbers(numbers) => (Fields::new(Dialect::B, &[], 0), Width::Word, numbers),
        };
        // In text the blank in front of the first one belongs to them.
        if fields.dialect() == Dialect::A && !fields.is_over() {
            let _ = fields.text(0);
        }
        let count = self.len();
        (0..count).map(move |place| match (numbers.get(place), width) {
            (Some(&number), _) => number,
            (None, Width::Byte) => fields.u8("value").map_or(0, u16::from),
            (None, Width::Word) => fields.u16("value").unwrap_or(0),
        })
    }
}

impl PartialEq for Values<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

/// One channel: ranges or remissions of all beams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel<'a> {
    /// `DIST1` to `DIST5` ranges by echo, `RSSI1` to `RSSI5` their remissions; others exist.
    pub name: [u8; 5],
    /// A range is a value times this, in mm.
    pub scale: f32,
    /// Added to a range; 0 in all captures, its unit is disputed.
    pub offset: f32,
    /// Direction of the first beam, in 1/10000 degree; 90 degrees is straight ahead.
    pub start_e4deg: i32,
    /// From beam to beam, in 1/10000 degree, rounded.
    pub step_e4deg: u16,
    /// Bits of a value.
    pub width: Width,
    /// The values.
    pub values: Values<'a>,
}

/// Where a device that moves says it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// x, y, z, roll, pitch, yaw.
    pub values: [f32; 6],
    /// What the angles are.
    pub rotation_type: u8,
}

/// The device's own calendar; from 1970 on where nobody set it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Clock {
    /// Year.
    pub year: u16,
    /// Month from 1.
    pub month: u8,
    /// Day from 1.
    pub day: u8,
    /// Hour.
    pub hour: u8,
    /// Minute.
    pub minute: u8,
    /// Second.
    pub second: u8,
    /// Microseconds, in whole milliseconds.
    pub us: u32,
}

/// What happened at a digital input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    /// `FDIN`.
    pub name: [u8; 4],
    /// Its numbers, as they come.
    pub numbers: [u32; 3],
}

/// A scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan<'a> {
    /// Counters and times.
    pub head: Head,
    /// Encoders.
    pub encoders: Vec<Encoder, MAX_ENCODERS>,
    /// Channels of 16 bits, then those of 8.
    pub channels: Vec<Channel<'a>, MAX_CHANNELS>,
    /// Where the device is.
    pub position: Option<Position>,
    /// Its name.
    pub name: Option<&'a [u8]>,
    /// A comment.
    pub comment: Option<&'a [u8]>,
    /// Its calendar.
    pub clock: Option<Clock>,
    /// What happened; `None` where old firmware does not even say that nothing did.
    pub event: Option<Option<Event>>,
}

impl<'a> Scan<'a> {
    /// The name of such telegrams, as event and as answer.
    pub const NAME: &'static [u8] = b"LMDscandata";

    /// Of a telegram's data.
    ///
    /// # Errors
    /// A field is none, a count leads past the end, or something is left.
    pub fn parse(telegram: &Telegram<'a>) -> Result<Self, WireError> {
        let data = telegram.data.unwrap_or_default();
        let mut fields = Fields::new(telegram.dialect, data, telegram.data_offset());
        let head = Head::parse(&mut fields)?;
        let mut encoders = Vec::new();
        for _ in 0..count(&mut fields, "encoders", MAX_ENCODERS)? {
            let (position, speed) = (fields.u32("encoder")?, fields.u16("encoder speed")?);
            // There is room: the count was checked.
            let _ = encoders.push(Encoder { position, speed });
        }
        let mut channels = Vec::new();
        for width in [Width::Word, Width::Byte] {
            for _ in 0..count(&mut fields, "channels", MAX_CHANNELS - channels.len())? {
                let _ = channels.push(Channel::parse(&mut fields, width)?);
            }
        }
        let position = block(&mut fields, Position::parse)?;
        let mut text = |fields: &mut Fields<'a>| {
            let length = fields.u8("length of a text")?;
            fields.text(usize::from(length))
        };
        let (name, comment) = (block(&mut fields, &mut text)?, block(&mut fields, &mut text)?);
        let clock = block(&mut fields, Clock::parse)?;
        let event = if fields.is_over() { None } else { Some(block(&mut fields, Event::parse)?) };
        fields.end_with(Self { head, encoders, channels, position, name, comment, clock, event })
    }

    /// Writes the data of such a telegram and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit_data(&self, dialect: Dialect, out: &mut [u8]) -> Result<usize, WireError> {
        let mut fields = FieldWriter::new(dialect, out);
        self.head.write(&mut fields);
        fields.u16(self.encoders.len() as u16);
        for encoder in &self.encoders {
            fields.u32(encoder.position);
            fields.u16(encoder.speed);
        }
        for width in [Width::Word, Width::Byte] {
            let channels = || self.channels.iter().filter(|channel| channel.width == width);
            fields.u16(channels().count() as u16);
            channels().for_each(|channel| channel.write(&mut fields));
        }
        let present = |fields: &mut FieldWriter<'_>, is_there: bool| fields.u16(u16::from(is_there));
        present(&mut fields, self.position.is_some());
        if let Some(position) = self.position {
            position.values.iter().for_each(|value| fields.f32(*value));
            fields.u8(position.rotation_type);
        }
        for text in [self.name, self.comment] {
            present(&mut fields, text.is_some());
            if let Some(text) = text {
                fields.u8(text.len() as u8);
                fields.text(text);
            }
        }
        present(&mut fields, self.clock.is_some());
        if let Some(clock) = self.clock {
            clock.write(&mut fields);
        }
        if let Some(event) = self.event {
            present(&mut fields, event.is_some());
            if let Some(event) = event {
                fields.text(&event.name);
                event.numbers.iter().for_each(|number| fields.u32(*number));
            }
        }
        fields.finish()
    }
}

impl Head {
    fn parse(fields: &mut Fields<'_>) -> Result<Self, WireError> {
        Ok(Self {
            version: fields.u16("version")?,
            device: fields.u16("device number")?,
            serial: fields.u32("serial number")?,
            status: fields.pair("status")?,
            telegram_counter: fields.u16("telegram counter")?,
            scan_counter: fields.u16("scan counter")?,
            scan_us: fields.u32("time of the scan")?,
            sent_us: fields.u32("time of transmission")?,
            inputs: fields.pair("inputs")?,
            outputs: fields.pair("outputs")?,
            layer_angle: fields.u16("layer angle")?,
            scan_frequency_chz: fields.u32("scan frequency")?,
            shot_frequency_100hz: fields.u32("shot frequency")?,
        })
    }

    fn write(&self, fields: &mut FieldWriter<'_>) {
        fields.u16(self.version);
        fields.u16(self.device);
        fields.u32(self.serial);
        fields.pair(self.status);
        fields.u16(self.telegram_counter);
        fields.u16(self.scan_counter);
        fields.u32(self.scan_us);
        fields.u32(self.sent_us);
        fields.pair(self.inputs);
        fields.pair(self.outputs);
        fields.u16(self.layer_angle);
        fields.u32(self.scan_frequency_chz);
        fields.u32(self.shot_frequency_100hz);
    }
}

impl<'a> Channel<'a> {
    fn parse(fields: &mut Fields<'a>, width: Width) -> Result<Self, WireError> {
        let name = fields.letters()?;
        let (scale, offset) = (fields.f32("scale")?, fields.f32("offset")?);
        let (start_e4deg, step_e4deg) = (fields.i32("start angle")?, fields.u16("angular step")?);
        let count = fields.u16("values")?;
        let size = if width == Width::Word { 2 } else { 1 };
        let bytes = fields.numbers(usize::from(count), size)?;
        let values = Values::Received { dialect: fields.dialect(), width, count, bytes };
        Ok(Self { name, scale, offset, start_e4deg, step_e4deg, width, values })
    }

    fn write(&self, fields: &mut FieldWriter<'_>) {
        fields.text(&self.name);
        fields.f32(self.scale);
        fields.f32(self.offset);
        fields.u32(self.start_e4deg as u32);
        fields.u16(self.step_e4deg);
        fields.u16(self.values.len() as u16);
        for value in self.values.iter() {
            match self.width {
                Width::Word => fields.u16(value),
                Width::Byte => fields.u8(value as u8),
            }
        }
    }
}

impl Position {
    fn parse(fields: &mut Fields<'_>) -> Result<Self, WireError> {
        let mut values = [0.0; 6];
        for value in &mut values {
            *value = fields.f32("position")?;
        }
        Ok(Self { values, rotation_type: fields.u8("rotation type")? })
    }
}

impl Clock {
    fn parse(fields: &mut Fields<'_>) -> Result<Self, WireError> {
        Ok(Self {
            year: fields.u16("year")?,
            month: fields.u8("month")?,
            day: fields.u8("day")?,
            hour: fields.u8("hour")?,
            minute: fields.u8("minute")?,
            second: fields.u8("second")?,
            us: fields.u32("microseconds")?,
        })
    }

    fn write(&self, fields: &mut FieldWriter<'_>) {
        fields.u16(self.year);
        [self.month, self.day, self.hour, self.minute, self.second].iter().for_each(|part| fields.u8(*part));
        fields.u32(self.us);
    }
}

impl Event {
    fn parse(fields: &mut Fields<'_>) -> Result<Self, WireError> {
        let name = fields.letters()?;
        let number = |fields: &mut Fields<'_>| fields.u32("event");
        Ok(Self { name, numbers: [number(fields)?, number(fields)?, number(fields)?] })
    }
}

/// A count that is not larger than what there is room for.
fn count(fields: &mut Fields<'_>, field: &'static str, limit: usize) -> Result<usize, WireError> {
    let offset = fields.offset();
    let found = usize::from(fields.u16(field)?);
    if found > limit { Err(WireError::Capacity { field, limit, found, offset }) } else { Ok(found) }
}

/// A block that a flag says is there.
fn block<'a, T>(
    fields: &mut Fields<'a>,
    mut parse: impl FnMut(&mut Fields<'a>) -> Result<T, WireError>,
) -> Result<Option<T>, WireError> {
    let offset = fields.offset();
    match fields.u16("flag of a block")? {
        0 => Ok(None),
        1 => parse(fields).map(Some),
        found => Err(WireError::Value { field: "flag of a block", found: u32::from(found), offset }),
    }
}
