//! The page's files, and how places in them are filled: `{{name}}`.

use std::io::{self, Write};

/// The page.
pub(super) const PAGE: &str = include_str!("assets/page.html");
/// The 3D view's part of it.
pub(super) const VIEW: &str = include_str!("assets/view.html");
/// The pane of the simplification by others, left out without one.
pub(super) const SIMPLE_PANE: &str = include_str!("assets/simple_pane.html");
/// Its button.
pub(super) const SIMPLE_TAB: &str = "<button type=\"button\" data-show=\"simple\">QSlim-like</button>";
/// What it is.
pub(super) const SIMPLE_NOTE: &str = "<p class=\"note\">QSlim-like: the raw mesh simplified by quadric errors to as many triangles as the \
    model has polygons and triangles.</p>";
/// How it looks.
pub(super) const STYLE: &str = include_str!("assets/style.css");

/// What the page does, in the order in which the files use each other; without a 3D view only the first.
const SCRIPTS: [&str; 15] = [
    include_str!("assets/scripts/map.js"),
    include_str!("assets/scripts/mesh/bytes.js"),
    include_str!("assets/scripts/mesh/matrix.js"),
    include_str!("assets/scripts/mesh/normals.js"),
    include_str!("assets/scripts/mesh/edges.js"),
    include_str!("assets/scripts/mesh/coarse.js"),
    include_str!("assets/scripts/pane/camera.js"),
    include_str!("assets/scripts/pane/controls.js"),
    include_str!("assets/scripts/pane/pane.js"),
    include_str!("assets/scripts/pane/pick.js"),
    include_str!("assets/scripts/pane/measure.js"),
    include_str!("assets/scripts/pane/panel.js"),
    include_str!("assets/scripts/pane/pace.js"),
    include_str!("assets/scripts/pane/viewer.js"),
    include_str!("assets/scripts/main.js"),
];

/// The shaders with the names by which the script finds them.
const SHADERS: [(&str, &str); 4] = [
    ("surface.vert", include_str!("assets/shaders/surface.vert")),
    ("surface.frag", include_str!("assets/shaders/surface.frag")),
    ("line.vert", include_str!("assets/shaders/line.vert")),
    ("line.frag", include_str!("assets/shaders/line.frag")),
];

/// Writes a template; `place` writes what belongs where a name stands. What it writes is not looked at again.
pub(super) fn fill(
    out: &mut dyn Write,
    template: &str,
    mut place: impl FnMut(&mut dyn Write, &str) -> io::Result<()>,
) -> io::Result<()> {
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.write_all(before.as_bytes())?;
        let (name, behind) = after.split_once("}}").unwrap_or((after, ""));
        place(out, name)?;
        rest = behind;
    }
    out.write_all(rest.as_bytes())
}

/// Writes the script, and the shaders when there is a 3D view.
pub(super) fn write_scripts(out: &mut dyn Write, with_view: bool) -> io::Result<()> {
    if with_view {
        for (name, source) in SHADERS {
            writeln!(out, "<script type=\"text/plain\" id=\"{name}\">{source}</script>")?;
        }
    }
    let files = if with_view { &SCRIPTS[..] } else { &SCRIPTS[..1] };
    out.write_all(b"<script>\n'use strict';\n(() => {\n")?;
    files.iter().try_for_each(|file| out.write_all(file.as_bytes()))?;
    out.write_all(b"})();\n</script>\n")
}

#[cfg(test)]
mod tests {
    use super::{SCRIPTS, SHADERS, fill};

    #[test]
    fn places_are_filled_once_and_what_fills_them_is_left_alone() {
        let mut out = Vec::new();
        fill(&mut out, "a{{x}}b{{y}}", |out, name| write!(out, "[{name} {{{{x}}}}]")).unwrap();
        assert_eq!(out, b"a[x {{x}}]b[y {{x}}]");
    }

    #[test]
    fn no_file_of_ours_ends_the_script_it_stands_in_or_fetches_anything() {
        for text in SCRIPTS.iter().chain(SHADERS.iter().map(|(_, source)| source)) {
            assert!(!text.contains("</script") && !text.contains("<!--"), "{text}");
            for word in ["http:", "https:", "fetch(", "XMLHttpRequest", "import("] {
                assert!(!text.contains(word), "{word} in {text}");
            }
        }
    }
}
