//! The floor map of a run: the beams of its horizontal laser at their poses, drawn into an occupancy grid.
//!
//! Frame `map`, meters. A beam that saw nothing says nothing: glass, black cloth and an open door look the
//! same to it.

pub(crate) mod map_files;
pub(crate) mod map_image;
#[cfg(feature = "cli")]
pub(crate) mod map_read;
pub(crate) mod picture;

use biplane_geometry::PortableMath;
use biplane_recording::Topic;
use biplane_recording::messages::LaserScan;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::recordings::run::{Run, RunError, scan_geometry_of};
use crate::recordings::scan_geometry::ScanGeometry;
use crate::slam::occupancy::OccupancyGrid;
use crate::slam::occupancy::OccupancyParams;
use crate::slam::occupancy::Ray;

/// Echoes nearer than this are the robot itself, meters.
const NEAREST_M: f32 = 0.05;
/// Poses farther apart than this are not bridged within a scan.
const LONGEST_GAP_NS: i64 = 1_000_000_000;

/// How a floor map is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FloorMapParams {
    /// The grid.
    pub grid: OccupancyParams,
    /// A scan is drawn when the robot has moved this far since the last one that was, meters. Larger saves
    /// time; from a cell's size on walls fray.
    pub every_m: f64,
    /// Or when it has turned this far, degrees. Larger saves time and leaves gaps between beams far away.
    pub every_deg: f64,
    /// Or when this much time has passed, seconds: who walks by is erased. Larger saves time where the robot
    /// stands.
    pub every_s: f64,
}

impl Default for FloorMapParams {
    fn default() -> Self {
        Self { grid: OccupancyParams::default(), every_m: 0.02, every_deg: 0.5, every_s: 1.0 }
    }
}

impl FloorMapParams {
    /// Whether a scan at this pose tells something that the last one did not.
    fn is_news(&self, last: Option<&StampedPose>, pose: &StampedPose) -> bool {
        let Some(last) = last else { return true };
        let moved_m = (pose.x_m - last.x_m).portable_hypot(pose.y_m - last.y_m);
        moved_m >= self.every_m
            || last.turn_rad(pose).abs().to_degrees() >= self.every_deg
            || pose.stamp_ns.abs_diff(last.stamp_ns) as f64 >= self.every_s * 1e9
    }
}

/// Draws the horizontal scans of a run. `poses` holds one pose a scan, in file order; scans without one are
/// left out.
///
/// # Errors
/// When the recording is damaged or says nothing of the robot.
pub(crate) fn draw(
    run: &Run,
    poses: &[Option<StampedPose>],
    trajectory: &Trajectory,
    params: &FloorMapParams,
) -> Result<OccupancyGrid, RunError> {
    let mut grid = OccupancyGrid::new(params.grid);
    let drive = PosedDrive { run, poses, trajectory };
    draw_into(&mut grid, &drive, params, &mut |_| ())?;
    Ok(grid)
}

/// A recording and its poses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PosedDrive<'a> {
    /// The recording.
    pub run: &'a Run,
    /// One pose for each horizontal scan, where it has one.
    pub poses: &'a [Option<StampedPose>],
    /// All poses.
    pub trajectory: &'a Trajectory,
}

/// Draws the horizontal scans of one run more into a map. `told` hears after each how many there were.
///
/// # Errors
/// As [`draw`].
pub(crate) fn draw_into(
    grid: &mut OccupancyGrid,
    drive: &PosedDrive<'_>,
    params: &FloorMapParams,
    progress: &mut dyn FnMut(usize),
) -> Result<(), RunError> {
    let &PosedDrive { run, poses, trajectory } = drive;
    let laser = run.rig()?.horizontal;
    let mut drawn: Option<StampedPose> = None;
    let mut poses = poses.iter();
    let mut scan_geometry: Option<(Geometry, ScanGeometry)> = None;
    let mut rays = Vec::new();
    let mut scans = 0;
    run.for_each_scan(Topic::ScanHorizontal, |scan| {
        scans += 1;
        progress(scans);
        let Some(Some(pose)) = poses.next() else { return };
        if !params.is_news(drawn.as_ref(), pose) {
            return;
        }
        drawn = Some(*pose);
        let geometry = Geometry::of(&scan);
        let scan_geometry = match &mut scan_geometry {
            Some((known, scan_geometry)) if *known == geometry => scan_geometry,
            other => &other.insert((geometry, scan_geometry_of(&scan, &laser))).1,
        };
        rays.clear();
        rays.extend(rays_of(&scan, scan_geometry, pose, trajectory));
        grid.add_scan(&rays);
    })
}

/// What a fan depends on.
#[derive(PartialEq)]
struct Geometry {
    beams: usize,
    first_rad: f32,
    increment_rad: f32,
    time_increment_s: f32,
}

impl Geometry {
    fn of(scan: &LaserScan) -> Self {
        Self {
            beams: scan.ranges_m.len(),
            first_rad: scan.angle_min_rad,
            increment_rad: scan.angle_increment_rad,
            time_increment_s: scan.time_increment_s,
        }
    }
}

fn rays_of<'a>(
    scan: &'a LaserScan,
    scan_geometry: &'a ScanGeometry,
    pose: &'a StampedPose,
    trajectory: &'a Trajectory,
) -> impl Iterator<Item = Ray> + 'a {
    let map_from_laser = |pose: &StampedPose| map_from_base(pose) * scan_geometry.base_from_laser;
    let at_stamp = map_from_laser(pose);
    scan.ranges_m
        .iter()
        .zip(&scan_geometry.beams)
        .filter(|(range_m, _)| range_m.is_finite() && **range_m > NEAREST_M)
        .map(move |(&range_m, beam)| {
            let map_from_laser = match beam.delay_ns {
                0 => at_stamp,
                delay_ns => trajectory
                    .at(scan.stamp_ns.saturating_add(delay_ns), LONGEST_GAP_NS)
                    .map_or(at_stamp, |pose| map_from_laser(&pose)),
            };
            let (sin, cos) = beam.angle_rad.portable_sin_cos();
            let end = map_from_laser * (Point3::new(cos, sin, 0.0) * f64::from(range_m));
            let from = map_from_laser.translation.vector;
            Ray { from_m: [from.x, from.y], to_m: [end.x, end.y] }
        })
}

fn map_from_base(pose: &StampedPose) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(pose.x_m, pose.y_m, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.theta_rad),
    )
}

#[cfg(test)]
mod tests {
    use biplane_recording::messages::LaserScan;
    use biplane_recording::rig::{Laser, Mount};

    use super::{FloorMapParams, rays_of};
    use crate::recordings::deskew::{StampedPose, Trajectory};
    use crate::recordings::run::scan_geometry_of;

    #[test]
    fn a_scan_is_drawn_when_the_robot_moved_turned_or_waited() {
        let params = FloorMapParams::default();
        let last = StampedPose { stamp_ns: 5_000_000_000, theta_rad: 3.139, ..StampedPose::default() };
        let news = |change: fn(&mut StampedPose)| {
            let mut pose = last;
            change(&mut pose);
            params.is_news(Some(&last), &pose)
        };
        assert!(params.is_news(None, &last) && !news(|_| {}));
        assert!(!news(|pose| pose.x_m += 0.019) && news(|pose| pose.x_m += 0.021));
        // From 3.139 to -3.139 is a small turn.
        assert!(!news(|pose| pose.theta_rad = -3.139) && news(|pose| pose.theta_rad -= 0.01));
        assert!(!news(|pose| pose.stamp_ns += 999_999_999) && news(|pose| pose.stamp_ns -= 1_000_000_000));
    }

    #[test]
    fn beams_start_at_the_laser_and_end_at_their_own_time() {
        let laser = Laser { mount: Mount { x: 0.5, ..Mount::default() }, ..Laser::horizontal() };
        let mut scan = LaserScan {
            angle_min_rad: -std::f32::consts::FRAC_PI_2,
            angle_increment_rad: 1.0_f32.to_radians(),
            time_increment_s: 37e-6,
            ranges_m: vec![f32::INFINITY; 181],
            ..LaserScan::default()
        };
        scan.ranges_m[90] = 2.0; // straight ahead, 3.33 ms after the stamp
        scan.ranges_m[91] = f32::NAN;
        scan.ranges_m[92] = 0.01;
        // Driving along x at 1 m a second.
        let at =
            |stamp_ns: i64| StampedPose { stamp_ns, x_m: stamp_ns as f64 * 1e-9, ..StampedPose::default() };
        let trajectory = Trajectory::new(vec![at(0), at(100_000_000)]);
        let scan_geometry = scan_geometry_of(&scan, &laser);
        let rays: Vec<_> = rays_of(&scan, &scan_geometry, &at(0), &trajectory).collect();
        let [ray] = &rays[..] else { panic!("{rays:?}") };
        assert!((ray.from_m[0] - 0.50333).abs() < 1e-9 && ray.from_m[1].abs() < 1e-9, "{ray:?}");
        assert!((ray.to_m[0] - 2.50333).abs() < 1e-5 && ray.to_m[1].abs() < 1e-5, "{ray:?}");
    }
}
