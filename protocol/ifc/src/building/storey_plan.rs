//! Reads the plan of a storey: rooms from spaces, walls with their thickness, openings with what fills them.

use crate::building::elements::{Element, Ifc};
use crate::building::footprint::{Footprint, Point};
use crate::building::plan::{Opening, Plan, PlanStorey, Room, Wall};
use crate::geometry::item::{Cuts, Items};
use crate::geometry::mesh::Triangle;
use crate::step::parse::IfcError;
use crate::step::value::Entity;

/// A ceiling is at least so high over the floor, meters: over furniture, over doors that stand open.
const MIN_CEILING_M: f64 = 1.5;
/// Height of a room over which nothing is, meters.
const NOMINAL_CEILING_M: f64 = 2.5;
/// Places of a room at which it is looked up, along each axis.
const LOOKS: usize = 9;
/// What ends lower over the floor is no opening of this storey, meters.
const MIN_TOP_M: f64 = 0.3;
/// A room's border lies so near to a wall that bounds it, meters.
const TOUCH_M: f64 = 0.03;
/// With less of its border along a wall a room is not bounded by it, meters.
const MIN_TOUCH_M: f64 = 0.3;
/// How far beyond a wall's face is looked for the room behind an opening, meters.
const BEYOND_M: f64 = 0.15;
/// Kinds of walls.
const WALLS: [&str; 3] = ["IFCWALL", "IFCWALLSTANDARDCASE", "IFCWALLELEMENTEDCASE"];

impl Ifc {
    /// The plan of a storey, counted from 0 at the lowest. `elements` are those of [`Ifc::elements`]: what is
    /// over a room is its ceiling.
    ///
    /// # Errors
    /// When there is no such storey, or none of its spaces has a body.
    pub fn plan(&self, storey: usize, elements: &[Element]) -> Result<Plan, IfcError> {
        let storeys = self.storey_ids();
        let Some((id, named)) = storeys.get(storey) else {
            return Err(IfcError::StoreyMissing { asked: storey, found: storeys.len() });
        };
        let mut items = self.items(Cuts::Left);
        let spaces: Vec<(String, Footprint, f64)> = self.spaces(&mut items, *id);
        let mut floors: Vec<f64> = spaces.iter().map(|space| space.2).collect();
        floors.sort_by(f64::total_cmp);
        let Some(floor_z_m) = floors.get(floors.len() / 2).copied() else {
            return Err(IfcError::NoSpaces { storey, name: named.name.clone() });
        };
        let rooms: Vec<Room> = spaces
            .iter()
            .enumerate()
            .map(|(index, (name, footprint, _))| {
                room(index, name, footprint, ceiling(elements, footprint, floor_z_m))
            })
            .collect();
        let footprints: Vec<&Footprint> = spaces.iter().map(|space| &space.1).collect();
        let mut plan = Plan { floor_z_m, rooms, ..Plan::default() };
        let ceiling_z_m = plan.rooms.iter().map(|room| room.ceiling_z_m).fold(0.0, f64::max);
        plan.storeys = vec![PlanStorey { id: "S1".to_owned(), floor_z_m: 0.0, ceiling_z_m }];
        self.add_walls(&mut plan, &mut items, *id, &footprints);
        self.add_glazed_fronts(&mut plan, &mut items, *id, &footprints);
        Ok(plan)
    }

    /// Name, footprint and height of the floor of each space.
    fn spaces(&self, items: &mut Items<'_>, storey: u64) -> Vec<(String, Footprint, f64)> {
        let mut spaces = Vec::new();
        for (id, space) in self.step.all(&["IFCSPACE"]) {
            if self.relations.storey_of(&self.step, id) != Some(storey) {
                continue;
            }
            let body = self.body(items, space);
            let Some(footprint) = Footprint::of(&body) else { continue };
            let names = [space.at(2).text(), space.at(7).text()];
            let names: Vec<&str> = names.into_iter().flatten().filter(|name| !name.is_empty()).collect();
            spaces.push((names.join(" "), footprint, range(&body)[0]));
        }
        spaces
    }

    fn add_walls(&self, plan: &mut Plan, items: &mut Items<'_>, storey: u64, rooms: &[&Footprint]) {
        for (id, entity) in self.step.all(&WALLS) {
            if self.relations.storey_of(&self.step, id) != Some(storey) {
                continue;
            }
            let body = self.body(items, entity);
            let Some(footprint) = Footprint::of(&body) else { continue };
            let Some(wall) = wall(plan, entity, &footprint, rooms) else { continue };
            let [low, high] = range(&body);
            let wall = Wall { height_m: high - low, kind: "wall".to_owned(), ..wall };
            for opening in self.relations.openings_of.get(&id).into_iter().flatten() {
                let found = self.opening(items, *opening, &wall, plan, rooms);
                plan.openings.extend(found);
            }
            plan.walls.push(wall);
        }
    }

    /// Fronts of glass are walls that do not count, and no windows.
    fn add_glazed_fronts(&self, plan: &mut Plan, items: &mut Items<'_>, storey: u64, rooms: &[&Footprint]) {
        for (id, entity) in self.step.all(&["IFCCURTAINWALL"]) {
            if self.relations.storey_of(&self.step, id) != Some(storey) {
                continue;
            }
            let mut body = self.body(items, entity);
            for (part, _) in self.relations.whole_of.iter().filter(|(_, whole)| **whole == id) {
                body.extend(self.step.get(*part).map(|part| self.body(items, part)).unwrap_or_default());
            }
            let Some(footprint) = Footprint::of(&body) else { continue };
            // Panes and posts need not touch: the whole is the rectangle around all of them.
            let corners: Vec<Point> = body.iter().flatten().map(|corner| [corner[0], corner[1]]).collect();
            let around = Footprint { outline_m: corners, holes_m: Vec::new() };
            let Some((axis, thickness)) = longest_strip(&footprint, &around) else { continue };
            let footprint = Footprint { outline_m: rectangle(axis, thickness), holes_m: Vec::new() };
            let Some(wall) = wall(plan, entity, &footprint, rooms) else { continue };
            let [low, high] = range(&body);
            plan.walls.push(Wall { height_m: high - low, kind: "curtain".to_owned(), ..wall });
        }
    }

    fn opening(
        &self,
        items: &mut Items<'_>,
        id: u64,
        wall: &Wall,
        plan: &Plan,
        rooms: &[&Footprint],
    ) -> Option<Opening> {
        let body = self.body(items, self.step.get(id)?);
        let footprint = Footprint::of(&body)?;
        let [low, high] = range(&body).map(|z| z - plan.floor_z_m);
        if high < MIN_TOP_M {
            return None;
        }
        let fillings: Vec<&Entity> = self
            .relations
            .fillings_of
            .get(&id)
            .into_iter()
            .flatten()
            .filter_map(|filling| self.step.get(*filling))
            .collect();
        let kind = fillings.iter().find_map(|filling| match filling.kind.as_str() {
            kind if kind.starts_with("IFCDOOR") => Some("door"),
            kind if kind.starts_with("IFCWINDOW") => Some("window"),
            _ => None,
        });
        let name = fillings.iter().find_map(|filling| filling.at(2).text()).unwrap_or_default();
        let [a, b] = wall.axis_m;
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let u = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        let bounds = |axis: Point| {
            let places =
                footprint.outline_m.iter().map(|p| (p[0] - a[0]) * axis[0] + (p[1] - a[1]) * axis[1]);
            places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
        };
        let (s, t) = (bounds(u), bounds([-u[1], u[0]]));
        let (along, aside) = ((s[0] + s[1]) / 2.0, (t[0] + t[1]) / 2.0);
        let at = |aside: f64| [a[0] + u[0] * along - u[1] * aside, a[1] + u[1] * along + u[0] * aside];
        let reach = wall.thickness_m / 2.0 + BEYOND_M;
        let beside = [reach, -reach]
            .map(|side| rooms.iter().position(|room| room.contains(at(aside + side))).map(room_id));
        let [x, y] = at(aside);
        Some(Opening {
            id: format!("O{:02}", plan.openings.len() + 1),
            kind: kind.unwrap_or("passage").to_owned(),
            name: name.to_owned(),
            wall: wall.id.clone(),
            center_m: [x, y, (low + high) / 2.0],
            width_m: s[1] - s[0],
            height_m: high - low,
            sill_m: low,
            shut: false,
            rooms: beside.into_iter().flatten().collect(),
            box_m: footprint.outline_m,
        })
    }
}

fn room_id(index: usize) -> String {
    format!("R{:02}", index + 1)
}

fn room(index: usize, name: &str, footprint: &Footprint, ceiling_z_m: f64) -> Room {
    Room {
        id: room_id(index),
        storey: "S1".to_owned(),
        name: name.to_owned(),
        outline_m: footprint.outline_m.clone(),
        holes_m: footprint.holes_m.clone(),
        floor_z_m: 0.0,
        ceiling_z_m,
        area_m2: footprint.area_m2(),
        closed: true,
        entered: None,
    }
}

fn wall(plan: &Plan, entity: &Entity, footprint: &Footprint, rooms: &[&Footprint]) -> Option<Wall> {
    let (axis_m, thickness_m) = footprint.strip()?;
    let bounded = |room: &Footprint| beside_m(room, footprint) > MIN_TOUCH_M;
    let bounded = rooms.iter().enumerate().filter(|(_, room)| bounded(room));
    Some(Wall {
        id: format!("W{:02}", plan.walls.len() + 1),
        storey: "S1".to_owned(),
        name: entity.at(2).text().unwrap_or_default().to_owned(),
        axis_m,
        outline_m: footprint.outline_m.clone(),
        thickness_m,
        rooms: bounded.map(|(index, _)| room_id(index)).collect(),
        ..Wall::default()
    })
}

/// Length of a room's border along a wall.
fn beside_m(room: &Footprint, wall: &Footprint) -> f64 {
    const STEP_M: f64 = 0.05;
    let edges = room.outline_m.iter().zip(room.outline_m.iter().cycle().skip(1));
    let near = |(a, b): (&Point, &Point)| {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let steps = (length / STEP_M).ceil().max(1.0) as usize;
        let at = |k: usize| (k as f64 + 0.5) / steps as f64;
        let point = |k: usize| [a[0] + at(k) * (b[0] - a[0]), a[1] + at(k) * (b[1] - a[1])];
        let is_near = |p: &Point| wall.contains(*p) || wall.border_distance_m(*p) < TOUCH_M;
        (0..steps).map(point).filter(is_near).count() as f64 * length / steps as f64
    };
    edges.map(near).sum()
}

/// Lowest and highest place of a body, meters in the frame of the file.
fn range(body: &[Triangle]) -> [f64; 2] {
    let heights = body.iter().flatten().map(|corner| corner[2]);
    heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)])
}

/// The strip around many points that runs as the longest part does.
fn longest_strip(part: &Footprint, all: &Footprint) -> Option<([Point; 2], f64)> {
    let ([a, b], _) = part.strip()?;
    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
    let u = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    let bounds = |axis: Point| {
        let places = all.outline_m.iter().map(|p| (p[0] - a[0]) * axis[0] + (p[1] - a[1]) * axis[1]);
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let (s, t) = (bounds(u), bounds([-u[1], u[0]]));
    let middle = (t[0] + t[1]) / 2.0;
    let at = |along: f64| [a[0] + u[0] * along - u[1] * middle, a[1] + u[1] * along + u[0] * middle];
    Some(([at(s[0]), at(s[1])], t[1] - t[0]))
}

fn rectangle([a, b]: [Point; 2], width: f64) -> Vec<Point> {
    let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
    let v = [-(b[1] - a[1]) / length * width / 2.0, (b[0] - a[0]) / length * width / 2.0];
    vec![
        [a[0] - v[0], a[1] - v[1]],
        [b[0] - v[0], b[1] - v[1]],
        [b[0] + v[0], b[1] + v[1]],
        [a[0] + v[0], a[1] + v[1]],
    ]
}

/// The median height of what is over places of a room, over its floor.
fn ceiling(elements: &[Element], room: &Footprint, floor_z_m: f64) -> f64 {
    let bounds = [0, 1].map(|axis| {
        let values = room.outline_m.iter().map(|p| p[axis]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    });
    let at = |axis: usize, k: usize| {
        bounds[axis][0] + (k as f64 + 0.5) / LOOKS as f64 * (bounds[axis][1] - bounds[axis][0])
    };
    let places = (0..LOOKS * LOOKS).map(|k| [at(0, k % LOOKS), at(1, k / LOOKS)]);
    let low_m = floor_z_m + MIN_CEILING_M;
    let fixed = elements.iter().filter(|element| !element.kind.starts_with("IFCFURN"));
    let above: Vec<&Triangle> = fixed
        .flat_map(|element| &element.triangles_m)
        .filter(|triangle| triangle.iter().any(|corner| corner[2] > low_m))
        .collect();
    let over = |place: Point| {
        let heights = above.iter().filter_map(|triangle| height_at(triangle, place));
        heights.filter(|z| *z > low_m).min_by(f64::total_cmp)
    };
    let mut heights: Vec<f64> = places.filter(|place| room.contains(*place)).filter_map(over).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 2).map_or(NOMINAL_CEILING_M, |z| z - floor_z_m)
}

/// Height of a triangle over a place.
fn height_at([a, b, c]: &Triangle, [x, y]: Point) -> Option<f64> {
    let det = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    if det.abs() < 1e-9 {
        return None;
    }
    let s = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / det;
    let t = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / det;
    let is_in = s >= 0.0 && t >= 0.0 && s + t <= 1.0;
    is_in.then(|| a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]))
}

#[cfg(test)]
mod tests {
    use crate::building::elements::Ifc;
    use crate::geometry::swept::volume;
    use crate::step::parse::IfcError;

    /// A wall of 5 m by 0.2 m with a door, cut at 2.5 m, and a room of 4 m by 3 m; what it is stands in it.
    const ROOM: &[u8] = include_bytes!("../../../../tests/fuzz/corpus/ifc/room.ifc");

    #[test]
    fn a_wall_is_clipped_and_its_opening_is_cut_out() {
        let ifc = Ifc::read(ROOM).expect("a file");
        let (elements, unknown) = ifc.elements();
        assert!(unknown.is_empty(), "{unknown:?}");
        assert_eq!(elements.iter().map(|e| e.kind.as_str()).collect::<Vec<_>>(), ["IFCWALL"]);
        let cut = volume(&elements[0].triangles_m);
        assert!((cut - (5.0 * 2.5 - 0.9 * 2.0) * 0.2).abs() < 1e-6, "{cut}");
    }

    #[test]
    fn the_plan_states_room_wall_and_door() {
        let ifc = Ifc::read(ROOM).expect("a file");
        let plan = ifc.plan(0, &ifc.elements().0).expect("a plan");
        let (room, wall, door) = (&plan.rooms[0], &plan.walls[0], &plan.openings[0]);
        assert_eq!((room.name.as_str(), wall.name.as_str()), ("1 Kitchen", "M\u{fc}ller's wall"));
        assert!((room.area_m2 - 12.0).abs() < 1e-6 && (wall.thickness_m - 0.2).abs() < 1e-6);
        assert_eq!(
            (wall.rooms.clone(), door.rooms.clone()),
            (vec!["R01".to_owned()], vec!["R01".to_owned()])
        );
        assert_eq!((door.kind.as_str(), door.wall.as_str()), ("door", "W01"));
        let sizes = [door.width_m, door.height_m, door.sill_m, door.center_m[0], door.center_m[1]];
        for (found, expected) in sizes.into_iter().zip([0.9, 2.0, 0.0, 2.5, 3.1]) {
            assert!((found - expected).abs() < 1e-6, "{sizes:?}");
        }
        assert_eq!(ifc.plan(1, &[]), Err(IfcError::StoreyMissing { asked: 1, found: 1 }));
    }
}
