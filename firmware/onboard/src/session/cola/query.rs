//! The questions of a session, each with the answer that belongs to it and how long to wait.

use biplane_wire::WireError;
use biplane_wire::cola::{
    CLIENT_HASH, Dialect, Kind, OutputRange, SAFETY_CLIENT_HASH, Scan, ScanConfig, ScanDataConfig, Telegram,
    emit_byte, emit_login,
};

use crate::session::cola::settings::ColaChange;
use crate::session::device_session::REQUEST_CAPACITY;
use crate::session::event::Step;
use crate::session::timing::retry::Patience;

/// A question.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Query {
    /// Name and version; also whether the device answers at all.
    Ident,
    /// Firmware version.
    Firmware,
    /// Serial number.
    Serial,
    /// Busy, ready, error.
    State,
    /// Rate and step.
    ReadScan,
    /// What telegrams hold.
    ReadData,
    /// Which part of the fan is sent.
    ReadRange,
    /// Become an authorized client.
    Login,
    /// The same at a safety-type unit.
    SafetyLogin,
    /// Set rate and step.
    WriteScan,
    /// Set what telegrams hold.
    WriteData,
    /// Set which part of the fan is sent.
    WriteRange,
    /// Keep it without power.
    Save,
    /// Measure.
    StartMeasuring,
    /// Log out, and make active what was written.
    Run,
    /// Send scans.
    Subscribe,
    /// Send none.
    Unsubscribe,
}

impl Query {
    /// Kind and name of the request.
    fn head(self) -> (Kind, &'static [u8]) {
        match self {
            Self::Ident => (Kind::Read, b"DeviceIdent"),
            Self::Firmware => (Kind::Read, b"FirmwareVersion"),
            Self::Serial => (Kind::Read, b"SerialNumber"),
            Self::State => (Kind::Read, b"SCdevicestate"),
            Self::ReadScan => (Kind::Read, ScanConfig::NAME),
            Self::ReadData => (Kind::Read, ScanDataConfig::NAME),
            Self::ReadRange => (Kind::Read, OutputRange::NAME),
            Self::Login | Self::SafetyLogin => (Kind::Method, b"SetAccessMode"),
            Self::WriteScan => (Kind::Method, ScanConfig::SETTER),
            Self::WriteData => (Kind::Write, ScanDataConfig::NAME),
            Self::WriteRange => (Kind::Write, OutputRange::NAME),
            Self::Save => (Kind::Method, b"mEEwriteall"),
            Self::StartMeasuring => (Kind::Method, b"LMCstartmeas"),
            Self::Run => (Kind::Method, b"Run"),
            Self::Subscribe | Self::Unsubscribe => (Kind::Subscribe, Scan::NAME),
        }
    }

    /// Whether a telegram answers this.
    pub(crate) fn is_answered_by(self, telegram: &Telegram<'_>) -> bool {
        let (kind, name) = self.head();
        let answer = match kind {
            Kind::Read => Kind::ReadAnswer,
            Kind::Write => Kind::WriteAnswer,
            Kind::Method => Kind::MethodAnswer,
            _ => Kind::SubscribeAnswer,
        };
        (telegram.kind, telegram.name) == (answer, name)
    }

    /// How long, and how often.
    pub(crate) fn patience(self) -> Patience {
        match self {
            // A device that starts up takes connections before it answers.
            Self::Ident => Patience::new(400, 3),
            // It works on its memory.
            Self::Save => Patience::new(10_000, 1),
            Self::WriteScan => Patience::new(5_000, 2),
            Self::Unsubscribe => Patience::new(300, 1),
            _ => Patience::new(1_000, 3),
        }
    }

    /// What the session is doing, for whoever is told.
    pub(crate) fn step(self) -> Step {
        match self {
            Self::Ident | Self::Firmware | Self::Serial => Step::Open,
            Self::State => Step::ReadStatus,
            Self::ReadScan | Self::ReadData | Self::ReadRange => Step::ReadConfiguration,
            Self::Login | Self::SafetyLogin => Step::LogIn,
            Self::WriteScan | Self::WriteData | Self::WriteRange | Self::Save => Step::WriteConfiguration,
            Self::StartMeasuring | Self::Run | Self::Subscribe => Step::StartStream,
            Self::Unsubscribe => Step::StopStream,
        }
    }

    /// Writes the request.
    pub(crate) fn emit(
        self,
        dialect: Dialect,
        change: &ColaChange,
        out: &mut [u8],
    ) -> Result<usize, WireError> {
        let mut data = [0; REQUEST_CAPACITY];
        let length = match self {
            Self::Login => Some(emit_login(CLIENT_HASH, dialect, &mut data)?),
            Self::SafetyLogin => Some(emit_login(SAFETY_CLIENT_HASH, dialect, &mut data)?),
            Self::WriteScan => change.scan.map(|scan| scan.emit_data(dialect, &mut data)).transpose()?,
            Self::WriteData => change.data.map(|wanted| wanted.emit_data(dialect, &mut data)).transpose()?,
            Self::WriteRange => change.range.map(|range| range.emit_data(dialect, &mut data)).transpose()?,
            Self::Subscribe => Some(emit_byte(1, dialect, &mut data)?),
            Self::Unsubscribe => Some(emit_byte(0, dialect, &mut data)?),
            _ => None,
        };
        let (kind, name) = self.head();
        let data = length.and_then(|length| data.get(..length));
        Telegram { dialect, kind, name, data }.emit(out)
    }
}
