//! Detection of components of a deformed mesh that have not moved.

use cotan_flow::Flow;
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{Components, HalfedgeMesh};

/// Distinguishes components at rest from deformed ones.
///
/// If every handle of a component is at its original position, the original shape is an exact
/// solution: its Laplacian coordinates are matched, and there are no forces. A solve then changes
/// it only by the rounding error of the coordinates, amplified by the system: a few units in the
/// last place of the size, or thousands if triangles without area have weights of 10⁶. If all
/// vertices of a component lie within √ε of the size from the original (ε is the machine epsilon,
/// so half of the digits agree), the component is set to the original. A component that ended
/// farther away, for example in another solution, is kept.
#[derive(Debug)]
pub(crate) struct Unmoved<T: Scalar> {
    components: Components,
    reach: T,
}

impl<T: Scalar> Unmoved<T> {
    /// Creates the detector for a mesh of this size.
    pub(crate) fn new(mesh: &HalfedgeMesh, size: T) -> Self {
        Self {
            components: mesh.components(),
            reach: size * T::default_epsilon().sqrt(),
        }
    }

    /// Resets the components at rest to their original positions.
    pub(crate) fn put_back(&self, flow: &Flow<T>, positions: &mut Positions<T>) {
        let original = flow.rest().original_positions();
        let mut is_at_rest = vec![true; self.components.count()];
        for (handle, target) in flow.handles().iter().zip(flow.handle_targets()) {
            if *target != original[handle.vertex] {
                is_at_rest[self.components.of(handle.vertex)] = false;
            }
        }
        if is_at_rest.iter().all(|is_at_rest| !is_at_rest) {
            return;
        }
        for (v, p) in positions.iter() {
            // Not tested by the largest coordinate, which would ignore a NaN.
            if !(p - original[v]).iter().all(|x| x.abs() <= self.reach) {
                is_at_rest[self.components.of(v)] = false;
            }
        }
        let of_vertices = self.components.of_vertices().values();
        let pairs = positions.values_mut().zip(original.values());
        for ((p, original), component) in pairs.zip(of_vertices) {
            if is_at_rest[*component as usize] {
                *p = *original;
            }
        }
    }
}
