//! A mesh before and after, coloured by its mean curvature.

use cotan::geometry::{Positions, Surface};
use cotan::halfedge::HalfedgeMesh;
use cotan::smooth::curvature_field;
use cotan_tool::ColorScale;

use super::heat::{HeatMap, Panel, Quantity, Views};

/// The title of the bar. The unit is that of the file.
const TITLE: &str = "mean curvature, 1 / unit of length, positive where convex";

/// Two panels with the same camera, on a common scale that is symmetric about 0.
pub(crate) fn curvature_picture(
    mesh: &HalfedgeMesh,
    before: &Positions<f64>,
    after: &Positions<f64>,
) -> Vec<u8> {
    let curvatures = [before, after].map(|x| curvature_field(&Surface::assume_checked(mesh, x)));
    // The scale is that of the result: the noise of the input would use up all colours.
    let scale = ColorScale::signed(TITLE, curvatures[1].values().copied());
    let panel = |positions, quantity, caption| Panel {
        mesh,
        positions,
        quantity: Quantity::Vertices(quantity),
        caption,
    };
    HeatMap {
        panels: &[
            panel(before, &curvatures[0], "before"),
            panel(after, &curvatures[1], "after"),
        ],
        scale: &scale,
        views: Views::OneCamera,
    }
    .png()
}
