//! The mesh and its sphere, coloured by the change of areas.

use cotan::geometry::Scalar;
use cotan::sphere::area_log_ratios;

use crate::picture::{ColorScale, HeatMap, Panel, Quantity, Views};
use crate::report::counted;
use crate::sphere::Mapped;

/// The picture as PNG.
pub(crate) fn area_picture<T: Scalar>(mapped: &Mapped<T>) -> Vec<u8> {
    let mesh = mapped.map.mesh();
    let ratios = area_log_ratios(&mapped.surface(), &mapped.map);
    let scale = ColorScale::signed(TITLE, ratios.values().copied());
    let source = mapped.positions.map(|p| p.map(T::as_f64));
    let sphere = mapped.map.positions().map(|p| p.map(T::as_f64));
    let caption = format!("mesh, {}", counted(mesh.num_faces(), "triangle"));
    let panel = |positions, caption| Panel {
        mesh,
        positions,
        quantity: Quantity::Faces(&ratios),
        caption,
    };
    HeatMap {
        panels: &[panel(&source, &caption), panel(&sphere, "sphere")],
        scale: &scale,
        views: Views::OneDirection,
    }
    .png()
}

const TITLE: &str = "ln (share of the sphere's area / share of the mesh's area), 0: kept";
