//! The command line at its border: words in, exit code and text out.

use std::ffi::OsString;
use std::fs;
use std::path::Path;

use biplane_recording::{Writer, WriterOptions};
use clap::CommandFactory;

use super::*;

fn with_program<'a>(words: &'a [&'a str]) -> impl Iterator<Item = OsString> + 'a {
    std::iter::once("biplane-onboard").chain(words.iter().copied()).map(OsString::from)
}

fn exit_code(words: &[&str]) -> u8 {
    run(with_program(words))
}

/// The exit code when words are no command, or ask for help. Nothing is printed.
fn refused(words: &[&str]) -> Option<u8> {
    Cli::try_parse_from(with_program(words)).err().map(|error| refusal_code(&error))
}

fn rig_file(name: &str, text: &str) -> String {
    let path = std::env::temp_dir().join(format!("biplane-cli-{name}-{}.toml", std::process::id()));
    fs::write(&path, text).unwrap();
    path.to_string_lossy().into_owned()
}

const PORTS: &str =
    "[horizontal]\nport = \"/nowhere/a\"\n[vertical]\nport = \"/nowhere/b\"\n[base]\nport = \"/nowhere/c\"\n";

#[test]
fn the_definition_of_the_command_line_is_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn wrong_words_give_2_and_help_gives_0() {
    for words in [&["fly"][..], &["record"], &["replay"], &["replay", "a", "-o", "b", "--speed", "fast"], &[]]
    {
        assert_eq!(refused(words), Some(2), "{words:?}");
    }
    assert_eq!(refused(&["replay", "a", "-o", "b", "--matcher", "magic"]), Some(2));
    for setting in ["align.typo=1", "map.cell_m=0", "map.tiles=1.5", "map.cell_m=NaN", "map.cell_m"] {
        assert_eq!(refused(&["replay", "a", "-o", "b", "--set", setting]), Some(2), "{setting}");
        assert_eq!(refused(&["record", "--rig", "r", "-o", "b", "--set", setting]), Some(2), "{setting}");
    }
    assert_eq!(refused(&["record", "--rig", "r", "-o", "x", "--duration", "soon"]), Some(2));
    assert_eq!(refused(&["parameters", "--json"]), None);
    assert_eq!(refused(&["--help"]), Some(0));
}

#[test]
fn an_output_that_is_there_is_told_with_the_word_that_replaces_it() {
    let path = std::path::PathBuf::from("run.mcap");
    for error in [WriteError::Exists { path: path.clone() }, WriteError::Unfinished { path: path.clone() }] {
        assert!(sentence(&error.into()).contains("--force"));
    }
    assert!(!sentence(&WriteError::NotAFile { path }.into()).contains("--force"));
}

#[test]
fn of_a_full_disk_only_a_recording_says_that_what_was_written_is_kept() {
    let full = || OnboardError::Write(WriteError::DiskFull { path: "run.mcap.active".into() });
    assert_eq!(sentence(&full()), "disk full while writing run.mcap.active");
    let words = "what was written before is kept, and `biplane-onboard salvage` makes it whole";
    assert!(sentence(&runs::record::kept(full())).ends_with(words));
}

#[test]
fn a_rig_is_checked_before_anything_is_opened() {
    let good = rig_file("good", PORTS);
    assert_eq!(exit_code(&["check-config", "--rig", &good]), 0);
    assert_eq!(exit_code(&["check-config", "--rig", &good, "--json"]), 0);
    let unknown = rig_file("unknown", &PORTS.replace("[base]", "[base]\ncolor = 1"));
    assert_eq!(exit_code(&["check-config", "--rig", &unknown]), 1);
    let shared = rig_file("shared", &PORTS.replace("/nowhere/b", "/nowhere/a"));
    assert_eq!(exit_code(&["check-config", "--rig", &shared]), 1);
    assert_eq!(exit_code(&["check-config", "--rig", "/nowhere/rig.toml"]), 1);
    for file in [good, unknown, shared] {
        fs::remove_file(file).unwrap();
    }
}

#[test]
fn ports_that_are_not_there_give_1_and_leave_no_file() {
    let rig = rig_file("ports", PORTS);
    let output = std::env::temp_dir().join(format!("biplane-cli-{}.mcap", std::process::id()));
    assert_eq!(exit_code(&["record", "--rig", &rig, "-o", &output.to_string_lossy()]), 1);
    assert!(!output.exists() && !output.with_extension("mcap.active").exists());
    assert_eq!(exit_code(&["probe", "--rig", &rig]), 1);
    assert_eq!(exit_code(&["probe", "--rig", &rig, "--only", "base"]), 1);
    assert_eq!(refused(&["probe", "--rig", &rig, "--only", "sonar"]), Some(2));
    fs::remove_file(rig).unwrap();
}

#[test]
fn manual_pages_and_completions_come_from_the_same_definition() {
    let folder = std::env::temp_dir().join(format!("biplane-cli-man-{}", std::process::id()));
    assert_eq!(exit_code(&["man", &folder.to_string_lossy()]), 0);
    for command in Cli::command().get_subcommands() {
        let page = folder.join(format!("biplane-onboard-{}.1", command.get_name()));
        let text = fs::read_to_string(&page).unwrap();
        for option in command.get_opts().filter_map(clap::Arg::get_long) {
            assert!(text.contains(&option.replace('-', "\\-")), "{}: --{option}", page.display());
        }
    }
    assert!(folder.join("biplane-onboard.1").exists());
    fs::remove_dir_all(&folder).unwrap();
    let Command::Completions(bash) =
        Cli::try_parse_from(["biplane-onboard", "completions", "bash"]).unwrap().command
    else {
        panic!("another command")
    };
    assert!(String::from_utf8(bash.text(Cli::command())).unwrap().contains("--rig"));
    assert_eq!(refused(&["completions", "tcsh"]), Some(2));
}

#[test]
fn a_folder_with_a_leftover_is_salvaged_and_one_that_is_missing_is_told() {
    let folder = std::env::temp_dir().join(format!("biplane-cli-salvage-{}", std::process::id()));
    fs::create_dir(&folder).unwrap();
    let words = ["salvage", &folder.to_string_lossy(), "--json"];
    assert_eq!(exit_code(&words), 0);
    fs::write(folder.join("run.mcap.active"), "no recording").unwrap();
    assert_eq!(exit_code(&words), 3);
    fs::remove_dir_all(&folder).unwrap();
    assert_eq!(exit_code(&words), 1);
}

#[test]
fn the_probes_table_has_aligned_columns_and_says_what_differs() {
    let reports = [
        crate::io::probe::device_report::DeviceReport {
            device: "horizontal laser",
            port: "/dev/a".to_owned(),
            answered: true,
            baud_configured: 38400,
            baud_found: Some(9600),
            kind: Some("LMS291;S05;X01.27".to_owned()),
            firmware: Some("X01.27".to_owned()),
            fov_deg: Some(180),
            resolution_deg: Some(0.5),
            units: Some("cm"),
            measuring_mode: Some(6),
            fault: Some(true),
            problem: None,
            remarks: vec!["faults: error 12".to_owned(), "record would change the rate".to_owned()],
        },
        crate::io::probe::device_report::DeviceReport {
            device: "base",
            port: "/dev/base".to_owned(),
            problem: Some("no answer".to_owned()),
            ..Default::default()
        },
    ];
    let table = "\
device            port       baud               type               firmware  field  step  units  mode  status
horizontal laser  /dev/a     9600 (rig: 38400)  LMS291;S05;X01.27  X01.27    180    0.5   cm     06    FAULT
  faults: error 12
  record would change the rate
base              /dev/base  -                  -                  -         -      -     -      -     no answer
";
    assert_eq!(devices::probe::table(&reports), table);
}

#[test]
fn a_basin_without_scans_or_pairs_gives_1() {
    let list = std::env::temp_dir().join(format!("biplane-cli-pairs-{}", std::process::id()));
    fs::write(&list, "1 2 0.5 0 0\n").unwrap();
    let list = list.to_string_lossy();
    assert_eq!(exit_code(&["basin", "/nowhere.mcap", &list]), 1);
    assert_eq!(exit_code(&["basin", "/nowhere.mcap", "/nowhere.txt"]), 1);
    assert_eq!(refused(&["basin", "/nowhere.mcap"]), Some(2));
    assert_eq!(refused(&["basin", "/nowhere.mcap", &list, "--matcher", "magic"]), Some(2));
    fs::remove_file(&*list).unwrap();
}

#[test]
fn every_command_has_an_example_and_every_example_is_a_command() {
    assert_eq!(biplane_cli::faulty_examples(Cli::command()), Vec::<String>::new());
}

#[test]
fn a_rig_is_checked_by_its_name_alone_too() {
    let good = rig_file("named", PORTS);
    let by_name = exit_code(&["check-config", &good]);
    assert_eq!(by_name, exit_code(&["check-config", "--rig", &good]));
    assert_eq!(exit_code(&["check-config", "/nowhere/rig.toml"]), 1);
    assert_eq!(refused(&["check-config"]), Some(2));
    assert_eq!(refused(&["check-config", &good, "--rig", &good]), Some(2));
    fs::remove_file(&good).unwrap();
}

#[test]
fn no_output_replaces_a_file_unasked_nor_an_input_or_another_output_at_all() {
    let folder = std::env::temp_dir().join(format!("biplane-cli-outputs-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir(&folder).unwrap();
    let name = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let capture = name("a.mcap");
    fs::write(name("rig.toml"), PORTS).unwrap();
    fs::write(name("there.csv"), "somebody's").unwrap();
    fs::write(name("pairs.txt"), "1 2 0.5 0 0\n").unwrap();
    Writer::create(Path::new(&capture), &WriterOptions::default()).unwrap().finish().unwrap();
    let (rig, pairs) = (name("rig.toml"), name("pairs.txt"));
    let replay = ["replay", &capture, "--rig", &rig];
    let record = ["record", "--rig", &rig];
    let basin = ["basin", &capture, &pairs, "--rig", &rig];
    let there = "exists already; it is not overwritten without --force";
    let (input, twice) = ("is an input: it is not overwritten", "is another output of the same run");
    let files = || ["a.mcap", "rig.toml", "there.csv", "pairs.txt"].map(|file| fs::read(name(file)).unwrap());
    let before = files();
    for (command, output, journal, forced, expected) in [
        (&replay[..], "o.mcap", "there.csv", false, there),
        (&replay, "o.mcap", "a.mcap", true, input),
        (&replay, "o.mcap", "rig.toml", true, input),
        (&replay, "rig.toml", "j.csv", true, input),
        (&replay, "o.mcap", "o.mcap", true, twice),
        (&replay, "o.mcap", "o.mcap.active", true, twice),
        (&record, "o.mcap", "there.csv", false, there),
        (&record, "o.mcap", "rig.toml", true, input),
        (&record, "rig.toml", "j.csv", true, input),
        (&record, "o.mcap", "o.mcap", false, twice),
        (&basin, "there.csv", "j.csv", false, there),
        (&basin, "b.csv", "there.csv", false, there),
        (&basin, "pairs.txt", "j.csv", true, input),
        (&basin, "b.csv", "a.mcap", true, input),
        (&basin, "rig.toml", "j.csv", true, input),
        (&basin, "b.csv", "b.csv", true, twice),
    ] {
        let (output, journal) = (name(output), name(journal));
        let words =
            [command, &["-o", &output, "--journal", &journal], if forced { &["--force"] } else { &[] }];
        let words = words.concat();
        let error = Cli::try_parse_from(with_program(&words)).unwrap().command.carry_out(false).unwrap_err();
        assert!(error.to_string().contains(expected), "{words:?}: {error}");
        assert!(files() == before, "{words:?}");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), before.len(), "{words:?}: something was begun");
    }
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_device_that_the_rig_has_not_is_asked_with_a_word_of_what_is_missing() {
    let without = "[horizontal]\nport = \"/nowhere/a\"\n[base]\nprotocol = \"none\"\n";
    let rig = rig_file("only", without);
    let carried = rig_file("only-imu", &format!("{without}[imu]\n"));
    for (rig, device, words) in [
        (&rig, "imu", "there is no inertial unit to ask: the rig has no [imu]"),
        (&rig, "vertical", "there is no vertical laser to ask: the rig has no [vertical]"),
        (&rig, "base", "there is no base to ask: the rig has protocol = \"none\" in [base]"),
        (&carried, "imu", "there is no inertial unit to ask: its samples come with"),
    ] {
        let words_of_command = ["probe", "--rig", rig, "--only", device];
        let cli = Cli::try_parse_from(with_program(&words_of_command)).unwrap();
        let error = cli.command.carry_out(false).unwrap_err().to_string();
        assert!(error.starts_with(words), "{error}");
    }
    for file in [rig, carried] {
        fs::remove_file(file).unwrap();
    }
}
