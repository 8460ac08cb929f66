//! Mounts of robots whose bags hold none.
//!
//! Cartographer's backpack (Deutsches Museum, 2D): topics and frames of its documentation, mounts of its
//! `backpack_2d.urdf` (xyz in m, rpy in rad). Not tried on the bags themselves.

use biplane_recording::rig::Mount;

/// What a note says of it.
pub(crate) const CARTOGRAPHER: &str = "topics of Cartographer's 2D backpack and no transforms: mounts as in its backpack_2d.urdf \
     (by its documentation; not tried on those bags themselves). base_link is at the chest: the floor is below z = 0";

/// Topics without a leading slash, their frames and mounts.
const LASERS: [(&str, &str, Mount); 2] = [
    (
        "horizontal_laser_2d",
        "horizontal_laser_link",
        Mount { x: 0.1007, y: 0.0, z: 0.0558, roll: 0.0, pitch: 0.0, yaw: 0.0 },
    ),
    (
        "vertical_laser_2d",
        "vertical_laser_link",
        Mount { x: 0.1007, y: 0.0, z: 0.1814, roll: 0.0, pitch: -90.0, yaw: 180.0 },
    ),
];

/// The mount of a laser of Cartographer's backpack.
pub(crate) fn cartographer_mount(topic: &str, frame: &str) -> Option<Mount> {
    LASERS.iter().find(|(name, link, _)| *name == topic && *link == frame).map(|(.., mount)| *mount)
}
