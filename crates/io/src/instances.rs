//! Copies of a mesh that nodes show at additional places, for formats without nodes.
//!
//! A document contains a mesh once, at its first instance. In a format without nodes, the faces
//! of every further instance follow all others, with their own vertices.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::{Point3, Vector3};

use crate::attributes::{Attributes, NONE, NORMAL};
use crate::error::IoError;
use crate::faces::FaceList;
use crate::parsed::Part;
use crate::placement::{Instance, Placement};
use crate::remap::Remap;
use crate::source::{Mesh, SourceFile};

/// A mesh with all its instances.
pub(crate) struct Expanded<'a> {
    pub(crate) positions: Cow<'a, [Point3<f64>]>,
    pub(crate) faces: Cow<'a, FaceList>,
    pub(crate) attributes: Cow<'a, Attributes>,
    /// For each vertex, the first vertex that it is welded to; may be empty.
    pub(crate) places: Cow<'a, [u32]>,
}

impl<'a> Expanded<'a> {
    /// Appends the instances to the mesh of a source.
    pub(crate) fn new(
        source: Option<&dyn SourceFile>,
        mesh: Mesh<'a>,
        parts: &[Part],
        attributes: Cow<'a, Attributes>,
        places: Cow<'a, [u32]>,
    ) -> Result<Self, IoError> {
        let mut copies = Copies::new(mesh, &places);
        if let Some(source) = source {
            source.instances(&mut |instance| {
                if let Some(part) = parts.get(instance.part) {
                    copies.add(part.faces.clone(), &instance);
                }
                Ok(())
            })?;
        }
        if copies.ranges.is_empty() {
            return Ok(Self {
                positions: Cow::Borrowed(mesh.positions),
                faces: Cow::Borrowed(mesh.faces),
                attributes,
                places,
            });
        }
        let Copies {
            remap,
            positions,
            places: new_places,
            ranges,
            ..
        } = copies;
        let mut attributes = attributes.remapped(&remap);
        if let Some(normals) = attributes.vertices.iter_mut().find(|p| p.name == NORMAL) {
            for (vertices, from, to) in &ranges {
                for v in vertices.clone() {
                    let value = |k: usize| normals.values.get(3 * v + k).unwrap_or(0.0);
                    let normal = from.normal_to_mesh(Vector3::new(value(0), value(1), value(2)));
                    let normal = to.normal_to_scene(normal);
                    (0..3).for_each(|k| normals.values.set(3 * v + k, normal[k]));
                }
            }
        }
        Ok(Self {
            positions: Cow::Owned(positions),
            faces: Cow::Owned(remap.faces),
            attributes: Cow::Owned(attributes),
            places: match places.is_empty() {
                true => Cow::Borrowed(&[]),
                false => Cow::Owned(new_places),
            },
        })
    }
}

struct Copies<'a> {
    mesh: Mesh<'a>,
    old_places: &'a [u32],
    remap: Remap,
    positions: Vec<Point3<f64>>,
    places: Vec<u32>,
    /// The vertex range of each copy, with its transforms.
    ranges: Vec<(Range<usize>, Placement, Placement)>,
    /// For each old vertex, its index in the current copy; for each old place, the first vertex
    /// of the current copy there.
    numbers: Vec<u32>,
    firsts: Vec<u32>,
}

impl<'a> Copies<'a> {
    fn new(mesh: Mesh<'a>, old_places: &'a [u32]) -> Self {
        Self {
            mesh,
            old_places,
            remap: Remap::default(),
            positions: Vec::new(),
            places: Vec::new(),
            ranges: Vec::new(),
            numbers: Vec::new(),
            firsts: Vec::new(),
        }
    }

    /// Starts with the unmodified mesh.
    fn begin(&mut self) {
        let num_vertices = self.mesh.positions.len();
        self.remap = Remap::identity(num_vertices, self.mesh.faces);
        self.positions = self.mesh.positions.to_vec();
        self.places = match self.old_places {
            [] => (0..num_vertices as u32).collect(),
            places => places.to_vec(),
        };
        self.numbers = vec![NONE; num_vertices];
        self.firsts = vec![NONE; num_vertices];
    }

    /// Adds the faces of an instance.
    fn add(&mut self, faces_of_mesh: Range<usize>, instance: &Instance<'_>) {
        if self.ranges.is_empty() {
            self.begin();
        }
        let faces = self.mesh.faces;
        let start = self.positions.len();
        let mut corners: Vec<u32> = Vec::new();
        for face in faces_of_mesh.clone() {
            corners.extend(faces.get(face).unwrap_or(&[]));
        }
        // In the order of the mesh.
        let mut vertices = corners;
        vertices.sort_unstable();
        vertices.dedup();
        for &v in &vertices {
            let number = self.positions.len() as u32;
            self.numbers[v as usize] = number;
            let place = self.old_places.get(v as usize).copied().unwrap_or(v);
            let first = &mut self.firsts[place as usize];
            if *first == NONE {
                *first = number;
            }
            self.places.push(*first);
            self.remap.vertices.push(v);
            let p = self.mesh.positions[v as usize];
            self.positions.push(moved(p, instance));
        }
        let is_turned = instance.from.is_mirrored != instance.to.is_mirrored;
        for face in faces_of_mesh {
            let mut order: Vec<usize> = faces.corner_range(face).collect();
            if is_turned {
                // The first corner stays first.
                if let Some(rest) = order.get_mut(1..) {
                    rest.reverse();
                }
            }
            for corner in order {
                let v = faces.corners()[corner];
                self.remap.faces.push_corner(self.numbers[v as usize]);
                self.remap.corner_sources.push(corner as u32);
            }
            self.remap.faces.end_face();
            self.remap.face_sources.push(face as u32);
        }
        for &v in &vertices {
            let place = self.old_places.get(v as usize).copied().unwrap_or(v);
            self.firsts[place as usize] = NONE;
        }
        let range = start..self.positions.len();
        let (from, to) = (instance.from.clone(), instance.to.clone());
        self.ranges.push((range, from, to));
    }
}

/// Returns the position of a copy.
///
/// A vertex that has not moved is placed exactly where the scene puts it: the file stores it in
/// single precision, which the inverse transform recovers up to rounding.
fn moved(p: Point3<f64>, instance: &Instance<'_>) -> Point3<f64> {
    let local = instance.from.to_mesh(p);
    let single = local.map(|x| f64::from(x as f32));
    if instance.from.to_scene(single) == p {
        instance.to.to_scene(single)
    } else {
        instance.to.to_scene(local)
    }
}
