//! What was really there: poses, scan times and surfaces of a simulated drive, as files.
//!
//! | file | content |
//! |---|---|
//! | `poses.tum` | `base_link` in `map` at each horizontal scan's first beam: `t x y z qx qy qz qw` |
//! | `poses_vertical.tum` | the same for the vertical laser |
//! | `trajectory.tum` | the same every 10 ms |
//! | `scans_horizontal.txt`, `scans_vertical.txt` | times of the scans' first beams, one a line |
//! | `truth.json` | rooms, walls, openings of a world from an IFC file: `building.json`'s schema, in `map` |
//! | `surfaces.ply` | all surfaces in `map`, an int property `plane` a face: -1 = no plane |
//! | `truth.json` | the round things of a built-in world: `cylinders`, axes in `map` |
//!
//! Times in seconds of the capture's clock with nine decimals; meters.

use crate::rig::simulated::{LaserRole, SimulatedRig};
use crate::simulate::truth_folder::{TruthError, write_file};
use crate::world::built_in::round::RoundThing;
use crate::world::files::ply::write_ply;
use biplane_ifc::Plan;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Step of `trajectory.tum`.
const STEP_NS: i64 = 10_000_000;

/// Writes the truth of one drive into a directory.
pub struct Truth<'a> {
    rig: &'a SimulatedRig,
    directory: PathBuf,
    /// Time of the capture's clock at which the devices' clock is zero.
    zero_ns: i64,
}

impl<'a> Truth<'a> {
    /// For a directory that is there ([`crate::simulate::truth_folder::prepare`]). `zero_ns` is added to
    /// device times.
    #[must_use]
    pub fn new(rig: &'a SimulatedRig, directory: &Path, zero_ns: i64) -> Self {
        Self { rig, directory: directory.to_owned(), zero_ns }
    }

    /// Writes `surfaces.ply`.
    pub fn surfaces(&self) -> Result<(), TruthError> {
        self.file("surfaces.ply", |out| write_ply(out, self.rig.scene().mesh()))
    }

    /// Writes `truth.json`: a plan of the world's own frame, in `map`.
    pub fn plan(&self, plan: &Plan) -> Result<(), TruthError> {
        let map_from_world = self.rig.drive().map_from_world();
        let plan = plan.moved(|[x, y]| {
            let at = map_from_world.apply([x, y, plan.floor_z_m]);
            [at[0], at[1]]
        });
        self.file("truth.json", |out| serde_json::to_writer_pretty(out, &plan).map_err(io::Error::from))
    }

    /// Writes `truth.json`: the round things of the world, which are given in its own frame.
    pub fn round_things(&self, rounds: &[RoundThing]) -> Result<(), TruthError> {
        let map_from_world = self.rig.drive().map_from_world();
        let cylinders: Vec<RoundThing> = rounds.iter().map(|thing| thing.moved(&map_from_world)).collect();
        self.file("truth.json", |out| {
            write!(out, "{{\"cylinders\": [")?;
            for (number, thing) in cylinders.iter().enumerate() {
                write!(out, "{}\n  {}", if number == 0 { "" } else { "," }, thing.json())?;
            }
            writeln!(out, "\n]}}")
        })
    }

    /// Writes `trajectory.tum` from `from_ns` to `to_ns` (device time).
    pub fn trajectory(&self, from_ns: i64, to_ns: i64) -> Result<(), TruthError> {
        self.file("trajectory.tum", |out| {
            (from_ns..=to_ns).step_by(STEP_NS as usize).try_for_each(|t_ns| self.pose_line(out, t_ns))
        })
    }

    /// Writes times and poses of a laser's scans (device times of their first beams).
    pub fn scans(&self, role: LaserRole, first_beams_ns: &[i64]) -> Result<(), TruthError> {
        let (times, poses) = match role {
            LaserRole::Horizontal => ("scans_horizontal.txt", "poses.tum"),
            LaserRole::Vertical => ("scans_vertical.txt", "poses_vertical.tum"),
        };
        self.file(times, |out| {
            first_beams_ns.iter().try_for_each(|t_ns| writeln!(out, "{}", seconds(self.zero_ns + t_ns)))
        })?;
        self.file(poses, |out| first_beams_ns.iter().try_for_each(|t_ns| self.pose_line(out, *t_ns)))
    }

    fn pose_line(&self, out: &mut dyn Write, t_ns: i64) -> io::Result<()> {
        let pose = self.rig.map_from_base(t_ns);
        let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation_m, pose.quaternion_xyzw());
        let time = seconds(self.zero_ns + t_ns);
        writeln!(out, "{time} {x:.6} {y:.6} {z:.6} {qx:.9} {qy:.9} {qz:.9} {qw:.9}")
    }

    fn file(
        &self,
        name: &str,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), TruthError> {
        write_file(&self.directory, name, write)
    }
}

/// Nanoseconds as seconds with nine decimals, exactly.
#[must_use]
pub fn seconds(time_ns: i64) -> String {
    let sign = if time_ns < 0 { "-" } else { "" };
    let magnitude = time_ns.unsigned_abs();
    format!("{sign}{}.{:09}", magnitude / 1_000_000_000, magnitude % 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::seconds;

    #[test]
    fn times_keep_every_nanosecond() {
        assert_eq!(seconds(1_000_000_000_000_000_007), "1000000000.000000007");
        assert_eq!(seconds(-1_500_000_000), "-1.500000000");
        assert_eq!(seconds(-1), "-0.000000001");
    }
}
