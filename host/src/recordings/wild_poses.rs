//! Poses that no motion explains: a few kilometers off for a moment, by a flipped bit or a program's slip.
//!
//! A pose belongs to the way driven when its neighbors in time can be reached from it. So the poses fall
//! into chains, each of which some vehicle could have driven; a chain of a few poses beside a long one is
//! left out. Frame and units of the poses; stamps in nanoseconds.

use biplane_geometry::StampedPose;

/// No vehicle with these lasers is faster, meters a second: twice the speed of a car in town, so that a bad
/// stamp condemns no pose.
const FASTEST_M_S: f64 = 50.0;
/// Stamps may be wrong by this much, nanoseconds: logs of whole seconds exist.
const STAMP_ERROR_NS: u64 = 1_000_000_000;
/// A chain with fewer poses than this is no drive: a laser gives as many in a second.
const DRIVE_POSES: usize = 10;
/// And it has less than this share of the longest chain's poses.
const DRIVE_SHARE: f64 = 0.1;
/// Chains that a pose may go on with: the latest. More poses off at once than these are some drive of their
/// own.
const OPEN_CHAINS: usize = 16;

/// Takes out the poses that no motion explains, and says how many they were. The order stays.
pub(crate) fn remove_wild(poses: &mut Vec<StampedPose>) -> usize {
    let chains = chains(poses);
    let mut lengths = vec![0_usize; chains.iter().max().map_or(0, |last| last + 1)];
    chains.iter().for_each(|chain| lengths[*chain] += 1);
    let longest = lengths.iter().copied().max().unwrap_or(0);
    let is_drive = |length: usize| {
        length == longest || length >= DRIVE_POSES || length as f64 >= DRIVE_SHARE * longest as f64
    };
    let before = poses.len();
    let mut chains = chains.iter();
    poses.retain(|_| chains.next().is_none_or(|chain| is_drive(lengths[*chain])));
    before - poses.len()
}

/// The chain that each pose belongs to.
fn chains(poses: &[StampedPose]) -> Vec<usize> {
    let mut by_time: Vec<usize> = (0..poses.len()).collect();
    by_time.sort_by_key(|&index| poses[index].stamp_ns);
    let mut chain_of = vec![0; poses.len()];
    // The last pose of each open chain, and its number; the one that went on last stands last.
    let mut open: Vec<(usize, usize)> = Vec::new();
    let mut count = 0;
    for index in by_time {
        let found = open.iter().rposition(|&(last, _)| is_reached(&poses[last], &poses[index]));
        let chain = found.map_or(count, |place| open.remove(place).1);
        count = count.max(chain + 1);
        open.push((index, chain));
        if open.len() > OPEN_CHAINS {
            open.remove(0);
        }
        chain_of[index] = chain;
    }
    chain_of
}

fn is_reached(from: &StampedPose, to: &StampedPose) -> bool {
    let span_s = to.stamp_ns.abs_diff(from.stamp_ns).saturating_add(STAMP_ERROR_NS) as f64 * 1e-9;
    from.step_m(to) <= FASTEST_M_S * span_s
}

#[cfg(test)]
mod tests {
    use super::{StampedPose, remove_wild};

    /// A drive at 0.5 m/s, ten poses a second.
    fn drive(count: usize) -> Vec<StampedPose> {
        let pose = |index: usize| StampedPose {
            stamp_ns: index as i64 * 100_000_000,
            x_m: 0.05 * index as f64,
            ..StampedPose::default()
        };
        (0..count).map(pose).collect()
    }

    #[test]
    fn a_pose_or_a_few_far_off_are_left_out_wherever_they_stand() {
        for far_m in [200.0, 20_000.0, 9e5] {
            for at in [vec![0], vec![50], vec![99], vec![40, 41, 42], vec![10, 30, 31, 90]] {
                let mut poses = drive(100);
                at.iter().for_each(|&index| poses[index].y_m += far_m);
                assert_eq!(remove_wild(&mut poses), at.len(), "{far_m} {at:?}");
                assert!(
                    poses.iter().all(|pose| pose.y_m == 0.0) && poses.is_sorted_by_key(|pose| pose.stamp_ns)
                );
            }
        }
    }

    #[test]
    fn what_a_vehicle_could_have_driven_stays() {
        // A drive far from the origin, with a long pause, out of order, and one that goes on elsewhere.
        let mut far = drive(100);
        far.iter_mut().for_each(|pose| pose.x_m += 3e5);
        let mut pause = drive(100);
        pause[60..].iter_mut().for_each(|pose| pose.stamp_ns += 3_600_000_000_000);
        let mut carried = drive(100);
        carried[60..].iter_mut().for_each(|pose| pose.x_m += 5_000.0);
        let mut shuffled = drive(100);
        shuffled.swap(3, 80);
        for mut poses in [far, pause, carried, shuffled, drive(1), drive(3), Vec::new()] {
            let before = poses.clone();
            assert_eq!(remove_wild(&mut poses), 0);
            assert_eq!(poses, before);
        }
    }

    #[test]
    fn a_thin_log_of_whole_seconds_loses_nothing() {
        let mut poses = drive(100);
        for (index, pose) in poses.iter_mut().enumerate() {
            (pose.stamp_ns, pose.x_m) = ((index as i64 / 2) * 1_000_000_000, 1.5 * index as f64);
        }
        assert_eq!(remove_wild(&mut poses), 0);
    }

    #[test]
    fn many_wild_poses_are_still_told_from_the_drive() {
        let mut poses = drive(1000);
        for index in (5..1000).step_by(10) {
            (poses[index].x_m, poses[index].y_m) = (1e4 * index as f64, -1e4 * (index % 7) as f64);
        }
        assert_eq!(remove_wild(&mut poses), 100);
    }
}
