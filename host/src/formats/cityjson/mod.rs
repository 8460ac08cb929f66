//! CityJSON 2.0: the polygons as one MultiSurface, holes as inner rings, in `map` axes and meters.
//!
//! Of a drive rooms are solids with their doors and windows, and so are walls; storeys hold them. Each
//! surface names what it is (wall, floor, ceiling, as far as its normal tells) and carries its plane's
//! figures. Leftovers are not in it. Source: CityJSON specifications 2.0.1.

mod rooms;

use std::io::{self, Write};

use serde_json::{Value, json};

use super::{Shapes, description, generator};
use crate::building::elements::Elements;
use crate::formats::input::shift::restored;
use crate::formats::obj::welded::WeldedVertices;
use crate::model::palette::Orientation;
use crate::model::{PlanarPolygon, Plane};

/// Coordinates are whole multiples of this, meters: a tenth of a millimeter keeps rings apart that nearly
/// touch.
const STEP_M: f64 = 1e-4;

/// Outer ring, then inner rings; `None` when the outer one vanished.
fn boundary(polygon: &PlanarPolygon, vertices: &mut WeldedVertices) -> Option<Vec<Vec<usize>>> {
    let outer = vertices.ring(&polygon.outer_m);
    if outer.is_empty() {
        return None;
    }
    let mut rings = vec![outer];
    rings.extend(polygon.holes_m.iter().map(|hole| vertices.ring(hole)).filter(|ring| !ring.is_empty()));
    Some(rings)
}

fn semantics(index: usize, plane: &Plane) -> Value {
    let kind = match Orientation::of(plane) {
        Orientation::Wall => "WallSurface",
        Orientation::Floor => "FloorSurface",
        Orientation::Ceiling => "CeilingSurface",
    };
    json!({ "type": kind, "plane": index, "points": plane.points, "rms_m": plane.rms_m })
}

/// Least and greatest coordinates, meters.
fn extent(vertices: &WeldedVertices, shift_m: [f64; 3]) -> Option<[f64; 6]> {
    let mut points = vertices.positions_m().map(|point| restored(point, shift_m));
    let first = points.next()?;
    let (mut min, mut max) = (first, first);
    for point in points {
        for axis in 0..3 {
            min[axis] = min[axis].min(point[axis]);
            max[axis] = max[axis].max(point[axis]);
        }
    }
    let round = |value: f64| (value / STEP_M).round() * STEP_M;
    let [a, b, c] = min.map(round);
    let [d, e, f] = max.map(round);
    Some([a, b, c, d, e, f])
}

/// Writes the polygons as CityJSON.
///
/// # Errors
/// When writing fails.
pub fn write(out: &mut impl Write, shapes: &Shapes<'_>) -> io::Result<()> {
    write_with(out, shapes, None)
}

/// Writes the polygons, and rooms and walls where a drive told of them.
///
/// # Errors
/// When writing fails.
pub(crate) fn write_with(
    out: &mut impl Write,
    shapes: &Shapes<'_>,
    elements: Option<&Elements>,
) -> io::Result<()> {
    let mut vertices = WeldedVertices::new(STEP_M);
    let (mut boundaries, mut values) = (Vec::new(), Vec::new());
    for polygon in &shapes.model.polygons {
        if let Some(rings) = boundary(polygon, &mut vertices) {
            boundaries.push(rings);
            values.push(polygon.plane);
        }
    }
    let mut surfaces: Vec<Value> =
        shapes.model.planes.iter().enumerate().map(|(index, plane)| semantics(index, plane)).collect();
    for (index, round) in shapes.model.cylinders.iter().enumerate() {
        // Strips within the chord error: CityJSON has no curved surfaces.
        for strip in round.strips_m() {
            let ring = vertices.ring(&strip);
            if !ring.is_empty() {
                boundaries.push(vec![ring]);
                values.push(surfaces.len());
            }
        }
        surfaces.push(json!({
            "type": "WallSurface", "cylinder": index, "kind": round.kind, "radius_m": round.radius_m,
            "points": round.points, "rms_m": round.rms_m
        }));
    }
    let geometry = json!([{
        "type": "MultiSurface",
        "lod": "3",
        "boundaries": boundaries,
        "semantics": { "surfaces": surfaces, "values": values }
    }]);
    let attributes = json!({
        "program": generator(), "source": shapes.source, "frame": "map (x ahead of the robot at its start, z up)", "unit": "metre"
    });
    let elements = elements.filter(|elements| !elements.is_empty());
    let rooms =
        elements.map(|elements| rooms::objects(elements, &shapes.model.inferred, "building", &mut vertices));
    let mut document = json!({
        "type": "CityJSON",
        "version": "2.0",
        "transform": { "scale": [STEP_M, STEP_M, STEP_M], "translate": shapes.shift_m },
        "metadata": { "title": format!("flat surfaces by {}", description(shapes)) },
        "CityObjects": { "building": { "type": "Building", "attributes": attributes, "geometry": geometry } },
        "vertices": vertices.lattice(),
    });
    if let Some(rooms) = rooms {
        let storeys: Vec<&String> = elements.iter().flat_map(|all| &all.storeys).map(|s| &s.id).collect();
        document["CityObjects"]["building"]["children"] = json!(storeys);
        rooms.into_iter().for_each(|(name, object)| document["CityObjects"][name] = object);
    }
    if let Some(extent) = extent(&vertices, shapes.shift_m) {
        document["metadata"]["geographicalExtent"] = json!(extent);
    }
    serde_json::to_writer(&mut *out, &document)?;
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::{STEP_M, rooms, write};
    use crate::building::elements::{Elements, Storey};
    use crate::formats::Shapes;
    use crate::formats::obj::welded::WeldedVertices;
    use crate::model::{Model, sample};

    #[test]
    fn what_nobody_measured_is_an_object_of_its_storey() {
        let model = Model { inferred: vec![sample::inferred()], ..sample::model() };
        let storey = Storey { id: "S1".to_owned(), floor_z_m: 0.0, ceiling_z_m: None, floor_inferred: true };
        let elements = Elements { storeys: vec![storey], ..Elements::default() };
        let mut vertices = WeldedVertices::new(STEP_M);
        let objects = rooms::objects(&elements, &model.inferred, "building", &mut vertices);
        assert_eq!(objects["S1"]["children"], json!(["S1-inferred"]));
        let own = &objects["S1-inferred"];
        assert_eq!(own["attributes"]["inferred"], true);
        let surface = &own["geometry"][0]["semantics"]["surfaces"][0];
        assert_eq!(surface, &json!({ "type": "WallSurface", "inferred": true, "part_of": "S1-W01" }));
    }

    #[test]
    fn each_polygon_is_a_surface_with_its_holes_as_inner_rings() {
        let model = sample::model();
        let mut bytes = Vec::new();
        write(&mut bytes, &Shapes::new(&model)).unwrap();
        let document: Value = serde_json::from_slice(&bytes).unwrap();
        assert_eq!((&document["type"], &document["version"]), (&json!("CityJSON"), &json!("2.0")));
        let geometry = &document["CityObjects"]["building"]["geometry"][0];
        assert_eq!(geometry["type"], "MultiSurface");
        assert_eq!(geometry["boundaries"], json!([[[0, 1, 2, 3], [4, 5, 6, 7]], [[8, 9, 1, 0]]]));
        assert_eq!(geometry["semantics"]["values"], json!([0, 1]));
        assert_eq!(geometry["semantics"]["surfaces"][1]["type"], "FloorSurface");
        assert_eq!(document["vertices"][2], json!([40_000, 20_000, 30_000]));
        assert_eq!(document["metadata"]["geographicalExtent"], json!([0.0, 0.0, 0.0, 4.0, 2.0, 3.0]));
    }
}
