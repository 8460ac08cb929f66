//! Coarser copies of a model, for views from afar: programs load the finest one that they need.
//!
//! One file a level and no glTF extension: `MSFT_lod`, the only one for this, is read by few programs, and
//! the others would load and draw all levels at once. Each level moves borders by no more than a stated
//! length, so a viewer can tell from what distance a level is enough. Meters.

use crate::model::Model;
use crate::reconstruct::decimate::{self, Reach};

/// How coarse a level is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Level {
    /// Borders may move so far at least, meters; things of that size go.
    pub from_m: f64,
    /// And so far at most.
    pub to_m: f64,
    /// Between these a level gets coarser until it has no more than this share of the model's triangles.
    pub share: f64,
}

/// From fine to coarse. On a screen of 1000 lines that shows 60 degrees, 5 cm are a line from 50 m on, 20 cm
/// from 200 m on.
pub(crate) const LEVELS: [Level; 2] =
    [Level { from_m: 0.05, to_m: 0.2, share: 0.25 }, Level { from_m: 0.2, to_m: 1.0, share: 0.0625 }];

/// A level of a model, and how far borders moved at most, meters. No flat surface larger than that goes, so
/// the share may not be reached.
pub(crate) fn coarse(model: &Model, level: &Level, triangles: usize) -> (Model, f64) {
    let reach = Reach { from_m: level.from_m, to_m: level.to_m };
    decimate::coarsened(model, reach, (triangles as f64 * level.share) as usize)
}

#[cfg(test)]
mod tests {
    use super::{LEVELS, coarse};
    use crate::formats::Shapes;
    use crate::model::sample;
    use crate::model::{Mesh, Model};

    /// A bumpy sheet of 6 m by 6 m with an edge of 10 cm, bumps of 1 cm.
    fn sheet() -> Mesh {
        let at = |k: u32| [k % 61, k / 61];
        let vertices_m = (0..61 * 61)
            .map(|k| {
                let [x, y] = at(k);
                [x as f32 * 0.1, y as f32 * 0.1, 1.0 + 0.01 * ((x * 7 + y * 13) % 3) as f32]
            })
            .collect();
        let cells = (0..60).flat_map(|y| (0..60).map(move |x| y * 61 + x));
        let triangles = cells.flat_map(|k| [[k, k + 1, k + 62], [k, k + 62, k + 61]]).collect();
        Mesh { vertices_m, triangles }
    }

    #[test]
    fn each_level_has_fewer_triangles_and_all_large_surfaces() {
        let model = Model { leftovers: sheet(), ..sample::model() };
        let all = Shapes::new(&model).triangles();
        let mut before = all;
        for level in &LEVELS {
            let (coarse, moved_m) = coarse(&model, level, all);
            let triangles = Shapes::new(&coarse).triangles();
            assert!((level.from_m..=level.to_m).contains(&moved_m), "{moved_m}");
            assert_eq!(coarse.polygons.len(), 2);
            assert!(!coarse.leftovers.triangles.is_empty(), "a sheet of 36 square meters is large");
            assert!(
                triangles < before && triangles as f64 <= level.share * all as f64,
                "{triangles} of {all}"
            );
            before = triangles;
        }
    }
}
