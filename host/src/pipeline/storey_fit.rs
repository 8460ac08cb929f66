//! Whether storeys lie over each other as those of one building: drives of different floors are not matched
//! with each other, so a start that looked another way turns a whole storey.

use biplane_geometry::PortableMath;

use crate::building::elements::assemble::is_inside;
use crate::building::elements::{Elements, Room, Storey, Wall};
use crate::building::elevation::extent;
use crate::building::spaces::directions::beyond_rad;

/// Walls of two storeys that stand farther apart, modulo a right angle, are those of a turned storey,
/// radians: 2 degrees. Larger: a start that was a little off is not noticed. Smaller: old houses are not
/// straight.
const TURNED_RAD: f64 = 0.035;
/// Storeys with less length of straight wall say nothing, meters.
const MIN_WALLS_M: f64 = 6.0;
/// With less than this share of a storey's walls in one pair of directions there is no direction of the
/// storey.
const MIN_SHARE: f64 = 0.5;
/// The smaller of two storeys lies over the other one with at least this share of its rooms. Larger: wings
/// that were driven on one floor only are reported.
const MIN_OVERLAP: f64 = 0.3;
/// Rooms are compared at points so far apart, meters.
const STEP_M: f64 = 0.25;

/// What speaks against it, of each storey and the one below it.
pub(crate) fn contradictions(elements: &Elements) -> Vec<String> {
    let storeys: Vec<Part> = elements.storeys.iter().map(|storey| Part::of(elements, storey)).collect();
    storeys.windows(2).filter_map(|pair| contradiction(&pair[0], &pair[1])).collect()
}

/// A storey as far as it is compared.
struct Part {
    id: String,
    /// Of most of its walls; `None` where no direction has most.
    angle_rad: Option<f64>,
    rooms: Vec<Room>,
}

impl Part {
    fn of(elements: &Elements, storey: &Storey) -> Self {
        let own = elements.of_storey(storey);
        let straight = own.walls.iter().filter(|wall| wall.is_straight()).map(Wall::along);
        let walls: Vec<[f64; 2]> =
            straight.map(|([x, y], length_m)| [y.portable_atan2(x), length_m]).collect();
        let angle_rad = main_rad(&walls);
        Self { id: storey.id.clone(), angle_rad, rooms: own.rooms }
    }

    fn area_m2(&self) -> f64 {
        self.rooms.iter().map(|room| room.area_m2).sum()
    }

    fn has(&self, at_m: [f64; 2]) -> bool {
        self.rooms.iter().any(|room| is_inside(&room.outline_m, at_m))
    }
}

/// The direction, modulo a right angle, of most walls, which are angles and lengths.
fn main_rad(walls: &[[f64; 2]]) -> Option<f64> {
    let near = |angle_rad: f64| {
        let off = walls.iter().map(move |[of_rad, length_m]| (beyond_rad(*of_rad, angle_rad), *length_m));
        off.filter(|(off_rad, _)| off_rad.abs() <= TURNED_RAD)
    };
    let length_m = |angle_rad: f64| near(angle_rad).map(|(_, length_m)| length_m).sum::<f64>();
    let all_m: f64 = walls.iter().map(|[_, length_m]| length_m).sum();
    let angles = walls.iter().map(|[angle_rad, _]| *angle_rad);
    let best_rad = angles.max_by(|a, b| length_m(*a).total_cmp(&length_m(*b)))?;
    let best_m = length_m(best_rad);
    let mean_rad = near(best_rad).map(|(off_rad, length_m)| off_rad * length_m).sum::<f64>() / best_m;
    (all_m >= MIN_WALLS_M && best_m >= MIN_SHARE * all_m).then_some(best_rad + mean_rad)
}

fn contradiction(lower: &Part, upper: &Part) -> Option<String> {
    let turn_rad = lower.angle_rad.zip(upper.angle_rad).map_or(0.0, |(of, angle)| beyond_rad(angle, of));
    let what = if turn_rad.abs() > TURNED_RAD {
        format!("walls stand {:.1} degrees off those of {}, modulo 90", turn_rad.to_degrees(), lower.id)
    } else {
        let share = overlap(lower, upper).filter(|share| *share < MIN_OVERLAP)?;
        format!("rooms and those of {} lie over each other by {:.0} % only", lower.id, 100.0 * share)
    };
    Some(format!(
        "{}: its {what}. Drives of different floors are not matched with each other: the first one of each floor \
         has to begin over that of the others, looking the same way",
        upper.id
    ))
}

/// Which share of the rooms of the smaller one lies over, or under, a room of the other; `None` without
/// rooms.
fn overlap(a: &Part, b: &Part) -> Option<f64> {
    let (small, large) = if a.area_m2() < b.area_m2() { (a, b) } else { (b, a) };
    let (mut inside, mut all) = (0_usize, 0_usize);
    for room in small.rooms.iter().filter(|room| !room.outline_m.is_empty()) {
        let [xs, ys] = [0, 1].map(|axis| extent(room.outline_m.iter().map(|corner| corner[axis])));
        let steps = |[low, high]: [f64; 2]| ((high - low) / STEP_M).ceil() as usize;
        for (column, row) in (0..steps(xs)).flat_map(|x| (0..steps(ys)).map(move |y| (x, y))) {
            let at_m = [xs[0] + (column as f64 + 0.5) * STEP_M, ys[0] + (row as f64 + 0.5) * STEP_M];
            if is_inside(&room.outline_m, at_m) {
                all += 1;
                inside += usize::from(large.has(at_m));
            }
        }
    }
    (all > 0 && large.area_m2() > 0.0).then(|| inside as f64 / all as f64)
}

#[cfg(test)]
mod tests {
    use super::contradictions;
    use crate::building::elements::{Elements, KnownBy, Room, Storey, Wall};

    /// A storey of one room of 8 m by 4 m, turned about the origin by so much, and moved along x.
    fn storey(number: usize, turned_deg: f64, moved_m: f64) -> Elements {
        let (sin, cos) = turned_deg.to_radians().sin_cos();
        let at = |[x, y]: [f64; 2]| [moved_m + cos * x - sin * y, sin * x + cos * y];
        let corners = [[-1.0, -2.0], [7.0, -2.0], [7.0, 2.0], [-1.0, 2.0]].map(at);
        let id = format!("S{number}");
        let floor_z_m = 3.1 * (number as f64 - 1.0);
        let room = Room {
            id: format!("{id}-R01"),
            storey: id.clone(),
            outline_m: corners.to_vec(),
            holes_m: Vec::new(),
            floor_z_m,
            ceiling_z_m: floor_z_m + 2.5,
            area_m2: 32.0,
            seen_area_m2: None,
            closed: true,
            walled_share: 1.0,
            inferred: false,
        };
        let wall = |side: usize| Wall {
            id: format!("{id}-W{side:02}"),
            storey: id.clone(),
            axis_m: [corners[side], corners[(side + 1) % 4]],
            curve: None,
            outline_m: Vec::new(),
            thickness_m: None,
            thickness_from: KnownBy::Unknown,
            drawn_thickness_m: 0.1,
            seen_left: true,
            height_m: 2.5,
            rooms: Vec::new(),
            seen_share: 1.0,
            inferred: false,
        };
        Elements {
            walls: (0..4).map(wall).collect(),
            rooms: vec![room],
            storeys: vec![Storey { id, floor_z_m, ceiling_z_m: None, floor_inferred: false }],
            openings: Vec::new(),
        }
    }

    fn two(turned_deg: f64, moved_m: f64) -> Vec<String> {
        let mut both = storey(1, 17.0, 0.0);
        both.take(storey(2, 17.0 + turned_deg, moved_m));
        contradictions(&both)
    }

    #[test]
    fn a_storey_that_is_turned_or_elsewhere_is_doubted_and_one_that_lies_over_the_other_is_not() {
        for (turned_deg, moved_m) in [(0.0, 0.0), (1.0, 0.5), (-1.5, 2.0)] {
            assert_eq!(two(turned_deg, moved_m), [""; 0], "{turned_deg} {moved_m}");
        }
        for (turned_deg, words) in [(80.0, "-10.0 degrees off those of S1"), (3.0, "3.0 degrees off")] {
            let found = two(turned_deg, 0.0);
            assert!(found.len() == 1 && found[0].contains(words), "{found:?}");
            assert!(found[0].starts_with("S2: its walls stand"), "{found:?}");
        }
        // Its walls stand right when it is turned by a right angle, but its rooms do not.
        for (turned_deg, moved_m) in [(0.0, 7.0), (90.0, 0.0)] {
            let found = two(turned_deg, moved_m);
            assert!(
                found[0].starts_with("S2: its rooms and those of S1 lie over each other by"),
                "{found:?}"
            );
        }
        assert_eq!(contradictions(&storey(1, 0.0, 0.0)), [""; 0]);
    }
}
