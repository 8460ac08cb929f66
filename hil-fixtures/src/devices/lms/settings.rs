//! What a mock laser can be set to: variant, configuration block, status report.
//!
//! Sources: SICK telegram listing 74h/77h (configuration), 3Bh (variant), B1h (status); bytes of the status
//! report that no source explains are those of the transcripts in which five client programs accepted it.

/// Field of view and step of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Field of view in degrees: 100 or 180 (90 for an S14).
    pub fov_deg: u16,
    /// Step between beams in hundredths of a degree: 100, 50 or 25.
    pub resolution_cdeg: u16,
}

impl Variant {
    /// Variants that command 3Bh accepts; 180 degrees at a quarter degree is not among them.
    pub const ALL: [Self; 5] =
        [Self::of(180, 100), Self::of(180, 50), Self::of(100, 100), Self::of(100, 50), Self::of(100, 25)];

    /// The only one of an S14, whose laser fires at each half degree.
    pub const S14: Self = Self::of(90, 50);

    /// A variant from its two numbers, checked by nobody.
    #[must_use]
    pub const fn of(fov_deg: u16, resolution_cdeg: u16) -> Self {
        Self { fov_deg, resolution_cdeg }
    }

    /// Mirror turns that one whole scan takes: 1, 2 or 4.
    #[must_use]
    pub fn turns(self) -> i64 {
        match self.resolution_cdeg {
            _ if self == Self::S14 => 1,
            25 => 4,
            50 => 2,
            _ => 1,
        }
    }

    /// Values of a whole scan.
    #[must_use]
    pub fn beam_count(self) -> usize {
        usize::from(self.fov_deg) * 100 / usize::from(self.resolution_cdeg.max(1)) + 1
    }

    /// The variant that a scan of this many values has, if it is one of 3Bh's.
    #[must_use]
    pub fn of_count(count: usize) -> Option<Self> {
        Self::ALL.into_iter().find(|variant| variant.beam_count() == count)
    }
}

/// Length of the configuration block in current firmware.
pub const CONFIG_BYTES: usize = 34;

/// Length of the block in old firmware.
pub const OLD_CONFIG_BYTES: usize = 32;

/// Length of the second block (7Bh, 7Ch).
pub const SECOND_CONFIG_BYTES: usize = 84;

/// The configuration block, as on the wire (offsets of the telegram listing, code byte not counted).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfigBlock(pub [u8; CONFIG_BYTES]);

impl Default for ConfigBlock {
    /// Centimeters, measuring mode 00, no index bytes, peak threshold 46h: what sicktoolbox's mock and LMS
    /// 2x1 agree on.
    fn default() -> Self {
        let contour = [0x00, 0x0A, 0x0A, 0x50, 0x64];
        let mut block = [0; CONFIG_BYTES];
        block[2] = 0x46;
        block[9..12].copy_from_slice(&[2, 2, 2]);
        for start in [13, 18, 23] {
            block[start..start + 5].copy_from_slice(&contour);
        }
        block[32] = 2;
        Self(block)
    }
}

impl ConfigBlock {
    /// Bit 1 of the availability byte: scans carry two index bytes.
    #[must_use]
    pub fn sends_indices(&self) -> bool {
        self.0[4] & 2 != 0
    }

    /// Measuring mode: how many bits of a value are range.
    #[must_use]
    pub fn measuring_mode(&self) -> u8 {
        self.0[5]
    }

    /// Whether values are in millimeters.
    #[must_use]
    pub fn is_mm(&self) -> bool {
        self.0[6] == 1
    }

    /// The same block with these units and this measuring mode.
    #[must_use]
    pub fn with_units(mut self, mm: bool, measuring_mode: u8) -> Self {
        self.0[5] = measuring_mode;
        self.0[6] = u8::from(mm);
        self
    }

    /// The block after a write of `data`: shorter writes leave the rest alone, as old drivers expect. `None`
    /// when a device with a block of `length` bytes would refuse the values.
    #[must_use]
    pub fn written(mut self, data: &[u8], length: usize) -> Option<Self> {
        if data.is_empty() || data.len() > length.min(CONFIG_BYTES) {
            return None;
        }
        self.0[..data.len()].copy_from_slice(data);
        let mode_known = matches!(self.measuring_mode(), 0..=6 | 0x0D..=0x0F | 0x3F);
        (mode_known && self.0[6] <= 1).then_some(self)
    }
}

/// Data bytes of the status report.
pub const STATUS_BYTES: usize = 152;

/// What the status report tells beside constants.
#[derive(Clone, Copy, Debug)]
pub struct StatusFacts<'a> {
    /// Firmware text, seven characters such as `X01.27 `.
    pub firmware: &'a str,
    /// Operating mode: sub-command of 20h in force.
    pub mode: u8,
    /// Whether a fault is current.
    pub faulty: bool,
    /// Variant in force.
    pub variant: Variant,
    /// Configuration in force.
    pub config: &'a ConfigBlock,
    /// Rate of the line in Bd.
    pub baud: u32,
    /// Whether the rate is kept at power-off.
    pub baud_is_permanent: bool,
    /// Own address.
    pub address: u8,
}

/// The 152 data bytes of a B1 reply. Offsets below count the code byte as 0, as the listing does; the array
/// begins at 1.
#[must_use]
pub fn status_report(facts: &StatusFacts<'_>) -> [u8; STATUS_BYTES] {
    let mut report = [0; STATUS_BYTES];
    let mut put =
        |offset: usize, bytes: &[u8]| report[offset - 1..offset - 1 + bytes.len()].copy_from_slice(bytes);
    let version: Vec<u8> = facts.firmware.bytes().chain(std::iter::repeat(b' ')).take(7).collect();
    put(1, &version);
    put(8, &[facts.mode, u8::from(facts.faulty)]);
    put(12, &[0x40]);
    for word in 0..24u16 {
        put(19 + 2 * usize::from(word), &(100 + word).to_le_bytes());
    }
    put(67, &148u16.to_le_bytes());
    for offset in (71..101).step_by(2) {
        put(offset, &[0x50, 0x00]);
    }
    put(102, &[facts.config.measuring_mode()]);
    put(107, &facts.variant.fov_deg.to_le_bytes());
    put(109, &facts.variant.resolution_cdeg.to_le_bytes());
    // Restart mode and time, number of evaluations: as configured (block, offsets 10, 11 and 9).
    put(111, &facts.config.0[10..12]);
    put(116, &baud_code(facts.baud).to_le_bytes());
    put(118, &[facts.config.0[9]]);
    put(119, &[u8::from(facts.baud_is_permanent)]);
    put(120, &[facts.address]);
    put(121, &[1]);
    put(122, &[u8::from(facts.config.is_mm())]);
    put(123, &[1]);
    put(124, b"V02.10 ");
    report
}

/// Rate code of the status report (listing: 8001, 8019, 8033, 8067).
fn baud_code(baud: u32) -> u16 {
    match baud {
        500_000 => 0x8001,
        38_400 => 0x8019,
        19_200 => 0x8033,
        _ => 0x8067,
    }
}
