//! MCAP for viewers such as Foxglove and RViz: the model as markers on `/model`, with the points, the floor
//! map and the way that was driven, where these are known. Frame `map`, meters.

use std::io::{self, Write};

use biplane_recording::mcap::write::{Shown, write_shown};
use biplane_recording::messages::shown::{self, FloorMap, Marker, MarkerShape};
use biplane_recording::topics::FRAME_MAP;

use crate::formats::Shapes;
use crate::formats::input::shift::restored;
use crate::model::Mesh;
use crate::model::inferred::InferredKind;
use crate::model::palette::{self, Orientation, Rgb};
use crate::recordings::deskew::StampedPose;

/// What was driven is drawn so wide, meters.
const WAY_WIDTH_M: f64 = 0.03;
const WAY: Rgb = [220, 60, 60];

/// What is shown around a model.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surroundings {
    /// Points, meters; thinned, where there are very many.
    pub points_m: Vec<[f32; 3]>,
    /// The map of the floor.
    pub floor_map: Option<FloorMap>,
    /// The poses of the base, in the order of time.
    pub poses: Vec<StampedPose>,
}

/// Writes the file. All of it is at the time of the first pose, or at 0.
///
/// # Errors
/// When writing fails.
pub(crate) fn write(out: &mut impl Write, shapes: &Shapes<'_>, around: &Surroundings) -> io::Result<()> {
    let time_ns = around.poses.first().map_or(0, |pose| pose.stamp_ns);
    let mut markers = surfaces(shapes);
    markers.extend(ways(&around.poses));
    let markers = shown::markers(time_ns, FRAME_MAP, &markers);
    let points = shown::points(time_ns, FRAME_MAP, &around.points_m);
    let floor_map = around.floor_map.as_ref().map(|map| shown::floor_map(time_ns, FRAME_MAP, map));
    let model = Shown { topic: "/model", type_name: "visualization_msgs/msg/MarkerArray", bytes: &markers };
    let points = Shown { topic: "/points", type_name: "sensor_msgs/msg/PointCloud2", bytes: &points };
    let mut messages = vec![model];
    messages.extend((!around.points_m.is_empty()).then_some(points));
    messages.extend(floor_map.as_deref().map(|bytes| Shown {
        topic: "/map",
        type_name: "nav_msgs/msg/OccupancyGrid",
        bytes,
    }));
    write_shown(out, time_ns, &messages)
}

/// A marker for each polygon and each round thing, and one for the leftovers; groups are what they are.
fn surfaces(shapes: &Shapes<'_>) -> Vec<Marker> {
    let mut markers = Vec::new();
    let mut add = |group: &str, mesh: &Mesh, color: Rgb| {
        if !mesh.triangles.is_empty() {
            let id = i32::try_from(markers.len()).unwrap_or(i32::MAX);
            let points_m = corners(mesh, shapes.shift_m);
            markers.push(marker(group, id, color, MarkerShape::Triangles, points_m));
        }
    };
    for (polygon, mesh) in shapes.model.polygons.iter().zip(&shapes.faces) {
        if let Some(plane) = shapes.model.planes.get(polygon.plane) {
            let color = palette::plane_color(polygon.plane, plane);
            add(Orientation::of(plane).name(), mesh, color);
        }
    }
    for (round, mesh) in shapes.model.cylinders.iter().zip(&shapes.rounds) {
        add(round.kind.name(), mesh, palette::ROUND);
    }
    for (surface, mesh) in shapes.model.inferred.iter().zip(&shapes.inferred) {
        let group = match surface.kind {
            InferredKind::Floor => "inferred floor",
            InferredKind::WallBase | InferredKind::OpeningSurround => "inferred wall",
        };
        add(group, mesh, palette::inferred_color(surface.kind));
    }
    add("leftovers", &shapes.model.leftovers, palette::LEFTOVERS);
    markers
}

/// The way, in pieces: where nobody drove from one pose to the next, a new one begins.
fn ways(poses: &[StampedPose]) -> Vec<Marker> {
    let drives = poses.chunk_by(|a, b| a.step_m(b) <= StampedPose::LONGEST_STEP_M);
    (0..)
        .zip(drives)
        .map(|(id, drive)| {
            let points_m = drive.iter().map(|pose| [pose.x_m, pose.y_m, pose.z_m]).collect();
            marker("way", id, WAY, MarkerShape::Line { width_m: WAY_WIDTH_M }, points_m)
        })
        .collect()
}

fn marker(group: &str, id: i32, color: Rgb, shape: MarkerShape, points_m: Vec<[f64; 3]>) -> Marker {
    let [red, green, blue] = color.map(|channel| f32::from(channel) / 255.0);
    Marker { group: group.to_owned(), id, shape, color: [red, green, blue, 1.0], points_m }
}

fn corners(mesh: &Mesh, shift_m: [f64; 3]) -> Vec<[f64; 3]> {
    let corners = mesh.triangles.iter().flatten();
    let vertices = corners.filter_map(|&index| mesh.vertices_m.get(index as usize));
    vertices.map(|vertex_m| restored(vertex_m.map(f64::from), shift_m)).collect()
}

#[cfg(test)]
mod tests {
    use super::{Surroundings, surfaces, write};
    use crate::formats::Shapes;
    use crate::model::cylinder::CylinderKind;
    use crate::model::palette::Orientation;
    use crate::model::{Model, sample};
    use crate::recordings::deskew::StampedPose;

    #[test]
    fn every_triangle_of_the_model_is_in_a_marker() {
        let model = Model { inferred: vec![sample::inferred()], ..sample::model() };
        let shapes = Shapes { faces: sample::faces(&model), ..Shapes::new(&model) };
        let markers = surfaces(&shapes);
        let corners: usize = markers.iter().map(|marker| marker.points_m.len()).sum();
        assert_eq!(corners, 3 * shapes.triangles());
        let groups: Vec<&str> = markers.iter().map(|marker| marker.group.as_str()).collect();
        assert_eq!(groups, ["wall", "floor", "inferred wall", "leftovers"]);
    }

    #[test]
    fn the_layout_for_viewers_names_each_topic_and_each_group() {
        let layout: serde_json::Value =
            serde_json::from_str(include_str!("../../../docs/model-layout.json")).unwrap();
        let topics = layout["configById"]["3D!model"]["topics"].as_object().unwrap();
        assert_eq!(topics.keys().collect::<Vec<_>>(), ["/map", "/model", "/points"]);
        let groups = topics["/model"]["namespaces"].as_object().unwrap();
        let of_planes = [Orientation::Floor, Orientation::Ceiling, Orientation::Wall].map(Orientation::name);
        let kinds = [CylinderKind::Column, CylinderKind::Pipe, CylinderKind::Pole, CylinderKind::Wall];
        let mut known: Vec<&str> = of_planes.into_iter().chain(kinds.map(CylinderKind::name)).collect();
        known.extend(["inferred floor", "inferred wall", "leftovers", "way"]);
        known.sort_unstable();
        known.dedup();
        assert_eq!(groups.keys().collect::<Vec<_>>(), known);
    }

    #[test]
    fn a_file_holds_what_is_known_and_nothing_else() {
        let model = sample::model();
        let shapes = Shapes { faces: sample::faces(&model), ..Shapes::new(&model) };
        let topics = |around: &Surroundings| {
            let mut bytes = Vec::new();
            write(&mut bytes, &shapes, around).unwrap();
            assert!(bytes.starts_with(b"\x89MCAP0\r\n") && bytes.ends_with(b"\x89MCAP0\r\n"));
            ["/model", "/points", "/map"]
                .map(|topic| bytes.windows(topic.len()).any(|part| part == topic.as_bytes()))
        };
        assert_eq!(topics(&Surroundings::default()), [true, false, false]);
        let poses = vec![StampedPose { stamp_ns: 5, ..StampedPose::default() }];
        let around = Surroundings { points_m: vec![[1.0, 2.0, 3.0]], poses, ..Surroundings::default() };
        assert_eq!(topics(&around), [true, true, false]);
    }
}
