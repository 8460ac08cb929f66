//! Transforms between frames that stay as they are, and the way from one frame to another along them.

use biplane_geometry::PortableMath;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use biplane_recording::messages::TransformStamped;
use nalgebra::{Isometry3, Vector3};

use crate::recordings::mounts::isometry;

/// A transform on `/tf` that moves by less than this, in m and in parts of a quaternion, stands still.
const STILL: f64 = 1e-6;
/// More frames than any robot has; those beyond are refused.
const MAX_FRAMES: usize = 10_000;
/// What a bag says of one frame: its parent and where it sits in it.
#[derive(Clone, Debug, PartialEq)]
struct Edge {
    parent: String,
    parent_from_child: Isometry3<f64>,
    /// From a topic of static transforms.
    is_static: bool,
    /// It was seen elsewhere too.
    moves: bool,
}

/// The frames of a bag.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frames {
    edges: BTreeMap<String, Edge>,
    /// Transforms that are none: not finite, or a quaternion of zeros.
    pub refused: usize,
}

/// A frame's name as it is compared: older bags write `/laser` here and `laser` there.
pub(crate) fn bare(frame: &str) -> &str {
    frame.strip_prefix('/').unwrap_or(frame)
}

impl Frames {
    /// Takes a transform of `/tf_static` or `/tf`.
    pub(crate) fn take(&mut self, transform: &TransformStamped, is_static: bool) {
        let Some(found) = isometry(transform.translation_m, transform.rotation_xyzw) else {
            self.refused += 1;
            return;
        };
        let (parent, child) = (bare(&transform.frame_id), bare(&transform.child_frame_id));
        if parent == child || child.is_empty() {
            self.refused += 1;
            return;
        }
        let edge = Edge { parent: parent.to_owned(), parent_from_child: found, is_static, moves: false };
        let is_full = self.edges.len() >= MAX_FRAMES;
        match self.edges.get_mut(child) {
            // Said once and for all, it is not taken back by what is said again and again.
            Some(known) if known.is_static && !is_static => {}
            Some(known) if known.is_static == is_static => {
                known.moves |=
                    !is_static && (known.parent != parent || !is_same(&known.parent_from_child, &found));
                if is_static {
                    *known = edge;
                }
            }
            None if is_full => self.refused += 1,
            _ => {
                self.edges.insert(child.to_owned(), edge);
            }
        }
    }

    /// Whether the frame is named anywhere.
    pub(crate) fn knows(&self, frame: &str) -> bool {
        self.edges.contains_key(frame) || self.edges.values().any(|edge| edge.parent == frame)
    }

    /// Frames that carry a base on `/tf`: children of frames named `odom`, `odom_combined` ...
    pub(crate) fn driven(&self) -> Vec<(&str, &str)> {
        let is_odom = |edge: &Edge| {
            !edge.is_static && edge.parent.rsplit('/').next().is_some_and(|name| name.starts_with("odom"))
        };
        let edges = self.edges.iter().filter(|(_, edge)| is_odom(edge));
        edges.map(|(child, edge)| (edge.parent.as_str(), child.as_str())).collect()
    }

    /// `from_to`: takes points of frame `to` into frame `from`, along transforms that stay as they are.
    pub(crate) fn between(&self, from: &str, to: &str) -> Option<Isometry3<f64>> {
        let mut seen = BTreeSet::from([from.to_owned()]);
        let mut open = VecDeque::from([(from.to_owned(), Isometry3::identity())]);
        while let Some((frame, from_frame)) = open.pop_front() {
            if frame == to {
                return Some(from_frame);
            }
            let driven = self.driven();
            let stays =
                |child: &str, edge: &Edge| !edge.moves && !driven.contains(&(edge.parent.as_str(), child));
            for (child, edge) in self.edges.iter().filter(|(child, edge)| stays(child, edge)) {
                let step = if edge.parent == frame {
                    Some((child, edge.parent_from_child))
                } else if *child == frame {
                    Some((&edge.parent, edge.parent_from_child.inverse()))
                } else {
                    None
                };
                if let Some((next, step)) = step
                    && seen.insert(next.clone())
                {
                    open.push_back((next.clone(), from_frame * step));
                }
            }
        }
        None
    }
}

fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    let apart = (a.translation.vector - b.translation.vector).norm();
    apart < STILL && 1.0 - a.rotation.dot(&b.rotation).abs() < STILL
}

/// How far a laser's fan is from lying flat, in degrees from 0 to 90; on its back it lies flat too.
pub(crate) fn tilt_deg(base_from_laser: &Isometry3<f64>) -> f64 {
    let up = base_from_laser.rotation * Vector3::z();
    up.z.abs().clamp(0.0, 1.0).portable_acos().to_degrees()
}

#[cfg(test)]
mod tests {
    use super::{Frames, tilt_deg};
    use crate::recordings::mounts::{base_from_mount, mount_of};
    use biplane_recording::messages::TransformStamped;
    use biplane_recording::rig::Mount;

    fn transform(parent: &str, child: &str, x_m: f64) -> TransformStamped {
        TransformStamped {
            frame_id: parent.to_owned(),
            child_frame_id: child.to_owned(),
            translation_m: [x_m, 0.0, 0.0],
            ..TransformStamped::default()
        }
    }

    #[test]
    fn a_chain_leads_over_static_frames_and_those_that_never_move() {
        let mut frames = Frames::default();
        frames.take(&transform("base_footprint", "base_link", 0.25), true);
        for _ in 0..3 {
            frames.take(&transform("/mast", "/laser", 2.0), false);
            frames.take(&transform("odom", "base_footprint", 5.0), false);
        }
        frames.take(&transform("base_link", "mast", 9.0), true);
        frames.take(&transform("base_link", "mast", 1.0), true);
        let x_m = |from, to| frames.between(from, to).map(|found| found.translation.x);
        assert_eq!(x_m("base_footprint", "laser"), Some(3.25));
        assert_eq!(x_m("laser", "base_link"), Some(-3.0));
        // A robot that stands still is carried by its odometry all the same.
        assert_eq!(x_m("odom", "laser"), None);
        assert_eq!(frames.driven(), [("odom", "base_footprint")]);
        frames.take(&transform("mast", "laser", 2.5), false);
        assert_eq!(frames.between("base_link", "laser"), None);
    }

    #[test]
    fn a_turned_frame_turns_what_sits_on_it() {
        let mut frames = Frames::default();
        let left = base_from_mount(&Mount { yaw: 90.0, ..Mount::default() }).rotation;
        let turned =
            TransformStamped { rotation_xyzw: left.coords.into(), ..transform("base_link", "mast", 1.0) };
        frames.take(&turned, true);
        frames.take(&transform("mast", "laser", 2.0), true);
        let mount = mount_of(&frames.between("base_link", "laser").unwrap());
        assert_eq!((mount.x, mount.y, mount.yaw), (1.0, 2.0, 90.0));
    }

    #[test]
    fn what_is_no_transform_is_counted() {
        let mut frames = Frames::default();
        frames.take(&transform("a", "b", f64::NAN), true);
        frames.take(&TransformStamped { rotation_xyzw: [0.0; 4], ..transform("a", "b", 0.0) }, true);
        frames.take(&transform("a", "/a", 0.0), true);
        assert!(!frames.knows("b") && frames.refused == 3);
    }

    #[test]
    fn a_fan_on_its_back_lies_flat() {
        for (roll, pitch, expected) in [(180.0, 0.0, 0.0), (0.0, -90.0, 90.0), (0.0, 20.0, 20.0)] {
            let mount = Mount { roll, pitch, yaw: 33.0, ..Mount::default() };
            assert!((tilt_deg(&base_from_mount(&mount)) - expected).abs() < 1e-6);
        }
    }
}
