//! The interior edges created by triangulating polygons.

use cotan_geometry::relative_height;
use nalgebra::Point3;

use crate::faces::FaceList;
use crate::recut::{Cutter, Polygons, Recuts};
use crate::topology::Topology;

/// A triangle counts as having no area if the ratio of its smallest height to its longest edge is
/// at most this.
pub(crate) const FLAT: f64 = 1e-9;

/// A side of a triangle that is not a side of its polygon.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Cut {
    /// The places at its ends, in ascending order.
    ends: [u32; 2],
    face: u32,
    is_forward: bool,
}

/// The result of triangulating the polygons of a mesh.
#[derive(Debug, Default)]
pub(crate) struct Cuts {
    /// Sorted by their ends.
    sides: Vec<Cut>,
    /// Faces with a triangle that passes through a place twice.
    pub(crate) repeating: Vec<u32>,
    /// Faces with a triangle of no area, and `true` if all their triangles have none.
    pub(crate) flat: Vec<(u32, bool)>,
}

impl Cuts {
    /// Collects the cuts.
    ///
    /// `corners` gives the vertex of every corner, `places` the place of every vertex.
    pub(crate) fn new(
        topology: &Topology<'_>,
        corners: &[u32],
        places: &[u32],
        positions: &[Point3<f64>],
    ) -> Self {
        let mut cuts = Self::default();
        let mut outlines = FaceList::new();
        for outline in topology.outlines.iter() {
            let vertices = outline.iter().map(|&corner| corners[corner as usize]);
            vertices.for_each(|v| outlines.push_corner(v));
            outlines.end_face();
        }
        let recuts = Recuts::new(Polygons {
            faces: &outlines,
            places,
            positions,
        });
        let mut cutter = Cutter::new(positions, corners.len(), &recuts);
        let mut triangles = Vec::new();
        let (mut own, mut inner) = (Vec::new(), Vec::new());
        for (face, outline) in (0u32..).zip(topology.outlines.iter()) {
            if outline.is_empty() {
                continue;
            }
            let polygon = outlines.get(face as usize).unwrap_or_default();
            triangles.clear();
            cutter.cut(face, polygon, |t| {
                triangles.push(t.map(|v| places[v as usize]))
            });
            let is_flat = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| positions[v as usize]);
                relative_height(&a, &b, &c) <= FLAT
            };
            let num_flat = triangles.iter().filter(|t| is_flat(t)).count();
            if num_flat > 0 {
                cuts.flat.push((face, num_flat == triangles.len()));
            }
            if let [_] = *triangles {
                continue;
            }
            if triangles.iter().any(|[a, b, c]| a == b || b == c || c == a) {
                cuts.repeating.push(face);
            }
            let side = |a: u32, b: u32| Cut {
                ends: [a.min(b), a.max(b)],
                face,
                is_forward: a < b,
            };
            let place = |k: usize| topology.place(outline[k % outline.len()]);
            own.clear();
            own.extend((0..outline.len()).map(|k| side(place(k), place(k + 1))));
            own.sort_unstable();
            inner.clear();
            for &[a, b, c] in &triangles {
                inner.extend([side(a, b), side(b, c), side(c, a)]);
            }
            inner.sort_unstable();
            // Remove the polygon's own sides; both lists are sorted.
            let mut rest = own.iter().peekable();
            inner.retain(|side| {
                while rest.next_if(|own| *own < side).is_some() {}
                rest.next_if(|own| *own == side).is_none()
            });
            cuts.sides.extend_from_slice(&inner);
        }
        cuts.sides.sort_unstable();
        cuts
    }

    /// Finds polygons with a cut that coincides with an edge or a cut of another face, with the
    /// ends of the cut.
    pub(crate) fn conflicts(&self, topology: &Topology<'_>) -> Vec<(u32, [u32; 2])> {
        let mut conflicts = Vec::new();
        let mut edges = topology.edges().map(|sides| sides[0].ends).peekable();
        for cuts in self.sides.chunk_by(|a, b| a.ends == b.ends) {
            let ends = cuts[0].ends;
            while edges.next_if(|edge| *edge < ends).is_some() {}
            let is_proper = matches!(cuts, [a, b] if a.is_forward != b.is_forward);
            if !is_proper || edges.peek() == Some(&ends) {
                conflicts.extend(cuts.iter().map(|cut| (cut.face, ends)));
            }
        }
        conflicts.sort_unstable();
        conflicts.dedup();
        conflicts
    }

    /// The ends of all cuts, in ascending order.
    pub(crate) fn ends(&self) -> impl Iterator<Item = [u32; 2]> {
        self.sides.iter().map(|cut| cut.ends)
    }
}
