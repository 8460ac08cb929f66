//! Models of recordings, meshes and clouds.

mod build;
mod compact;
mod floor;
mod odd_clouds;
mod planes;
