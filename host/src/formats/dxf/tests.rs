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
