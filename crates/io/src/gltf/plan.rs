//! Assignment of the faces and vertices of a repaired mesh to primitives.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use cotan_halfedge::DisjointSets;

use super::GltfFile;
use super::geometry::{Block, Geometry, Piece};
use crate::attributes::NONE;
use crate::error::IoError;
use crate::remap::Remap;
use crate::source::Mesh;

/// The primitive of each new face, and the vertices that share an accessor.
pub(super) struct Plan {
    /// For each piece, its new faces.
    pub(super) faces: Vec<Range<usize>>,
    /// For each block, its group.
    pub(super) group_of: Vec<usize>,
    pub(super) groups: Vec<Group>,
}

/// New vertices in one accessor.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub(super) vertices: Range<usize>,
    /// `true` if these are the unchanged vertices of a block.
    pub(super) is_kept: bool,
}

impl Plan {
    pub(super) fn new(file: &GltfFile, remap: &Remap, mesh: Mesh<'_>) -> Result<Self, IoError> {
        let geometry = &file.geometry;
        let faces = faces(&geometry.pieces, remap, mesh)?;
        let block_of = |v: u32| {
            let blocks = &geometry.blocks;
            let block = blocks.partition_point(|b| b.vertices.end <= v as usize);
            block.min(blocks.len().saturating_sub(1))
        };
        // Blocks whose vertices occur in the same piece form one group.
        let mut sets = DisjointSets::new(geometry.blocks.len());
        let mut first_piece = vec![usize::MAX; geometry.blocks.len()];
        for (piece, faces) in faces.iter().enumerate() {
            let mut first = None;
            for face in faces.clone() {
                for &v in remap.faces.get(face).unwrap_or(&[]) {
                    let Some(&old) = remap.vertices.get(v as usize) else {
                        return Err(unsupported("a vertex that does not exist"));
                    };
                    let block = block_of(old);
                    sets.join(*first.get_or_insert(block as u32), block as u32);
                    first_piece[block] = first_piece[block].min(piece);
                }
            }
        }
        // So do blocks whose new vertices are interleaved.
        let mut extents: BTreeMap<u32, Range<usize>> = BTreeMap::new();
        for (i, &old) in remap.vertices.iter().enumerate() {
            let extent = extents
                .entry(sets.root(block_of(old) as u32))
                .or_insert(i..i);
            extent.end = i + 1;
        }
        let mut sorted: Vec<(u32, Range<usize>)> = extents.into_iter().collect();
        sorted.sort_by_key(|(_, extent)| extent.start);
        let mut runs: Vec<(u32, Range<usize>, usize)> = Vec::new();
        let mut first_of_root = vec![usize::MAX; geometry.blocks.len()];
        for (block, &first) in (0u32..).zip(&first_piece) {
            let root = sets.root(block) as usize;
            first_of_root[root] = first_of_root[root].min(first);
        }
        for (root, extent) in sorted {
            let first = first_of_root[root as usize];
            match runs.last_mut() {
                // A group must have faces, and groups are in the order of their primitives.
                Some((last, run, last_first))
                    if extent.start < run.end || first == usize::MAX || first < *last_first =>
                {
                    sets.join(*last, root);
                    run.end = run.end.max(extent.end);
                    *last_first = first.min(*last_first);
                }
                _ => runs.push((root, extent, first)),
            }
        }
        // Joining may have moved the first primitive of a run before that of the previous run.
        let mut groups: Vec<(u32, Range<usize>, usize)> = Vec::new();
        for (root, extent, mut first) in runs {
            let mut extent = extent;
            while let Some((last, run, last_first)) = groups.pop_if(|(_, _, last)| first <= *last) {
                sets.join(last, root);
                extent.start = run.start;
                first = first.min(last_first);
            }
            groups.push((root, extent, first));
        }
        let numbers: HashMap<u32, usize> = groups
            .iter()
            .enumerate()
            .map(|(number, &(root, ..))| (sets.root(root), number))
            .collect();
        let group_of: Vec<usize> = (0..geometry.blocks.len() as u32)
            .map(|b| numbers.get(&sets.root(b)).copied().unwrap_or(usize::MAX))
            .collect();
        let groups = groups.into_iter().map(|(_, vertices, _)| Group {
            is_kept: is_kept(
                &geometry.blocks,
                &remap.vertices[vertices.clone()],
                block_of,
            ),
            vertices,
        });
        let mut plan = Self {
            faces,
            groups: groups.collect(),
            group_of,
        };
        for (piece, faces) in geometry.pieces.iter().zip(&plan.faces) {
            let Some(group) = plan.groups.get_mut(plan.group_of[piece.block]) else {
                continue;
            };
            let old = remap.vertices.get(group.vertices.start);
            group.is_kept &= faces.is_empty() || old.is_some_and(|&v| block_of(v) == piece.block);
        }
        plan.part_from_others(geometry, remap, mesh);
        plan.check_placements(&geometry.blocks)?;
        Ok(plan)
    }

    /// Marks groups as not kept if their faces change and other blocks share their accessor. The
    /// sharing depends on the faces, and must be the same when the file is read again.
    fn part_from_others(&mut self, geometry: &Geometry, remap: &Remap, mesh: Mesh<'_>) {
        let mut counts: HashMap<usize, usize> = HashMap::new();
        for block in &geometry.blocks {
            *counts.entry(block.layout.accessor).or_default() += 1;
        }
        for (number, piece) in geometry.pieces.iter().enumerate() {
            let block = &geometry.blocks[piece.block];
            let is_shared = counts.get(&block.layout.accessor) > Some(&1);
            if is_shared && !self.has_same_faces(number, piece, block, remap, mesh) {
                let group = self.group_of[piece.block];
                if let Some(group) = self.groups.get_mut(group) {
                    group.is_kept = false;
                }
            }
        }
    }

    /// Returns `true` if the faces of a piece are unchanged, as indices within its vertices.
    pub(super) fn has_same_faces(
        &self,
        number: usize,
        piece: &Piece,
        block: &Block,
        remap: &Remap,
        mesh: Mesh<'_>,
    ) -> bool {
        let faces = self.faces[number].clone();
        let Some(group) = self.groups.get(self.group_of[piece.block]) else {
            return false;
        };
        let shift = |v: u32, start: usize| (v as usize).checked_sub(start);
        faces.len() == piece.faces.len()
            && faces.zip(piece.faces.clone()).all(|(new, old)| {
                let new = remap.faces.get(new).unwrap_or(&[]);
                let old = mesh.faces.get(old).unwrap_or(&[]);
                new.len() == old.len()
                    && new.iter().zip(old).all(|(&new, &old)| {
                        shift(new, group.vertices.start) == shift(old, block.vertices.start)
                    })
            })
    }

    /// Checks that all vertices in one accessor have the same placement.
    fn check_placements(&self, blocks: &[Block]) -> Result<(), IoError> {
        let mut first: Vec<Option<&Block>> = vec![None; self.groups.len()];
        for (block, &group) in blocks.iter().zip(&self.group_of) {
            let Some(first) = first.get_mut(group) else {
                continue;
            };
            if first.get_or_insert(block).placement != block.placement {
                return Err(unsupported("meshes that are grown together across nodes"));
            }
        }
        Ok(())
    }
}

/// Returns `true` if the new vertices are exactly those of one block, in order.
fn is_kept(blocks: &[Block], vertices: &[u32], block_of: impl Fn(u32) -> usize) -> bool {
    let Some(block) = vertices.first().and_then(|&v| blocks.get(block_of(v))) else {
        return false;
    };
    vertices.len() == block.vertices.len()
        && vertices
            .iter()
            .zip(block.vertices.clone())
            .all(|(&a, b)| a as usize == b)
}

/// The new faces of each piece.
fn faces(pieces: &[Piece], remap: &Remap, mesh: Mesh<'_>) -> Result<Vec<Range<usize>>, IoError> {
    let piece_of = |face: usize| pieces.partition_point(|piece| piece.faces.end <= face);
    let mut faces = vec![0..0; pieces.len()];
    let mut current: Option<usize> = None;
    for (face, &source) in remap.face_sources.iter().enumerate() {
        if remap
            .faces
            .get(face)
            .is_none_or(|polygon| polygon.len() != 3)
        {
            return Err(unsupported("faces of more than three corners"));
        }
        let piece = if source == NONE {
            // A face that closes a hole is assigned to the piece of the preceding face, if that
            // belongs to the mesh with the hole. Faces of an old glTF are triangles.
            let corner = remap.faces.corner_range(face).start;
            let corner = remap.corner_sources.get(corner).copied().unwrap_or(NONE);
            let neighbour = piece_of(corner as usize / 3);
            let mesh_of = |piece: usize| pieces.get(piece).map(|p| p.mesh);
            current
                .filter(|&piece| {
                    mesh_of(piece) == mesh_of(neighbour) || mesh_of(neighbour).is_none()
                })
                .unwrap_or(neighbour)
        } else {
            piece_of(source as usize)
        };
        if piece >= pieces.len() || source != NONE && source as usize >= mesh.faces.len() {
            return Err(unsupported("a face that does not exist"));
        }
        if current.is_some_and(|current| piece < current) {
            return Err(unsupported("faces of its primitives in another order"));
        }
        if current != Some(piece) {
            faces[piece] = face..face;
            current = Some(piece);
        }
        faces[piece].end = face + 1;
    }
    Ok(faces)
}

/// The error for an unsupported repair.
pub(super) fn unsupported(what: &str) -> IoError {
    IoError::Unsupported {
        feature: format!("a glTF with {what}"),
        remedy: "convert the file to another format and repair that",
    }
}
