//! The pictures of a page, and what its 3D view takes over of how they were taken.

use crate::view::render::vector::Vec3;

/// One picture.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// The PNG.
    pub base64: String,
    /// Width and height, pixels.
    pub size: [usize; 2],
    /// What it shows.
    pub words: String,
}

/// The pictures, and what the 3D view takes over of how they were taken.
#[derive(Clone, Debug)]
pub(crate) struct Drawn {
    /// From outside and from inside.
    pub pictures: Vec<Picture>,
    /// Least and greatest coordinates of most of the scene, meters.
    pub bounds_m: [Vec3; 2],
    /// From where one looks in the picture from inside, and in which direction.
    pub inside: [Vec3; 2],
}
