//! The vertices and faces of the meshes of a file.

use std::ops::Range;

use nalgebra::Point3;

use super::Buffers;
use super::accessor::{Component, Layout, no_such, problem};
use super::model::{Mesh, Root};
use super::scene::{Others, Placements};
use super::sharing::Sharing;
use crate::attributes::NONE;
use crate::error::{IoError, Warning};
use crate::limits::Limits;
use crate::parsed::{Parsed, Part};
use crate::placement::{Instance, Placement};

/// The vertices of one POSITION accessor.
///
/// An accessor has several blocks if some of its uses need separate vertices.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Block {
    pub(super) layout: Layout,
    /// Their range in the document.
    pub(super) vertices: Range<usize>,
    pub(super) placement: Placement,
    /// The layer of the mesh that it belongs to; 0 if the mesh has only one.
    pub(super) layer: u32,
    /// The pieces that use it.
    pub(super) pieces: Vec<usize>,
}

/// The faces of one primitive.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Piece {
    pub(super) mesh: usize,
    pub(super) primitive: usize,
    pub(super) block: usize,
    /// Their range in the document.
    pub(super) faces: Range<usize>,
}

/// The source of the vertices and faces of the document.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Geometry {
    pub(super) blocks: Vec<Block>,
    pub(super) pieces: Vec<Piece>,
    pub(super) placements: Placements,
}

/// The way in which triangles are formed from a list of vertices; the codes are those of OpenGL.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mode {
    Triangles,
    Strip,
    Fan,
}

impl Mode {
    /// The mode for a code, or `None` if primitives of that mode have no faces.
    pub(super) fn of_code(code: u64) -> Option<Self> {
        Some(match code {
            4 => Self::Triangles,
            5 => Self::Strip,
            6 => Self::Fan,
            _ => return None,
        })
    }

    fn num_triangles(self, count: usize) -> usize {
        match self {
            Self::Triangles => count / 3,
            Self::Strip | Self::Fan => count.saturating_sub(2),
        }
    }

    /// The list positions of the corners of a triangle, all with the same orientation.
    #[inline]
    fn corners(self, triangle: usize) -> [usize; 3] {
        let i = triangle;
        match self {
            Self::Triangles => [3 * i, 3 * i + 1, 3 * i + 2],
            Self::Strip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Self::Fan => [0, i + 1, i + 2],
        }
    }
}

/// Maximum number of corners per byte of the file. A strip of 8-bit indices makes three of each,
/// and several primitives may share an accessor, but a small file must not produce a huge mesh.
const CORNERS_PER_BYTE: usize = 32;

/// Maximum number of vertices per byte of the file. An accessor may have several uses, but a
/// small file must not produce a huge mesh.
const VERTICES_PER_BYTE: usize = 8;

impl Geometry {
    /// Reads all meshes.
    pub(super) fn read(
        root: &Root<'_>,
        buffers: &Buffers,
        limits: &Limits,
        sharing: Sharing,
        warnings: &mut Vec<Warning>,
    ) -> Result<(Self, Parsed), IoError> {
        let placements = Placements::new(root, buffers, limits)?;
        for &mesh in &placements.singular {
            warnings.push(warning(format!(
                "the transform of mesh {mesh} is not invertible; the mesh is read without it"
            )));
        }
        for (mesh, others) in placements.others.iter().enumerate() {
            if others.count > 1 {
                warnings.push(warning(format!(
                    "mesh {mesh} is shown {} times; it is read once, where it is shown first, and \
                     an edit of it shows everywhere",
                    others.count
                )));
            }
        }
        let skinned = root.nodes.iter().filter(|node| node.skin.is_some());
        let mut skinned: Vec<u64> = skinned.filter_map(|node| node.mesh).collect();
        skinned.sort_unstable();
        skinned.dedup();
        for mesh in skinned {
            warnings.push(warning(format!(
                "mesh {mesh} has a skin; it is read in its bind pose, and an edit changes that pose"
            )));
        }
        let mut reader = Reader {
            root,
            buffers,
            limits,
            placements,
            geometry: Self::default(),
            parsed: Parsed {
                is_split: true,
                ..Parsed::default()
            },
            sharing,
            unshown: 0,
            leftover: 0,
            num_first: 0,
        };
        for (number, mesh) in root.meshes.iter().enumerate() {
            reader.mesh(number, mesh)?;
        }
        if reader.geometry.pieces.is_empty() {
            return Err(problem(
                "meshes".to_owned(),
                match (root.meshes.len(), reader.unshown) {
                    (0, _) => "the file has no mesh".to_owned(),
                    _ => "no primitive consists of triangles".to_owned(),
                },
            ));
        }
        if reader.unshown > 0 {
            warnings.push(warning(format!(
                "{} primitives of points or lines are kept but not read",
                reader.unshown
            )));
        }
        if reader.leftover > 0 {
            warnings.push(warning(format!(
                "{} primitives have one or two indices after their last triangle",
                reader.leftover
            )));
        }
        let layered = reader.geometry.blocks.iter();
        let layered = layered.filter(|block| block.layer > 0).count();
        if layered > 0 {
            warnings.push(warning(format!(
                "primitives that have faces of another one at the same place: {layered}; each has \
                 vertices of its own, after those of the first"
            )));
        }
        let mut parsed = reader.parsed;
        let mut geometry = reader.geometry;
        let layered = geometry.blocks.iter().filter(|block| block.layer > 0);
        parsed.layers = layered
            .map(|block| (block.vertices.clone(), block.layer))
            .collect();
        geometry.placements = reader.placements;
        Ok((geometry, parsed))
    }
}

impl Geometry {
    /// Visits the instances of meshes in addition to those where they were read.
    ///
    /// Returns the number of instances whose transform is singular, which are skipped.
    pub(super) fn instances(
        &self,
        buffers: &Buffers,
        visit: &mut dyn FnMut(Instance<'_>) -> Result<(), IoError>,
    ) -> Result<usize, IoError> {
        let mut num_singular = 0;
        for (mesh, _) in self.faces_of_meshes() {
            let Some(others) = self.placements.others.get(mesh) else {
                continue;
            };
            let from = &self.placements.meshes[mesh];
            num_singular += others.for_each(buffers, |to| {
                visit(Instance {
                    part: mesh,
                    from,
                    to,
                })
            })?;
        }
        Ok(num_singular)
    }

    /// The meshes that have faces, with their face ranges.
    fn faces_of_meshes(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        let of_one = self.pieces.chunk_by(|a, b| a.mesh == b.mesh);
        of_one.filter_map(|pieces| {
            let (first, last) = (pieces.first()?, pieces.last()?);
            Some((first.mesh, first.faces.start..last.faces.end))
        })
    }

    /// Rejects more instances than the limits allow, before any memory is reserved for them.
    pub(super) fn check_instances(
        &self,
        buffers: &Buffers,
        limits: &Limits,
    ) -> Result<(), IoError> {
        let mut num_vertices = self.blocks.last().map_or(0, |block| block.vertices.end);
        let mut num_faces = self.pieces.last().map_or(0, |piece| piece.faces.end);
        for (mesh, faces) in self.faces_of_meshes() {
            let others = self.placements.others.get(mesh);
            let places = others.map_or(0, Others::num_places);
            num_faces = num_faces.saturating_add(faces.len().saturating_mul(places));
            // A copy has only the vertices of its faces.
            let mut blocks: Vec<usize> = self
                .pieces
                .iter()
                .filter(|p| p.mesh == mesh)
                .map(|p| p.block)
                .collect();
            blocks.dedup();
            let vertices = blocks
                .iter()
                .map(|&block| self.blocks[block].vertices.len());
            let vertices = vertices.fold(0, usize::saturating_add).min(3 * faces.len());
            num_vertices = num_vertices.saturating_add(vertices.saturating_mul(places));
        }
        limits.check_vertices(num_vertices)?;
        limits.check_faces(num_faces)?;
        let num_corners = num_faces.saturating_mul(3);
        limits.check_corners(num_corners)?;
        limits.check_memory(buffers.num_bytes(), num_vertices, num_corners)
    }
}

fn warning(message: String) -> Warning {
    Warning {
        place: None,
        message,
    }
}

pub(super) struct Reader<'a> {
    root: &'a Root<'a>,
    buffers: &'a Buffers,
    limits: &'a Limits,
    pub(super) placements: Placements,
    pub(super) geometry: Geometry,
    pub(super) parsed: Parsed,
    pub(super) sharing: Sharing,
    /// The number of primitives without faces.
    unshown: usize,
    leftover: usize,
    /// The number of vertices in the first uses of accessors.
    num_first: usize,
}

impl Reader<'_> {
    fn mesh(&mut self, number: usize, mesh: &Mesh) -> Result<(), IoError> {
        let vertex = self.parsed.positions.len();
        let face = self.parsed.faces.len();
        self.begin_mesh();
        for (index, primitive) in mesh.primitives.iter().enumerate() {
            let path = || format!("meshes[{number}].primitives[{index}]");
            let mode = match primitive.mode {
                0..=3 => {
                    self.unshown += 1;
                    continue;
                }
                code => Mode::of_code(code).ok_or_else(|| {
                    problem(
                        format!("{}.mode", path()),
                        format!("{code} is not a primitive mode; modes are 0 to 6"),
                    )
                })?,
            };
            let Some(&accessor) = primitive.attributes.get("POSITION") else {
                return Err(
                    match primitive
                        .extensions
                        .contains_key("KHR_draco_mesh_compression")
                    {
                        true => draco(),
                        false => problem(
                            format!("{}.attributes", path()),
                            "there is no POSITION".to_owned(),
                        ),
                    },
                );
            };
            let layout = self.positions_layout(accessor)?;
            let corners = self.corners(mode, primitive.indices, layout.count, &path)?;
            let block = self.block_for(number, layout, &corners)?;
            let start = self.parsed.faces.len();
            self.faces(&corners, block);
            let piece = self.geometry.pieces.len();
            self.geometry.blocks[block].pieces.push(piece);
            self.geometry.pieces.push(Piece {
                mesh: number,
                primitive: index,
                block,
                faces: start..self.parsed.faces.len(),
            });
        }
        self.parsed.parts.push(Part {
            name: mesh.name.clone(),
            vertices: vertex..self.parsed.positions.len(),
            faces: face..self.parsed.faces.len(),
        });
        Ok(())
    }

    /// The layout of a POSITION accessor.
    fn positions_layout(&self, accessor: u64) -> Result<Layout, IoError> {
        let layout = self.layout(accessor)?;
        let path = || format!("accessors[{accessor}]");
        if layout.components != 3 {
            return Err(problem(
                format!("{}.type", path()),
                "positions must be VEC3".to_owned(),
            ));
        }
        if layout.component == Component::U32 {
            return Err(problem(
                format!("{}.componentType", path()),
                "positions are numbers of 32 bits with a point, or of 8 or 16 bits".to_owned(),
            ));
        }
        // An invalid position is reported before a face that refers to it.
        layout.replaced(self.buffers)?;
        self.limits
            .check_vertices(self.parsed.positions.len().saturating_add(layout.count))?;
        Ok(layout)
    }

    /// Reads the positions of an accessor into a new block.
    pub(super) fn block(&mut self, mesh: usize, layout: Layout) -> Result<usize, IoError> {
        let path = || format!("accessors[{}]", layout.accessor);
        let placement = self.placements.meshes[mesh].clone();
        let positions = &mut self.parsed.positions;
        let start = positions.len();
        let count = start.saturating_add(layout.count);
        self.limits.check_vertices(count)?;
        // On its first use, a vertex is backed by bytes of its own, even if accessors overlap.
        let is_first = self.sharing.blocks(layout.accessor as u64).is_empty();
        if is_first {
            self.num_first = self.num_first.saturating_add(layout.count);
        }
        let num_bytes = self.buffers.num_bytes();
        if self.num_first > num_bytes || count > num_bytes.saturating_mul(VERTICES_PER_BYTE) {
            return Err(problem(
                format!("{}.count", path()),
                format!("{count} vertices in all in a file of {num_bytes} bytes"),
            ));
        }
        self.limits.check_room(
            self.buffers.num_bytes(),
            count,
            self.parsed.faces.num_corners(),
        )?;
        positions.reserve(layout.count);
        let non_finite = |element: usize, p: Point3<f64>| {
            let value = p.iter().copied().find(|x| !x.is_finite());
            problem(
                path(),
                format!(
                    "element {element} has the coordinate {}, which is not a finite number",
                    value.unwrap_or(f64::INFINITY)
                ),
            )
        };
        let plain = layout
            .base
            .filter(|_| layout.component == Component::F32 && layout.sparse.is_none());
        if let Some(span) = plain {
            for (element, bytes) in span.elements(self.buffers).enumerate() {
                let single = |k: usize| match bytes.get(k..).and_then(|b| b.first_chunk::<4>()) {
                    Some(&bytes) => f64::from(f32::from_le_bytes(bytes)),
                    None => 0.0,
                };
                let p = placement.to_scene(Point3::new(single(0), single(4), single(8)));
                if !(p.x.is_finite() && p.y.is_finite() && p.z.is_finite()) {
                    return Err(non_finite(element, p));
                }
                positions.push(p);
            }
        } else {
            layout.for_each(self.buffers, |element, bytes| {
                let p = Point3::from([0, 1, 2].map(|k| layout.value(bytes, k)));
                let p = placement.to_scene(p);
                if !p.iter().all(|x| x.is_finite()) {
                    return Err(non_finite(element, p));
                }
                positions.push(p);
                Ok(())
            })?;
        }
        let block = self.geometry.blocks.len();
        self.geometry.blocks.push(Block {
            layout,
            vertices: start..positions.len(),
            placement,
            layer: 0,
            pieces: Vec::new(),
        });
        Ok(block)
    }

    /// The corners of the triangles of a primitive, numbered within its vertices.
    fn corners(
        &mut self,
        mode: Mode,
        indices: Option<u64>,
        num_vertices: usize,
        path: &impl Fn() -> String,
    ) -> Result<Vec<u32>, IoError> {
        let layout = indices.map(|accessor| self.layout(accessor)).transpose()?;
        let count = layout.as_ref().map_or(num_vertices, |layout| layout.count);
        let num_triangles = mode.num_triangles(count);
        let num_corners = num_triangles
            .checked_mul(3)
            .and_then(|n| n.checked_add(self.parsed.faces.num_corners()))
            .unwrap_or(usize::MAX);
        self.limits
            .check_faces(self.parsed.faces.len().saturating_add(num_triangles))?;
        self.limits.check_corners(num_corners)?;
        let num_bytes = self.buffers.num_bytes();
        if num_corners > num_bytes.saturating_mul(CORNERS_PER_BYTE) {
            return Err(problem(
                path(),
                format!("{num_corners} face corners in all in a file of {num_bytes} bytes"),
            ));
        }
        self.limits
            .check_room(num_bytes, self.parsed.positions.len(), num_corners)?;
        if mode == Mode::Triangles && count % 3 != 0 {
            self.leftover += 1;
        }
        let list = match &layout {
            Some(layout) => self.indices(layout, num_vertices, mode, path)?,
            // The count of a block fits 32 bits.
            None => (0..num_vertices as u32).collect(),
        };
        if mode == Mode::Triangles {
            let mut corners = list;
            corners.truncate(3 * num_triangles);
            return Ok(corners);
        }
        let mut corners = Vec::with_capacity(3 * num_triangles);
        for triangle in 0..num_triangles {
            corners.extend(mode.corners(triangle).map(|i| list[i]));
        }
        Ok(corners)
    }

    /// Adds the faces of a primitive.
    fn faces(&mut self, corners: &[u32], block: usize) {
        let Block {
            vertices,
            placement,
            ..
        } = &self.geometry.blocks[block];
        let (first, is_mirrored) = (vertices.start as u32, placement.is_mirrored);
        let faces = &mut self.parsed.faces;
        faces.reserve(corners.len() / 3, corners.len());
        let (triangles, _) = corners.as_chunks::<3>();
        for &[a, b, c] in triangles {
            let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
            faces.push_corner(first + a);
            faces.push_corner(first + b);
            faces.push_corner(first + c);
            faces.end_face();
        }
    }

    /// The values of an index accessor, all less than `num_vertices`.
    fn indices(
        &self,
        layout: &Layout,
        num_vertices: usize,
        mode: Mode,
        path: &impl Fn() -> String,
    ) -> Result<Vec<u32>, IoError> {
        let at = |field: &str| format!("accessors[{}].{field}", layout.accessor);
        if layout.components != 1 {
            return Err(problem(at("type"), "indices must be SCALAR".to_owned()));
        }
        let is_unsigned = matches!(
            layout.component,
            Component::U8 | Component::U16 | Component::U32
        );
        if !is_unsigned {
            return Err(problem(
                at("componentType"),
                "indices must be unsigned integers".to_owned(),
            ));
        }
        let mut list: Vec<u32> = Vec::with_capacity(layout.count);
        let tight = layout
            .base
            .filter(|span| layout.sparse.is_none() && span.stride == span.size);
        match (tight, layout.component) {
            (Some(span), Component::U32) => {
                let (chunks, _) = span.bytes(self.buffers).as_chunks::<4>();
                list.extend(chunks.iter().map(|&b| u32::from_le_bytes(b)));
            }
            (Some(span), Component::U16) => {
                let (chunks, _) = span.bytes(self.buffers).as_chunks::<2>();
                list.extend(chunks.iter().map(|&b| u32::from(u16::from_le_bytes(b))));
            }
            _ => layout.for_each(self.buffers, |_, bytes| {
                // At most 32 bits, so the cast preserves the value.
                list.push(layout.component.read(bytes) as u32);
                Ok(())
            })?,
        }
        let largest = list.iter().copied().max().unwrap_or(0) as usize;
        if largest < num_vertices || list.is_empty() {
            return Ok(list);
        }
        let place = list
            .iter()
            .position(|&i| i as usize >= num_vertices)
            .unwrap_or(0);
        let index = list[place];
        let restart = match layout.component {
            Component::U8 => u32::from(u8::MAX),
            Component::U16 => u32::from(u16::MAX),
            _ => NONE,
        };
        let face = match mode {
            Mode::Triangles => place / 3,
            Mode::Strip | Mode::Fan => place.saturating_sub(2),
        };
        Err(problem(
            format!("{}.indices", path()),
            if index == restart {
                format!(
                    "index {place} (face {face}) is {index}, which would start a primitive anew; \
                     glTF has no such"
                )
            } else {
                format!(
                    "index {place} (face {face}) refers to vertex {index}, but there are \
                     {num_vertices}, numbered from 0"
                )
            },
        ))
    }

    fn layout(&self, accessor: u64) -> Result<Layout, IoError> {
        let root = self.root;
        if accessor >= root.accessors.len() as u64 {
            let path = "meshes".to_owned();
            return Err(no_such("accessor", accessor, root.accessors.len(), path));
        }
        Layout::new(accessor, &root.accessors, &root.views, self.buffers)
    }
}

/// The error for geometry that requires Draco decompression.
pub(super) fn draco() -> IoError {
    IoError::Unsupported {
        feature: "the extension KHR_draco_mesh_compression".to_owned(),
        remedy: "write the file without compression, for example with `gltf-transform copy`",
    }
}
