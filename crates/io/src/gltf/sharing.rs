//! Detection of primitives that share their vertices.
//!
//! Primitives that refer to one POSITION accessor share its vertices: they are parts of one
//! surface. They get separate vertices if these are at different places, or if the surface would
//! otherwise pass through itself:
//!
//! - Meshes that are placed differently.
//! - Meshes that have a face in common: the second is another use of the same data, not a
//!   duplicate of the first.
//! - Primitives of one mesh with a face in common, such as a coloured surface and an outline or a
//!   decal over it. They are *layers*, whose vertices are not welded to each other, whether they
//!   use the same accessors or copies. One common face is enough: if one layer was edited and the
//!   other was not, the unmoved faces still show that there are two.

use std::collections::{HashMap, HashSet, VecDeque};

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
    /// The only primitive with faces of the current mesh, until there is another.
    alone: Option<usize>,
    /// The layers of the current mesh, once it has two primitives.
    layers: Vec<Layer>,
    /// The groups of primitives that share a block, in primitive order, if decided beforehand.
    given: Option<VecDeque<usize>>,
    /// The block of each of these groups.
    groups: HashMap<usize, usize>,
}

/// The places of the triangles of a layer.
#[derive(Debug, Default)]
struct Layer {
    faces: HashSet<u64, RandomState>,
    /// The number of triangles at each edge; not counted for the first layer.
    edges: HashMap<u64, u32, RandomState>,
}

impl Layer {
    /// Returns `true` if none of these triangles is in the layer.
    fn is_free(&self, mut triangles: impl Iterator<Item = Triangle>) -> bool {
        !triangles.any(|triangle| self.faces.contains(&place(&triangle)))
    }

    /// Returns `true` if no edge would have more than two triangles.
    fn has_room(&self, edges: &HashMap<u64, u32, RandomState>) -> bool {
        let there = |edge| self.edges.get(edge).copied().unwrap_or(0);
        let mut edges = edges.iter().map(|(edge, &count)| (there(edge), count));
        edges.all(|(there, count)| there == 0 || there + count <= 2)
    }
}

/// The corners of a triangle.
type Triangle = [Point3<f64>; 3];

impl Sharing {
    /// Assigns primitives with faces to these groups, in primitive order.
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
    /// Returns the block for a primitive with this POSITION accessor and these corners, numbered
    /// within the accessor; a new one if none fits.
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

    /// Returns the layer of a primitive whose vertices are those of `block`.
    ///
    /// This is the first one if it has no face in common with any layer. Otherwise it is the
    /// first of the others with which it has no face in common and whose edges would have at most
    /// two triangles.
    fn layer(&mut self, block: usize, corners: &[u32]) -> u32 {
        let positions = &self.parsed.positions;
        let start = self.geometry.blocks[block].vertices.start;
        let (faces, _) = corners.as_chunks::<3>();
        let faces = faces.iter().filter(is_proper);
        let triangles = faces.map(|face| face.map(|v| positions[start + v as usize]));
        let sharing = &mut self.sharing;
        if sharing.layers.is_empty() {
            let Some(first) = sharing.alone else {
                sharing.alone = Some(self.geometry.pieces.len());
                return 0;
            };
            let first = self.geometry.pieces.get(first);
            let first = first.map_or(0..0, |piece| piece.faces.clone());
            let first = first.filter_map(|face| self.parsed.faces.get(face)?.first_chunk::<3>());
            let first = first.filter(is_proper);
            let first = first.map(|face| place(&face.map(|v| positions[v as usize])));
            sharing.layers.push(Layer {
                faces: first.collect(),
                ..Layer::default()
            });
        }
        let layers = &mut sharing.layers;
        // A primitive over any layer is not part of the first one, even if that layer's face has
        // since moved away.
        if layers.iter().all(|layer| layer.is_free(triangles.clone())) {
            layers[0].faces.extend(triangles.map(|t| place(&t)));
            return 0;
        }
        let mut edges = HashMap::default();
        for [a, b, c] in triangles.clone() {
            for edge in [[a, b], [b, c], [c, a]] {
                *edges.entry(place(&edge)).or_default() += 1;
            }
        }
        let fits = |layer: &Layer| layer.is_free(triangles.clone()) && layer.has_room(&edges);
        let found = layers.iter().skip(1).position(fits);
        let layer = found.map_or(layers.len(), |found| found + 1);
        if layer == layers.len() {
            layers.push(Layer::default());
        }
        layers[layer].faces.extend(triangles.map(|t| place(&t)));
        for (edge, count) in edges {
            *layers[layer].edges.entry(edge).or_default() += count;
        }
        layer as u32
    }

    /// Returns `true` if a primitive may use the vertices of a block: it has no face in common
    /// with another mesh there.
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

    /// Clears the layers of the previous mesh.
    pub(super) fn begin_mesh(&mut self) {
        self.sharing.alone = None;
        self.sharing.layers.clear();
    }
}

/// Returns `true` if a triangle has three distinct vertices. Others do not affect the shape.
fn is_proper(&[a, b, c]: &&[u32; 3]) -> bool {
    a != b && b != c && c != a
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// A hash of the positions of some points, independent of their order. It is the same for
/// different positions with a probability of 2⁻⁶⁴; two primitives are then misread as layers.
fn place(points: &[Point3<f64>]) -> u64 {
    let point = |p: &Point3<f64>| {
        // Negative and positive zero are the same position.
        let bits = p.coords.map(|x| (x + 0.0).to_bits());
        mixed(mixed(mixed(bits.x) ^ bits.y) ^ bits.z)
    };
    mixed(points.iter().map(point).fold(0, u64::wrapping_add))
}

/// The finalizer of SplitMix64 (Steele, Lea and Flood 2014): every output bit depends on every
/// input bit.
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
