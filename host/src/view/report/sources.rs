//! What a page is made of.

use crate::formats::Shapes;
use crate::model::Mesh;
use crate::recordings::deskew::StampedPose;
use crate::view::floor_map::map_image::MapImage;

/// What a page is made of.
#[derive(Clone, Copy)]
pub(crate) struct Sources<'a> {
    /// What it is a report of: the recording's name.
    pub title: &'a str,
    /// The raw mesh.
    pub raw: &'a Mesh,
    /// The raw mesh as the pictures show it: as it is, or coarser.
    pub drawn: &'a Mesh,
    /// The raw mesh as others simplify it; `None` when there is no simplifier.
    pub simple: Option<&'a Mesh>,
    /// The model.
    pub shapes: &'a Shapes<'a>,
    /// The floor map, when there is one.
    pub floor: Option<Floor<'a>>,
    /// The poses of the horizontal scans.
    pub poses: &'a [StampedPose],
}

/// The floor that has a map: of several storeys the lowest.
#[derive(Clone, Copy)]
pub(crate) struct Floor<'a> {
    /// Its map.
    pub map: &'a MapImage<'a>,
    /// The poses of the scans that were taken on it.
    pub poses: &'a [StampedPose],
}
