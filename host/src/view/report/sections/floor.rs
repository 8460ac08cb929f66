//! The floor map with the robot's way over it: a picture of the cells, and lines in SVG that stay sharp
//! however far one zooms.

use std::fmt::Write;
use std::io;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::recordings::deskew::StampedPose;
use crate::view::floor_map::map_files::write_cells_png;
use crate::view::floor_map::map_image::MapImage;

/// The way has no corners nearer to each other than this, meters: a cell's size.
const CORNER_M: f64 = 0.05;

/// The section. The picture's unit is a cell; y points down.
///
/// # Errors
/// When the picture cannot be encoded.
pub(crate) fn section(map: &MapImage<'_>, poses: &[StampedPose]) -> io::Result<String> {
    let map = &map.without_spokes(poses);
    let mut png = Vec::new();
    write_cells_png(&mut png, map)?;
    let [columns, rows] = map.size();
    let place = |pose: &StampedPose| {
        let [x_m, y_m] = map.origin_m();
        [(pose.x_m - x_m) / map.resolution_m(), f64::from(rows) - (pose.y_m - y_m) / map.resolution_m()]
    };
    let dot = |pose: Option<&StampedPose>, class: &str| {
        pose.map(place).map_or_else(String::new, |[x, y]| {
            format!("<path class=\"{class}\" d=\"M{x:.1} {y:.1}h0\" vector-effect=\"non-scaling-stroke\"/>")
        })
    };
    let [x_m, y_m] = map.origin_m();
    let mut html = format!(
        "<section id=\"floor\"><h2>Floor map and the robot’s way</h2><figure><svg id=\"map\" viewBox=\"0 0 {columns} {rows}\" \
         data-origin-x=\"{x_m}\" data-origin-y=\"{y_m}\" data-cell=\"{}\" tabindex=\"0\" role=\"img\" \
         aria-label=\"Floor map with the robot’s way. Plus and minus zoom, arrows move, 0 shows all.\">\
         <image href=\"data:image/png;base64,{}\" width=\"{columns}\" height=\"{rows}\"/>\
         <path class=\"way\" vector-effect=\"non-scaling-stroke\" d=\"{}\"/>{}{}<g id=\"here\"></g></svg>",
        map.resolution_m(),
        STANDARD.encode(&png),
        way(poses, &place),
        dot(poses.first(), "start"),
        dot(poses.last(), "end"),
    );
    let _ = write!(
        html,
        "<figcaption><span>{:.1} × {:.1} m, cells of {:.0} cm</span><span><i class=\"start\"></i>start <i class=\"end\"></i>end</span>\
         <span class=\"tools\"><button type=\"button\" id=\"map-in\" aria-label=\"Zoom in\">+</button><button type=\"button\" id=\"map-out\" \
         aria-label=\"Zoom out\">−</button><button type=\"button\" id=\"map-all\">All</button></span></figcaption></figure>\
         <p class=\"note\" id=\"map-note\">Wheel or two fingers zoom, drag moves.</p></section>",
        f64::from(columns) * map.resolution_m(),
        f64::from(rows) * map.resolution_m(),
        100.0 * map.resolution_m(),
    );
    Ok(html)
}

/// The way as a path.
fn way(poses: &[StampedPose], place: &dyn Fn(&StampedPose) -> [f64; 2]) -> String {
    let mut path = String::new();
    let mut last: Option<&StampedPose> = None;
    for pose in poses {
        let letter = match last.map(|last| last.step_m(pose)) {
            Some(step_m) if step_m < CORNER_M => continue,
            Some(step_m) if step_m <= StampedPose::LONGEST_STEP_M => 'L',
            _ => 'M',
        };
        let [x, y] = place(pose);
        let _ = write!(path, "{letter}{x:.1} {y:.1}");
        last = Some(pose);
    }
    path
}
