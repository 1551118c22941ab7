//! Gradients of the energies of triangles, by which rotations are fitted and edges are pulled.
//!
//! ```text
//! g_ij = − Σ_{T at the edge ij} (cot_ij (x⁰_j − x⁰_i) + cot_ik (x⁰_k − x⁰_i))
//! ```
//!
//! with k the third corner of T and cot the cotangent of the angle opposite an edge in T: the
//! gradient at i of the energy of the two triangles at the edge. With them sums over triangles are
//! sums over neighbours:
//!
//! ```text
//! Σ_{T at i} Σ_{e in T} cot_e e e⁰ᵀ = Σ_j (x_j − x_i) g_jiᵀ
//! ```
//!
//! The sum of cot_e |e|² over a triangle is its Dirichlet energy, never negative, whatever the
//! signs of the cotangents: a fit by these sums is safe where one by single edges with negative
//! weights is not. That holds for any three vectors that sum to 0. The triangles may therefore be
//! intrinsic ones, with straight lines in space in place of their edges.

use cotan_geometry::Scalar;
use cotan_halfedge::{HalfedgeId, HalfedgeMap};
use cotan_laplacian::{Graph, IntrinsicTriangulation, OneRings, RowId};
use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::cells::as_f64;
use crate::rest::Rest;

/// g_ij of a rest shape: sums over the triangles of the mesh, or over those of the operator if it
/// has its own.
pub(crate) enum Gradients<'a> {
    /// One per halfedge of the mesh.
    OfMesh {
        rings: &'a OneRings,
        values: HalfedgeMap<Vector3<f64>>,
    },
    /// One per entry of the operator's graph.
    OfTriangles {
        graph: &'a Graph,
        values: Vec<Vector3<f64>>,
        /// The terms between two corners of a triangle that are the same vertex.
        loops: Vec<(usize, Vector3<f64>)>,
    },
}

impl<'a> Gradients<'a> {
    pub(crate) fn new<T: Scalar>(rest: &'a Rest<T>) -> Self {
        match rest.operator().triangles() {
            Some(triangles) => of_triangles(rest, triangles),
            None => Self::OfMesh {
                rings: rest.rings(),
                values: edge_gradients(rest),
            },
        }
    }

    /// g_ij of every entry (i, j), row after row, times a factor.
    pub(crate) fn of_rows(&self, factor: f64) -> Vec<[f64; 3]> {
        match self {
            Self::OfMesh { rings, values } => in_rows(rings, values, factor, |h| h),
            Self::OfTriangles { values, .. } => {
                parallel::filled(values.len(), |k| (values[k] * factor).into())
            }
        }
    }

    /// g_ji of every entry (i, j), row after row, times a factor.
    pub(crate) fn of_neighbours(&self, factor: f64) -> Vec<[f64; 3]> {
        match self {
            Self::OfMesh { rings, values } => in_rows(rings, values, factor, |h| h.twin()),
            Self::OfTriangles { graph, values, .. } => {
                let reverse = graph.reverse();
                parallel::filled(values.len(), |k| {
                    (values[reverse[k] as usize] * factor).into()
                })
            }
        }
    }

    /// −Σ_j g_ji of every row i, times a factor: half the sum of its entries in [`Self::of_rows`]
    /// with this factor, which are given. Two corners of an intrinsic triangle may be the same
    /// vertex; the terms between them are in no entry.
    pub(crate) fn of_own(&self, graph: &Graph, rows: &[[f64; 3]], factor: f64) -> Vec<[f64; 3]> {
        let half = |i: usize| {
            let row = rows[graph.range(i)].iter();
            let sum = row.fold(Vector3::zeros(), |sum, g| sum + Vector3::from(*g));
            (sum * 0.5).into()
        };
        let mut own: Vec<[f64; 3]> = parallel::filled(graph.num_rows(), half);
        if let Self::OfTriangles { loops, .. } = self {
            for (i, lost) in loops {
                // As an entry such a term would count by half, and once more by the turn of its
                // neighbour, which is the vertex itself.
                own[*i] = (Vector3::from(own[*i]) + lost * (1.5 * factor)).into();
            }
        }
        own
    }
}

/// The sums over intrinsic triangles.
fn of_triangles<'a, T: Scalar>(
    rest: &'a Rest<T>,
    triangles: &IntrinsicTriangulation,
) -> Gradients<'a> {
    let (graph, x) = (&**rest.graph(), rest.positions().as_slice());
    let mut values = vec![Vector3::zeros(); graph.num_entries()];
    let mut loops = Vec::new();
    for t in 0..triangles.num_triangles() {
        let (triangle, share) = (triangles.triangle(t), triangles.share(t));
        let cotangents = triangle.opposite_cotangents();
        let corners = triangle.vertices.map(|v| v.index());
        for c in 0..3 {
            let (next, last) = ((c + 1) % 3, (c + 2) % 3);
            let edge = |to: usize| as_f64(x[corners[to]] - x[corners[c]]);
            let pull = edge(next) * cotangents[c] + edge(last) * cotangents[last];
            let gradient = pull * -share;
            for to in [next, last] {
                match entry(graph, corners[c], corners[to]) {
                    Some(k) => values[k] += gradient,
                    None => loops.push((corners[c], gradient)),
                }
            }
        }
    }
    Gradients::OfTriangles {
        graph,
        values,
        loops,
    }
}

/// The entry (i, j) of a graph; `None` for i = j.
fn entry(graph: &Graph, i: usize, j: usize) -> Option<usize> {
    let range = graph.range(i);
    let row = &graph.neighbours()[range.clone()];
    let at = row.binary_search(&RowId::new(j)).ok()?;
    Some(range.start + at)
}

/// g_ij of every halfedge i→j of the mesh.
fn edge_gradients<T: Scalar>(rest: &Rest<T>) -> HalfedgeMap<Vector3<f64>> {
    let (mesh, cotangents) = (rest.mesh(), rest.cotangents());
    let surface = rest.surface();
    let x = surface.positions();
    let edge = |h: HalfedgeId| as_f64(x[mesh.target(h)] - x[mesh.origin(h)]) * cotangents[h];
    let mut out = HalfedgeMap::filled(mesh.num_halfedges(), Vector3::zeros());
    parallel::fill(out.as_mut_slice(), |i| {
        // A boundary halfedge has no triangle, and cotangent 0.
        let h = HalfedgeId::new(i);
        let twin = h.twin();
        let mut sum = edge(twin) - edge(h);
        if !mesh.is_boundary_halfedge(h) {
            sum += edge(mesh.prev(h));
        }
        if !mesh.is_boundary_halfedge(twin) {
            sum -= edge(mesh.next(twin));
        }
        sum
    });
    out
}

/// In the order of the rings, for every halfedge h the value of `of(h)`, times a factor. Where
/// several halfedges lead to a neighbour, the sum.
fn in_rows(
    rings: &OneRings,
    values: &HalfedgeMap<Vector3<f64>>,
    factor: f64,
    of: impl Fn(HalfedgeId) -> HalfedgeId + Sync,
) -> Vec<[f64; 3]> {
    let mut out = vec![[0.0; 3]; rings.graph().num_entries()];
    if rings.is_shared() {
        parallel::fill(&mut out, |k| {
            let values = rings.halfedges_of(k).iter().map(|h| values[of(*h)]);
            (values.sum::<Vector3<f64>>() * factor).into()
        });
    } else {
        let halfedges = rings.halfedges();
        parallel::fill(&mut out, |k| (values[of(halfedges[k])] * factor).into());
    }
    out
}

#[cfg(test)]
mod tests {
    use cotan_geometry::Mesh;
    use cotan_geometry::shapes::{cylinder, icosphere};
    use cotan_laplacian::IntrinsicDelaunay;
    use nalgebra::{Matrix3, Rotation3};

    use super::*;

    /// F(h) = Σ_T Σ_c R_c : Σ_e cot_e h_e e⁰ᵀ over the triangles, with a turn R per vertex.
    fn by_triangles(rest: &Rest<f64>, turns: &[Matrix3<f64>], h: &[Vector3<f64>]) -> f64 {
        let triangles = rest.operator().triangles().unwrap();
        let x = rest.positions().as_slice();
        let mut sum = 0.0;
        for t in 0..triangles.num_triangles() {
            let triangle = triangles.triangle(t);
            let v = triangle.vertices.map(|v| v.index());
            let mut energy = Matrix3::zeros();
            for (k, cotangent) in triangle.opposite_cotangents().into_iter().enumerate() {
                let [a, b] = [v[k], v[(k + 1) % 3]];
                energy += (h[b] - h[a]) * (x[b] - x[a]).transpose() * cotangent;
            }
            sum += triangles.share(t) * v.iter().map(|v| turns[*v].dot(&energy)).sum::<f64>();
        }
        sum
    }

    fn check(shape: &Mesh<f64>) -> bool {
        let scheme = IntrinsicDelaunay::default();
        let rest = Rest::new(shape.connectivity(), shape.positions(), scheme).unwrap();
        let gradients = Gradients::new(&rest);
        let graph = rest.graph();
        let [fit, pull] = [gradients.of_neighbours(1.0), gradients.of_rows(1.0)];
        let own = gradients.of_own(graph, &pull, 1.0);
        let n = graph.num_rows();
        let turns: Vec<Matrix3<f64>> = (0..n)
            .map(|i| Rotation3::new(Vector3::new(0.3, -0.1, 0.01) * i as f64).into_inner())
            .collect();
        let h: Vec<Vector3<f64>> = (0..n)
            .map(|i| Vector3::new((i as f64).sin(), (2.0 * i as f64).cos(), 0.1 * i as f64))
            .collect();
        let (mut by_fit, mut by_pull) = (0.0, 0.0);
        for i in 0..n {
            let mut force = turns[i] * Vector3::from(own[i]);
            for (j, k) in graph.row(i) {
                let edge = h[j.index()] - h[i];
                by_fit += edge.dot(&(turns[i] * Vector3::from(fit[k])));
                force += turns[j.index()] * Vector3::from(pull[k]);
            }
            by_pull += h[i].dot(&force);
        }
        let expected = by_triangles(&rest, &turns, &h);
        assert!((by_fit - expected).abs() < 1e-10 * expected.abs());
        assert!((by_pull - expected).abs() < 1e-10 * expected.abs());
        matches!(gradients, Gradients::OfTriangles { loops, .. } if !loops.is_empty())
    }

    /// Tetrahedra in a row: the shortest way around the tube returns to its vertex.
    fn tube() -> Mesh<f64> {
        let n = 8_u32;
        let at = |k: u32| {
            let angle = f64::from(k) * 2.1;
            [angle.cos(), angle.sin(), 20.0 * f64::from(k)]
        };
        let positions: Vec<[f64; 3]> = (0..n).map(at).collect();
        let mut corners = vec![1, 0, 2, n - 3, n - 2, n - 1];
        for k in 0..n - 3 {
            corners.extend([k + 2, k, k + 3, k, k + 1, k + 3]);
        }
        Mesh::from_triangles(&positions, &corners).unwrap()
    }

    /// Fits and pulls are sums of the same energy, whatever the triangles.
    #[test]
    fn fits_and_pulls_are_those_of_the_intrinsic_triangles() {
        assert!(!check(&icosphere(2)));
        assert!(!check(&cylinder(0.05, 8.0, 6, 1)));
        assert!(check(&tube()), "an edge returns to its vertex");
    }
}
