//! Building a mesh from buffers, with the unambiguous repairs.

use std::collections::HashMap;

use cotan_halfedge::{BuildError, EditError, FaceMap, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Point3;

use super::{Mesh, MeshError};
use crate::scalar::Scalar;

/// Options for building a [`Mesh`] from buffers.
///
/// ```
/// use cotan_geometry::MeshBuilder;
///
/// // Two triangles as a renderer keeps them: a vertex per corner. The last vertex is unused.
/// let positions = [
///     [0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0],
///     [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0],
///     [9.0, 9.0, 9.0],
/// ];
/// let built = MeshBuilder::new()
///     .weld_equal()
///     .drop_unused()
///     .triangles::<f64, _>(&positions, &[0, 1, 2, 3, 4, 5])?;
/// assert_eq!(built.mesh.num_vertices(), 4);
/// let numbers: Vec<_> = built.vertices.iter().map(|v| v.map(|v| v.index())).collect();
/// assert_eq!(numbers, [Some(0), Some(1), Some(2), Some(0), Some(2), Some(3), None]);
/// # Ok::<(), cotan_geometry::MeshError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MeshBuilder {
    welds: bool,
    drops_unused: bool,
    cuts: bool,
}

/// A mesh and the origin of its elements in the buffers.
#[derive(Clone, PartialEq, Debug)]
pub struct BuiltMesh<T: Scalar> {
    /// The mesh.
    pub mesh: Mesh<T>,
    /// For each input position its vertex, or `None` if the position was dropped.
    pub vertices: Vec<Option<VertexId>>,
    /// For each vertex its index in the input; for welded positions the first one, and for copies
    /// that of the vertex.
    pub sources: VertexMap<u32>,
    /// For each triangle the index of the input face that it is part of.
    pub faces: FaceMap<u32>,
}

impl MeshBuilder {
    /// The default options, which take positions and faces unchanged.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Merges all positions whose coordinates are exactly equal (0 equals −0) into one vertex.
    ///
    /// Faces that are left with fewer than three corners are dropped. To weld with a tolerance,
    /// use the repairs in `cotan-io`.
    #[must_use]
    pub fn weld_equal(mut self) -> Self {
        self.welds = true;
        self
    }

    /// Drops vertices that no face uses. Otherwise they are an error.
    #[must_use]
    pub fn drop_unused(mut self) -> Self {
        self.drops_unused = true;
        self
    }

    /// Accepts faces that are not manifold or not consistently oriented, and cuts them into pieces
    /// ([`HalfedgeMesh::from_faces_in_pieces`]). Otherwise they are an error.
    ///
    /// Copies of vertices follow the others. A job that moves vertices gives all copies of a vertex
    /// the same position. For faces that need no cut, nothing changes.
    ///
    /// ```
    /// use cotan_geometry::MeshBuilder;
    /// // Three pages of a book, bound along an edge.
    /// let positions = [[0., 0., 0.], [0., 0., 1.], [1., 0., 0.], [0., 1., 0.], [-1., 0., 0.]];
    /// let indices = [0, 1, 2, 0, 1, 3, 0, 1, 4];
    /// let built = MeshBuilder::new().cut_into_pieces().triangles::<f64, _>(&positions, &indices)?;
    /// assert_eq!(built.mesh.num_vertices(), 5 + 4);
    /// assert_eq!(built.mesh.connectivity().num_rows(), 5);
    /// # Ok::<(), cotan_geometry::MeshError>(())
    /// ```
    #[must_use]
    pub fn cut_into_pieces(mut self) -> Self {
        self.cuts = true;
        self
    }

    /// Builds a mesh from positions and three indices per triangle; see [`Mesh::from_triangles`].
    ///
    /// # Errors
    /// [`MeshError`] if the number of indices is not a multiple of three, the triangles do not
    /// form an oriented 2-manifold, a vertex is unused, or a coordinate is not finite.
    pub fn triangles<T: Scalar, P: Scalar>(
        &self,
        positions: &[[P; 3]],
        indices: &[u32],
    ) -> Result<BuiltMesh<T>, MeshError> {
        let (triangles, rest) = indices.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(MeshError::Indices {
                count: indices.len(),
            });
        }
        self.faces(positions, triangles)
    }

    /// Builds a mesh from positions and polygons; see [`Mesh::from_faces`].
    ///
    /// # Errors
    /// Same as [`MeshBuilder::triangles`].
    pub fn faces<T: Scalar, P: Scalar, F: AsRef<[u32]>>(
        &self,
        positions: &[[P; 3]],
        faces: &[F],
    ) -> Result<BuiltMesh<T>, MeshError> {
        check_faces(positions.len(), faces)?;
        let places = if self.welds {
            first_equal(positions)
        } else {
            (0..positions.len() as u32).collect()
        };
        let mut polygons = Polygons::new(faces, &places);
        if polygons.sources.is_empty() {
            return Err(MeshError::AllCollapsed {
                num_faces: faces.len(),
            });
        }
        let (vertices, sources) = self.number(&places, &polygons.corners)?;

        polygons.renumber(&vertices);
        let list = polygons.list();
        let built = match self.cuts {
            true => HalfedgeMesh::from_faces_in_pieces(sources.len(), &list),
            false => HalfedgeMesh::from_faces(sources.len(), &list),
        };
        let mut connectivity = built.map_err(|error| {
            error.renumbered(
                |v| VertexId::new(sources[v] as usize),
                |face| polygons.sources[face] as usize,
            )
        })?;
        let parents = connectivity
            .triangulate()
            .map_err(|error| polygons.not_cut(&error))?;
        let points = connectivity.to_vertices(positions_of(&sources, positions)?);
        let sources = connectivity.to_vertices(sources);
        Ok(BuiltMesh {
            mesh: Mesh::assume_checked(connectivity, points),
            vertices,
            sources,
            faces: parents.map(|face| polygons.sources[face.index()]),
        })
    }

    /// Assigns a vertex to each distinct position that a corner uses, in input order. Returns the
    /// vertex of each position and the first position of each vertex.
    fn number(
        self,
        places: &[u32],
        corners: &[u32],
    ) -> Result<(Vec<Option<VertexId>>, VertexMap<u32>), MeshError> {
        let mut is_used = vec![false; places.len()];
        for &place in corners {
            is_used[place as usize] = true;
        }
        let mut vertices: Vec<Option<VertexId>> = Vec::with_capacity(places.len());
        let mut sources = VertexMap::default();
        for (input, &place) in places.iter().enumerate() {
            // `place` is at or before this position.
            vertices.push(match vertices.get(place as usize) {
                Some(&first) => first,
                None if is_used[input] => Some(sources.push(input as u32)),
                None if self.drops_unused => None,
                None => return Err(MeshError::Unused { vertex: input }),
            });
        }
        Ok((vertices, sources))
    }
}

/// Faces with welded corners, flattened.
struct Polygons {
    /// For each corner its welded position, and its vertex after [`Polygons::renumber`].
    corners: Vec<u32>,
    /// The first corner of each polygon, followed by the total number of corners.
    starts: Vec<usize>,
    /// For each polygon its input face.
    sources: Vec<u32>,
}

impl Polygons {
    /// Replaces corners by their welded positions, and drops repeated corners and collapsed
    /// polygons.
    fn new<F: AsRef<[u32]>>(faces: &[F], places: &[u32]) -> Self {
        let mut polygons = Self {
            corners: Vec::with_capacity(3 * faces.len()),
            starts: vec![0],
            sources: Vec::with_capacity(faces.len()),
        };
        for (source, face) in faces.iter().enumerate() {
            let face = face.as_ref();
            let start = polygons.corners.len();
            let mut before = face.last();
            for corner in face {
                // A corner that was repeated before welding is an error, which is reported later.
                let is_welded = before.is_some_and(|before| {
                    before != corner && places[*before as usize] == places[*corner as usize]
                });
                if !is_welded {
                    polygons.corners.push(places[*corner as usize]);
                }
                before = Some(corner);
            }
            if polygons.corners.len() < start + 3 {
                polygons.corners.truncate(start);
                continue;
            }
            polygons.starts.push(polygons.corners.len());
            polygons.sources.push(source as u32);
        }
        polygons
    }

    /// Replaces welded positions by vertices.
    fn renumber(&mut self, vertices: &[Option<VertexId>]) {
        for corner in &mut self.corners {
            // The position of every corner has a vertex.
            *corner = vertices[*corner as usize].map_or(0, |v| v.index() as u32);
        }
    }

    /// The corners of each polygon.
    fn list(&self) -> Vec<&[u32]> {
        let bounds = self.starts.windows(2);
        bounds.map(|ends| &self.corners[ends[0]..ends[1]]).collect()
    }

    fn not_cut(&self, error: &EditError) -> MeshError {
        match *error {
            EditError::NoFan { face, degree } => MeshError::NotCut {
                face: self.sources[face.index()] as usize,
                degree,
            },
            _ => MeshError::NotManifold(BuildError::TooLarge {
                elements: "corners",
                count: self.corners.len(),
            }),
        }
    }
}

/// Checks that every face has at least three corners and every corner has a position.
fn check_faces<F: AsRef<[u32]>>(num_vertices: usize, faces: &[F]) -> Result<(), MeshError> {
    if faces.is_empty() {
        return Err(MeshError::NoFaces);
    }
    for (elements, count) in [("vertices", num_vertices), ("faces", faces.len())] {
        if count > MOST {
            return Err(BuildError::TooLarge { elements, count }.into());
        }
    }
    for (face, corners) in faces.iter().enumerate() {
        let corners = corners.as_ref();
        let degree = corners.len();
        if degree < 3 {
            return Err(BuildError::TooFewCorners { face, degree }.into());
        }
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= num_vertices) {
            let vertex = vertex as usize;
            return Err(BuildError::IndexOutOfRange {
                face,
                vertex,
                num_vertices,
            }
            .into());
        }
    }
    Ok(())
}

/// For each position, the first one that is exactly equal.
fn first_equal<P: Scalar>(positions: &[[P; 3]]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(positions.len() / 2);
    let places = positions.iter().enumerate().map(|(input, p)| {
        // Adding 0 turns −0 into 0.
        let bits = p.map(|x| (x.as_f64() + 0.0).to_bits());
        *first.entry(bits).or_insert(input as u32)
    });
    places.collect()
}

fn positions_of<T: Scalar, P: Scalar>(
    sources: &VertexMap<u32>,
    positions: &[[P; 3]],
) -> Result<VertexMap<Point3<T>>, MeshError> {
    let points = sources.map(|&input| {
        let coordinates = positions[input as usize];
        Point3::from(coordinates.map(|x| T::of_f64(x.as_f64())))
    });
    match points
        .iter()
        .find(|(_, p)| p.iter().any(|x| !x.is_finite()))
    {
        Some((v, _)) => Err(MeshError::NonFinite {
            vertex: sources[v] as usize,
        }),
        None => Ok(points),
    }
}

/// The largest number of vertices or faces that a half-edge mesh can hold.
const MOST: usize = (1 << 31) - 2;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing;

    const SQUARE: [[f64; 3]; 4] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];

    fn refused(positions: &[[f64; 3]], faces: &[&[u32]]) -> MeshError {
        let refused = MeshBuilder::new().faces::<f32, _, _>(positions, faces);
        refused.map(|built| built.mesh).unwrap_err()
    }

    #[test]
    fn polygons_are_cut_and_say_where_their_parts_come_from() {
        let positions = [SQUARE.as_slice(), &[[2.0, 0.0, 0.0]]].concat();
        let faces: [&[u32]; 2] = [&[1, 4, 2], &[0, 1, 2, 3]];
        let built = MeshBuilder::new()
            .faces::<f64, _, _>(&positions, &faces)
            .unwrap();
        assert_eq!(built.faces.as_slice(), [0, 1, 1]);
        assert_eq!(built.sources.as_slice(), [0, 1, 2, 3, 4]);
        assert_eq!(built.mesh.surface().area(), 1.5);
    }

    #[test]
    fn bad_input_is_named_by_its_own_numbers() {
        let cut_short = Mesh::<f64>::from_triangles(&SQUARE, &[0, 1]);
        assert_eq!(cut_short, Err(MeshError::Indices { count: 2 }));
        assert_eq!(refused(&SQUARE, &[]), MeshError::NoFaces);
        assert_eq!(refused(&[], &[]), MeshError::NoFaces);
        assert!(matches!(
            refused(&SQUARE, &[&[0, 1]]),
            MeshError::NotManifold(BuildError::TooFewCorners { face: 0, degree: 2 })
        ));
        assert!(matches!(
            refused(&SQUARE, &[&[0, 1, 2], &[0, 2, 7]]),
            MeshError::NotManifold(BuildError::IndexOutOfRange {
                face: 1,
                vertex: 7,
                ..
            })
        ));
        assert!(matches!(
            refused(&SQUARE, &[&[0, 1, 2, 3], &[0, 1, 1]]),
            MeshError::NotManifold(BuildError::RepeatedVertex { face: 1, .. })
        ));
        assert_eq!(
            refused(&SQUARE, &[&[0, 1, 3]]),
            MeshError::Unused { vertex: 2 }
        );
        let mut far = SQUARE;
        far[3][1] = 1e300;
        assert_eq!(
            refused(&far, &[&[0, 1, 2, 3]]),
            MeshError::NonFinite { vertex: 3 }
        );
    }

    #[test]
    fn errors_after_welding_have_the_numbers_of_the_input() {
        // The first two positions are unused; both triangles share the edge from (0, 0) to (1,
        // 0).
        let unused = [[7.0, 7.0, 7.0], [7.0, 7.0, 7.0]];
        let positions = [&unused, SQUARE.as_slice(), SQUARE.as_slice()].concat();
        let builder = MeshBuilder::new().weld_equal().drop_unused();
        let error = builder
            .triangles::<f64, _>(&positions, &[2, 3, 4, 6, 7, 9])
            .unwrap_err();
        let MeshError::NotManifold(BuildError::InconsistentOrientation { vertices, .. }) = error
        else {
            panic!("{error}");
        };
        assert_eq!(vertices.map(|v| v.index()), [2, 3]);
        let all_one = [[1.0, 1.0, -0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        assert_eq!(
            builder
                .triangles::<f64, _>(&all_one, &[0, 1, 2])
                .unwrap_err(),
            MeshError::AllCollapsed { num_faces: 1 }
        );
    }

    #[test]
    fn faces_that_welding_collapses_are_dropped() {
        // A sliver joins corner 2 to its copy; the square loses its duplicate corner.
        let positions = [SQUARE.as_slice(), &[[1.0, 1.0, 0.0]]].concat();
        let faces: [&[u32]; 2] = [&[1, 4, 2], &[0, 1, 2, 4, 3]];
        let built = MeshBuilder::new()
            .weld_equal()
            .faces::<f64, _, _>(&positions, &faces)
            .unwrap();
        assert_eq!(built.mesh.num_vertices(), 4);
        assert_eq!(built.faces.as_slice(), [1, 1]);
        assert_eq!(built.vertices[4], built.vertices[2]);
    }

    proptest! {
        #[test]
        fn a_triangle_soup_is_welded_to_the_mesh_again(mesh in testing::surfaces()) {
            let points = mesh.to_positions::<f64>();
            let soup: Vec<[f64; 3]> =
                mesh.to_triangles().into_iter().map(|v| points[v as usize]).collect();
            let indices: Vec<u32> = (0..soup.len() as u32).collect();
            let built = MeshBuilder::new().weld_equal().triangles::<f64, _>(&soup, &indices).unwrap();
            prop_assert_eq!(built.mesh.num_vertices(), mesh.num_vertices());
            for (input, vertex) in built.vertices.iter().enumerate() {
                let position = built.mesh.positions()[vertex.unwrap()];
                prop_assert_eq!(<[f64; 3]>::from(position), soup[input]);
            }
            for (v, &source) in &built.sources {
                prop_assert_eq!(built.vertices[source as usize], Some(v));
            }
            prop_assert_eq!(built.mesh.connectivity().topology(), mesh.connectivity().topology());
        }
    }
}
