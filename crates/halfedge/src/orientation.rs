//! Reversing the orientation of a component.

use crate::edit::EditError;
use crate::mesh::HalfedgeMesh;

impl HalfedgeMesh {
    /// Reverses all faces of a component, indexed as in [`HalfedgeMesh::components`]. O(n).
    ///
    /// ```text
    ///         c                   c
    ///        ╱ ▲                 ▲ ╲
    ///       ▼   ╲       ──▶     ╱   ▼
    ///      a ──h─▶ b           a ◀─h── b
    /// ```
    ///
    /// Every element keeps its id, every halfedge its face, and every face its first corner. The
    /// halfedges, including those of boundary loops, are reversed. Applying it twice is the
    /// identity.
    ///
    /// # Errors
    /// [`EditError::NoSuchComponent`].
    pub fn flip_orientation(&mut self, component: usize) -> Result<(), EditError> {
        let components = self.components();
        let num_components = components.count();
        if component >= num_components {
            return Err(EditError::NoSuchComponent {
                component,
                num_components,
            });
        }
        // Faces first: their vertices are read from the halfedges before these change.
        for face in self.faces() {
            let first = self.face_halfedge(face);
            if components.of(self.target(first)) == component {
                self.face_halfedge[face.index()] = self.prev(first);
            }
        }
        // A halfedge that left a vertex before it in the face will arrive there, and vice versa.
        for vertex in self.vertices().filter(|&v| components.of(v) == component) {
            self.vertex_halfedge[vertex.index()] = self.prev(self.vertex_halfedge(vertex));
        }
        for edge in self.edges() {
            let [h, t] = edge.halfedges().map(|side| side.index());
            if components.of(self.target[h]) == component {
                self.target.swap(h, t);
                for side in [h, t] {
                    std::mem::swap(&mut self.next[side], &mut self.prev[side]);
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing;

    #[test]
    fn a_component_that_does_not_exist() {
        let mut mesh = HalfedgeMesh::from_faces(3, &[[0, 1, 2]]).unwrap();
        let error = EditError::NoSuchComponent {
            component: 1,
            num_components: 1,
        };
        assert_eq!(mesh.flip_orientation(1), Err(error));
    }

    proptest! {
        #[test]
        fn faces_are_reversed_and_twice_is_the_identity(
            mesh in testing::arbitrary_mesh(),
            choice in any::<prop::sample::Index>(),
        ) {
            let components = mesh.components();
            let component = choice.index(components.count());
            let mut flipped = mesh.clone();
            flipped.flip_orientation(component).unwrap();
            prop_assert_eq!(flipped.validate(), Ok(()));
            prop_assert_eq!(flipped.topology(), mesh.topology());
            for face in mesh.faces() {
                let mut corners: Vec<_> = flipped.face_vertices(face).collect();
                if components.of(corners[0]) == component {
                    corners[1..].reverse();
                }
                prop_assert_eq!(corners, mesh.face_vertices(face).collect::<Vec<_>>());
            }
            flipped.flip_orientation(component).unwrap();
            prop_assert_eq!(flipped, mesh);
        }
    }
}
