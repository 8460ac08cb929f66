//! ROS 1 messages, byte for byte as robots recorded them.

use biplane_recording::CdrError;
use biplane_recording::messages::{Imu, LaserScan, Message, TfMessage};

/// The last transform of a bag of a LMS 1xx: 92 bytes; `/cloud` to `/radar`, all zeros but w.
fn transform() -> Vec<u8> {
    let mut bytes = vec![1, 0, 0, 0, 0, 0, 0, 0, 0xF3, 0x8C, 0x2D, 0x63, 0x52, 0x1B, 0x0F, 0x14];
    for frame in ["/cloud", "/radar"] {
        bytes.extend([6, 0, 0, 0]);
        bytes.extend(frame.as_bytes());
    }
    bytes.extend([0; 48]);
    bytes.extend(1.0_f64.to_le_bytes());
    bytes
}

#[test]
fn a_transform_is_read_packed_with_its_sequence_number_and_without_nul() {
    let bytes = transform();
    assert_eq!(bytes.len(), 92);
    let message = TfMessage::decode_ros1(&bytes).unwrap();
    let [transform] = &message.transforms[..] else { panic!("{message:?}") };
    assert_eq!((transform.frame_id.as_str(), transform.child_frame_id.as_str()), ("/cloud", "/radar"));
    assert_eq!(transform.stamp_ns, 0x632D_8CF3 * 1_000_000_000 + 0x140F_1B52);
    assert_eq!(transform.rotation_xyzw, [0.0, 0.0, 0.0, 1.0]);
    for end in 0..bytes.len() {
        assert!(matches!(TfMessage::decode_ros1(&bytes[..end]), Err(CdrError::Short { .. })), "{end}");
    }
}

#[test]
fn a_scan_behind_a_frame_of_five_letters_is_read_unaligned() {
    // The start of the same bag's first scan, with two ranges and no intensities.
    let mut bytes = vec![0xC8, 0xC3, 0, 0, 0xF1, 0x8C, 0x2D, 0x63, 0xB2, 0x24, 0x85, 0x1C, 5, 0, 0, 0];
    bytes.extend(b"cloud");
    bytes.extend([0xE4, 0xCB, 0x16, 0xC0, 0xE4, 0xCB, 0x16, 0x40, 0x35, 0xFA, 0x0E, 0x3C]);
    bytes.extend([0x53, 0x04, 0xE9, 0x37, 0x0A, 0xD7, 0xA3, 0x3C, 0xCD, 0xCC, 0x4C, 0x3D, 0, 0, 0xC8, 0x41]);
    bytes.extend([2, 0, 0, 0, 0x32, 0x08, 0x2C, 0x3D, 0, 0, 0x80, 0x3F, 0, 0, 0, 0]);
    let scan = LaserScan::decode_ros1(&bytes).unwrap();
    assert_eq!((scan.frame_id.as_str(), scan.ranges_m.len(), scan.ranges_m[1]), ("cloud", 2, 1.0));
    assert_eq!((scan.range_min_m, scan.range_max_m, scan.scan_time_s), (0.05, 25.0, 0.02));
    assert!((scan.angle_increment_rad.to_degrees() - 0.5).abs() < 1e-4);
    // A count that promises more than is there.
    let at = bytes.len() - 16;
    bytes[at..at + 4].copy_from_slice(&[0xFF; 4]);
    assert!(matches!(LaserScan::decode_ros1(&bytes), Err(CdrError::Short { .. })));
}

#[test]
fn an_inertial_sample_is_read_back_as_it_was_written() {
    let imu = Imu {
        stamp_ns: 12_345_678_901,
        frame_id: "imu_link".to_owned(),
        orientation_covariance: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        angular_rad_s: [0.1, -0.2, 0.3],
        acceleration_m_s2: [0.0, 0.5, 9.81],
        acceleration_covariance: [4.0; 9],
        ..Imu::default()
    };
    let mut bytes = Vec::new();
    imu.encode(&mut bytes);
    assert_eq!(Imu::decode(&bytes), Ok(imu));
    // Header of the encoding, stamp, text of 9 with its length, padding to 8, then 37 numbers.
    assert_eq!(bytes.len(), 4 + 8 + 4 + 9 + 3 + 37 * 8);
}
