//! Frames of doors and windows, with a pane in a window. Their profiles are assumed: no laser measures them.

use super::solids;
use super::step::{Id, Step};

/// Frames are assumed to be so wide and so deep, meters.
const FRAME_M: [f64; 2] = [0.05, 0.08];
/// Panes are assumed to be so thick, meters.
const PANE_M: f64 = 0.01;

/// Solids of a frame in an opening of a width and a height: around the origin along x, from zero up along z.
pub(super) fn frame(step: &mut Step, [width, height]: [f64; 2], is_window: bool) -> Vec<Id> {
    let [thick, deep] = FRAME_M;
    let (side, inner) = ((width - thick) / 2.0, width - 2.0 * thick);
    let mut items = vec![
        solids::cuboid(step, [-side, 0.0], [thick, deep], [0.0, height]),
        solids::cuboid(step, [side, 0.0], [thick, deep], [0.0, height]),
        solids::cuboid(step, [0.0, 0.0], [inner, deep], [height - thick, height]),
    ];
    if is_window {
        items.push(solids::cuboid(step, [0.0, 0.0], [inner, deep], [0.0, thick]));
        items.push(solids::cuboid(step, [0.0, 0.0], [inner, PANE_M], [thick, height - thick]));
    }
    items
}

/// The color of a frame.
pub(super) fn color(is_window: bool) -> [u8; 3] {
    if is_window { [150, 180, 205] } else { [150, 120, 90] }
}
