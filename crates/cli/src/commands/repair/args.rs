//! The options of `repair`.

use std::num::NonZeroUsize;

use clap::Args;
use cotan_io::{Filling, Repair, Weld};

use crate::args::{EmbedArgs, InputPath, OutputPath, values};

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan repair scan.ply -o sound.ply --fill-holes=8 --report changes.json

Without an option that names a repair: --orient --split-vertices --drop-duplicates
--drop-degenerate, which keep the number of every vertex; in a glTF of several meshes the copies of
split vertices go behind those of their own mesh, and the later meshes move up. Numbers are those of
IN, from 0.";

const REPAIRS: &str = "Repairs";

#[derive(Debug, Args)]
pub(crate) struct RepairArgs {
    /// Mesh file to read (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    #[arg(value_name = "IN")]
    pub(crate) input: InputPath,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    /// Turn faces round until neighbours agree, and closed parts look outward
    #[arg(long, help_heading = REPAIRS)]
    orient: bool,
    /// Give each fan of faces at a vertex a vertex of its own
    #[arg(long, help_heading = REPAIRS)]
    split_vertices: bool,
    /// Part the faces at edges with more than two, and cut one-sided parts open
    #[arg(long, help_heading = REPAIRS)]
    split_edges: bool,
    /// Drop faces that have the outline of one before them, in either direction
    #[arg(long, help_heading = REPAIRS)]
    drop_duplicates: bool,
    /// Drop faces, and corners of polygons, that enclose nothing
    #[arg(long, help_heading = REPAIRS)]
    drop_degenerate: bool,
    /// Drop faces without area whose vertices differ; that opens holes
    #[arg(long, help_heading = REPAIRS)]
    drop_zero_area: bool,
    /// Drop vertices that no face uses; the others are renumbered
    #[arg(long, help_heading = REPAIRS)]
    compact: bool,
    /// Merge vertices at the same place, or this close
    #[arg(long, value_name = "exact|X", value_parser = values::merge, help_heading = REPAIRS)]
    weld: Option<Weld>,
    /// Keep the parts with the most faces: one, or =N; parts hang together by edges
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true,
        help_heading = REPAIRS)]
    keep_largest: Option<Option<NonZeroUsize>>,
    /// Drop parts with fewer faces than this, and their vertices
    #[arg(long, value_name = "FACES", help_heading = REPAIRS)]
    drop_parts_below: Option<NonZeroUsize>,
    /// Fill holes of at most N edges (=N), or all; `smooth` or `smooth:N` adds vertices that make
    /// the patch continue the surface
    #[arg(long, value_name = "[smooth][:N]", num_args = 0..=1, require_equals = true,
        value_parser = values::filling, help_heading = REPAIRS)]
    fill_holes: Option<Option<Filling>>,
    /// All of these but those that drop parts or faces without area, until a surface can be built
    #[arg(long, help_heading = REPAIRS)]
    all: bool,
    /// Write every change (JSON)
    #[arg(long, value_name = "R.json")]
    pub(crate) report: Option<OutputPath>,
}

/// A function that adds a repair to the others.
type Step = fn(Repair) -> Repair;

impl RepairArgs {
    /// The requested repairs.
    pub(crate) fn repair(&self) -> Repair {
        let mut repair = match self.all {
            true => Repair::all(),
            false => Repair::new(),
        };
        let steps: [(bool, Step); 7] = [
            (self.orient, Repair::orient),
            (self.split_vertices, Repair::split_vertices),
            (self.split_edges, Repair::split_edges),
            (self.drop_duplicates, Repair::drop_duplicates),
            (self.drop_degenerate, Repair::drop_degenerate),
            (self.drop_zero_area, Repair::drop_zero_area),
            (self.compact, Repair::compact),
        ];
        for (_, step) in steps.into_iter().filter(|(is_asked, _)| *is_asked) {
            repair = step(repair);
        }
        if let Some(weld) = self.weld {
            repair = repair.weld(weld);
        }
        if let Some(num_parts) = self.keep_largest {
            repair = repair.keep_largest(num_parts.unwrap_or(NonZeroUsize::MIN));
        }
        if let Some(num_faces) = self.drop_parts_below {
            repair = repair.drop_parts_below(num_faces.get());
        }
        if let Some(filling) = self.fill_holes {
            repair = repair.fill_holes(filling.unwrap_or(Filling::PLAIN));
        }
        match repair == Repair::new() {
            true => Repair::default(),
            false => repair,
        }
    }
}
