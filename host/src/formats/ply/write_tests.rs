//! What is written, read by a reader of its own.

use super::write::{PointRows, write_mesh, write_model, write_planes, write_points};
use crate::formats::Shapes;
use crate::model::sample;
use crate::model::{Cloud, Model};

/// A reader of its own: header lines, then the rows of each element as it was declared, as numbers.
fn read(bytes: &[u8]) -> (Vec<String>, Vec<Vec<Vec<f64>>>) {
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|window| window == end).unwrap() + end.len();
    let lines: Vec<String> = std::str::from_utf8(&bytes[..at]).unwrap().lines().map(str::to_owned).collect();
    let mut data = bytes[at..].iter().copied();
    let mut number = |kind: &str| -> f64 {
        let mut take = || data.next().unwrap();
        match kind {
            "uchar" => f64::from(take()),
            "int" => f64::from(i32::from_le_bytes([take(), take(), take(), take()])),
            "float" => f64::from(f32::from_le_bytes([take(), take(), take(), take()])),
            other => panic!("{other}"),
        }
    };
    let mut elements = Vec::new();
    for (index, line) in lines.iter().enumerate().filter(|(_, line)| line.starts_with("element")) {
        let count: usize = line.split(' ').nth(2).unwrap().parse().unwrap();
        let properties: Vec<Vec<&str>> = lines[index + 1..]
            .iter()
            .take_while(|line| line.starts_with("property"))
            .map(|line| line.split(' ').skip(1).collect())
            .collect();
        let mut rows = Vec::new();
        for _ in 0..count {
            let mut row = Vec::new();
            for property in &properties {
                if property[0] == "list" {
                    let items = number(property[1]) as usize;
                    row.push(items as f64);
                    row.extend((0..items).map(|_| number(property[2])));
                } else {
                    row.push(number(property[0]));
                }
            }
            rows.push(row);
        }
        elements.push(rows);
    }
    assert!(data.next().is_none(), "bytes after the last row");
    (lines, elements)
}

#[test]
fn the_model_holds_the_triangles_of_its_polygons_with_their_planes_and_the_leftovers() {
    let model = sample::model();
    let shapes = Shapes { faces: sample::faces(&model), ..Shapes::new(&model) };
    let mut bytes = Vec::new();
    write_model(&mut bytes, &shapes).unwrap();
    let (lines, elements) = read(&bytes);
    assert_eq!(lines[..2], ["ply", "format binary_little_endian 1.0"]);
    let [vertices, faces] = &elements[..] else { panic!() };
    assert_eq!((vertices.len(), faces.len()), (8 + 4 + 3, 8 + 2 + 1));
    let of_plane = |plane: f64| faces.iter().filter(|face| face[4] == plane).count();
    assert_eq!([of_plane(0.0), of_plane(1.0), of_plane(-1.0)], [8, 2, 1]);
    // The wall's triangles, turned towards the sensor, cover the wall without its window: 12 - 1 square
    // meters.
    let area = |face: &Vec<f64>| {
        let corner = |i: usize| &vertices[face[i] as usize];
        let (a, b, c) = (corner(1), corner(2), corner(3));
        let (u, v) = ([b[0] - a[0], b[2] - a[2]], [c[0] - a[0], c[2] - a[2]]);
        (u[0] * v[1] - u[1] * v[0]) / 2.0
    };
    let wall: f64 = faces.iter().filter(|face| face[4] == 0.0).map(area).sum();
    assert!((wall.abs() - 11.0).abs() < 1e-6, "{wall}");

    bytes.clear();
    write_planes(&mut bytes, &shapes).unwrap();
    assert_eq!(read(&bytes).1[1].len(), 10);
}

#[test]
fn faces_that_nobody_measured_come_last_and_are_marked() {
    let model = Model { inferred: vec![sample::inferred()], ..sample::model() };
    let mut bytes = Vec::new();
    write_model(&mut bytes, &Shapes::new(&model)).unwrap();
    let ply = crate::formats::ply::read::read(&bytes).unwrap();
    let inferred = ply.face_column("inferred").unwrap();
    let (measured, rest) = inferred.split_at(inferred.len() - 2);
    assert!(measured.iter().all(|mark| *mark == 0.0) && rest == [1.0, 1.0], "{inferred:?}");
    bytes.clear();
    write_planes(&mut bytes, &Shapes::new(&model)).unwrap();
    let planes = crate::formats::ply::read::read(&bytes).unwrap();
    assert!(planes.face_column("inferred").is_none(), "planes.ply holds what was measured");
    assert_eq!(planes.mesh.triangles.len() + 1, measured.len(), "one triangle is left over");
}

#[test]
fn points_hold_their_plane_scan_and_beam_and_come_in_the_order_asked_for() {
    let cloud = Cloud {
        points_m: vec![[1.0, 2.0, 3.0], [-0.5, 0.25, 0.125]],
        scan: vec![0, 1],
        beam: vec![90, 180],
        ..Cloud::default()
    };
    let rows = PointRows {
        cloud: &cloud,
        labels: &[4],
        scan_numbers: &[0, 7],
        order: None,
        shift_m: [0.0; 3],
        source: "",
    };
    let written = |rows: &PointRows<'_>| {
        let mut bytes = Vec::new();
        write_points(&mut bytes, rows).unwrap();
        bytes
    };
    let (_, elements) = read(&written(&rows));
    assert_eq!(elements[0], [[1.0, 2.0, 3.0, 4.0, 0.0, 90.0], [-0.5, 0.25, 0.125, -1.0, 7.0, 180.0]]);
    let (_, elements) = read(&written(&PointRows { order: Some(&[1, 0]), ..rows }));
    assert_eq!(elements[0][0], [-0.5, 0.25, 0.125, -1.0, 7.0, 180.0]);

    let far = written(&PointRows { shift_m: [4e6, 0.0, -1e3], scan_numbers: &[], ..rows });
    let far = crate::formats::ply::read::read_wanted(
        &far,
        &crate::formats::ply::read::Wanted {
            shift: crate::formats::input::shift::Shift::Given([4e6, 0.0, -1e3]),
            columns: None,
        },
    );
    assert_eq!(far.unwrap().mesh.vertices_m, cloud.points_m);
}

#[test]
fn a_mesh_reads_back_as_it_was() {
    let mesh = sample::model().leftovers;
    let mut bytes = Vec::new();
    write_mesh(&mut bytes, &mesh, "test").unwrap();
    let (_, elements) = read(&bytes);
    assert_eq!(elements[0][2], [1.0, 1.5, 0.75]);
    assert_eq!(elements[1], [[3.0, 0.0, 1.0, 2.0]]);
}
