//! Which primitives have their vertices in common.
//!
//! Primitives that name one POSITION accessor have the same vertices: they are parts of one
//! surface. They have vertices of their own where these are not at the same places, or where the
//! surface would run through itself:
//!
//! - Meshes that are placed differently.
//! - Meshes that have a face in common: the second is another use of the same data, not a
//!   duplicate of the first.
//! - Primitives of one mesh with the same faces, such as a coloured surface and an outline over
//!   it. They are *layers*, whose vertices are not welded to each other, whether they name the
//!   same accessors or copies.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};

use foldhash::fast::RandomState;
use nalgebra::Point3;

use super::accessor::Layout;
use super::geometry::Reader;
use crate::error::IoError;

/// The uses of POSITION accessors so far.
#[derive(Debug, Default)]
pub(super) struct Sharing {
    blocks: HashMap<u64, Vec<usize>>,
    /// The faces of blocks that several meshes use: their sorted corners, with the mesh.
    faces: HashMap<usize, HashMap<[u32; 3], usize, RandomState>>,
    /// The first primitive of the current mesh with so many faces, until there is another.
    alone: HashMap<usize, usize>,
    /// How many primitives of the current mesh have these faces.
    layers: HashMap<Signature, u32>,
    /// Which primitives share a block, in their order, where that was decided before.
    given: Option<VecDeque<usize>>,
    /// The block of each of these groups.
    groups: HashMap<usize, usize>,
}

/// A sum over the faces of a primitive by which those with the same faces are found, whatever
/// the order of faces and corners.
type Signature = [u64; 2];

impl Sharing {
    /// Primitives with faces share their vertices as these numbers say, in their order.
    pub(super) fn given(groups: impl Iterator<Item = usize>) -> Self {
        Self {
            given: Some(groups.collect()),
            ..Self::default()
        }
    }

    /// The blocks of an accessor.
    pub(super) fn blocks(&self, accessor: u64) -> &[usize] {
        self.blocks.get(&accessor).map_or(&[], Vec::as_slice)
    }
}

impl Reader<'_> {
    /// The block for a primitive with this POSITION accessor and these corners, counted within
    /// the accessor; a new one if none fits.
    pub(super) fn block_for(
        &mut self,
        mesh: usize,
        layout: Layout,
        corners: &[u32],
    ) -> Result<usize, IoError> {
        let accessor = layout.accessor as u64;
        let group = self.sharing.given.as_mut().and_then(VecDeque::pop_front);
        let placement = &self.placements.meshes[mesh];
        let alike: Vec<usize> = match group {
            Some(group) => self
                .sharing
                .groups
                .get(&group)
                .copied()
                .into_iter()
                .collect(),
            None => {
                let blocks = self.sharing.blocks(accessor).iter().copied();
                let is_alike = |&b: &usize| self.geometry.blocks[b].placement == *placement;
                blocks.filter(is_alike).collect()
            }
        };
        if let Some(&first) = alike.first() {
            let layer = self.layer(first, corners);
            for block in alike {
                let is_like = self.geometry.blocks[block].layer == layer;
                if group.is_some() || is_like && self.joins(block, mesh, corners) {
                    return Ok(block);
                }
            }
            let block = self.block(mesh, layout)?;
            self.geometry.blocks[block].layer = layer;
            self.sharing.blocks.entry(accessor).or_default().push(block);
            return Ok(block);
        }
        let block = self.block(mesh, layout)?;
        self.geometry.blocks[block].layer = self.layer(block, corners);
        self.sharing.blocks.entry(accessor).or_default().push(block);
        if let Some(group) = group {
            self.sharing.groups.insert(group, block);
        }
        Ok(block)
    }

    /// How many primitives of the mesh before this one have the same faces; its vertices are those
    /// of `block`.
    fn layer(&mut self, block: usize, corners: &[u32]) -> u32 {
        let (faces, _) = corners.as_chunks::<3>();
        let num_faces = faces.iter().filter(is_proper).count();
        if num_faces == 0 {
            return 0;
        }
        let positions = &self.parsed.positions;
        let first = match self.sharing.alone.entry(num_faces) {
            Entry::Vacant(entry) => {
                entry.insert(self.geometry.pieces.len());
                return 0;
            }
            Entry::Occupied(mut entry) => std::mem::replace(entry.get_mut(), usize::MAX),
        };
        if let Some(first) = self.geometry.pieces.get(first) {
            let faces = first.faces.clone();
            let faces = faces.filter_map(|face| self.parsed.faces.get(face)?.first_chunk::<3>());
            let faces = faces.filter(is_proper);
            let signature = sum(faces.map(|face| face.map(|v| positions[v as usize])));
            self.sharing.layers.insert(signature, 1);
        }
        let start = self.geometry.blocks[block].vertices.start;
        let faces = faces.iter().filter(is_proper);
        let signature = sum(faces.map(|face| face.map(|v| positions[start + v as usize])));
        let layers = self.sharing.layers.entry(signature).or_default();
        *layers += 1;
        *layers - 1
    }

    /// Whether a primitive may have the vertices of a block: none of its faces is one of another
    /// mesh there.
    fn joins(&mut self, block: usize, mesh: usize, corners: &[u32]) -> bool {
        let pieces = &self.geometry.blocks[block].pieces;
        let pieces = pieces.iter().map(|&piece| &self.geometry.pieces[piece]);
        let has_others = pieces.clone().any(|piece| piece.mesh != mesh);
        if !has_others && !self.sharing.faces.contains_key(&block) {
            return true;
        }
        let start = self.geometry.blocks[block].vertices.start as u32;
        let faces = self.sharing.faces.entry(block).or_insert_with(|| {
            let mut faces = HashMap::default();
            for piece in pieces {
                for face in piece.faces.clone() {
                    if let Some(&[a, b, c]) = self.parsed.faces.get(face) {
                        let face = sorted([a - start, b - start, c - start]);
                        faces.entry(face).or_insert(piece.mesh);
                    }
                }
            }
            faces
        });
        let (triangles, _) = corners.as_chunks::<3>();
        let is_foreign = |face: &[u32; 3]| faces.get(&sorted(*face)).is_some_and(|&m| m != mesh);
        if triangles.iter().any(is_foreign) {
            return false;
        }
        for face in triangles {
            faces.entry(sorted(*face)).or_insert(mesh);
        }
        true
    }

    /// Forgets the layers of the mesh before.
    pub(super) fn begin_mesh(&mut self) {
        self.sharing.alone.clear();
        self.sharing.layers.clear();
    }
}

/// Whether a triangle has three vertices; what has fewer does not make another shape of it.
fn is_proper(&[a, b, c]: &&[u32; 3]) -> bool {
    a != b && b != c && c != a
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

fn sum(faces: impl Iterator<Item = [Point3<f64>; 3]>) -> Signature {
    let mut sum = [0u64; 2];
    for face in faces {
        let corner = |p: Point3<f64>| {
            // A negative zero is the same place as a positive one.
            let bits = p.coords.map(|x| (x + 0.0).to_bits());
            mixed(mixed(mixed(bits.x) ^ bits.y) ^ bits.z)
        };
        let face = face.map(corner).into_iter().fold(0, u64::wrapping_add);
        sum[0] = sum[0].wrapping_add(mixed(face));
        sum[1] = sum[1].wrapping_add(mixed(face ^ 0x9e37_79b9_7f4a_7c15));
    }
    sum
}

/// The finalizer of SplitMix64 (Steele, Lea and Flood 2014): every bit depends on every bit.
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
