//! `sensor_msgs/msg/PointCloud2`.

use crate::messages::cdr::Encoder;

/// `PointField.FLOAT32`.
const FLOAT32: u8 = 7;
/// Bytes of a point.
const POINT_BYTES: u32 = 12;

/// The bytes of points in this frame, meters.
#[must_use]
pub fn points(stamp_ns: i64, frame_id: &str, points_m: &[[f32; 3]]) -> Vec<u8> {
    let mut out = Vec::with_capacity(160 + points_m.len() * POINT_BYTES as usize);
    let width = u32::try_from(points_m.len()).unwrap_or(u32::MAX);
    let mut encoder = Encoder::new(&mut out);
    encoder.header(stamp_ns, frame_id);
    encoder.u32(1); // height: no rows
    encoder.u32(width);
    encoder.count(3);
    for (name, offset) in [("x", 0), ("y", 4), ("z", 8)] {
        encoder.string(name);
        encoder.u32(offset);
        encoder.u8(FLOAT32);
        encoder.u32(1);
    }
    encoder.u8(0); // is_bigendian
    encoder.u32(POINT_BYTES);
    encoder.u32(width.saturating_mul(POINT_BYTES));
    encoder.count(points_m.len() * POINT_BYTES as usize);
    for coordinate in points_m.iter().flatten() {
        for byte in coordinate.to_le_bytes() {
            encoder.u8(byte);
        }
    }
    encoder.u8(1); // is_dense: no NaN among them
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 s and 2 ns, `map`.
    const HEADER: [u8; 16] = [1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0, b'm', b'a', b'p', 0];

    #[test]
    fn points_have_the_bytes_that_cdr_asks_for() {
        let mut expected = vec![0, 1, 0, 0];
        expected.extend(HEADER);
        expected.extend([1, 0, 0, 0, 1, 0, 0, 0, 3, 0, 0, 0]); // height, width, three fields
        for (name, offset) in [(b'x', 0), (b'y', 4), (b'z', 8)] {
            // Name with its NUL, to a multiple of 4; offset; FLOAT32, to a multiple of 4; count.
            expected.extend([2, 0, 0, 0, name, 0, 0, 0, offset, 0, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0]);
        }
        // little endian, point, row, data
        expected.extend([0, 0, 0, 0, 12, 0, 0, 0, 12, 0, 0, 0, 12, 0, 0, 0]);
        expected.extend([0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f, 1]); // 1, -2, 0.5; dense
        assert_eq!(points(1_000_000_002, "map", &[[1.0, -2.0, 0.5]]), expected);
    }
}
