//! Models of recordings, meshes and clouds.

mod build;
mod compact;
mod export;
mod floor;
mod odd_clouds;
mod planes;
mod tiles;
