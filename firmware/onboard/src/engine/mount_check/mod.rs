//! Notices while it is recorded that a laser does not sit where the rig says: two lasers exchanged, one
//! upside down, an axis with the wrong sign. A day's recording of such a rig is worth little, and its maker
//! learns of it only at home.
//!
//! Watched is what the odometry and the two lasers say of the same motion and of the same walls (`sense`,
//! `fan`); votes are taken every 0.4 m or 12 degrees, and only what wins clearly is said. Small errors of a
//! mount are not noticed here: `biplane calibrate` finds them.

pub(crate) mod motion_agreement;
pub(crate) mod news;
pub(crate) mod range_profile;
pub(crate) mod shared_walls;
#[cfg(test)]
mod tests;
pub(crate) mod vote;

use biplane_matcher::Pose2;
use biplane_recording::{Port, Rig};

use crate::engine::localize::interpolated_poses::MatchedPose;
use crate::engine::mount_check::motion_agreement::{LevelMount, SenseWatch};
use crate::engine::mount_check::news::News;
use crate::engine::mount_check::range_profile::Profile;
use crate::engine::mount_check::shared_walls::SharedWallCheck;
use crate::engine::scan_data::ScanData;
use crate::types::mount_fault::MountFault;
use crate::types::mount_fault::MountHypothesis;
use crate::types::mount_fault::Mounting;
use crate::types::mount_fault::Sense;

/// A scan of the laser that sees the building is looked at so often at most, nanoseconds.
const LOOK_NS: i64 = 200_000_000;

/// Watches how the lasers sit.
#[derive(Debug)]
pub(crate) struct MountWatch {
    level: Option<Level>,
    vertical_laser: Option<VerticalLaser>,
    reported: [Mounting; 2],
}

/// The localizing laser.
#[derive(Debug)]
struct Level {
    mount: LevelMount,
    watch: SenseWatch,
}

/// The laser that sees the building.
#[derive(Debug)]
struct VerticalLaser {
    /// What is seen of it if it were the level one.
    as_level: SenseWatch,
    watch: SharedWallCheck,
    pending: Option<Pending>,
}

/// A scan that waits for its pose.
#[derive(Debug)]
struct Pending {
    stamp_ns: i64,
    profile: Profile,
}

impl MountWatch {
    /// Of a rig. A localizing laser that is not nearly level is not judged, and no other one beside it.
    #[must_use]
    pub(crate) fn new(rig: &Rig) -> Self {
        let height_m = rig.horizontal.mount.z;
        let vertical_laser =
            rig.vertical.as_ref().filter(|laser| LevelMount::of(&laser.mount).is_none()).map(|laser| {
                VerticalLaser {
                    as_level: SenseWatch::in_turns(),
                    watch: SharedWallCheck::new(&laser.mount, height_m),
                    pending: None,
                }
            });
        let level =
            LevelMount::of(&rig.horizontal.mount).map(|mount| Level { mount, watch: SenseWatch::default() });
        Self { level, vertical_laser, reported: Default::default() }
    }

    /// A scan of the localizing laser that was matched.
    pub(crate) fn level_scan(&mut self, scan: &ScanData, pose: &MatchedPose) {
        let (Some(level), Some(odom_from_base)) = (&mut self.level, pose.odom_from_base) else { return };
        if !level.watch.wants(&odom_from_base) {
            return;
        }
        let profile = Profile::of(scan, level.mount.mirrored);
        if let Some(vertical_laser) = &mut self.vertical_laser {
            let map_from_laser = pose.map_from_base * level.mount.base_from_laser;
            vertical_laser.watch.level(&map_from_laser, profile.clone());
        }
        level.watch.see(scan.stamp_ns, profile, odom_from_base, &level.mount.base_from_laser);
    }

    /// A scan of the laser that sees the building; its pose comes later.
    pub(crate) fn vertical_scan(&mut self, scan: &ScanData) {
        let Some(vertical_laser) = &mut self.vertical_laser else { return };
        let is_due = vertical_laser
            .pending
            .as_ref()
            .is_none_or(|pending| !(0..LOOK_NS).contains(&scan.stamp_ns.saturating_sub(pending.stamp_ns)));
        if is_due {
            vertical_laser.pending =
                Some(Pending { stamp_ns: scan.stamp_ns, profile: Profile::of(scan, false) });
        }
    }

    /// The pose of a scan of the laser that sees the building, and the odometry of the same time.
    pub(crate) fn vertical_posed(
        &mut self,
        stamp_ns: i64,
        map_from_base: &Pose2,
        odom_from_base: Option<Pose2>,
    ) {
        let (Some(level), Some(vertical_laser), Some(odom_from_base)) =
            (&self.level, &mut self.vertical_laser, odom_from_base)
        else {
            return;
        };
        let is_pending = vertical_laser.pending.as_ref().is_some_and(|pending| pending.stamp_ns == stamp_ns);
        if !is_pending || !vertical_laser.as_level.wants(&odom_from_base) {
            return;
        }
        if let Some(Pending { stamp_ns, profile }) = vertical_laser.pending.take() {
            vertical_laser.watch.see(map_from_base, &profile);
            vertical_laser.as_level.see(stamp_ns, profile, odom_from_base, &level.mount.base_from_laser);
        }
    }

    /// What is known of a laser.
    #[must_use]
    pub(crate) fn mounting(&self, port: Port) -> Mounting {
        let Some(level) = &self.level else { return Mounting::Unknown };
        let sense = level.watch.verdict();
        let level_sense =
            self.vertical_laser.as_ref().and_then(|vertical_laser| vertical_laser.as_level.verdict());
        let vertical_is_level = level_sense.is_some_and(|sense| sense != Sense::Still);
        let is_no_level = self
            .vertical_laser
            .as_ref()
            .is_some_and(|vertical_laser| vertical_laser.as_level.is_surely_none());
        let mount_fault = match port {
            Port::Horizontal => MountFault::of_level(sense, vertical_is_level),
            // Where the poses are wrong nothing can be said of the walls.
            Port::Vertical if sense != Some(Sense::AsMounted) => return Mounting::Unknown,
            Port::Vertical if vertical_is_level => Some(MountFault::LiesLevel),
            Port::Vertical => {
                match self.vertical_laser.as_ref().and_then(|vertical_laser| vertical_laser.watch.verdict()) {
                    None => return Mounting::Unknown,
                    Some(MountHypothesis::AsMounted) if is_no_level => None,
                    Some(MountHypothesis::AsMounted) => return Mounting::Unknown,
                    Some(hypothesis) => Some(MountFault::Sits(hypothesis)),
                }
            }
            Port::Base | Port::Imu => return Mounting::Unknown,
        };
        match mount_fault {
            Some(mount_fault) => Mounting::Suspect(mount_fault),
            None if sense.is_none() => Mounting::Unknown,
            None => Mounting::Fits,
        }
    }

    /// What has come up, or has gone, since it was last asked.
    pub(crate) fn news(&mut self) -> Option<News> {
        for (place, port) in [Port::Horizontal, Port::Vertical].into_iter().enumerate() {
            let now = self.mounting(port);
            let (was, is) = (self.reported[place].mount_fault(), now.mount_fault());
            if was == is {
                continue;
            }
            self.reported[place] = now;
            // What is suspected instead needs no word of what was before.
            let begins = is.is_some();
            return is.or(was).map(|mount_fault| News { port, mount_fault, begins });
        }
        None
    }
}
