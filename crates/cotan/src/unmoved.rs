//! Components of a deformed mesh that nothing has moved.

use cotan_flow::Flow;
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{Components, HalfedgeMesh};

/// Tells components that are at rest from those that are deformed.
///
/// If every handle of a component is at its original place, the original shape is an exact
/// solution: its Laplacian coordinates are met, nothing pulls. What a solve leaves of it is the
/// rounding of the coordinates, times what the system makes of that: a few units in the last place
/// of the size, and thousands where triangles without area have weights of 10⁶. A component whose
/// vertices all lie within √ε of the size from the original (ε the spacing of the numbers at 1, so
/// that half of the digits agree) is the original; one that ended farther away, in another solution
/// say, is what it is.
#[derive(Debug)]
pub(crate) struct Unmoved<T: Scalar> {
    components: Components,
    reach: T,
}

impl<T: Scalar> Unmoved<T> {
    /// For a mesh of this size.
    pub(crate) fn new(mesh: &HalfedgeMesh, size: T) -> Self {
        Self {
            components: mesh.components(),
            reach: size * T::default_epsilon().sqrt(),
        }
    }

    /// Gives the components at rest their original positions.
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
            // Not by the largest coordinate, which drops a NaN.
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
