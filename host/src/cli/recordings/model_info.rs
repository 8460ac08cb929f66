//! `biplane info MODEL_DIR`: the rooms, doors and windows of a model, as tables.

use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, anyhow};
use serde_json::Value;

use crate::building::elements::{Room, Use, Wall, WallOpening};

/// The file that lists them.
const LIST: &str = "building.json";

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
    let text = std::fs::read_to_string(&path).map_err(|why| {
        let folder = folder.display();
        anyhow!(
            "{folder} is a folder without a {LIST} that can be read ({why}): `biplane build` of a drive with a vertical laser writes one"
        )
    })?;
    let value: Value = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    if json {
        return Ok(writeln!(out, "{}", text.trim_end())?);
    }
    let lists = lists(value).with_context(|| format!("{}: not a list of this version", path.display()))?;
    Ok(print_lists(out, folder, &lists)?)
}

fn lists(mut value: Value) -> serde_json::Result<Lists> {
    Ok(Lists {
        rooms: serde_json::from_value(value["rooms"].take())?,
        walls: serde_json::from_value(value["walls"].take())?,
        openings: serde_json::from_value(value["openings"].take())?,
    })
}

fn print_lists(out: &mut impl Write, folder: &Path, lists: &Lists) -> io::Result<()> {
    let Lists { rooms, walls, openings } = lists;
    writeln!(
        out,
        "{}: report.html shows it, docs/exports.md says what opens the other files",
        folder.display()
    )?;
    writeln!(out, "  rooms: {} (area in m2, height in m; open: not closed all around)", rooms.len())?;
    for room in rooms {
        let open = if room.closed { "" } else { "  open" };
        let height_m = room.ceiling_z_m - room.floor_z_m;
        writeln!(out, "    {:10} {:8.2} {height_m:6.2}{open}", room.id, room.area_m2)?;
    }
    let thick = walls.iter().filter(|wall| wall.thickness_m.is_some()).count();
    writeln!(out, "  walls: {}, of known thickness {thick}", walls.len())?;
    for (kind, words) in [(Use::Door, "doors"), (Use::Passage, "passages"), (Use::Window, "windows")] {
        let all: Vec<_> = openings.iter().filter(|opening| opening.kind == kind).collect();
        writeln!(out, "  {words}: {} (width, height, sill in m; wall; rooms)", all.len())?;
        for one in all {
            let (wide, high, sill, rooms) = (one.width_m, one.height_m, one.sill_m, one.rooms.join(", "));
            writeln!(out, "    {:10} {wide:6.2} {high:6.2} {sill:6.2}  {}  {rooms}", one.id, one.wall)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::print;

    const LIST: &str = r#"{"generator": "a", "storeys": [], "rooms": [{"id": "S1-R01", "storey": "S1",
        "outline_m": [], "holes_m": [], "floor_z_m": 0.1, "ceiling_z_m": 2.6, "area_m2": 12.345,
        "closed": false, "walled_share": 0.5, "inferred": true}], "walls": [], "openings": [{"id": "S1-N01", "kind": "window",
        "wall": "S1-W02", "center_m": [0, 0, 1], "width_m": 1.2, "height_m": 1.1, "sill_m": 0.9,
        "rooms": ["S1-R01"], "evidence": "seen through", "inferred": false}]}"#;

    #[test]
    fn rooms_and_openings_of_a_model_are_listed() {
        let folder = std::env::temp_dir().join(format!("biplane-model-info-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let printed = |json| {
            let mut out = Vec::new();
            print(&mut out, &folder, json).map(|()| String::from_utf8(out).unwrap())
        };
        assert!(printed(false).unwrap_err().to_string().contains("without a building.json"));
        std::fs::write(folder.join("building.json"), LIST).unwrap();
        let text = printed(false).unwrap();
        assert!(text.contains("S1-R01        12.35   2.50  open"), "{text}");
        assert!(text.contains("S1-N01       1.20   1.10   0.90  S1-W02  S1-R01"), "{text}");
        assert!(text.contains("doors: 0 ") && text.contains("windows: 1 "), "{text}");
        assert_eq!(printed(true).unwrap().trim_end(), LIST);
        std::fs::write(folder.join("building.json"), r#"{"rooms": 3}"#).unwrap();
        assert!(printed(false).unwrap_err().to_string().contains("not a list of this version"));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
