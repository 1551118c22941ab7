//! The options of `merge`.

use std::num::NonZeroUsize;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use cotan_io::Weld;

use crate::args::{EmbedArgs, InputPath, OutputPath, Selection, values};

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan merge body.obj head.obj -o both.obj --keep-a plane:0,1.5,0,0,-1,0 \\
      --keep-b plane:0,1.6,0,0,1,0 --picture both.png
  cotan merge body.obj head.ply -o both.obj --keep-a-file body.json --keep-b-file head.json \\
      --place fit

Whole triangles are kept, those with all corners in the selection. Each cut of A is joined to one
of B; the surface within --band rings of the seam moves, everything else keeps every digit.";

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// Mesh file, which stays in place
    #[arg(value_name = "A")]
    pub(crate) first: InputPath,
    /// Mesh file to join to it
    #[arg(value_name = "B")]
    pub(crate) second: InputPath,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    /// Part of A to keep: plane:X,Y,Z,NX,NY,NZ (the side that the normal points to)
    /// box:X,Y,Z,X,Y,Z  sphere:X,Y,Z,R  near:VERTEX,R (along the surface) or property:NAME
    #[arg(long, value_name = "SEL", value_parser = Selection::from_str,
        required_unless_present = "keep_a_file")]
    pub(crate) keep_a: Option<Selection>,
    /// Part of A to keep: the vertices that a handles file names
    #[arg(long, value_name = "FILE", conflicts_with = "keep_a")]
    pub(crate) keep_a_file: Option<InputPath>,
    /// Part of B to keep, in its own coordinates
    #[arg(long, value_name = "SEL", value_parser = Selection::from_str,
        required_unless_present = "keep_b_file")]
    pub(crate) keep_b: Option<Selection>,
    /// Part of B to keep: the vertices that a handles file names
    #[arg(long, value_name = "FILE", conflicts_with = "keep_b")]
    pub(crate) keep_b_file: Option<InputPath>,
    /// Placement of B
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Place::AsIs)]
    pub(crate) place: Place,
    /// Pairs of a vertex of A and one of B that belong together, `a b` per line or a JSON list of
    /// lists; three or more determine the place with --place fit
    #[arg(long, value_name = "FILE")]
    pub(crate) landmarks: Option<InputPath>,
    /// Cuts that belong together, counted from 0 in the order of their lowest vertices
    /// [default: by landmarks, or the closest]
    #[arg(long, value_name = "A:B,...", value_parser = LoopPairs::from_str)]
    pub(crate) loops: Option<LoopPairs>,
    /// Number of rings of vertices on either side of the seam that may move
    #[arg(long, value_name = "N", default_value = "4")]
    pub(crate) band: usize,
    /// Join the cuts by triangles and move no vertex
    #[arg(long)]
    pub(crate) no_blend: bool,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    /// Repair both meshes first, as `cotan repair` without options does
    #[arg(long)]
    pub(crate) repair: bool,
    /// Treat vertices at the same place (exact), or within this distance, as one
    /// [default: exact for .stl, .gltf and .glb, otherwise off]
    #[arg(long, value_name = "off|exact|X", value_parser = values::weld)]
    pub(crate) weld: Option<Weld>,
    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write a report (JSON)
    #[arg(long, value_name = "R.json")]
    pub(crate) report: Option<OutputPath>,
    /// Draw both meshes and the result, coloured by mean curvature (PNG)
    #[arg(long, value_name = "P.png")]
    pub(crate) picture: Option<OutputPath>,
}

/// The place of the second mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Place {
    /// In its own coordinates
    AsIs,
    /// Scaled, turned and moved onto the cut of A, or by landmarks
    Fit,
}

/// Pairs of loops.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct LoopPairs(pub(crate) Vec<[usize; 2]>);

impl FromStr for LoopPairs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let pair = |pair: &str| {
            let (a, b) = pair.split_once(':')?;
            Some([a.trim().parse().ok()?, b.trim().parse().ok()?])
        };
        let pairs: Option<Vec<[usize; 2]>> = text.split(',').map(pair).collect();
        pairs
            .map(Self)
            .ok_or_else(|| "give pairs of numbers, as in 0:1,1:0".to_owned())
    }
}
