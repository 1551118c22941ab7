//! The built command, run as a person runs it.

mod bench;
mod commands;
mod deform;
mod demo;
mod edit;
mod numbering;
mod paths;
mod refusals;
mod repair;
mod sandbox;
mod shared;
mod signals;
mod smooth;
mod sphere;
mod sphere_uses;
mod terminal;
