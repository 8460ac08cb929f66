//! `biplane plot`: tables in, figures out.

use std::fs;

use crate::room::{self, Content};
use crate::run::Folder;

const BASIN: &str = "matcher,stamp_a,stamp_b,start_x_m,start_y_m,start_theta_rad,error_m,error_rad,iterations,cpu_us\n\
    map,1,2,0.1,0.1,0.5,0.001,0.001,5,200\n";
const RELATIONS: &str = "stamp_a,stamp_b,translation_m,rotation_rad\n0,1,0.01,0.001\n2,60,0.02,0.002\n";
const JOURNAL: &str = "stamp_s,iteration,x_m,y_m,theta_rad,cost,step_m,step_rad,used\n\
    1,0,0,0,0,2,0.1,0.1,180\n1,1,0,0,0,1,0.001,0.001,180\n";

#[test]
fn each_table_becomes_a_figure_and_the_same_one_each_time() {
    let folder = Folder::new("plot");
    for (figure, table) in [("basin", BASIN), ("relations", RELATIONS), ("journal", JOURNAL)] {
        folder.write(&format!("{figure}.csv"), table);
        for ending in ["svg", "png"] {
            folder.expect(&format!("plot {figure} {figure}.csv -o {figure}.{ending}"), 0, &["1 curve\n"]);
            folder.expect(&format!("plot {figure} {figure}.csv -o again.{ending} --force"), 0, &[]);
            let [one, other] =
                [figure, "again"].map(|name| fs::read(folder.path(&format!("{name}.{ending}"))).unwrap());
            assert!(one == other, "{figure}.{ending}");
        }
    }
    folder.expect(
        "plot relations relations.csv relations.csv -o two.svg --title Two --caption <Tests.>",
        0,
        &["2 curves"],
    );
    let svg = fs::read_to_string(folder.path("two.svg")).unwrap();
    for words in [
        "Two",
        "relations: mean 0.0150 m, 0.09 deg over 2 relations",
        "translation (cm)",
        "&lt;Tests.&gt; Line:",
    ] {
        assert!(svg.contains(words), "no {words} in {svg}");
    }
    let png = fs::read(folder.path("basin.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
}

#[test]
fn a_table_that_is_another_and_a_figure_of_another_kind_are_refused() {
    let folder = Folder::new("plot-refused");
    folder.write("r.csv", RELATIONS);
    folder.write("broken.csv", RELATIONS.replace("0.01", "x"));
    folder.expect("plot basin r.csv -o f.svg", 1, &["cannot read r.csv", "no column \"start_theta_rad\""]);
    folder.expect(
        "plot relations broken.csv -o f.svg",
        1,
        &["broken.csv", "line 2", "\"translation_m\", found \"x\""],
    );
    folder.expect("plot relations gone.csv -o f.svg", 1, &["gone.csv does not exist"]);
    folder.expect("plot relations r.csv -o f.gif", 2, &["ends in .svg or .png"]);
    folder.expect("plot relations -o f.svg", 2, &[]);
    folder.write("f.svg", "mine");
    folder.expect("plot relations r.csv -o f.svg", 1, &["--force"]);
    assert_eq!(folder.names(), ["broken.csv", "f.svg", "r.csv"]);
}

#[test]
fn paths_are_laid_upon_their_reference_and_drawn_over_a_map() {
    let folder = Folder::new("plot-trajectory");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    folder.expect("traj run.mcap -o way.tum", 0, &[]);
    // The reference is in a frame of its own: turned by a quarter and ten meters off.
    let turned: String = fs::read_to_string(folder.path("way.tum"))
        .unwrap()
        .lines()
        .map(|line| {
            let values: Vec<f64> =
                line.split(' ').skip(1).take(2).map(|word| word.parse().unwrap()).collect();
            let stamp = line.split(' ').next().unwrap();
            format!("{stamp} {} {} {}\n", 10.0 - values[1], values[0], std::f64::consts::FRAC_PI_2)
        })
        .collect();
    folder.write("truth.txt", turned);
    let command = "plot trajectory run.mcap way.tum --reference truth.txt --map run.mcap";
    folder.expect(&format!("{command} -o paths.svg"), 0, &["paths.svg: 3 paths"]);
    folder.expect(&format!("{command} -o paths.png"), 0, &[]);
    folder.expect(&format!("{command} -o again.svg"), 0, &[]);
    let [svg, again] = ["paths.svg", "again.svg"].map(|name| fs::read_to_string(folder.path(name)).unwrap());
    assert!(svg == again && fs::read(folder.path("paths.png")).unwrap().starts_with(b"\x89PNG"));
    for words in [
        "truth (reference): ",
        ">run: ",
        ">way: ",
        " 0.000 m RMS",
        ">x (m)<",
        ">y (m)<",
        "<image ",
        "Gray: floor map.",
    ] {
        assert!(svg.contains(words), "no {words} in {svg}");
    }
    // In the frame of the map all three are one line along x.
    let lines: Vec<[f64; 2]> = svg
        .lines()
        .filter(|line| line.starts_with("<polyline class=\"c") && !line.contains("stroke-width=\"3\""))
        .map(|line| {
            let places = line.split("points=\"").nth(1).unwrap().trim_end_matches("\"/>");
            let ys = places.split(' ').map(|place| place.split(',').nth(1).unwrap().parse::<f64>().unwrap());
            ys.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(y), high.max(y)])
        })
        .collect();
    assert_eq!(lines.len(), 3, "{svg}");
    assert!(lines.iter().all(|[low, high]| low == high && *low == lines[0][0]), "{lines:?}");
    folder.expect("plot trajectory way.tum -o one.svg", 0, &["1 path\n"]);
    let svg = fs::read_to_string(folder.path("one.svg")).unwrap();
    assert!(!svg.contains("<image") && !svg.contains("reference"), "{svg}");
    folder.write("later.txt", "10 0 0 0\n");
    folder.expect(
        "plot trajectory later.txt --reference truth.txt -o f.svg",
        1,
        &["no pose of later.txt is within 0.01 s of one of truth.txt", "truth.txt from ", "--max-dt"],
    );
    folder.expect("plot trajectory way.tum --map way.tum -o f.svg", 1, &["way.tum"]);
    folder.expect("plot trajectory one.svg -o one.svg --force", 1, &["is read"]);
}
