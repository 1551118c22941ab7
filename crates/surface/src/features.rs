//! The lines of a surface that decimation and remeshing keep: its boundary, creases by their
//! dihedral angle, and marked edges.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{EdgeId, EdgeMap};

use crate::tessellation_error::TessellationError;
use crate::triangles::{NONE, Triangles, prev};

/// The lines that are kept in addition to the boundary.
#[derive(Clone, PartialEq, Debug, Default)]
#[non_exhaustive]
pub struct Features {
    /// The smallest angle between the normals of two triangles at which their edge is a crease,
    /// in radians; `None` keeps no creases.
    pub angle: Option<f64>,
    /// Edges that are kept in any case, such as seams of texture coordinates or borders between
    /// materials.
    pub edges: Vec<EdgeId>,
}

impl Features {
    /// Only the boundary.
    pub fn none() -> Self {
        Self::default()
    }

    /// The boundary, and creases of at least `angle`, in radians.
    pub fn creases(angle: f64) -> Self {
        Self {
            angle: Some(angle),
            ..Self::default()
        }
    }

    /// Adds marked edges.
    #[must_use]
    pub fn with_edges(mut self, edges: impl IntoIterator<Item = EdgeId>) -> Self {
        self.edges.extend(edges);
        self
    }

    /// Tags the edges of `triangles` that are kept (including those of the boundary) with their
    /// own halfedge.
    pub(crate) fn tag<T: Scalar>(
        &self,
        surface: &Surface<'_, T>,
        triangles: &mut Triangles,
    ) -> Result<(), TessellationError> {
        let mesh = surface.mesh();
        if let Some(angle) = self.angle
            && !(angle >= 0.0)
        {
            return Err(TessellationError::Option {
                option: "the angle of creases",
                expected: "a number of at least 0",
                value: angle,
            });
        }
        let mut is_marked = EdgeMap::filled(mesh.num_edges(), false);
        for &e in &self.edges {
            match is_marked.get_mut(e) {
                Some(mark) => *mark = true,
                None => {
                    return Err(TessellationError::Length {
                        name: "marked edges",
                        entries: e.index() + 1,
                        elements: mesh.num_edges(),
                    });
                }
            }
        }
        let corner_edges: Vec<EdgeId> = mesh
            .faces()
            .flat_map(|f| mesh.face_halfedges(f).map(|h| h.edge()))
            .collect();
        let tags = cotan_parallel::filled(triangles.origin.len(), |i| {
            let h = i as u32;
            let is_kept = triangles.twin(h) == NONE
                || is_marked[corner_edges[i]]
                || self
                    .angle
                    .is_some_and(|angle| is_crease(triangles, h, angle));
            if is_kept { triangles.edge_of(h) } else { NONE }
        });
        triangles.tag = tags;
        Ok(())
    }
}

/// The freedom of a vertex to move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Place {
    /// On no line.
    Free,
    /// On a line that passes.
    Line,
    /// A vertex at which a line ends, bends or branches.
    Corner,
}

/// The place of every vertex. A line that turns by more than `bend` has a corner there.
pub(crate) fn places(triangles: &Triangles, bend: f64) -> Vec<Place> {
    cotan_parallel::filled(triangles.points.len(), |v| place(triangles, v as u32, bend))
}

fn place(triangles: &Triangles, v: u32, bend: f64) -> Place {
    if !triangles.has_vertex(v) {
        return Place::Corner;
    }
    let mut directions = [nalgebra::Vector3::zeros(); 2];
    let mut count = 0;
    for h in triangles.edges_at(v) {
        if triangles.tag(h) != NONE {
            if count < 2 {
                let other = triangles.origin(h) + triangles.target(h) - v;
                directions[count] = triangles.point(other) - triangles.point(v);
            }
            count += 1;
        }
    }
    match count {
        0 => Place::Free,
        2 if directions[0].angle(&-directions[1]) <= bend => Place::Line,
        _ => Place::Corner,
    }
}

fn is_crease(triangles: &Triangles, h: u32, angle: f64) -> bool {
    let t = triangles.twin(h);
    if t == NONE {
        return true;
    }
    let (m, n) = (triangles.area_vector(h / 3), triangles.area_vector(t / 3));
    // A triangle without area has no direction; `angle` gives 0 or a right angle for it.
    let has_area = |n: &nalgebra::Vector3<f64>, h: u32| {
        n.norm() > 1e-6 * triangles.length(h).max(triangles.length(prev(h))).powi(2)
    };
    has_area(&m, h) && has_area(&n, t) && m.angle(&n) >= angle
}
