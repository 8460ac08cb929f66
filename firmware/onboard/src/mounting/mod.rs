//! Notices while it is recorded that a laser does not sit where the rig says: two lasers exchanged, one upside down, an axis with the
//! wrong sign. A day's recording of such a rig is worth little, and its maker learns of it only at home.
//!
//! Watched is what the odometry and the two lasers say of the same motion and of the same walls (`sense`, `fan`); votes are taken
//! every 0.4 m or 12 degrees, and only what wins clearly is said. Small errors of a mount are not noticed here: `biplane calibrate`
//! finds them.

mod ballot;
mod fan;
mod profile;
mod sense;
mod suspicion;

use biplane_matcher::Pose2;
use biplane_recording::{Port, Rig};

pub use fan::Seat;
pub use sense::Sense;
pub use suspicion::{Mounting, News, Suspicion};

use crate::engine::{MatchedPose, ScanData};
use fan::FanWatch;
use profile::Profile;
use sense::{LevelMount, SenseWatch};

/// A scan of the laser that sees the building is looked at so often at most, nanoseconds.
const LOOK_NS: i64 = 200_000_000;

/// Watches how the lasers sit.
#[derive(Debug)]
pub struct MountWatch {
    level: Option<Level>,
    fan: Option<Fan>,
    told: [Mounting; 2],
}

/// The localising laser.
#[derive(Debug)]
struct Level {
    mount: LevelMount,
    watch: SenseWatch,
}

/// The laser that sees the building.
#[derive(Debug)]
struct Fan {
    /// What is seen of it if it were the level one.
    as_level: SenseWatch,
    watch: FanWatch,
    pending: Option<Pending>,
}

/// A scan that waits for its pose.
#[derive(Debug)]
struct Pending {
    stamp_ns: i64,
    profile: Profile,
}

impl MountWatch {
    /// Of a rig. A localising laser that is not nearly level is not judged, and no other one beside it.
    #[must_use]
    pub fn new(rig: &Rig) -> Self {
        let height_m = rig.horizontal.mount.z;
        let fan =
            rig.vertical.as_ref().filter(|laser| LevelMount::of(&laser.mount).is_none()).map(|laser| Fan {
                as_level: SenseWatch::in_turns(),
                watch: FanWatch::new(&laser.mount, height_m),
                pending: None,
            });
        let level =
            LevelMount::of(&rig.horizontal.mount).map(|mount| Level { mount, watch: SenseWatch::default() });
        Self { level, fan, told: Default::default() }
    }

    /// A scan of the localising laser that was matched.
    pub fn level_scan(&mut self, scan: &ScanData, pose: &MatchedPose) {
        let (Some(level), Some(odom_from_base)) = (&mut self.level, pose.odom_from_base) else { return };
        if !level.watch.wants(&odom_from_base) {
            return;
        }
        let profile = Profile::of(scan, level.mount.mirrored);
        if let Some(fan) = &mut self.fan {
            let map_from_laser = pose.map_from_base * level.mount.base_from_laser;
            fan.watch.level(&map_from_laser, profile.clone());
        }
        level.watch.see(scan.stamp_ns, profile, odom_from_base, &level.mount.base_from_laser);
    }

    /// A scan of the laser that sees the building; its pose comes later.
    pub fn fan_scan(&mut self, scan: &ScanData) {
        let Some(fan) = &mut self.fan else { return };
        let is_due = fan
            .pending
            .as_ref()
            .is_none_or(|pending| !(0..LOOK_NS).contains(&scan.stamp_ns.saturating_sub(pending.stamp_ns)));
        if is_due {
            fan.pending = Some(Pending { stamp_ns: scan.stamp_ns, profile: Profile::of(scan, false) });
        }
    }

    /// The pose of a scan of the laser that sees the building, and the odometry of the same time.
    pub fn fan_posed(&mut self, stamp_ns: i64, map_from_base: &Pose2, odom_from_base: Option<Pose2>) {
        let (Some(level), Some(fan), Some(odom_from_base)) = (&self.level, &mut self.fan, odom_from_base)
        else {
            return;
        };
        let is_pending = fan.pending.as_ref().is_some_and(|pending| pending.stamp_ns == stamp_ns);
        if !is_pending || !fan.as_level.wants(&odom_from_base) {
            return;
        }
        if let Some(Pending { stamp_ns, profile }) = fan.pending.take() {
            fan.watch.see(map_from_base, &profile);
            fan.as_level.see(stamp_ns, profile, odom_from_base, &level.mount.base_from_laser);
        }
    }

    /// What is known of a laser.
    #[must_use]
    pub fn mounting(&self, port: Port) -> Mounting {
        let Some(level) = &self.level else { return Mounting::Unknown };
        let sense = level.watch.verdict();
        let level_sense = self.fan.as_ref().and_then(|fan| fan.as_level.verdict());
        let fan_is_level = level_sense.is_some_and(|sense| sense != Sense::Still);
        let is_no_level = self.fan.as_ref().is_some_and(|fan| fan.as_level.is_surely_none());
        let suspicion = match port {
            Port::Horizontal => Suspicion::of_level(sense, fan_is_level),
            // Where the poses are wrong nothing can be said of the walls.
            Port::Vertical if sense != Some(Sense::AsMounted) => return Mounting::Unknown,
            Port::Vertical if fan_is_level => Some(Suspicion::LiesLevel),
            Port::Vertical => match self.fan.as_ref().and_then(|fan| fan.watch.verdict()) {
                None => return Mounting::Unknown,
                Some(Seat::AsMounted) if is_no_level => None,
                Some(Seat::AsMounted) => return Mounting::Unknown,
                Some(seat) => Some(Suspicion::Sits(seat)),
            },
            Port::Base => return Mounting::Unknown,
        };
        match suspicion {
            Some(suspicion) => Mounting::Suspect(suspicion),
            None if sense.is_none() => Mounting::Unknown,
            None => Mounting::Fits,
        }
    }

    /// What has come up, or has gone, since it was last asked.
    pub fn news(&mut self) -> Option<News> {
        for (place, port) in [Port::Horizontal, Port::Vertical].into_iter().enumerate() {
            let now = self.mounting(port);
            let (was, is) = (self.told[place].suspicion(), now.suspicion());
            if was == is {
                continue;
            }
            self.told[place] = now;
            // What is suspected instead needs no word of what was before.
            let begins = is.is_some();
            return is.or(was).map(|suspicion| News { port, suspicion, begins });
        }
        None
    }
}

#[cfg(test)]
mod tests;
