//! `biplane traj` and `biplane map`.

use std::fs;

use crate::room::{self, Content, HORIZONTAL_SCANS};
use crate::run::Folder;

#[test]
fn a_trajectory_has_one_line_a_horizontal_scan_with_the_scans_own_stamp() {
    let folder = Folder::new("traj");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    let ran = folder.expect("traj run.mcap -o -", 0, &[]);
    let lines: Vec<&str> = ran.stdout.lines().collect();
    assert_eq!(lines.len(), HORIZONTAL_SCANS);
    assert_eq!(
        lines[1],
        "1700000000.200000000 0.050000 0.000000 0.000000 0.000000000 0.000000000 0.000000000 1.000000000"
    );
    folder.expect("traj run.mcap -o t.txt --format xytheta", 0, &["t.txt: 101 poses"]);
    let text = fs::read_to_string(folder.path("t.txt")).unwrap();
    assert_eq!(text.lines().nth(100), Some("1700000020.000000000 5.000000 0.000000 0.000000000"));
    folder.expect("traj run.mcap -o t.txt", 1, &["t.txt exists already", "--force"]);
    folder.expect("traj run.mcap -o t.txt --force", 0, &[]);
}

#[test]
fn a_recording_without_poses_has_neither_trajectory_nor_map() {
    let folder = Folder::new("unposed");
    room::record(&folder.path("run.mcap"), Content { poses: false, vertical: false });
    for command in ["traj run.mcap -o t.tum", "map run.mcap -o m", "build run.mcap -o d"] {
        folder.expect(
            command,
            1,
            &["run.mcap holds 101 horizontal scans and no pose", "biplane-onboard replay"],
        );
    }
    assert_eq!(folder.names(), ["run.mcap"]);
}

#[test]
fn the_map_of_a_room_has_its_walls_where_they_are() {
    let folder = Folder::new("map");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    folder.expect("map run.mcap -o room", 0, &["room.pgm"]);
    assert_eq!(folder.names(), ["room.pgm", "room.png", "room.yaml", "run.mcap"]);
    let yaml = fs::read_to_string(folder.path("room.yaml")).unwrap();
    assert!(yaml.starts_with("image: room.pgm\nmode: trinary\nresolution: 0.05\norigin: ["), "{yaml}");
    let origin: Vec<f64> =
        yaml.split(['[', ']']).nth(1).unwrap().split(", ").map(|v| v.parse().unwrap()).collect();

    let bytes = fs::read(folder.path("room.pgm")).unwrap();
    let header: Vec<&[u8]> = bytes.splitn(4, |byte| *byte == b'\n').collect();
    let size: Vec<usize> =
        std::str::from_utf8(header[1]).unwrap().split(' ').map(|value| value.parse().unwrap()).collect();
    let at = |x_m: f64, y_m: f64| {
        let column = ((x_m - origin[0]) / 0.05) as usize;
        let row_from_below = ((y_m - origin[1]) / 0.05) as usize;
        header[3][(size[1] - 1 - row_from_below) * size[0] + column]
    };
    // The wall ahead at x = 7, the side walls at y = 2 and -2: occupied within a cell. The middle of the
    // floor is free.
    let occupied_near = |x_m: f64, y_m: f64| {
        [-0.05, 0.0, 0.05].iter().any(|d| at(x_m + d, y_m) == 0 || at(x_m, y_m + d) == 0)
    };
    assert!(occupied_near(7.0, 0.51) && occupied_near(3.02, 1.99) && occupied_near(3.02, -2.0));
    assert_eq!((at(3.0, 0.0), at(5.0, 1.0)), (254, 254));
    folder.expect("map run.mcap -o room.pgm", 1, &["room.pgm exists already"]);
    folder.expect("map run.mcap -o x --resolution 0", 2, &["expected meters between"]);
}
