//! Warnings about a sphere map and its options.

use cotan::flow::StopReason;
use cotan::sphere::{SphereMethod, SphereOptions, SphereReport, Stage};

use crate::console::Console;
use crate::report::counted;

/// Warns about a map that has not converged (it is checked all the same) and about ignored
/// options.
pub(crate) fn warn(report: &SphereReport, options: &SphereOptions, console: &Console) {
    if options.authalic > 0.0 && options.method != SphereMethod::Robust {
        console.warn(format_args!(
            "--method {} keeps angles; --authalic is ignored, since it needs --method robust",
            options.method.name()
        ));
    }
    if options.authalic > 0.0 && options.scheme != SphereOptions::default().scheme {
        console.warn("--scheme is ignored with --authalic; it applies to the conformal map only");
    }
    if options.authalic == 0.0 && report.stages.contains(&Stage::Hierarchy) {
        console.warn(
            "the conformal map of this mesh cannot be represented in floating-point numbers; a map between \
             conformal and authalic was made vertex by vertex instead; no triangle is flipped",
        );
        return;
    }
    let iterations = counted(report.iterations, "iteration");
    let change = report.change;
    match report.stop {
        None | Some(StopReason::Converged) => {}
        Some(StopReason::IterationLimit)
            if !change.is_finite() && options.iteration_limit < USUAL_ITERATIONS =>
        {
            console.warn(format_args!(
                "not converged after {iterations} (the surface is not near a sphere yet); no triangle is \
                 flipped, but raise --iterations for less distortion"
            ));
        }
        Some(StopReason::Diverged) => console.warn(format_args!(
            "the iteration did not approach a sphere: its steps overflow, since the last of \
             {iterations} has no finite length; lengths in this mesh differ by orders of magnitude, \
             and more iterations rarely help; no triangle is flipped, but angles are distorted; \
             --authalic 0.1 maps without iterations"
        )),
        Some(_) if !change.is_finite() => console.warn(format_args!(
            "the surface is not near a sphere after {iterations}, and more of them rarely help; no \
             triangle is flipped, but angles are distorted; --authalic 0.1 maps without iterations"
        )),
        Some(StopReason::IterationLimit) => console.warn(format_args!(
            "not converged after {iterations} (the last moved a vertex by {change:.1e} of the \
             sphere's radius); no triangle is flipped, but raise --iterations for less distortion"
        )),
        Some(other) => console.warn(format_args!(
            "stopped after {iterations}: {other}; no triangle is flipped, but the map may be more \
             distorted than necessary"
        )),
    }
}

/// Most meshes are near a sphere after this many iterations.
const USUAL_ITERATIONS: usize = 100;
