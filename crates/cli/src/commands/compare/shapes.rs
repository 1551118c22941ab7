//! The picture of two shapes of a mesh next to a third.

use cotan::geometry::Positions;
use cotan::halfedge::{HalfedgeMesh, VertexMap};
use cotan_tool::ColorScale;

use crate::picture::{HeatMap, Panel, Quantity, Views};

/// A, B and SHAPE with one camera. A and B are coloured by the distance of their vertices from
/// those of SHAPE, which is blank.
pub(super) fn picture(
    mesh: &HalfedgeMesh,
    compared: [&Positions<f64>; 2],
    shape: &Positions<f64>,
) -> Vec<u8> {
    let distances = |positions: &Positions<f64>| -> VertexMap<f64> {
        let pairs = positions.values().zip(shape.values());
        pairs.map(|(p, q)| (p - q).norm()).collect()
    };
    let [a, b] = compared.map(distances);
    let blank = VertexMap::filled(shape.len(), f64::NAN);
    let scale = ColorScale::size(
        "distance of the vertices from those of SHAPE, in the unit of the files",
        a.values().chain(b.values()).copied(),
    );
    let panel = |positions, values, caption| Panel {
        mesh,
        positions,
        quantity: Quantity::Vertices(values),
        caption,
    };
    let map = HeatMap {
        panels: &[
            panel(compared[0], &a, "A"),
            panel(compared[1], &b, "B"),
            panel(shape, &blank, "SHAPE"),
        ],
        scale: &scale,
        views: Views::OneCamera,
    };
    map.png()
}
