//! `biplane planes`.

use std::fs;

use serde_json::Value;

use crate::room::{self, Content};
use crate::run::{Folder, names};

/// A floor of 4 m by 4 m and a wall of 4 m by 2 m, a point every 5 cm, as a PLY; `at` is added to every
/// coordinate.
fn corner(at: [f64; 3]) -> String {
    let mut rows = String::new();
    let mut count = 0;
    let mut add = |p: [f64; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| p[k] + at[k]);
        rows.push_str(&format!("{x:.4} {y:.4} {z:.4}\n"));
        count += 1;
    };
    for i in 0..80u32 {
        for j in 0..80u32 {
            let (u, v) = (0.05 * f64::from(i), 0.05 * f64::from(j));
            // A weave of 5 mm stands for noise.
            let off = 0.005 * (f64::from((i * 7 + j * 13) % 11) / 5.0 - 1.0);
            add([u, v, off]);
            if j < 40 {
                add([u, 4.0 + off, v + 0.1]);
            }
        }
    }
    format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty double x\nproperty double y\nproperty double z\nend_header\n{rows}"
    )
}

fn report(folder: &Folder, of: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.path(of).join("planes.json")).unwrap()).unwrap()
}

#[test]
fn a_floor_and_a_wall_are_two_planes_also_in_utm_coordinates() {
    let folder = Folder::new("planes");
    folder.write("cloud.ply", corner([0.0; 3]));
    folder.expect("planes cloud.ply -o out", 0, &["9600 points (unorganized)", "on 2 planes", "estimated"]);
    assert_eq!(names(&folder.path("out")), ["labels.bin", "planes.json", "points.ply"]);
    let near = report(&folder, "out");
    assert_eq!(near["planes"].as_array().unwrap().len(), 2, "{near}");
    assert!(near["cpu_s"].as_f64().unwrap() > 0.0 && near["wall_s"].as_f64().unwrap() > 0.0);
    assert_eq!(fs::read(folder.path("out/labels.bin")).unwrap().len(), 4 * 9600);

    let at = [3_456_789.0, 5_400_000.0, 120.0];
    folder.write("utm.ply", corner(at));
    let ran = folder.expect("planes utm.ply -o utm --sigma 0.005 --threads 1 --json", 0, &["as given"]);
    let far: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(far, report(&folder, "utm"));
    assert_eq!((&far["threads"], &far["sigma_m"]), (&1.into(), &0.005.into()));
    for plane in far["planes"].as_array().unwrap() {
        // A point of the floor and one of the wall lie on their planes, in the input's own coordinates.
        let normal: [f64; 3] = serde_json::from_value(plane["normal"].clone()).unwrap();
        let on = if normal[2].abs() > 0.9 { [1.0, 1.0, 0.0] } else { [1.0, 4.0, 1.0] };
        let along: f64 = (0..3).map(|k| normal[k] * (on[k] + at[k])).sum();
        assert!((along - plane["offset_m"].as_f64().unwrap()).abs() < 0.005, "{plane}");
    }
    assert_eq!(
        fs::read(folder.path("utm/labels.bin")).unwrap(),
        fs::read(folder.path("out/labels.bin")).unwrap()
    );
    let points = fs::read(folder.path("utm/points.ply")).unwrap();
    assert!(
        points.starts_with(b"ply\n") && String::from_utf8_lossy(&points[..400]).contains("property double x")
    );
}

#[test]
fn the_points_of_a_build_give_its_planes_again_on_any_number_of_threads() {
    let folder = Folder::new("planes-again");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.expect("build run.mcap -o model", 0, &[]);
    folder.expect("planes model/points.ply -o one --threads 1", 0, &["(organized)"]);
    folder.expect("planes model/points.ply -o two --threads 2", 0, &[]);
    // The header names what the file was made of, which is another; the rows after it are the same.
    let points = |of: &str| {
        let bytes = fs::read(folder.path(of).join("points.ply")).unwrap();
        let end = b"end_header\n";
        let at = bytes.windows(end.len()).position(|window| window == end).unwrap();
        bytes[at..].to_vec()
    };
    assert!(points("model") == points("one"), "points.ply of build and of planes differ");
    assert!(points("one") == points("two"));
    assert_eq!(report(&folder, "one")["planes"], report(&folder, "two")["planes"]);
}

#[test]
fn results_are_not_replaced_without_force_nor_is_what_is_read() {
    let folder = Folder::new("planes-force");
    folder.write("cloud.ply", corner([0.0; 3]));
    folder.expect("planes cloud.ply -o out", 0, &[]);
    folder.expect("planes cloud.ply -o out", 1, &["out exists already", "--force"]);
    folder.expect("planes cloud.ply -o out --force", 0, &[]);
    folder.expect("planes out/points.ply -o out --force", 1, &["name another output"]);
    fs::write(folder.path("out/mine"), "").unwrap();
    folder.expect("planes cloud.ply -o out --force", 1, &["holds mine"]);
    folder.expect("planes cloud.ply -o other --sigma 20", 2, &["--sigma", "at most 10"]);
    folder.expect("planes cloud.txt -o other", 1, &["biplane: cloud.txt does not exist"]);
    assert_eq!(folder.names(), ["cloud.ply", "out"]);
}

#[test]
fn why_planes_end_is_said_when_asked_for() {
    let folder = Folder::new("planes-explain");
    folder.write("cloud.ply", corner([0.0; 3]));
    let ran = folder.expect("planes cloud.ply -o out --explain", 0, &[]);
    for words in ["why planes end (limits: delta 30 cm", "other surfaces meet it", "on no plane: 0 points"] {
        assert!(ran.stdout.contains(words), "no {words:?} in {}", ran.stdout);
    }
    let explanation = &report(&folder, "out")["explanation"];
    assert_eq!(explanation["endings"].as_array().unwrap().len(), 2);
    // The wall's points within 30 cm of the floor but further off it than noise, and more: none is free.
    assert_eq!(
        explanation["endings"][0]["beyond_gamma"],
        explanation["endings"][0]["beyond_gamma_on_others"]
    );
    folder.expect("planes cloud.ply -o plain", 0, &[]);
    assert!(report(&folder, "plain")["explanation"].is_null());
}

#[test]
fn the_paper_s_search_agrees_with_the_fast_one_on_a_floor_and_a_wall() {
    let folder = Folder::new("planes-paper");
    folder.write("cloud.ply", corner([0.0; 3]));
    folder.expect("planes cloud.ply -o fast", 0, &[]);
    let asked =
        "planes cloud.ply -o paper --method paper --gamma 0.05 --epsilon 0.0001 --against fast/labels.bin";
    let ran = folder.expect(asked, 0, &["on 2 planes"]);
    assert!(ran.stdout.contains("2 of 2 planes are among the 2 others"), "{}", ran.stdout);
    let found = report(&folder, "paper");
    assert!(found["agreement"]["points_percent"].as_f64().unwrap() > 97.0, "{found}");
    assert_eq!((&found["method"]["name"], &found["method"]["gamma_m"]), (&"paper".into(), &0.05.into()));
    folder.expect("planes cloud.ply -o no --gamma 0.05", 2, &["--gamma belongs to --method paper"]);
    folder.expect(
        "planes cloud.ply -o no --method paper --sigma 0.01",
        2,
        &["--sigma belongs to --method fast"],
    );
    folder.expect(
        "planes cloud.ply -o no --against cloud.ply",
        1,
        &["expected 4 for each of the 9600 points"],
    );
}

/// Two scans of a floor of 6 m by 6 m, a point every 10 cm, as PTX: the scanner stands so far above its
/// corner, then above the corner across. The second is turned by half a circle.
fn two_scans(above_m: f64) -> String {
    let mut text = String::new();
    for (place, turn) in [("100 200 1", 1), ("106 206 1", -1)] {
        text += &format!("60\n60\n{place}\n{turn} 0 0\n0 {turn} 0\n0 0 1\n");
        text += &format!("{turn} 0 0 0\n0 {turn} 0 0\n0 0 1 0\n{place} 1\n");
        for k in 0..3600u32 {
            let [x, y] = [0.1 * f64::from(k / 60), 0.1 * f64::from(k % 60)];
            let off = 0.005 * (f64::from((k * 7) % 11) / 5.0 - 1.0);
            let seen = k % 10 > 0;
            text += &if seen {
                format!("{x:.3} {y:.3} {:.4} 0.5\n", off - above_m)
            } else {
                "0 0 0 0.5\n".into()
            };
        }
    }
    text
}

#[test]
fn scans_of_a_ptx_are_one_cloud_and_points_too_far_from_their_scan_are_left_out() {
    let folder = Folder::new("planes-ptx");
    folder.write("scans.ptx", two_scans(1.0));
    let expected = "7200 points (unorganized, with origins), 6480 of them on 1 plane";
    folder.expect("planes scans.ptx -o all", 0, &[expected]);
    let all = report(&folder, "all");
    let plane = &all["planes"][0];
    assert!(plane["normal"][2].as_f64().unwrap() > 0.9999, "a floor was seen from above: {plane}");
    assert!(plane["offset_m"].as_f64().unwrap().abs() < 0.005, "{plane}");
    assert!(all["range_limit"].is_null());

    // Within 3 m of the scanner, 1 m above the floor, lies a quarter of a circle of 2.83 m: 628 places.
    folder.expect("planes scans.ptx -o near --max-range 3", 0, &["of 7200 points beyond 3 m are left out"]);
    let near = report(&folder, "near");
    let left_out = near["range_limit"]["points_left_out"].as_u64().unwrap();
    let on_planes = near["points_on_planes"].as_u64().unwrap();
    assert_eq!(left_out + on_planes, 6480, "{near}");
    assert!(on_planes.abs_diff(2 * 628 * 9 / 10) < 60, "{near}");
    assert_eq!(fs::read(folder.path("near/labels.bin")).unwrap().len(), 4 * 7200);

    folder.expect("planes scans.ptx -o no --max-range 0.5", 1, &["no point lies within 0.5 m"]);
    folder.expect("planes scans.ptx -o no --max-range 0", 2, &["--max-range", "more than 0"]);
    folder.write("cloud.ply", corner([0.0; 3]));
    folder.expect(
        "planes cloud.ply -o no --max-range 5",
        1,
        &["--max-range does not work with cloud.ply", "does not say where points were seen from"],
    );
    assert_eq!(folder.names(), ["all", "cloud.ply", "near", "scans.ptx"]);

    folder.write("ceiling.ptx", two_scans(-1.5));
    folder.expect("planes ceiling.ptx -o ceiling", 0, &["on 1 plane"]);
    let plane = &report(&folder, "ceiling")["planes"][0];
    assert!(plane["normal"][2].as_f64().unwrap() < -0.9999, "a ceiling was seen from below: {plane}");
}
