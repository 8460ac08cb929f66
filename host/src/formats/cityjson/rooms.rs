//! A drive's building as city objects: storeys, rooms as solids with their doors and windows, walls.

use biplane_geometry::PortableMath;
use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use crate::building::elements::{Elements, Room, Use, Wall, WallOpening};
use crate::formats::obj::welded::WeldedVertices;
use crate::model::inferred::{InferredKind, InferredSurface};

/// Openings keep this from the ends of their side and from the ceiling, meters: they are parts of one face.
const BORDER_M: f64 = 0.01;
/// A side belongs to the wall of an opening when it is as near to its middle as half of the wall and this.
const BESIDE_M: f64 = 0.1;

/// A solid in the making: surfaces, what each is, and what the whole has of each kind.
#[derive(Default)]
struct Solid {
    boundaries: Vec<Value>,
    values: Vec<usize>,
    semantics: Vec<Value>,
}

impl Solid {
    /// Adds a surface: its outer ring, counter-clockwise from outside, and rings of its holes.
    fn add(&mut self, vertices: &mut WeldedVertices, rings_m: &[Vec<[f64; 3]>], semantics: usize) {
        let rings: Vec<Vec<usize>> = rings_m.iter().map(|ring| vertices.ring(ring)).collect();
        self.boundaries.push(json!(rings));
        self.values.push(semantics);
    }

    fn semantics(&mut self, value: Value) -> usize {
        self.semantics.push(value);
        self.semantics.len() - 1
    }

    fn geometry(mut self) -> Value {
        with_children(&mut self.semantics);
        json!([{
            "type": "Solid", "lod": "3", "boundaries": [self.boundaries],
            "semantics": { "surfaces": self.semantics, "values": [self.values] }
        }])
    }
}

/// An opening on a side of a room: from where to where along it, and its heights.
struct OnSide<'a> {
    opening: &'a WallOpening,
    along_m: [f64; 2],
    height_m: [f64; 2],
}

/// All objects by name; `parent` is the building that they are part of.
pub(super) fn objects(
    elements: &Elements,
    inferred: &[InferredSurface],
    parent: &str,
    vertices: &mut WeldedVertices,
) -> Map<String, Value> {
    let mut all = Map::new();
    for storey in &elements.storeys {
        let rooms = elements.rooms.iter().filter(|room| room.storey == storey.id).map(|room| &room.id);
        let walls = elements.walls.iter().filter(|wall| wall.storey == storey.id).map(|wall| &wall.id);
        let own: Vec<&InferredSurface> =
            inferred.iter().filter(|surface| storey_of(&surface.part_of) == storey.id).collect();
        let name = format!("{}-inferred", storey.id);
        let children: Vec<&String> = rooms.chain(walls).chain((!own.is_empty()).then_some(&name)).collect();
        let geometry = inferred_surfaces(&own, vertices);
        let attributes = json!({ "floor_z_m": storey.floor_z_m, "ceiling_z_m": storey.ceiling_z_m });
        all.insert(
            storey.id.clone(),
            json!({ "type": "BuildingStorey", "parents": [parent], "children": children, "attributes": attributes }),
        );
        if !own.is_empty() {
            let attributes = json!({ "inferred": true });
            all.insert(
                name,
                json!({
                    "type": "BuildingConstructiveElement", "parents": [storey.id], "attributes": attributes,
                    "geometry": geometry
                }),
            );
        }
    }
    for room in &elements.rooms {
        let attributes = json!({
            "area_m2": room.area_m2, "seen_area_m2": room.seen_area_m2, "closed": room.closed,
            "inferred": room.inferred, "floor_inferred": true
        });
        let geometry = room_solid(elements, room, vertices).geometry();
        all.insert(
            room.id.clone(),
            json!({ "type": "BuildingRoom", "parents": [room.storey], "attributes": attributes, "geometry": geometry }),
        );
    }
    for wall in &elements.walls {
        let attributes = json!({
            "thickness_m": wall.thickness_m, "thickness_from": wall.thickness_from, "inferred": wall.inferred,
            "drawn_thickness_m": wall.drawn_thickness_m
        });
        let floor_z_m = elements.storey(&wall.storey).map_or(0.0, |storey| storey.floor_z_m);
        let geometry = wall_solid(wall, floor_z_m, vertices).geometry();
        all.insert(
            wall.id.clone(),
            json!({
                "type": "BuildingConstructiveElement", "parents": [wall.storey], "attributes": attributes,
                "geometry": geometry
            }),
        );
    }
    all
}

/// The storey that a name begins with.
fn storey_of(name: &str) -> &str {
    name.split('-').next().unwrap_or_default()
}

/// What of a storey nobody measured, as surfaces.
fn inferred_surfaces(own: &[&InferredSurface], vertices: &mut WeldedVertices) -> Value {
    let (mut boundaries, mut semantics) = (Vec::new(), Vec::new());
    for surface in own {
        let Some(rings) = super::boundary(&surface.polygon(), vertices) else { continue };
        boundaries.push(rings);
        let kind = match surface.kind {
            InferredKind::Floor => "FloorSurface",
            InferredKind::WallBase | InferredKind::OpeningSurround => "WallSurface",
        };
        semantics.push(json!({ "type": kind, "inferred": true, "part_of": surface.part_of }));
    }
    let values: Vec<usize> = (0..semantics.len()).collect();
    json!([{
        "type": "MultiSurface", "lod": "3", "boundaries": boundaries,
        "semantics": { "surfaces": semantics, "values": values }
    }])
}

fn lifted(ring: &[[f64; 2]], z_m: f64) -> Vec<[f64; 3]> {
    ring.iter().map(|[x, y]| [*x, *y, z_m]).collect()
}

/// A box; its openings are in the rooms.
fn wall_solid(wall: &Wall, floor_z_m: f64, vertices: &mut WeldedVertices) -> Solid {
    let mut solid = Solid::default();
    let kind = solid.semantics(json!({ "type": "WallSurface" }));
    let (low, high) = (floor_z_m, floor_z_m + wall.height_m);
    let down: Vec<[f64; 2]> = wall.outline_m.iter().rev().copied().collect();
    solid.add(vertices, &[lifted(&down, low)], kind);
    solid.add(vertices, &[lifted(&wall.outline_m, high)], kind);
    for (a, b) in wall.outline_m.iter().zip(wall.outline_m.iter().cycle().skip(1)) {
        let ring = [[a[0], a[1], low], [b[0], b[1], low], [b[0], b[1], high], [a[0], a[1], high]];
        solid.add(vertices, &[ring.to_vec()], kind);
    }
    solid
}

/// A room: its floor, its ceiling, and each side with its doors and windows as surfaces of their own.
fn room_solid(elements: &Elements, room: &Room, vertices: &mut WeldedVertices) -> Solid {
    let mut solid = Solid::default();
    let floor = solid.semantics(json!({ "type": "FloorSurface", "inferred": true }));
    let ceiling = solid.semantics(json!({ "type": "CeilingSurface" }));
    let wall = solid.semantics(json!({ "type": "InteriorWallSurface" }));
    let (low, high) = (room.floor_z_m, room.ceiling_z_m);
    let rings: Vec<&Vec<[f64; 2]>> = std::iter::once(&room.outline_m).chain(&room.holes_m).collect();
    let mut feet = Vec::new();
    let mut placed = BTreeMap::new();
    for ring in &rings {
        let mut foot = Vec::new();
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            let on_side = on_side(elements, room, [*a, *b], &mut placed);
            foot.extend(side(&mut solid, vertices, ([*a, *b], [low, high]), wall, &on_side));
        }
        feet.push(foot);
    }
    let down: Vec<Vec<[f64; 3]>> =
        feet.iter().map(|foot| foot.iter().rev().map(|[x, y]| [*x, *y, low]).collect()).collect();
    solid.add(vertices, &down, floor);
    let up: Vec<Vec<[f64; 3]>> = rings.iter().map(|ring| lifted(ring, high)).collect();
    solid.add(vertices, &up, ceiling);
    solid
}

/// The openings of a room's side that no other side has, along it, none over another.
fn on_side<'a>(
    elements: &'a Elements,
    room: &Room,
    [a, b]: [[f64; 2]; 2],
    placed: &mut BTreeMap<&'a str, ()>,
) -> Vec<OnSide<'a>> {
    let length = (b[0] - a[0]).portable_hypot(b[1] - a[1]).max(1e-9);
    let way = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    let mut found = Vec::new();
    for opening in elements.openings.iter().filter(|opening| opening.rooms.contains(&room.id)) {
        let Some(wall) = elements.wall(&opening.wall) else { continue };
        let along = wall.along_at(wall.place_m(opening));
        let [x, y] = [opening.center_m[0] - a[0], opening.center_m[1] - a[1]];
        let (at, off) = (x * way[0] + y * way[1], (x * way[1] - y * way[0]).abs());
        let is_parallel = (along[0] * way[0] + along[1] * way[1]).abs() > 0.999;
        let ends = [at - opening.width_m / 2.0, at + opening.width_m / 2.0];
        let is_within = ends[0] > BORDER_M && ends[1] < length - BORDER_M;
        let is_near = off < wall.drawn_thickness_m / 2.0 + BESIDE_M;
        if is_parallel && is_within && is_near && !placed.contains_key(opening.id.as_str()) {
            let top = (room.floor_z_m + opening.sill_m + opening.height_m).min(room.ceiling_z_m - BORDER_M);
            let height_m = [room.floor_z_m + opening.sill_m, top];
            found.push(OnSide { opening, along_m: ends, height_m });
        }
    }
    found.sort_by(|p, q| p.along_m[0].total_cmp(&q.along_m[0]));
    found.dedup_by(|later, kept| later.along_m[0] < kept.along_m[1] + BORDER_M);
    for on_side in &found {
        placed.insert(&on_side.opening.id, ());
    }
    found
}

/// Adds a side with what is in it; returns its corners at the floor, but for the last.
fn side(
    solid: &mut Solid,
    vertices: &mut WeldedVertices,
    ([a, b], [low, high]): ([[f64; 2]; 2], [f64; 2]),
    wall: usize,
    openings: &[OnSide<'_>],
) -> Vec<[f64; 2]> {
    let length = (b[0] - a[0]).portable_hypot(b[1] - a[1]).max(1e-9);
    let at = |along: f64| [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * along / length);
    let up = |[x, y]: [f64; 2], z: f64| [x, y, z];
    let (mut outer, mut holes, mut foot) = (vec![up(a, low)], Vec::new(), vec![a]);
    for OnSide { opening, along_m, height_m } in openings {
        let [from, to] = along_m.map(at);
        let [sill, top] = *height_m;
        let face = vec![up(from, sill), up(to, sill), up(to, top), up(from, top)];
        if sill - low < 1e-3 {
            outer.extend([up(from, low), up(from, top), up(to, top), up(to, low)]);
            foot.extend([from, to]);
        } else {
            holes.push(face.iter().rev().copied().collect());
        }
        let kind = if opening.kind == Use::Window { "Window" } else { "Door" };
        let semantics = solid.semantics(json!({
            "type": kind, "parent": wall, "id": opening.id, "evidence": opening.evidence
        }));
        solid.add(vertices, &[face], semantics);
    }
    outer.extend([up(b, low), up(b, high), up(a, high)]);
    let rings: Vec<Vec<[f64; 3]>> = std::iter::once(outer).chain(holes).collect();
    solid.add(vertices, &rings, wall);
    foot
}

/// The semantics of a surface name the surfaces that it has, as CityJSON wants.
fn with_children(semantics: &mut [Value]) {
    let parents: Vec<Option<usize>> =
        semantics.iter().map(|value| value["parent"].as_u64().map(|parent| parent as usize)).collect();
    for (child, parent) in parents.iter().enumerate() {
        if let Some(parent) = parent.and_then(|parent| semantics.get_mut(parent)) {
            match parent["children"].as_array_mut() {
                Some(children) => children.push(json!(child)),
                None => parent["children"] = json!([child]),
            }
        }
    }
}
