//! The file of a mesh made of this one's vertices and faces, which is the result of every repair.
//!
//! Changed primitives get new accessors with the elements of the new vertices, copied byte by
//! byte from the old ones, and new indices. Unchanged primitives keep their accessors. If the new
//! order of vertices or a face requires it, primitives are made to share one set of vertices.
//!
//! Changes that glTF cannot represent without moving or renumbering vertices are rejected: the
//! removal of a mesh that determined the placement of shared vertices, or a change in the order
//! of faces across primitives.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;

use super::GltfFile;
use super::accessor::{Component, Layout};
use super::geometry::Piece;
use super::json::member;
use super::plan::{Plan, unsupported};
use super::sharing::Sharing;
use super::write::{Rewrite, array, limits};
use crate::error::IoError;
use crate::limits::Limits;
use crate::remap::Remap;
use crate::source::Mesh;

/// Builds the file of the new mesh.
pub(super) fn rebuild(file: &GltfFile, remap: &Remap, mesh: Mesh<'_>) -> Result<GltfFile, IoError> {
    let plan = Plan::new(file, remap, mesh)?;
    let mut rebuild = Rebuild {
        file,
        remap,
        plan: &plan,
        rewrite: Rewrite::new(file)?,
        made: HashMap::new(),
        spans: BTreeMap::new(),
    };
    let mut changes = Vec::new();
    for (number, piece) in file.geometry.pieces.iter().enumerate() {
        if !plan.faces[number].is_empty() {
            changes.extend(rebuild.piece(number, piece, mesh)?);
        }
    }
    rebuild.edit(changes)?;
    rebuild.drop_pieces()?;
    let bytes = rebuild.rewrite.finish(file.container.is_binary)?;
    // A repair may exceed the limits that the original file met, except for the depth.
    let unbounded = Limits {
        max_depth: file.limits.max_depth,
        ..Limits::NONE
    };
    let pieces = file.geometry.pieces.iter().zip(&plan.faces);
    let pieces = pieces.filter(|(_, faces)| !faces.is_empty());
    let sharing = Sharing::given(pieces.map(|(piece, _)| plan.group_of[piece.block]));
    let (mut new, parsed) = GltfFile::read_shared(bytes, &unbounded, file.files.clone(), sharing)?;
    new.limits = file.limits;
    let positions = remap
        .vertices
        .iter()
        .map(|&v| mesh.positions.get(v as usize));
    // Everything else depends on this; a result that the plan did not foresee is rejected and not
    // written.
    if parsed.faces != remap.faces || !parsed.positions.iter().map(Some).eq(positions) {
        return Err(unsupported("vertices or faces in this order"));
    }
    Ok(new)
}

/// The location of an accessor reference in a primitive.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
enum Slot {
    Attribute(String),
    Target(usize, String),
}

/// New accessors of a primitive.
struct Change {
    mesh: usize,
    primitive: usize,
    slots: Vec<(Slot, usize)>,
    indices: usize,
}

struct Rebuild<'a> {
    file: &'a GltfFile,
    remap: &'a Remap,
    plan: &'a Plan,
    rewrite: Rewrite<'a>,
    /// New accessors that primitives share, by group, block, slot and old accessor.
    made: HashMap<(usize, usize, Slot, u64), usize>,
    /// The primitives of the meshes in the JSON.
    spans: BTreeMap<usize, Vec<Range<usize>>>,
}

impl Rebuild<'_> {
    /// Returns the new accessors of a piece, if anything in it changed.
    fn piece(
        &mut self,
        number: usize,
        piece: &Piece,
        mesh: Mesh<'_>,
    ) -> Result<Option<Change>, IoError> {
        let faces = self.plan.faces[number].clone();
        let group_number = self.plan.group_of[piece.block];
        let (Some(group), Some(primitive)) = (
            self.plan.groups.get(group_number),
            self.file.primitive(piece),
        ) else {
            return Err(unsupported("a primitive without vertices"));
        };
        let block = &self.file.geometry.blocks[piece.block];
        let is_same = group.is_kept
            && self
                .plan
                .has_same_faces(number, piece, block, self.remap, mesh);
        if is_same {
            return Ok(None);
        }
        let mut slots = Vec::new();
        if !group.is_kept {
            let attributes = primitive.attributes.iter();
            let mut named: Vec<(Slot, u64)> = attributes
                .map(|(semantic, &accessor)| (Slot::Attribute(semantic.clone()), accessor))
                .collect();
            for (t, target) in primitive.targets.iter().enumerate() {
                named.extend(
                    target
                        .iter()
                        .map(|(semantic, &accessor)| (Slot::Target(t, semantic.clone()), accessor)),
                );
            }
            let vertices = group.vertices.clone();
            for (slot, accessor) in named {
                // All primitives of a group share its positions.
                let key = if slot == position() {
                    (group_number, usize::MAX, slot, 0)
                } else {
                    (group_number, piece.block, slot, accessor)
                };
                let new = match self.made.get(&key) {
                    Some(&new) => new,
                    None => {
                        let new = self.gather(&vertices, piece.block, &key.2, accessor)?;
                        self.made.insert(key.clone(), new);
                        new
                    }
                };
                slots.push((key.2, new));
            }
        }
        let is_mirrored = block.placement.is_mirrored;
        let start = group.vertices.start;
        let mut indices = Vec::with_capacity(3 * faces.len());
        for face in faces {
            let Some(&[a, b, c]) = self.remap.faces.get(face) else {
                continue;
            };
            let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
            for v in [a, b, c] {
                let local = (v as usize).checked_sub(start);
                let local = local.filter(|&v| v < group.vertices.len());
                indices.push(local.ok_or_else(|| unsupported("a face across primitives"))? as u32);
            }
        }
        let count = indices.len();
        let (code, bytes): (_, Vec<u8>) = if group.vertices.len() <= usize::from(u16::MAX) {
            (
                5123,
                indices
                    .iter()
                    .flat_map(|&i| (i as u16).to_le_bytes())
                    .collect(),
            )
        } else {
            (5125, indices.iter().flat_map(|i| i.to_le_bytes()).collect())
        };
        let text = format!("\"componentType\":{code},\"count\":{count},\"type\":\"SCALAR\"");
        let indices = self.rewrite.append(&bytes, &text, Some(34963), None)?;
        Ok(Some(Change {
            mesh: piece.mesh,
            primitive: piece.primitive,
            slots,
            indices,
        }))
    }

    /// Creates an accessor of the elements of the new vertices. Those from other blocks come from
    /// the same slot there, or are zero; colours are white.
    fn gather(
        &mut self,
        vertices: &Range<usize>,
        own: usize,
        slot: &Slot,
        accessor: u64,
    ) -> Result<usize, IoError> {
        let file = self.file;
        let layout =
            |accessor: u64| Layout::new(accessor, &file.accessors, &file.views, &file.buffers);
        let own_layout = layout(accessor)?;
        let is_position = *slot == position();
        let old = &self.remap.vertices[vertices.clone()];
        let blocks = &file.geometry.blocks;
        let block_of = |v: u32| blocks.partition_point(|b| b.vertices.end <= v as usize);
        let used: HashSet<usize> = old.iter().map(|&v| block_of(v)).collect();
        let mut used: Vec<usize> = used.into_iter().collect();
        used.sort_unstable();
        let mut layouts = Vec::new();
        for block in used {
            let found = if block == own {
                Some(own_layout.clone())
            } else {
                self.named(block, slot).map(layout).transpose()?
            };
            // Accessors without exactly one element per vertex are not carried over.
            let count = blocks.get(block).map_or(0, |b| b.vertices.len());
            layouts.push((block, found.filter(|layout| layout.count == count)));
        }
        let is_like = |l: &Layout| {
            (l.component, l.components, l.normalized)
                == (
                    own_layout.component,
                    own_layout.components,
                    own_layout.normalized,
                )
        };
        let is_mixed = is_position && layouts.iter().flat_map(|(_, l)| l).any(|l| !is_like(l));
        let (component, normalized) = if is_mixed {
            (Component::F32, false)
        } else {
            (own_layout.component, own_layout.normalized)
        };
        let components = own_layout.components;
        let size = components * component.size();
        // Elements start at multiples of four bytes.
        let stride = size.next_multiple_of(4);
        let mut tables: HashMap<usize, Vec<u8>> = HashMap::new();
        for (block, layout) in layouts {
            let Some(layout) = layout.filter(|l| is_mixed || is_like(l)) else {
                continue;
            };
            let mut table = Vec::with_capacity(layout.count * size);
            layout.for_each(&file.buffers, |_, bytes| {
                if is_mixed {
                    (0..components)
                        .for_each(|k| component.write(&mut table, layout.value(bytes, k)));
                } else {
                    table.extend_from_slice(bytes);
                }
                Ok(())
            })?;
            tables.insert(block, table);
        }
        // Vertices without a colour are white, as rendered.
        let mut missing = Vec::new();
        if *slot == Slot::Attribute("COLOR_0".to_owned()) {
            (0..components).for_each(|_| component.write(&mut missing, component.unit().into()));
        }
        let mut out = Vec::with_capacity(old.len() * stride);
        for &v in old {
            let block = block_of(v);
            let start = blocks.get(block).map_or(0, |b| b.vertices.start);
            let at = (v as usize - start) * size;
            let element = tables
                .get(&block)
                .and_then(|table| table.get(at..at + size));
            let end = out.len() + stride;
            out.extend_from_slice(element.unwrap_or(&missing));
            out.resize(end, 0);
        }
        let json = file.accessors.get(own_layout.accessor);
        let mut text = format!(
            "\"componentType\":{},\"count\":{},\"type\":\"{}\"",
            if is_mixed {
                5126
            } else {
                json.map_or(5126, |a| a.component)
            },
            old.len(),
            json.map_or("VEC3", |a| &a.shape)
        );
        if normalized {
            text.push_str(",\"normalized\":true");
        }
        if *slot_semantic(slot) == *"POSITION" && components == 3 {
            let elements = out.chunks(stride).map(|element| {
                [0, 1, 2]
                    .map(|k| component.read(element.get(k * component.size()..).unwrap_or(&[])))
            });
            let [min, max] = limits(elements);
            text.push_str(&format!(",\"min\":{},\"max\":{}", array(&min), array(&max)));
        }
        let stride = (stride != size).then_some(stride);
        self.rewrite.append(&out, &text, Some(34962), stride)
    }

    /// The accessor in a slot of the first primitive of a block that has it.
    fn named(&self, block: usize, slot: &Slot) -> Option<u64> {
        let pieces = &self.file.geometry.blocks.get(block)?.pieces;
        pieces.iter().find_map(|&piece| {
            let primitive = self.file.primitive(self.file.geometry.pieces.get(piece)?)?;
            match slot {
                Slot::Attribute(semantic) => primitive.attributes.get(semantic).copied(),
                Slot::Target(t, semantic) => primitive.targets.get(*t)?.get(semantic).copied(),
            }
        })
    }

    /// The span of a primitive in the JSON.
    fn span(&mut self, mesh: usize, primitive: usize) -> Result<Range<usize>, IoError> {
        if self.spans.is_empty() {
            let root = self.rewrite.editor.root();
            for (m, span) in self
                .rewrite
                .editor
                .list(&root, "meshes")?
                .iter()
                .enumerate()
            {
                let primitives = self.rewrite.editor.list(span, "primitives")?;
                self.spans.insert(m, primitives);
            }
        }
        let primitives = self.spans.get(&mesh);
        let span = primitives.and_then(|list| list.get(primitive)).cloned();
        span.ok_or_else(|| unsupported("a primitive that does not exist"))
    }

    /// Makes the primitives refer to their new accessors.
    fn edit(&mut self, changes: Vec<Change>) -> Result<(), IoError> {
        for change in changes {
            let span = self.span(change.mesh, change.primitive)?;
            let editor = &mut self.rewrite.editor;
            let members = editor.members(&span)?;
            let mut spans: HashMap<Slot, Range<usize>> = HashMap::new();
            if let Some(object) = member(&members, "attributes") {
                for (semantic, span) in editor.members(object)? {
                    spans.insert(Slot::Attribute(semantic), span);
                }
            }
            if let Some(list) = member(&members, "targets") {
                for (t, object) in editor.elements(list)?.iter().enumerate() {
                    for (semantic, span) in editor.members(object)? {
                        spans.insert(Slot::Target(t, semantic), span);
                    }
                }
            }
            for (slot, accessor) in change.slots {
                if let Some(span) = spans.get(&slot) {
                    editor.replace(span.clone(), accessor.to_string());
                }
            }
            editor.set(&span, "indices", change.indices.to_string())?;
            if member(&members, "mode").is_some() {
                editor.set(&span, "mode", "4".to_owned())?;
            }
            if let Some(object) = member(&members, "extensions") {
                editor.remove(object, |key| key == "KHR_draco_mesh_compression")?;
            }
        }
        Ok(())
    }

    /// Removes primitives without remaining faces.
    ///
    /// The last one of a mesh becomes points of a mesh that no node shows, since a mesh must have
    /// primitives and other meshes must keep their indices.
    fn drop_pieces(&mut self) -> Result<(), IoError> {
        let mut dropped: BTreeMap<usize, HashSet<usize>> = BTreeMap::new();
        for (piece, faces) in self.file.geometry.pieces.iter().zip(&self.plan.faces) {
            if faces.is_empty() {
                dropped
                    .entry(piece.mesh)
                    .or_default()
                    .insert(piece.primitive);
            }
        }
        let mut hidden = HashSet::new();
        let editor = &self.rewrite.editor;
        let meshes = editor.list(&editor.root(), "meshes")?;
        for (&mesh, dropped) in &dropped {
            let count = self.file.meshes.get(mesh).map_or(0, |m| m.primitives.len());
            if dropped.len() == count {
                hidden.insert(mesh as u64);
                for &primitive in dropped {
                    let span = self.span(mesh, primitive)?;
                    self.rewrite.editor.set(&span, "mode", "0".to_owned())?;
                }
                continue;
            }
            let editor = &mut self.rewrite.editor;
            let members = meshes
                .get(mesh)
                .map(|span| editor.members(span))
                .transpose()?;
            if let Some(list) = members.as_ref().and_then(|m| member(m, "primitives")) {
                editor.remove_elements(list, |i| dropped.contains(&i))?;
            }
        }
        if hidden.is_empty() {
            return Ok(());
        }
        let editor = &mut self.rewrite.editor;
        for node in editor.list(&editor.root(), "nodes")? {
            let members = editor.members(&node)?;
            let mesh = member(&members, "mesh").map(|span| editor.text(span));
            let mesh = mesh.and_then(|text| text.parse::<u64>().ok());
            if mesh.is_some_and(|mesh| hidden.contains(&mesh)) {
                editor.remove(&node, |key| matches!(key, "mesh" | "skin" | "weights"))?;
            }
        }
        Ok(())
    }
}

fn position() -> Slot {
    Slot::Attribute("POSITION".to_owned())
}

fn slot_semantic(slot: &Slot) -> &str {
    match slot {
        Slot::Attribute(semantic) | Slot::Target(_, semantic) => semantic,
    }
}
