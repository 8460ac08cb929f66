//! The faults that can be asked for by name, what each acts on, and where it can be had.

use std::str::FromStr;

/// A fault that can be asked for by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Preset {
    /// A bit in ten thousand flips.
    BitNoise,
    /// The plug loses contact for a moment every few seconds.
    LooseConnector,
    /// A USB adapter delivers late, and now and then holds everything back for a while.
    UsbStall,
    /// A device is dark for a while, then starts up as if just switched on.
    PowerCycle,
    /// Sunlight dazzles a run of a laser's beams for seconds.
    Dazzle,
    /// Dirt on a laser's window: some values short or invalid, and the status byte says so.
    WindowDirty,
    /// The host's clock steps by seconds to hours, away and back.
    ClockStep,
    /// The devices stream already when the client comes.
    LeftStreaming,
}

/// What a fault acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActsOn {
    /// Bytes on their way, both directions of every line.
    Line,
    /// The power of every device.
    Power,
    /// What the lasers measure.
    Measurement,
    /// How the devices are at the start.
    Start,
    /// The host's UTC.
    HostClock,
}

/// Where faults are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Devices on ports that a client opens.
    Serve,
    /// A capture without a client.
    Simulate,
}

/// A name that no preset has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown fault `{name}`; known: {} (`serve --unplug` pulls the plug of one device)", Preset::names().join(", "))]
pub struct UnknownPreset {
    /// The name.
    pub name: String,
}

/// A fault that cannot be had where it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("fault `{}`: {why}", preset.name())]
pub struct Misplaced {
    /// The fault.
    pub preset: Preset,
    /// Why not here, and where.
    pub why: &'static str,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 8] = [
        Self::BitNoise,
        Self::LooseConnector,
        Self::UsbStall,
        Self::PowerCycle,
        Self::Dazzle,
        Self::WindowDirty,
        Self::ClockStep,
        Self::LeftStreaming,
    ];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BitNoise => "bit-noise",
            Self::LooseConnector => "loose-connector",
            Self::UsbStall => "usb-stall",
            Self::PowerCycle => "power-cycle",
            Self::Dazzle => "dazzle",
            Self::WindowDirty => "window-dirty",
            Self::ClockStep => "clock-step",
            Self::LeftStreaming => "left-streaming",
        }
    }

    /// All names.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        Self::ALL.into_iter().map(Self::name).collect()
    }

    /// What it acts on.
    #[must_use]
    pub fn acts_on(self) -> ActsOn {
        match self {
            Self::BitNoise | Self::LooseConnector | Self::UsbStall => ActsOn::Line,
            Self::PowerCycle => ActsOn::Power,
            Self::Dazzle | Self::WindowDirty => ActsOn::Measurement,
            Self::ClockStep => ActsOn::HostClock,
            Self::LeftStreaming => ActsOn::Start,
        }
    }

    /// Refuses a fault that has nothing to act on.
    ///
    /// # Errors
    /// It cannot be had at that place.
    pub fn check(self, place: Place) -> Result<(), Misplaced> {
        let why = match (self.acts_on(), place) {
            (ActsOn::HostClock, Place::Serve) => {
                "a mock does not step the clock of the machine it runs on; `simulate` steps the clock that stamps its capture"
            }
            (ActsOn::Power, Place::Simulate) => {
                "a simulated capture has no client that would set the devices up again; `serve` has"
            }
            (ActsOn::Start, Place::Simulate) => {
                "a simulated capture begins with devices that stream in any case; `serve` leaves them so for a client"
            }
            _ => return Ok(()),
        };
        Err(Misplaced { preset: self, why })
    }
}

impl FromStr for Preset {
    type Err = UnknownPreset;

    fn from_str(name: &str) -> Result<Self, UnknownPreset> {
        let found = Self::ALL.into_iter().find(|preset| preset.name() == name);
        found.ok_or_else(|| UnknownPreset { name: name.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let error = "rain".parse::<Preset>().unwrap_err().to_string();
        let known = "bit-noise, loose-connector, usb-stall, power-cycle, dazzle, window-dirty, clock-step, left-streaming";
        let unplug = "(`serve --unplug` pulls the plug of one device)";
        assert_eq!(error, format!("unknown fault `rain`; known: {known} {unplug}"));
    }

    #[test]
    fn faults_with_nothing_to_act_on_are_refused_by_name() {
        let refused = |place| -> Vec<&str> {
            Preset::ALL.into_iter().filter(|p| p.check(place).is_err()).map(Preset::name).collect()
        };
        assert_eq!(refused(Place::Serve), ["clock-step"]);
        assert_eq!(refused(Place::Simulate), ["power-cycle", "left-streaming"]);
        let error = Preset::ClockStep.check(Place::Serve).unwrap_err().to_string();
        assert!(error.starts_with("fault `clock-step`: a mock does not step"), "{error}");
    }
}
