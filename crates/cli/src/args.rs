//! The command line: commands, options, and the text of `--help`.

mod bench;
mod limits;
mod options;
mod parts;
mod paths;
mod repair;
mod smooth;
mod sphere;
mod values;

use std::ffi::OsString;

use clap::{Args, Parser, Subcommand};

pub(crate) use bench::BenchArgs;
pub(crate) use limits::LimitArgs;
pub(crate) use options::{DeformArgs, EmbedArgs, InputArgs, ReconstructArgs, RunArgs};
pub(crate) use parts::PartsArgs;
pub(crate) use paths::{InputPath, OutputFolder, OutputPath};
pub(crate) use repair::RepairArgs;
pub(crate) use smooth::{DetailArgs, KeepArgs, MeshArgs, SmoothArgs};
pub(crate) use sphere::{Align, MorphArgs, ResampleArgs, SphereArgs};
pub(crate) use values::Precision;

/// Edit triangle meshes by a few handles: the surface follows, its details turn with it.
#[derive(Debug, Parser)]
#[command(name = "cotan", version, max_term_width = 100, after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) messages: Messages,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Joins the word `smooth` after `--fill-holes` to that option.
///
/// The value of the option is optional, so any other word after it is a file.
pub(crate) fn joined(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut joined: Vec<OsString> = Vec::new();
    let mut has_ended = false;
    for argument in arguments {
        has_ended |= argument == "--";
        let is_value = argument
            .to_str()
            .is_some_and(|text| text == "smooth" || text.starts_with("smooth:"));
        match joined.last_mut() {
            Some(last) if is_value && !has_ended && *last == "--fill-holes" => {
                last.push("=");
                last.push(argument);
            }
            _ => joined.push(argument),
        }
    }
    joined
}

const EXAMPLES: &str = "\
Examples:
  cotan demo                                     deform the built-in model, with pictures
  cotan info bunny.ply                           what the mesh is and whether it can be edited
  cotan repair scan.ply -o sound.ply             orient, split bow-ties, drop duplicate faces
  cotan deform bar.obj --handles bar.json -o bent.obj --picture bent.png
  cotan edit bar.obj                             the same by hand, in a window
  cotan sphere brain.ply -o sphere.ply           onto the unit sphere, no triangle flipped
  cotan smooth scan.ply -o smooth.ply --preserve-volume
  cotan compare bar.obj bent.obj                 how far the two are from each other
  cotan bench scan.ply                           how long this machine takes for this mesh

Exit codes: 0 done, 1 an input is bad or a file cannot be written, 2 wrong usage.";

const MESSAGES: &str = "Messages";

/// The verbosity of messages on standard error.
#[derive(Debug, Args)]
pub(crate) struct Messages {
    /// Say nothing but errors: no progress, no warnings, no summary
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = MESSAGES)]
    pub(crate) quiet: bool,
    /// Say more: the phases and how long they take; twice: what the libraries tell
    #[arg(short, long, global = true, action = clap::ArgAction::Count, help_heading = MESSAGES)]
    pub(crate) verbose: u8,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Deform the built-in model and write meshes, a picture and a report
    #[command(after_help = DEMO_EXAMPLE)]
    Demo(DemoArgs),
    /// Tell what a mesh file holds: counts, topology, shape, defects
    #[command(after_help = INFO_EXAMPLE)]
    Info(InfoArgs),
    /// Open a mesh in the editor: drag handles and see the surface follow
    #[command(after_help = EDIT_EXAMPLE)]
    Edit(EditArgs),
    /// Repair a mesh without guessing a shape, and tell each change
    #[command(after_help = repair::REPAIR_EXAMPLE)]
    Repair(RepairArgs),
    /// Move handles and let the surface follow
    #[command(after_long_help = options::DEFORM_HELP, after_help = options::DEFORM_EXAMPLE)]
    Deform(DeformArgs),
    /// Rebuild a mesh from its Laplacian coefficients and magnitudes alone
    #[command(after_help = options::RECONSTRUCT_EXAMPLE)]
    Reconstruct(ReconstructArgs),
    /// Map a closed mesh onto the unit sphere without flipping a triangle
    #[command(after_help = sphere::SPHERE_EXAMPLE)]
    Sphere(SphereArgs),
    /// Remesh a closed shape by the even triangles of an icosphere
    #[command(after_help = sphere::RESAMPLE_EXAMPLE)]
    Resample(ResampleArgs),
    /// Write a shape between two closed ones
    #[command(after_help = sphere::MORPH_EXAMPLE)]
    Morph(MorphArgs),
    /// Smooth a mesh without shrinking it
    #[command(after_help = smooth::SMOOTH_EXAMPLE)]
    Smooth(SmoothArgs),
    /// Exaggerate, fade, exchange or paint the details of a mesh
    #[command(after_help = smooth::DETAIL_EXAMPLE)]
    Detail(DetailArgs),
    /// Measure how far two meshes of the same connectivity are from each other
    #[command(after_help = COMPARE_EXAMPLE)]
    Compare(CompareArgs),
    /// Write a mesh in another format (.obj, .ply, .off, .stl, .gltf, .glb)
    #[command(after_help = CONVERT_EXAMPLE)]
    Convert(ConvertArgs),
    /// Measure how fast this machine edits a mesh
    #[command(after_help = bench::BENCH_EXAMPLE)]
    Bench(BenchArgs),
    /// Print a completion script for a shell
    #[command(after_help = COMPLETIONS_EXAMPLE)]
    Completions(CompletionsArgs),
}

const DEMO_EXAMPLE: &str = "\
Example:
  cotan demo -o out     writes before.obj, after.obj, handles.json, demo.png and report.json";

const INFO_EXAMPLE: &str = "\
Example:
  cotan info bunny.ply --json

Meshes that are not manifold are described too; their defects are listed with their element, and
JSON lists --limit of each kind. `cotan repair` cures what can be cured without guessing a shape.
Vertices and faces have the numbers of the file, counted from 0.";

const EDIT_EXAMPLE: &str = "\
Example:
  cotan edit bar.obj --handles bar.json

Starts the program cotan-editor, which lies beside this one or on the PATH; its exit code is passed
on. `cotan edit bar.obj --help` shows the editor's own options.";

const COMPARE_EXAMPLE: &str = "\
Example:
  cotan compare before.obj after.obj

A is the original. E_p is the change of the cotangent weights, E_g the change of the lengths of the
Laplacian coordinates, with A scaled to a bounding box of longest side 1.";

const CONVERT_EXAMPLE: &str = "\
Example:
  cotan convert scan.ply scan.obj

The extension of OUT names the format; a .gz behind it compresses. Vertices and faces
keep their order; what the new format cannot hold is named in a warning.";

const COMPLETIONS_EXAMPLE: &str = "\
Example:
  cotan completions bash > ~/.local/share/bash-completion/completions/cotan";

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// Folder for the results; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "cotan-demo")]
    pub(crate) output: OutputFolder,
}

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    pub(crate) mesh: InputPath,
    /// Treat vertices as one that are at the same place (exact) or this close
    /// [default: exact for .stl, .gltf and .glb, otherwise off]
    #[arg(long, value_name = "off|exact|X", value_parser = values::weld)]
    pub(crate) weld: Option<cotan_io::Weld>,
    /// The most defects of a kind that are listed in JSON
    #[arg(long, value_name = "N", default_value = "100")]
    pub(crate) limit: usize,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct EditArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    pub(crate) mesh: InputPath,
    /// Options of the editor, passed on as they are; a `--` before them is left out
    #[arg(
        value_name = "OPTIONS",
        trailing_var_arg = true,
        allow_hyphen_values = true
    )]
    pub(crate) options: Vec<std::ffi::OsString>,
}

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// The original mesh
    #[arg(value_name = "A")]
    pub(crate) original: InputPath,
    /// The other mesh: same vertices and faces, other positions
    #[arg(value_name = "B")]
    pub(crate) other: InputPath,
    /// A third shape of the same vertices and faces; the distance is that of B to it, not to A
    #[arg(long, value_name = "SHAPE")]
    pub(crate) distance_to: Option<InputPath>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ConvertArgs {
    /// Mesh file to read
    #[arg(value_name = "IN")]
    pub(crate) input: InputPath,
    /// Mesh file to write
    #[arg(value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
}

#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    pub(crate) shell: clap_complete::Shell,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn every_command_shows_an_example() {
        for command in Arguments::command().get_subcommands_mut() {
            let name = command.get_name().to_owned();
            let help = command.render_help().to_string();
            assert!(help.contains(&format!("cotan {name} ")), "{name}: {help}");
        }
    }
}
