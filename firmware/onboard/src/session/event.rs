//! What a session has to say, as values and in words.

use std::fmt;

use biplane_wire::roboclaw::StatusBits;

use crate::session::cola::event::ColaEvent;
use crate::session::inertial::event::InertialEvent;
use crate::session::lms::health::FaultList;
use crate::session::lms::scan::condition::Trouble;
use crate::session::lms::scan::ranges::Unpublished;
use crate::session::lms::setup::difference::BlockDifference;
use crate::session::lms::setup::requested::ConfigChange;
use crate::session::scip::event::ScipEvent;
use crate::types::device_name::ShortText;
use crate::types::foreign_protocol::ForeignProtocol;
use crate::types::mount_fault::MountFault;

/// What a session was doing.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Step {
    /// Looking for the rate at which the device answers.
    FindRate,
    /// Asking a second, different question at the rate found.
    ConfirmRate,
    /// Changing to the configured rate.
    SwitchRate,
    /// Reading the configuration.
    ReadConfiguration,
    /// Reading the status.
    ReadStatus,
    /// Reading the list of faults.
    ReadFaults,
    /// Reading a configuration back that was written.
    ReadBack,
    /// Entering the installation mode, in which the configuration may be written.
    EnterInstallation,
    /// Writing the configuration.
    WriteConfiguration,
    /// Leaving the installation mode.
    LeaveInstallation,
    /// Setting field of view and resolution.
    SetVariant,
    /// Starting continuous output.
    StartStream,
    /// Stopping continuous output.
    StopStream,
    /// Synchronizing with the base.
    Synchronize,
    /// Opening the session.
    Open,
    /// Becoming an authorized client.
    LogIn,
    /// Asking who it is.
    Identify,
}

impl Step {
    fn words(self) -> &'static str {
        match self {
            Self::FindRate => "finding the rate",
            Self::ConfirmRate => "confirming the rate",
            Self::SwitchRate => "changing the rate",
            Self::ReadConfiguration => "reading the configuration",
            Self::ReadStatus => "reading the status",
            Self::ReadFaults => "reading the list of faults",
            Self::ReadBack => "reading back the configuration",
            Self::EnterInstallation => "entering installation mode",
            Self::WriteConfiguration => "writing the configuration",
            Self::LeaveInstallation => "leaving installation mode",
            Self::SetVariant => "setting field of view and resolution",
            Self::StartStream => "starting continuous output",
            Self::StopStream => "stopping continuous output",
            Self::Synchronize => "synchronizing",
            Self::Open => "opening the session",
            Self::LogIn => "logging in",
            Self::Identify => "asking who it is",
        }
    }
}

/// Something worth saying.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Event {
    /// The device answers at this rate.
    Found {
        /// Bits per second.
        baud: u32,
    },
    /// No answer at any rate; the search goes on.
    NotFound {
        /// Rounds over all rates so far.
        rounds: u32,
    },
    /// The line now runs at this rate.
    RateSet {
        /// Bits per second.
        baud: u32,
    },
    /// The device does not change to the configured rate; the session goes on at the old one.
    RateKept {
        /// Configured, bits per second.
        wanted: u32,
        /// In force, bits per second.
        kept: u32,
    },
    /// The port does not run at this rate; it is left out.
    RateRefused {
        /// Bits per second.
        baud: u32,
    },
    /// The device has told its type or name.
    Identified(ShortText),
    /// A question was not answered in time and is asked again.
    Retried {
        /// The question.
        step: Step,
        /// Which attempt this is; 2 = first repetition.
        attempt: u8,
    },
    /// The device refused a request.
    Refused {
        /// The request.
        step: Step,
    },
    /// A question got no good answer in all its attempts.
    GivenUp {
        /// The question.
        step: Step,
    },
    /// The configuration was written and read back, because it differed from what the rig asks.
    ConfigurationWritten(ConfigChange),
    /// The device is set otherwise than the rig asks, and does not take it; its ranges are read in the units
    /// and the measuring mode that it says.
    ConfigurationKept(ConfigChange),
    /// The device holds another configuration than the one that it was sent: it has changed these bytes
    /// itself, or the write was damaged on its way.
    ConfigurationNotAsSent(BlockDifference),
    /// The device does not send remission; ranges alone are recorded.
    RemissionRefused,
    /// The device has these faults in its list.
    Faults(FaultList),
    /// The status report says that the device has a fault.
    HasFault,
    /// The status byte of scans begins or ceases to complain.
    Trouble {
        /// What of.
        trouble: Trouble,
        /// Whether it begins.
        begins: bool,
    },
    /// Intact telegrams come that cannot be published as scans, for this reason.
    Unpublished(Unpublished),
    /// A telegram came whose checksum is right and whose form is not the device's: it was damaged, and is
    /// left out.
    Implausible,
    /// The device keeps another field of view or resolution than configured; its scans are recorded as they
    /// are.
    VariantKept {
        /// In force, degrees.
        fov_deg: u16,
        /// In force, hundredths of a degree.
        resolution_cdeg: u16,
    },
    /// The configuration could not be read: ranges are decoded with measuring mode 00 (13 bits).
    ModeAssumed,
    /// Scans or odometry flow.
    Streaming,
    /// Nothing came for so long.
    Silent {
        /// Milliseconds.
        for_ms: u32,
    },
    /// Bytes came, but no intact telegram for so long.
    Garbled {
        /// Milliseconds.
        for_ms: u32,
    },
    /// The device has just been switched on or reset.
    PoweredOn,
    /// Too many telegrams arrive damaged, or no longer so.
    Damaged {
        /// Per cent of them in the last ten seconds; `None`: it is over.
        percent: Option<u8>,
        /// Whether this computer read some too late, so that they were cut.
        is_overrun: bool,
    },
    /// The scans of a laser come at a distance that is no whole number of turns of its mirror.
    OddInterval {
        /// The distance, microseconds.
        micros: u32,
    },
    /// What a laser sees does not fit how it sits in the rig, or does again.
    Mounting {
        /// What is suspected.
        mount_fault: MountFault,
        /// Whether it begins.
        begins: bool,
    },
    /// The base had a session open; it is closed first.
    SessionLeftOpen,
    /// The base counts its odometry from zero again.
    OdometryRestarted,
    /// The base's subclass is not known, and the rig does not say how long a unit of its position is.
    UnitsAssumed,
    /// What the base reports of its own state has changed.
    BaseStatus(StatusBits),
    /// The driver was written after other drivers and has not met the device.
    Untried,
    /// The device was left idle.
    Stopped,
    /// Another device speaks on the port.
    ForeignDevice(ForeignProtocol),
    /// The port has gone: an adapter was pulled.
    PortLost,
    /// The port is there again.
    PortBack,
    /// The laser was left idle at this rate.
    Idle {
        /// Bits per second.
        baud: u32,
    },
    /// The run ends while the laser is looked for: it has not answered a stop request at any rate.
    StopUnanswered,
    /// What only a laser on a network has to say.
    Cola(ColaEvent),
    /// What only a Hokuyo laser has to say.
    Scip(ScipEvent),
    /// What only an inertial unit has to say.
    Inertial(InertialEvent),
}

impl Event {
    /// Whether something is not as it should be.
    #[must_use]
    pub fn is_warning(&self) -> bool {
        match self {
            Self::Cola(event) => return event.is_warning(),
            Self::Scip(event) => return event.is_warning(),
            _ => {}
        }
        !matches!(
            self,
            Self::Found { .. }
                | Self::RateSet { .. }
                | Self::Identified(_)
                | Self::ConfigurationWritten(_)
                | Self::Trouble { begins: false, .. }
                | Self::Idle { .. }
                | Self::Streaming
                | Self::Damaged { percent: None, .. }
                | Self::Mounting { begins: false, .. }
                | Self::Stopped
                | Self::PortBack
                | Self::Untried
                | Self::Retried { step: Step::FindRate | Step::ConfirmRate, .. }
        )
    }
}

impl Event {
    /// In two or three words what keeps the line from bringing anything, where that is what is said.
    #[must_use]
    pub fn fault(&self) -> Option<&'static str> {
        Some(match self {
            Self::Cola(event) => return event.fault(),
            Self::Scip(event) => return event.fault(),
            Self::Inertial(event) => return event.fault(),
            Self::PortLost => "its port is gone",
            Self::Silent { .. } => "silent",
            Self::Garbled { .. } => "no intact telegram",
            Self::PoweredOn => "switched on or reset",
            Self::NotFound { .. } => "no answer at any rate",
            Self::ForeignDevice(_) => "another device on its port",
            Self::GivenUp { .. } => "does not do what it is asked",
            _ => return None,
        })
    }
}

fn say_damaged(percent: Option<u8>, is_overrun: bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let how = match is_overrun {
        true => "are cut: this computer reads them too late, it has too much else to do",
        false => "arrive damaged: look at cable and plug",
    };
    match percent {
        Some(percent) => write!(f, "{percent} % of its telegrams {how}"),
        None => write!(f, "its telegrams arrive intact again"),
    }
}

fn say_interval(micros: u32, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let interval_ms = f64::from(micros) * 1e-3;
    write!(f, "its scans come every {interval_ms:.2} ms, no whole number of turns of a mirror at 75 Hz: ")?;
    write!(f, "stamps follow that, and may err by a few milliseconds")
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cola(event) => event.fmt(f),
            Self::Scip(event) => event.fmt(f),
            Self::Inertial(event) => event.fmt(f),
            Self::Found { baud } => write!(f, "answers at {baud} Bd"),
            Self::NotFound { .. } => {
                write!(f, "no answer yet, asking on (is it switched on and connected?)")
            }
            Self::RateSet { baud } => write!(f, "runs at {baud} Bd"),
            Self::RateKept { wanted, kept } => {
                write!(f, "does not change to {wanted} Bd, stays at {kept} Bd")
            }
            Self::RateRefused { baud } => write!(f, "its port does not run at {baud} Bd, which is left out"),
            Self::Identified(text) => write!(f, "is a {}", text.trim()),
            Self::Retried { step, attempt } => {
                write!(f, "no answer while {}, attempt {attempt}", step.words())
            }
            Self::Refused { step } => write!(f, "refused while {}", step.words()),
            Self::GivenUp { step: Step::StopStream } => {
                write!(f, "did not answer when asked to stop: it may be streaming")
            }
            Self::GivenUp { step } => write!(f, "gave up {}", step.words()),
            Self::ConfigurationWritten(change) => write!(f, "configuration written: {change}"),
            Self::ConfigurationKept(change) => write!(f, "does not take what the rig asks: {change}"),
            Self::ConfigurationNotAsSent(difference) => {
                write!(f, "holds another configuration than was written to it: {difference}")
            }
            Self::RemissionRefused => write!(f, "does not send remission, ranges alone are recorded"),
            Self::Faults(faults) => write!(f, "reports {faults}"),
            Self::HasFault => write!(f, "says in its status report that it has a fault"),
            Self::Trouble { trouble, begins: true } => write!(f, "complains of {trouble}"),
            Self::Trouble { trouble, begins: false } => write!(f, "no longer complains of {trouble}"),
            Self::Unpublished(why) => write!(f, "sends {why}: not recorded as scans, only counted"),
            Self::Implausible => {
                write!(
                    f,
                    "a telegram was damaged in a way that its checksum does not show; such are left out and counted"
                )
            }
            Self::VariantKept { fov_deg, resolution_cdeg } => write!(
                f,
                "keeps {fov_deg} degrees in steps of {}.{:02}, not what is configured",
                resolution_cdeg / 100,
                resolution_cdeg % 100
            ),
            Self::ModeAssumed => {
                write!(f, "configuration not known, ranges read with measuring mode 00 (13 bits)")
            }
            Self::Streaming => write!(f, "streams"),
            Self::Silent { for_ms } => write!(f, "silent for {for_ms} ms, starting again"),
            Self::Garbled { for_ms } => write!(f, "no intact telegram for {for_ms} ms, starting again"),
            Self::PoweredOn => write!(f, "was switched on or reset, starting again"),
            Self::Damaged { percent, is_overrun } => say_damaged(*percent, *is_overrun, f),
            Self::OddInterval { micros } => say_interval(*micros, f),
            Self::Mounting { mount_fault, begins } => mount_fault.say(*begins, f),
            Self::SessionLeftOpen => write!(f, "had a session open, closing it first"),
            Self::OdometryRestarted => write!(f, "counts its odometry from zero again"),
            Self::UnitsAssumed => write!(f, "unknown subclass: one unit of its position is taken as 1 mm"),
            Self::BaseStatus(bits) if bits.words().next().is_none() => {
                write!(f, "reports no trouble any more")
            }
            Self::BaseStatus(bits) => write!(f, "reports {bits}"),
            Self::Untried => write!(f, "this driver was never tried on hardware"),
            Self::Stopped => write!(f, "left idle"),
            Self::ForeignDevice(foreign_protocol) => write!(f, "{foreign_protocol}"),
            Self::PortLost => write!(f, "its port is gone, looking for it"),
            Self::PortBack => write!(f, "its port is back"),
            Self::Idle { baud } => write!(f, "left idle at {baud} Bd"),
            Self::StopUnanswered => write!(f, "did not answer when asked to stop: it may be streaming"),
        }
    }
}
