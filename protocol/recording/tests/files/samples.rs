//! Messages to write, of every topic and type.

use biplane_recording::messages::{
    DiagnosticArray, DiagnosticStatus, KeyValue, LaserScan, Odometry, PoseWithCovarianceStamped, TfMessage,
    TransformStamped,
};
use biplane_recording::{Direction, Port, Rig, Topic, WriteError, Writer, WriterOptions};
use std::collections::BTreeMap;
use std::path::Path;

pub(crate) const START_NS: i64 = 1_700_000_000_000_000_000;
pub(crate) const STEP_NS: i64 = 26_640_000;

/// Ranges that do not pack to nothing: a plain generator (Numerical Recipes' constants), in steps of 1 cm.
pub(crate) fn scan(number: u32, frame_id: &str) -> LaserScan {
    let mut state = number.wrapping_mul(2_654_435_761).wrapping_add(frame_id.len() as u32);
    let mut range = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 20) as f32 * 0.01
    };
    let mut ranges_m: Vec<f32> = (0..181).map(|_| range()).collect();
    ranges_m[7] = f32::INFINITY;
    LaserScan {
        stamp_ns: START_NS + i64::from(number) * STEP_NS,
        frame_id: frame_id.to_owned(),
        angle_min_rad: -1.570_796_4,
        angle_max_rad: 1.570_796_4,
        angle_increment_rad: 0.017_453_292,
        time_increment_s: 37e-6,
        scan_time_s: 0.01332,
        range_min_m: 0.0,
        range_max_m: 81.83,
        ranges_m,
        intensities: vec![],
    }
}

pub(crate) fn odometry(number: u32) -> Odometry {
    Odometry {
        stamp_ns: START_NS + i64::from(number) * STEP_NS,
        frame_id: "odom".into(),
        child_frame_id: "base_link".into(),
        position_m: [f64::from(number) * 0.01, 0.0, 0.0],
        linear_m_s: [0.5, 0.0, 0.0],
        ..Odometry::default()
    }
}

pub(crate) fn pose(number: u32) -> PoseWithCovarianceStamped {
    PoseWithCovarianceStamped {
        stamp_ns: START_NS + i64::from(number) * STEP_NS,
        frame_id: "map".into(),
        position_m: [f64::from(number) * 0.01, -0.5, 0.0],
        ..PoseWithCovarianceStamped::default()
    }
}

pub(crate) fn transform(number: u32) -> TfMessage {
    let stamp_ns = START_NS + i64::from(number) * STEP_NS;
    let between = |frame_id: &str, child_frame_id: &str| TransformStamped {
        stamp_ns,
        frame_id: frame_id.into(),
        child_frame_id: child_frame_id.into(),
        ..TransformStamped::default()
    };
    TfMessage { transforms: vec![between("map", "odom"), between("odom", "base_link")] }
}

pub(crate) fn diagnostics(number: u32) -> DiagnosticArray {
    DiagnosticArray {
        stamp_ns: START_NS + i64::from(number) * STEP_NS,
        frame_id: String::new(),
        status: vec![DiagnosticStatus {
            level: DiagnosticStatus::WARN,
            name: "laser_horizontal".into(),
            message: "3 telegrams damaged".into(),
            hardware_id: "/dev/lms-horizontal".into(),
            values: vec![KeyValue { key: "rate_hz".into(), value: "37.5".into() }],
        }],
    }
}

/// Writes a run of `steps` scans a laser, with every topic that a recording can hold, rig and metadata.
pub(crate) fn write_run(path: &Path, steps: u32, options: &WriterOptions) -> Result<Writer, WriteError> {
    let mut writer = Writer::create(path, options)?;
    writer.attach("rig.toml", "application/toml", Rig::default().to_toml().as_bytes())?;
    writer.metadata("run", &BTreeMap::from([("biplane".to_owned(), "test".to_owned())]))?;
    writer.write(Topic::TfStatic, START_NS, START_NS, &transform(0))?;
    for number in 0..steps {
        let stamp = START_NS + i64::from(number) * STEP_NS;
        let log = stamp + 20_000_000;
        writer.write(Topic::ScanHorizontal, log, stamp, &scan(number, "laser_horizontal"))?;
        // Received later, taken earlier: publish times go back, log times do not.
        writer.write(Topic::ScanVertical, log + 1_000, stamp - 5_000, &scan(number, "laser_vertical"))?;
        writer.write(Topic::Odom, log + 2_000, stamp - 9_000, &odometry(number))?;
        writer.write(Topic::Pose, log + 3_000, stamp, &pose(number))?;
        writer.write(Topic::PoseVertical, log + 3_000, stamp - 5_000, &pose(number))?;
        writer.write(Topic::PoseIncremental, log + 3_000, stamp, &pose(number))?;
        writer.write(Topic::Tf, log + 4_000, stamp, &transform(number))?;
        for port in Port::ALL {
            writer.write_serial(port, Direction::Rx, log + 5_000, &number.to_le_bytes())?;
        }
        if number % 37 == 0 {
            writer.write(Topic::Diagnostics, log + 6_000, stamp, &diagnostics(number))?;
            writer.write_serial(Port::Base, Direction::Tx, log + 6_000, b"pulse")?;
        }
    }
    Ok(writer)
}
