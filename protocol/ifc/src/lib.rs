//! Reads IFC files: surfaces of their elements, and the rooms, walls and openings of a storey.
//!
#![doc = include_str!("../README.md")]

mod building;
mod geometry;
mod step;

#[doc(inline)]
pub use self::{
    building::elements::{Element, Ifc},
    building::plan::{Opening, Plan, PlanStorey, Room, Storey, Wall},
    step::parse::IfcError,
};
