//! The mesh under repair, with the origin of each of its elements.

use nalgebra::Point3;

use super::{Change, Repaired, Toggle};
use crate::attributes::NONE;
use crate::cuts::Cuts;
use crate::defects::{duplicate_faces, shells};
use crate::document::Document;
use crate::error::IoError;
use crate::faces::FaceList;
use crate::remap::Remap;
use crate::topology::Topology;
use crate::weld::Weld;

pub(super) struct Work<'a> {
    pub(super) document: &'a Document,
    /// `true` if several vertices may be at one place: the format splits vertices, or they are
    /// welded in place.
    is_split: bool,
    /// `true` if vertices that were one no longer are.
    is_unwelded: bool,
    /// The document vertex of each vertex. Copies follow the original vertices, then come the
    /// vertices that fill holes, with a vertex next to the hole.
    pub(super) sources: Vec<u32>,
    /// The positions of the vertices that fill holes, which are the last ones.
    added: Vec<Point3<f64>>,
    /// For each vertex, the first vertex at its place.
    pub(super) places: Vec<u32>,
    /// The place of each document vertex before faces were separated.
    welded: Vec<u32>,
    /// For each document vertex, `true` if it was merged into another or dropped with its part.
    is_gone: Vec<bool>,
    pub(super) faces: FaceList,
    /// The document face of each face; [`NONE`] if it fills a hole.
    pub(super) face_sources: Vec<u32>,
    pub(super) corner_sources: Vec<u32>,
    /// For each document face, `true` if it was reversed.
    is_turned: Vec<bool>,
    pub(super) changes: Vec<Change>,
}

impl<'a> Work<'a> {
    pub(super) fn new(document: &'a Document) -> Result<Self, IoError> {
        let identity = Remap::identity(document.positions().len(), document.faces());
        let places = document.places(Weld::AsFormat)?;
        let is_split = !places.is_empty();
        let places = match is_split {
            true => places.into_owned(),
            false => identity.vertices.clone(),
        };
        Ok(Self {
            document,
            is_split,
            is_unwelded: false,
            is_gone: vec![false; places.len()],
            welded: places.clone(),
            places,
            sources: identity.vertices,
            added: Vec::new(),
            is_turned: vec![false; identity.faces.len()],
            faces: identity.faces,
            face_sources: identity.face_sources,
            corner_sources: identity.corner_sources,
            changes: Vec::new(),
        })
    }

    /// The place of every corner.
    pub(super) fn at(&self) -> Vec<u32> {
        let corners = self.faces.corners().iter();
        corners.map(|&v| self.places[v as usize]).collect()
    }

    pub(super) fn points(&self) -> Vec<Point3<f64>> {
        let positions = self.document.positions();
        let old = self.sources[..self.first_added()].iter();
        let old = old.map(|&v| positions[v as usize]);
        old.chain(self.added.iter().copied()).collect()
    }

    /// The index of the first vertex that fills a hole, or the number of vertices if there is
    /// none.
    fn first_added(&self) -> usize {
        self.sources.len() - self.added.len()
    }

    /// Adds a vertex to a hole.
    ///
    /// It has the data of the vertex `source`, except for the position.
    pub(super) fn add_vertex(&mut self, source: u32, position: Point3<f64>) -> u32 {
        let vertex = self.sources.len() as u32;
        self.sources.push(self.sources[source as usize]);
        self.places.push(vertex);
        self.added.push(position);
        vertex
    }

    /// The document index of a vertex.
    pub(super) fn vertex(&self, vertex: u32) -> usize {
        self.sources[vertex as usize] as usize
    }

    /// The document index of a face.
    pub(super) fn face(&self, face: u32) -> usize {
        self.face_sources[face as usize] as usize
    }

    /// Reduces each face to the listed corners. A face without corners is removed.
    pub(super) fn select(&mut self, corners: &FaceList) {
        let mut faces = FaceList::new();
        let (mut face_sources, mut corner_sources) = (Vec::new(), Vec::new());
        for (face, corners) in corners.iter().enumerate() {
            if corners.is_empty() {
                continue;
            }
            for &corner in corners {
                faces.push_corner(self.faces.corners()[corner as usize]);
                corner_sources.push(self.corner_sources[corner as usize]);
            }
            faces.end_face();
            face_sources.push(self.face_sources[face]);
        }
        self.faces = faces;
        self.face_sources = face_sources;
        self.corner_sources = corner_sources;
    }

    pub(super) fn weld(&mut self, weld: Weld, keeps: Toggle) -> Result<(), IoError> {
        let places = self.document.places(weld)?;
        if places.is_empty() {
            self.is_unwelded = std::mem::replace(&mut self.is_split, false);
            self.places.clone_from(&self.sources);
            self.welded.clone_from(&self.sources);
            return Ok(());
        }
        self.is_split |= keeps.is_on();
        for (vertex, &into) in places.iter().enumerate() {
            let was_alone = self.places[vertex] as usize == vertex;
            if was_alone && into as usize != vertex {
                self.is_gone[vertex] = !self.is_split;
                let into = into as usize;
                self.changes.push(Change::MergedVertex { vertex, into });
            }
        }
        if !self.is_split {
            let moved = |polygon: &[u32]| -> Vec<u32> {
                polygon.iter().map(|&v| places[v as usize]).collect()
            };
            self.faces = self.faces.iter().map(moved).collect();
        }
        self.places = places.into_owned();
        self.welded.clone_from(&self.places);
        Ok(())
    }

    pub(super) fn drop_degenerate(&mut self) {
        let at = self.at();
        let outlines = crate::topology::outlines(&self.faces, &at);
        for (face, outline) in (0u32..).zip(outlines.iter()) {
            let lost = self.faces.corner_range(face as usize).len() - outline.len();
            let face = self.face(face);
            match (outline.len(), lost) {
                (0, _) => self.changes.push(Change::DroppedDegenerate { face }),
                (_, 0) => {}
                (_, num_corners) => self.changes.push(Change::TrimmedFace { face, num_corners }),
            }
        }
        self.select(&outlines);
    }

    pub(super) fn drop_zero_area(&mut self) {
        let at = self.at();
        let topology = Topology::new(&self.faces, &at);
        let cuts = Cuts::new(
            &topology,
            self.faces.corners(),
            &self.places,
            &self.points(),
        );
        let mut is_dropped = vec![false; self.faces.len()];
        for (face, _) in cuts.flat.into_iter().filter(|&(_, is_whole)| is_whole) {
            is_dropped[face as usize] = true;
            let face = self.face(face);
            self.changes.push(Change::DroppedZeroArea { face });
        }
        self.drop(&is_dropped);
    }

    pub(super) fn drop_duplicates(&mut self) {
        let at = self.at();
        let mut is_dropped = vec![false; self.faces.len()];
        for (face, repeats) in duplicate_faces(&Topology::new(&self.faces, &at)) {
            is_dropped[face as usize] = true;
            let (face, repeats) = (self.face(face), self.face(repeats));
            self.changes
                .push(Change::DroppedDuplicate { face, repeats });
        }
        self.drop(&is_dropped);
    }

    fn drop(&mut self, is_dropped: &[bool]) {
        if is_dropped.contains(&true) {
            let corners = |face: usize| match is_dropped[face] {
                true => Vec::new(),
                false => self.faces.corner_range(face).map(|c| c as u32).collect(),
            };
            let kept: FaceList = (0..self.faces.len()).map(corners).collect();
            self.select(&kept);
        }
    }

    /// Drops faces, and the vertices that no other face uses.
    pub(super) fn drop_with_vertices(&mut self, is_dropped: &[bool]) {
        let polygons = self.faces.iter().zip(is_dropped);
        for (polygon, _) in polygons.filter(|(_, is_dropped)| **is_dropped) {
            for &v in polygon {
                if let Some(is_gone) = self.is_gone.get_mut(v as usize) {
                    *is_gone = true;
                }
            }
        }
        self.drop(is_dropped);
    }

    /// Reverses faces, keeping their first corner first.
    fn turn(&mut self, is_turned: &[bool]) {
        if !is_turned.contains(&true) {
            return;
        }
        let corners = |face: usize| {
            let mut corners: Vec<u32> = self.faces.corner_range(face).map(|c| c as u32).collect();
            if is_turned[face] {
                corners[1..].reverse();
            }
            corners
        };
        let turned: FaceList = (0..self.faces.len()).map(corners).collect();
        self.select(&turned);
        for (&source, &is_turned) in self.face_sources.iter().zip(is_turned) {
            self.is_turned[source as usize] ^= is_turned;
        }
    }

    /// Orients neighbours consistently.
    ///
    /// One-sided components are oriented as far as possible if their edges may be split, and left
    /// unchanged otherwise.
    pub(super) fn orient(&mut self, edges: Toggle) {
        let at = self.at();
        let topology = Topology::new(&self.faces, &at);
        let orientation = topology.orientation(&topology.pairs());
        let mut balance = vec![0i64; orientation.is_orientable.len()];
        for (&component, &is_turned) in orientation.component.iter().zip(&orientation.is_turned) {
            if component != NONE {
                balance[component as usize] += if is_turned { 1 } else { -1 };
            }
        }
        let is_turned: Vec<bool> = orientation
            .component
            .iter()
            .zip(&orientation.is_turned)
            .map(|(&component, &is_turned)| {
                component != NONE
                    && (orientation.is_orientable[component as usize] || edges.is_on())
                    && is_turned != (balance[component as usize] > 0)
            })
            .collect();
        self.turn(&is_turned);
    }

    /// Reverses closed components that point inward, and the components inside them.
    pub(super) fn turn_outward(&mut self) {
        let at = self.at();
        let topology = Topology::new(&self.faces, &at);
        let mut sets = topology.components();
        let roots: Vec<u32> = (0..self.faces.len() as u32).map(|f| sets.root(f)).collect();
        let points = self.points();
        let point = |corner: u32| points[topology.place(corner) as usize];
        let shells = shells(&topology, &roots, roots.len(), point);
        let mut is_inward = vec![false; roots.len()];
        for shell in &shells {
            let outermost = shell.outer.map_or(shell, |outer| &shells[outer]);
            is_inward[shell.component as usize] = outermost.is_inward;
        }
        let is_turned: Vec<bool> = roots.iter().map(|&root| is_inward[root as usize]).collect();
        self.turn(&is_turned);
    }

    /// Builds the repaired document.
    pub(super) fn finish(mut self, compact: Toggle) -> Result<Repaired, IoError> {
        let is_used = self.faces.used_vertices(self.sources.len());
        let drops_unused = compact.is_on() && !self.faces.is_empty();
        let num_old = self.document.positions().len();
        let is_kept = |v: usize| {
            // Copies are made only for faces.
            let is_gone = self.is_gone.get(v).is_none_or(|is_gone| *is_gone);
            is_used[v] || !(drops_unused || is_gone)
        };
        let stretch = self.document.stretch_of();
        let mut order: Vec<u32> = (0..self.sources.len() as u32)
            .filter(|&v| is_kept(v as usize))
            .collect();
        // Copies follow the vertices of their part.
        order.sort_by_key(|&v| (stretch(self.sources[v as usize] as usize), v));
        let mut numbers = vec![NONE; self.sources.len()];
        for (number, &v) in (0u32..).zip(&order) {
            numbers[v as usize] = number;
        }
        let mut face_order: Vec<usize> = (0..self.faces.len()).collect();
        face_order.sort_by_key(|&face| self.part_of_face(face));
        let mut remap = Remap {
            vertices: order.iter().map(|&v| self.sources[v as usize]).collect(),
            ..Remap::default()
        };
        for face in face_order {
            for corner in self.faces.corner_range(face) {
                let v = self.faces.corners()[corner];
                remap.faces.push_corner(numbers[v as usize]);
                remap.corner_sources.push(self.corner_sources[corner]);
            }
            remap.faces.end_face();
            remap.face_sources.push(self.face_sources[face]);
        }
        let places = match self.is_split {
            true => self.final_places(&order),
            false => Vec::new(),
        };
        let dropped = (0..num_old).filter(|&v| !self.is_gone[v] && numbers[v] == NONE);
        let dropped: Vec<_> = dropped
            .map(|vertex| Change::DroppedVertex { vertex })
            .collect();
        self.list_turned();
        self.list_split(&numbers, &is_used);
        self.changes.extend(dropped);
        let vertex_sources = remap.vertices.iter().map(|&v| v as usize).collect();
        let of_file = |&face: &u32| (face != NONE).then_some(face as usize);
        let face_sources = remap.face_sources.iter().map(of_file).collect();
        // Holes that were merely kept are no reason for a new document.
        let is_same = self
            .changes
            .iter()
            .all(|change| matches!(change, Change::KeptHole { .. }));
        let mut document = match is_same && !self.is_unwelded {
            true => self.document.clone(),
            false => self.document.remapped(&remap, places)?,
        };
        let added_numbers = numbers[self.first_added()..].iter();
        let mut added_vertices: Vec<usize> = added_numbers.map(|&v| v as usize).collect();
        for (&vertex, &position) in added_vertices.iter().zip(&self.added) {
            document.set_position(vertex, position)?;
        }
        added_vertices.sort_unstable();
        Ok(Repaired {
            document,
            changes: self.changes,
            vertex_sources,
            added_vertices,
            face_sources,
        })
    }

    /// Returns the part of a face: that of its original face or, if it fills a hole, of an
    /// original face next to it. Its vertices may lie in another part.
    fn part_of_face(&self, face: usize) -> usize {
        let parts = self.document.parts();
        if parts.len() == 1 {
            return 0;
        }
        let old_face = match self.face_sources[face] {
            NONE => {
                let first = self.faces.corner_range(face).start;
                let corner = self.corner_sources[first] as usize;
                self.document.faces().face_of(corner)
            }
            old => old as usize,
        };
        parts.partition_point(|part| part.faces.end <= old_face)
    }

    /// For each vertex of the new document, the first vertex at its place.
    fn final_places(&self, order: &[u32]) -> Vec<u32> {
        let mut first = vec![NONE; self.sources.len()];
        let mut place = |(number, &v): (u32, &u32)| {
            let first = &mut first[self.places[v as usize] as usize];
            if *first == NONE {
                *first = number;
            }
            *first
        };
        (0u32..).zip(order).map(&mut place).collect()
    }

    fn list_turned(&mut self) {
        let turned = self.face_sources.iter().map(|&face| face as usize);
        let turned = turned.filter(|&face| face != NONE as usize && self.is_turned[face]);
        let turned: Vec<_> = turned.map(|face| Change::TurnedFace { face }).collect();
        self.changes.extend(turned);
    }

    fn list_split(&mut self, numbers: &[u32], is_used: &[bool]) {
        let mut copies: Vec<(u32, usize)> = (self.welded.len()..self.first_added())
            .filter(|&v| numbers[v] != NONE)
            .map(|v| (self.sources[v], numbers[v] as usize))
            .collect();
        copies.sort_unstable();
        for of_one in copies.chunk_by(|a, b| a.0 == b.0) {
            self.changes.push(Change::SplitVertex {
                vertex: of_one[0].0 as usize,
                copies: of_one.iter().map(|&(_, number)| number).collect(),
            });
        }
        if !self.is_split {
            return;
        }
        let used = (0..self.first_added()).filter(|&v| is_used[v]);
        let mut parted: Vec<(u32, u32)> = used
            .map(|v| (self.welded[self.sources[v] as usize], self.places[v]))
            .collect();
        parted.sort_unstable();
        parted.dedup();
        for of_one in parted.chunk_by(|a, b| a.0 == b.0) {
            if of_one.len() > 1 {
                self.changes.push(Change::PartedPlace {
                    vertex: of_one[0].0 as usize,
                    num_places: of_one.len(),
                });
            }
        }
    }
}
