//! Several scenes in one picture, each with a caption, all seen with the same camera.

use super::camera::Camera;
use super::font;
use super::raster::{Picture, Style, draw};
use super::scene::Scene;
use super::views::{Extent, View, aspect};
use crate::model::Mesh;
use crate::model::palette;
use crate::model::palette::Rgb;

/// Pixels between two pictures.
const GAP: usize = 16;
const CAPTION: Rgb = [70, 74, 84];

/// A scene with what is said of it.
#[derive(Clone, Debug)]
pub(crate) struct Subject {
    /// What is drawn.
    pub scene: Scene,
    /// What stands above it.
    pub caption: String,
}

/// How large a sheet is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SheetSize {
    /// Width of the whole sheet, pixels.
    pub width: usize,
    /// Height of each scene, pixels; `None` for what the scene needs.
    pub scene_height: Option<usize>,
}

/// A mesh as it was measured, in the raw mesh's gray.
pub(crate) fn noisy_scene(mesh: &Mesh) -> Scene {
    let mut scene = Scene::default();
    scene.add_noisy_mesh(mesh, palette::RAW);
    scene
}

/// 159114 as 159,114.
pub(crate) fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A count with its noun, digits in groups of three: "1 polygon", "1,234 polygons".
pub(crate) fn grouped_count(number: usize, noun: &str) -> String {
    format!("{} {noun}{}", grouped(number), if number == 1 { "" } else { "s" })
}

/// What of a scene is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scope<'a> {
    /// From where.
    pub view: View,
    /// How far the scene reaches.
    pub extent: &'a Extent,
}

/// Draws each scene with the camera that `camera` gives for a shape (height over width); wide scenes one
/// above the other, others side by side.
pub(crate) fn compose(
    subjects: &[&Subject],
    size: SheetSize,
    scope: Scope<'_>,
    camera: impl Fn(f64) -> Camera,
) -> Picture {
    let Scope { view, extent } = scope;
    let (width, count) = (size.width, subjects.len());
    let shape = aspect(view, extent).clamp(0.2, 1.2) * 1.04;
    let beside = count > 1 && shape > 0.5;
    let scene_width = if beside { (width - (count - 1) * GAP) / count } else { width };
    let scene_height = size.scene_height.unwrap_or((scene_width as f64 * shape) as usize).max(1);
    let dot = (scene_width / 360).clamp(1, 3);
    let caption_height = (font::HEIGHT + 8) * dot;
    let cell_height = scene_height + caption_height;
    let height = if beside { cell_height } else { count * cell_height + count.saturating_sub(1) * GAP };
    let camera = camera(scene_height as f64 / scene_width as f64);
    let style = Style { cull_backs: view != View::Inside };
    let mut picture = Picture::blank(width, height);
    for (index, subject) in subjects.iter().enumerate() {
        let drawn = draw(&subject.scene, &camera, [scene_width, scene_height], style);
        let (left, top) =
            if beside { (index * (scene_width + GAP), 0) } else { (0, index * (cell_height + GAP)) };
        picture.put(&drawn, left, top + caption_height);
        font::write_text(&mut picture, &subject.caption, [left + 6 * dot, top + 4 * dot], dot, CAPTION);
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::{Scope, SheetSize, Subject, compose, grouped, grouped_count};
    use crate::model::palette;
    use crate::model::sample;
    use crate::view::render::scene::Scene;
    use crate::view::render::views::{Extent, View, camera};

    #[test]
    fn thousands_are_grouped() {
        assert_eq!(
            [0, 999, 1000, 163_336, 1_000_000].map(grouped),
            ["0", "999", "1,000", "163,336", "1,000,000"]
        );
        assert_eq!([1, 1000].map(|count| grouped_count(count, "hole")), ["1 hole", "1,000 holes"]);
    }

    #[test]
    fn the_same_scene_twice_gives_the_same_pixels_under_two_captions() {
        let mut scene = Scene::default();
        sample::faces(&sample::model()).iter().for_each(|face| scene.add_mesh(face, |_| palette::RAW));
        let extent = Extent::of(View::Top, &scene).unwrap();
        let subjects =
            ["one", "two"].map(|caption| Subject { scene: scene.clone(), caption: caption.to_owned() });
        let [one, two] = &subjects;
        let size = SheetSize { width: 416, scene_height: Some(100) };
        let sheet = compose(&[one, two], size, Scope { view: View::Top, extent: &extent }, |shape| {
            camera(View::Top, &scene, &extent, shape, &[])
        });
        // Too flat a shape to stand side by side would be twice as high.
        assert_eq!(sheet.width, 416);
        let row =
            |top: usize, y: usize, left: usize, wide: usize| &sheet.pixels[(top + y) * 416 + left..][..wide];
        let beside = sheet.height == 100 + 15;
        let (wide, second) = if beside { (200, (216, 15)) } else { (416, (0, 100 + 15 + 16 + 15)) };
        for y in 0..100 {
            assert_eq!(row(15, y, 0, wide), row(second.1, y, second.0, wide), "row {y}");
        }
        assert!(sheet.pixels.iter().any(|pixel| *pixel != [255; 3]));
    }
}
