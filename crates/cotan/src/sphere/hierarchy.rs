//! An embedding of any closed genus-0 triangle mesh on the sphere that is valid at every step.
//!
//! Vertices are removed in levels of independent ones until a tetrahedron is left, which is
//! mapped to a regular tetrahedron. Then the vertices are reinserted in reverse order, each at a
//! position from which its whole ring is visible. The target of the collapse sees the whole ring,
//! so in exact arithmetic there is always such a position, and relaxing each level keeps enough
//! room. Each remaining face carries the source area of the faces it represents, so already the
//! coarse levels give every part of the surface its share of the sphere.
//!
//! **Source**: Praun, Hoppe 2003, "Spherical parametrization and remeshing", section 4.

mod insert;
mod simplify;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::HalfedgeMesh;
use nalgebra::{Point3, Vector3};

use super::corners::{CornerTable, face_of};
use super::energy::{Blend, Rest, shares};
use super::error::SphereError;
use super::layout::{Layout, Rounding};
use super::predicate::flipped_faces;
use super::relax::checked_layout;
use super::sweep::Sweeper;
pub(super) use simplify::{Collapses, Hierarchy, cost, flips_after, simplify};

/// Maps a closed, connected genus-0 triangle mesh to the unit sphere without flipped triangles.
///
/// `balance` ranges from angles (0) to areas (1). Zero-area faces, coincident vertices and
/// slivers are allowed. Non-finite coordinates are treated as 0.
///
/// # Errors
/// [`SphereError`] if the mesh is not of that kind, or if the precision of `T` is too low to
/// distinguish that many vertices.
pub fn embed<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    balance: f64,
) -> Result<Positions<T>, SphereError> {
    let mut layout = checked_layout::<T>(mesh, positions, Blend::checked(balance)?)?;
    let hierarchy = simplify(&mut layout, Collapses::Any);
    tetrahedron(&mut layout, &hierarchy.left);
    refine(&mut layout, hierarchy)?;
    let sphere = positions_of(&layout);
    match flipped_faces(mesh, &sphere).as_slice() {
        [] => Ok(sphere),
        flipped => Err(SphereError::Flipped {
            count: flipped.len(),
            first: flipped[0],
        }),
    }
}

/// Reinserts the vertices level by level, and relaxes each level.
///
/// # Errors
/// If there is not enough room for a vertex at the available precision.
pub(super) fn refine(layout: &mut Layout, mut hierarchy: Hierarchy) -> Result<(), SphereError> {
    for &v in &hierarchy.left {
        for face in layout.table.outgoing(v).map(face_of).collect::<Vec<_>>() {
            layout.reshape(face);
        }
    }
    relax_level(layout, &hierarchy.left);
    while let Some(level) = hierarchy.levels.pop() {
        for &halfedge in level.iter().rev() {
            hierarchy.insert(layout, halfedge)?;
        }
        relax_level(layout, &hierarchy.left);
    }
    Ok(())
}

/// The layout of a mesh with all vertices at the origin.
pub(super) fn layout(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    blend: Blend,
    round: Rounding,
) -> Layout {
    let table = CornerTable::new(mesh);
    let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
    let source: Vec<Vector3<f64>> = positions.values().map(|p| p.coords.map(finite)).collect();
    let corners = |f: usize| table.triangle(f).map(|v| source[v as usize]);
    let area = |f: usize| {
        let [a, b, c] = corners(f);
        (b - a).cross(&(c - a)).norm()
    };
    let areas: Vec<f64> = (0..table.num_faces()).map(area).collect();
    let weights = shares(&areas);
    let rest = weights.iter().enumerate().map(|(f, &weight)| {
        let [a, b, c] = corners(f);
        Rest::new(weight, [&a, &b, &c])
    });
    Layout {
        rest: rest.collect(),
        place: vec![Vector3::zeros(); source.len()],
        table,
        source,
        blend,
        round,
    }
}

/// The positions of a layout, in the type to which they were rounded.
pub(super) fn positions_of<T: Scalar>(layout: &Layout) -> Positions<T> {
    let to_point = |p: &Vector3<f64>| Point3::from(p.map(T::of_f64));
    layout.place.iter().map(to_point).collect()
}

/// Places the remaining four vertices at the corners of a regular tetrahedron with outward-facing
/// faces.
fn tetrahedron(layout: &mut Layout, left: &[u32]) {
    let Some(&apex) = left.first() else { return };
    let ring: Vec<u32> = layout.table.ring(apex).collect();
    let corners = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    for (v, corner) in std::iter::once(apex).chain(ring).zip(corners) {
        layout.place[v as usize] = (layout.round)(&Vector3::from(corner));
    }
}

/// Sweeps over the present vertices, with more sweeps on coarser levels.
fn relax_level(layout: &mut Layout, present: &[u32]) {
    let sweeps = (SWEEPS_TIMES_VERTICES / present.len()).clamp(MIN_SWEEPS, MAX_SWEEPS);
    let mut sweeper = Sweeper::new(layout, present);
    for _ in 0..sweeps {
        if sweeper.sweep(layout, OVER_RELAXATION) == 0 {
            break;
        }
    }
}

/// The number of vertex steps spent on each level. Coarse levels cost almost nothing.
const SWEEPS_TIMES_VERTICES: usize = 100_000;
const MIN_SWEEPS: usize = 3;
const MAX_SWEEPS: usize = 100;
/// Scales the steps of a sweep, as in successive over-relaxation.
const OVER_RELAXATION: f64 = 1.5;

#[cfg(test)]
mod tests;
