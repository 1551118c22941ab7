//! Writing of the file with moved vertices and rotated normals, or in the other container.
//!
//! Positions and normals are changed in place if their bytes are not shared and have a type that
//! can represent the new values. Otherwise new ones are appended and the primitives refer to
//! them. The JSON changes only in the corresponding places. A buffer that changes and is not the
//! binary chunk of a GLB becomes a data URI; other file references are left unchanged.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use nalgebra::Vector3;

use super::GltfFile;
use super::accessor::{Component, Layout};
use super::attributes::layout_of;
use super::buffers::{Kind, encode};
use super::container::write_binary;
use super::geometry::Block;
use super::json::{Editor, member};
use super::private::Private;
use crate::error::IoError;
use crate::format::Format;
use crate::number::push_f64;
use crate::source::Moves;

/// Writes the file in one of the two containers, with the changes applied.
pub(super) fn write(
    file: &GltfFile,
    format: Format,
    moves: &Moves<'_>,
) -> Result<Vec<u8>, IoError> {
    let is_changed = moves.moved.contains(&true) || !moves.normals.vertices.is_empty();
    let is_binary = format == Format::Glb;
    if !is_changed && is_binary == file.container.is_binary {
        return Ok(file.buffers.file.clone());
    }
    let mut rewrite = Rewrite::new(file)?;
    if is_changed {
        rewrite.moved(moves)?;
    }
    rewrite.finish(is_binary)
}

/// A file that is being changed.
pub(super) struct Rewrite<'a> {
    file: &'a GltfFile,
    pub(super) editor: Editor<'a>,
    /// The buffers that change.
    buffers: Vec<Option<Vec<u8>>>,
    /// New data, with the index of the buffer it is appended to and the offset there.
    appended: Vec<u8>,
    append_to: usize,
    append_at: usize,
    new_accessors: Vec<String>,
    new_views: Vec<String>,
    accessors: Vec<Range<usize>>,
    /// New accessors of attributes, by mesh and primitive.
    repoint: BTreeMap<(usize, usize), Vec<(String, usize)>>,
}

impl<'a> Rewrite<'a> {
    pub(super) fn new(file: &'a GltfFile) -> Result<Self, IoError> {
        let editor = Editor::new(file.text());
        let list = &file.buffers.list;
        // Append where it changes the least: the binary chunk or a data URI.
        let (append_to, length) = match list.first() {
            Some(first) if matches!(first.kind, Kind::Chunk | Kind::Embedded) => (0, first.length),
            _ => (list.len(), 0),
        };
        Ok(Self {
            accessors: editor.list(&editor.root(), "accessors")?,
            file,
            editor,
            buffers: vec![None; list.len()],
            appended: Vec::new(),
            append_to,
            append_at: length.next_multiple_of(4),
            new_accessors: Vec::new(),
            new_views: Vec::new(),
            repoint: BTreeMap::new(),
        })
    }

    fn moved(&mut self, moves: &Moves<'_>) -> Result<(), IoError> {
        let file = self.file;
        let private = Private::new(file);
        let users = users(file);
        for (number, block) in file.geometry.blocks.iter().enumerate() {
            let position = block.layout.accessor;
            let Users {
                primitives,
                is_alone,
            } = &users[number];
            let is_alone = *is_alone;
            let changes = positions(block, moves)?;
            if !changes.is_empty() {
                let is_private = is_alone
                    && private.position(position)
                    && block.layout.component == Component::F32;
                if let Some(accessor) =
                    self.change(&block.layout, &changes, is_private, Bounds::Always)?
                {
                    for &user in primitives {
                        self.point(user, "POSITION", accessor);
                    }
                }
                // A compressed copy would no longer match.
                for &user in primitives {
                    self.repoint.entry(user).or_default();
                }
            }
            let normals = &moves.normals.vertices;
            let start = normals.partition_point(|&(v, _)| (v as usize) < block.vertices.start);
            let end = normals.partition_point(|&(v, _)| (v as usize) < block.vertices.end);
            if start == end {
                continue;
            }
            let Some(layout) = layout_of(file, number, "NORMAL")? else {
                continue;
            };
            let changes: Vec<_> = normals[start..end]
                .iter()
                .map(|&(v, normal)| {
                    let normal = block.placement.normal_to_mesh(Vector3::from(normal));
                    (v as usize - block.vertices.start, normal.into())
                })
                .collect();
            let is_private = is_alone && private.normal(layout.accessor, position);
            if let Some(accessor) = self.change(&layout, &changes, is_private, Bounds::IfThere)? {
                for &user in primitives {
                    let primitive = &file.meshes[user.0].primitives[user.1];
                    if primitive.attributes.get("NORMAL") == Some(&(layout.accessor as u64)) {
                        self.point(user, "NORMAL", accessor);
                    }
                }
            }
        }
        Ok(())
    }

    pub(super) fn point(&mut self, user: (usize, usize), semantic: &str, accessor: usize) {
        let attributes = self.repoint.entry(user).or_default();
        attributes.push((semantic.to_owned(), accessor));
    }

    /// Replaces elements of a three-component accessor: in place, or else in a new accessor,
    /// whose index is returned.
    fn change(
        &mut self,
        layout: &Layout,
        changes: &[(usize, [f64; 3])],
        is_private: bool,
        bounds: Bounds,
    ) -> Result<Option<usize>, IoError> {
        let holds = layout.component == Component::F32 || layout.normalized;
        let span = layout
            .base
            .filter(|_| is_private && holds && layout.sparse.is_none());
        let Some(span) = span else {
            let mut values = Vec::with_capacity(3 * layout.count);
            layout.for_each(&self.file.buffers, |_, bytes| {
                values.extend([0, 1, 2].map(|k| layout.value(bytes, k) as f32));
                Ok(())
            })?;
            for &(element, value) in changes {
                for (k, x) in value.into_iter().enumerate() {
                    values[3 * element + k] = x as f32;
                }
            }
            return self.append_vectors(&values).map(Some);
        };
        let old = self.file.buffers.bytes(span.buffer);
        let buffer = self.buffers[span.buffer].get_or_insert_with(|| old.to_vec());
        let unit = f64::from(if layout.normalized {
            layout.component.unit()
        } else {
            1.0
        });
        let size = layout.component.size();
        let mut bytes = Vec::new();
        for &(element, value) in changes {
            for (k, x) in value.into_iter().enumerate() {
                bytes.clear();
                layout.component.write(&mut bytes, x * unit);
                let at = span.start + element * span.stride + k * size;
                let old = &mut buffer[at..at + size];
                // Equal numbers keep their bits, because there are two zeros.
                if layout.component.read(old) != layout.component.read(&bytes) {
                    old.copy_from_slice(&bytes);
                }
            }
        }
        let accessor = &self.file.accessors[layout.accessor];
        let is_there = accessor.min.is_some() || accessor.max.is_some();
        if bounds == Bounds::Always || is_there {
            let elements = buffer[span.start..span.end()].chunks(span.stride);
            let [min, max] = limits(elements.map(|element| {
                [0, 1, 2].map(|k| {
                    layout
                        .component
                        .read(element.get(k * size..).unwrap_or(&[]))
                })
            }));
            let object = self.accessors.get(layout.accessor).cloned().unwrap_or(0..0);
            self.set_bound(&object, "min", min)?;
            self.set_bound(&object, "max", max)?;
        }
        Ok(None)
    }

    /// Writes a bound, unless it is already equal.
    fn set_bound(
        &mut self,
        object: &Range<usize>,
        key: &str,
        bound: [f64; 3],
    ) -> Result<(), IoError> {
        let members = self.editor.members(object)?;
        let old = member(&members, key).map(|span| self.editor.text(span));
        let old: Option<[f64; 3]> = old.and_then(|text| serde_json::from_str(text).ok());
        // Bounds are often rounded to fewer digits than the numbers that they bound.
        if old.is_some_and(|old| old.map(|x| x as f32) == bound.map(|x| x as f32)) {
            return Ok(());
        }
        self.editor.set(object, key, array(&bound))
    }

    /// Appends an accessor of vectors with bounds.
    fn append_vectors(&mut self, values: &[f32]) -> Result<usize, IoError> {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let (triples, _) = values.as_chunks::<3>();
        let [min, max] = limits(triples.iter().map(|v| v.map(f64::from)));
        let text = format!(
            "\"componentType\":5126,\"count\":{},\"type\":\"VEC3\",\"min\":{},\"max\":{}",
            triples.len(),
            array(&min),
            array(&max)
        );
        self.append(&bytes, &text, Some(34962), None)
    }

    /// Appends an accessor of new bytes; `text` is its JSON except for the view.
    pub(super) fn append(
        &mut self,
        bytes: &[u8],
        text: &str,
        target: Option<u32>,
        stride: Option<usize>,
    ) -> Result<usize, IoError> {
        // Attributes without bytes of their own get some here; a small file must not grow into a
        // huge one.
        let num_bytes = self.file.buffers.num_bytes();
        let most = (64usize << 20).saturating_add(num_bytes.saturating_mul(16));
        if self.appended.len().saturating_add(bytes.len()) > most {
            return Err(IoError::Unsupported {
                feature: format!(
                    "a change that adds more than {most} bytes to a glTF of {num_bytes}"
                ),
                remedy: "write the mesh in another format and change that file",
            });
        }
        let offset = self.append_at + self.appended.len();
        self.appended.extend_from_slice(bytes);
        self.appended
            .resize(self.appended.len().next_multiple_of(4), 0);
        let view = self.file.views.len() + self.new_views.len();
        let mut json = format!(
            "{{\"buffer\":{},\"byteOffset\":{offset},\"byteLength\":{}",
            self.append_to,
            bytes.len()
        );
        if let Some(stride) = stride {
            json.push_str(&format!(",\"byteStride\":{stride}"));
        }
        if let Some(target) = target {
            json.push_str(&format!(",\"target\":{target}"));
        }
        json.push('}');
        self.new_views.push(json);
        let accessor = self.accessors.len() + self.new_accessors.len();
        self.new_accessors
            .push(format!("{{\"bufferView\":{view},{text}}}"));
        Ok(accessor)
    }

    /// Makes the primitives refer to their new accessors.
    fn point_primitives(&mut self) -> Result<(), IoError> {
        let root = self.editor.root();
        let repoint = std::mem::take(&mut self.repoint);
        if repoint.is_empty() {
            return Ok(());
        }
        let meshes = self.editor.list(&root, "meshes")?;
        let mut current: Option<(usize, Vec<Range<usize>>)> = None;
        for ((mesh, primitive), attributes) in repoint {
            if current.as_ref().is_none_or(|(number, _)| *number != mesh) {
                let span = meshes.get(mesh).cloned().unwrap_or(0..0);
                current = Some((mesh, self.editor.list(&span, "primitives")?));
            }
            let Some((_, primitives)) = &current else {
                continue;
            };
            let Some(primitive) = primitives.get(primitive) else {
                continue;
            };
            let members = self.editor.members(primitive)?;
            if let Some(object) = member(&members, "attributes") {
                for (semantic, accessor) in attributes {
                    self.editor.set(object, &semantic, accessor.to_string())?;
                }
            }
            if let Some(object) = member(&members, "extensions") {
                self.editor
                    .remove(object, |key| key == "KHR_draco_mesh_compression")?;
            }
        }
        Ok(())
    }

    /// Returns the bytes of the file.
    pub(super) fn finish(mut self, is_binary: bool) -> Result<Vec<u8>, IoError> {
        self.point_primitives()?;
        let root = self.editor.root();
        self.editor
            .append(&root, "accessors", &self.new_accessors)?;
        self.editor.append(&root, "bufferViews", &self.new_views)?;
        let file = self.file;
        let objects = self.editor.list(&root, "buffers")?;
        if !self.appended.is_empty() {
            if let Some(object) = objects.get(self.append_to) {
                let old = file.buffers.bytes(self.append_to);
                let buffer = self.buffers[self.append_to].get_or_insert_with(|| old.to_vec());
                buffer.resize(self.append_at, 0);
                buffer.append(&mut self.appended);
                self.editor
                    .set(object, "byteLength", buffer.len().to_string())?;
            } else {
                let text = format!(
                    "{{\"byteLength\":{},\"uri\":\"{}\"}}",
                    self.appended.len(),
                    encode(&self.appended)
                );
                self.editor.append(&root, "buffers", &[text])?;
            }
        }
        let mut bin = None;
        let mut embedded = 0u64;
        for (number, buffer) in file.buffers.list.iter().enumerate() {
            let changed = self.buffers[number].take();
            let (Some(object), true) = (objects.get(number), buffer.kind != Kind::Absent) else {
                continue;
            };
            let original = file.buffers.bytes(number);
            if number == 0 && is_binary {
                if buffer.kind != Kind::Chunk {
                    // In a GLB, a first buffer outside the binary chunk stays there.
                    if file.container.is_binary {
                        if let Some(bytes) = changed {
                            self.editor
                                .set(object, "uri", format!("\"{}\"", encode(&bytes)))?;
                        }
                        continue;
                    }
                    self.editor.remove(object, |key| key == "uri")?;
                }
                bin = Some(changed.unwrap_or_else(|| original.to_vec()));
                continue;
            }
            let is_moved = file.container.is_binary != is_binary && buffer.kind != Kind::Embedded;
            if changed.is_some() || is_moved {
                let bytes = changed.as_deref().unwrap_or(original);
                // Many buffers may refer to one file, which is read once but written for each.
                embedded = embedded.saturating_add((bytes.len() as u64).saturating_mul(4) / 3);
                file.limits.check_bytes(embedded)?;
                self.editor
                    .set(object, "uri", format!("\"{}\"", encode(bytes)))?;
            }
        }
        let json = self.editor.finish();
        let Some(first) = file.buffers.file.get(..file.container.json.start) else {
            return Ok(Vec::new());
        };
        if is_binary {
            // A chunk that no buffer refers to is kept too.
            let chunk = file
                .container
                .bin
                .clone()
                .map(|range| &file.buffers.file[range]);
            let bin = bin.as_deref().or(chunk);
            let (chunks, trailing) = file.chunks();
            return write_binary(&json, bin, chunks, trailing);
        }
        if file.container.is_binary {
            if file.chunks().0.next().is_some() {
                return Err(IoError::Unsupported {
                    feature: "a further chunk of a GLB in a .gltf".to_owned(),
                    remedy: "write a .glb",
                });
            }
            return Ok(json.into_bytes());
        }
        let last = &file.buffers.file[file.container.json.end..];
        Ok([first, json.as_bytes(), last].concat())
    }
}

/// The condition for writing the bounds of an accessor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Bounds {
    Always,
    IfThere,
}

/// The primitives whose positions are those of a block.
#[derive(Clone, Debug, Default)]
struct Users {
    /// By mesh and primitive index.
    primitives: Vec<(usize, usize)>,
    /// `true` if the accessor has no other use as positions.
    is_alone: bool,
}

/// The users of each block. Points and lines are assigned to the triangles of their mesh with the
/// same accessor, or else to others at the same place.
fn users(file: &GltfFile) -> Vec<Users> {
    let geometry = &file.geometry;
    let mut of_accessor: HashMap<u64, Vec<usize>> = HashMap::new();
    for (number, block) in geometry.blocks.iter().enumerate() {
        let accessor = block.layout.accessor as u64;
        of_accessor.entry(accessor).or_default().push(number);
    }
    let pieces = geometry.pieces.iter();
    let of_piece: HashMap<(usize, usize), usize> = pieces
        .map(|piece| ((piece.mesh, piece.primitive), piece.block))
        .collect();
    let mut users = vec![Users::default(); geometry.blocks.len()];
    let mut counts: HashMap<u64, usize> = HashMap::new();
    for (m, mesh) in file.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let Some(&accessor) = primitive.attributes.get("POSITION") else {
                continue;
            };
            *counts.entry(accessor).or_default() += 1;
            let blocks = of_accessor.get(&accessor).map_or(&[][..], Vec::as_slice);
            let is_of_mesh = |&&block: &&usize| {
                let pieces = geometry.blocks[block].pieces.iter();
                pieces
                    .clone()
                    .any(|&piece| geometry.pieces[piece].mesh == m)
            };
            let is_at_place = |&&block: &&usize| {
                geometry.placements.meshes.get(m) == Some(&geometry.blocks[block].placement)
            };
            let block = of_piece.get(&(m, p));
            let block = block.or_else(|| blocks.iter().find(is_of_mesh));
            if let Some(&block) = block.or_else(|| blocks.iter().find(is_at_place)) {
                users[block].primitives.push((m, p));
            }
        }
    }
    for (block, users) in geometry.blocks.iter().zip(&mut users) {
        let count = counts.get(&(block.layout.accessor as u64));
        users.is_alone = count == Some(&users.primitives.len());
    }
    users
}

/// The moved elements of a block, in mesh coordinates.
fn positions(block: &Block, moves: &Moves<'_>) -> Result<Vec<(usize, [f64; 3])>, IoError> {
    let range = block.vertices.clone();
    let moved = moves.moved.get(range.clone()).unwrap_or(&[]);
    let mut changes = Vec::new();
    for (element, _) in moved.iter().enumerate().filter(|&(_, &moved)| moved) {
        let vertex = range.start + element;
        let world = moves.mesh.positions[vertex];
        let local = block.placement.to_mesh(world);
        if let Some(&value) = local.iter().find(|&&x| !(x as f32).is_finite()) {
            return Err(IoError::DoesNotFit {
                vertex,
                value,
                number_type: "float",
            });
        }
        changes.push((element, local.into()));
    }
    Ok(changes)
}

/// The minimum and maximum finite value of each component; zero if there is none.
pub(super) fn limits(values: impl Iterator<Item = [f64; 3]>) -> [[f64; 3]; 2] {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for value in values {
        // JSON can represent neither infinity nor NaN.
        for k in (0..3).filter(|&k| value[k].is_finite()) {
            min[k] = min[k].min(value[k]);
            max[k] = max[k].max(value[k]);
        }
    }
    [min, max].map(|bound| bound.map(|x| if x.is_finite() { x } else { 0.0 }))
}

/// Formats numbers as a JSON array.
pub(super) fn array(values: &[f64]) -> String {
    let mut text = String::from("[");
    for (i, &x) in values.iter().enumerate() {
        if i > 0 {
            text.push(',');
        }
        push_f64(&mut text, x);
    }
    text.push(']');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_finite() {
        let values = [
            [f64::NAN, 1.0, f64::INFINITY],
            [f64::NEG_INFINITY, f64::NAN, 2.0],
            [f64::NAN, -1.0, 3.0],
        ];
        let bounds = limits(values.into_iter());
        assert_eq!(bounds, [[0.0, -1.0, 2.0], [0.0, 1.0, 3.0]]);
        assert_eq!(limits([].into_iter()), [[0.0; 3]; 2]);
    }
}
