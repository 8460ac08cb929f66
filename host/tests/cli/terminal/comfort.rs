//! Flags from a file, and runs that only say what they would do.

use std::fs;

use crate::room::{self, Content};
use crate::run::Folder;

#[test]
fn a_dry_run_says_what_a_run_then_does() {
    let folder = Folder::new("dry");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    for (command, output) in [
        ("build run.mcap -o out --formats all", "out"),
        ("compact out/raw.ply -o small --no-report", "small"),
    ] {
        let before = folder.names();
        let dry = folder.expect(&format!("{command} --dry-run"), 0, &[]);
        assert_eq!(folder.names(), before);
        folder.expect(command, 0, &[]);
        let written = dry.stdout.lines().find_map(|line| line.strip_prefix("would write  ")).unwrap();
        let reported: Vec<String> = written.split(", ").map(str::to_owned).collect();
        let mut made: Vec<String> = fs::read_dir(folder.path(output))
            .unwrap()
            .map(|entry| format!("{output}/{}", entry.unwrap().file_name().to_string_lossy()))
            .collect();
        made.sort();
        assert_eq!(reported, made, "{command}");
    }
    let dry = folder.expect("optimize run.mcap -o opt.mcap --dry-run", 0, &[]);
    assert_eq!(
        dry.stdout,
        "would read   run.mcap\nwould do     read, optimize, write\nwould write  opt.mcap\n"
    );
    // What would fail fails, before any work.
    folder.expect("build run.mcap -o out --dry-run", 1, &["out exists already"]);
    folder.expect("build run.mcap -o out", 1, &["out exists already"]);
    folder.expect("optimize run.mcap -o run.mcap --dry-run", 1, &["name another output"]);
}

#[test]
fn a_program_reads_on_stdout_what_a_command_made() {
    let folder = Folder::new("json");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let json = |command: &str| -> serde_json::Value {
        let ran = folder.expect(command, 0, &[]);
        serde_json::from_str(&ran.stdout).unwrap_or_else(|error| panic!("{command}: {error}: {}", ran.stdout))
    };
    let summary = |folder_name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(folder.path(folder_name).join("summary.json")).unwrap()).unwrap()
    };
    assert_eq!(json("build run.mcap -o out --json"), summary("out"));
    assert_eq!(json("compact out/raw.ply -o small --no-report --json"), summary("small"));
    let map = json("map run.mcap -o floor --json");
    assert_eq!(map["files"], serde_json::json!(["floor.pgm", "floor.yaml", "floor.png"]));
    // Binary PGM: the second line says how wide and how high.
    let picture = fs::read(folder.path("floor.pgm")).unwrap();
    let size = format!("{} {}", map["columns"], map["rows"]);
    assert!(String::from_utf8_lossy(&picture[..200]).lines().any(|line| line == size), "{size}");
    let plan = json("build run.mcap -o again --json --dry-run");
    assert_eq!(
        (&plan["reads"], plan["steps"][0].as_str()),
        (&serde_json::json!(["run.mcap"]), Some("optimize"))
    );
    assert!(plan["takes"].is_string() && !folder.path("again").exists(), "{plan}");
}

#[test]
fn figures_and_trajectories_are_said_as_json_too() {
    let folder = Folder::new("json-figures");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    folder.write("a.log", carmen_log());
    let json = |command: &str| -> serde_json::Value {
        let ran = folder.expect(command, 0, &[]);
        serde_json::from_str(&ran.stdout).unwrap_or_else(|error| panic!("{command}: {error}: {}", ran.stdout))
    };
    let way = json("traj run.mcap -o t.tum --json");
    let lines = fs::read_to_string(folder.path("t.tum")).unwrap().lines().count();
    assert_eq!((way["output"].as_str(), way["poses"].as_u64()), (Some("t.tum"), Some(lines as u64)));
    folder.expect("traj run.mcap -o - --json", 2, &["--json prints to stdout"]);
    let paths = json("plot trajectory run.mcap -o t.svg --json");
    assert_eq!((paths["output"].as_str(), paths["names"].as_array().map(Vec::len)), (Some("t.svg"), Some(1)));
    let imported = json("import carmen a.log -o a.mcap --json");
    assert_eq!((imported["scans"].as_u64(), imported["broken_lines"].as_u64()), (Some(3), Some(0)));
    let plan = json("tiles plan run.mcap -o tiles --json");
    assert!(plan["tiles"].as_u64() > Some(0) && plan["points"].as_u64() > Some(0), "{plan}");
    folder.expect("build run.mcap -o out --no-report", 0, &[]);
    let picture = json("render out -o p.png --width 200 --json");
    assert_eq!((picture["output"].as_str(), picture["width"].as_u64()), (Some("p.png"), Some(200)));
}

/// Three scans of four beams.
fn carmen_log() -> String {
    let scan = |t: usize| format!("FLASER 4 1.0 2.0 2.0 1.0 0 0 0 0 0 0 {t}.0 host {t}.0\n");
    (1..=3).map(scan).collect()
}

#[test]
fn wrong_numbers_and_missing_files_are_refused_in_plain_english() {
    let folder = Folder::new("plain");
    folder.expect("build run.mcap -o out --threads 0", 2, &["expected a whole number from 1 to 65535"]);
    folder.expect(
        "build run.mcap -o out --threads x",
        2,
        &["'x' for '--threads <N>': expected a whole number"],
    );
    for command in
        ["planes none.ply -o d", "compact none.ply -o d", "export none.ply --formats dxf", "info none.ply"]
    {
        let ran = folder.expect(command, 1, &["biplane: none.ply does not exist"]);
        assert!(!ran.stderr.contains("os error"), "{}", ran.stderr);
    }
}

#[test]
fn a_number_below_0_is_refused_for_what_it_is() {
    let folder = Folder::new("negative");
    folder.expect("build run.mcap -o out --sigma -1", 2, &["--sigma", "more than 0"]);
}

#[test]
fn a_terminal_shows_the_stages_to_come_and_a_file_only_those_that_are_done() {
    let folder = Folder::new("stages");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let written = folder.expect("build run.mcap -o out --no-optimize --threads 1", 0, &["  polygons  "]);
    assert!(
        !written.stderr.contains('\u{1b}') && !written.stderr.contains("left in all"),
        "{}",
        written.stderr
    );
    let Some(drawn) = folder.on_terminal("build run.mcap -o drawn --no-optimize") else { return };
    let place = |text: &str| drawn.find(text).unwrap_or_else(|| panic!("no {text:?} in {drawn:?}"));
    // To come before the first is done, dim; then done, with what it made.
    assert!(place("report") < place(" scans "), "{drawn:?}");
    assert!(place("report") < place(" files "), "{drawn:?}");
    assert!(drawn.contains(" left in all"), "{drawn:?}");
    // Nothing but results stays: the last thing drawn is the note of what came out.
    assert!(drawn.trim_end().ends_with("% fewer"), "{drawn:?}");
    let quiet = folder.on_terminal("build run.mcap -o quiet --no-optimize --quiet").unwrap();
    assert_eq!(quiet, "");
}

#[test]
fn who_asks_for_more_is_told_parameters_costs_and_files_and_nobody_else() {
    let folder = Folder::new("verbose");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let more = ["parameters: {", "s of processor time", "bytes  loud/model.glb"];
    folder.expect("-v build run.mcap -o loud --no-optimize --no-report", 0, &more);
    let usual = folder.expect("build run.mcap -o usual --no-optimize --no-report", 0, &[]).stderr;
    assert!(more.iter().all(|words| !usual.contains(&words.replace("loud", "usual"))), "{usual}");
    folder.expect("-v --quiet build run.mcap -o none", 2, &["--quiet", "--verbose"]);
}

#[test]
fn the_file_of_all_defaults_changes_nothing_and_another_does() {
    let folder = Folder::new("config");
    room::record(&folder.path("run.mcap"), Content { poses: true, vertical: true });
    let defaults = folder.expect("parameters", 0, &[]).stdout;
    for words in [
        "[build]\n",
        "\n[compact]\n",
        "\n[optimize]\n",
        "\nno-optimize = false\n",
        "\n# sigma = M\n",
        "\nmerging = \"holes\"\n",
    ] {
        assert!(defaults.contains(words), "{words} in\n{defaults}");
    }
    assert!(!defaults.contains("force"), "{defaults}");
    folder.write("all.toml", &defaults);
    folder.write("some.toml", "[build]\nformats = [\"ply\"]\nno-report = true\noutput = \"c\"\n");
    folder.expect("build run.mcap -o a", 0, &[]);
    folder.expect("build run.mcap -o b --config all.toml", 0, &[]);
    folder.expect("--config some.toml build run.mcap", 0, &[]);
    for name in ["model.glb", "model.ply", "model.obj", "model.city.json", "planes.ply"] {
        assert_eq!(
            fs::read(folder.path("a").join(name)).unwrap(),
            fs::read(folder.path("b").join(name)).unwrap()
        );
    }
    let has = |name: &str| folder.path("c").join(name).exists();
    assert!(has("model.ply") && !has("model.glb") && !has("report.html"));
    folder.write("wrong.toml", "[build]\nsigm = 0.02\n");
    folder.expect(
        "build run.mcap -o d --config wrong.toml",
        2,
        &["wrong.toml: [build] has no sigm; it knows", "sigma"],
    );
    folder.write("value.toml", "[build]\nsigma = -1\n");
    folder.expect("build run.mcap -o d --config value.toml", 2, &["--sigma"]);
}
