//! The built command, run as a person runs it.

mod bench;
mod commands;
mod deform;
mod demo;
mod edit;
mod gltf;
mod numbering;
mod refusals;
mod repair;
mod sandbox;
mod shared;
mod smooth;
mod sphere;
mod sphere_uses;
