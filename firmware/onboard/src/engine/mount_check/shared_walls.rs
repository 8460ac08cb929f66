//! Whether the laser that sees the building sees the same walls as the one that localizes, where the rig says
//! that it sits.
//!
//! Its points at about the height of the localizing laser are looked up in what that laser has seen from
//! where the base has come: there they lie on a surface, or in what was seen to be free. The same is asked
//! for other ways in which the laser may sit.

use biplane_geometry::PortableMath;
use biplane_matcher::Pose2;
use biplane_recording::rig::Mount;

use crate::engine::mount_check::range_profile::{Profile, Visibility};
use crate::engine::mount_check::vote::VoteCount;
use crate::types::mount_fault::MountHypothesis;

/// Level scans that are kept.
const VIEWS: usize = 48;
/// Points so far below the localizing laser are compared, meters.
const BELOW_M: f64 = 0.3;
/// And so far above.
const ABOVE_M: f64 = 0.6;
/// Fewer points that are known to be surface or free say nothing.
const FEWEST: usize = 8;
/// A difference of shares below this says nothing.
const MIN_LEAD: f32 = 0.3;
/// Another way to sit must explain so much of what is seen.
const MIN_SHARE: f32 = 0.6;
/// How fast mean shares follow.
const FOLLOWING: f32 = 0.15;
/// Beams that point up or down more steeply than this (sine) tell which of the two it is.
const STEEP: f64 = 0.85;
/// Such a beam has hit the floor if its range tells the laser's height to this, meters, and to a twentieth.
const FLOOR_M: f64 = 0.05;
/// A point is below the floor by this, meters; a ramp, a doorstep and a mount's small error are not.
const UNDER_M: f64 = 0.25;
/// And not further away than this, meters.
const UNDER_FAR_M: f32 = 5.0;
/// Shares of beams above which they tell that the laser is upside down, or points below the floor.
const MAXIMUM: f32 = 0.7;

/// The ways that are told apart by walls.
const WALLS: [MountHypothesis; 2] = [MountHypothesis::Mirrored, MountHypothesis::Quartered];
/// The ways that are told by the floor.
const FLOOR: [MountHypothesis; 3] = [MountHypothesis::Down, MountHypothesis::Up, MountHypothesis::Under];

/// Level scans, and where they were taken.
#[derive(Debug)]
struct Views {
    views: Box<heapless::Deque<(Pose2, Profile), VIEWS>>,
}

impl Views {
    /// What they say of a point in the map, meters: one that sees a surface there outweighs all that saw
    /// through.
    fn visibility(&self, point_m: [f64; 2]) -> Visibility {
        let mut visibility = Visibility::Unseen;
        for (laser_from_map, profile) in self.views.iter() {
            match profile.visibility(laser_from_map.transform(point_m)) {
                Visibility::Surface => return Visibility::Surface,
                Visibility::Free => visibility = Visibility::Free,
                Visibility::Unseen => {}
            }
        }
        visibility
    }
}

/// Watches the laser that sees the building.
#[derive(Debug)]
pub(crate) struct SharedWallCheck {
    mount: Mount,
    matrix: [[f64; 3]; 3],
    /// Height of the localizing laser, meters.
    height_m: f64,
    views: Views,
    walls: [VoteCount; WALLS.len()],
    means: [f32; WALLS.len()],
    floor: [VoteCount; FLOOR.len()],
    as_mounted: VoteCount,
}

impl SharedWallCheck {
    /// Of a laser with this mount, beside a localizing one at this height, meters.
    #[must_use]
    pub(crate) fn new(mount: &Mount, height_m: f64) -> Self {
        Self {
            mount: *mount,
            matrix: mount.matrix(),
            height_m,
            views: Views { views: Box::new(heapless::Deque::new()) },
            walls: Default::default(),
            means: Default::default(),
            floor: Default::default(),
            as_mounted: VoteCount::default(),
        }
    }

    /// A level scan, taken from there.
    pub(crate) fn level(&mut self, map_from_laser: &Pose2, profile: Profile) {
        if self.views.views.is_full() {
            self.views.views.pop_front();
        }
        // There is room now.
        let _ = self.views.views.push_back((map_from_laser.inverse(), profile));
    }

    /// A scan of the laser itself.
    pub(crate) fn see(&mut self, map_from_base: &Pose2, profile: &Profile) {
        self.vote_on_walls(map_from_base, profile);
        let leads = self.floor_leads(profile);
        for (vote_count, lead) in self.floor.iter_mut().zip(leads) {
            vote_count.vote(lead, 0.0);
        }
    }

    /// How it sits; `None` while that cannot be told.
    #[must_use]
    pub(crate) fn verdict(&self) -> Option<MountHypothesis> {
        let floor = FLOOR.into_iter().zip(self.floor).find(|(_, vote_count)| vote_count.is_won());
        if let Some((hypothesis, _)) = floor {
            return Some(hypothesis);
        }
        let walls = WALLS.into_iter().zip(self.walls).zip(self.means);
        let best = walls
            .filter(|((_, vote_count), mean)| vote_count.is_won() && *mean >= MIN_SHARE)
            .max_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some(((hypothesis, _), _)) = best {
            return Some(hypothesis);
        }
        self.as_mounted.is_won().then_some(MountHypothesis::AsMounted)
    }

    fn vote_on_walls(&mut self, map_from_base: &Pose2, profile: &Profile) {
        let share = |hypothesis| self.share(hypothesis, map_from_base, profile);
        let Some(as_mounted) = share(MountHypothesis::AsMounted) else { return };
        let others = WALLS.map(share);
        self.as_mounted.vote(as_mounted - MIN_SHARE, 0.0);
        for (place, other) in others.into_iter().enumerate() {
            let Some(other) = other else { continue };
            self.walls[place].vote(other - as_mounted, MIN_LEAD);
            self.means[place] += FOLLOWING * (other - self.means[place]);
        }
    }

    /// The share of the low points that lie on surfaces, of those that lie on surfaces or in the free.
    fn share(&self, hypothesis: MountHypothesis, map_from_base: &Pose2, profile: &Profile) -> Option<f32> {
        let (mut on_surface, mut known) = (0_usize, 0_usize);
        for (angle_rad, range_m) in profile.hits() {
            let [x_m, y_m, z_m] = self.point_m(hypothesis, angle_rad, range_m);
            if !(-BELOW_M..=ABOVE_M).contains(&(z_m - self.height_m)) {
                continue;
            }
            match self.views.visibility(map_from_base.transform([x_m, y_m])) {
                Visibility::Unseen => {}
                Visibility::Free => known += 1,
                Visibility::Surface => {
                    known += 1;
                    on_surface += 1;
                }
            }
        }
        (known >= FEWEST).then(|| on_surface as f32 / known as f32)
    }

    /// A point in the base, meters, of a laser that sits like this.
    fn point_m(&self, hypothesis: MountHypothesis, angle_rad: f32, range_m: f32) -> [f64; 3] {
        let angle_rad = if hypothesis == MountHypothesis::Mirrored { -angle_rad } else { angle_rad };
        let [dx, dy, dz] = self.direction(angle_rad);
        let range_m = f64::from(range_m);
        let [dx, dy] = if hypothesis == MountHypothesis::Quartered { [-dy, dx] } else { [dx, dy] };
        [self.mount.x + range_m * dx, self.mount.y + range_m * dy, self.mount.z + range_m * dz]
    }

    /// A beam's direction in the base.
    fn direction(&self, angle_rad: f32) -> [f64; 3] {
        let (sin, cos) = f64::from(angle_rad).portable_sin_cos();
        self.matrix.map(|row| row[0] * cos + row[1] * sin)
    }

    /// What a scan says for each of [`FLOOR`]: above 0 for it, below against it.
    fn floor_leads(&self, profile: &Profile) -> [f32; FLOOR.len()] {
        let mut up = Share::default();
        let mut down = Share::default();
        let mut under = Share::default();
        for (angle_rad, range_m) in profile.hits() {
            let dz = self.direction(angle_rad)[2];
            let rise_m = f64::from(range_m) * dz;
            let tolerance_m = FLOOR_M + self.mount.z / 20.0;
            if dz > STEEP {
                up.add((rise_m - self.mount.z).abs() < tolerance_m);
            }
            if dz < -STEEP {
                down.add(-rise_m > self.mount.z + UNDER_M);
            }
            if dz < 0.0 && range_m < UNDER_FAR_M {
                under.add(self.mount.z + rise_m < -UNDER_M);
            }
        }
        [up, down, under].map(|share| share.of_all() - MAXIMUM)
    }
}

#[derive(Copy, Clone, Debug, Default)]
struct Share {
    yes: usize,
    all: usize,
}

impl Share {
    fn add(&mut self, yes: bool) {
        self.yes += usize::from(yes);
        self.all += 1;
    }

    /// Nothing where there are few.
    fn of_all(self) -> f32 {
        if self.all < FEWEST { 0.0 } else { self.yes as f32 / self.all as f32 }
    }
}
