//! `visualization_msgs/msg/MarkerArray`, as ROS 2 defines it since Humble.

use crate::messages::cdr::Encoder;

/// `Marker.LINE_STRIP`.
const LINE_STRIP: i32 = 4;
/// `Marker.TRIANGLE_LIST`.
const TRIANGLE_LIST: i32 = 11;

/// How a marker's points are drawn.
#[derive(Copy, Clone, PartialEq, Debug)]
pub enum MarkerShape {
    /// Three points a triangle.
    Triangles,
    /// A line through all points, so wide, meters.
    Line {
        /// Its width, meters.
        width_m: f64,
    },
}

/// One thing that a viewer draws.
#[derive(Clone, PartialEq, Debug)]
pub struct Marker {
    /// The group that it is shown or hidden with (`ns`).
    pub group: String,
    /// Its number, which no other of its group has.
    pub id: i32,
    /// What its points are.
    pub shape: MarkerShape,
    /// Red, green, blue and opacity, from 0 to 1.
    pub color: [f32; 4],
    /// The points, meters.
    pub points_m: Vec<[f64; 3]>,
}

/// The bytes of markers in this frame.
#[must_use]
pub fn markers(stamp_ns: i64, frame_id: &str, markers: &[Marker]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out);
    encoder.count(markers.len());
    for marker in markers {
        write(&mut encoder, stamp_ns, frame_id, marker);
    }
    out
}

fn write(encoder: &mut Encoder<'_>, stamp_ns: i64, frame_id: &str, marker: &Marker) {
    let (kind, scale) = match marker.shape {
        MarkerShape::Triangles => (TRIANGLE_LIST, [1.0; 3]),
        MarkerShape::Line { width_m } => (LINE_STRIP, [width_m, 0.0, 0.0]),
    };
    encoder.header(stamp_ns, frame_id);
    encoder.string(&marker.group);
    encoder.i32(marker.id);
    encoder.i32(kind);
    encoder.i32(0); // action: add
    encoder.f64_array(&[0.0, 0.0, 0.0]);
    encoder.f64_array(&[0.0, 0.0, 0.0, 1.0]);
    encoder.f64_array(&scale);
    for channel in marker.color {
        encoder.f32(channel);
    }
    encoder.stamp_ns(0); // lifetime: for ever
    encoder.u8(0); // frame_locked
    encoder.count(marker.points_m.len());
    for point_m in &marker.points_m {
        encoder.f64_array(point_m);
    }
    encoder.count(0); // a color for each point
    encoder.string(""); // texture_resource
    encoder.header(0, ""); // texture
    encoder.string("");
    encoder.count(0);
    encoder.count(0); // uv_coordinates
    encoder.string(""); // text
    encoder.string(""); // mesh_resource
    encoder.string(""); // mesh_file
    encoder.count(0);
    encoder.u8(0); // mesh_use_embedded_materials
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_has_the_bytes_that_cdr_asks_for() {
        let marker = Marker {
            group: "w".to_owned(),
            id: 7,
            shape: MarkerShape::Triangles,
            color: [0.5, 0.0, 0.0, 1.0],
            points_m: vec![[1.0, 2.0, 3.0]],
        };
        let mut expected = vec![0, 1, 0, 0, 1, 0, 0, 0];
        expected.extend([1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0, b'm', b'a', b'p', 0]);
        expected.extend([2, 0, 0, 0, b'w', 0, 0, 0, 7, 0, 0, 0, 11, 0, 0, 0, 0, 0, 0, 0]);
        for value in [0.0_f64, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0] {
            expected.extend(value.to_le_bytes());
        }
        for value in [0.5_f32, 0.0, 0.0, 1.0] {
            expected.extend(value.to_le_bytes());
        }
        expected.extend([0; 8]); // lifetime
        expected.extend([0, 0, 0, 0, 1, 0, 0, 0]); // not locked, one point
        for value in [1.0_f64, 2.0, 3.0] {
            expected.extend(value.to_le_bytes());
        }
        expected.extend([0; 4]); // colors
        expected.extend([1, 0, 0, 0, 0, 0, 0, 0]); // no texture, its header's stamp from a multiple of 4
        expected.extend([0; 4]);
        expected.extend([0; 4]);
        assert_eq!(markers(1_000_000_002, "map", &[marker])[..expected.len()], expected);
    }
}
