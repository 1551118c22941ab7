//! Tests that run the built command.

mod bench;
mod commands;
mod deform;
mod demo;
mod digits;
mod edit;
mod geodesic;
mod gltf;
mod memory;
mod mending;
mod merge;
mod numbering;
mod parts;
mod paths;
mod refusals;
mod repair;
mod sandbox;
mod shared;
mod shared_rows;
mod signals;
mod smooth;
mod sphere;
mod sphere_files;
mod sphere_uses;
mod terminal;
mod tessellation;
