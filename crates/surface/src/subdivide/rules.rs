//! The weights of the new vertices.

use std::f64::consts::TAU;

use cotan_halfedge::{EdgeId, FaceId, HalfedgeMesh, VertexId};

use super::SubdivisionScheme;
use super::stencils::Stencils;

/// The weights of the vertices of the next level: those of the mesh, of its edges, and, unless
/// all faces are triangles that are cut into triangles, of its faces.
pub(super) fn vertices(
    mesh: &HalfedgeMesh,
    scheme: SubdivisionScheme,
    is_crease: &[bool],
) -> Stencils {
    let rules = Rules { mesh, is_crease };
    let mut stencils = Stencils::default();
    for v in mesh.vertices() {
        match (scheme, rules.sharp_edges(v).as_slice()) {
            (SubdivisionScheme::Midpoint, _) => stencils.push([(v.index(), 1.0)]),
            // The cubic B-spline of the line.
            (_, [a, b]) => {
                stencils.push([(v.index(), 0.75), (a.index(), 0.125), (b.index(), 0.125)])
            }
            // Without lines, or at the end of one.
            (SubdivisionScheme::Loop, [] | [_]) => stencils.push(rules.loop_vertex(v)),
            (SubdivisionScheme::CatmullClark, [] | [_]) => {
                stencils.push(rules.catmull_clark_vertex(v));
            }
            _ => stencils.push([(v.index(), 1.0)]),
        }
    }
    for e in mesh.edges() {
        let is_sharp = rules.is_sharp(e);
        match scheme {
            SubdivisionScheme::Loop if !is_sharp => stencils.push(rules.loop_edge(e)),
            SubdivisionScheme::CatmullClark if !is_sharp => {
                stencils.push(rules.catmull_clark_edge(e));
            }
            _ => stencils.push(mesh.edge_vertices(e).map(|v| (v.index(), 0.5))),
        }
    }
    if !keeps_triangles(mesh, scheme) {
        for f in mesh.faces() {
            stencils.push(mean(mesh, f, 1.0));
        }
    }
    stencils
}

/// Returns true if every face is a triangle that is cut into triangles.
pub(super) fn keeps_triangles(mesh: &HalfedgeMesh, scheme: SubdivisionScheme) -> bool {
    scheme != SubdivisionScheme::CatmullClark && mesh.is_triangle_mesh()
}

struct Rules<'a> {
    mesh: &'a HalfedgeMesh,
    is_crease: &'a [bool],
}

impl Rules<'_> {
    fn is_sharp(&self, e: EdgeId) -> bool {
        self.is_crease[e.index()] || self.mesh.is_boundary_edge(e)
    }

    /// The other ends of the sharp edges at `v`.
    fn sharp_edges(&self, v: VertexId) -> Vec<VertexId> {
        let sharp = self
            .mesh
            .outgoing_halfedges(v)
            .filter(|h| self.is_sharp(h.edge()));
        sharp.map(|h| self.mesh.target(h)).collect()
    }

    fn loop_vertex(&self, v: VertexId) -> Vec<(usize, f64)> {
        let n = self.mesh.valence(v);
        let beta = loop_weight(n);
        let ring = self.mesh.one_ring(v).map(|w| (w.index(), beta));
        std::iter::once((v.index(), 1.0 - n as f64 * beta))
            .chain(ring)
            .collect()
    }

    fn loop_edge(&self, e: EdgeId) -> Vec<(usize, f64)> {
        let ends = self.mesh.edge_vertices(e).map(|v| (v.index(), 0.375));
        let opposite = e
            .halfedges()
            .map(|h| (self.mesh.target(self.mesh.next(h)).index(), 0.125));
        ends.into_iter().chain(opposite).collect()
    }

    /// (F + 2R + (n − 3) v) / n, with the mean F of the face points and the mean R of the middles
    /// of the edges.
    fn catmull_clark_vertex(&self, v: VertexId) -> Vec<(usize, f64)> {
        let n = self.mesh.valence(v) as f64;
        // R has v itself by one half.
        let mut terms = vec![(v.index(), (n - 3.0) / n + 1.0 / n)];
        for w in self.mesh.one_ring(v) {
            terms.push((w.index(), 1.0 / (n * n)));
        }
        for f in self.mesh.vertex_faces(v) {
            terms.extend(mean(self.mesh, f, 1.0 / (n * n)));
        }
        merged(terms)
    }

    fn catmull_clark_edge(&self, e: EdgeId) -> Vec<(usize, f64)> {
        let mut terms: Vec<_> = self.mesh.edge_vertices(e).map(|v| (v.index(), 0.25)).into();
        for f in e.halfedges().into_iter().filter_map(|h| self.mesh.face(h)) {
            terms.extend(mean(self.mesh, f, 0.25));
        }
        merged(terms)
    }
}

/// Loop's weight of a neighbour, for n of them.
fn loop_weight(n: usize) -> f64 {
    let n = n as f64;
    (0.625 - (0.375 + 0.25 * (TAU / n).cos()).powi(2)) / n
}

/// `weight` times the mean of the corners of a face.
fn mean(mesh: &HalfedgeMesh, f: FaceId, weight: f64) -> impl Iterator<Item = (usize, f64)> + '_ {
    let weight = weight / mesh.degree(f) as f64;
    mesh.face_vertices(f).map(move |v| (v.index(), weight))
}

fn merged(terms: Vec<(usize, f64)>) -> Vec<(usize, f64)> {
    let mut sum: Vec<(usize, f64)> = Vec::with_capacity(terms.len());
    for (j, w) in terms {
        match sum.iter_mut().find(|(i, _)| *i == j) {
            Some((_, total)) => *total += w,
            None => sum.push((j, w)),
        }
    }
    sum
}
