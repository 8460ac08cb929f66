//! One color a plane, the same in every file and picture: floors warm, ceilings pale, walls in quiet hues
//! that tell neighbors apart.

use crate::model::Plane;
use crate::model::inferred::InferredKind;

/// Red, green, blue, sRGB.
pub(crate) type Rgb = [u8; 3];

/// Fine structure that is on no plane.
pub(crate) const LEFTOVERS: Rgb = [150, 153, 158];
/// Round things.
pub(crate) const ROUND: Rgb = [196, 160, 118];
/// Floors that nobody measured.
const INFERRED_FLOOR: Rgb = [176, 158, 184];
/// Bases of walls that nobody measured.
const INFERRED_WALL: Rgb = [150, 132, 168];
/// The raw mesh.
pub(crate) const RAW: Rgb = [206, 208, 212];

/// Normals closer to the vertical than this cosine make floors and ceilings.
const LEVEL_COSINE: f64 = 0.9;

const FLOORS: [Rgb; 3] = [[203, 178, 146], [190, 167, 138], [214, 192, 163]];
const CEILINGS: [Rgb; 3] = [[232, 230, 222], [222, 222, 218], [238, 234, 226]];
const WALLS: [Rgb; 12] = [
    [150, 185, 208],
    [232, 186, 142],
    [160, 200, 168],
    [212, 166, 176],
    [234, 212, 146],
    [170, 172, 212],
    [142, 200, 194],
    [224, 160, 140],
    [190, 206, 148],
    [194, 170, 206],
    [132, 174, 190],
    [218, 196, 170],
];

/// The name of a plane, the same in every file and picture.
pub(crate) fn plane_name(index: usize, plane: &Plane) -> String {
    format!("plane {index} ({})", Orientation::of(plane).name())
}

/// What a plane is in a building, as far as its normal tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Orientation {
    /// Seen from above.
    Floor,
    /// Seen from below.
    Ceiling,
    /// Upright or sloping.
    Wall,
}

impl Orientation {
    /// Of a plane whose normal points towards the sensor.
    pub(crate) fn of(plane: &Plane) -> Self {
        match plane.normal[2] {
            up if up > LEVEL_COSINE => Self::Floor,
            up if up < -LEVEL_COSINE => Self::Ceiling,
            _ => Self::Wall,
        }
    }

    /// A word for it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Floor => "floor",
            Self::Ceiling => "ceiling",
            Self::Wall => "wall",
        }
    }
}

/// The color of what nobody measured.
pub(crate) fn inferred_color(kind: InferredKind) -> Rgb {
    match kind {
        InferredKind::Floor => INFERRED_FLOOR,
        InferredKind::WallBase | InferredKind::OpeningSurround => INFERRED_WALL,
    }
}

/// The color of the plane with this index.
pub(crate) fn plane_color(index: usize, plane: &Plane) -> Rgb {
    let colors: &[Rgb] = match Orientation::of(plane) {
        Orientation::Floor => &FLOORS,
        Orientation::Ceiling => &CEILINGS,
        Orientation::Wall => &WALLS,
    };
    colors[index % colors.len()]
}

#[cfg(test)]
mod tests {
    use super::{Orientation, plane_color};
    use crate::model::Plane;

    #[test]
    fn a_plane_is_named_after_the_side_that_it_was_seen_from() {
        let plane = |normal| Plane { normal, offset_m: 0.0, points: 3, rms_m: 0.0 };
        let table = [
            ([0.0, 0.0, 1.0], Orientation::Floor),
            ([0.0, 0.0, -1.0], Orientation::Ceiling),
            ([1.0, 0.0, 0.0], Orientation::Wall),
            ([0.0, 0.6, 0.8], Orientation::Wall),
        ];
        for (normal, expected) in table {
            assert_eq!(Orientation::of(&plane(normal)), expected, "{normal:?}");
        }
        assert_ne!(plane_color(0, &plane([1.0, 0.0, 0.0])), plane_color(1, &plane([1.0, 0.0, 0.0])));
        assert_eq!(plane_color(12, &plane([1.0, 0.0, 0.0])), plane_color(0, &plane([1.0, 0.0, 0.0])));
    }
}
