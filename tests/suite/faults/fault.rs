//! What is done to a line, and from when to when.

use biplane_mock::faults::Preset;
use biplane_mock::rng::Rng;
use biplane_recording::Port;

use crate::rig::S;
use crate::rig::devices::foreign::ForeignDevice;
use crate::rig::line::byte_faults::Harm;
use crate::rig::plan::Happening;

/// Streaming again, after the device answers at the rate that the session last used.
const BACK_KNOWN_NS: i64 = 2 * S;
/// Streaming again, when its rate must be searched.
const BACK_SEARCHED_NS: i64 = 9 * S;
/// Where hardly a telegram passes, a device may be just being set up when that ends: a laser may take 3.2 s
/// for a change that it has acknowledged, of which the answer was damaged; a base that waits for the rest of
/// a packet is woken by the next round, 2.5 s later.
const BACK_ACKNOWLEDGED_NS: i64 = 3_200_000_000 + BACK_KNOWN_NS;
/// Bytes harmed more often than once in so many leave hardly a scan whole.
const HEAVY_ONCE_IN: u32 = 500;

/// What is done to a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The adapter is pulled out of the computer and put back.
    Unplug,
    /// The cable behind it is.
    Cable,
    /// The same, for less than a driver need notice.
    Jerk,
    /// The device loses its power, gets it back and starts.
    PowerCycle,
    /// The same, and a laser takes a minute to start.
    LongStart,
    /// Nothing comes from the device.
    Silence,
    /// Random bytes come instead.
    Garbage,
    /// Presets: those of the line for eight seconds, those of the device or its measurements from the start.
    Noise(&'static [Preset]),
    /// Single bytes from the device are harmed for eight seconds, once in so many.
    Harm(Harm, u32),
    /// Those to the device, from the start, so that it is set up through them.
    HarmAtStart(Harm, u32),
    /// The laser is found at another rate all at once, and streams.
    OtherRate(u32),
    /// Another device is on the line for a while.
    ForeignDevice(ForeignDevice),
    /// From the start on, and then its own.
    ForeignFirst(ForeignDevice),
    /// The base takes any packet before SYNC0 for a SYNC out of turn; whether a session was left open.
    StrictBase(bool),
}

/// A fault in time.
pub(crate) struct Outage {
    /// From then on.
    pub begin_ns: i64,
    /// From then on the device would answer.
    pub answering_ns: i64,
    /// What happens to the line.
    pub happenings: Vec<(i64, Happening)>,
    /// Its measurements are recorded again by then.
    pub back_within_ns: i64,
}

impl Fault {
    /// The fault in a run with these random numbers, at a device that takes so long to start.
    pub(crate) fn outage(self, port: Port, boot_ns: i64, rng: &mut Rng) -> Outage {
        let chance_ns = (rng.unit() * 1e9) as i64;
        let begin_ns = if self.is_at_start() { 0 } else { 3 * S + chance_ns };
        let mut lasts = |from_s: f64, to_s: f64| (rng.between(from_s, to_s) * 1e9) as i64;
        let (length_ns, begins, ends, back_within_ns) = match self {
            Self::Unplug => (lasts(0.1, 9.0), Happening::Unplug, Happening::Plug, BACK_KNOWN_NS),
            Self::Cable => (lasts(1.3, 9.0), Happening::Part, Happening::Join, BACK_KNOWN_NS),
            Self::Jerk => (lasts(0.05, 0.8), Happening::Part, Happening::Join, BACK_KNOWN_NS),
            Self::PowerCycle | Self::LongStart => {
                let within_ns = match port {
                    Port::Base | Port::Imu => BACK_KNOWN_NS,
                    Port::Horizontal | Port::Vertical => BACK_SEARCHED_NS,
                };
                (lasts(0.3, 10.0), Happening::PowerOff, Happening::PowerOn, within_ns)
            }
            Self::Silence => (lasts(1.3, 9.0), Happening::Mute, Happening::Unmute, BACK_KNOWN_NS),
            Self::Garbage => (lasts(1.3, 9.0), Happening::Babble, Happening::Clear, BACK_KNOWN_NS),
            Self::Noise(presets) => {
                let begins = Happening::Faults(presets.to_vec());
                (8 * S, begins, Happening::Faults(Vec::new()), BACK_KNOWN_NS)
            }
            Self::StrictBase(_) => {
                (8 * S, Happening::Faults(Vec::new()), Happening::Faults(Vec::new()), BACK_KNOWN_NS)
            }
            Self::Harm(harm, once_in) => {
                let begins = Happening::Harm([Some((harm, once_in)), None]);
                let within_ns = if once_in < HEAVY_ONCE_IN { BACK_ACKNOWLEDGED_NS } else { BACK_KNOWN_NS };
                (8 * S, begins, Happening::Harm([None; 2]), within_ns)
            }
            Self::HarmAtStart(harm, once_in) => {
                let begins = Happening::Harm([None, Some((harm, once_in))]);
                (8 * S, begins, Happening::Harm([None; 2]), BACK_ACKNOWLEDGED_NS)
            }
            Self::OtherRate(baud) => {
                (0, Happening::OtherRate(baud), Happening::OtherRate(baud), BACK_SEARCHED_NS)
            }
            Self::ForeignDevice(foreign_device) | Self::ForeignFirst(foreign_device) => {
                (lasts(1.3, 9.0), Happening::ForeignDevice(foreign_device), Happening::Own, BACK_KNOWN_NS)
            }
        };
        let ends_ns = begin_ns + length_ns;
        // A lost port is looked for every quarter of a second.
        let seen_ns = if self == Self::Unplug { lasts(0.0, 0.25) } else { 0 };
        let mut happenings = vec![(begin_ns, begins), (ends_ns + seen_ns, ends)];
        if matches!(self, Self::OtherRate(_)) {
            happenings.pop();
        }
        let boot_ns = if matches!(self, Self::PowerCycle | Self::LongStart) { boot_ns } else { 0 };
        let answering_ns = ends_ns + boot_ns;
        Outage { begin_ns, answering_ns, happenings, back_within_ns }
    }

    /// Seeds in a quick run.
    pub(crate) fn few(self) -> u64 {
        if matches!(self, Self::Harm(..) | Self::HarmAtStart(..)) { 1 } else { 2 }
    }

    /// Whether it is there from the start.
    pub(crate) fn is_at_start(self) -> bool {
        matches!(self, Self::HarmAtStart(..) | Self::ForeignFirst(_))
    }

    /// Whether the line goes on under it, be it badly.
    pub(crate) fn is_noise(self) -> bool {
        matches!(self, Self::Noise(_) | Self::Harm(..) | Self::HarmAtStart(..) | Self::StrictBase(_))
    }

    /// Who is there instead of the line's own device.
    pub(crate) fn foreign_device(self) -> Option<ForeignDevice> {
        match self {
            Self::ForeignDevice(foreign_device) | Self::ForeignFirst(foreign_device) => Some(foreign_device),
            _ => None,
        }
    }

    /// The mock's presets in it.
    pub(crate) fn presets(self) -> &'static [Preset] {
        match self {
            Self::Noise(presets) => presets,
            _ => &[],
        }
    }

    /// What it is called.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Unplug => "adapter unplugged, 0.1 to 9 s".to_owned(),
            Self::Cable => "cable pulled, 1.3 to 9 s".to_owned(),
            Self::Jerk => "cable pulled, under 0.8 s".to_owned(),
            Self::PowerCycle => "power-cycle".to_owned(),
            Self::LongStart => "power-cycle, starts in 60 s".to_owned(),
            Self::Silence => "silence, 1.3 to 9 s".to_owned(),
            Self::Garbage => "garbage, 1.3 to 9 s".to_owned(),
            Self::Noise(presets) => {
                presets.iter().map(|preset| preset.name()).collect::<Vec<_>>().join(" + ")
            }
            Self::StrictBase(true) => "a strict base with a session left open".to_owned(),
            Self::StrictBase(false) => "a strict base".to_owned(),
            Self::Harm(harm, once_in) => format!("{}, 1 in {once_in}", harm.name()),
            Self::HarmAtStart(harm, once_in) => {
                format!("{}, 1 in {once_in}, to the device from the start", harm.name())
            }
            Self::OtherRate(baud) => format!("another rate all at once: {baud} Bd"),
            Self::ForeignDevice(foreign_device) => {
                format!("instead of it {}, 1.3 to 9 s", foreign_device.name())
            }
            Self::ForeignFirst(foreign_device) => {
                format!("instead of it {} from the start", foreign_device.name())
            }
        }
    }
}
