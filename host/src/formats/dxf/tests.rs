//! What stands in the file, read pair by pair.

use super::write;
use crate::building::Building;
use crate::building::tests::{add_room, room};
use crate::formats::Shapes;
use crate::model::{Model, sample};

fn pairs(model: &Model, shift_m: [f64; 3], source: &str) -> Vec<(u16, String)> {
    let building = Building::read(model, None);
    let shapes = Shapes { shift_m, source: source.to_owned(), ..Shapes::new(model) };
    let mut bytes = Vec::new();
    write(&mut bytes, &shapes, &building).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    lines.chunks(2).map(|pair| (pair[0].trim().parse().unwrap(), pair[1].to_owned())).collect()
}

/// Kind, layer and values of an entity.
type Entity = (String, String, Vec<(u16, f64)>);

fn entities(pairs: &[(u16, String)]) -> Vec<Entity> {
    let start = pairs.iter().position(|(code, value)| *code == 2 && value == "ENTITIES").unwrap();
    let mut found = Vec::new();
    for entity in
        pairs[start + 1..].chunk_by(|_, next| next.0 != 0).take_while(|entity| entity[0].1 != "ENDSEC")
    {
        let layer = entity.iter().find(|(code, _)| *code == 8).unwrap().1.clone();
        let value = |(code, value): &(u16, String)| value.parse().ok().map(|value| (*code, value));
        found.push((entity[0].1.clone(), layer, entity.iter().filter_map(value).collect()));
    }
    found
}

fn count(pairs: &[(u16, String)], kind: &str, layer: &str) -> usize {
    entities(pairs).iter().filter(|entity| entity.0 == kind && entity.1 == layer).count()
}

#[test]
fn a_room_has_its_lines_on_their_layers_in_meters() {
    let model = room();
    let pairs = pairs(&model, [0.0; 3], "a\u{e9}.mcap");
    assert_eq!(pairs.last(), Some(&(0, "EOF".to_owned())));
    assert!(pairs[0].1.contains("a\\U+00E9.mcap") && pairs[0].0 == 999, "{:?}", pairs[0]);
    let units = pairs.iter().position(|pair| pair.1 == "$INSUNITS").unwrap();
    assert_eq!(pairs[units + 1], (70, "6".to_owned()));
    let counts =
        [("LINE", "WALLS"), ("LINE", "OPENINGS"), ("LWPOLYLINE", "FLOOR"), ("LWPOLYLINE", "CEILING")];
    assert_eq!(counts.map(|(kind, layer)| count(&pairs, kind, layer)), [6, 2, 1, 1]);
    assert_eq!(count(&pairs, "3DFACE", "SURFACES"), Shapes::new(&model).triangles());
    assert_eq!(count(&pairs, "3DFACE", "INFERRED"), 0);
    assert!(["S1-D01", "S1-N01"].iter().all(|name| pairs.contains(&(1, (*name).to_owned()))), "{pairs:?}");
    let texts: Vec<&str> = pairs
        .iter()
        .filter(|(code, value)| *code == 1 && value.contains('.'))
        .map(|(_, value)| value.as_str())
        .collect();
    assert_eq!(
        texts,
        ["0.90 x 2.00", "1.20 x 1.20", "sill 0.90", "floor +0.00 m, cut 1.20 m above it; meters"]
    );
}

#[test]
fn handles_are_unique_and_below_the_seed() {
    let pairs = pairs(&room(), [0.0; 3], "");
    let seed = pairs.iter().position(|pair| pair.1 == "$HANDSEED").unwrap();
    let number = |text: &str| u64::from_str_radix(text, 16).unwrap();
    let own =
        pairs.iter().enumerate().filter(|(at, (code, _))| (*code == 5 || *code == 105) && *at != seed + 1);
    let mut handles: Vec<u64> = own.map(|(_, (_, value))| number(value)).collect();
    let all = handles.len();
    handles.sort_unstable();
    handles.dedup();
    assert_eq!(handles.len(), all);
    assert!(handles.last().unwrap() < &number(&pairs[seed + 1].1));
}

#[test]
fn storeys_have_layers_of_their_own_and_far_models_their_own_coordinates() {
    let mut model = room();
    add_room(&mut model, 3.0);
    let pairs = pairs(&model, [3_456_800.0, 0.0, 100.0], "");
    assert_eq!((count(&pairs, "LINE", "S1-WALLS"), count(&pairs, "LINE", "S2-WALLS")), (6, 6));
    let upper = entities(&pairs).into_iter().filter(|entity| entity.1 == "S2-WALLS");
    let heights: Vec<f64> =
        upper.clone().flat_map(|entity| entity.2).filter(|(code, _)| *code == 30).map(|v| v.1).collect();
    assert_eq!(heights, [103.0; 6]);
    let x_m: Vec<f64> =
        upper.flat_map(|entity| entity.2).filter(|(code, _)| *code == 10).map(|v| v.1).collect();
    assert!(x_m.iter().all(|x| (3_456_800.0..=3_456_805.0).contains(x)), "{x_m:?}");
    // The plans lie on each other: those of upper storeys are off.
    let color = |layer: &str| -> i16 {
        let at = pairs.windows(2).position(|pair| {
            pair[0] == (100, "AcDbLayerTableRecord".to_owned()) && pair[1] == (2, layer.to_owned())
        });
        pairs[at.unwrap()..].iter().find(|(code, _)| *code == 62).unwrap().1.parse().unwrap()
    };
    assert!(["S1-WALLS", "S1-LABELS"].map(color).iter().all(|color| *color > 0));
    assert!(["S2-WALLS", "S2-LABELS", "S2-OPENINGS"].map(color).iter().all(|color| *color < 0));
}

/// A room of 4 m by 3 m whose wall y = 0, 20 cm thick, has a window.
const WINDOW: &str = r#"{"storeys": [{"id": "S1", "floor_z_m": 0, "ceiling_z_m": 2.5, "floor_inferred": true}],
    "rooms": [{"id": "S1-R01", "storey": "S1", "outline_m": [[0, 0], [4, 0], [4, 3], [0, 3]], "holes_m": [],
    "floor_z_m": 0, "ceiling_z_m": 2.5, "area_m2": 12, "closed": true, "walled_share": 1, "inferred": false}],
    "walls": [{"id": "S1-W01", "storey": "S1", "axis_m": [[0, -0.1], [4, -0.1]], "outline_m": [[0, 0], [0, -0.2],
    [4, -0.2], [4, 0]], "thickness_m": 0.2, "thickness_from": "faces", "drawn_thickness_m": 0.2, "seen_left": true,
    "height_m": 2.5, "rooms": ["S1-R01"], "seen_share": 1, "inferred": false}], "openings": [{"id": "S1-N01",
    "kind": "window", "wall": "S1-W01", "center_m": [2, -0.1, 1.5], "width_m": 1.2, "height_m": 1.1, "sill_m": 0.9,
    "rooms": ["S1-R01"], "evidence": "seen through", "inferred": false}]}"#;

#[test]
fn the_name_and_the_size_of_an_opening_stand_beside_the_lines_of_its_wall() {
    let model = room();
    let elements = serde_json::from_str(WINDOW).unwrap();
    let building = Building { elements, ..Building::read(&model, None) };
    let mut bytes = Vec::new();
    write(&mut bytes, &Shapes::new(&model), &building).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let foot_m = |label: &str| -> f64 {
        let at = lines.iter().position(|line| *line == label).unwrap();
        let start = lines[..at].iter().rposition(|line| *line == "AcDbText").unwrap();
        // After the x that follows the class: code 20, y.
        lines[start + 4].parse().unwrap()
    };
    // From 0.2 m under the room's side to that side there is wall.
    assert!(foot_m("1.20 x 1.10") > 0.03, "{}", foot_m("1.20 x 1.10"));
    assert!(foot_m("S1-N01") > foot_m("1.20 x 1.10") + 0.1, "{}", foot_m("S1-N01"));
    assert!(foot_m("sill 0.90") < -0.2 - 0.1, "{}", foot_m("sill 0.90"));
}

#[test]
fn without_a_floor_the_surfaces_alone_are_there_and_shown() {
    let model = Model { polygons: sample::model().polygons[..1].to_vec(), ..sample::model() };
    let pairs = pairs(&model, [0.0; 3], "");
    assert_eq!(count(&pairs, "3DFACE", "SURFACES"), 8);
    assert_eq!(count(&pairs, "3DFACE", "LEFTOVERS"), 1);
    assert_eq!(entities(&pairs).len(), 9);
    let colors: Vec<&str> =
        pairs.iter().filter(|(code, _)| *code == 62).map(|(_, value)| value.as_str()).collect();
    assert!(colors.iter().all(|color| !color.starts_with('-')), "{colors:?}");
    // Edges between the triangles of the wall are not drawn: each of the eight has one or two.
    let flags =
        entities(&pairs).into_iter().filter(|entity| entity.1 == "SURFACES").flat_map(|entity| entity.2);
    let hidden: u32 =
        flags.filter(|(code, _)| *code == 70).map(|(_, flags)| (flags as u32).count_ones()).sum();
    assert_eq!(hidden, 2 * 8);
}

#[test]
fn what_nobody_measured_is_on_a_layer_of_its_own() {
    let model = Model { inferred: vec![sample::inferred()], ..room() };
    let pairs = pairs(&model, [0.0; 3], "a");
    assert_eq!(count(&pairs, "3DFACE", "INFERRED"), 2);
    assert_eq!(count(&pairs, "3DFACE", "SURFACES") + 2, Shapes::new(&model).triangles());
}
