//! `nav_msgs/msg/OccupancyGrid`.

use crate::messages::cdr::Encoder;

/// A floor map as it is sent. Cells row by row from the lower left: 0 free to 100 occupied, -1 unknown.
#[derive(Clone, PartialEq, Debug)]
pub struct FloorMap {
    /// Side of a cell, meters.
    pub cell_m: f32,
    /// Cells along x and along y.
    pub size: [u32; 2],
    /// The lower left corner, meters.
    pub origin_m: [f64; 2],
    /// The cells.
    pub cells: Vec<i8>,
}

/// The bytes of a floor map in this frame.
#[must_use]
pub fn floor_map(stamp_ns: i64, frame_id: &str, map: &FloorMap) -> Vec<u8> {
    let mut out = Vec::with_capacity(128 + map.cells.len());
    let mut encoder = Encoder::new(&mut out);
    encoder.header(stamp_ns, frame_id);
    encoder.stamp_ns(stamp_ns);
    encoder.f32(map.cell_m);
    encoder.u32(map.size[0]);
    encoder.u32(map.size[1]);
    encoder.f64_array(&[map.origin_m[0], map.origin_m[1], 0.0]);
    encoder.f64_array(&[0.0, 0.0, 0.0, 1.0]);
    encoder.count(map.cells.len());
    for &cell in &map.cells {
        encoder.u8(cell.cast_unsigned());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 s and 2 ns, `map`.
    const HEADER: [u8; 16] = [1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0, b'm', b'a', b'p', 0];

    #[test]
    fn a_map_has_the_bytes_that_cdr_asks_for() {
        let small = FloorMap { cell_m: 0.5, size: [2, 1], origin_m: [-1.0, 2.0], cells: vec![-1, 100] };
        let mut expected = vec![0, 1, 0, 0];
        expected.extend(HEADER);
        expected.extend([1, 0, 0, 0, 2, 0, 0, 0]); // map_load_time
        expected.extend([0, 0, 0, 0x3f, 2, 0, 0, 0, 1, 0, 0, 0]); // 0.5, width, height
        expected.extend([0; 4]); // to a multiple of 8: 16 + 8 + 12 = 36 -> 40
        for value in [-1.0_f64, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0] {
            expected.extend(value.to_le_bytes());
        }
        expected.extend([2, 0, 0, 0, 0xff, 100]);
        assert_eq!(floor_map(1_000_000_002, "map", &small), expected);
    }
}
