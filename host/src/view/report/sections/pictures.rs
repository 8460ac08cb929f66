//! Pictures by the software renderer, where the 3D view cannot be: without WebGL2, without scripts, on paper.

use crate::view::report::drawn::{Drawn, Picture};
use std::io;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::model::palette;
use crate::view::render::camera::Camera;
use crate::view::render::scene::Scene;
use crate::view::render::sheet::{Scope, SheetSize, Subject, compose, grouped_count, noisy_scene};
use crate::view::render::vector::Vec3;
use crate::view::render::views::{Extent, View, camera};
use crate::view::report::data::contents;
use crate::view::report::sources::Sources;

/// Width of a picture, pixels.
const WIDTH: usize = 1200;

/// Draws raw mesh, simplification and model from outside and, when the robot was inside, from there.
pub(crate) fn draw(sources: &Sources<'_>) -> io::Result<Drawn> {
    let raw_subject = subject("raw mesh", sources.raw.triangles.len(), noisy_scene(sources.drawn));
    let simple = sources.simple.map(|mesh| subject("QSlim-like", mesh.triangles.len(), noisy_scene(mesh)));
    let model = model_subject(sources);
    let subjects: Vec<&Subject> =
        [Some(&raw_subject), simple.as_ref(), Some(&model)].into_iter().flatten().collect();
    let mut drawn =
        Drawn { pictures: Vec::new(), bounds_m: [[0.0; 3]; 2], inside: [[0.0; 3], [1.0, 0.0, 0.0]] };
    for (view, words) in [(View::Outside, "from outside"), (View::Inside, "from inside")] {
        let Some(extent) = Extent::of(view, &raw_subject.scene) else { continue };
        let extent = extent.with_surfaces(view, &model.scene);
        if view == View::Outside {
            drawn.bounds_m = bounds_m(&extent, sources);
        }
        if view == View::Inside && sources.poses.is_empty() {
            continue;
        }
        let see = |shape: f64| camera(view, &model.scene, &extent, shape, sources.poses);
        if view == View::Inside {
            let camera: Camera = see(0.6);
            drawn.inside = [camera.eye_m, camera.forward()];
        }
        let picture = compose(
            &subjects,
            SheetSize { width: WIDTH, scene_height: None },
            Scope { view, extent: &extent },
            see,
        );
        let mut png = Vec::new();
        picture.write_png(&mut png)?;
        let names: Vec<&str> = subjects.iter().map(|subject| subject.caption.as_str()).collect();
        drawn.pictures.push(Picture {
            base64: STANDARD.encode(&png),
            size: [picture.width, picture.height],
            words: format!("{} {words}", names.join(", ")),
        });
    }
    Ok(drawn)
}

/// Bounds of most of the raw mesh, of all flat surfaces and of the trajectory, not of what one camera sees.
fn bounds_m(extent: &Extent, sources: &Sources<'_>) -> [Vec3; 2] {
    let [mut low_m, mut high_m] = extent.bounds_m();
    let floor_m = low_m[2];
    let corners = sources.shapes.faces.iter().flat_map(|face| &face.vertices_m);
    let path = sources.poses.iter().map(|pose| [pose.x_m, pose.y_m, floor_m]);
    for place_m in corners.map(|corner| corner.map(f64::from)).chain(path) {
        for axis in 0..3 {
            low_m[axis] = low_m[axis].min(place_m[axis]);
            high_m[axis] = high_m[axis].max(place_m[axis]);
        }
    }
    [low_m, high_m]
}

fn subject(name: &str, triangles: usize, scene: Scene) -> Subject {
    Subject { caption: format!("{name}: {}", grouped_count(triangles, "triangle")), scene }
}

fn model_subject(sources: &Sources<'_>) -> Subject {
    let model = sources.shapes.model;
    let mut scene = Scene::default();
    for (polygon, face) in model.polygons.iter().zip(&sources.shapes.faces) {
        let color = contents::color(model, polygon.plane);
        scene.add_mesh(face, |_| color);
        scene.add_borders(face, |_| Some(0));
    }
    sources.shapes.rounds.iter().for_each(|mesh| scene.add_mesh(mesh, |_| palette::ROUND));
    scene.add_mesh(&model.leftovers, |_| palette::LEFTOVERS);
    let caption = format!(
        "model: {} + {}",
        grouped_count(model.polygons.len(), "polygon"),
        grouped_count(model.leftovers.triangles.len(), "triangle")
    );
    Subject { caption, scene }
}
