//! The questions to an inertial unit, how long each is waited for, and what answers it.

use biplane_wire::xsens::{Command, EVERY_SAMPLE, Output, Outputs, Report, quantity};

use crate::session::event::Step;
use crate::session::timing::retry::Patience;

/// An answer comes behind the measurement that is on the line, some milliseconds later.
const ANSWER: Patience = Patience::new(400, 4);
/// A unit that writes its settings takes its time.
const SETTING: Patience = Patience::new(1000, 3);

/// A question.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) enum Query {
    /// Into the config state.
    Configure,
    /// Its number.
    Identify,
    /// What it shall send.
    SetOutputs,
    /// Into the measuring state.
    Measure,
    /// Into the config state, in which it is left idle.
    Idle,
}

impl Query {
    pub(super) fn patience(self) -> Patience {
        if self == Self::SetOutputs { SETTING } else { ANSWER }
    }

    pub(super) fn step(self) -> Step {
        match self {
            Self::Configure => Step::Open,
            Self::Identify => Step::Identify,
            Self::SetOutputs => Step::WriteConfiguration,
            Self::Measure => Step::StartStream,
            Self::Idle => Step::StopStream,
        }
    }

    pub(super) fn command(self, rate_hz: u16) -> Command {
        match self {
            Self::Configure | Self::Idle => Command::GoToConfig,
            Self::Identify => Command::AskDeviceId,
            Self::SetOutputs => Command::SetOutputs(outputs(rate_hz)),
            Self::Measure => Command::GoToMeasurement,
        }
    }

    pub(super) fn is_answered_by(self, report: &Report<'_>) -> bool {
        match self {
            Self::Configure | Self::Idle => matches!(report, Report::ConfigState),
            Self::Identify => matches!(report, Report::DeviceId(_)),
            Self::SetOutputs => matches!(report, Report::Outputs(_)),
            Self::Measure => matches!(report, Report::MeasuringState),
        }
    }
}

/// What a sample needs, with the rate of its numbers; and the flags.
fn outputs(rate_hz: u16) -> Outputs {
    [
        (quantity::PACKET_COUNTER, EVERY_SAMPLE),
        (quantity::SAMPLE_TIME_FINE, EVERY_SAMPLE),
        (quantity::ACCELERATION, rate_hz),
        (quantity::RATE_OF_TURN, rate_hz),
        (quantity::STATUS_WORD, EVERY_SAMPLE),
    ]
    .into_iter()
    .map(|(identifier, rate_hz)| Output { identifier, rate_hz })
    .collect()
}

/// The rate at which a unit with these outputs sends whole samples; `None` when it sends none.
pub(super) fn sample_rate_hz(outputs: &Outputs) -> Option<u16> {
    let rate_hz = |wanted: u16| {
        let mut found = outputs.iter().filter(|output| output.identifier & quantity::MASK == wanted);
        found.next().map(|output| output.rate_hz)
    };
    rate_hz(quantity::PACKET_COUNTER)?;
    rate_hz(quantity::SAMPLE_TIME_FINE)?;
    let [acceleration_hz, turn_hz] = [rate_hz(quantity::ACCELERATION)?, rate_hz(quantity::RATE_OF_TURN)?];
    (acceleration_hz == turn_hz && turn_hz > 0).then_some(turn_hz)
}
