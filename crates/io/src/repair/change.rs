//! The log of a repair.

use std::fmt;

/// A single change made by a repair.
///
/// Vertex and face indices are 0-based and refer to the document before the repair, except for
/// new vertices, which have their indices in the repaired document.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Change {
    /// A vertex was merged into another.
    MergedVertex {
        /// The vertex that was removed.
        vertex: usize,
        /// The vertex that replaces it.
        into: usize,
    },
    /// A polygon lost corners that enclosed nothing.
    TrimmedFace {
        /// The face.
        face: usize,
        /// The number of corners removed.
        num_corners: usize,
    },
    /// A face that enclosed nothing was dropped.
    DroppedDegenerate {
        /// The face.
        face: usize,
    },
    /// A face without area was dropped.
    DroppedZeroArea {
        /// The face.
        face: usize,
    },
    /// A face with the outline of an earlier one was dropped.
    DroppedDuplicate {
        /// The face.
        face: usize,
        /// The face that is kept.
        repeats: usize,
    },
    /// A face was reversed.
    TurnedFace {
        /// The face.
        face: usize,
    },
    /// The faces at an edge were separated into consistently oriented pairs and single faces.
    PartedEdge {
        /// The ends of the edge.
        vertices: [usize; 2],
        /// The faces at the edge.
        faces: Vec<usize>,
    },
    /// A face was detached from its neighbours, as a last resort.
    DetachedFace {
        /// The face.
        face: usize,
    },
    /// A vertex was split so that each fan of faces has its own.
    SplitVertex {
        /// The vertex.
        vertex: usize,
        /// Its copies, as indices in the repaired document.
        copies: Vec<usize>,
    },
    /// Welded vertices were separated because their faces are not connected there.
    PartedPlace {
        /// The first of them.
        vertex: usize,
        /// The number of places after the separation.
        num_places: usize,
    },
    /// All faces of a part were dropped, together with the vertices that only they used.
    DroppedPart {
        /// Its first face.
        face: usize,
        /// The number of its faces.
        num_faces: usize,
    },
    /// A hole was filled.
    FilledHole {
        /// The vertices around it.
        vertices: Vec<usize>,
        /// The number of faces that fill it.
        num_faces: usize,
        /// The number of vertices added.
        num_added: usize,
    },
    /// A hole could not be filled and remains open.
    KeptHole {
        /// The vertices around it.
        vertices: Vec<usize>,
        /// The reason.
        problem: &'static str,
    },
    /// A vertex that no face uses was dropped.
    DroppedVertex {
        /// The vertex.
        vertex: usize,
    },
}

impl Change {
    /// The kind of change, without its location.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::MergedVertex { .. } => "merged vertices",
            Self::TrimmedFace { .. } => "trimmed faces",
            Self::DroppedDegenerate { .. } => "dropped degenerate faces",
            Self::DroppedZeroArea { .. } => "dropped zero-area faces",
            Self::DroppedDuplicate { .. } => "dropped duplicate faces",
            Self::TurnedFace { .. } => "turned faces",
            Self::PartedEdge { .. } => "parted edges",
            Self::DetachedFace { .. } => "detached faces",
            Self::SplitVertex { .. } => "split vertices",
            Self::PartedPlace { .. } => "parted places",
            Self::DroppedPart { .. } => "dropped parts",
            Self::FilledHole { .. } => "filled holes",
            Self::KeptHole { .. } => "holes that stay",
            Self::DroppedVertex { .. } => "dropped vertices",
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MergedVertex { vertex, into } => {
                write!(f, "merged vertex {vertex} into vertex {into}")
            }
            Self::TrimmedFace { face, num_corners } => {
                let s = if *num_corners == 1 { "" } else { "s" };
                write!(
                    f,
                    "trimmed face {face} of {num_corners} corner{s} that enclosed nothing"
                )
            }
            Self::DroppedDegenerate { face } => {
                write!(f, "dropped face {face}: it encloses nothing")
            }
            Self::DroppedZeroArea { face } => write!(f, "dropped face {face}: it has no area"),
            Self::DroppedDuplicate { face, repeats } => {
                write!(f, "dropped face {face}: it repeats face {repeats}")
            }
            Self::TurnedFace { face } => write!(f, "turned face {face} round"),
            Self::PartedEdge {
                vertices: [a, b],
                faces,
            } => write!(
                f,
                "parted {} faces at the edge between vertices {a} and {b}",
                faces.len()
            ),
            Self::DetachedFace { face } => {
                write!(f, "detached face {face} from its neighbours")
            }
            Self::SplitVertex { vertex, copies } => {
                let s = if copies.len() == 1 {
                    "vertex"
                } else {
                    "vertices"
                };
                let list: Vec<String> = copies.iter().map(usize::to_string).collect();
                write!(
                    f,
                    "split vertex {vertex} into {} (new {s} {})",
                    copies.len() + 1,
                    list.join(", ")
                )
            }
            Self::PartedPlace { vertex, num_places } => {
                write!(
                    f,
                    "parted the {num_places} fans of faces at vertex {vertex}"
                )
            }
            Self::DroppedPart { face, num_faces } => {
                let s = if *num_faces == 1 { "" } else { "s" };
                write!(f, "dropped the part from face {face} ({num_faces} face{s})")
            }
            Self::FilledHole {
                vertices,
                num_faces,
                num_added,
            } => {
                let s = if *num_faces == 1 { "" } else { "s" };
                write!(f, "filled {} with {num_faces} face{s}", Hole(vertices))?;
                match num_added {
                    0 => Ok(()),
                    1 => f.write_str(" and a new vertex"),
                    n => write!(f, " and {n} new vertices"),
                }
            }
            Self::KeptHole { vertices, problem } => {
                write!(f, "left {} open: {problem}", Hole(vertices))
            }
            Self::DroppedVertex { vertex } => {
                write!(f, "dropped vertex {vertex}: no face uses it")
            }
        }
    }
}

/// Displays a hole by its lowest vertex, like [`Defect::Hole`](crate::Defect::Hole).
struct Hole<'a>(&'a [usize]);

impl fmt::Display for Hole<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lowest = self.0.iter().min().copied().unwrap_or_default();
        write!(f, "the hole at vertex {lowest} ({} edges)", self.0.len())
    }
}
