//! `biplane tiles`: the same model in pieces, in any order, after any interruption.

use std::fs;
use std::path::Path;

use crate::room::{self, Content};
use crate::run::{Folder, names};

/// Files that hold measured times.
const TIMED: [&str; 2] = ["summary.json", "report.html"];

fn recorded(name: &str) -> Folder {
    let folder = Folder::new(name);
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder
}

/// Two models have the same bytes, also in folders within.
#[track_caller]
fn expect_same(one: &Path, other: &Path) {
    assert_eq!(names(one), names(other));
    for name in names(one).iter().filter(|name| !TIMED.contains(&name.as_str())) {
        if one.join(name).is_dir() {
            expect_same(&one.join(name), &other.join(name));
            continue;
        }
        assert!(fs::read(one.join(name)).unwrap() == fs::read(other.join(name)).unwrap(), "{name} differs");
    }
}

#[test]
fn a_model_of_one_tile_is_the_model_without_tiles() {
    let folder = recorded("tiles-one");
    folder.expect("build run.mcap -o whole --formats all", 0, &[]);
    let planned = folder.expect("tiles plan run.mcap -o tiles", 0, &[]);
    assert_eq!(planned.stdout, "1 tile\n");
    folder.expect("tiles run tiles --index 0", 0, &["tile 0: "]);
    folder.expect("tiles merge tiles -o merged --formats all", 0, &["% fewer"]);
    expect_same(&folder.path("whole"), &folder.path("merged"));
    let building = fs::read_to_string(folder.path("merged/building.json")).unwrap();
    let building: serde_json::Value = serde_json::from_str(&building).unwrap();
    assert!(!building["rooms"].as_array().unwrap().is_empty(), "{building}");
}

#[test]
fn tiles_may_be_run_in_any_order_and_again_and_missing_ones_are_named() {
    let folder = recorded("tiles-many");
    let planned = folder.expect("tiles plan run.mcap -o tiles --size 2", 0, &[]);
    let count: usize = planned.stdout.split_whitespace().next().unwrap().parse().unwrap();
    assert!(count > 3, "{planned:?}");
    folder.expect("tiles plan run.mcap -o other --size 2", 0, &[]);
    for index in 0..count {
        folder.expect(&format!("tiles run tiles --index {index}"), 0, &[]);
    }
    folder.expect("tiles merge tiles -o first", 0, &["% fewer"]);

    // Of a run that was killed, and of one whose disk forgot the end.
    folder.write("other/tiles/00001.found.elsewhere-7.part", "half");
    folder.write("other/tiles/00002.found", &fs::read(folder.path("tiles/tiles/00002.found")).unwrap()[..99]);
    for index in (2..count).rev().filter(|index| *index != 2) {
        folder.expect(&format!("tiles run other --index {index} --threads 1"), 0, &[]);
    }
    let refused = folder.expect("tiles merge other -o second", 1, &["3 of", "--array=0-2"]);
    assert_eq!(refused.stdout, "--array=0-2\n");
    for index in [2, 0, 1] {
        folder.expect(&format!("tiles run other --index {index}"), 0, &[&format!("tile {index}: ")]);
    }
    folder.expect("tiles run other --index 1", 0, &["tile 1 is finished already"]);
    folder.expect("tiles merge other -o second --threads 1", 0, &[]);
    expect_same(&folder.path("first"), &folder.path("second"));
    folder.expect(&format!("tiles run other --index {count}"), 2, &["there is no tile"]);
}

#[test]
fn what_is_not_what_was_planned_is_refused() {
    let folder = recorded("tiles-changed");
    folder.expect("tiles plan run.mcap -o tiles", 0, &[]);
    folder.expect("tiles plan run.mcap -o tiles", 1, &["exists already"]);
    folder.expect("tiles run tiles --index 0", 0, &[]);
    folder.expect("tiles plan run.mcap -o tiles --force", 0, &[]);
    assert_eq!(names(&folder.path("tiles/tiles")), ["00000.points"], "what was found before is gone");
    folder.write("tiles/tiles/notes.txt", "mine");
    folder.expect("tiles plan run.mcap -o tiles --force", 1, &["holds tiles, which no plan of tiles wrote"]);
    fs::remove_file(folder.path("tiles/tiles/notes.txt")).unwrap();
    folder.expect("tiles run . --index 0", 1, &["is . a folder of `biplane tiles plan`?"]);
    let points = folder.path("tiles/tiles/00000.points");
    let whole = fs::read(&points).unwrap();
    fs::write(&points, &whole[..whole.len() - 1]).unwrap();
    folder.expect("tiles run tiles --index 0", 1, &["00000.points is not what was planned"]);
    fs::write(&points, whole).unwrap();
    folder.expect("tiles run tiles --index 0", 0, &[]);
    let mut recording = fs::read(folder.path("run.mcap")).unwrap();
    recording.push(0);
    folder.write("run.mcap", recording);
    folder.expect("tiles merge tiles -o model", 1, &["run.mcap is not what it was", "plan again"]);
    let script = folder.expect("tiles script tiles", 0, &[]).stdout;
    for words in ["#SBATCH --array=0-0\n", "afterok:", "tiles run", "tiles merge"] {
        assert!(script.contains(words), "{words}: {script}");
    }
    assert!(!script.contains('@'), "{script}");
}
