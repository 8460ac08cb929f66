//! What a laser on a network answers.

use biplane_wire::cola::{
    CLIENT_HASH, Dialect, Kind, OutputRange, Scan, ScanConfig, ScanDataConfig, Telegram, emit_byte,
    emit_texts, parse_byte, parse_login,
};

use super::model::ColaParams;

/// Codes of refusals.
const NOT_ALLOWED: u16 = 1;
const UNKNOWN: u16 = 3;
const NOT_WRITABLE: u16 = 0xA;

/// What can be set, and who is logged in.
#[derive(Clone, Debug)]
pub struct Settings {
    pub(super) scan: ScanConfig,
    pub(super) data: ScanDataConfig,
    pub(super) range: OutputRange,
    /// Writes to the device's memory.
    pub(super) saves: u64,
    is_logged_in: bool,
    /// Nothing can be set.
    is_fixed: bool,
}

/// An answer, and what follows from it.
#[derive(Clone, Debug, Default)]
pub(super) struct Answered {
    pub(super) bytes: Vec<u8>,
    pub(super) is_refused: bool,
    /// Scans shall be sent from now on, or no more.
    pub(super) subscribes: Option<bool>,
    /// The scan that comes next is the answer.
    pub(super) wants_scan: bool,
    /// The mirror has got another rate.
    pub(super) restarts_mirror: bool,
}

impl Settings {
    pub(super) fn of(params: &ColaParams, is_fixed: bool) -> Self {
        let ColaParams { scan, data, range, .. } = *params;
        Self { scan, data, range, saves: 0, is_logged_in: false, is_fixed }
    }

    /// The answer to a request.
    pub(super) fn answer(&mut self, params: &ColaParams, telegram: &Telegram<'_>) -> Answered {
        let mut answered = Answered::default();
        let mut data = [0; 256];
        let found = match telegram.kind {
            Kind::Read if telegram.name == Scan::NAME => {
                answered.wants_scan = true;
                return answered;
            }
            Kind::Read => self.read(params, telegram, &mut data),
            Kind::Write => self.write(telegram),
            Kind::Method => self.call(params, telegram, &mut data, &mut answered),
            Kind::Subscribe if telegram.name == Scan::NAME => {
                let is_on = parse_byte(telegram) == Ok(1);
                answered.subscribes = Some(is_on);
                byte(u8::from(is_on), telegram.dialect, &mut data)
            }
            _ => Err(UNKNOWN),
        };
        answered.is_refused = found.is_err();
        answered.bytes = match found {
            Ok(length) => framed(telegram, data.get(..length).unwrap_or_default()),
            Err(code) => refusal(telegram.dialect, code),
        };
        answered
    }

    fn read(&self, params: &ColaParams, telegram: &Telegram<'_>, data: &mut [u8]) -> Result<usize, u16> {
        let dialect = telegram.dialect;
        let serial = params.serial.to_string();
        let [name, version] = [params.name.as_bytes(), params.version.as_bytes()];
        let written = match telegram.name {
            b"DeviceIdent" => emit_texts(&[name, version], dialect, data),
            b"FirmwareVersion" => emit_texts(&[version], dialect, data),
            b"SerialNumber" => emit_texts(&[serial.as_bytes()], dialect, data),
            b"SCdevicestate" => emit_byte(1, dialect, data),
            ScanDataConfig::NAME => self.data.emit_data(dialect, data),
            OutputRange::NAME => self.range.emit_data(dialect, data),
            ScanConfig::NAME if params.family.sets_rate() => self.scan.emit_data(dialect, data),
            _ => return Err(UNKNOWN),
        };
        written.map_err(|_| UNKNOWN)
    }

    fn write(&mut self, telegram: &Telegram<'_>) -> Result<usize, u16> {
        let wrong = |_| 5_u16;
        match telegram.name {
            ScanDataConfig::NAME | OutputRange::NAME if !self.is_logged_in || self.is_fixed => {
                return Err(NOT_WRITABLE);
            }
            ScanDataConfig::NAME => self.data = ScanDataConfig::parse(telegram).map_err(wrong)?,
            OutputRange::NAME => self.range = OutputRange::parse(telegram).map_err(wrong)?,
            _ => return Err(UNKNOWN),
        }
        Ok(0)
    }

    fn call(
        &mut self,
        params: &ColaParams,
        telegram: &Telegram<'_>,
        data: &mut [u8],
        answered: &mut Answered,
    ) -> Result<usize, u16> {
        let dialect = telegram.dialect;
        match telegram.name {
            b"SetAccessMode" => {
                self.is_logged_in = parse_login(telegram) == Ok((3, CLIENT_HASH));
                byte(u8::from(self.is_logged_in), dialect, data)
            }
            b"Run" => {
                self.is_logged_in = false;
                byte(1, dialect, data)
            }
            ScanConfig::SETTER | b"mEEwriteall" | b"LMCstartmeas" if !self.is_logged_in => Err(NOT_ALLOWED),
            b"mEEwriteall" => {
                self.saves += 1;
                byte(1, dialect, data)
            }
            b"LMCstartmeas" => byte(0, dialect, data),
            ScanConfig::SETTER if params.family.sets_rate() => {
                let wanted = ScanConfig::parse(telegram).map_err(|_| 5_u16)?;
                let fits = |offer: &biplane_wire::cola::Offer| {
                    (offer.rate_chz, offer.step_e4deg) == (wanted.rate_chz, wanted.step_e4deg)
                };
                let is_offered = !self.is_fixed && params.family.offers().iter().any(fits);
                if is_offered {
                    let ScanConfig { rate_chz, step_e4deg, .. } = wanted;
                    self.scan = ScanConfig { rate_chz, step_e4deg, ..self.scan };
                    answered.restarts_mirror = true;
                }
                let code = if is_offered { 0 } else { 3 };
                self.scan.emit_answer(code, dialect, data).map_err(|_| UNKNOWN)
            }
            _ => Err(UNKNOWN),
        }
    }
}

fn byte(value: u8, dialect: Dialect, data: &mut [u8]) -> Result<usize, u16> {
    emit_byte(value, dialect, data).map_err(|_| UNKNOWN)
}

fn framed(request: &Telegram<'_>, data: &[u8]) -> Vec<u8> {
    let kind = match request.kind {
        Kind::Read => Kind::ReadAnswer,
        Kind::Write => Kind::WriteAnswer,
        Kind::Method => Kind::MethodAnswer,
        _ => Kind::SubscribeAnswer,
    };
    emitted(&Telegram { kind, data: Some(data), ..*request })
}

fn refusal(dialect: Dialect, code: u16) -> Vec<u8> {
    let (text, binary) = (format!("{code:X}"), code.to_be_bytes());
    let data = if dialect == Dialect::A { text.as_bytes() } else { &binary };
    emitted(&Telegram { dialect, kind: Kind::Error, name: &[], data: Some(data) })
}

fn emitted(telegram: &Telegram<'_>) -> Vec<u8> {
    let mut bytes = vec![0; telegram.encoded_len()];
    // The buffer is as long as the telegram says.
    let _ = telegram.emit(&mut bytes);
    bytes
}
