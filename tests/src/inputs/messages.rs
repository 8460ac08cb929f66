//! CDR messages of every type that a recording holds.

use biplane_recording::messages::{
    AnyMessage, ByteArray, DiagnosticArray, Imu, LaserScan, Message, Odometry, PoseWithCovarianceStamped,
    TfMessage,
};

/// The types; the first byte of an input says which.
pub(super) const TYPES: [&str; 7] = [
    LaserScan::TYPE,
    Odometry::TYPE,
    PoseWithCovarianceStamped::TYPE,
    TfMessage::TYPE,
    DiagnosticArray::TYPE,
    ByteArray::TYPE,
    Imu::TYPE,
];

/// A message that decodes is written, decodes again and is then written as the same bytes. (Not always as the
/// first ones: padding may hold anything, a text may come without its NUL, a time with more nanoseconds than
/// a second has.)
pub(super) fn any(input: &[u8]) {
    let Some((choice, bytes)) = input.split_first() else { return };
    let name = TYPES[usize::from(*choice) % TYPES.len()];
    if let Ok(message) = AnyMessage::decode(name, bytes) {
        writes_back(name, &message);
    }
}

/// Panics when a decoded message does not survive being written and read.
pub(super) fn writes_back(name: &str, message: &AnyMessage) {
    let _ = message.stamp_ns();
    let Some(first) = encoded(message) else { return };
    let again = AnyMessage::decode(name, &first).expect("what was written decodes");
    let second = encoded(&again).expect("a known type");
    assert_eq!(first, second, "{name}");
}

fn encoded(message: &AnyMessage) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    match message {
        AnyMessage::Scan(scan) => scan.encode(&mut out),
        AnyMessage::Odometry(odometry) => odometry.encode(&mut out),
        AnyMessage::Imu(imu) => imu.encode(&mut out),
        AnyMessage::Pose(pose) => pose.encode(&mut out),
        AnyMessage::Tf(tf) => tf.encode(&mut out),
        AnyMessage::Diagnostics(diagnostics) => diagnostics.encode(&mut out),
        AnyMessage::Bytes(bytes) => bytes.encode(&mut out),
        AnyMessage::Other => return None,
    }
    Some(out)
}
