//! The command line: the commands, the options of all of them, and the text of `--help`.
//!
//! The options of one command are in `args.rs` of its folder in `commands`, those that several
//! commands share in `args`.

use std::ffi::OsString;

use clap::{Parser, Subcommand};

use crate::args::{LimitArgs, Messages};
use crate::commands::{
    bench, compare, completions, convert, decimate, deform, demo, denoise, detail, edit, geodesic,
    info, merge, morph, reconstruct, remesh, repair, resample, smooth, sphere, subdivide,
};

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
  cotan smooth scan.ply --size 2% -o smooth.ply  bumps below 2 % of the size go
  cotan denoise scan.ply -o clean.ply            noise goes, as much as is found
  cotan compare bar.obj bent.obj                 how far the two are from each other
  cotan bench scan.ply                           how long this machine takes for this mesh

Exit codes: 0 done, 1 an input is bad or a file cannot be written, 2 wrong usage.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Deform the built-in model and write meshes, a picture and a report
    #[command(after_help = demo::args::EXAMPLE)]
    Demo(demo::args::DemoArgs),
    /// Describe a mesh file: counts, topology, shape, defects
    #[command(after_help = info::args::EXAMPLE)]
    Info(info::args::InfoArgs),
    /// Open a mesh in the editor: drag handles and see the surface follow
    #[command(after_help = edit::args::EXAMPLE)]
    Edit(edit::args::EditArgs),
    /// Repair a mesh without guessing a shape, and report each change
    #[command(after_help = repair::args::EXAMPLE)]
    Repair(repair::args::RepairArgs),
    /// Move handles and let the surface follow
    #[command(after_long_help = deform::args::HELP, after_help = deform::args::EXAMPLE)]
    Deform(deform::args::DeformArgs),
    /// Rebuild a mesh from its Laplacian coefficients and magnitudes alone
    #[command(after_help = reconstruct::args::EXAMPLE)]
    Reconstruct(reconstruct::args::ReconstructArgs),
    /// Map a closed mesh onto the unit sphere without flipping a triangle
    #[command(after_help = sphere::args::EXAMPLE)]
    Sphere(sphere::args::SphereArgs),
    /// Remesh a closed shape with the even triangles of an icosphere
    #[command(after_help = resample::args::EXAMPLE)]
    Resample(resample::args::ResampleArgs),
    /// Join parts of two meshes into one, without a seam
    #[command(after_help = merge::args::EXAMPLE)]
    Merge(merge::args::MergeArgs),
    /// Write a shape between two closed ones
    #[command(after_help = morph::args::EXAMPLE)]
    Morph(morph::args::MorphArgs),
    /// Remove bumps that are smaller than a size, and keep pose, girth and volume
    #[command(after_help = smooth::args::EXAMPLE)]
    Smooth(smooth::args::SmoothArgs),
    /// Remove the noise of a mesh, and nothing else
    #[command(after_help = denoise::args::EXAMPLE)]
    Denoise(denoise::args::DenoiseArgs),
    /// Exaggerate, fade, exchange or paint the details of a mesh
    #[command(after_help = detail::args::EXAMPLE)]
    Detail(detail::args::DetailArgs),
    /// Measure distances along a mesh from some of its vertices
    #[command(after_help = geodesic::args::EXAMPLE)]
    Geodesic(geodesic::args::GeodesicArgs),
    /// Remesh a surface with triangles of even size and shape
    #[command(after_help = remesh::args::EXAMPLE)]
    Remesh(remesh::args::RemeshArgs),
    /// Reduce the number of triangles
    #[command(after_help = decimate::args::EXAMPLE)]
    Decimate(decimate::args::DecimateArgs),
    /// Cut every face into smaller ones, by Loop, Catmull and Clark, or at midpoints
    #[command(after_help = subdivide::args::EXAMPLE)]
    Subdivide(subdivide::args::SubdivideArgs),
    /// Measure how far two meshes are from each other
    #[command(after_help = compare::args::EXAMPLE)]
    Compare(compare::args::CompareArgs),
    /// Write a mesh in another format (.obj, .ply, .off, .stl, .gltf, .glb)
    #[command(after_help = convert::args::EXAMPLE)]
    Convert(convert::args::ConvertArgs),
    /// Measure how fast this machine edits a mesh
    #[command(after_help = bench::args::EXAMPLE)]
    Bench(bench::args::BenchArgs),
    /// Print a completion script for a shell
    #[command(after_help = completions::args::EXAMPLE)]
    Completions(completions::args::CompletionsArgs),
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
