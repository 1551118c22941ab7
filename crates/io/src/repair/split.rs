//! Separation of faces at edges and vertices.

use std::collections::HashMap;

use cotan_halfedge::DisjointSets;
use foldhash::fast::RandomState;
use nalgebra::{Point3, Vector3};

use super::work::Work;
use super::{Change, Toggle};
use crate::attributes::NONE;
use crate::cuts::Cuts;
use crate::topology::{Side, Topology};

impl Work<'_> {
    /// Gives each fan of faces its own vertex.
    ///
    /// With `edges` on, faces at edges with more than two are separated first.
    pub(super) fn split(&mut self, edges: Toggle) {
        let at = self.at();
        let topology = Topology::new(&self.faces, &at);
        let is_outlined = is_outlined(&topology);
        let (mut fans, parted) = self.fans(&topology, edges);
        self.changes.extend(parted);
        self.assign(&mut fans, &is_outlined);
    }

    /// Detaches faces that still conflict with others from all their neighbours, so that a
    /// surface can be built.
    ///
    /// Detaching only separates the remaining faces further, so one pass is enough.
    pub(super) fn untangle(&mut self) {
        let at = self.at();
        let topology = Topology::new(&self.faces, &at);
        let is_outlined = is_outlined(&topology);
        let is_loose = self.tangled(&topology);
        if !is_loose.contains(&true) {
            return;
        }
        let mut fans = DisjointSets::new(at.len());
        for sides in topology.edges() {
            if let [a, b] = sides
                && !is_loose[a.face as usize]
                && !is_loose[b.face as usize]
            {
                topology.join_ends(&mut fans, a.corner, b.corner);
            }
        }
        for face in (0u32..).zip(&is_loose).filter(|(_, is_loose)| **is_loose) {
            let face = self.face(face.0);
            self.changes.push(Change::DetachedFace { face });
        }
        self.assign(&mut fans, &is_outlined);
    }

    /// Returns the corners that stay together, and the edges at which faces were separated.
    fn fans(&self, topology: &Topology<'_>, edges: Toggle) -> (DisjointSets, Vec<Change>) {
        let mut fans = DisjointSets::new(topology.at.len());
        let mut parted = Vec::new();
        let mut normals = None;
        let points = self.points();
        for sides in topology.edges() {
            let is_proper = match sides {
                [_] => true,
                [a, b] => a.is_forward != b.is_forward,
                _ => false,
            };
            if is_proper || !edges.is_on() {
                for pair in sides.windows(2) {
                    topology.join_ends(&mut fans, pair[0].corner, pair[1].corner);
                }
                continue;
            }
            let normals = normals.get_or_insert_with(|| normals_of(topology, &points));
            for [a, b] in wedges(sides, normals, &points) {
                topology.join_ends(&mut fans, a, b);
            }
            parted.push(Change::PartedEdge {
                vertices: sides[0].ends.map(|v| self.vertex(v)),
                faces: sides.iter().map(|side| self.face(side.face)).collect(),
            });
        }
        (fans, parted)
    }

    /// Gives each fan its own place, and each vertex to one fan; the other fans get copies.
    fn assign(&mut self, fans: &mut DisjointSets, is_outlined: &[bool]) {
        let mut owner = vec![NONE; self.sources.len()];
        let mut copies: HashMap<(u32, u32), u32, RandomState> = HashMap::default();
        // The first vertex at the place of each fan.
        let mut place = vec![NONE; self.faces.num_corners()];
        let mut corners = self.faces.corners().to_vec();
        for (corner, vertex) in (0u32..).zip(&mut corners) {
            // Corners that enclose nothing belong to no fan and stay in place.
            if !is_outlined[corner as usize] {
                continue;
            }
            let fan = fans.root(corner);
            let old = *vertex as usize;
            if owner[old] == NONE {
                owner[old] = fan;
            }
            if owner[old] != fan {
                *vertex = *copies.entry((fan, *vertex)).or_insert_with(|| {
                    self.sources.push(self.sources[old]);
                    owner.push(fan);
                    (self.sources.len() - 1) as u32
                });
            }
            let first = &mut place[fan as usize];
            *first = (*first).min(*vertex);
        }
        let mut places: Vec<u32> = (0u32..)
            .zip(&owner)
            .map(|(v, &fan)| if fan == NONE { v } else { place[fan as usize] })
            .collect();
        // A vertex that is no longer used stays with the vertices it was welded to.
        let mut of_welded = vec![NONE; self.places.len()];
        for (v, &welded) in self.places.iter().enumerate() {
            if owner[v] != NONE {
                let first = &mut of_welded[welded as usize];
                *first = (*first).min(places[v]);
            }
        }
        for (v, &welded) in self.places.iter().enumerate() {
            if owner[v] == NONE && of_welded[welded as usize] != NONE {
                places[v] = of_welded[welded as usize];
            }
        }
        self.places = places;
        let polygon = |face| &corners[self.faces.corner_range(face)];
        self.faces = (0..self.faces.len()).map(polygon).collect();
    }

    /// Finds faces that prevent a surface from being built.
    fn tangled(&self, topology: &Topology<'_>) -> Vec<bool> {
        let mut is_tangled = vec![false; self.faces.len()];
        for sides in topology.edges() {
            let is_wrong = match sides {
                [_] => false,
                [a, b] => a.is_forward == b.is_forward,
                _ => true,
            };
            if is_wrong {
                sides
                    .iter()
                    .for_each(|side| is_tangled[side.face as usize] = true);
            }
        }
        let cuts = Cuts::new(topology, self.faces.corners(), &self.places, &self.points());
        let conflicts = cuts.conflicts(topology);
        let faces = conflicts
            .iter()
            .map(|(face, _)| face)
            .chain(&cuts.repeating);
        faces.for_each(|&face| is_tangled[face as usize] = true);
        is_tangled
    }
}

/// For each corner, `true` if it is in the outline of its face.
fn is_outlined(topology: &Topology<'_>) -> Vec<bool> {
    let corners = 0..topology.at.len() as u32;
    corners
        .map(|corner| topology.face(corner) != NONE)
        .collect()
}

/// The unit normals of all faces, or zero.
fn normals_of(topology: &Topology<'_>, points: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    let point = |corner: u32| points[topology.place(corner) as usize];
    let normal = |outline: &[u32]| -> Vector3<f64> {
        let Some(&first) = outline.first() else {
            return Vector3::zeros();
        };
        let origin = point(first);
        let sum: Vector3<f64> = outline[1..]
            .windows(2)
            .map(|pair| (point(pair[0]) - origin).cross(&(point(pair[1]) - origin)))
            .sum();
        sum.try_normalize(0.0).unwrap_or_default()
    };
    topology.outlines.iter().map(normal).collect()
}

/// Pairs the sides of an edge, given by their corners, that bound a wedge of the solid between
/// them.
///
/// The faces are considered in their order around the edge. Viewed from the upper end of the
/// edge, the inside is counter-clockwise of a face that runs downward, and clockwise of one that
/// runs upward.
fn wedges(sides: &[Side], normals: &[Vector3<f64>], points: &[Point3<f64>]) -> Vec<[u32; 2]> {
    let [low, high] = sides[0].ends.map(|v| points[v as usize]);
    let axis = (high - low).try_normalize(0.0).unwrap_or_else(Vector3::z);
    let mut helper = Vector3::zeros();
    helper[axis.iamin()] = 1.0;
    let u = axis.cross(&helper).try_normalize(0.0).unwrap_or_default();
    let v = axis.cross(&u);
    let mut order: Vec<(f64, &Side)> = sides
        .iter()
        .map(|side| {
            let along = if side.is_forward { axis } else { -axis };
            let inward = normals[side.face as usize].cross(&along);
            (inward.dot(&v).atan2(inward.dot(&u)), side)
        })
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.corner.cmp(&b.1.corner)));
    (0..order.len())
        .map(|k| [order[k].1, order[(k + 1) % order.len()].1])
        .filter(|[a, b]| !a.is_forward && b.is_forward)
        .map(|pair| pair.map(|side| side.corner))
        .collect()
}
