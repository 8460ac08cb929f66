//! Compact 3D building models from recordings of a robot with two laser scanners.
//!
//! The stages in the order of the paper (Hähnel, Burgard, Thrun 2001): trajectory, cloud, mesh, planes, polygons, leftovers.
//! Frame `map` (x forward at the start, z up), metres, stamps in whole nanoseconds.

pub mod budget;
pub mod building;
pub mod calibrate;
pub mod cloud;
pub mod cloud_file;
pub mod compact;
pub mod compare;
pub mod deskew;
pub mod evaluate;
pub mod export;
#[cfg(test)]
mod fixture;
pub mod floor_map;
pub mod import;
pub mod info;
pub mod leftovers;
pub mod loops;
pub mod map_files;
mod markup;
pub mod mesh;
pub mod mesh_file;
pub mod model;
pub mod obj_read;
pub mod occupancy;
pub mod output;
pub mod page;
pub mod palette;
pub mod params;
pub mod pipeline;
pub mod plane_report;
pub mod planes;
pub mod plot;
pub mod ply_read;
pub mod polygons;
pub mod rays;
pub mod render;
pub mod run;
pub mod shift;
#[cfg(feature = "simplify")]
pub mod simplify;
pub mod stamp_text;
pub mod summary;
pub mod surface_distance;
pub mod trajectory;
pub mod triangulate;
