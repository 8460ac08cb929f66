//! The truth behind a served world: its surfaces, where the robot was, and where it was at each scan that was
//! sent.
//!
//! Frame `map`: `base_link` at the start of the drive. Stamps are UTC seconds as a host without any delay
//! would give them; the same files as `simulate` writes: `surfaces.ply`, `trajectory.tum` (dense),
//! `poses.tum` and `scans_horizontal.txt` (at each scan's t0), and the vertical laser's.

use super::clock::VirtualClock;
use crate::devices::lms::scans::feed::{Answer, Ask, ScanFeed};
use crate::devices::lms::settings::Variant;
use crate::devices::run::Begun;
use crate::rig::simulated::SimulatedRig;
use crate::simulate::truth::seconds;
use crate::simulate::truth_folder::{TruthError, write_file};
use crate::world::files::ply::write_ply;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Distance of dense poses.
const STEP_NS: i64 = 10_000_000;

/// Poses are written from this long before the drive's start to this long after its end.
const MARGIN_NS: i64 = 2_000_000_000;

/// When the scans of one laser began, on the virtual clock.
#[derive(Clone, Debug, Default)]
pub(super) struct SentScans(Arc<Mutex<Vec<i64>>>);

impl SentScans {
    /// A scan that is sent began at this time.
    pub(super) fn note(&self, t0_ns: i64) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(t0_ns);
    }

    fn times_ns(&self) -> Vec<i64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A feed that notes which scans it gave.
pub(super) struct NotingFeed<F> {
    /// The feed.
    pub feed: F,
    /// Where to.
    pub sent: SentScans,
}

impl<F: ScanFeed> ScanFeed for NotingFeed<F> {
    fn holds(&self, variant: Variant) -> bool {
        self.feed.holds(variant)
    }

    fn next(&mut self, ask: &Ask) -> Answer {
        let answer = self.feed.next(ask);
        if let Answer::Scan(offer) = &answer {
            self.sent.note(ask.t0_ns(offer.start_ns));
        }
        answer
    }

    fn status(&mut self, now_ns: i64) -> u8 {
        self.feed.status(now_ns)
    }
}

/// Writes the truth of one run.
pub(super) struct TruthWriter<'a> {
    /// Folder that is there.
    pub folder: &'a Path,
    /// The world and the drive through it.
    pub rig: &'a SimulatedRig,
    /// The mock's clock.
    pub clock: VirtualClock,
    /// The run.
    pub begun: Begun,
}

impl TruthWriter<'_> {
    /// Surfaces and the whole drive, known as soon as it begins.
    pub(super) fn write_drive(&self) -> Result<(), TruthError> {
        self.file("surfaces.ply", |out| write_ply(out, self.rig.scene().mesh()))?;
        let end_ns = (self.rig.drive_duration_s() * 1e9) as i64 + MARGIN_NS;
        let times = (-MARGIN_NS..=end_ns).step_by(STEP_NS as usize).map(|t_ns| self.begun.start_ns + t_ns);
        self.poses("trajectory.tum", times)
    }

    /// The poses at the scans of one laser.
    pub(super) fn write_scans(&self, name: &str, poses: &str, sent: &SentScans) -> Result<(), TruthError> {
        let times_ns = sent.times_ns();
        self.file(name, |out| {
            times_ns.iter().try_for_each(|t_ns| writeln!(out, "{}", seconds(self.clock.utc_ns(*t_ns))))
        })?;
        self.poses(poses, times_ns.into_iter())
    }

    fn poses(&self, name: &str, mut virtual_ns: impl Iterator<Item = i64>) -> Result<(), TruthError> {
        self.file(name, |out| virtual_ns.try_for_each(|t_ns| self.pose_line(out, t_ns)))
    }

    fn pose_line(&self, out: &mut dyn Write, virtual_ns: i64) -> io::Result<()> {
        let pose = self.rig.map_from_base(virtual_ns - self.begun.start_ns);
        let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation_m, pose.quaternion_xyzw());
        let time = seconds(self.clock.utc_ns(virtual_ns));
        writeln!(out, "{time} {x:.6} {y:.6} {z:.6} {qx:.9} {qy:.9} {qz:.9} {qw:.9}")
    }

    fn file(
        &self,
        name: &str,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), TruthError> {
        write_file(self.folder, name, write)
    }
}
