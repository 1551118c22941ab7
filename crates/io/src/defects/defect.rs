//! One defect, with its elements.

use std::fmt;

use cotan_geometry::Readable;

use crate::repair::Cure;

/// Something that is wrong with a mesh, and where.
///
/// Vertices and faces have the numbers of the document, counted from 0. Where vertices are welded,
/// a number stands for the first vertex at its place.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum Defect {
    /// A face whose outline runs twice through a place, in a way that it cannot be cut into
    /// triangles; a face that welding collapses is one.
    RepeatedVertex {
        /// The face.
        face: usize,
        /// The vertex that it passes twice.
        vertex: usize,
    },
    /// A face with the outline of one before it, in either direction; not two faces that are each
    /// other's back and have no other neighbour, which are a closed surface.
    DuplicateFace {
        /// The face.
        face: usize,
        /// The first face with this outline.
        repeats: usize,
    },
    /// A face of which a triangle has no area: its height is below 1e-9 of its longest edge.
    ZeroArea {
        /// The face.
        face: usize,
    },
    /// An edge with three faces or more.
    NonManifoldEdge {
        /// Its ends.
        vertices: [usize; 2],
        /// Its faces.
        faces: Vec<usize>,
    },
    /// A polygon that, cut into triangles, gets an edge that other faces have too.
    CutMeetsEdge {
        /// The polygon.
        face: usize,
        /// The ends of the edge.
        vertices: [usize; 2],
    },
    /// Two faces that run through their edge in the same direction.
    InconsistentOrientation {
        /// The ends of the edge.
        vertices: [usize; 2],
        /// The faces.
        faces: [usize; 2],
    },
    /// A component that has but one side, as a Möbius band: it cannot be oriented.
    NotOrientable {
        /// The component, in the order of [`Inspection::components`](super::Inspection).
        component: usize,
        /// Its first face.
        face: usize,
    },
    /// A vertex whose faces do not hang together by edges there.
    SeveralFans {
        /// The vertex.
        vertex: usize,
        /// How many fans of faces meet in it.
        num_fans: usize,
    },
    /// A closed, oriented component whose faces look inward: its volume is negative.
    ///
    /// A component within the bounding box of another closed one may be a cavity and is not
    /// listed.
    InsideOut {
        /// The component, in the order of [`Inspection::components`](super::Inspection).
        component: usize,
        /// Its first face.
        face: usize,
    },
    /// A boundary loop.
    Hole {
        /// Its vertices, one after the other.
        vertices: Vec<usize>,
        /// Its length.
        length: f64,
    },
    /// A vertex at exactly the position of one before it, and not welded to it.
    DuplicateVertex {
        /// The vertex.
        vertex: usize,
        /// The first vertex there.
        repeats: usize,
    },
    /// A vertex that no face uses.
    UnreferencedVertex {
        /// The vertex.
        vertex: usize,
    },
    /// A value of an attribute that is NaN or infinite.
    NonFinite {
        /// What has the value: `vertex`, `face`, or `corner value`.
        element: &'static str,
        /// The property, as [`Attributes`](crate::Attributes) name it.
        property: String,
        /// The number of the vertex, the face, or the value in the property's table.
        number: usize,
    },
}

/// What is wrong, without where.
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
    /// Its name in words.
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

    /// Whether no surface can be built as long as there is such a defect.
    ///
    /// Duplicate faces are no hindrance themselves: two that face each other close. Faces that
    /// welding collapses are an exception, as the surface leaves them out, and a few that
    /// run out and back, whose triangles happen to fit.
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

    /// The step of [`Repair`](crate::Repair) that cures it; `None` if none does.
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
    /// What is wrong, without where.
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

    /// The vertices that have it; of a repetition, the later one first.
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

    /// The faces that have it; of a repetition, the later one first.
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
            // Each by its lowest vertex, wherever it is spoken of.
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
