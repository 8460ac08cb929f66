//! What a Hokuyo laser is when it is switched on, and how it differs from its paper.

use biplane_wire::scip::{Delivery, Parameters, ScanRequest};

const MS: i64 = 1_000_000;
/// Rate of an RS-232 line after power-on.
const POWER_ON_BAUD: u32 = 19_200;

/// In which state a client finds a laser.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScipState {
    /// Waiting for requests.
    #[default]
    Idle,
    /// Streaming, because the last client died.
    Streaming,
    /// In the mode in which its clock is read.
    Clock,
    /// Speaking SCIP 1.1.
    Scip1,
}

/// On what line it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScipLink {
    /// RS-232 at a rate that can be set, in Bd.
    Serial(u32),
    /// USB: any rate will do.
    Usb,
    /// TCP.
    Network,
}

/// A laser as it leaves the factory, and how it differs from its paper.
#[derive(Clone, Debug, PartialEq)]
pub struct ScipParams {
    /// Model as `PP` tells it.
    pub model: String,
    /// Its firmware.
    pub firmware: String,
    /// Its serial number.
    pub serial: String,
    /// Geometry, reach and rate.
    pub parameters: Parameters,
    /// The value of a step without an echo.
    pub no_echo: u32,
    /// Whether it knows intensities and several echoes; others do not answer when they are asked for them.
    pub has_intensity: bool,
    /// Whether a scan leaves at the next millisecond of its clock, as a UST does, or at once.
    pub waits_for_tick: bool,
    /// How it is found.
    pub state: ScipState,
    /// Its line.
    pub link: ScipLink,
    /// From a request to its answer.
    pub latency_ns: i64,
    /// From power-on until it answers; one on a network takes connections before.
    pub boot_ns: i64,
    /// Its clock at time 0, in ms.
    pub first_ms: u32,
    /// By how many millionths its clock is fast.
    pub clock_ppm: f64,
    /// By how many millionths its mirror turns slower than it says.
    pub slow_ppm: f64,
    /// Where its mirror is at time 0, nanoseconds of a turn.
    pub phase_ns: i64,
}

impl ScipParams {
    /// A laser of this type: `UST-10LX`, `UST-20LX`, `UTM-30LX`, `UTM-30LX-EW`, `UXM-30LX-E`, `URG-04LX`.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        let utm = parameters([23, 60_000], 1440, [0, 540, 1080], 2400);
        match name {
            "UST-10LX" => {
                Some(Self::new(name, parameters([20, 30_000], 1440, [0, 540, 1080], 2400), ScipLink::Network))
            }
            "UST-20LX" => {
                Some(Self::new(name, parameters([20, 60_000], 1440, [0, 540, 1080], 2400), ScipLink::Network))
            }
            "UTM-30LX" => Some(Self::new(name, utm, ScipLink::Usb)),
            "UTM-30LX-EW" => Some(Self::new(name, utm, ScipLink::Network)),
            "UXM-30LX-E" => {
                let uxm = parameters([100, 100_000], 1440, [0, 380, 760], 1200);
                Some(Self::new(name, uxm, ScipLink::Network))
            }
            "URG-04LX" => {
                let urg = parameters([20, 5_600], 1024, [44, 384, 725], 600);
                Some(Self::new(name, urg, ScipLink::Serial(POWER_ON_BAUD)))
            }
            _ => None,
        }
    }

    fn new(name: &str, parameters: Parameters, link: ScipLink) -> Self {
        let is_urg = name == "URG-04LX";
        let is_ust = name.starts_with("UST");
        Self {
            model: format!("{name}(Hokuyo Automatic Co.,Ltd.)"),
            firmware: if is_urg { "3.1.04(02/Aug./2007)" } else { "1.20.02(02/Aug./2014)" }.to_owned(),
            serial: "H0706400".to_owned(),
            parameters,
            no_echo: match (is_urg, is_ust) {
                (true, _) => 0,
                (_, true) => 65_533,
                _ => 1,
            },
            has_intensity: !is_urg,
            waits_for_tick: is_ust,
            // An URG-04LX speaks the old protocol whenever it is switched on.
            state: if is_urg { ScipState::Scip1 } else { ScipState::Idle },
            link,
            latency_ns: MS,
            boot_ns: 1_500 * MS,
            first_ms: 4_821_609,
            clock_ppm: 40.0,
            slow_ppm: 700.0,
            phase_ns: 0,
        }
    }

    /// Such a laser on the line of a rig: at an address, or on a port at its rate in Bd.
    #[must_use]
    pub fn on_line(self, is_network: bool, baud: u32) -> Self {
        let link = match (is_network, self.link) {
            (true, _) => ScipLink::Network,
            (false, ScipLink::Serial(_)) => ScipLink::Serial(baud),
            (false, _) => ScipLink::Usb,
        };
        Self { link, ..self }
    }

    /// One turn of the mirror, nanoseconds.
    #[must_use]
    pub fn turn_ns(&self) -> i64 {
        (self.parameters.turn_ns() * (1.0 + self.slow_ppm * 1e-6)).round() as i64
    }

    /// The rate of its line after power-on; 0 where any will do.
    pub(super) fn power_on_baud(&self) -> u32 {
        match self.link {
            ScipLink::Serial(_) => POWER_ON_BAUD,
            ScipLink::Usb | ScipLink::Network => 0,
        }
    }
}

impl Default for ScipParams {
    /// A UST-20LX.
    fn default() -> Self {
        Self::new("UST-20LX", parameters([20, 60_000], 1440, [0, 540, 1080], 2400), ScipLink::Network)
    }
}

/// Turns of the mirror from a scan to the next.
#[must_use]
pub fn turns(request: &ScanRequest) -> i64 {
    match request.delivery {
        Delivery::Once => 1,
        Delivery::Stream { skip, .. } => 1 + i64::from(skip),
    }
}

fn parameters(
    [min_mm, max_mm]: [u32; 2],
    steps: u32,
    [first, front, last]: [u16; 3],
    rpm: u32,
) -> Parameters {
    Parameters {
        min_mm,
        max_mm,
        steps_per_turn: steps,
        first_step: first,
        last_step: last,
        front_step: front,
        rpm,
    }
}
