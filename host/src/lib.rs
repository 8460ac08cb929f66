//! Compact 3D building models from recordings of a robot with two laser scanners.
//!
#![doc = include_str!("../README.md")]
// Without the command line nobody calls what only its commands use, such as pictures and reports.
#![cfg_attr(not(feature = "cli"), allow(dead_code, unused_imports))]

mod building;
mod calibrate;
#[cfg(feature = "cli")]
pub mod cli;
mod formats;
mod metrics;
mod model;
mod pipeline;
mod reconstruct;
mod recordings;
mod slam;
mod view;

#[doc(inline)]
pub use self::{
    building::{Building, Kind, Opening, OpeningKind, Part},
    calibrate::{Calibration, Fit, Row, calibrate},
    model::{Cloud, Mesh, Model, PlanarPolygon, Plane},
    pipeline::compact::compact,
    pipeline::params::BuildParams,
    pipeline::{BuildError, BuildInput, BuildOutput, Counts, Observer, Stage, build, model_of},
    reconstruct::cloud::CloudParams,
    reconstruct::leftovers::LeftoverParams,
    reconstruct::mesh::MeshParams,
    reconstruct::planes::extract as planes,
    reconstruct::planes::{PlaneParams, Planes, SigmaSource},
    reconstruct::polygons::triangulate::{model_mesh, polygons_mesh},
    reconstruct::polygons::validate::{Defect, check as check_polygon},
    reconstruct::polygons::{Merging, PolygonParams},
    reconstruct::revisits::params::RevisitParams,
    recordings::deskew::{StampedPose, Trajectory},
    recordings::run::{Run, RunError, RunPoses, VerticalScans},
    recordings::scan_geometry::{BeamGeometry, RangeScan, ScanGeometry},
};

/// Files of other programs, read and written. Readers take no more memory than a file fills, and never panic.
pub mod files {
    #[cfg(feature = "las")]
    #[doc(inline)]
    pub use crate::formats::las::write as write_las;
    #[doc(inline)]
    pub use crate::formats::{
        Shapes,
        cityjson::write as write_cityjson,
        dxf::write as write_dxf,
        gltf::write as write_glb,
        ifc::write as write_ifc,
        input::cloud::{from_ply as cloud_from_ply, read as read_cloud},
        input::cloud_file::{CloudFile, CloudFileError},
        input::mesh::{MeshFile, MeshFileError, read as read_mesh},
        input::shift::Shift,
        obj::{Obj, ObjError, read as read_obj, write as write_obj},
        ply::error::PlyError,
        ply::read::{Ply, Wanted, read as read_ply, read_wanted as read_wanted_ply},
        ply::write::{PointRow, PointRows, PointTable, write_mesh, write_model as write_ply, write_points},
        text::model_json::{ModelFile, ModelFileError, PointsOf, ScanTimes, read as read_model_json},
        text::trajectory::{TrajectoryError, TrajectoryFormat, read_poses, write_poses},
    };
    #[doc(inline)]
    pub use crate::recordings::import::bag::{
        BagError, BagOptions, BagReport, Echo, LaserOptions, Losses, Stamps, TopicChoice,
        import as import_bag, parse_mount,
    };
    #[doc(inline)]
    pub use crate::recordings::import::carmen::{
        BrokenLine, ImportError, ImportReport, import as import_carmen,
    };
    #[doc(inline)]
    pub use crate::recordings::stamp_text::{format_seconds, parse_seconds_ns};
}

/// Loops closed: keyframes of recordings in, corrected poses out.
pub mod loops {
    #[doc(inline)]
    pub use crate::slam::{
        Counts, LoopFound, LoopParams, Optimized, Progress,
        corrected_poses::Corrected,
        keyframes::{KeyframeParams, Keyframes, Node},
        loop_closure::checkpoint::Checkpoint,
        optimize,
        pose_graph::wheel_calibration::OdometryScale,
    };
}

/// How good poses and surfaces are, in figures that others publish.
pub mod evaluate {
    #[doc(inline)]
    pub use crate::metrics::{
        evaluate::association::{PosePair, associate},
        evaluate::pose_error::{PoseErrors, Step, absolute, alignment, relative},
        evaluate::relations::{
            PosesFound, Relation, RelationError, RelationsError, RelationsParams, RelationsReport,
            read_relations, relation_errors, report as relations_report,
        },
        surface_distance::{Distances, Surface, distances_m, sample},
    };
}
