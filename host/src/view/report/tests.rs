//! The page as a reader of it sees it: found by text, decoded by a decoder of its own.

use super::Page;
use crate::formats::Shapes;
use crate::model::sample;
use crate::model::{Mesh, Model};
use crate::pipeline::Counts;
use crate::pipeline::summary::{StageFigures, Summary};
use crate::recordings::deskew::StampedPose;
use crate::slam::occupancy::OccupancyGrid;
use crate::slam::occupancy::OccupancyParams;
use crate::slam::occupancy::Ray;
use crate::view::floor_map::map_image::MapImage;
use crate::view::report::sources::{Floor, Sources};
use serde_json::Value;

/// A rough floor, 4 m by 2 m in steps of 10 cm.
fn raw() -> Mesh {
    let at = |k: u32| [0.1 * (k % 41) as f32, 0.1 * (k / 41) as f32, 0.013 * ((k * 7919) % 5) as f32];
    let square = |k: u32| {
        let a = k / 40 * 41 + k % 40;
        [[a, a + 1, a + 42], [a, a + 42, a + 41]]
    };
    Mesh { vertices_m: (0..41 * 21).map(at).collect(), triangles: (0..800).flat_map(square).collect() }
}

fn summary(model: &Model) -> Summary {
    let counts = Counts {
        raw_points: 1_234_567,
        raw_triangles: 2_345_678,
        planes: 2,
        polygons: 2,
        holes: 1,
        leftover_triangles: 1,
        ..Counts::default()
    };
    let mut summary = Summary::new(&counts, model, 11);
    summary.source.recordings = vec!["</script><script>alert(1)</script>&.mcap".to_owned()];
    summary.source.loops = Some(17);
    summary.stages = vec![
        StageFigures {
            stage: "optimize".to_owned(),
            count: 16,
            wall_s: 3.25,
            cpu_s: 4.5,
            peak_memory_bytes: Some(77_000_000),
        },
        StageFigures { stage: "planes".to_owned(), count: 2, wall_s: 0.5, ..StageFigures::default() },
    ];
    summary
}

/// The page of the sample model over a map of one room.
fn page() -> (String, Mesh, Mesh) {
    let model = sample::model();
    let shapes = Shapes::new(&model);
    let raw = raw();
    let mut grid = OccupancyGrid::new(OccupancyParams { resolution_m: 0.1, ..OccupancyParams::default() });
    for _ in 0..9 {
        grid.add_scan(&[
            Ray { from_m: [0.5, 0.5], to_m: [3.5, 0.5] },
            Ray { from_m: [0.5, 0.5], to_m: [0.5, 1.8] },
        ]);
    }
    let pose = |t_s: i64, x_m: f64| StampedPose {
        stamp_ns: t_s * 1_000_000_000,
        x_m,
        y_m: 0.5,
        ..StampedPose::default()
    };
    // And one on the next floor, over the last one.
    let above = StampedPose { z_m: 3.1, ..pose(1000, 2.6) };
    let poses =
        [pose(0, 0.5), pose(4, 1.5), pose(8, 2.5), above, StampedPose { z_m: 3.1, ..pose(1004, 3.4) }];
    let (map, _) = MapImage::new(&grid, &poses).unwrap();
    let sources = Sources {
        title: "a <b> & \"c\"",
        raw: &raw,
        drawn: &raw,
        simple: Some(&shapes.faces[1]),
        shapes: &shapes,
        floor: Some(Floor { map: &map, poses: &poses[..3] }),
        poses: &poses,
    };
    let mut bytes = Vec::new();
    Page::new(&sources).unwrap().write(&mut bytes, &summary(&model), &["model.glb".to_owned()]).unwrap();
    let simple = shapes.faces[1].clone();
    (String::from_utf8(bytes).unwrap(), raw, simple)
}

/// Base64 by the book: six bits a character.
fn base64(text: &str) -> Vec<u8> {
    const ALPHABET: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bits, mut count, mut bytes) = (0_u32, 0, Vec::new());
    for character in text.bytes().filter(|character| *character != b'=') {
        bits = bits << 6 | ALPHABET.iter().position(|known| *known == character).unwrap() as u32;
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    bytes
}

/// The triangles of a mesh of the page, corner by corner, meters.
fn decoded(page: &str, contents: &Value, name: &str) -> Vec<[[f64; 3]; 3]> {
    let mark = format!("data-mesh=\"{name}\">");
    let blocks = page.split(&mark).skip(1).filter(|block| !block.starts_with("<canvas"));
    let bytes: Vec<u8> = blocks.flat_map(|block| base64(block.split('<').next().unwrap())).collect();
    let mut rest = bytes.iter();
    let mut number = || {
        let (mut value, mut shift) = (0_u64, 0);
        loop {
            let byte = *rest.next().unwrap();
            value |= u64::from(byte % 128) << shift;
            shift += 7;
            if byte < 128 {
                return value as i64;
            }
        }
    };
    let note = contents["meshes"].as_array().unwrap().iter().find(|mesh| mesh["name"] == name).unwrap();
    let count = |key: &str| note[key].as_u64().unwrap();
    let mut at = [0_i64; 3];
    let mut vertices = Vec::new();
    for _ in 0..count("vertices") {
        for value in &mut at {
            let step = number();
            *value += if step % 2 == 0 { step / 2 } else { -(step + 1) / 2 };
        }
        let meters = |axis: usize| {
            contents["origin_m"][axis].as_f64().unwrap()
                + contents["step_m"].as_f64().unwrap() * at[axis] as f64
        };
        vertices.push([0, 1, 2].map(meters));
    }
    let mut seen = 0;
    let mut corner = || {
        let ago = number();
        if ago == 0 {
            seen += 1;
            return vertices[seen - 1];
        }
        vertices[seen - ago as usize]
    };
    let triangles = (0..count("triangles")).map(|_| [corner(), corner(), corner()]).collect();
    assert!(rest.next().is_none(), "bytes are left over");
    triangles
}

fn contents(page: &str) -> Value {
    let json = page.split("id=\"contents\">").nth(1).unwrap().split("</script>").next().unwrap();
    serde_json::from_str(json).unwrap()
}

#[test]
fn the_buffers_of_the_page_are_the_meshes_to_half_a_millimeter() {
    let (page, raw, simple) = page();
    let contents = contents(&page);
    for (name, mesh) in [("raw", raw), ("simple", simple)] {
        let triangles = decoded(&page, &contents, name);
        assert_eq!(triangles.len(), mesh.triangles.len());
        for (found, expected) in triangles.iter().flatten().zip(mesh.triangles.iter().flatten()) {
            for axis in 0..3 {
                let expected = f64::from(mesh.vertices_m[*expected as usize][axis]);
                assert!((found[axis] - expected).abs() < 0.000_501, "{name}: {found:?} {expected}");
            }
        }
    }
    // The wall's triangles come first; they lie in y = 2 and cover 4 m x 3 m without a window of 1 m².
    let polygons = contents["polygons"].as_array().unwrap();
    let wall = &decoded(&page, &contents, "model")[..polygons[0]["triangles"].as_u64().unwrap() as usize];
    assert!(wall.iter().flatten().all(|corner| (corner[1] - 2.0).abs() < 0.000_501));
    assert_eq!((polygons[0]["area_m2"].as_f64(), polygons[0]["holes"].as_u64()), (Some(11.0), Some(1)));
    assert_eq!(contents["planes"][0]["points"], 900);
}

#[test]
fn the_way_of_each_floor_lies_on_it() {
    let (page, ..) = page();
    let way = [
        [[0.5, 0.5, 0.0], [1.5, 0.5, 0.0], [2.5, 0.5, 0.0]].to_vec(),
        [[2.6, 0.5, 3.1], [3.4, 0.5, 3.1]].to_vec(),
    ];
    assert_eq!(contents(&page)["way_m"], serde_json::json!(way));
    // On the floor map there is that of its own floor.
    let drawn = page.split("class=\"way\"").nth(1).unwrap().split(" d=\"").nth(1).unwrap();
    let drawn = drawn.split('"').next().unwrap();
    assert_eq!((drawn.matches('M').count(), drawn.matches('L').count()), (1, 2), "{drawn}");
}

#[test]
fn the_page_holds_the_figures_of_the_run_beside_the_paper_s() {
    let (page, ..) = page();
    let figures = [
        "1,234,567",
        "2,345,678",
        "82,592",
        "163,336",
        "24,996",
        "800,869",
        "474,921",
        "84 %",
        "40.7 %",
        "3.25 s",
        "4.50 s",
        "77 MB",
        "2.8 m",
        "<dt>loops closed</dt><dd>17</dd>",
        "12 s, 2.8 m",
        "href=\"model.glb\" download",
    ];
    for figure in figures {
        assert!(page.contains(figure), "no {figure}");
    }
    assert_eq!(page.matches("data:image/png;base64,").count(), 3, "map, outside, inside");
}

#[test]
fn no_text_of_a_recording_is_markup() {
    let (page, ..) = page();
    assert!(!page.contains("alert(1)</script>") && page.contains("&lt;script&gt;alert(1)"));
    assert!(page.contains("<h1>a &lt;b&gt; &amp; &quot;c&quot;</h1>"));
    assert_eq!(page.matches(crate::view::report::sections::comparison::PLACE).count(), 1);
    assert!(!page.contains("{{"));
}

#[test]
fn a_page_without_a_model_has_map_and_figures_only() {
    let model = Model::default();
    let shapes = Shapes::new(&model);
    let raw = Mesh::default();
    let sources = Sources {
        title: "flat",
        raw: &raw,
        drawn: &raw,
        simple: None,
        shapes: &shapes,
        floor: None,
        poses: &[],
    };
    let mut bytes = Vec::new();
    let mut figures = summary(&model);
    figures.counts.raw_triangles = 0;
    Page::new(&sources).unwrap().write(&mut bytes, &figures, &[]).unwrap();
    let page = String::from_utf8(bytes).unwrap();
    assert!(page.contains("<h1>flat</h1>") && !page.contains("<canvas") && !page.contains("WebGL"));
}

#[test]
fn the_bounds_of_all_views_hold_every_surface_and_the_whole_trajectory() {
    let (page, ..) = page();
    let contents = contents(&page);
    let bound = |side: usize, axis: usize| contents["bounds_m"][side][axis].as_f64().unwrap();
    let polygons = contents["polygons"].as_array().unwrap();
    let flat: u64 = polygons.iter().map(|polygon| polygon["triangles"].as_u64().unwrap()).sum();
    let triangles = decoded(&page, &contents, "model");
    let places =
        triangles[..flat as usize].iter().flatten().copied().chain([[0.5, 0.5, 0.0], [2.5, 0.5, 0.0]]);
    for place in places {
        for axis in 0..3 {
            let inside = bound(0, axis) - 0.001 <= place[axis] && place[axis] <= bound(1, axis) + 0.001;
            assert!(inside, "{place:?} {axis}");
        }
    }
}
