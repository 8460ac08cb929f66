//! Pictures of models without a browser or a graphics card: a small software rasterizer.
//!
//! Frame `map`, meters, z up. The same scene gives the same picture on any machine.

pub(crate) mod camera;
pub(crate) mod font;
pub(crate) mod mask;
pub(crate) mod raster;
pub(crate) mod scene;
pub(crate) mod sheet;
pub(crate) mod vector;
pub(crate) mod views;

use std::io::{self, Write};

pub(crate) use raster::Picture;

impl Picture {
    /// A white picture.
    pub(crate) fn blank(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[255; 3]; width * height] }
    }

    /// Puts another picture with its top left corner at a place; what does not fit is cut off.
    pub(crate) fn put(&mut self, other: &Self, left: usize, top: usize) {
        let columns = other.width.min(self.width.saturating_sub(left));
        for row in 0..other.height.min(self.height.saturating_sub(top)) {
            let (to, from) = ((top + row) * self.width + left, row * other.width);
            self.pixels[to..to + columns].copy_from_slice(&other.pixels[from..from + columns]);
        }
    }

    /// Writes the picture as PNG.
    ///
    /// # Errors
    /// When writing fails.
    pub(crate) fn write_png(&self, out: &mut impl Write) -> io::Result<()> {
        let side = |value: usize| u32::try_from(value).map_err(io::Error::other);
        let mut encoder = png::Encoder::new(out, side(self.width)?, side(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(io::Error::from)?;
        writer.write_image_data(self.pixels.as_flattened()).map_err(io::Error::from)?;
        writer.finish().map_err(io::Error::from)
    }
}
