//! When a point shows nothing new: the parameters.

use serde::Serialize;

/// When a point shows nothing new.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RevisitParams {
    /// A drive of which a smaller share of the points shows nothing new is taken whole: one pass and a bit of
    /// a second one cost little, and each point counts for its borders. Larger: more memory and time before
    /// anything is fused.
    pub min_share: f64,
    /// A scan taken nearer to the last one that was kept than this shows nothing new, meters. Larger:
    /// borders are less exact. Smaller: a fast laser on a slow robot costs more than one that sees as much.
    pub min_step_m: f64,
    /// A turn counts as so many meters a radian for `min_step_m`: how far away surfaces usually are.
    pub turn_m: f64,
    /// Smallest cells in which points are counted, meters; where points are farther apart, cells are two,
    /// four or eight times as large. Larger: less is kept, borders that are seen better later are missed.
    /// Smaller: more passes are kept.
    pub cell_m: f64,
    /// A cell is at least so many times as large as its points are apart. Larger: less is kept, coarser
    /// decisions. Smaller: cells stay empty by chance, and passes are kept without need.
    pub spacings: f64,
    /// Points of earlier passes in a cell, and in those before and behind it along the beam, from which on a
    /// point shows nothing new. Larger: more passes are kept. Smaller: holes where one pass saw little.
    pub min_points: u32,
    /// New points in a neighborhood that was known (four cells wide) from which on they are something new,
    /// and not mixed pixels. Larger: narrow strips that only later passes saw are missed. Smaller: edges are
    /// kept anew with each pass.
    pub min_together: u32,
    /// What is seen within so many seconds is one pass. Larger: a robot that turns on the spot keeps more.
    /// Smaller: one slow pass counts as several, and its later part is not kept.
    pub pass_s: f64,
    /// Points that show nothing new are kept all the same when something new is seen next to them within so
    /// many seconds, so that triangles reach over the border. Larger: more memory. Smaller: slits behind a
    /// slow robot.
    pub margin_s: f64,
}

impl Default for RevisitParams {
    fn default() -> Self {
        Self {
            min_share: 0.5,
            min_step_m: 0.01,
            turn_m: 3.0,
            cell_m: 0.05,
            spacings: 1.5,
            min_points: 2,
            min_together: 24,
            pass_s: 10.0,
            margin_s: 1.5,
        }
    }
}
