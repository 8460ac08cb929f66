//! `biplane info MODEL_DIR`: the rooms, doors and windows of a model, as tables.

use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, bail};
use serde_json::Value;

use crate::building::elements::{CLOSED_LEAF, Room, Use, Wall, WallOpening};
use crate::building::{Kind, OpeningKind};
use crate::formats::text::model_json;
use biplane_cli::counted;

/// The file that lists them.
pub(super) const LIST: &str = "building.json";

/// What is printed of a model.
struct Lists {
    rooms: Vec<Room>,
    walls: Vec<Wall>,
    openings: Vec<WallOpening>,
}

/// Prints what a model's folder lists; with `json` the list itself.
///
/// # Errors
/// When the folder has no list, or one that cannot be read.
pub(super) fn print(out: &mut impl Write, folder: &Path, json: bool) -> anyhow::Result<()> {
    let path = folder.join(LIST);
    if !path.exists() {
        let shown = folder.display();
        if folder.join(model_json::NAME).exists() {
            return print_mesh(out, folder, json);
        }
        if is_truth(folder) {
            bail!(
                "{shown} is no model, and looks like the truth of a simulated drive: \
                 `biplane compare MODEL --truth {shown}/surfaces.ply` and \
                 `biplane evaluate trajectory {shown}/poses.tum RUN.mcap` take it"
            );
        }
        if folder.join("planes.json").exists() {
            bail!(
                "{shown} holds planes that `biplane planes` found in a cloud, and no building: planes.json lists them"
            );
        }
        bail!(
            "{shown} is a folder without {LIST}, which `biplane build` writes of a drive with a vertical laser{}",
            if folder.join("map.yaml").exists() { "; it holds the map of one without" } else { "" }
        );
    }
    let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let value: Value = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    if json {
        return Ok(writeln!(out, "{}", text.trim_end())?);
    }
    let lists = lists(value).with_context(|| format!("{}: not a list of this version", path.display()))?;
    Ok(print_lists(out, folder, &lists)?)
}

/// Prints what is known of a model that `biplane compact` made of a mesh.
fn print_mesh(out: &mut impl Write, folder: &Path, json: bool) -> anyhow::Result<()> {
    if json {
        bail!(
            "{} has no {LIST}: `biplane compact` made it of a mesh, and rooms are found in drives alone; summary.json \
             has its figures",
            folder.display()
        );
    }
    print_head(out, folder)?;
    writeln!(out, "  no rooms: they are found in drives alone, and `biplane compact` made this of a mesh")?;
    Ok(print_surfaces(out, folder)?)
}

/// What is drawn of a model without rooms: what its surfaces alone tell.
fn print_surfaces(out: &mut impl Write, folder: &Path) -> io::Result<()> {
    let bytes = std::fs::read(folder.join(model_json::NAME)).ok();
    let Some(file) = bytes.and_then(|bytes| model_json::read(&bytes).ok()) else { return Ok(()) };
    let building = file.building();
    let walls = building.parts.iter().filter(|part| part.kind == Kind::Wall).count();
    let openings =
        |kind: OpeningKind| building.openings.iter().filter(|opening| opening.kind == kind).count();
    writeln!(
        out,
        "  its surfaces alone show {}, {}, {}, {} and {}: those are in model.ifc and model.dxf\n  \
           (`biplane export {} --formats ifc,dxf`)",
        counted(building.floors_m.len(), "storey"),
        counted(walls, "surface") + " of walls",
        counted(openings(OpeningKind::Door), "door"),
        counted(openings(OpeningKind::Passage), "passage"),
        counted(openings(OpeningKind::Window), "window"),
        folder.display()
    )
}

/// Whether a folder has the files of a simulator's truth.
fn is_truth(folder: &Path) -> bool {
    ["surfaces.ply", "poses.tum"].iter().all(|name| folder.join(name).exists())
}

fn lists(mut value: Value) -> serde_json::Result<Lists> {
    Ok(Lists {
        rooms: serde_json::from_value(value["rooms"].take())?,
        walls: serde_json::from_value(value["walls"].take())?,
        openings: serde_json::from_value(value["openings"].take())?,
    })
}

fn print_head(out: &mut impl Write, folder: &Path) -> io::Result<()> {
    writeln!(
        out,
        "{}: report.html shows it, docs/exports.md says what opens the other files",
        folder.display()
    )
}

fn print_lists(out: &mut impl Write, folder: &Path, lists: &Lists) -> io::Result<()> {
    let Lists { rooms, walls, openings } = lists;
    print_head(out, folder)?;
    if rooms.is_empty() && walls.is_empty() && openings.is_empty() {
        writeln!(out, "  no room was found: the robot was in none, or saw too little of its walls")?;
        return print_surfaces(out, folder);
    }
    print_names(out, lists)?;
    print_rooms(out, rooms)?;
    let thick = walls.iter().filter(|wall| wall.thickness_m.is_some()).count();
    writeln!(out, "  walls: {}, {thick} of them of known thickness", walls.len())?;
    for kind in Use::LISTED {
        let words = format!("{}s", kind.word());
        let all: Vec<_> = openings.iter().filter(|opening| opening.kind == kind).collect();
        print_openings(out, &words, &all)?;
    }
    Ok(())
}

/// What names mean, by one that is in the list.
fn print_names(out: &mut impl Write, lists: &Lists) -> io::Result<()> {
    let room = || lists.rooms.first().map(|room| (&room.id, "room"));
    let opening = || lists.openings.first().map(|opening| (&opening.id, opening.kind.word()));
    let wall = || lists.walls.first().map(|wall| (&wall.id, "wall"));
    let Some((id, kind)) = room().or_else(opening).or_else(wall) else { return Ok(()) };
    write!(out, "  ")?;
    if let Some((storey, number)) = id.strip_prefix('S').and_then(|id| id.split_once('-')) {
        let number = number.trim_start_matches(|letter: char| !letter.is_ascii_digit());
        write!(out, "{id} is {kind} {} of storey {storey}; ", number.trim_start_matches('0'))?;
    }
    writeln!(out, "R: room, W: wall, D: door, P: passage, N: window")
}

fn print_rooms(out: &mut impl Write, rooms: &[Room]) -> io::Result<()> {
    if rooms.is_empty() {
        return writeln!(out, "  rooms: none");
    }
    writeln!(out, "  rooms: {}", rooms.len())?;
    writeln!(out, "    {:8} {:>8} {:>8}", "name", "area m2", "height m")?;
    for room in rooms {
        let open = match (room.closed, room.guessed_m2()) {
            (true, _) => String::new(),
            (false, None) => "  not closed all around".to_owned(),
            (false, Some(guessed_m2)) => {
                let seen_m2 = room.area_m2 - guessed_m2;
                format!("  not closed all around: {seen_m2:.2} seen, {guessed_m2:.2} a guess")
            }
        };
        let height_m = room.ceiling_z_m - room.floor_z_m;
        writeln!(out, "    {:8} {:8.2} {height_m:8.2}{open}", room.id, room.area_m2)?;
    }
    Ok(())
}

fn print_openings(out: &mut impl Write, words: &str, all: &[&WallOpening]) -> io::Result<()> {
    if all.is_empty() {
        return writeln!(out, "  {words}: none");
    }
    writeln!(out, "  {words}: {}", all.len())?;
    writeln!(
        out,
        "    {:8} {:>8} {:>8} {:>8}  {:8} of rooms",
        "name", "width m", "height m", "sill m", "in wall"
    )?;
    for one in all {
        let (wide, high, sill, rooms) = (one.width_m, one.height_m, one.sill_m, one.rooms.join(", "));
        let note = note(one);
        writeln!(out, "    {:8} {wide:8.2} {high:8.2} {sill:8.2}  {:8} {rooms}{note}", one.id, one.wall)?;
    }
    Ok(())
}

/// What of an opening is a guess.
fn note(opening: &WallOpening) -> &'static str {
    match opening.kind {
        _ if !opening.inferred => "",
        _ if opening.is_narrow() => "  narrower than doors are",
        Use::Door if opening.evidence == CLOSED_LEAF => "  closed: nothing was seen of its foot",
        Use::Window => "  nothing was seen under it",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::print;

    const LIST: &str = r#"{"generator": "a", "storeys": [], "rooms": [{"id": "S1-R01", "storey": "S1",
        "outline_m": [], "holes_m": [], "floor_z_m": 0.1, "ceiling_z_m": 2.6, "area_m2": 12.345, "seen_area_m2": 11.5,
        "closed": false, "walled_share": 0.5, "inferred": true}], "walls": [], "openings": [{"id": "S1-N01", "kind": "window",
        "wall": "S1-W02", "center_m": [0, 0, 1], "width_m": 1.2, "height_m": 1.1, "sill_m": 0.9,
        "rooms": ["S1-R01"], "evidence": "seen through", "inferred": false},
        {"id": "S1-D01", "kind": "door", "wall": "S1-W02", "center_m": [0, 0, 1], "width_m": 0.9, "height_m": 2,
        "sill_m": 0, "rooms": ["S1-R01"], "evidence": "closed leaf", "inferred": true}]}"#;

    #[test]
    fn rooms_and_openings_of_a_model_are_listed() {
        let folder = std::env::temp_dir().join(format!("biplane-model-info-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let printed = |json| {
            let mut out = Vec::new();
            print(&mut out, &folder, json).map(|()| String::from_utf8(out).unwrap())
        };
        let refused = || printed(false).unwrap_err().to_string();
        assert!(refused().contains("without building.json, which `biplane build` writes"), "{}", refused());
        let truth = ["surfaces.ply", "poses.tum"].map(|name| folder.join(name));
        truth.iter().for_each(|path| std::fs::write(path, "").unwrap());
        assert!(
            refused().contains("the truth of a simulated drive: `biplane compare MODEL --truth /"),
            "{}",
            refused()
        );
        std::fs::write(folder.join("building.json"), LIST).unwrap();
        let text = printed(false).unwrap();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        let expected = [
            "  S1-R01 is room 1 of storey 1; R: room, W: wall, D: door, P: passage, N: window",
            "  rooms: 1",
            "    name      area m2 height m",
            "    S1-R01      12.35     2.50  not closed all around: 11.50 seen, 0.85 a guess",
            "  walls: 0, 0 of them of known thickness",
            "  doors: 1",
            "    name      width m height m   sill m  in wall  of rooms",
            "    S1-D01       0.90     2.00     0.00  S1-W02   S1-R01  closed: nothing was seen of its foot",
            "  passages: none",
            "  windows: 1",
            "    name      width m height m   sill m  in wall  of rooms",
            "    S1-N01       1.20     1.10     0.90  S1-W02   S1-R01",
        ];
        assert_eq!(lines, expected);
        assert_eq!(printed(true).unwrap().trim_end(), LIST);
        std::fs::write(folder.join("building.json"), r#"{"rooms": 3}"#).unwrap();
        assert!(printed(false).unwrap_err().to_string().contains("not a list of this version"));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
