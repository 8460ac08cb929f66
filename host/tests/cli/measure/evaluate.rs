//! `biplane evaluate`: figures from texts and recordings.

use std::fs;

use serde_json::Value;

use crate::room::{self, Content};
use crate::run::Folder;

/// The number at a path of keys and indices.
fn number(json: &str, path: &str) -> f64 {
    let value: Value = serde_json::from_str(json).unwrap();
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {json}"))
}

#[test]
fn relations_are_measured_on_recordings_and_on_both_forms_of_text_alike() {
    let folder = Folder::new("evaluate-relations");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    folder.expect("traj run.mcap -o run.tum", 0, &[]);
    folder.expect("traj run.mcap -o run.txt --format xytheta", 0, &[]);
    // The robot drives along x at 0.25 m a second: after 4 s it is a meter on, after 16 s four.
    folder.write(
        "room.relations",
        "1700000000 1700000004 1.03 0.04 0 0 0 0.1\n1700000020 1700000004 -4 0 0 0 0 0\n",
    );
    for trajectory in ["run.mcap", "run.tum", "run.txt"] {
        let words =
            format!("evaluate relations room.relations {trajectory} --json --per-relation {trajectory}.csv");
        let ran = folder.expect(&words, 0, &[]);
        assert!((number(&ran.stdout, "/translation_m/mean") - 0.025).abs() < 1e-6, "{}", ran.stdout);
        assert!((number(&ran.stdout, "/rotation_deg/max") - 0.1_f64.to_degrees()).abs() < 1e-6);
        assert_eq!(number(&ran.stdout, "/poses/direct"), 3.0);
        assert_eq!(
            fs::read_to_string(folder.path(&format!("{trajectory}.csv"))).unwrap(),
            "stamp_a,stamp_b,translation_m,rotation_rad\n\
             1700000000.000000000,1700000004.000000000,0.050000000,0.100000000\n\
             1700000020.000000000,1700000004.000000000,0.000000000,0.000000000\n"
        );
    }
    let ran = folder.expect("evaluate relations room.relations run.txt --max-gap 10", 0, &[]);
    assert!(
        ran.stdout.contains("1 relation between 2 poses") && ran.stdout.contains("0.0500"),
        "{}",
        ran.stdout
    );
    folder.expect("evaluate relations room.relations run.txt --max-gap 1", 1, &["none of the 2 relations"]);
    folder.expect("evaluate relations run.txt run.txt", 1, &["run.txt", "line 1: expected", "t1 t2 x y z"]);
    // Each kind of file in the place of the other.
    folder.expect("evaluate relations run.tum run.mcap", 1, &["run.tum holds the poses of a trajectory"]);
    folder.expect("evaluate relations run.mcap run.mcap", 1, &["run.mcap is an MCAP file", "t1 t2 x y z"]);
    for command in ["evaluate relations room.relations", "evaluate trajectory run.mcap"] {
        folder.expect(&format!("{command} room.relations"), 1, &["holds relations between poses"]);
    }
    folder.expect("plot trajectory room.relations -o p.svg", 1, &["holds relations between poses"]);
    folder.write("carmen.log", "FLASER 2 1.0 2.0 0 0 0 0 0 0 1.0 host 1.0\n");
    folder.expect("evaluate trajectory carmen.log run.mcap", 1, &["a CARMEN log", "`biplane import carmen`"]);
    folder.expect("evaluate relations room.relations run.mcap --per-relation run.txt", 1, &["--force"]);
    folder.expect(
        "evaluate relations room.relations run.mcap --per-relation run.mcap --force",
        1,
        &["is read"],
    );
    folder.expect("evaluate relations room.relations run.mcap --max-gap=-1", 2, &["not negative"]);
}

#[test]
fn relations_outside_of_the_trajectorys_time_are_left_out_and_said_and_of_none_there_is_no_figure() {
    let folder = Folder::new("evaluate-outside");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    // A meter on after 4 s; then one that begins inside and ends after the drive, and one before it.
    let outside = "1700000004 1700000024 5 0 0 0 0 0\n1699999900 1699999904 1 0 0 0 0 0\n";
    folder.write("both.relations", format!("1700000000 1700000004 1.03 0.04 0 0 0 0\n{outside}"));
    folder.write("outside.relations", outside);
    let ran = folder.expect("evaluate relations both.relations run.mcap --json", 0, &[]);
    for (path, wanted) in [("/relations", 1.0), ("/relations_left_out", 2.0), ("/poses/outside", 3.0)] {
        assert_eq!(number(&ran.stdout, path), wanted, "{path}: {}", ran.stdout);
    }
    assert!((number(&ran.stdout, "/translation_m/mean") - 0.05).abs() < 1e-6, "{}", ran.stdout);
    let ran = folder.expect("evaluate relations both.relations run.mcap", 0, &[]);
    for words in ["1 relation between 2 poses", "2 relations left out: outside of the trajectory's time"] {
        assert!(ran.stdout.contains(words), "{words}: {}", ran.stdout);
    }
    let words =
        ["no relation of outside.relations lies in the time of run.mcap", "from 1699999900.000000000 to"];
    folder.expect("evaluate relations outside.relations run.mcap", 1, &words);
}

#[test]
fn a_trajectory_is_laid_upon_the_truth_before_it_is_judged_unless_told_otherwise() {
    let folder = Folder::new("evaluate-trajectory");
    // A quarter turn and a meter off, but for the last pose, which is 3 cm short of where it should be.
    folder.write("truth.txt", "0 0 0 0\n1 1 0 0\n2 2 0 0\n3 3 0 0\n");
    folder.write(
        "turned.txt",
        "0 1 0 1.5707963267948966\n1 1 1 1.5707963267948966\n2 1 2 1.5707963267948966\n",
    );
    let ran = folder.expect("evaluate trajectory truth.txt turned.txt --json", 0, &[]);
    assert_eq!(number(&ran.stdout, "/pairs"), 3.0);
    assert!(number(&ran.stdout, "/absolute/translation_m/max") < 1e-9, "{}", ran.stdout);
    assert!((number(&ran.stdout, "/alignment/2") + 90.0).abs() < 1e-9);
    assert_eq!(number(&ran.stdout, "/relative/1/delta/metres"), 1.0);
    let ran = folder.expect("evaluate trajectory truth.txt turned.txt --no-align --delta 2f --json", 0, &[]);
    assert!((number(&ran.stdout, "/absolute/rotation_deg/mean") - 90.0).abs() < 1e-9);
    assert!((number(&ran.stdout, "/absolute/translation_m/max") - 5.0_f64.sqrt()).abs() < 1e-9);
    assert!(number(&ran.stdout, "/relative/0/errors/translation_m/max") < 1e-9);
    let ran = folder.expect("evaluate trajectory truth.txt turned.txt --delta 9m", 0, &[]);
    assert!(ran.stdout.contains("nothing is that far apart"), "{}", ran.stdout);
    folder.write("later.txt", "10 0 0 0\n");
    folder.expect("evaluate trajectory truth.txt later.txt", 1, &["no pose of later.txt is within 0.01 s"]);
    let spans = "later.txt is from 10.000000000 to 10.000000000 s, truth.txt from ";
    folder.expect("evaluate trajectory truth.txt later.txt", 1, &[spans, "; --max-dt takes poses"]);
    folder.expect("evaluate trajectory gone.txt later.txt", 1, &["gone.txt"]);
    for wrong in ["1", "0.5f", "-1m", "m", "1é"] {
        let words = format!("evaluate trajectory truth.txt turned.txt --delta={wrong}");
        folder.expect(&words, 2, &["expected a length such as"]);
    }
}

#[test]
fn a_trajectory_in_another_unit_is_pointed_out() {
    let folder = Folder::new("evaluate-unit");
    folder.write("truth.txt", "0 0 0 0\n1 1 0 0\n2 2 1 0\n");
    folder.write("cm.txt", "0 0 0 0\n1 100 0 0\n2 200 100 0\n");
    folder.write("drifts.txt", "0 0 0 0\n1 2 0 0\n2 4 1 0\n");
    let words = "cm.txt: 100.0 times larger than the reference: is the estimate in centimeters?";
    let ran = folder.expect("evaluate trajectory truth.txt cm.txt --json", 0, &[words]);
    assert!((number(&ran.stdout, "/size_ratio") - 100.0).abs() < 1e-9, "{}", ran.stdout);
    let words = "truth.txt: 100.0 times smaller than the reference: is the reference in centimeters?";
    folder.expect("evaluate trajectory cm.txt truth.txt", 0, &[words]);
    let ran = folder.expect("evaluate trajectory truth.txt drifts.txt", 0, &[]);
    assert!(!ran.stderr.contains("times"), "{}", ran.stderr);
}

/// The old order, while it lives: where the files tell, the figures are the same, and the new one is named.
#[test]
fn what_is_judged_may_still_come_first_and_is_told_to_come_second() {
    let folder = Folder::new("evaluate-order");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    for form in ["tum", "xytheta"] {
        folder.expect(&format!("traj run.mcap -o run.{form} --format {form}"), 0, &[]);
    }
    folder.write("room.relations", "1700000000 1700000004 1.03 0.04 0 0 0 0.1\n");
    for (new, old) in [
        ("relations room.relations run.mcap", "relations run.mcap room.relations"),
        ("relations room.relations run.tum", "relations run.tum room.relations"),
        ("relations room.relations run.xytheta", "relations run.xytheta room.relations"),
        ("trajectory run.tum run.mcap", "trajectory run.mcap run.tum"),
    ] {
        let asked = folder.expect(&format!("evaluate {new} --json"), 0, &[]);
        assert!(!asked.stderr.contains("must come first"), "{}", asked.stderr);
        let of_old = folder.expect(&format!("evaluate {old} --json"), 0, &["must come first"]);
        assert_eq!(of_old.stdout, asked.stdout, "{old}");
    }
}

#[test]
fn the_entropy_of_a_rooms_map_is_said_with_its_cell_size() {
    let folder = Folder::new("evaluate-map");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: false });
    let ran = folder.expect("evaluate map run.mcap --json", 0, &[]);
    assert_eq!(number(&ran.stdout, "/resolution_m"), 0.05);
    // Floor and walls of a room of 8 x 4 m: some 12,800 cells, nearly all of them well known.
    let (cells, mean_bits) = (number(&ran.stdout, "/cells"), number(&ran.stdout, "/mean_bits"));
    assert!((10_000.0..14_000.0).contains(&cells) && (0.05..0.3).contains(&mean_bits), "{}", ran.stdout);
    let ran = folder.expect("evaluate map run.mcap --resolution 0.1", 0, &[]);
    assert!(ran.stdout.contains("cells of 0.1 m"), "{}", ran.stdout);
    room::record(&folder.path("unposed.mcap"), Content { poses: false, vertical: false });
    folder.expect("evaluate map unposed.mcap", 1, &["no pose"]);
}
