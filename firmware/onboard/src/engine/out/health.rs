//! The state of a run as plain numbers, taken once a second: what flows, what is damaged, what is late.

use biplane_matcher::{MapSize, Odometry, OdometryScale, Outcome};
use biplane_wire::Counts;

use crate::session::inertial::health::InertialHealth;
use crate::session::lms::health::LaserHealth;
use crate::types::mount_fault::Mounting;

/// What is wrong with a line, in two or three words.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum LineFault {
    /// Nothing.
    #[default]
    None,
    /// This, still.
    Lasts(&'static str),
    /// This, and it is over; said once.
    Over(&'static str),
}

/// Telegrams that arrive damaged.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct DamagedShare {
    /// Their share, 0 to 1.
    pub share: f64,
    /// Whether some of them were cut because this computer read them too late.
    pub is_overrun: bool,
}

/// The state of one serial line and its device.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct LineHealth {
    /// Whether there is such a device in the rig.
    pub present: bool,
    /// Whether measurements flow.
    pub streaming: bool,
    /// What is wrong.
    pub fault: LineFault,
    /// Rate of the line, bits per second.
    pub baud: u32,
    /// Its telegrams that arrived damaged in the last ten seconds, while these are too many.
    pub damaged: Option<DamagedShare>,
    /// Account of its bytes.
    pub counts: Option<Counts>,
    /// Scans, odometry reports or samples so far.
    pub measurements: u64,
    /// The same in the last second, a second.
    pub rate_hz: f64,
    /// Times that the session had to start again.
    pub restarts: u64,
    /// Times that its port's buffer was full before this computer read it.
    pub overruns: u64,
    /// From a measurement's stamp to its arrival, the largest in the last second, seconds.
    pub latency_s: f64,
    /// What a unit of a base's position is taken as, meters; `None` for a base without such units, and before
    /// it reports.
    pub metres_per_tick: Option<f64>,
    /// At which distance a laser's scans come, if that is no whole number of turns of a mirror at 75 Hz,
    /// milliseconds.
    pub odd_interval_ms: Option<f64>,
    /// What a laser's telegrams say of it; `None` for another device.
    pub laser: Option<LaserHealth>,
    /// Whether a laser sits where the rig says, as far as what it sees tells; `None` for another device.
    pub mounting: Option<Mounting>,
}

/// The state of the matcher.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct MatcherHealth {
    /// Poses so far.
    pub poses: u64,
    /// Poses that follow the odometry because the match failed.
    pub unmatched: u64,
    /// What became of the last scan.
    pub last_outcome: Option<Outcome>,
    /// What became of its odometry.
    pub last_odometry: Odometry,
    /// Scans whose odometry was not taken as it is: it was missing, jumped, stalled, was contradicted by
    /// scans, or was reversed.
    pub distrusted: [u64; 5],
    /// Its score, 0 to 1.
    pub last_score: f64,
    /// Its iterations.
    pub last_iterations: u32,
    /// From a scan's stamp to its pose, the largest in the last second, seconds.
    pub latency_s: f64,
    /// The last pose of `base_link` in `map`: x and y in meters, heading in radians.
    pub last_pose: [f64; 3],
    /// Scans that wait for odometry.
    pub waiting: usize,
    /// Vertical scans that wait for a pose.
    pub waiting_vertical: usize,
    /// What the map uses of its memory.
    pub map: MapSize,
    /// What a meter and a radian of the odometry truly are.
    pub odometry_scale: OdometryScale,
}

impl MatcherHealth {
    /// The share of the map's memory that is in use, percent, rounded down.
    pub fn map_filled_percent(&self) -> u32 {
        (100.0 * self.map.filling()) as u32
    }

    /// Takes note of what became of a scan's odometry.
    pub fn note_odometry(&mut self, odometry: Odometry) {
        self.last_odometry = odometry;
        match odometry {
            Odometry::Used => {}
            Odometry::Missing => self.distrusted[0] += 1,
            Odometry::Jumped => self.distrusted[1] += 1,
            Odometry::Stalled => self.distrusted[2] += 1,
            Odometry::Contradicted => self.distrusted[3] += 1,
            Odometry::Reversed => self.distrusted[4] += 1,
        }
    }
}

/// The state of a run.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Health {
    /// The laser that localizes.
    pub horizontal: LineHealth,
    /// The laser that sees the building.
    pub vertical: LineHealth,
    /// The base.
    pub base: LineHealth,
    /// The inertial unit on a line.
    pub imu: LineHealth,
    /// What its messages say of it.
    pub inertial: Option<InertialHealth>,
    /// The matcher.
    pub matcher: MatcherHealth,
    /// Reads, messages, requests to devices and states that a full queue has dropped so far.
    pub dropped: u64,
    /// Events and states that the log and the status were not told so far, because whoever reads them does
    /// not keep up.
    pub unreported: u64,
    /// Stamps that stepped back so far.
    pub backward_stamps: u64,
    /// Times that the clock of the input went back, so far.
    pub clock_steps: u64,
}
