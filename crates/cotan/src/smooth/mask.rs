//! Restriction of an edit to a part of a mesh.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};

use super::run::refuse;
use crate::error::Error;

/// The part of a mesh that an edit may move: one weight per vertex in 0 … 1.
///
/// A vertex moves by its weight times the displacement of the edit. Vertices of weight 0 keep
/// their exact positions. For a border without a step, weights should fall to 0 smoothly, as
/// those of [`Mask::inside`] do.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::Mask;
///
/// let shape = cotan::shapes::icosphere::<f64>(3);
/// let upper = shape.surface().vertices_where(|p| p.z > 0.0);
/// let mask = Mask::inside(&shape.surface(), &upper, 0.5)?;
/// for (v, weight) in mask.weights().iter() {
///     assert!(shape.positions()[v].z > 0.0 || *weight == 0.0);
/// }
/// # Ok::<(), cotan::Error>(())
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Mask {
    weights: VertexMap<f64>,
}

impl Mask {
    /// Creates a mask from weights.
    ///
    /// # Errors
    /// [`Error::Flow`] for a weight that is not in 0 … 1.
    pub fn new(weights: VertexMap<f64>) -> Result<Self, Error> {
        match weights.values().find(|w| !(0.0..=1.0).contains(*w)) {
            Some(weight) => Err(refuse("weight of a mask", "between 0 and 1", *weight)),
            None => Ok(Self { weights }),
        }
    }

    /// A region with a soft border: 0 outside, and inside
    ///
    /// ```text
    /// 6 t⁵ − 15 t⁴ + 10 t³        t = min(distance from the outside / falloff, 1)
    /// ```
    ///
    /// which has two continuous derivatives. The distance is measured along the surface
    /// ([`distances`]). A component without outside has the weight 1.
    ///
    /// **Units**: `falloff` is a length. At 0 the border is a step.
    ///
    /// # Errors
    /// [`Error::Flow`] for a falloff that is negative or not finite, and
    /// [`Error::HandleOutOfRange`] for a vertex that does not exist.
    pub fn inside<T: Scalar>(
        surface: &Surface<'_, T>,
        region: &[VertexId],
        falloff: f64,
    ) -> Result<Self, Error> {
        check_falloff(falloff)?;
        let is_inside = flags(surface, region)?;
        let outside: Vec<VertexId> = surface
            .mesh()
            .vertices()
            .filter(|v| !is_inside[v.index()])
            .collect();
        let far = distances(surface, &outside, falloff);
        let weights = far.iter().map(|(v, d)| match is_inside[v.index()] {
            true if *d >= falloff => 1.0,
            true => rise(d / falloff),
            false => 0.0,
        });
        Ok(Self {
            weights: weights.collect(),
        })
    }

    /// The vertices within a distance of some others along the surface, with a soft border as in
    /// [`Self::inside`]: 0 from `radius` on and 1 up to `radius − falloff`.
    ///
    /// # Errors
    /// As [`Self::inside`].
    pub fn around<T: Scalar>(
        surface: &Surface<'_, T>,
        sources: &[VertexId],
        radius: f64,
        falloff: f64,
    ) -> Result<Self, Error> {
        check_falloff(falloff)?;
        if !(radius.is_finite() && radius >= 0.0) {
            return Err(refuse("radius of a mask", "at least 0", radius));
        }
        flags(surface, sources)?;
        let near = distances(surface, sources, radius);
        let weights = near.values().map(|d| match radius - d {
            left if left <= 0.0 => 0.0,
            left if left >= falloff => 1.0,
            left => rise(left / falloff),
        });
        Ok(Self {
            weights: weights.collect(),
        })
    }

    /// The weights.
    pub fn weights(&self) -> &VertexMap<f64> {
        &self.weights
    }

    /// The complement: 1 − w.
    #[must_use]
    pub fn inverted(&self) -> Self {
        Self {
            weights: self.weights.map(|w| 1.0 - w),
        }
    }

    /// x⁰ + w (x − x⁰): exactly x⁰ for w = 0 and exactly x for w = 1.
    ///
    /// # Panics
    /// If the three do not have the same length.
    pub fn blend<T: Scalar>(&self, original: &Positions<T>, moved: &Positions<T>) -> Positions<T> {
        assert!(
            original.len() == self.weights.len() && moved.len() == self.weights.len(),
            "one position per weight"
        );
        let ends = original.values().zip(moved.values());
        ends.zip(self.weights.values())
            .map(|((a, b), weight)| match *weight {
                0.0 => *a,
                1.0 => *b,
                weight => a + (b - a) * T::of_f64(weight),
            })
            .collect()
    }

    /// The mask with one weight for all copies of a vertex, that of its row: they move alike.
    pub(crate) fn shared(&self, mesh: &HalfedgeMesh) -> Cow<'_, Self> {
        match mesh.has_copies() {
            false => Cow::Borrowed(self),
            true => Cow::Owned(Self {
                weights: mesh.to_vertices(mesh.to_rows(&self.weights)),
            }),
        }
    }

    /// # Errors
    /// [`Error::FieldLength`] if the mask is for a mesh with another number of vertices.
    pub(crate) fn check(&self, num_vertices: usize) -> Result<(), Error> {
        match self.weights.len() == num_vertices {
            true => Ok(()),
            false => Err(Error::FieldLength {
                what: "the mask",
                len: self.weights.len(),
                num_vertices,
            }),
        }
    }

    /// Adds the vertices of weight 0 to those that are held.
    pub(crate) fn hold(&self, held: &mut [bool]) {
        for (held, weight) in held.iter_mut().zip(self.weights.values()) {
            *held |= *weight == 0.0;
        }
    }
}

/// The distance of each vertex from the nearest source along the surface, up to `limit`;
/// infinite beyond it.
///
/// Distances spread from vertex to vertex in order of their size, across each triangle as if it
/// were flat. On a plane without obtuse triangles the error is a few per cent of an edge.
///
/// **Source**: Kimmel and Sethian, "Computing geodesic paths on manifolds", 1998. Obtuse
/// triangles are not split; across them the distance is that along edges.
///
/// # Panics
/// If a source does not exist.
pub fn distances<T: Scalar>(
    surface: &Surface<'_, T>,
    sources: &[VertexId],
    limit: f64,
) -> VertexMap<f64> {
    let mesh = surface.mesh();
    let n = mesh.num_vertices();
    let mut distances = VertexMap::filled(n, f64::INFINITY);
    let mut is_done = vec![false; n];
    let mut queue = BinaryHeap::new();
    let same = copies_of(mesh);
    for &v in sources {
        distances[v] = 0.0;
        queue.push(Reached(0.0, v));
    }
    while let Some(Reached(distance, v)) = queue.pop() {
        if is_done[v.index()] || distance > limit {
            continue;
        }
        is_done[v.index()] = true;
        for &copy in same.get(mesh.row_of(v).index()).into_iter().flatten() {
            if distance < distances[copy] {
                distances[copy] = distance;
                queue.push(Reached(distance, copy));
            }
        }
        for h in mesh.outgoing_halfedges(v) {
            let j = mesh.target(h);
            let mut relax = |to: VertexId, distance: f64| {
                if distance < distances[to] {
                    distances[to] = distance;
                    queue.push(Reached(distance, to));
                }
            };
            relax(j, distance + edge(surface, v, j));
        }
        for f in mesh.vertex_faces(v) {
            let [a, b, c] = mesh.triangle(f);
            for [to, p, q] in [[a, b, c], [b, c, a], [c, a, b]] {
                if to == v || !is_done[p.index()] || !is_done[q.index()] {
                    continue;
                }
                let across = across(surface, [to, p, q], [distances[p], distances[q]]);
                if let Some(distance) = across.filter(|d| *d < distances[to]) {
                    distances[to] = distance;
                    queue.push(Reached(distance, to));
                }
            }
        }
    }
    distances.values_mut().for_each(|d| {
        if *d > limit {
            *d = f64::INFINITY;
        }
    });
    distances
}

/// Per row all its vertices, if any vertex has copies.
fn copies_of(mesh: &HalfedgeMesh) -> Vec<Vec<VertexId>> {
    let mut same = Vec::new();
    if mesh.has_copies() {
        same.resize(mesh.num_rows(), Vec::new());
    }
    for (copy, row) in mesh.copies() {
        let here: &mut Vec<VertexId> = &mut same[row.index()];
        if here.is_empty() {
            here.push(row);
        }
        here.push(copy);
    }
    same
}

/// The distance at the corner `to` of a flat triangle whose other corners p and q have these
/// distances from a point in its plane, on the other side of pq. `None` if the straight line to
/// that point does not cross pq.
fn across<T: Scalar>(
    surface: &Surface<'_, T>,
    [to, p, q]: [VertexId; 3],
    [at_p, at_q]: [f64; 2],
) -> Option<f64> {
    let [to, p, q] = [to, p, q].map(|v| surface.position(v).map(T::as_f64));
    let along = q - p;
    let length = along.norm();
    // The triangle with pq on the x axis, p at 0.
    let x = (to - p).dot(&along) / length;
    let y = ((to - p).norm_squared() - x * x).max(0.0).sqrt();
    let source_x = (at_p * at_p - at_q * at_q + length * length) / (2.0 * length);
    let square = at_p * at_p - source_x * source_x;
    if !(square >= 0.0) {
        return None;
    }
    let source_y = square.sqrt();
    let crossing = source_x + (x - source_x) * source_y / (source_y + y);
    let is_between = crossing >= 0.0 && crossing <= length;
    is_between.then(|| ((x - source_x).powi(2) + (y + source_y).powi(2)).sqrt())
}

fn edge<T: Scalar>(surface: &Surface<'_, T>, a: VertexId, b: VertexId) -> f64 {
    (surface.position(b) - surface.position(a))
        .map(T::as_f64)
        .norm()
}

/// A vertex with a distance; the least comes first, and the lowest vertex among equals.
struct Reached(f64, VertexId);

impl PartialEq for Reached {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Reached {}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

/// 6 t⁵ − 15 t⁴ + 10 t³.
fn rise(t: f64) -> f64 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

fn check_falloff(falloff: f64) -> Result<(), Error> {
    match falloff.is_finite() && falloff >= 0.0 {
        true => Ok(()),
        false => Err(refuse("falloff of a mask", "at least 0", falloff)),
    }
}

/// Which vertices are in a list.
fn flags<T: Scalar>(surface: &Surface<'_, T>, vertices: &[VertexId]) -> Result<Vec<bool>, Error> {
    let num_vertices = surface.mesh().num_vertices();
    let mut is_in = vec![false; num_vertices];
    for &vertex in vertices {
        match is_in.get_mut(vertex.index()) {
            Some(flag) => *flag = true,
            None => {
                return Err(Error::HandleOutOfRange {
                    group: 0,
                    vertex,
                    num_vertices,
                });
            }
        }
    }
    Ok(is_in)
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bumpy_plane, icosphere};

    use super::*;

    #[test]
    fn distances_on_a_plane_are_straight() {
        let shape = bumpy_plane::<f64>([2.0, 2.0], [40, 40], 0.0);
        let source = VertexId::new(20 * 41 + 20);
        let found = distances(&shape.surface(), &[source], f64::INFINITY);
        let centre = shape.positions()[source];
        for (v, p) in shape.positions().iter() {
            let off = (found[v] - (p - centre).norm()).abs();
            assert!(off < 0.5 * 0.05, "{v:?}: {off}");
        }
    }

    #[test]
    fn distances_on_a_sphere_are_arcs_up_to_the_limit() {
        let shape = icosphere::<f64>(4);
        let source = VertexId::new(0);
        let top = shape.positions()[source].coords;
        let found = distances(&shape.surface(), &[source], 1.5);
        for (v, p) in shape.positions().iter() {
            let arc = p.coords.dot(&top).clamp(-1.0, 1.0).acos();
            if arc < 1.4 {
                assert!((found[v] - arc).abs() < 0.03, "{arc}: {}", found[v]);
            }
            if arc > 1.6 {
                assert_eq!(found[v], f64::INFINITY);
            }
        }
    }

    #[test]
    fn weights_outside_of_0_to_1_are_refused() {
        for weight in [-0.1, 1.5, f64::NAN] {
            assert!(Mask::new(VertexMap::filled(3, weight)).is_err());
        }
        let shape = icosphere::<f64>(1);
        assert!(Mask::inside(&shape.surface(), &[], -1.0).is_err());
        assert!(Mask::inside(&shape.surface(), &[VertexId::new(99)], 1.0).is_err());
    }
}
