//! Intrinsic triangulations: triangles given by edge lengths, and their Delaunay flips.
//!
//! The surface of a mesh has many triangulations on the same vertices whose edges are straight
//! lines *on the surface*, across the edges of the mesh. One of them is Delaunay: the cotangent
//! weights of its edges are never negative. Only lengths are needed to find it: an edge whose
//! opposite angles add up to more than 180° is replaced by the other diagonal of its two triangles,
//! unfolded into the plane, until no such edge is left.
//!
//! Two triangles may then share more than one edge, and an edge may start and end at the same
//! vertex (a Δ-complex), so a half-edge mesh cannot hold the result.
//!
//! A boundary edge has no second diagonal, and its weight is negative if the opposite angle is
//! above 90°. A component with a boundary is therefore glued to a mirrored copy of itself along the
//! boundary, which makes it closed, and both copies count one half. On functions that are equal on
//! both copies this is the Laplacian with a zero normal derivative at the boundary.
//!
//! **Source**: Fisher, Springborn, Schröder, Bobenko 2006, An algorithm for the construction of
//! intrinsic Delaunay triangulations with applications to digital geometry processing; lengths are
//! mollified as in Sharp and Crane 2020, A Laplacian for nonmanifold triangle meshes, section 4.5.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{FaceId, HalfedgeId, HalfedgeMesh, VertexId};
use cotan_parallel::Chunks;
use nalgebra::Vector2;

/// A triangulation of a surface by edge lengths, in double precision.
///
/// ```
/// use cotan_geometry::icosphere;
/// use cotan_laplacian::{IntrinsicTriangulation, MOLLIFICATION};
///
/// let ball = icosphere::<f64>(3);
/// let mut triangulation = IntrinsicTriangulation::new(&ball.surface(), MOLLIFICATION);
/// triangulation.flip_to_delaunay();
/// assert_eq!(triangulation.num_triangles(), ball.num_faces());
/// assert!(triangulation.is_delaunay());
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct IntrinsicTriangulation {
    num_vertices: usize,
    /// Three sides per triangle; side 3 t + k runs from corner k of triangle t to corner k + 1.
    sides: Vec<Side>,
    /// For each face of the mesh whether there is a mirrored copy of it.
    is_mirrored: Vec<bool>,
    /// The length that was added to every edge.
    added: f64,
}

/// A directed side of a triangle.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Side {
    /// The vertex at which the side begins.
    origin: u32,
    /// The same edge as a side of the triangle beyond.
    twin: u32,
    length: f64,
    /// The halfedge of the mesh, or `NONE` if the edge was flipped.
    halfedge: u32,
}

const NONE: u32 = u32::MAX;

/// A triangle of an [`IntrinsicTriangulation`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct IntrinsicTriangle {
    /// The corners, counter-clockwise; they need not be distinct.
    pub vertices: [VertexId; 3],
    /// The lengths of the sides from each corner to the next.
    pub lengths: [f64; 3],
}

impl IntrinsicTriangle {
    /// The area.
    #[must_use]
    pub fn area(&self) -> f64 {
        area(self.lengths)
    }

    /// The corners laid out in the plane: the first at the origin, the second on the first axis,
    /// the third above it.
    #[must_use]
    pub fn unfolded(&self) -> [Vector2<f64>; 3] {
        let [ab, bc, ca] = self.lengths;
        [
            Vector2::zeros(),
            Vector2::new(ab, 0.0),
            apex(ab, ca, bc, area(self.lengths)),
        ]
    }

    /// The cotangent of the angle opposite each side.
    #[must_use]
    pub fn opposite_cotangents(&self) -> [f64; 3] {
        opposite_cotangents(self.lengths)
    }
}

impl IntrinsicTriangulation {
    /// The triangles of a surface, with lengths increased by the same small amount where a triangle
    /// is so thin that its angles would be rounding errors.
    ///
    /// `mollification` is the smallest amount, relative to the mean edge length, by which two sides
    /// of a triangle together are to be longer than the third; see [`MOLLIFICATION`]. Zero keeps
    /// the lengths as they are.
    pub fn new<T: Scalar>(surface: &Surface<'_, T>, mollification: f64) -> Self {
        let mesh = surface.mesh();
        let copies = Copies::new(mesh);
        let mut slots = vec![NONE; mesh.num_halfedges()];
        for f in mesh.faces() {
            for (k, h) in mesh.face_halfedges(f).enumerate().take(3) {
                slots[h.index()] = (3 * f.index() + k) as u32;
            }
        }
        let num_sides = 3 * (mesh.num_faces() + copies.faces.len());
        let sides = CHUNKS.filled(num_sides, |slot| {
            let (of_mesh, is_copy) = copies.original(slot);
            let first = mesh.face_halfedge(FaceId::new(of_mesh / 3));
            let h = match of_mesh % 3 {
                0 => first,
                1 => mesh.next(first),
                _ => mesh.prev(first),
            };
            let beyond = slots[h.twin().index()];
            let twin = match (is_copy, beyond) {
                (false, NONE) => copies.copy(of_mesh),
                (false, beyond) => beyond as usize,
                (true, NONE) => of_mesh,
                (true, beyond) => copies.copy(beyond as usize),
            };
            let origin = if is_copy {
                mesh.target(h)
            } else {
                mesh.origin(h)
            };
            // The same direction from either side, so that both have the same length.
            let vector = surface.halfedge_vector(h.edge().halfedge());
            Side {
                origin: origin.index() as u32,
                twin: twin as u32,
                length: vector.map(T::as_f64).norm(),
                halfedge: h.index() as u32,
            }
        });
        let mut triangulation = Self {
            num_vertices: mesh.num_vertices(),
            sides,
            is_mirrored: copies.of_face.iter().map(|copy| *copy != NONE).collect(),
            added: 0.0,
        };
        triangulation.mollify(mollification);
        triangulation
    }

    /// Adds the same length to all edges, such that every triangle inequality holds by a margin.
    fn mollify(&mut self, relative: f64) {
        let count = self.sides.len();
        if count == 0 || !(relative > 0.0) {
            return;
        }
        let margin = relative * self.mean_length();
        let added = cotan_parallel::max(count / 3, |t| {
            let [a, b, c] = self.lengths(t);
            // Two sides gain twice as much as the third.
            let missing = a.max(b).max(c) * 2.0 - (a + b + c) + margin;
            missing.max(0.0)
        });
        if added > 0.0 && added.is_finite() {
            self.sides.iter_mut().for_each(|side| side.length += added);
            self.added = added;
        }
    }

    /// The mean length over the sides of all triangles.
    #[must_use]
    pub fn mean_length(&self) -> f64 {
        let total = CHUNKS.sum::<f64>(self.sides.len(), |s| self.sides[s].length);
        total / self.sides.len().max(1) as f64
    }

    /// The length that mollification added to every edge.
    pub fn added_length(&self) -> f64 {
        self.added
    }

    /// Number of vertices.
    pub fn num_vertices(&self) -> usize {
        self.num_vertices
    }

    /// Number of triangles: one per face, and one more per face of a component with a boundary.
    pub fn num_triangles(&self) -> usize {
        self.sides.len() / 3
    }

    /// The share with which a triangle counts in sums over the surface: 1, or ½ in a component
    /// with a boundary, whose triangles exist twice.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn share(&self, index: usize) -> f64 {
        match self.is_mirrored.get(index) {
            Some(false) => 1.0,
            _ => 0.5,
        }
    }

    /// The triangle with this index.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn triangle(&self, index: usize) -> IntrinsicTriangle {
        IntrinsicTriangle {
            vertices: [0, 1, 2].map(|k| {
                let origin = self.sides[3 * index + k].origin;
                VertexId::new(origin as usize)
            }),
            lengths: self.lengths(index),
        }
    }

    /// A halfedge of the mesh along each side of a triangle, in either direction, or `None` for
    /// edges that are not in the mesh.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn halfedges(&self, index: usize) -> [Option<HalfedgeId>; 3] {
        [0, 1, 2].map(|k| {
            let h = self.sides[3 * index + k].halfedge;
            (h != NONE).then(|| HalfedgeId::new(h as usize))
        })
    }

    /// Flips edges until every edge is Delaunay: the angles opposite to it add up to at most 180°,
    /// up to rounding. Returns the number of flips.
    ///
    /// Each flip is one that Fisher et al. prove to be possible; an edge with the same triangle on
    /// both sides is always Delaunay.
    pub fn flip_to_delaunay(&mut self) -> usize {
        let mut pending: Vec<u32> = (0..self.sides.len())
            .rev()
            .filter(|&s| self.sides[s].twin > s as u32)
            .map(|s| s as u32)
            .collect();
        let mut flips = 0;
        // Rounding cannot make the loop endless.
        let most = MAX_FLIPS.saturating_mul(self.sides.len());
        while let Some(side) = pending.pop() {
            let side = side as usize;
            let twin = self.sides[side].twin;
            if flips >= most || !(self.weight(side) < -TOLERANCE) {
                continue;
            }
            if self.flip(side) {
                flips += 1;
                let (f, g) = (side / 3, twin as usize / 3);
                let around = [3 * f + 1, 3 * f + 2, 3 * g + 1, 3 * g + 2];
                pending.extend(around.map(|s| s as u32));
            }
        }
        flips
    }

    /// Returns true if no edge has a negative weight, up to rounding.
    #[must_use]
    pub fn is_delaunay(&self) -> bool {
        cotan_parallel::all(self.sides.len(), |s| self.weight(s) >= -TOLERANCE)
    }

    /// cot α + cot β of the angles opposite an edge, given by one of its sides.
    fn weight(&self, side: usize) -> f64 {
        let one = |side: usize| opposite_cotangents(self.lengths(side / 3))[side % 3];
        one(side) + one(self.sides[side].twin as usize)
    }

    fn lengths(&self, triangle: usize) -> [f64; 3] {
        [0, 1, 2].map(|k| self.sides[3 * triangle + k].length)
    }

    /// Replaces an edge by the other diagonal of its two triangles.
    ///
    /// ```text
    ///       w                 w
    ///     / f \             / | \
    ///    u ---- v    →     u f|g v
    ///     \ g /             \ | /
    ///       x                 x
    /// ```
    fn flip(&mut self, side: usize) -> bool {
        let twin = self.sides[side].twin as usize;
        if twin / 3 == side / 3 {
            return false;
        }
        let after = |s: usize, by: usize| s / 3 * 3 + (s % 3 + by) % 3;
        let [vw, wu] = [after(side, 1), after(side, 2)];
        let [ux, xv] = [after(twin, 1), after(twin, 2)];
        let base = self.sides[side].length;
        let length_of = |s: usize| self.sides[s].length;
        let above = [base, length_of(vw), length_of(wu)];
        let below = [base, length_of(ux), length_of(xv)];
        let w = apex(base, above[2], above[1], area(above));
        let x = apex(base, below[1], below[2], area(below));
        let length = (w - Vector2::new(x.x, -x.y)).norm();
        if !(length > 0.0) || !length.is_finite() {
            return false;
        }
        let (f, g) = (side / 3, twin / 3);
        // The old side of each new place: f becomes x w u, g becomes w x v.
        let moves = [
            (wu, 3 * f + 1),
            (ux, 3 * f + 2),
            (xv, 3 * g + 1),
            (vw, 3 * g + 2),
        ];
        let old = moves.map(|(from, _)| self.sides[from]);
        let place = |s: u32| {
            let moved = moves.iter().find(|(from, _)| *from as u32 == s);
            moved.map_or(s, |(_, to)| *to as u32)
        };
        let (origin_w, origin_x) = (self.sides[wu].origin, self.sides[xv].origin);
        for ((_, to), side) in moves.iter().zip(old) {
            let twin = place(side.twin);
            self.sides[*to] = Side { twin, ..side };
            self.sides[twin as usize].twin = *to as u32;
        }
        let diagonal = |origin: u32, twin: usize| Side {
            origin,
            twin: twin as u32,
            length,
            halfedge: NONE,
        };
        self.sides[3 * f] = diagonal(origin_x, 3 * g);
        self.sides[3 * g] = diagonal(origin_w, 3 * f);
        true
    }
}

/// The faces that have mirrored copies: those of components with a boundary.
struct Copies {
    /// For each face the index of its copy among the copies, or `NONE`.
    of_face: Vec<u32>,
    /// The face of each copy.
    faces: Vec<u32>,
}

impl Copies {
    fn new(mesh: &HalfedgeMesh) -> Self {
        let components = mesh.components();
        let mut is_open = vec![false; components.count()];
        for h in mesh.boundary_loops() {
            is_open[components.of(mesh.origin(h))] = true;
        }
        let mut faces = Vec::new();
        let of_face = mesh.faces().map(|f| {
            if !is_open[components.of(mesh.triangle(f)[0])] {
                return NONE;
            }
            faces.push(f.index() as u32);
            faces.len() as u32 - 1
        });
        Self {
            of_face: of_face.collect(),
            faces,
        }
    }

    /// The side of the mesh's own triangle for any side, and whether that is one of a copy. A copy
    /// has its sides in reverse order: it is seen from the other side.
    fn original(&self, slot: usize) -> (usize, bool) {
        match (slot / 3).checked_sub(self.of_face.len()) {
            None => (slot, false),
            Some(copy) => (3 * self.faces[copy] as usize + 2 - slot % 3, true),
        }
    }

    /// The side of the copy for a side of the mesh's own triangle, which has a copy.
    fn copy(&self, slot: usize) -> usize {
        let copy = self.of_face[slot / 3] as usize;
        3 * (self.of_face.len() + copy) + 2 - slot % 3
    }
}

/// The area of a triangle by its sides, without cancellation.
///
/// **Source**: Kahan 2014, Miscalculating area and angles of a needle-like triangle.
fn area(lengths: [f64; 3]) -> f64 {
    let [mut a, mut b, mut c] = lengths;
    if a < b {
        std::mem::swap(&mut a, &mut b);
    }
    if b < c {
        std::mem::swap(&mut b, &mut c);
    }
    if a < b {
        std::mem::swap(&mut a, &mut b);
    }
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    0.25 * product.max(0.0).sqrt()
}

/// The apex of a triangle over a base along the first axis from the origin, by the lengths of the
/// sides at the base's start and end.
fn apex(base: f64, at_start: f64, at_end: f64, area: f64) -> Vector2<f64> {
    let along = 0.5 * ((at_start - at_end) * (at_start + at_end) / base + base);
    Vector2::new(along, 2.0 * area / base)
}

/// The cotangent of the angle opposite each side, (b² + c² − a²) / 4A. Triangles thinner than the
/// floor of [`crate::Cotangent`] are treated as having its area.
fn opposite_cotangents(lengths: [f64; 3]) -> [f64; 3] {
    let squares = lengths.map(|l| l * l);
    let total: f64 = squares.iter().sum();
    let quadruple = (4.0 * area(lengths)).max(2.0 * FLOOR * total);
    if !(quadruple > 0.0) {
        return [0.0; 3];
    }
    squares.map(|a| (total - 2.0 * a) / quadruple)
}

/// The mollification that Sharp and Crane recommend, relative to the mean edge length.
pub const MOLLIFICATION: f64 = 1e-5;

/// Edges with a weight above −`TOLERANCE` count as Delaunay: four points on a circle, as in every
/// square grid, have weight 0 for either diagonal, and a mesh rounded to single precision is not to
/// flip half of them.
const TOLERANCE: f64 = 1e-6;

/// Twice the least area over Σ l², far below what mollification leaves.
const FLOOR: f64 = 1e-12;

/// Limit of the flips per side. Meshes need less than one; a bound of theory is quadratic.
const MAX_FLIPS: usize = 1000;

/// Sides per task.
const CHUNKS: Chunks = Chunks::of(4096);

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{cylinder, icosphere, tetrahedron, torus};
    use cotan_geometry::testing::surfaces;
    use proptest::prelude::*;

    use super::*;

    fn total_area(t: &IntrinsicTriangulation) -> f64 {
        let areas = (0..t.num_triangles()).map(|i| t.share(i) * t.triangle(i).area());
        areas.sum()
    }

    /// Twins point at each other and agree about ends and length.
    fn check(t: &IntrinsicTriangulation) {
        for (s, side) in t.sides.iter().enumerate() {
            let twin = t.sides[side.twin as usize];
            assert_eq!(twin.twin as usize, s);
            assert_eq!(twin.length, side.length);
            assert_eq!(twin.origin, t.sides[s / 3 * 3 + (s % 3 + 1) % 3].origin);
        }
    }

    /// The cone angle of each vertex.
    fn angles(t: &IntrinsicTriangulation) -> Vec<f64> {
        let mut sums = vec![0.0; t.num_vertices()];
        for i in 0..t.num_triangles() {
            let triangle = t.triangle(i);
            let cotangents = triangle.opposite_cotangents();
            for k in 0..3 {
                // The side after a corner's own is opposite to it.
                let angle = 1.0_f64.atan2(cotangents[(k + 1) % 3]);
                sums[triangle.vertices[k].index()] += t.share(i) * angle;
            }
        }
        sums
    }

    proptest! {
        #[test]
        fn flips_keep_the_surface_and_end_delaunay(
            shape in surfaces(), thin in 0.02..1.0_f64,
        ) {
            let squeezed = shape.positions().map(|p| nalgebra::Point3::new(p.x, p.y * thin, p.z));
            let surface = shape.surface();
            let surface = surface.with_positions(&squeezed);
            let before = IntrinsicTriangulation::new(&surface, 0.0);
            let mut after = before.clone();
            after.flip_to_delaunay();
            check(&after);
            prop_assert!(after.is_delaunay());
            let area = total_area(&before);
            prop_assert!((total_area(&after) - area).abs() < 1e-8 * area);
            for (a, b) in angles(&before).iter().zip(angles(&after)) {
                prop_assert!((a - b).abs() < 1e-4, "{} {}", a, b);
            }
        }
    }

    #[test]
    fn a_delaunay_mesh_stays() {
        for shape in [icosphere::<f64>(2), tetrahedron()] {
            let mut t = IntrinsicTriangulation::new(&shape.surface(), MOLLIFICATION);
            assert_eq!((t.flip_to_delaunay(), t.added_length()), (0, 0.0));
        }
    }

    #[test]
    fn two_triangles_may_share_several_edges() {
        // A long tube of tetrahedra in a row: the shortest way around it starts and ends at the
        // same vertex.
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
        let tube = cotan_geometry::Mesh::<f64>::from_triangles(&positions, &corners).unwrap();
        let mut t = IntrinsicTriangulation::new(&tube.surface(), 0.0);
        assert!(t.flip_to_delaunay() > 0);
        check(&t);
        assert!(t.is_delaunay());
        let has_loop = |[a, b, c]: [VertexId; 3]| a == b || b == c || c == a;
        assert!((0..t.num_triangles()).any(|i| has_loop(t.triangle(i).vertices)));
        for shape in [cylinder(0.05, 8.0, 6, 1), torus(1.0, 0.1, 40, 5)] {
            let mut t = IntrinsicTriangulation::new(&shape.surface(), 0.0);
            t.flip_to_delaunay();
            check(&t);
            assert!(t.is_delaunay());
        }
    }

    #[test]
    fn triangles_without_area_are_mollified() {
        let mut shape = icosphere::<f64>(1);
        let v = VertexId::new(0);
        let neighbour = shape.connectivity().one_ring(v).next().unwrap();
        shape.positions_mut()[0] = shape.positions()[neighbour];
        let mut t = IntrinsicTriangulation::new(&shape.surface(), MOLLIFICATION);
        assert!(t.added_length() > 0.0);
        assert!((0..t.num_triangles()).all(|i| t.triangle(i).area() > 0.0));
        t.flip_to_delaunay();
        check(&t);
        assert!(t.is_delaunay());
    }
}
