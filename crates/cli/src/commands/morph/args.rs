//! The options of `morph`.

use std::num::NonZeroUsize;

use clap::{Args, ValueEnum};

use crate::args::{EmbedArgs, InputPath, OutputPath, values};
use crate::sphere::args::{MapArgs, MendingArgs};

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan morph cow.obj horse.obj -t 0.5 -o between.obj
  cotan morph cow.obj horse.obj -t 0.5 --level 6 --authalic 1 -o even.obj

Each vertex goes the straight way to the place of B that has its place on the sphere, B's sphere
turned to fit A's, which is all that is done to make limbs meet limbs. OUT has the same triangles
for every -t, so that files of several times make an animation.";

#[derive(Debug, Args)]
pub(crate) struct MorphArgs {
    /// Mesh file of the shape at time 0
    #[arg(value_name = "A")]
    pub(crate) start: InputPath,
    /// Mesh file of the shape at time 1
    #[arg(value_name = "B")]
    pub(crate) end: InputPath,
    /// Time between A and B: 0 is A, 1 is B
    #[arg(short, long, value_name = "T", value_parser = values::share)]
    pub(crate) time: f64,
    /// Resample both to an icosphere of N subdivisions, at most 8; without it OUT is A's file with
    /// other positions
    #[arg(long, value_name = "N", value_parser = values::level())]
    pub(crate) level: Option<u32>,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    /// Alignment of B's sphere with A's
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Align::Pose)]
    pub(crate) align: Align,
    /// Pairs of a vertex of A and one of B that belong together, `a b` per line or a JSON list of
    /// lists; two or more
    #[arg(long, value_name = "FILE", conflicts_with = "align")]
    pub(crate) landmarks: Option<InputPath>,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    #[command(flatten)]
    pub(crate) map: MapArgs,
    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
}

/// The alignment of one sphere with another.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Align {
    /// Places that are near each other in space, for shapes in like poses
    Pose,
    /// Places where both maps shrink areas alike, whatever the poses
    Areas,
    /// Not at all
    None,
}
