//! Triangulation of polygons, on request.

use std::collections::HashSet;

use super::EditError;
use crate::ids::{FaceId, HalfedgeId, NONE, VertexId};
use crate::map::{FaceMap, VertexMap};
use crate::mesh::HalfedgeMesh;

impl HalfedgeMesh {
    /// Cuts every larger polygon into a fan of triangles.
    ///
    /// ```text
    ///      e ─── d             e ─── d
    ///     ╱       ╲           ╱│   ╱ ╲
    ///    a         c   ──▶   a │ ╱  __c
    ///     ╲       ╱           ╲│╱_─  ╱
    ///      ● ─── b             ● ─── b      ● first corner
    /// ```
    ///
    /// The fan starts at the first corner of the face, or, if one of its diagonals already exists
    /// as an edge, at the next corner without such a diagonal. Positions are not known here, so
    /// the shape of the polygon is ignored: in a non-convex polygon some triangles may be
    /// inverted. Vertices, edges and triangles keep their ids. A polygon keeps its id as the last
    /// triangle of its fan, and the other triangles are appended after the last face.
    ///
    /// Returns for each face the face that it was part of.
    ///
    /// # Errors
    /// [`EditError::NoFan`] if every fan of a face would double an edge (use
    /// [`HalfedgeMesh::split_face`] in that case), [`EditError::TooLarge`]. The mesh is then
    /// unchanged.
    ///
    /// ```
    /// # use cotan_halfedge::HalfedgeMesh;
    /// let mut mesh = HalfedgeMesh::from_faces(5, &[vec![0, 1, 2, 3], vec![0, 3, 4]])?;
    /// let source = mesh.triangulate()?;
    /// assert_eq!(mesh.to_faces(), [[0, 2, 3], [0, 3, 4], [2, 0, 1]]);
    /// assert_eq!(source.values().map(|f| f.index()).collect::<Vec<_>>(), [0, 1, 0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn triangulate(&mut self) -> Result<FaceMap<FaceId>, EditError> {
        let mut source: FaceMap<FaceId> = self.faces().collect();
        if self.is_triangle_mesh() {
            return Ok(source);
        }
        // A triangle mesh has two faces per inner edge, which gives the number of missing
        // diagonals.
        let num_corners = self
            .halfedges()
            .filter(|&h| !self.is_boundary_halfedge(h))
            .count();
        self.check_room(num_corners - 3 * self.num_faces())?;
        // A fan may become invalid through earlier diagonals, so the cuts are made on a copy.
        let mut cutter = Cutter::new(self.clone());
        for face in self.faces() {
            let corners: Vec<HalfedgeId> = self.face_halfedges(face).collect();
            if corners.len() > 3 {
                cutter.cut(face, &corners)?;
            }
            for _ in 3..corners.len() {
                source.push(face);
            }
        }
        *self = cutter.mesh;
        Ok(source)
    }
}

/// A mesh that is being triangulated.
struct Cutter {
    mesh: HalfedgeMesh,
    /// The ends of all edges, lower end first. Used for membership tests only, so its order never
    /// matters.
    edges: HashSet<[VertexId; 2]>,
    /// For each vertex, the last processed face that has it as a corner.
    corner_of: VertexMap<u32>,
}

impl Cutter {
    fn new(mesh: HalfedgeMesh) -> Self {
        let edges = mesh
            .edges()
            .map(|e| ordered(mesh.edge_vertices(e)))
            .collect();
        let corner_of = VertexMap::filled(mesh.num_vertices(), NONE);
        Self {
            mesh,
            edges,
            corner_of,
        }
    }

    /// Cuts one polygon, whose halfedges are `corners`.
    fn cut(&mut self, face: FaceId, corners: &[HalfedgeId]) -> Result<(), EditError> {
        let degree = corners.len();
        for &h in corners {
            self.corner_of[self.mesh.origin(h)] = face.0;
        }
        let apex = (0..degree)
            .find(|&apex| self.is_free(face, corners, apex))
            .ok_or(EditError::NoFan { face, degree })?;
        let mut from = corners[apex];
        for step in 2..degree - 1 {
            let to = corners[(apex + step) % degree];
            from = self.mesh.cut_face(from, to);
            self.edges
                .insert(ordered(self.mesh.edge_vertices(from.edge())));
        }
        Ok(())
    }

    /// Returns true if no diagonal from corner `apex` already exists as an edge.
    ///
    /// Checks the neighbours of the corner or the other corners, whichever are fewer, so that
    /// neither a hub among many small faces nor a face with very many corners is slow.
    fn is_free(&self, face: FaceId, corners: &[HalfedgeId], apex: usize) -> bool {
        let degree = corners.len();
        let vertex = self.mesh.origin(corners[apex]);
        if self.mesh.one_ring(vertex).nth(degree).is_none() {
            let on_face = |&w: &VertexId| self.corner_of[w] == face.0;
            // The previous and the next corner are always neighbours.
            return self.mesh.one_ring(vertex).filter(on_face).count() == 2;
        }
        (2..degree - 1).all(|step| {
            let other = self.mesh.origin(corners[(apex + step) % degree]);
            !self.edges.contains(&ordered([vertex, other]))
        })
    }
}

fn ordered([a, b]: [VertexId; 2]) -> [VertexId; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_apex_where_the_first_would_double_an_edge() {
        // The square 0 1 2 3 has a roof whose ridge is the edge 0–2.
        let faces = [vec![0, 1, 2, 3], vec![2, 1, 0], vec![0, 3, 2]];
        let mut mesh = HalfedgeMesh::from_faces(4, &faces).unwrap();
        let source = mesh.triangulate().unwrap();
        mesh.validate().unwrap();
        assert!(mesh.is_triangle_mesh());
        assert!(mesh.halfedge_between(VertexId(1), VertexId(3)).is_some());
        assert_eq!(
            source.as_slice(),
            [FaceId(0), FaceId(1), FaceId(2), FaceId(0)]
        );
    }

    #[test]
    fn squares_back_to_back_take_one_diagonal_each() {
        let faces = [[0, 1, 2, 3], [3, 2, 1, 0]];
        let mut mesh = HalfedgeMesh::from_faces(4, &faces).unwrap();
        let _ = mesh.triangulate().unwrap();
        mesh.validate().unwrap();
        assert_eq!(mesh.num_edges(), 6);
    }

    #[test]
    fn a_polygon_whose_corners_are_all_joined_is_refused() {
        // The torus with seven vertices joins each pair of them. The triangles around vertex 6
        // are replaced by a hexagon, all of whose diagonals are edges.
        let triangles = (0..7u32).flat_map(|i| {
            let at = |k| (i + k) % 7;
            [vec![i, at(1), at(3)], vec![i, at(3), at(2)]]
        });
        let mut faces: Vec<_> = triangles.filter(|face| !face.contains(&6)).collect();
        let open = HalfedgeMesh::from_faces(6, &faces).unwrap();
        let rim = open.boundary_loop(open.boundary_loops()[0]);
        faces.push(rim.map(|h| open.origin(h).0).collect());
        let mesh = HalfedgeMesh::from_faces(6, &faces).unwrap();
        let hexagon = FaceId::new(faces.len() - 1);
        let mut edited = mesh.clone();
        let error = edited.triangulate().unwrap_err();
        assert_eq!(
            error,
            EditError::NoFan {
                face: hexagon,
                degree: 6
            }
        );
        assert_eq!(edited, mesh);
        edited.split_face(hexagon).unwrap();
        assert!(edited.is_triangle_mesh());
    }

    #[test]
    fn hubs_and_large_polygons_are_quick() {
        // Quads around one vertex, and one polygon with the same number of corners.
        const N: u32 = 100_000;
        let squares = (0..N).map(|i| vec![2 * N, 2 * i, 2 * i + 1, (2 * i + 2) % (2 * N)]);
        let mut mesh = HalfedgeMesh::from_faces(2 * N as usize + 1, &squares.collect::<Vec<_>>());
        assert!(mesh.as_mut().is_ok_and(|mesh| mesh.triangulate().is_ok()));
        let polygon: Vec<u32> = (0..N).collect();
        let mut mesh = HalfedgeMesh::from_faces(N as usize, &[polygon]);
        assert!(mesh.as_mut().is_ok_and(|mesh| mesh.triangulate().is_ok()));
    }
}
