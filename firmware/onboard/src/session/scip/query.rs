//! The questions of a session, each with the answer that belongs to it and how long to wait.

use biplane_wire::WireError;
use biplane_wire::scip::{Block, Command, Request, ScanRequest, TimeStep};

use crate::session::event::Step;
use crate::session::timing::retry::Patience;

/// A question.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Query {
    /// Whether it answers at all; ends a stream that was left on.
    Quit,
    /// Leave SCIP 1.1.
    Scip2,
    /// Leave the mode in which the clock is read.
    LeaveTime,
    /// Who it is.
    Version,
    /// Geometry, reach, rate.
    Parameters,
    /// Its state.
    Information,
    /// Run the line at this rate.
    Baud(u32),
    /// Whether it answers at the new rate.
    Confirm,
    /// Send scans.
    Start(ScanRequest),
    /// Send none.
    Stop,
}

impl Query {
    fn command(self) -> Command {
        match self {
            Self::Quit | Self::Confirm | Self::Stop => Command::Quit,
            Self::Scip2 => Command::Scip2,
            Self::LeaveTime => Command::Time(TimeStep::Leave),
            Self::Version => Command::Version,
            Self::Parameters => Command::Parameters,
            Self::Information => Command::Information,
            Self::Baud(baud) => Command::Baud(baud),
            Self::Start(request) => Command::Scans(request),
        }
    }

    /// Whether a reply answers this.
    pub(crate) fn is_answered_by(self, block: &Block<'_>) -> bool {
        block.request.command == self.command()
    }

    /// How long, and how often; while a scan is on the line, as long as that takes.
    pub(crate) fn patience(self) -> Patience {
        match self {
            // At 19200 Bd a scan takes 1.1 s.
            Self::Quit => Patience::new(150, 1).acknowledged(1_400),
            Self::Confirm => Patience::new(150, 3).acknowledged(1_400),
            Self::Stop => Patience::new(400, 2).acknowledged(1_400),
            Self::Version => Patience::new(300, 2),
            // A motor that starts up refuses for a while.
            Self::Start(_) => Patience::new(500, 6),
            _ => Patience::new(300, 3),
        }
    }

    /// What the session is doing, for whoever is told.
    pub(crate) fn step(self) -> Step {
        match self {
            Self::Quit | Self::Scip2 | Self::LeaveTime => Step::FindRate,
            Self::Confirm | Self::Baud(_) => Step::ConfirmRate,
            Self::Version | Self::Parameters => Step::ReadConfiguration,
            Self::Information => Step::ReadStatus,
            Self::Start(_) => Step::StartStream,
            Self::Stop => Step::StopStream,
        }
    }

    /// Writes the request.
    pub(crate) fn emit(self, out: &mut [u8]) -> Result<usize, WireError> {
        Request::from(self.command()).emit(out)
    }
}
