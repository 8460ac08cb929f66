//! Links to the files that lie beside a page.

use std::fmt::Write;

/// Files that a reader may want, with the words of their links.
const KNOWN: [(&str, &str); 15] = [
    ("model.glb", "3D model for viewers"),
    ("model.lod1.glb", "coarser"),
    ("model.lod2.glb", "coarsest"),
    ("model.ply", "3D model as triangles"),
    ("model.obj", "3D model as polygons"),
    ("model.city.json", "city model"),
    ("model.dxf", "floor plan"),
    ("model.ifc", "building model"),
    ("building.json", "rooms, walls, doors"),
    ("points.laz", "points"),
    ("points.las", "points"),
    ("points.ply", "points"),
    ("raw.ply", "raw mesh"),
    ("map.png", "floor map"),
    ("trajectory.tum", "trajectory"),
];

/// The section; nothing when none of the known files is among `names`.
pub(crate) fn section(names: &[String]) -> String {
    let mut links = String::new();
    for (name, words) in KNOWN.iter().filter(|(name, _)| names.iter().any(|there| there == name)) {
        let _ = write!(links, "<li><a href=\"{name}\" download>{name} <small>{words}</small></a></li>");
    }
    if links.is_empty() {
        return String::new();
    }
    format!(
        "<section id=\"downloads\"><h2>Files</h2><ul>{links}</ul>\
         <p class=\"note\">The links work while this page lies in the folder that it was written to. \
         Files that <code>biplane export</code> writes later lie beside them, and are not in this list.</p></section>"
    )
}

#[cfg(test)]
mod tests {
    use super::section;

    #[test]
    fn known_files_that_are_there_are_linked_and_others_are_not() {
        let names = ["model.ifc", "<evil>.glb", "summary.json"].map(str::to_owned);
        let html = section(&names);
        assert_eq!(html.matches("<a ").count(), 1, "{html}");
        assert!(html.contains("href=\"model.ifc\" download"), "{html}");
        assert!(html.contains("biplane export</code> writes later"), "{html}");
        assert_eq!(section(&names[1..]), "");
    }
}
