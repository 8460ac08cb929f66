//! How the robot stands on the ground: four wheels on whatever surfaces are under them.
//!
//! Frame `map`. The height of the base is the mean of its wheels', its tilt that of the plane through them:
//! a kink in the ground becomes a tilt that changes over the length of the wheel base.

use crate::world::path::PathError;
use crate::world::scene::Scene;

/// Half the distance between the axles, and between the wheels of one, meters: a Pioneer's size.
const HALF_WHEEL_BASE_M: f64 = 0.13;
const HALF_TRACK_M: f64 = 0.165;
/// The ground is sought from so far above the last height to as far below it, meters: less than a storey,
/// more than a step of the way climbs.
const REACH_M: f64 = 0.5;

/// Height and tilt of the base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Footing {
    /// Height of `base_link`, meters.
    pub z_m: f64,
    /// Right side down is positive, radians.
    pub roll_rad: f64,
    /// Nose down is positive, radians.
    pub pitch_rad: f64,
}

impl Footing {
    /// The share `u` of the way from this one to another.
    pub(crate) fn between(&self, other: &Self, u: f64) -> Self {
        let mix = |a: f64, b: f64| a + u * (b - a);
        Self {
            z_m: mix(self.z_m, other.z_m),
            roll_rad: mix(self.roll_rad, other.roll_rad),
            pitch_rad: mix(self.pitch_rad, other.pitch_rad),
        }
    }
}

/// Footings along a way of (x, y, heading) that begins at height 0.
pub(crate) fn footings(way: &[[f64; 3]], scene: &Scene) -> Result<Vec<Footing>, PathError> {
    let mut z_m = 0.0;
    let mut found = Vec::with_capacity(way.len());
    for &place in way {
        let footing = footing(place, z_m, scene)?;
        z_m = footing.z_m;
        found.push(footing);
    }
    Ok(found)
}

fn footing([x_m, y_m, heading_rad]: [f64; 3], near_m: f64, scene: &Scene) -> Result<Footing, PathError> {
    let (sin, cos) = heading_rad.sin_cos();
    let height_m = |ahead_m: f64, left_m: f64| {
        let from = [x_m + cos * ahead_m - sin * left_m, y_m + sin * ahead_m + cos * left_m, near_m + REACH_M];
        let ground = scene.look(from, [0.0, 0.0, -1.0], 2.0 * REACH_M);
        ground.map(|hit| from[2] - hit.range_m).ok_or(PathError::NoGround { x_m, y_m, reach_m: REACH_M })
    };
    let (long, wide) = (HALF_WHEEL_BASE_M, HALF_TRACK_M);
    let [front_left, front_right] = [height_m(long, wide)?, height_m(long, -wide)?];
    let [back_left, back_right] = [height_m(-long, wide)?, height_m(-long, -wide)?];
    let rise_m = 0.5 * (front_left + front_right - back_left - back_right);
    let bank_m = 0.5 * (front_left + back_left - front_right - back_right);
    Ok(Footing {
        z_m: 0.25 * (front_left + front_right + back_left + back_right),
        roll_rad: bank_m.atan2(2.0 * wide),
        pitch_rad: -rise_m.atan2(2.0 * long),
    })
}

#[cfg(test)]
mod tests {
    use super::footings;
    use crate::world::mesh::LabeledMesh;
    use crate::world::path::PathError;
    use crate::world::scene::Scene;

    /// A plane that rises by `slope` along x.
    fn plane(slope: f64) -> Scene {
        let mut mesh = LabeledMesh::default();
        let corners = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
        let at = corners.map(|[x, y]| mesh.vertex([x, y, slope * x]));
        mesh.face([at[0], at[1], at[2]], 0);
        mesh.face([at[0], at[2], at[3]], 0);
        Scene::new(mesh)
    }

    #[test]
    fn a_slope_pitches_the_robot_that_climbs_and_rolls_the_one_that_crosses() {
        let scene = plane(0.1);
        let quarter = std::f64::consts::FRAC_PI_2;
        let way = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, quarter], [1.0, 0.0, -2.0 * quarter]];
        let found = footings(&way, &scene).expect("ground");
        let tilt = 0.1_f64.atan();
        for (footing, [z, roll, pitch]) in
            found.iter().zip([[0.0, 0.0, -tilt], [0.1, 0.0, -tilt], [0.1, -tilt, 0.0], [0.1, 0.0, tilt]])
        {
            let off = [footing.z_m - z, footing.roll_rad - roll, footing.pitch_rad - pitch];
            assert!(off.iter().all(|off| off.abs() < 1e-9), "{footing:?}");
        }
    }

    #[test]
    fn level_ground_is_level_to_the_bit_and_no_ground_is_said() {
        let found = footings(&[[0.3, -0.2, 1.1]], &plane(0.0)).expect("ground");
        assert_eq!(found, [super::Footing::default()]);
        let gone = footings(&[[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]], &plane(0.0));
        assert!(matches!(gone, Err(PathError::NoGround { .. })), "{gone:?}");
    }
}
