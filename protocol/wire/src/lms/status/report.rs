//! The status report: reply B1h (telegram listing, section 7.8).
//!
//! Offsets count the code byte B1 as 0, as the listing does; its total of 152 data bytes is what devices
//! send, although the listing prints fewer reserved bytes.

use crate::WireError;
use crate::lms::baud::Baud;
use crate::lms::frame::DATA_OFFSET;
use crate::lms::scan::Unit;
use crate::lms::settings::measuring::MeasuringMode;
use crate::text::Text;

/// Data bytes of a status report.
pub const STATUS_REPORT_BYTES: usize = 152;

mod field {
    pub(super) const VERSION: usize = 1;
    pub(super) const VERSION_BYTES: usize = 7;
    pub(super) const OPERATING_MODE: usize = 8;
    pub(super) const FAULT: usize = 9;
    pub(super) const VARIANT: usize = 18;
    pub(super) const POLLUTION: usize = 19;
    pub(super) const MIRROR_TURN: usize = 67;
    pub(super) const MEASURING_MODE: usize = 102;
    pub(super) const ANGLE: usize = 107;
    pub(super) const RESOLUTION: usize = 109;
    pub(super) const RESTART_MODE: usize = 111;
    pub(super) const RESTART_TIME: usize = 112;
    pub(super) const BAUD: usize = 116;
    pub(super) const EVALUATIONS: usize = 118;
    pub(super) const PERMANENT_BAUD: usize = 119;
    pub(super) const ADDRESS: usize = 120;
    pub(super) const FIELD_SET: usize = 121;
    pub(super) const UNIT: usize = 122;
    pub(super) const LASER: usize = 123;
    pub(super) const BOOT_VERSION: usize = 124;
}

/// A status report in place. Fields that no program here needs (calibration, signals) are in
/// [`StatusReport::data`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusReport<'a> {
    data: &'a [u8],
}

impl<'a> StatusReport<'a> {
    /// Checks the length only; [`STATUS_REPORT_BYTES`] or more.
    ///
    /// # Errors
    /// Fewer bytes.
    pub fn new(data: &'a [u8]) -> Result<Self, WireError> {
        if data.len() < STATUS_REPORT_BYTES {
            let needed = DATA_OFFSET + STATUS_REPORT_BYTES;
            return Err(WireError::TooShort { needed, found: DATA_OFFSET + data.len() });
        }
        Ok(Self { data })
    }

    /// All bytes behind the code.
    pub fn data(&self) -> &'a [u8] {
        self.data
    }

    /// The byte at the listing's offset, which counts the code byte. The constructor has checked the length.
    fn byte(&self, offset: usize) -> u8 {
        self.data.get(offset - 1).copied().unwrap_or(0)
    }

    fn word(&self, offset: usize) -> u16 {
        u16::from_le_bytes([self.byte(offset), self.byte(offset + 1)])
    }

    fn text(&self, offset: usize) -> Text<'a> {
        Text(self.data.get(offset - 1..offset - 1 + field::VERSION_BYTES).unwrap_or(&[]))
    }

    /// Firmware version.
    pub fn version(&self) -> Text<'a> {
        self.text(field::VERSION)
    }

    /// Operating mode: the sub-command of 20h in force (24h streams, 25h on request ...).
    pub fn operating_mode(&self) -> u8 {
        self.byte(field::OPERATING_MODE)
    }

    /// Whether the device has a fault.
    pub fn has_fault(&self) -> bool {
        self.byte(field::FAULT) != 0
    }

    /// Device variant.
    pub fn variant(&self) -> u8 {
        self.byte(field::VARIANT)
    }

    /// Pollution of the front window, eight channels in device units.
    pub fn pollution(&self) -> [u16; 8] {
        core::array::from_fn(|channel| self.word(field::POLLUTION + 2 * channel))
    }

    /// Time of 1/90 mirror turn in microseconds: 148.
    pub fn mirror_turn_90th_us(&self) -> u16 {
        self.word(field::MIRROR_TURN)
    }

    /// What the bits of a measured value mean.
    pub fn measuring_mode(&self) -> MeasuringMode {
        MeasuringMode::from_byte(self.byte(field::MEASURING_MODE))
    }

    /// Field of view in degrees.
    pub fn angle_deg(&self) -> u16 {
        self.word(field::ANGLE)
    }

    /// Angular step in hundredths of a degree.
    pub fn resolution_cdeg(&self) -> u16 {
        self.word(field::RESOLUTION)
    }

    /// Restart mode.
    pub fn restart_mode(&self) -> u8 {
        self.byte(field::RESTART_MODE)
    }

    /// Restart time in seconds.
    pub fn restart_time_s(&self) -> u8 {
        self.byte(field::RESTART_TIME)
    }

    /// Present line rate; the code itself when it is none of the four.
    pub fn baud(&self) -> Result<Baud, u16> {
        let code = self.word(field::BAUD);
        Baud::from_status_code(code).ok_or(code)
    }

    /// Scans in a row that must agree.
    pub fn evaluations(&self) -> u8 {
        self.byte(field::EVALUATIONS)
    }

    /// Whether the present rate stays after power-off.
    pub fn permanent_baud(&self) -> bool {
        self.byte(field::PERMANENT_BAUD) != 0
    }

    /// The device's own address.
    pub fn address(&self) -> u8 {
        self.byte(field::ADDRESS)
    }

    /// Field set in use.
    pub fn field_set(&self) -> u8 {
        self.byte(field::FIELD_SET)
    }

    /// Unit of measured values; the byte itself when it has no meaning.
    pub fn unit(&self) -> Result<Unit, u8> {
        let byte = self.byte(field::UNIT);
        Unit::from_byte(byte).ok_or(byte)
    }

    /// Whether the laser is on.
    pub fn laser_on(&self) -> bool {
        self.byte(field::LASER) != 0
    }

    /// Version of the boot program.
    pub fn boot_version(&self) -> Text<'a> {
        self.text(field::BOOT_VERSION)
    }
}

/// What a simulated device reports about itself; everything else in its report is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusFields {
    /// Firmware version, padded with blanks.
    pub version: [u8; 7],
    /// Sub-command of 20h in force.
    pub operating_mode: u8,
    /// Whether the device has a fault.
    pub has_fault: bool,
    /// Device variant.
    pub variant: u8,
    /// Pollution of the front window, in device units.
    pub pollution: [u16; 8],
    /// Meaning of the value bits.
    pub measuring_mode: MeasuringMode,
    /// Field of view in degrees.
    pub angle_deg: u16,
    /// Angular step in hundredths of a degree.
    pub resolution_cdeg: u16,
    /// Present line rate.
    pub baud: Baud,
    /// Whether that rate stays after power-off.
    pub permanent_baud: bool,
    /// The device's own address.
    pub address: u8,
    /// Unit of measured values.
    pub unit: Unit,
    /// Whether the laser is on.
    pub laser_on: bool,
    /// Version of the boot program, padded with blanks.
    pub boot_version: [u8; 7],
}

impl Default for StatusFields {
    /// An LMS 291 after power-on: 180 degrees in steps of 0.5, centimeters, on request.
    fn default() -> Self {
        Self {
            version: *b"X01.27 ",
            operating_mode: 0x25,
            has_fault: false,
            variant: 0,
            pollution: [100; 8],
            measuring_mode: MeasuringMode::FieldsAbDazzle,
            angle_deg: 180,
            resolution_cdeg: 50,
            baud: Baud::B9600,
            permanent_baud: false,
            address: 0,
            unit: Unit::Cm,
            laser_on: true,
            boot_version: *b"V02.10 ",
        }
    }
}

impl StatusFields {
    /// The data bytes of the report; `StatusReport::new(&fields.encode())` reads them.
    pub fn encode(&self) -> [u8; STATUS_REPORT_BYTES] {
        // One byte longer at the front, so that the listing's offsets index it.
        let mut block = [0u8; 1 + STATUS_REPORT_BYTES];
        block[field::VERSION..][..field::VERSION_BYTES].copy_from_slice(&self.version);
        block[field::OPERATING_MODE] = self.operating_mode;
        block[field::FAULT] = u8::from(self.has_fault);
        block[field::VARIANT] = self.variant;
        let mut word = |offset: usize, word: u16| block[offset..][..2].copy_from_slice(&word.to_le_bytes());
        for (channel, &pollution) in self.pollution.iter().enumerate() {
            word(field::POLLUTION + 2 * channel, pollution);
        }
        word(field::MIRROR_TURN, 148);
        word(field::ANGLE, self.angle_deg);
        word(field::RESOLUTION, self.resolution_cdeg);
        word(field::BAUD, self.baud.status_code());
        block[field::MEASURING_MODE] = self.measuring_mode.byte();
        block[field::RESTART_MODE] = 2;
        block[field::RESTART_TIME] = 2;
        block[field::EVALUATIONS] = 2;
        block[field::PERMANENT_BAUD] = u8::from(self.permanent_baud);
        block[field::ADDRESS] = self.address;
        block[field::FIELD_SET] = 1;
        block[field::UNIT] = self.unit.byte();
        block[field::LASER] = u8::from(self.laser_on);
        block[field::BOOT_VERSION..][..field::VERSION_BYTES].copy_from_slice(&self.boot_version);
        let mut data = [0u8; STATUS_REPORT_BYTES];
        data.copy_from_slice(&block[1..]);
        data
    }
}
