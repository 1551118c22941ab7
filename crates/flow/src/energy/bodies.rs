//! The bodies of a surface: which side of it is inside, and what they enclose.

use cotan_geometry::Scalar;
use cotan_halfedge::{Components, HalfedgeId, HalfedgeMesh, VertexId};
use cotan_laplacian::Fans;
use nalgebra::Vector3;

use crate::rest::Rest;

/// The bodies and what they enclose at rest.
///
/// A body is a piece, and unless the mesh was cut, that is a connected component. Where it was cut,
/// pieces are one body if they continue each other: across an edge of the rows that has two faces,
/// one of each piece. A surface deforms alike wherever it was cut. A body of which some piece would
/// have to be turned to continue itself is one-sided and encloses nothing.
#[derive(Debug)]
pub(super) struct Bodies {
    pieces: Components,
    of_piece: Vec<u32>,
    /// Per piece, whether its faces run against those of the body's first one; empty if none do.
    is_reversed: Vec<bool>,
    bodies: Vec<Body>,
    /// Per row whether its copies belong to several bodies; empty if no vertex has copies.
    is_between: Vec<bool>,
}

/// One body.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Body {
    /// The row of the lowest vertex.
    pub(super) first: usize,
    pub(super) is_open: bool,
    /// Signed, in box units: of an open body, that of the cone over it from the centroid of
    /// the surface.
    pub(super) volume: f64,
    pub(super) area: f64,
}

impl Bodies {
    pub(super) fn new<T: Scalar>(rest: &Rest<T>) -> Self {
        let mesh = rest.mesh();
        let pieces = mesh.pieces();
        let seams = Seams::new(rest, &pieces);
        let surface = rest.surface();
        let mut bodies = vec![Body::default(); seams.num_bodies];
        let body_of = |v: VertexId| seams.of_piece[pieces.of(v)] as usize;
        for v in mesh.vertices().rev() {
            bodies[body_of(v)].first = mesh.row_of(v).index();
        }
        // Areas and centroids first, then the cones over the faces.
        let corners_of = |f| mesh.triangle(f).map(|v| surface.position(v).map(T::as_f64));
        let mut moments = vec![Vector3::zeros(); bodies.len()];
        for f in mesh.faces() {
            let of = body_of(mesh.triangle(f)[0]);
            let [a, b, c] = corners_of(f);
            let area = 0.5 * (b - a).cross(&(c - a)).norm();
            bodies[of].area += area;
            moments[of] += (a.coords + b.coords + c.coords) * (area / 3.0);
        }
        for f in mesh.faces() {
            let corner = mesh.triangle(f)[0];
            let of = body_of(corner);
            let apex = moments[of] / bodies[of].area;
            let [a, b, c] = corners_of(f).map(|p| p.coords - apex);
            let cone = a.dot(&b.cross(&c)) / 6.0;
            match seams.is_reversed.get(pieces.of(corner)) {
                Some(true) => bodies[of].volume -= cone,
                _ => bodies[of].volume += cone,
            }
        }
        for h in mesh.halfedges().filter(|h| mesh.is_boundary_halfedge(*h)) {
            if !seams.is_sewn(h) {
                bodies[body_of(mesh.origin(h))].is_open = true;
            }
        }
        for body in &seams.one_sided {
            bodies[*body as usize].is_open = true;
            bodies[*body as usize].volume = 0.0;
        }
        let mut is_between = Vec::new();
        if mesh.has_copies() {
            is_between.resize(mesh.num_rows(), false);
            for (copy, row) in mesh.copies() {
                is_between[row.index()] |= body_of(copy) != body_of(row);
            }
        }
        let Seams {
            of_piece,
            is_reversed,
            ..
        } = seams;
        Self {
            pieces,
            of_piece,
            is_reversed,
            bodies,
            is_between,
        }
    }

    fn piece(&self, v: usize) -> usize {
        self.pieces.of_vertices().as_slice()[v] as usize
    }

    /// The body of vertex `v`.
    pub(super) fn of(&self, v: usize) -> u32 {
        self.of_piece[self.piece(v)]
    }

    pub(super) fn all(&self) -> &[Body] {
        &self.bodies
    }

    /// Returns true if the faces at vertex `v` run against those of the first piece of its body.
    pub(super) fn is_reversed(&self, v: usize) -> bool {
        !self.is_reversed.is_empty() && self.is_reversed[self.piece(v)]
    }

    /// By what the normals of the faces at vertex `v` are to be multiplied to point outwards: 1, or
    /// −1 on a body that is inside out, or 0 where there is no inside.
    pub(super) fn outwards(&self, v: usize) -> f64 {
        let volume = self.bodies[self.of(v) as usize].volume;
        let volume = if self.is_reversed(v) { -volume } else { volume };
        if volume > 0.0 {
            1.0
        } else if volume < 0.0 {
            -1.0
        } else {
            0.0
        }
    }

    /// The normal that points out of the body at row `i`; `None` where there is no inside, or the
    /// row belongs to several bodies.
    pub(super) fn outward_normal<T: Scalar>(
        &self,
        rest: &Rest<T>,
        i: usize,
    ) -> Option<Vector3<f64>> {
        if self.is_between.get(i) == Some(&true) {
            return None;
        }
        let outwards = self.outwards(i);
        let fans: &Fans = rest.fans();
        let normal = match self.is_reversed.is_empty() {
            true => rest.normals().as_slice()[i].map(T::as_f64) * outwards,
            false => {
                let at = |v: usize| fans.area_vector(rest.positions(), v, i) * self.outwards(v);
                let copies = fans.copies_of(i).iter();
                let sum = copies.fold(at(i), |sum, copy| sum + at(*copy as usize));
                sum.try_normalize(0.0).unwrap_or_default()
            }
        };
        (normal != Vector3::zeros()).then_some(normal)
    }
}

/// The edges at which pieces of a mesh that was cut continue each other.
struct Seams {
    /// Per piece its body, numbered by their first pieces.
    of_piece: Vec<u32>,
    num_bodies: usize,
    /// As in [`Bodies`].
    is_reversed: Vec<bool>,
    one_sided: Vec<u32>,
    /// Per edge whether its rim is continued by another; empty if the mesh has no copies.
    sewn: Vec<bool>,
}

impl Seams {
    fn new<T: Scalar>(rest: &Rest<T>, pieces: &Components) -> Self {
        let (mesh, rings) = (rest.mesh(), rest.rings());
        let mut tree = Tree::new(pieces.count());
        let mut sewn = Vec::new();
        if rings.is_shared() {
            sewn.resize(mesh.num_edges(), false);
            for k in 0..rings.graph().num_entries() {
                let [a, b] = *rings.halfedges_of(k) else {
                    continue;
                };
                let (Some(along_a), Some(along_b)) = (side(mesh, a), side(mesh, b)) else {
                    continue;
                };
                for h in [a, b] {
                    sewn[h.edge().index()] = true;
                }
                let [of_a, of_b] = [a, b].map(|h| pieces.of(mesh.origin(h)));
                tree.join(of_a, of_b, along_a == along_b);
            }
        }
        let mut of_piece: Vec<u32> = Vec::with_capacity(pieces.count());
        let mut is_reversed = Vec::with_capacity(pieces.count());
        let mut num_bodies = 0;
        let mut one_sided = Vec::new();
        for piece in 0..pieces.count() {
            let (root, is_against) = tree.root(piece);
            is_reversed.push(is_against);
            // The root is the first piece of its body.
            of_piece.push(match root == piece {
                true => {
                    num_bodies += 1;
                    num_bodies as u32 - 1
                }
                false => of_piece[root],
            });
            if root == piece && tree.is_one_sided[root] {
                one_sided.push(of_piece[piece]);
            }
        }
        if !is_reversed.contains(&true) {
            is_reversed.clear();
        }
        Self {
            of_piece,
            num_bodies,
            is_reversed,
            one_sided,
            sewn,
        }
    }

    fn is_sewn(&self, h: HalfedgeId) -> bool {
        self.sewn.get(h.edge().index()) == Some(&true)
    }
}

/// True if the only face at the edge of a halfedge is on its side; `None` where there are two.
fn side(mesh: &HalfedgeMesh, h: HalfedgeId) -> Option<bool> {
    match [h, h.twin()].map(|h| mesh.is_boundary_halfedge(h)) {
        [false, true] => Some(true),
        [true, false] => Some(false),
        _ => None,
    }
}

/// Disjoint sets of pieces, each with its direction against the lowest one of its set.
struct Tree {
    parent: Vec<(usize, bool)>,
    /// Per root.
    is_one_sided: Vec<bool>,
}

impl Tree {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count).map(|piece| (piece, false)).collect(),
            is_one_sided: vec![false; count],
        }
    }

    /// The lowest piece of a set, and whether this one runs against it.
    fn root(&mut self, piece: usize) -> (usize, bool) {
        let (mut root, mut is_against) = (piece, false);
        while self.parent[root].0 != root {
            let (above, is_turned) = self.parent[root];
            // Halves the path.
            let (top, is_turned_again) = self.parent[above];
            self.parent[root] = (top, is_turned != is_turned_again);
            is_against ^= self.parent[root].1;
            root = top;
        }
        (root, is_against)
    }

    /// Joins two sets; `against` if one piece runs against the other.
    fn join(&mut self, a: usize, b: usize, against: bool) {
        let ((a, turned_a), (b, turned_b)) = (self.root(a), self.root(b));
        let is_against = against != (turned_a != turned_b);
        if a == b {
            self.is_one_sided[a] |= is_against;
            return;
        }
        let (low, high) = (a.min(b), a.max(b));
        self.parent[high] = (low, is_against);
        self.is_one_sided[low] |= self.is_one_sided[high];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_add_up_along_a_tree() {
        let mut tree = Tree::new(5);
        tree.join(3, 4, true);
        tree.join(1, 3, false);
        tree.join(4, 0, true);
        assert_eq!(tree.root(4), (0, true));
        assert_eq!(tree.root(3), (0, false));
        assert_eq!(tree.root(1), (0, false));
        assert_eq!(tree.root(2), (2, false));
        tree.join(1, 4, true);
        assert!(!tree.is_one_sided[0]);
        tree.join(1, 0, true);
        assert!(tree.is_one_sided[0]);
    }
}
