//! Fairing: a part of a surface is moved so that it continues the rest.

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{VertexId, VertexMap};
use cotan_laplacian::{Cotangent, LaplacianScheme, Operator, Uniform};
use cotan_linear::{Defect, Handle, PreparedSystem};
use nalgebra::Vector3;

use crate::error::Error;

/// Moves the free vertices, and no others, so that the surface bends least:
///
/// ```text
/// Σ_i |ℓ_i|² → min,        ℓ = Laplacian coordinates
/// ```
///
/// summed over all vertices. This is the thin-plate energy of the patch. It includes the
/// Laplacian coordinates of the vertices around the patch, so the patch joins the rest without a
/// crease.
///
/// The weights are the cotangents of the given positions, or all equal if those are not finite
/// (triangles without area). **Shapes**: one position per vertex. If there are no free vertices,
/// nothing moves; a component that has only free vertices does not move either.
///
/// # Errors
/// [`Error::Surface`] for a mesh that is not a triangle mesh or has non-finite positions,
/// [`Error::Flow`] if the system cannot be solved.
///
/// **Source**: P. Liepa, "Filling holes in meshes", SGP 2003, section 5: second-order umbrella
/// operator. Liepa uses the scale-dependent or harmonic operator per vertex; here the rows are
/// not divided by areas, which makes no difference if the triangles are of similar size.
pub fn fair<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    free: &[VertexId],
) -> Result<Positions<T>, Error> {
    let surface = surface.into();
    let surface = Surface::new(surface.mesh(), surface.positions())?;
    match fair_by(&Cotangent::default(), &surface, free) {
        Ok(positions) => Ok(positions),
        Err(_) => fair_by(&Uniform, &surface, free),
    }
}

/// Like [`fair`], with the weights of a scheme.
pub(crate) fn fair_by<T: Scalar, S: LaplacianScheme<T>>(
    scheme: &S,
    surface: &Surface<'_, T>,
    free: &[VertexId],
) -> Result<Positions<T>, Error> {
    let (mesh, positions) = (surface.mesh(), surface.positions());
    // Copies of a vertex are one unknown.
    let mut is_free = vec![false; mesh.num_rows()];
    for v in free.iter().filter(|v| v.index() < mesh.num_vertices()) {
        is_free[mesh.row_of(*v).index()] = true;
    }
    let components = mesh.components();
    let mut is_anchored = vec![false; components.count()];
    for v in mesh.rows().filter(|v| !is_free[v.index()]) {
        is_anchored[components.of(v)] = true;
    }
    let is_held = |v: &VertexId| !is_free[v.index()] || !is_anchored[components.of(*v)];
    let handles: Vec<Handle> = mesh.rows().filter(is_held).map(Handle::hard).collect();
    if handles.len() == mesh.num_rows() {
        return Ok(positions.clone());
    }
    let correction = solve(scheme, surface, &handles)?;
    let fair = mesh.rows().map(|v| match is_held(&v) {
        true => positions[v],
        false => positions[v] + correction[v].map(T::of_f64),
    });
    Ok(mesh.to_vertices(fair.collect()))
}

/// Solves for the displacement of each vertex.
fn solve<T: Scalar, S: LaplacianScheme<T>>(
    scheme: &S,
    surface: &Surface<'_, T>,
    handles: &[Handle],
) -> Result<VertexMap<Vector3<f64>>, Error> {
    let operator = Operator::assemble(scheme, surface)?;
    let mut system =
        PreparedSystem::prepare(&operator, handles, None).map_err(cotan_flow::FlowError::from)?;
    let mesh = surface.mesh();
    let mismatch = mesh
        .rows()
        .map(|v| -operator.apply_at(surface.positions(), v.index()))
        .collect();
    let mut correction = VertexMap::filled(mesh.num_rows(), Vector3::zeros());
    let solved = system.correct(&Defect::of_laplacian(&mismatch), &mut correction);
    solved.map_err(cotan_flow::FlowError::from)?;
    Ok(correction)
}
