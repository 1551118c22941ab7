//! Subdivision: every face is cut into smaller ones, and the shape becomes smoother.
//!
//! - Loop (triangles to four triangles): C. Loop, "Smooth subdivision surfaces based on
//!   triangles", 1987; creases by H. Hoppe et al., "Piecewise smooth surface reconstruction",
//!   SIGGRAPH 1994.
//! - Catmull and Clark (a polygon of n corners to n quadrilaterals): "Recursively generated
//!   B-spline surfaces on arbitrary topological meshes", 1978.
//! - Midpoint: the same surface with more faces.

mod rules;
mod stencils;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{EdgeId, FaceId, FaceMap, HalfedgeId, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::{Point3, Vector3};

pub use stencils::Stencils;

use crate::tessellation_error::TessellationError;

/// The rules of subdivision.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum SubdivisionScheme {
    /// Loop's scheme, for triangles.
    #[default]
    Loop,
    /// The scheme of Catmull and Clark, for polygons. All new faces are quadrilaterals.
    CatmullClark,
    /// New vertices in the middle of edges; the shape stays. Triangles are cut into four
    /// triangles. In a mesh with other polygons, every face is cut into quadrilaterals.
    Midpoint,
}

/// The settings of [`subdivide`].
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct SubdivideOptions {
    /// The rules.
    pub scheme: SubdivisionScheme,
    /// The number of times that every face is cut.
    pub levels: usize,
    /// Edges that stay sharp. The boundary always does.
    pub creases: Vec<EdgeId>,
    /// The maximum memory that the work is predicted to take, in bytes; `None` for no limit.
    pub max_memory: Option<u64>,
}

impl SubdivideOptions {
    /// One level of a scheme.
    pub fn new(scheme: SubdivisionScheme) -> Self {
        Self {
            scheme,
            levels: 1,
            creases: Vec::new(),
            max_memory: None,
        }
    }

    /// Sets the number of levels.
    #[must_use]
    pub fn levels(mut self, levels: usize) -> Self {
        self.levels = levels;
        self
    }

    /// Sets the edges that stay sharp.
    #[must_use]
    pub fn creases(mut self, creases: impl IntoIterator<Item = EdgeId>) -> Self {
        self.creases = creases.into_iter().collect();
        self
    }

    /// Sets the maximum memory, in bytes.
    #[must_use]
    pub fn max_memory(mut self, bytes: Option<u64>) -> Self {
        self.max_memory = bytes;
        self
    }
}

/// The result of [`subdivide`].
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Subdivided<T: Scalar> {
    /// The connectivity. The vertices of the original keep their indices.
    pub connectivity: HalfedgeMesh,
    /// The positions.
    pub positions: Positions<T>,
    /// Per face: the face of the original that it is a part of.
    pub parents: FaceMap<FaceId>,
    /// Per corner, face by face in the order of [`HalfedgeMesh::face_vertices`]: its weights of
    /// the corners of the parent. They interpolate what belongs to corners, such as texture
    /// coordinates with seams.
    pub corners: Stencils,
    /// Per level: the weights of the new vertices.
    levels: Vec<Stencils>,
}

impl<T: Scalar> Subdivided<T> {
    /// The values at the new vertices of a quantity per original vertex, by the weights of the
    /// positions.
    pub fn interpolated<S: Scalar>(&self, values: &VertexMap<S>) -> VertexMap<S> {
        let mut current: Vec<S> = values.as_slice().to_vec();
        for level in &self.levels {
            current = level.apply(&current);
        }
        VertexMap::from_vec(current)
    }
}

/// Subdivides a polygon mesh.
///
/// **Shapes**: one position per vertex. Boundaries and creases follow the cubic B-spline of their
/// own vertices; where more than two creases meet, the vertex stays.
///
/// # Errors
/// [`TessellationError`] if a face has more than three corners with Loop's scheme, a crease is
/// not an edge of the mesh, or the result would be too large.
///
/// ```
/// use cotan_surface::{SubdivideOptions, SubdivisionScheme, subdivide};
/// let shape = cotan_geometry::tetrahedron::<f64>();
/// let options = SubdivideOptions::new(SubdivisionScheme::CatmullClark).levels(2);
/// let smooth = subdivide(shape.connectivity(), shape.positions(), &options)?;
/// assert_eq!(smooth.connectivity.num_faces(), 4 * 3 * 4);
/// # Ok::<(), cotan_surface::TessellationError>(())
/// ```
pub fn subdivide<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<T>,
    options: &SubdivideOptions,
) -> Result<Subdivided<T>, TessellationError> {
    check(mesh, positions, options)?;
    let mut is_crease = vec![false; mesh.num_edges()];
    for &e in &options.creases {
        match is_crease.get_mut(e.index()) {
            Some(mark) => *mark = true,
            None => {
                return Err(TessellationError::Length {
                    name: "creases",
                    entries: e.index() + 1,
                    elements: mesh.num_edges(),
                });
            }
        }
    }
    let mut result = Subdivided {
        connectivity: mesh.clone(),
        positions: positions.clone(),
        parents: mesh.faces().collect(),
        corners: Stencils::identity_of_faces(mesh),
        levels: Vec::new(),
    };
    for _ in 0..options.levels {
        is_crease = result.cut(options.scheme, &is_crease)?;
    }
    Ok(result)
}

impl<T: Scalar> Subdivided<T> {
    /// Cuts every face once. Returns the creases of the new edges.
    fn cut(
        &mut self,
        scheme: SubdivisionScheme,
        is_crease: &[bool],
    ) -> Result<Vec<bool>, TessellationError> {
        let mesh = &self.connectivity;
        let stencils = rules::vertices(mesh, scheme, is_crease);
        let cut = Cut::of(mesh, scheme);
        let connectivity = HalfedgeMesh::from_faces(stencils.len(), &cut.faces)?;
        // The part of a line that is exactly straight stays at its position.
        let coords: Vec<Vector3<T>> = self.positions.values().map(|p| p.coords).collect();
        let positions = stencils.apply_vectors(&coords);

        let mut crease = vec![false; connectivity.num_edges()];
        for e in mesh.edges().filter(|e| is_crease[e.index()]) {
            let middle = edge_vertex(mesh, e);
            for end in mesh.edge_vertices(e) {
                if let Some(h) = connectivity.halfedge_between(end, middle) {
                    crease[h.edge().index()] = true;
                }
            }
        }
        self.corners = self.corners.refined(mesh, &cut.corners);
        self.parents = cut.parents.iter().map(|&f| self.parents[f]).collect();
        self.positions = positions.into_iter().map(Point3::from).collect();
        self.connectivity = connectivity;
        self.levels.push(stencils);
        Ok(crease)
    }
}

/// The new vertex of an edge. The vertices of the mesh come first, then those of edges, then
/// those of faces.
fn edge_vertex(mesh: &HalfedgeMesh, edge: EdgeId) -> VertexId {
    VertexId::new(mesh.num_vertices() + edge.index())
}

fn face_vertex(mesh: &HalfedgeMesh, face: FaceId) -> VertexId {
    VertexId::new(mesh.num_vertices() + mesh.num_edges() + face.index())
}

/// A new corner within its parent face.
#[derive(Clone, Copy, Debug)]
enum InParent {
    /// At corner k.
    Corner(usize),
    /// In the middle of the edge from corner k to the next.
    Edge(usize),
    /// In the middle of the face.
    Center,
}

/// The new faces of one cut.
struct Cut {
    faces: Vec<Vec<u32>>,
    parents: Vec<FaceId>,
    corners: Vec<(FaceId, InParent)>,
}

impl Cut {
    fn of(mesh: &HalfedgeMesh, scheme: SubdivisionScheme) -> Self {
        let mut cut = Self {
            faces: Vec::new(),
            parents: Vec::new(),
            corners: Vec::new(),
        };
        let keeps_triangles = rules::keeps_triangles(mesh, scheme);
        for face in mesh.faces() {
            let sides: Vec<HalfedgeId> = mesh.face_halfedges(face).collect();
            let n = sides.len();
            if keeps_triangles {
                for k in 0..3 {
                    let places = [
                        InParent::Corner(k),
                        InParent::Edge(k),
                        InParent::Edge((k + 2) % 3),
                    ];
                    cut.push(mesh, face, &sides, &places);
                }
                cut.push(mesh, face, &sides, &[0, 1, 2].map(InParent::Edge));
            } else {
                for k in 0..n {
                    let before = InParent::Edge((k + n - 1) % n);
                    let places = [
                        InParent::Corner(k),
                        InParent::Edge(k),
                        InParent::Center,
                        before,
                    ];
                    cut.push(mesh, face, &sides, &places);
                }
            }
        }
        cut
    }

    fn push(
        &mut self,
        mesh: &HalfedgeMesh,
        face: FaceId,
        sides: &[HalfedgeId],
        places: &[InParent],
    ) {
        let vertex = |place: &InParent| match *place {
            InParent::Corner(k) => mesh.origin(sides[k]),
            InParent::Edge(k) => edge_vertex(mesh, sides[k].edge()),
            InParent::Center => face_vertex(mesh, face),
        };
        self.faces
            .push(places.iter().map(|p| vertex(p).index() as u32).collect());
        self.parents.push(face);
        self.corners
            .extend(places.iter().map(|&place| (face, place)));
    }
}

fn check<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<T>,
    options: &SubdivideOptions,
) -> Result<(), TessellationError> {
    if positions.len() != mesh.num_vertices() {
        return Err(TessellationError::Length {
            name: "positions",
            entries: positions.len(),
            elements: mesh.num_vertices(),
        });
    }
    if options.scheme == SubdivisionScheme::Loop
        && let Some(face) = mesh.faces().find(|&f| mesh.degree(f) != 3)
    {
        return Err(TessellationError::NotTriangles { face: face.index() });
    }
    // Every corner becomes at most four faces of the next level's corners.
    let corners: u64 = mesh.faces().map(|f| mesh.degree(f) as u64).sum();
    let growth = 4_u64
        .checked_pow(options.levels.min(63) as u32)
        .unwrap_or(u64::MAX);
    let predicted = corners.saturating_mul(growth);
    let most = options
        .max_memory
        .map_or(u64::MAX, |bytes| bytes / BYTES_PER_CORNER);
    if options.levels > 0 && predicted > most.min(u64::from(u32::MAX) / 4) {
        let faces = predicted / 3;
        return Err(TessellationError::TooLarge { faces });
    }
    Ok(())
}

/// Bytes per corner of the result at the peak: connectivity, faces as lists, and weights.
const BYTES_PER_CORNER: u64 = 250;

#[cfg(test)]
mod tests;
