//! Distances to the truth, put into a page that is there already: `compare` measures them after `build` wrote
//! the page.

use std::fmt::Write;

use crate::view::markup::escaped;
use crate::view::report::text::grouped;

/// Where they go. No text of a recording can look like it: a page holds no `<` of theirs.
pub(crate) const PLACE: &str = "<!--biplane:comparison-->";

/// One surface that was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    /// Which.
    pub name: &'static str,
    /// Polygons and triangles.
    pub surfaces: usize,
    /// RMS distance from the surface to the reference, meters.
    pub rms_m: f64,
    /// Mean distance from what was seen of the reference to the surface, meters.
    pub missed_m: f64,
    /// Rays of the laser that it blocks wrongly, percent.
    pub blocked_percent: Option<f64>,
}

/// A page with these figures in it; `None` when it has no place for them.
pub(crate) fn with_comparison(page: &str, reference: &str, rows: &[Row]) -> Option<String> {
    let (before, after) = page.split_once(PLACE)?;
    let mut body = String::new();
    for row in rows {
        let blocked = row.blocked_percent.map_or_else(|| "–".to_owned(), |percent| format!("{percent:.2} %"));
        let _ = write!(
            body,
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{:.2}</td><td>{:.2}</td><td>{blocked}</td></tr>",
            row.name,
            grouped(row.surfaces),
            100.0 * row.rms_m,
            100.0 * row.missed_m
        );
    }
    Some(format!(
        "{before}<section><h2>How true it is</h2><div class=\"scroll\"><table class=\"figures\"><thead><tr><td></td><th scope=\"col\">surfaces</th>\
         <th scope=\"col\">RMS, cm</th><th scope=\"col\">missed, cm</th><th scope=\"col\">rays blocked</th></tr></thead><tbody>{body}</tbody>\
         </table></div><p class=\"note\">Distances to {}. RMS: from the surface to it. Missed: mean distance from what was seen of it to the \
         surface. Blocked: rays of the laser that the surface stops before what they really hit, as a closed door would.</p></section>{PLACE}{after}",
        escaped(reference)
    ))
}

#[cfg(test)]
mod tests {
    use super::{PLACE, Row, with_comparison};

    #[test]
    fn figures_go_to_their_place_and_a_page_without_one_is_left_alone() {
        let row =
            Row { name: "model", surfaces: 12_345, rms_m: 0.0123, missed_m: 0.02, blocked_percent: None };
        let page = with_comparison(&format!("a{PLACE}b"), "<truth>.ply", &[row]).unwrap();
        assert!(page.starts_with("a<section>") && page.ends_with("b"));
        for words in ["12,345", "<td>1.23</td>", "&lt;truth&gt;.ply"] {
            assert!(page.contains(words), "{words}: {page}");
        }
        assert_eq!(with_comparison("nothing", "x", &[row]), None);
    }
}
