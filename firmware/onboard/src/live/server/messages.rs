//! The two message types that are made for viewers only, as CDR bytes: `nav_msgs/msg/OccupancyGrid` and
//! `sensor_msgs/msg/PointCloud2`, both in `map`.

use biplane_recording::messages::cdr::Encoder;
use biplane_recording::topics::FRAME_MAP;

/// A floor map as it is sent. Cells row by row from the lower left: 0 free to 100 occupied, -1 unknown.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct GridMessage {
    /// Side of a cell, meters.
    pub cell_m: f32,
    /// Cells along x and along y.
    pub size: [u32; 2],
    /// The lower left corner, meters.
    pub origin_m: [f64; 2],
    /// The cells.
    pub cells: Vec<i8>,
}

/// The bytes of a floor map.
pub(crate) fn grid(stamp_ns: i64, grid: &GridMessage) -> Vec<u8> {
    let mut out = Vec::with_capacity(128 + grid.cells.len());
    let mut encoder = Encoder::new(&mut out);
    encoder.header(stamp_ns, FRAME_MAP);
    encoder.stamp_ns(stamp_ns);
    encoder.f32(grid.cell_m);
    encoder.u32(grid.size[0]);
    encoder.u32(grid.size[1]);
    encoder.f64_array(&[grid.origin_m[0], grid.origin_m[1], 0.0]);
    encoder.f64_array(&[0.0, 0.0, 0.0, 1.0]);
    encoder.count(grid.cells.len());
    for &cell in &grid.cells {
        encoder.u8(cell.cast_unsigned());
    }
    out
}

/// `PointField.FLOAT32`.
const FLOAT32: u8 = 7;
/// Bytes of a point.
const POINT_BYTES: u32 = 12;

/// The bytes of points in `map`, meters.
pub(crate) fn points(stamp_ns: i64, points_m: &[[f32; 3]]) -> Vec<u8> {
    let mut out = Vec::with_capacity(160 + points_m.len() * POINT_BYTES as usize);
    let width = u32::try_from(points_m.len()).unwrap_or(u32::MAX);
    let mut encoder = Encoder::new(&mut out);
    encoder.header(stamp_ns, FRAME_MAP);
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
    fn a_map_has_the_bytes_that_cdr_asks_for() {
        let small = GridMessage { cell_m: 0.5, size: [2, 1], origin_m: [-1.0, 2.0], cells: vec![-1, 100] };
        let mut expected = vec![0, 1, 0, 0];
        expected.extend(HEADER);
        expected.extend([1, 0, 0, 0, 2, 0, 0, 0]); // map_load_time
        expected.extend([0, 0, 0, 0x3f, 2, 0, 0, 0, 1, 0, 0, 0]); // 0.5, width, height
        expected.extend([0; 4]); // to a multiple of 8: 16 + 8 + 12 = 36 -> 40
        for value in [-1.0_f64, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0] {
            expected.extend(value.to_le_bytes());
        }
        expected.extend([2, 0, 0, 0, 0xff, 100]);
        assert_eq!(grid(1_000_000_002, &small), expected);
    }

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
        assert_eq!(points(1_000_000_002, &[[1.0, -2.0, 0.5]]), expected);
    }
}
