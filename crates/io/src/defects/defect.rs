//! A single defect, with the elements concerned.

use std::fmt;

use cotan_geometry::Readable;

use crate::cure::Cure;

/// A defect of a mesh, with its location.
///
/// Vertices and faces are 0-based document indices. If vertices are welded, an index denotes the
/// first vertex at its place.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum Defect {
    /// A face whose outline passes through a place twice in such a way that it cannot be
    /// triangulated. This includes faces that welding collapses.
    RepeatedVertex {
        /// The face.
        face: usize,
        /// The vertex through which it passes twice.
        vertex: usize,
    },
    /// A face with the outline of an earlier one, in either direction. Two faces that are back to
    /// back and have no other neighbour are not duplicates, but a closed surface.
    DuplicateFace {
        /// The face.
        face: usize,
        /// The first face with this outline.
        repeats: usize,
    },
    /// A face with a triangle of no area: its height is below 1e-9 of its longest edge.
    ZeroArea {
        /// The face.
        face: usize,
    },
    /// An edge with three or more faces.
    NonManifoldEdge {
        /// The ends of the edge.
        vertices: [usize; 2],
        /// The faces at the edge.
        faces: Vec<usize>,
    },
    /// A polygon whose triangulation creates an edge that other faces also have.
    CutMeetsEdge {
        /// The polygon.
        face: usize,
        /// The ends of the edge.
        vertices: [usize; 2],
    },
    /// Two faces that traverse their common edge in the same direction.
    InconsistentOrientation {
        /// The ends of the edge.
        vertices: [usize; 2],
        /// The faces.
        faces: [usize; 2],
    },
    /// A one-sided component, such as a Möbius band, which cannot be oriented.
    NotOrientable {
        /// The index of the component in [`Inspection::components`](super::Inspection).
        component: usize,
        /// Its first face.
        face: usize,
    },
    /// A vertex whose faces are not all connected through edges there.
    SeveralFans {
        /// The vertex.
        vertex: usize,
        /// The number of fans of faces that meet there.
        num_fans: usize,
    },
    /// A closed, oriented component whose faces point inward: its volume is negative.
    ///
    /// A component within the bounding box of another closed one may be a cavity and is not
    /// listed.
    InsideOut {
        /// The index of the component in [`Inspection::components`](super::Inspection).
        component: usize,
        /// Its first face.
        face: usize,
    },
    /// A boundary loop.
    Hole {
        /// Its vertices, in loop order.
        vertices: Vec<usize>,
        /// Its length.
        length: f64,
    },
    /// A vertex at exactly the position of an earlier one, and not welded to it.
    DuplicateVertex {
        /// The vertex.
        vertex: usize,
        /// The first vertex at that position.
        repeats: usize,
    },
    /// A vertex that no face uses.
    UnreferencedVertex {
        /// The vertex.
        vertex: usize,
    },
    /// An attribute value that is NaN or infinite.
    NonFinite {
        /// The element with the value: `vertex`, `face`, or `corner value`.
        element: &'static str,
        /// The property, as named in [`Attributes`](crate::Attributes).
        property: String,
        /// The index of the vertex, the face, or the value in the property's table.
        number: usize,
    },
}

/// The kind of a defect, without its location.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each is described at the defect of its name")]
pub enum DefectKind {
    RepeatedVertex,
    DuplicateFace,
    ZeroArea,
    NonManifoldEdge,
    CutMeetsEdge,
    InconsistentOrientation,
    NotOrientable,
    SeveralFans,
    InsideOut,
    Hole,
    DuplicateVertex,
    UnreferencedVertex,
    NonFinite,
}

impl DefectKind {
    /// The name in plain words.
    pub fn name(self) -> &'static str {
        match self {
            Self::RepeatedVertex => "repeated vertex",
            Self::DuplicateFace => "duplicate face",
            Self::ZeroArea => "degenerate face",
            Self::NonManifoldEdge => "non-manifold edge",
            Self::CutMeetsEdge => "cut meets an edge",
            Self::InconsistentOrientation => "inconsistent orientation",
            Self::NotOrientable => "not orientable",
            Self::SeveralFans => "several fans",
            Self::InsideOut => "inside out",
            Self::Hole => "hole",
            Self::DuplicateVertex => "duplicate vertex",
            Self::UnreferencedVertex => "unreferenced vertex",
            Self::NonFinite => "non-finite value",
        }
    }

    /// Returns `true` if no surface can be built from a mesh with such a defect.
    ///
    /// Duplicate faces as such do not prevent it: two that face each other form a closed surface.
    /// Some repeated vertices do not either: faces that welding collapses, since the surface
    /// omits them, and a few faces that run out and back and whose triangles happen to fit.
    pub fn is_blocking(self) -> bool {
        matches!(
            self,
            Self::RepeatedVertex
                | Self::NonManifoldEdge
                | Self::CutMeetsEdge
                | Self::InconsistentOrientation
                | Self::NotOrientable
                | Self::SeveralFans
        )
    }

    /// The step of [`Repair`](crate::Repair) that fixes it; `None` if there is none.
    pub fn cure(self) -> Option<Cure> {
        match self {
            Self::RepeatedVertex => Some(Cure::DropDegenerate),
            Self::DuplicateFace => Some(Cure::DropDuplicates),
            Self::ZeroArea => Some(Cure::DropZeroArea),
            Self::NonManifoldEdge | Self::CutMeetsEdge | Self::NotOrientable => {
                Some(Cure::SplitEdges)
            }
            Self::InconsistentOrientation | Self::InsideOut => Some(Cure::Orient),
            Self::SeveralFans => Some(Cure::SplitVertices),
            Self::Hole => Some(Cure::FillHoles),
            Self::DuplicateVertex => Some(Cure::Weld),
            Self::UnreferencedVertex => Some(Cure::Compact),
            Self::NonFinite => None,
        }
    }
}

impl fmt::Display for DefectKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Defect {
    /// The kind of the defect.
    pub fn kind(&self) -> DefectKind {
        match self {
            Self::RepeatedVertex { .. } => DefectKind::RepeatedVertex,
            Self::DuplicateFace { .. } => DefectKind::DuplicateFace,
            Self::ZeroArea { .. } => DefectKind::ZeroArea,
            Self::NonManifoldEdge { .. } => DefectKind::NonManifoldEdge,
            Self::CutMeetsEdge { .. } => DefectKind::CutMeetsEdge,
            Self::InconsistentOrientation { .. } => DefectKind::InconsistentOrientation,
            Self::NotOrientable { .. } => DefectKind::NotOrientable,
            Self::SeveralFans { .. } => DefectKind::SeveralFans,
            Self::InsideOut { .. } => DefectKind::InsideOut,
            Self::Hole { .. } => DefectKind::Hole,
            Self::DuplicateVertex { .. } => DefectKind::DuplicateVertex,
            Self::UnreferencedVertex { .. } => DefectKind::UnreferencedVertex,
            Self::NonFinite { .. } => DefectKind::NonFinite,
        }
    }

    /// The vertices concerned; for a repetition, the later one first.
    pub fn vertices(&self) -> Vec<usize> {
        match self {
            Self::RepeatedVertex { vertex, .. }
            | Self::SeveralFans { vertex, .. }
            | Self::UnreferencedVertex { vertex } => vec![*vertex],
            Self::NonManifoldEdge { vertices, .. }
            | Self::CutMeetsEdge { vertices, .. }
            | Self::InconsistentOrientation { vertices, .. } => vertices.to_vec(),
            Self::DuplicateVertex { vertex, repeats } => vec![*vertex, *repeats],
            Self::Hole { vertices, .. } => vertices.clone(),
            Self::NonFinite {
                element: "vertex",
                number,
                ..
            } => vec![*number],
            _ => Vec::new(),
        }
    }

    /// The faces concerned; for a repetition, the later one first.
    pub fn faces(&self) -> Vec<usize> {
        match self {
            Self::RepeatedVertex { face, .. }
            | Self::ZeroArea { face }
            | Self::CutMeetsEdge { face, .. }
            | Self::NotOrientable { face, .. }
            | Self::InsideOut { face, .. } => vec![*face],
            Self::DuplicateFace { face, repeats } => vec![*face, *repeats],
            Self::NonManifoldEdge { faces, .. } => faces.clone(),
            Self::InconsistentOrientation { faces, .. } => faces.to_vec(),
            Self::NonFinite {
                element: "face",
                number,
                ..
            } => vec![*number],
            _ => Vec::new(),
        }
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RepeatedVertex { face, vertex } => {
                write!(f, "face {face} passes twice through vertex {vertex}")
            }
            Self::DuplicateFace { face, repeats } => {
                write!(f, "face {face} repeats face {repeats}")
            }
            Self::ZeroArea { face } => write!(f, "face {face} has a triangle without area"),
            Self::NonManifoldEdge {
                vertices: [a, b],
                faces,
            } => write!(
                f,
                "the edge between vertices {a} and {b} has {} faces",
                faces.len()
            ),
            Self::CutMeetsEdge {
                face,
                vertices: [a, b],
            } => write!(
                f,
                "face {face}, cut into triangles, has an edge between vertices {a} and {b}, \
                 where other faces have one"
            ),
            Self::InconsistentOrientation {
                vertices: [a, b],
                faces: [one, other],
            } => write!(
                f,
                "faces {one} and {other} run through the edge between vertices {a} and {b} in the \
                 same direction"
            ),
            Self::NotOrientable { component, face } => write!(
                f,
                "component {component} (from face {face}) has only one side: consistent \
                 orientation is impossible"
            ),
            Self::SeveralFans { vertex, num_fans } => {
                write!(f, "vertex {vertex} joins {num_fans} separate fans of faces")
            }
            Self::InsideOut { component, face } => write!(
                f,
                "component {component} (from face {face}) is inside out: its faces look inward"
            ),
            // A hole is always identified by its lowest vertex.
            Self::Hole { vertices, length } => match vertices.iter().min() {
                Some(vertex) => write!(
                    f,
                    "the hole at vertex {vertex} has {} edges, {} long",
                    vertices.len(),
                    Readable(*length)
                ),
                None => f.write_str("an empty boundary"),
            },
            Self::DuplicateVertex { vertex, repeats } => {
                write!(
                    f,
                    "vertex {vertex} is at the same position as vertex {repeats}"
                )
            }
            Self::UnreferencedVertex { vertex } => write!(f, "vertex {vertex} belongs to no face"),
            Self::NonFinite {
                element,
                property,
                number,
            } => write!(
                f,
                "`{property}` of {element} {number} is not a finite number"
            ),
        }
    }
}
