//! The floor map with the robot's way over it: a picture of the cells, and lines in SVG that stay sharp
//! however far one zooms.

use std::fmt::Write;
use std::io;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::model::turn::Turn;
use crate::recordings::deskew::StampedPose;
use crate::view::floor_map::map_files::write_cells_png;
use crate::view::floor_map::map_image::{CellState, MapImage, state_of};
use crate::view::report::text::turned_words;

/// The way has no corners nearer to each other than this, meters: a cell's size.
const CORNER_M: f64 = 0.05;

/// Space around what was seen, cells.
const MARGIN_CELLS: f64 = 8.0;

/// The section. The picture's unit is a cell; y points down. Cells and way are turned, so that walls lie
/// along the page.
///
/// # Errors
/// When the picture cannot be encoded.
pub(crate) fn section(map: &MapImage<'_>, poses: &[StampedPose], turn: &Turn) -> io::Result<String> {
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
    let Sheet { low, size: [width, height] } = Sheet::around(map, poses.iter().map(place), turn);
    let mut html = format!(
        "<section id=\"floor\"><h2>Floor map and the robot’s way</h2><figure><svg id=\"map\" viewBox=\"0 0 {width} {height}\" \
         data-origin-x=\"{x_m}\" data-origin-y=\"{y_m}\" data-cell=\"{}\" data-rows=\"{rows}\" tabindex=\"0\" role=\"img\" \
         aria-label=\"Floor map with the robot’s way. Plus and minus zoom, arrows move, 0 shows all.\">\
         <g id=\"cells\" transform=\"translate({:.1} {:.1}) rotate({:.4})\">\
         <image href=\"data:image/png;base64,{}\" width=\"{columns}\" height=\"{rows}\"/>\
         <path class=\"way\" vector-effect=\"non-scaling-stroke\" d=\"{}\"/>{}{}<g id=\"here\"></g></g></svg>",
        map.resolution_m(),
        -low[0],
        -low[1],
        -turn.angle_rad.to_degrees(),
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
         <p class=\"note\"><span id=\"map-note\">A click puts the 3D view there. Drag moves; two fingers zoom, and so does the wheel after a click.</span>{}</p></section>",
        width * map.resolution_m(),
        height * map.resolution_m(),
        100.0 * map.resolution_m(),
        turned_words(turn).unwrap_or_default(),
    );
    Ok(html)
}

/// What a drawing shows of turned cells: as much as holds all that was seen. Its unit is a cell, and the
/// upper left corner of the picture of cells is zero.
struct Sheet {
    low: [f64; 2],
    size: [f64; 2],
}

impl Sheet {
    fn around(map: &MapImage<'_>, way: impl Iterator<Item = [f64; 2]>, turn: &Turn) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for [x, y] in seen_places(map).into_iter().chain(way) {
            // The page's y points down.
            let [x, y, _] = turn.apply([x, -y, 0.0]);
            for (axis, value) in [x, -y].into_iter().enumerate() {
                low[axis] = low[axis].min(value - MARGIN_CELLS);
                high[axis] = high[axis].max(value + MARGIN_CELLS);
            }
        }
        // Whole cells: a browser reads a view box in single precision.
        Self { low, size: [0, 1].map(|axis| (high[axis] - low[axis]).ceil()) }
    }
}

/// The corners of the first and of the last cell of each row that were seen; two of the picture's corners
/// where none was.
fn seen_places(map: &MapImage<'_>) -> Vec<[f64; 2]> {
    let mut places = Vec::new();
    let mut row_cells = Vec::new();
    for row in 0..map.size()[1] {
        map.fill_row(row, &mut row_cells);
        let is_seen = |cell: &Option<f64>| state_of(*cell) != CellState::Unknown;
        let (first, last) = (row_cells.iter().position(is_seen), row_cells.iter().rposition(is_seen));
        for column in first.into_iter().chain(last.map(|last| last + 1)) {
            places.extend([0.0, 1.0].map(|below| [column as f64, f64::from(row) + below]));
        }
    }
    if places.is_empty() {
        return vec![[0.0; 2], map.size().map(f64::from)];
    }
    places
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slam::occupancy::{OccupancyGrid, OccupancyParams, Ray};

    #[test]
    fn a_corridor_that_lies_askew_lies_along_the_page_with_the_way_in_it() {
        let mut grid = OccupancyGrid::new(OccupancyParams::default());
        let angle_rad = 0.5_f64;
        let at = |along_m: f64, aside_m: f64| {
            let (sin, cos) = angle_rad.sin_cos();
            [along_m * cos - aside_m * sin, along_m * sin + aside_m * cos]
        };
        let rays: Vec<Ray> = (0..50)
            .map(|row| 0.02 * f64::from(row))
            .map(|aside_m| Ray { from_m: at(0.0, aside_m), to_m: at(20.0, aside_m) })
            .collect();
        (0..5).for_each(|_| grid.add_scan(&rays));
        let [x_m, y_m] = at(-4.0, 0.5);
        let poses = [StampedPose { x_m, y_m, ..StampedPose::default() }];
        let (map, _) = MapImage::new(&grid, &poses).unwrap();
        let view_box = |turn: &Turn| -> [f64; 2] {
            let html = section(&map, &poses, turn).unwrap();
            let words = html.split("viewBox=\"").nth(1).unwrap().split('"').next().unwrap();
            let numbers: Vec<f64> = words.split(' ').map(|number| number.parse().unwrap()).collect();
            [numbers[2], numbers[3]].map(|cells| cells * map.resolution_m() - 0.8)
        };
        // 24 m long with the way before it, 1 m wide, and what cells stand over.
        let [width_m, height_m] = view_box(&Turn { angle_rad: -angle_rad });
        assert!((24.0..24.3).contains(&width_m) && (1.0..1.3).contains(&height_m), "{width_m} {height_m}");
        let [width_m, height_m] = view_box(&Turn::default());
        assert!((21.3..21.7).contains(&width_m) && (11.8..12.2).contains(&height_m), "{width_m} {height_m}");
    }
}
