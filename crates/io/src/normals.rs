//! Rotation of normals with the surface.
//!
//! The normals of a file are kept as its author made them. Where vertices have moved, each normal
//! is rotated by the rotation that takes the old surface normal to the new one. Creases and
//! weighted or flipped normals are thus preserved, and nothing changes where nothing moved.
//! Corners at one place with the same normal belong together, even across a texture seam that
//! splits the vertex.

use std::collections::HashMap;

use foldhash::fast::RandomState;
use nalgebra::{Point3, Rotation3, Vector3};

use crate::attributes::{Attributes, NONE, NORMAL, Values};
use crate::faces::FaceList;
use crate::weld;

/// The normals that change, in the layout of the file. Lists are in ascending order.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Normals {
    /// Per-vertex normals.
    pub(crate) vertices: Vec<(u32, [f64; 3])>,
    /// Per-face normals, as in an STL.
    pub(crate) faces: Vec<(u32, [f64; 3])>,
    /// Corner normals, as in an OBJ.
    pub(crate) corners: CornerNormals,
}

/// Normals shared by corners through an index.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct CornerNormals {
    /// Changed entries of the table, with their new values.
    pub(crate) changed: Vec<(u32, [f64; 3])>,
    /// Entries appended to the table, for corners that no longer share a normal.
    pub(crate) added: Vec<[f64; 3]>,
    /// Corners (counted through all faces) that now refer to another entry, with its index.
    pub(crate) corners: Vec<(u32, u32)>,
}

impl Normals {
    /// Rotates the normals of `attributes` for a move of the vertices from `before` to `after`.
    pub(crate) fn turned(
        attributes: &Attributes,
        faces: &FaceList,
        before: &[Point3<f64>],
        after: &[Point3<f64>],
    ) -> Self {
        let moved: Vec<bool> = before.iter().zip(after).map(|(a, b)| a != b).collect();
        let turn = |sharing| Turn::new(faces, before, after, &moved, sharing);
        let mut normals = Self::default();
        if let Some(p) = attributes.vertex(NORMAL).filter(|p| p.components == 3) {
            normals.vertices = turn(Sharing::Place).vertices(&p.values);
        }
        if let Some(p) = attributes.face(NORMAL).filter(|p| p.components == 3) {
            normals.faces = turn(Sharing::Vertex).faces(&p.values);
        }
        if let Some(p) = attributes.corner(NORMAL).filter(|p| p.components == 3) {
            normals.corners = turn(Sharing::Vertex).corners(&p.values, &p.indices);
        }
        normals
    }

    /// Applies the changes to the attributes from which they were computed.
    pub(crate) fn apply(&self, attributes: &mut Attributes) {
        let put = |values: &mut Values, changes: &[(u32, [f64; 3])]| {
            for &(element, normal) in changes {
                for (k, x) in normal.into_iter().enumerate() {
                    values.set(3 * element as usize + k, x);
                }
            }
        };
        for p in attributes.vertices.iter_mut().filter(|p| p.name == NORMAL) {
            put(&mut p.values, &self.vertices);
        }
        for p in attributes.faces.iter_mut().filter(|p| p.name == NORMAL) {
            put(&mut p.values, &self.faces);
        }
        for p in attributes.corners.iter_mut().filter(|p| p.name == NORMAL) {
            put(&mut p.values, &self.corners.changed);
            self.corners
                .added
                .iter()
                .flatten()
                .for_each(|&x| p.values.push(x));
            for &(corner, entry) in &self.corners.corners {
                p.indices[corner as usize] = entry;
            }
        }
    }
}

/// A place on the surface, and the normal that its corners have there.
type Group = (u32, [u64; 3]);
/// The index of each group.
type Groups = HashMap<Group, usize, RandomState>;

/// The scope within which equal corner normals are shared.
#[derive(Clone, Copy)]
enum Sharing {
    /// The corners of one vertex.
    Vertex,
    /// The corners at one place, because seams split vertices.
    Place,
}

struct Turn<'a> {
    faces: &'a FaceList,
    /// For each vertex, the first vertex at its place.
    places: Vec<u32>,
    /// For each place, `true` if a face there moved.
    is_affected: Vec<bool>,
    before: &'a [Point3<f64>],
    after: &'a [Point3<f64>],
}

impl<'a> Turn<'a> {
    fn new(
        faces: &'a FaceList,
        before: &'a [Point3<f64>],
        after: &'a [Point3<f64>],
        moved: &[bool],
        sharing: Sharing,
    ) -> Self {
        // Vertices at one place belong together only if they also move to one place: if they
        // separate, they were two surfaces that touched. A corner's normal belongs to its vertex
        // alone.
        let places = match sharing {
            Sharing::Vertex => (0..before.len() as u32).collect(),
            Sharing::Place => {
                let first = weld::exact(before, |_| 0);
                weld::exact(after, |v| first[v])
            }
        };
        let mut is_affected = vec![false; before.len()];
        for polygon in faces
            .iter()
            .filter(|p| p.iter().any(|&v| moved[v as usize]))
        {
            for &v in polygon {
                is_affected[places[v as usize] as usize] = true;
            }
        }
        Self {
            faces,
            places,
            is_affected,
            before,
            after,
        }
    }

    /// Assigns every corner at an affected place to its group, and computes the rotated normal of
    /// every group.
    ///
    /// `normal` returns the normal of a corner, given its index and its vertex.
    fn groups(
        &self,
        normal: impl Fn(usize, u32) -> Option<[f64; 3]>,
    ) -> (Groups, Vec<Option<[f64; 3]>>) {
        let mut numbers = Groups::default();
        let mut groups: Vec<([f64; 3], [Sum; 2])> = Vec::new();
        for (face, polygon) in self.faces.iter().enumerate() {
            if !polygon.iter().any(|&v| self.affected(v)) {
                continue;
            }
            let sides = [self.before, self.after].map(|p| (p, newell(p, polygon)));
            for (corner, (k, &v)) in self
                .faces
                .corner_range(face)
                .zip(polygon.iter().enumerate())
            {
                if !self.affected(v) {
                    continue;
                }
                let Some(n) = normal(corner, v) else { continue };
                let number = *numbers.entry(self.group(v, n)).or_insert_with(|| {
                    groups.push((n, [Sum::default(); 2]));
                    groups.len() - 1
                });
                for (sum, (positions, unit)) in groups[number].1.iter_mut().zip(sides) {
                    sum.add(unit, angle(positions, polygon, k));
                }
            }
        }
        let turned = groups
            .iter()
            .map(|&(n, [old, new])| turned(n, old.direction(), new.direction()))
            .collect();
        (numbers, turned)
    }

    fn affected(&self, vertex: u32) -> bool {
        self.is_affected[self.places[vertex as usize] as usize]
    }

    fn group(&self, vertex: u32, normal: [f64; 3]) -> Group {
        (self.places[vertex as usize], normal.map(f64::to_bits))
    }

    fn vertices(&self, values: &Values) -> Vec<(u32, [f64; 3])> {
        let normal = |v: u32| triple(values, v);
        let (numbers, turned) = self.groups(|_, v| normal(v));
        let mut changes = Vec::new();
        for v in (0..self.places.len() as u32).filter(|&v| self.affected(v)) {
            let number = normal(v).and_then(|n| numbers.get(&self.group(v, n)));
            if let Some(n) = number.and_then(|&g| turned[g]) {
                changes.push((v, n));
            }
        }
        changes
    }

    fn faces(&self, values: &Values) -> Vec<(u32, [f64; 3])> {
        let mut changes = Vec::new();
        for (face, polygon) in (0u32..).zip(self.faces.iter()) {
            let is_moved = polygon
                .iter()
                .any(|&v| self.before[v as usize] != self.after[v as usize]);
            if !is_moved {
                continue;
            }
            let [old, new] = [self.before, self.after].map(|p| newell(p, polygon));
            if let Some(n) = triple(values, face).and_then(|n| turned(n, old, new)) {
                changes.push((face, n));
            }
        }
        changes
    }

    fn corners(&self, values: &Values, indices: &[u32]) -> CornerNormals {
        let normal = |corner: usize| {
            let entry = *indices.get(corner)?;
            if entry == NONE {
                None
            } else {
                triple(values, entry)
            }
        };
        let (numbers, turned) = self.groups(|corner, _| normal(corner));
        let table = values.len() / 3;
        // The group that owns each table entry: that of the first corner that refers to it.
        let mut holder: Vec<Option<Option<usize>>> = vec![None; table];
        let mut added: HashMap<(u32, usize), u32, RandomState> = HashMap::default();
        let mut changes = CornerNormals::default();
        for (corner, &v) in self.faces.corners().iter().enumerate() {
            let Some(n) = normal(corner) else { continue };
            let entry = indices[corner];
            let group = if self.affected(v) {
                numbers.get(&self.group(v, n)).copied()
            } else {
                None
            };
            let group = group.filter(|&g| turned[g].is_some());
            match holder[entry as usize] {
                None => {
                    holder[entry as usize] = Some(group);
                    if let Some(n) = group.and_then(|g| turned[g]) {
                        changes.changed.push((entry, n));
                    }
                }
                Some(held) if held == group => {}
                Some(_) => {
                    let value = group.and_then(|g| turned[g]).unwrap_or(n);
                    let key = (entry, group.unwrap_or(usize::MAX));
                    let number = *added.entry(key).or_insert_with(|| {
                        changes.added.push(value);
                        (table + changes.added.len() - 1) as u32
                    });
                    changes.corners.push((corner as u32, number));
                }
            }
        }
        changes.changed.sort_unstable_by_key(|&(entry, _)| entry);
        changes
    }
}

/// The three components of an element.
fn triple(values: &Values, element: u32) -> Option<[f64; 3]> {
    let at = 3 * element as usize;
    let n = [values.get(at)?, values.get(at + 1)?, values.get(at + 2)?];
    n.iter().all(|x| x.is_finite()).then_some(n)
}

/// The sum of the face normals at a place, weighted by angle.
#[derive(Clone, Copy, Default)]
struct Sum {
    normal: Vector3<f64>,
    weight: f64,
}

impl Sum {
    fn add(&mut self, unit: Vector3<f64>, angle: f64) {
        self.normal += unit * angle;
        self.weight += angle;
    }

    /// The unit normal, or zero if the faces cancel and only rounding error is left.
    fn direction(&self) -> Vector3<f64> {
        match self.normal.norm() > 1e-9 * self.weight {
            true => self.normal.normalize(),
            false => Vector3::zeros(),
        }
    }
}

/// The unit normal of a polygon (Newell), or zero if it has none.
fn newell(positions: &[Point3<f64>], polygon: &[u32]) -> Vector3<f64> {
    let p = |k: usize| positions[polygon[k % polygon.len()] as usize];
    let side = |k: usize| p(k) - p(0);
    let size = (1..polygon.len())
        .map(|k| side(k).amax())
        .fold(0.0, f64::max);
    // Scaled so that no product overflows or underflows.
    let sum: Vector3<f64> = (1..polygon.len())
        .map(|k| (side(k) / size).cross(&(side(k + 1) / size)))
        .sum();
    sum.try_normalize(0.0).unwrap_or_default()
}

/// The angle of a polygon at its corner `k`; 0 if adjacent corners coincide.
fn angle(positions: &[Point3<f64>], polygon: &[u32], k: usize) -> f64 {
    let n = polygon.len();
    let p = |k: usize| positions[polygon[k % n] as usize];
    let side = |to: usize| {
        let side = p(to) - p(k);
        (side / side.amax()).try_normalize(0.0)
    };
    match (side(k + 1), side(k + n - 1)) {
        (Some(a), Some(b)) => a.angle(&b),
        _ => 0.0,
    }
}

/// Rotates a normal with the surface; `None` if that changes nothing or one of the surface
/// normals is zero.
fn turned(normal: [f64; 3], old: Vector3<f64>, new: Vector3<f64>) -> Option<[f64; 3]> {
    if old == new || old.norm_squared() == 0.0 || new.norm_squared() == 0.0 {
        return None;
    }
    let normal = Vector3::from(normal);
    let result = match Rotation3::rotation_between(&old, &new) {
        Some(rotation) => rotation * normal,
        // Rotated by a half turn, about any axis in the surface.
        None => -normal,
    };
    let result: [f64; 3] = result.into();
    result.iter().all(|x| x.is_finite()).then_some(result)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attributes::{CornerProperty, Property};

    /// Two squares that share the edge 1–4; the move folds up the right one.
    fn fold() -> (FaceList, [Vec<Point3<f64>>; 2]) {
        let faces = [[0u32, 1, 4, 3], [1, 2, 5, 4]].iter().collect();
        let flat = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let before = vec![
            flat(0.0, 0.0),
            flat(1.0, 0.0),
            flat(2.0, 0.0),
            flat(0.0, 1.0),
            flat(1.0, 1.0),
            flat(2.0, 1.0),
        ];
        let mut after = before.clone();
        after[2] = Point3::new(1.0, 0.0, 1.0);
        after[5] = Point3::new(1.0, 1.0, 1.0);
        (faces, [before, after])
    }

    fn close(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-12)
    }

    #[test]
    fn vertex_normals_turn_where_the_surface_did() {
        let (faces, [before, after]) = fold();
        // Twice unit length and pointing inward: the author's choice must be preserved.
        let attributes = Attributes {
            vertices: vec![Property {
                name: NORMAL.into(),
                components: 3,
                values: Values::F64([0.0, 0.0, -2.0].repeat(6)),
            }],
            ..Attributes::default()
        };
        let changes = Normals::turned(&attributes, &faces, &before, &after);
        let numbers: Vec<u32> = changes.vertices.iter().map(|&(v, _)| v).collect();
        assert_eq!(numbers, [1, 2, 4, 5]);
        let half = 2.0f64.sqrt();
        assert!(close(changes.vertices[0].1, [half, 0.0, -half]));
        assert!(close(changes.vertices[1].1, [2.0, 0.0, 0.0]));
        let mut changed = attributes.clone();
        changes.apply(&mut changed);
        assert_eq!(changed.vertices[0].values.get(0), Some(0.0));
        assert!((changed.vertices[0].values.get(6).unwrap() - 2.0).abs() < 1e-12);
        // Nothing moved, so nothing changes.
        assert_eq!(
            Normals::turned(&attributes, &faces, &before, &before),
            Normals::default()
        );
    }

    #[test]
    fn corners_that_shared_a_normal_part() {
        let (faces, [before, after]) = fold();
        let attributes = Attributes {
            corners: vec![CornerProperty {
                name: NORMAL.into(),
                components: 3,
                values: Values::F64(vec![0.0, 0.0, 1.0]),
                indices: vec![0, 0, 0, 0, 0, 0, NONE, 0],
            }],
            ..Attributes::default()
        };
        let changes = Normals::turned(&attributes, &faces, &before, &after).corners;
        // The first corner is not rotated and keeps the entry.
        assert!(changes.changed.is_empty());
        let corners: Vec<u32> = changes.corners.iter().map(|&(c, _)| c).collect();
        assert_eq!(corners, [1, 2, 4, 5, 7]);
        let mut changed = attributes;
        Normals {
            corners: changes,
            ..Normals::default()
        }
        .apply(&mut changed);
        assert_eq!(changed.misfit(6, 2, 8), None);
        let p = &changed.corners[0];
        let normal = |corner: usize| triple(&p.values, p.indices[corner]).unwrap();
        assert_eq!(normal(0), [0.0, 0.0, 1.0]);
        assert!(close(normal(5), [-1.0, 0.0, 0.0]));
        assert!(close(normal(1), normal(4)));
    }

    #[test]
    fn surfaces_that_touch_do_not_turn_each_other() {
        let (_, [mut before, mut after]) = fold();
        let faces = [[0u32, 1, 4, 3], [1, 2, 5, 4], [6, 7, 10, 9], [7, 8, 11, 10]];
        let faces = faces.iter().collect();
        // A second sheet on top of the first, which does not move.
        before.extend_from_within(..);
        after.extend_from_slice(&before[6..]);
        let up = [0.0, 0.0, 1.0];
        let attributes = Attributes {
            corners: vec![CornerProperty {
                name: NORMAL.into(),
                components: 3,
                values: Values::F64(up.to_vec()),
                indices: vec![0; 16],
            }],
            ..Attributes::default()
        };
        let changes = Normals::turned(&attributes, &faces, &before, &after).corners;
        assert!(
            changes.corners.iter().all(|&(corner, _)| corner < 8),
            "{changes:?}"
        );
        assert!(changes.corners.iter().any(|&(corner, _)| corner == 5));
    }

    #[test]
    fn rounding_and_far_places_turn_nothing_wrong() {
        // A fan and its back: the normals cancel at every vertex.
        let n = 11;
        let point = |k: u32| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 11.0).sin_cos();
            Point3::new(cos, sin, 0.1 * f64::from(k % 3))
        };
        let mut before = vec![Point3::new(0.1, 0.2, 0.3)];
        before.extend((0..n).map(point));
        let faces = (0..n)
            .flat_map(|k| {
                let (a, b) = (1 + k, 1 + (k + 1) % n);
                [[0, a, b], [0, b, a]]
            })
            .collect();
        let mut after = before.clone();
        after[0].z = 0.7;
        let attributes = Attributes {
            vertices: vec![Property {
                name: NORMAL.into(),
                components: 3,
                values: Values::F64([0.0, 0.0, 1.0].repeat(12)),
            }],
            ..Attributes::default()
        };
        let changes = Normals::turned(&attributes, &faces, &before, &after);
        assert_eq!(changes, Normals::default());

        // Directions must be correct even if squares overflow.
        let (faces, [before, after]) = fold();
        for size in [1e200, 1e-200] {
            let [before, after] =
                [&before, &after].map(|points| points.iter().map(|p| p * size).collect::<Vec<_>>());
            let attributes = Attributes {
                vertices: vec![Property {
                    name: NORMAL.into(),
                    components: 3,
                    values: Values::F64([0.0, 0.0, 1.0].repeat(6)),
                }],
                ..Attributes::default()
            };
            let changes = Normals::turned(&attributes, &faces, &before, &after);
            assert!(
                close(changes.vertices[1].1, [-1.0, 0.0, 0.0]),
                "{changes:?}"
            );
        }
    }
}
