//! End points where beams have passed before: something has come there.
//!
//! People in a row, or somebody before a wall, are no short run of end points by themselves. But the map
//! knows that there was nothing where they are. It learns such an end point only when it is seen again in its
//! place after the base has moved on. Frame: map. Units: meters.

use biplane_geometry::Pose2;
use biplane_geometry::vec2::{distance, norm};

use crate::map::LocalMap;
use crate::placement::Placement;
use crate::registration::surface_map::Correspondence;
use crate::scan::end_points::{EndPoints, Kind, Mobility};

/// In a crowd farther end points are too far apart to tell, meters: a wall that is met between two that were
/// met before looks new.
const NEAR_M: f32 = 5.0;
/// The same of a scan that contradicts the map, meters. The floor is seen farther away than somebody.
const NEAR_ENOUGH_M: f32 = 10.0;
/// So close to a surface is on it, meters.
const KNOWN_M: f32 = 0.1;
/// Seen again when the base has moved so far, meters.
const APART_M: f32 = 0.35;
/// And not from farther away than this where a scan contradicts the map, meters: the floor may have been seen
/// in the same place from elsewhere.
const SAME_VISIT_M: f32 = 1.5;
/// Places remembered; a power of two.
const PLACES: usize = 4096;

/// Why new things are not to be learned at once.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Reason {
    /// There are many people about: what has come where beams passed may be one of them.
    Crowd,
    /// The scan contradicts the map: nothing new that it sees is sure, whatever was seen there before.
    Contradiction,
}

impl Reason {
    fn near_m(self) -> f32 {
        if self == Self::Crowd { NEAR_M } else { NEAR_ENOUGH_M }
    }

    /// So far the base may have come on from where it saw the same thing.
    fn farthest_m(self) -> f32 {
        if self == Self::Crowd { f32::INFINITY } else { SAME_VISIT_M }
    }
}

/// A cell, and where the base was when something was first seen there.
#[derive(Copy, Clone, Debug)]
struct Sighting {
    cell: [i32; 2],
    from_m: [f32; 2],
}

/// Where something has come, lately.
#[derive(Clone, Debug)]
pub(crate) struct Newcomers {
    sightings: Vec<Option<Sighting>>,
}

impl Newcomers {
    /// Nothing has come; with all the memory that it will ever have.
    pub(crate) fn new() -> Self {
        Self { sightings: vec![None; PLACES] }
    }

    /// Marks the end points of a scan taken at a pose where something has come.
    pub(crate) fn label(
        &mut self,
        map: &LocalMap,
        map_from_base: &Pose2,
        points: &mut EndPoints,
        reason: Reason,
    ) {
        let placement = Placement::new(map_from_base);
        points.mark(Mobility::Unknown, |point| {
            let is_far = norm(point.at_m) > reason.near_m();
            if point.mobility != Mobility::Static || point.kind == Kind::Unsure || is_far {
                return false;
            }
            let is_known = match Correspondence::find(map, point, &placement, 1.0) {
                Ok(met) => !met.is_other_face && met.squared_m2() < KNOWN_M * KNOWN_M,
                Err(_) => false,
            };
            let at_m = placement.place(point.at_m);
            let is_new = !is_known && (reason == Reason::Contradiction || map.seen_through(at_m));
            is_new && !self.stays(map.cell_of(at_m), placement.at_m, reason.farthest_m())
        });
    }

    /// Whether something was seen in a cell from elsewhere before. If not, it is remembered.
    fn stays(&mut self, [x, y]: [i32; 2], from_m: [f32; 2], farthest_m: f32) -> bool {
        let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
        let mut is_known = false;
        for cell in around {
            if let Some(seen) = self.sightings[place(cell)].filter(|seen| seen.cell == cell) {
                let apart_m = distance(seen.from_m, from_m);
                if apart_m > farthest_m {
                    continue;
                }
                is_known |= cell == [x, y];
                if apart_m > APART_M {
                    return true;
                }
            }
        }
        if !is_known {
            self.sightings[place([x, y])] = Some(Sighting { cell: [x, y], from_m });
        }
        false
    }
}

fn place([x, y]: [i32; 2]) -> usize {
    let mixed = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    (mixed ^ mixed >> 15) as usize % PLACES
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::MapParams;
    use crate::scan::end_points::tests::seen;

    /// What a base at a place along the x axis sees of a wall 6 m from the origin, and of somebody before it.
    fn seen_from(from_m: f64, somebody_m: Option<f64>) -> EndPoints {
        seen(40, |degree| {
            let at_m = somebody_m.filter(|_| degree.abs() < 4).unwrap_or(6.0);
            (at_m - from_m) / f64::from(degree).to_radians().cos()
        })
    }

    /// What the middle beam is taken for each time, where the base and somebody are.
    fn taken_for(reason: Reason, seen_at: &[(f64, f64)]) -> Vec<Mobility> {
        let mut map = LocalMap::new(MapParams::default());
        for _ in 0..5 {
            map.learn(&Pose2::IDENTITY, &seen_from(0.0, None));
        }
        let mut newcomers = Newcomers::new();
        let label = |(from_m, somebody_m): &(f64, f64)| {
            let mut points = seen_from(*from_m, Some(*somebody_m));
            newcomers.label(&map, &Pose2::new(*from_m, 0.0, 0.0), &mut points, reason);
            assert_eq!(points.as_slice()[10].mobility, Mobility::Static, "the wall is known");
            points.as_slice()[40].mobility
        };
        seen_at.iter().map(label).collect()
    }

    #[test]
    fn who_comes_where_nothing_was_is_not_learned_until_seen_again_from_elsewhere() {
        use Mobility::{Static, Unknown};
        let stands = taken_for(Reason::Crowd, &[(0.0, 3.0), (0.2, 3.0), (0.4, 3.0)]);
        assert_eq!(stands, [Unknown, Unknown, Static]);
        let walks = taken_for(Reason::Crowd, &[(0.0, 3.0), (0.2, 3.2), (0.4, 3.4), (0.6, 3.6), (0.8, 3.8)]);
        assert_eq!(walks, [Unknown; 5]);
    }
    #[test]
    fn where_a_scan_contradicts_the_map_a_place_is_confirmed_on_the_same_visit_only() {
        use Mobility::{Static, Unknown};
        let stays = [(0.0, 3.0), (0.2, 3.0), (0.4, 3.0)];
        assert_eq!(taken_for(Reason::Contradiction, &stays), [Unknown, Unknown, Static]);
        // The floor is seen in the same place from two meters on, and on the next visit.
        let floor = [(0.0, 5.2), (2.0, 5.2), (2.1, 5.2), (0.0, 5.2)];
        assert_eq!(taken_for(Reason::Contradiction, &floor), [Unknown; 4]);
        assert_eq!(taken_for(Reason::Crowd, &[(1.0, 5.2), (3.0, 5.2)]), [Unknown, Static]);
        // Where no beam has been, nothing speaks against a wall but the scan as a whole.
        let behind = |reason| {
            let mut points = seen_from(0.0, None);
            Newcomers::new().label(
                &LocalMap::new(MapParams::default()),
                &Pose2::IDENTITY,
                &mut points,
                reason,
            );
            points.as_slice()[40].mobility
        };
        assert_eq!([Reason::Crowd, Reason::Contradiction].map(behind), [Static, Unknown]);
    }
}
