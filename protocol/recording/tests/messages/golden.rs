//! Bytes worked out on paper from the CDR rules: offsets count from after the four header bytes, every number
//! stands at a multiple of its size, a string is its length with NUL, its letters, NUL. Checked the other way
//! by outside readers.

use biplane_recording::Message;
use biplane_recording::messages::{
    ByteArray, DiagnosticArray, DiagnosticStatus, KeyValue, LaserScan, Odometry, PoseWithCovarianceStamped,
    TfMessage, TransformStamped,
};

/// Hex digits to bytes; blanks and line ends are for the eye, `zN` stands for N zero bytes.
fn bytes(hex: &str) -> Vec<u8> {
    let word = |word: &str| match word.strip_prefix('z') {
        Some(count) => vec![0; count.parse().unwrap()],
        None => vec![u8::from_str_radix(word, 16).unwrap()],
    };
    hex.split_whitespace().flat_map(word).collect()
}

fn check<M: Message + PartialEq + std::fmt::Debug>(message: &M, hex: &str) {
    let expected = bytes(hex);
    // What was in the buffer before must not shine through.
    let mut found = vec![0xA5; 7];
    message.encode(&mut found);
    assert_eq!(found, expected, "{}", M::TYPE);
    assert_eq!(&M::decode(&expected).unwrap(), message);
}

#[test]
fn a_laser_scan() {
    let scan = LaserScan {
        stamp_ns: 1_000_000_002,
        frame_id: "ab".into(),
        angle_min_rad: 1.0,
        angle_max_rad: 2.0,
        angle_increment_rad: 0.5,
        time_increment_s: 0.25,
        scan_time_s: 4.0,
        range_min_m: 0.125,
        range_max_m: 8.0,
        ranges_m: vec![-1.0, f32::INFINITY],
        intensities: vec![3.0],
    };
    // 0: 1 s, 2 ns. 8: three bytes 'a' 'b' NUL end at 15, to 16 for the seven numbers. Then two ranges and
    // one intensity.
    check(
        &scan,
        "00 01 00 00
         01 00 00 00  02 00 00 00
         03 00 00 00  61 62 00  z1
         00 00 80 3f  00 00 00 40  00 00 00 3f  00 00 80 3e  00 00 80 40  00 00 00 3e  00 00 00 41
         02 00 00 00  00 00 80 bf  00 00 80 7f
         01 00 00 00  00 00 40 40",
    );
}

#[test]
fn bytes_of_a_serial_line() {
    // No dimension, no offset, three bytes.
    let message = ByteArray { data: vec![2, 0x80, 0xFF] };
    check(&message, "00 01 00 00  z4  z4  03 00 00 00  02 80 ff");
    let mut slice = vec![1, 2, 3];
    ByteArray::encode_slice(&message.data, &mut slice);
    assert_eq!(slice, bytes("00 01 00 00  z4  z4  03 00 00 00  02 80 ff"));
    // Somebody else's layout is passed over: one dimension "x" of size 3, stride 3; data offset 0.
    let foreign =
        "00 01 00 00  01 00 00 00  02 00 00 00 78 00 z2  03 00 00 00  03 00 00 00  z4  03 00 00 00  02 80 ff";
    assert_eq!(ByteArray::decode(&bytes(foreign)).unwrap(), message);
}

#[test]
fn odometry() {
    let mut odometry = Odometry {
        stamp_ns: -1,
        frame_id: "odom".into(),
        child_frame_id: "b".into(),
        position_m: [1.0, 2.0, 3.0],
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        linear_m_s: [0.5, 0.0, 0.0],
        angular_rad_s: [0.0, 0.0, -2.0],
        ..Odometry::default()
    };
    odometry.pose_covariance[0] = 1.0;
    odometry.twist_covariance[35] = 2.0;
    // One ns before 1970 is second -1 and 999,999,999 ns = 3b9ac9ff.
    // 8: "odom" ends at 17, to 20; "b" ends at 26, to 32 for the numbers of eight bytes.
    check(
        &odometry,
        "00 01 00 00  ff ff ff ff  ff c9 9a 3b  05 00 00 00  6f 64 6f 6d 00  z3  02 00 00 00  62 00  z6
         z6 f0 3f  z6 00 40  z6 08 40
         z24  z6 f0 3f
         z6 f0 3f  z280
         z6 e0 3f  z16
         z16  z6 00 c0
         z280  z6 00 40",
    );
}

#[test]
fn a_pose() {
    let mut pose = PoseWithCovarianceStamped {
        stamp_ns: 1_700_000_000_500_000_000,
        frame_id: "map".into(),
        position_m: [-1.0, 0.0, 0.0],
        ..PoseWithCovarianceStamped::default()
    };
    pose.covariance[7] = 0.5;
    // 1,700,000,000 = 6553f100; 500,000,000 = 1dcd6500. "map" ends at 16, where the numbers may begin.
    check(
        &pose,
        "00 01 00 00  00 f1 53 65  00 65 cd 1d  04 00 00 00  6d 61 70 00
         z6 f0 bf  z16  z24  z6 f0 3f
         z56  z6 e0 3f  z224",
    );
}

#[test]
fn two_transforms() {
    let transform = |stamp_ns, frame_id: &str, child: &str, x| TransformStamped {
        stamp_ns,
        frame_id: frame_id.into(),
        child_frame_id: child.into(),
        translation_m: [x, 0.0, 0.0],
        ..TransformStamped::default()
    };
    let message = TfMessage { transforms: vec![transform(1, "", "c", 1.0), transform(2, "c", "", 2.0)] };
    // First: 4 stamp, 12 "" (length 1), ends at 17, to 20; "c" ends at 26, to 32; 56 bytes of numbers end at
    // 88. Second: 88 stamp, 96 "c" ends at 102, to 104; "" ends at 109, to 112.
    check(
        &message,
        "00 01 00 00  02 00 00 00
         z4  01 00 00 00  01 00 00 00  00  z3  02 00 00 00  63 00  z6
         z6 f0 3f  z16  z24  z6 f0 3f
         z4  02 00 00 00  02 00 00 00  63 00  z2  01 00 00 00  00  z3
         z6 00 40  z16  z24  z6 f0 3f",
    );
}

#[test]
fn diagnostics() {
    let value = KeyValue { key: "k".into(), value: "vv".into() };
    let status = DiagnosticStatus {
        level: DiagnosticStatus::ERROR,
        name: "n".into(),
        message: String::new(),
        hardware_id: "hhh".into(),
        values: vec![value],
    };
    let message = DiagnosticArray { stamp_ns: 0, frame_id: String::new(), status: vec![status] };
    // 8 "" ends at 13, to 16; count; 20 level, to 24; "n" ends at 30, to 32; "" ends at 37, to 40; "hhh" ends
    // at 48; count; 52 "k" ends at 58, to 60; "vv" ends at 67.
    check(
        &message,
        "00 01 00 00  z4  z4  01 00 00 00  00  z3  01 00 00 00
         02  z3  02 00 00 00 6e 00  z2  01 00 00 00 00  z3  04 00 00 00 68 68 68 00
         01 00 00 00  02 00 00 00 6b 00  z2  03 00 00 00 76 76 00",
    );
}
