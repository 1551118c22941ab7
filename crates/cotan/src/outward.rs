//! The orientation of closed surfaces.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::VertexMap;

/// Which vertices belong to a closed piece of negative volume, whose normals point inwards.
pub(crate) fn inside_out<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<bool> {
    let mesh = surface.mesh();
    let pieces = mesh.pieces();
    let topology = mesh.topology();
    let mut volumes = vec![0.0; pieces.count()];
    let center = surface.bounding_box().center().map(T::as_f64);
    for f in mesh.faces() {
        let corners = mesh.triangle(f);
        let [p, q, r] = corners.map(|v| surface.position(v).map(T::as_f64) - center);
        volumes[pieces.of(corners[0])] += p.cross(&q).dot(&r);
    }
    VertexMap::from_fn(mesh.num_vertices(), |v| {
        let of = pieces.of(v);
        volumes[of] < 0.0 && topology.get(of).is_some_and(|t| t.is_closed())
    })
}
