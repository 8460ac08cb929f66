//! From measurements and poses to the messages of a recording (`docs/recording.md`).
//!
//! Message structs and the encoding buffer are kept and reused, so that publishing allocates nothing once all
//! have been used. Frames after REP 105: `map` -> `odom` -> `base_link` -> lasers. Poses are planar: z = 0,
//! roll = pitch = 0.

use biplane_geometry::pose3::quaternion_of_heading_xyzw;
use biplane_matcher::Pose2;
use biplane_recording::messages::{
    ByteArray, Imu, LaserScan, Message, Odometry, PoseWithCovarianceStamped, TfMessage, TransformStamped,
};
use biplane_recording::rig::Mount;
use biplane_recording::topics::{
    FRAME_BASE, FRAME_IMU, FRAME_LASER_HORIZONTAL, FRAME_LASER_VERTICAL, FRAME_MAP, FRAME_ODOM,
};
use biplane_recording::{Direction, Port, Rig, Topic};

use crate::engine::out::health::Health;
use crate::engine::out::sink::Sink;
use crate::engine::scan_data::ScanData;
use crate::session::inertial::reading::InertialReading;

/// Variance of what a planar pose says nothing of (z, roll, pitch), m^2 or rad^2: it is held to be exact.
const PLANAR_VARIANCE: f64 = 1e-9;
/// What odometry is worth where the base does not say, in variance a report: (1 cm)^2, (0.5 degrees)^2.
const ODOMETRY_VARIANCE: [f64; 2] = [1e-4, 8e-5];

/// The first number of the covariance of what is not there (sensor_msgs/Imu).
const NO_ORIENTATION: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Encodes messages into a sink.
#[derive(Debug)]
pub(crate) struct Publisher<S> {
    sink: S,
    bytes: Vec<u8>,
    scan: LaserScan,
    odometry: Odometry,
    imu: Imu,
    pose: PoseWithCovarianceStamped,
    tf: TfMessage,
    serial: ByteArray,
}

impl<S: Sink> Publisher<S> {
    /// A publisher into this sink.
    #[must_use]
    pub(crate) fn new(sink: S) -> Self {
        let tf = TfMessage {
            transforms: vec![transform(FRAME_MAP, FRAME_ODOM), transform(FRAME_ODOM, FRAME_BASE)],
        };
        Self {
            sink,
            bytes: Vec::with_capacity(1 << 16),
            scan: LaserScan::default(),
            odometry: odometry(),
            imu: Imu {
                frame_id: FRAME_IMU.to_owned(),
                orientation_covariance: NO_ORIENTATION,
                ..Imu::default()
            },
            pose: PoseWithCovarianceStamped {
                stamp_ns: 0,
                frame_id: FRAME_MAP.to_owned(),
                position_m: [0.0; 3],
                orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
                covariance: [0.0; 36],
            },
            tf,
            serial: ByteArray { data: Vec::with_capacity(1 << 12) },
        }
    }

    /// The sink.
    pub(crate) fn sink(&mut self) -> &mut S {
        &mut self.sink
    }

    /// The sink, when nothing more is published.
    pub(crate) fn into_sink(self) -> S {
        self.sink
    }

    /// The mounts, all in one message: who comes late gets the last message of this topic only.
    pub(crate) fn static_frames(&mut self, now_ns: i64, rig: &Rig) {
        let mut transforms = vec![mount(now_ns, FRAME_LASER_HORIZONTAL, &rig.horizontal.mount)];
        transforms
            .extend(rig.vertical.as_ref().map(|laser| mount(now_ns, FRAME_LASER_VERTICAL, &laser.mount)));
        transforms.extend(rig.imu.as_ref().map(|unit| mount(now_ns, FRAME_IMU, &unit.mount)));
        TfMessage { transforms }.encode(&mut self.bytes);
        self.sink.message(Topic::TfStatic, now_ns, now_ns, &self.bytes);
    }

    /// A scan from a device, with its remissions if it sends them.
    pub(crate) fn scan(&mut self, now_ns: i64, topic: Topic, data: &ScanData, remissions: &[u16]) {
        let frame = if topic == Topic::ScanVertical { FRAME_LASER_VERTICAL } else { FRAME_LASER_HORIZONTAL };
        let scan = &mut self.scan;
        scan.stamp_ns = data.stamp_ns;
        frame.clone_into(&mut scan.frame_id);
        scan.angle_min_rad = data.angle_min_rad as f32;
        scan.angle_increment_rad = data.angle_increment_rad as f32;
        let steps = data.ranges_m.len().saturating_sub(1) as f64;
        scan.angle_max_rad = (data.angle_min_rad + steps * data.angle_increment_rad) as f32;
        scan.time_increment_s = data.time_increment_s as f32;
        scan.scan_time_s = data.scan_time_s as f32;
        scan.range_min_m = data.range_min_m;
        scan.range_max_m = data.range_max_m;
        scan.ranges_m.clear();
        scan.ranges_m.extend_from_slice(&data.ranges_m);
        scan.intensities.clear();
        scan.intensities.extend(remissions.iter().copied().map(f32::from));
        scan.encode(&mut self.bytes);
        self.sink.message(topic, now_ns, data.stamp_ns, &self.bytes);
    }

    /// A message that was decoded from another recording, as it is.
    pub(crate) fn forward<M: Message>(&mut self, now_ns: i64, topic: Topic, stamp_ns: i64, message: &M) {
        message.encode(&mut self.bytes);
        self.sink.message(topic, now_ns, stamp_ns, &self.bytes);
    }

    /// An odometry report of the base: pose in `odom`, velocity in the base's own frame (ahead, left, turn).
    pub(crate) fn odometry(
        &mut self,
        now_ns: i64,
        stamp_ns: i64,
        odom_from_base: &Pose2,
        twist_in_base: [f64; 3],
    ) {
        let odometry = &mut self.odometry;
        odometry.stamp_ns = stamp_ns;
        odometry.position_m = [odom_from_base.x_m, odom_from_base.y_m, 0.0];
        odometry.orientation_xyzw = quaternion_of_heading_xyzw(odom_from_base.theta_rad);
        odometry.linear_m_s = [twist_in_base[0], twist_in_base[1], 0.0];
        odometry.angular_rad_s = [0.0, 0.0, twist_in_base[2]];
        odometry.encode(&mut self.bytes);
        self.sink.message(Topic::Odom, now_ns, stamp_ns, &self.bytes);
    }

    /// A sample of the inertial unit in its own frame; it says nothing of its errors.
    pub(crate) fn inertial(&mut self, now_ns: i64, stamp_ns: i64, reading: &InertialReading) {
        self.imu.stamp_ns = stamp_ns;
        self.imu.angular_rad_s = reading.turn_rad_s;
        self.imu.acceleration_m_s2 = reading.force_m_s2;
        self.imu.encode(&mut self.bytes);
        self.sink.message(Topic::Imu, now_ns, stamp_ns, &self.bytes);
    }

    /// A pose of the base in the map at a scan's stamp; covariance of x, y, theta in the map's axes.
    pub(crate) fn pose(
        &mut self,
        now_ns: i64,
        topic: Topic,
        stamp_ns: i64,
        map_from_base: &Pose2,
        covariance: &[[f64; 3]; 3],
    ) {
        self.pose.stamp_ns = stamp_ns;
        self.pose.position_m = [map_from_base.x_m, map_from_base.y_m, 0.0];
        self.pose.orientation_xyzw = quaternion_of_heading_xyzw(map_from_base.theta_rad);
        self.pose.covariance = spatial_covariance(covariance);
        self.pose.encode(&mut self.bytes);
        self.sink.message(topic, now_ns, stamp_ns, &self.bytes);
    }

    /// The two moving frames at a scan's stamp; they compose to the pose in the map.
    pub(crate) fn frames(
        &mut self,
        now_ns: i64,
        stamp_ns: i64,
        map_from_odom: &Pose2,
        odom_from_base: &Pose2,
    ) {
        for (transform, pose) in self.tf.transforms.iter_mut().zip([map_from_odom, odom_from_base]) {
            transform.stamp_ns = stamp_ns;
            transform.translation_m = [pose.x_m, pose.y_m, 0.0];
            transform.rotation_xyzw = quaternion_of_heading_xyzw(pose.theta_rad);
        }
        self.tf.encode(&mut self.bytes);
        self.sink.message(Topic::Tf, now_ns, stamp_ns, &self.bytes);
    }

    /// Bytes of a serial line: when they were read or written, and up to when the line had been listened to
    /// before.
    pub(crate) fn serial(
        &mut self,
        now_ns: i64,
        listened_ns: i64,
        port: Port,
        direction: Direction,
        bytes: &[u8],
    ) {
        self.serial.data.clear();
        self.serial.data.extend_from_slice(bytes);
        self.serial.encode(&mut self.bytes);
        self.sink.message(Topic::Serial(port, direction), now_ns, listened_ns, &self.bytes);
    }

    /// The state of everything.
    pub(crate) fn health(&mut self, now_ns: i64, health: &Health) {
        self.sink.health(now_ns, health);
    }
}

fn transform(frame: &str, child: &str) -> TransformStamped {
    TransformStamped {
        stamp_ns: 0,
        frame_id: frame.to_owned(),
        child_frame_id: child.to_owned(),
        translation_m: [0.0; 3],
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
    }
}

fn mount(now_ns: i64, child: &str, mount: &Mount) -> TransformStamped {
    TransformStamped {
        stamp_ns: now_ns,
        translation_m: mount.translation_m(),
        rotation_xyzw: mount.rotation_xyzw(),
        ..transform(FRAME_BASE, child)
    }
}

fn odometry() -> Odometry {
    let [position, heading] = ODOMETRY_VARIANCE;
    let covariance = spatial_covariance(&[[position, 0.0, 0.0], [0.0, position, 0.0], [0.0, 0.0, heading]]);
    Odometry {
        stamp_ns: 0,
        frame_id: FRAME_ODOM.to_owned(),
        child_frame_id: FRAME_BASE.to_owned(),
        position_m: [0.0; 3],
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        pose_covariance: covariance,
        linear_m_s: [0.0; 3],
        angular_rad_s: [0.0; 3],
        twist_covariance: covariance,
    }
}

/// Covariance of x, y, z and rotations about x, y, z, row by row, from that of x, y, theta.
fn spatial_covariance(planar: &[[f64; 3]; 3]) -> [f64; 36] {
    const AXES: [usize; 3] = [0, 1, 5];
    let mut covariance = [0.0; 36];
    for (row, values) in AXES.into_iter().zip(planar) {
        for (column, value) in AXES.into_iter().zip(values) {
            covariance[6 * row + column] = *value;
        }
    }
    for axis in [2, 3, 4] {
        covariance[7 * axis] = PLANAR_VARIANCE;
    }
    covariance
}
