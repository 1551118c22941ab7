//! What a repair did.

use std::fmt;

/// One thing that a repair did.
///
/// Vertices and faces have the numbers that they had before the repair, counted from 0; where new
/// vertices are named, they have those of the repaired document.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Change {
    /// A vertex became one with another.
    MergedVertex {
        /// The vertex that is gone.
        vertex: usize,
        /// The vertex that stands for it.
        into: usize,
    },
    /// A polygon lost corners that enclosed nothing.
    TrimmedFace {
        /// The face.
        face: usize,
        /// How many corners it lost.
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
    /// A face with the outline of one before it was dropped.
    DroppedDuplicate {
        /// The face.
        face: usize,
        /// The one that stays.
        repeats: usize,
    },
    /// A face was turned round.
    TurnedFace {
        /// The face.
        face: usize,
    },
    /// The faces at an edge were parted into pairs that agree, and single ones.
    PartedEdge {
        /// The ends of the edge.
        vertices: [usize; 2],
        /// Its faces.
        faces: Vec<usize>,
    },
    /// A face was cut loose from its neighbours, since nothing less helped.
    DetachedFace {
        /// The face.
        face: usize,
    },
    /// Each fan of faces got a vertex of its own.
    SplitVertex {
        /// The vertex.
        vertex: usize,
        /// Its copies, in the numbers of the repaired document.
        copies: Vec<usize>,
    },
    /// Vertices that were welded are no longer, as their faces do not hang together there.
    PartedPlace {
        /// The first of them.
        vertex: usize,
        /// How many places there are now.
        num_places: usize,
    },
    /// All faces of a part were dropped, with the vertices that only these used.
    DroppedPart {
        /// Its first face.
        face: usize,
        /// How many faces it had.
        num_faces: usize,
    },
    /// A hole was filled.
    FilledHole {
        /// The vertices round it.
        vertices: Vec<usize>,
        /// How many faces fill it.
        num_faces: usize,
        /// How many vertices were added to it.
        num_added: usize,
    },
    /// A hole could not be filled and stays.
    KeptHole {
        /// The vertices round it.
        vertices: Vec<usize>,
        /// Why.
        problem: &'static str,
    },
    /// A vertex that no face uses was dropped.
    DroppedVertex {
        /// The vertex.
        vertex: usize,
    },
}

impl Change {
    /// What was done, without where.
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

/// A hole by the lowest of its vertices, as a [`Defect::Hole`](crate::Defect::Hole) is named, too.
struct Hole<'a>(&'a [usize]);

impl fmt::Display for Hole<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lowest = self.0.iter().min().copied().unwrap_or_default();
        write!(f, "the hole at vertex {lowest} ({} edges)", self.0.len())
    }
}
