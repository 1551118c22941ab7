//! The pieces of a surface as bodies: which side is inside, and what they enclose.

use cotan_geometry::Scalar;
use cotan_halfedge::Components;
use nalgebra::Vector3;

use crate::rest::Rest;

/// The pieces and what they enclose at rest. A piece is a connected component, unless the mesh was
/// cut; one that was cut from a one-sided surface encloses nothing.
#[derive(Debug)]
pub(super) struct Bodies {
    pieces: Components,
    of_piece: Vec<Body>,
    /// Per row whether its copies belong to several pieces; empty if no vertex has copies.
    is_between: Vec<bool>,
}

/// One piece.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Body {
    /// The row of the lowest vertex.
    pub(super) first: usize,
    pub(super) is_open: bool,
    /// Signed, in box units: of an open piece, that of the cone over it from the centroid of
    /// the surface.
    pub(super) volume: f64,
    pub(super) area: f64,
}

impl Bodies {
    pub(super) fn new<T: Scalar>(rest: &Rest<T>) -> Self {
        let mesh = rest.mesh();
        let pieces = mesh.pieces();
        let surface = rest.surface();
        let mut of_piece = vec![Body::default(); pieces.count()];
        for v in mesh.vertices().rev() {
            let body = &mut of_piece[pieces.of(v)];
            body.first = mesh.row_of(v).index();
            body.is_open |= mesh.is_boundary_vertex(v);
        }
        // Areas and centroids first, then the cones over the faces.
        let corners_of = |f| mesh.triangle(f).map(|v| surface.position(v).map(T::as_f64));
        let mut moments = vec![Vector3::zeros(); pieces.count()];
        for f in mesh.faces() {
            let of = pieces.of(mesh.triangle(f)[0]);
            let [a, b, c] = corners_of(f);
            let area = 0.5 * (b - a).cross(&(c - a)).norm();
            of_piece[of].area += area;
            moments[of] += (a.coords + b.coords + c.coords) * (area / 3.0);
        }
        for f in mesh.faces() {
            let body = &mut of_piece[pieces.of(mesh.triangle(f)[0])];
            let apex = moments[pieces.of(mesh.triangle(f)[0])] / body.area;
            let [a, b, c] = corners_of(f).map(|p| p.coords - apex);
            body.volume += a.dot(&b.cross(&c)) / 6.0;
        }
        for piece in one_sided(rest, &pieces) {
            of_piece[piece].is_open = true;
            of_piece[piece].volume = 0.0;
        }
        let mut is_between = Vec::new();
        if mesh.has_copies() {
            is_between.resize(mesh.num_rows(), false);
            for (copy, row) in mesh.copies() {
                is_between[row.index()] |= pieces.of(copy) != pieces.of(row);
            }
        }
        Self {
            pieces,
            of_piece,
            is_between,
        }
    }

    /// The piece of vertex `v`.
    pub(super) fn of(&self, v: usize) -> u32 {
        self.pieces.of_vertices().as_slice()[v]
    }

    pub(super) fn all(&self) -> &[Body] {
        &self.of_piece
    }

    /// By what the normal at row `i` is to be multiplied to point outwards: 1, or −1 on a body
    /// that is inside out, or 0 where there is no inside or the row belongs to several bodies.
    pub(super) fn outwards(&self, i: usize) -> f64 {
        if self.is_between.get(i) == Some(&true) {
            return 0.0;
        }
        let volume = self.of_piece[self.of(i) as usize].volume;
        if volume > 0.0 {
            1.0
        } else if volume < 0.0 {
            -1.0
        } else {
            0.0
        }
    }
}

/// The pieces that were cut from one-sided surfaces: somewhere their two faces at an edge of the
/// original run along it in the same direction.
fn one_sided<T: Scalar>(rest: &Rest<T>, pieces: &Components) -> Vec<usize> {
    let (mesh, rings) = (rest.mesh(), rest.rings());
    if !rings.is_shared() {
        return Vec::new();
    }
    let piece = |k: usize| match rings.halfedges_of(k) {
        [a, b] if [a, b].iter().all(|h| !mesh.is_boundary_halfedge(**h)) => {
            let twins = [a, b].map(|h| h.twin());
            let is_cut = twins.iter().all(|h| mesh.is_boundary_halfedge(*h));
            let [of_a, of_b] = [a, b].map(|h| pieces.of(mesh.origin(*h)));
            (is_cut && of_a == of_b).then_some(of_a)
        }
        _ => None,
    };
    (0..rest.graph().num_entries()).filter_map(piece).collect()
}
