//! Storeys: heights at which there is a floor, with walls over it.

use super::section::cut;
use crate::building::part::CUT_M;
use crate::building::part::LEVEL;
use crate::building::part::is_upright;
use crate::model::Model;
use biplane_geometry::PortableMath;
use biplane_geometry::polygon_area::ring_area_m2;

/// Level surfaces this close in height are one floor, meters.
const BAND_M: f64 = 0.25;
/// Storeys are at least this far apart, meters: lower ones are tables, landings, galleries one cannot stand
/// under.
const APART_M: f64 = 2.0;
/// Smaller floors make no storey, square meters.
const MIN_M2: f64 = 2.0;
/// A floor is at least this share of the largest level of the model, ceilings included: a large table is
/// none.
const MIN_SHARE: f64 = 0.2;
/// With less length of wall at the height of the cut a level surface is a roof or a ceiling, meters.
const MIN_WALLS_M: f64 = 2.0;

/// Heights of the floors of a model, meters, from below.
pub(crate) fn find(model: &Model, known_m: &[f64]) -> Vec<f64> {
    let mut levels = level_surfaces(model, 1.0);
    let max_m2 = [1.0, -1.0].iter().filter_map(|up| largest(&level_surfaces(model, *up))).map(|(_, m2)| m2);
    let min_m2 = max_m2.fold(MIN_M2 / MIN_SHARE, f64::max) * MIN_SHARE;
    if levels.is_empty() && known_m.is_empty() {
        // A mesh may have its faces the wrong way round.
        levels = level_surfaces(model, -1.0);
    }
    let mut floors_m: Vec<f64> = known_m.to_vec();
    levels.retain(|(z, _)| is_free(&floors_m, *z));
    while let Some((z_m, area_m2)) = largest(&levels) {
        if area_m2 < min_m2 {
            break;
        }
        if walls_m(model, z_m + CUT_M) >= MIN_WALLS_M {
            floors_m.push(z_m);
            levels.retain(|(z, _)| is_free(&floors_m, *z));
        } else {
            levels.retain(|(z, _)| (z - z_m).abs() > BAND_M);
        }
    }
    floors_m.sort_by(f64::total_cmp);
    floors_m
}

fn is_free(floors_m: &[f64], z_m: f64) -> bool {
    floors_m.iter().all(|floor| (floor - z_m).abs() >= APART_M)
}

/// Mean height and area of each level polygon that faces up (1) or down (-1).
fn level_surfaces(model: &Model, up: f64) -> Vec<(f64, f64)> {
    let level = |index: usize| model.planes.get(index).is_some_and(|plane| up * plane.normal[2] >= LEVEL);
    let surfaces = model.polygons.iter().filter(|polygon| level(polygon.plane));
    surfaces
        .map(|polygon| {
            let heights = polygon.outer_m.iter().map(|p| p[2]);
            let mean_m = heights.sum::<f64>() / polygon.outer_m.len().max(1) as f64;
            let holes_m2: f64 = polygon.holes_m.iter().map(|hole| ring_area_m2(hole)).sum();
            (mean_m, ring_area_m2(&polygon.outer_m) - holes_m2)
        })
        .filter(|(z, area)| z.is_finite() && area.is_finite())
        .collect()
}

/// Mean height and area of the level with the most surface.
fn largest(levels: &[(f64, f64)]) -> Option<(f64, f64)> {
    let around = |seed_m: f64| {
        let near = levels.iter().filter(move |(z, _)| (z - seed_m).abs() <= BAND_M);
        let (weighted, area) = near.fold((0.0, 0.0), |(w, a), (z, area)| (w + z * area, a + area));
        (weighted / area, area)
    };
    levels.iter().map(|(z, _)| around(*z)).max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.total_cmp(&a.0)))
}

/// Length of the upright surfaces cut at a height, meters.
fn walls_m(model: &Model, z_m: f64) -> f64 {
    let upright = model.polygons.iter().filter(|p| model.planes.get(p.plane).is_some_and(is_upright));
    let lines = upright.flat_map(|polygon| cut(polygon, &model.planes[polygon.plane], z_m));
    lines.map(|[a, b]| (b[0] - a[0]).portable_hypot(b[1] - a[1])).sum()
}
