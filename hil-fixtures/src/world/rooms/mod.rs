//! A drive through all rooms of a plan that a robot reaches, as a person would drive it.
//!
//! In each room the robot goes near every corner, and to more places of large rooms, the nearest next; ways
//! keep off walls where there is room; at the end it comes back. The seed moves the start and the distance to
//! the walls. The world's own frame, meters.

mod floor;
mod tour;

use crate::rng::Rng;
use crate::world::mesh::LabeledMesh;
use crate::world::path::Path;
use biplane_ifc::Plan;

use self::floor::Floor;
use self::tour::Tour;

/// A person with a robot among furniture: cruising speed, turning, and how far curves reach.
const SPEED_M_S: f64 = 0.35;
const TURN_DEG_S: f64 = 40.0;
const CORNER_M: f64 = 0.4;

/// Plans the drive of a seed, and says which rooms it leads through; none when no room can be driven through.
pub(super) fn plan_path(plan: &Plan, mesh: &LabeledMesh, seed: u64) -> Option<(Path, Vec<bool>)> {
    let floor = Floor::new(plan, mesh);
    let mut rng = Rng::new(seed, 0xD21E, 0);
    let tour = Tour::plan(&floor, plan, &mut rng)?;
    let path = Path {
        name: "rooms".to_owned(),
        waypoints_m: tour.waypoints_m,
        floor_z_m: plan.floor_z_m,
        speed_m_s: SPEED_M_S,
        corner_m: CORNER_M,
        turn_deg_s: TURN_DEG_S,
        ..Path::default()
    };
    Some((path, tour.entered))
}

#[cfg(test)]
mod tests {
    use super::floor::distance;
    use super::plan_path;
    use crate::rig::drive::Drive;
    use crate::world::built_in::builder::{Builder, Hole};
    use crate::world::mesh::LabeledMesh;
    use crate::world::scene::Scene;
    use biplane_ifc::{Opening, Plan, Room};

    fn room(x: [f64; 2], y: [f64; 2]) -> Room {
        Room { outline_m: vec![[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]], ..Room::default() }
    }

    /// Two rooms of 4 m by 5 m, a wall of 20 cm between them with a door, and a third with no door.
    fn plan() -> (Plan, LabeledMesh) {
        let mut builder = Builder::default();
        builder.within([4.1, 0.0, 0.0], 90.0, |b| {
            b.wall([0.0, 5.0], 0.2, 2.5, &[Hole { u: [1.0, 1.9], v: [0.0, 2.0] }]);
        });
        builder.within([8.3, 0.0, 0.0], 90.0, |b| b.wall([0.0, 5.0], 0.2, 2.5, &[]));
        let door = Opening {
            kind: "door".to_owned(),
            box_m: vec![[4.0, 1.0], [4.2, 1.0], [4.2, 1.9], [4.0, 1.9]],
            ..Opening::default()
        };
        let rooms =
            vec![room([0.0, 4.0], [0.0, 5.0]), room([4.2, 8.2], [0.0, 5.0]), room([8.4, 9.9], [0.0, 5.0])];
        (Plan { rooms, openings: vec![door], ..Plan::default() }, builder.finish())
    }

    #[test]
    fn the_drive_enters_what_it_reaches_keeps_off_walls_and_differs_by_seed() {
        let (plan, mesh) = plan();
        let mut ways = Vec::new();
        for seed in 1..6 {
            let (path, entered) = plan_path(&plan, &mesh, seed).expect("a drive");
            assert_eq!(entered, [true, true, false]);
            assert!(distance(path.waypoints_m[0], path.waypoints_m[path.waypoints_m.len() - 1]) < 0.2);
            let drive = Drive::new(&path, seed).expect("drives");
            let scene = Scene::new(mesh.moved(&drive.map_from_world()));
            let steps = (drive.length_m() / 0.1) as i32;
            for k in 0..=steps {
                let at = drive.pose(drive.duration_s() * f64::from(k) / f64::from(steps)).translation_m;
                for turn in 0..24 {
                    let (sin, cos) = (f64::from(turn) * 15.0_f64).to_radians().sin_cos();
                    let hit = scene.look([at[0], at[1], 0.3], [cos, sin, 0.0], 0.28);
                    assert_eq!(hit, None, "seed {seed} at {at:?}, {} degrees", turn * 15);
                }
            }
            ways.push(path.waypoints_m);
        }
        assert_eq!(plan_path(&plan, &mesh, 1).map(|(path, _)| path.waypoints_m).as_ref(), Some(&ways[0]));
        assert!(ways.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn a_door_that_is_shut_is_not_driven_through() {
        let (mut plan, mesh) = plan();
        plan.openings[0].shut = true;
        let (_, entered) = plan_path(&plan, &mesh, 1).expect("a drive");
        assert_eq!(entered.iter().filter(|entered| **entered).count(), 1);
    }
}
