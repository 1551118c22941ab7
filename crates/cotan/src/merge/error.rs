//! Errors of merging.

use std::fmt;

use cotan_geometry::MeshError;
use cotan_halfedge::VertexId;
use thiserror::Error as ThisError;

/// One of the two surfaces that are merged.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Input {
    /// The first, which stays in place.
    A,
    /// The second.
    B,
}

impl fmt::Display for Input {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::A => "the first mesh",
            Self::B => "the second mesh",
        })
    }
}

/// The reason why two surfaces could not be merged.
#[derive(Clone, PartialEq, Debug, ThisError)]
#[non_exhaustive]
pub enum MergeError {
    /// A closed component has a negative volume.
    #[error(
        "{input} is inside out at the component of vertex {vertex}; reverse its faces first, for example with `Repair`"
    )]
    InsideOut {
        /// The surface.
        input: Input,
        /// The lowest vertex of the component.
        vertex: VertexId,
    },
    /// The selection has the wrong length.
    #[error("the selection of {input} has {len} entries, but there are {num_faces} faces")]
    KeepLength {
        /// The surface.
        input: Input,
        /// The number of entries.
        len: usize,
        /// The number of faces.
        num_faces: usize,
    },
    /// No face is left.
    #[error("nothing of {input} is kept; select a larger part, which contains whole triangles")]
    NothingKept {
        /// The surface.
        input: Input,
    },
    /// The selection cuts no edge.
    #[error(
        "the selection keeps {input} whole, so there is no cut to join; select the part that is to be kept"
    )]
    NothingCut {
        /// The surface.
        input: Input,
    },
    /// A cut ends on the boundary of an open surface.
    #[error(
        "the cut of {input} runs into its boundary near vertex {vertex}; cut along a closed line"
    )]
    CutMeetsRim {
        /// The surface.
        input: Input,
        /// A vertex of the cut.
        vertex: VertexId,
    },
    /// The cuts do not correspond.
    #[error(
        "the first mesh is cut along {} loops and the second along {}; change the selections so that the numbers agree", loops[0], loops[1]
    )]
    UnequalLoops {
        /// The numbers of loops.
        loops: [usize; 2],
    },
    /// A pair names a loop that does not exist, or one twice, or not all.
    #[error("the pairs of loops must name each of the {loops} loops of both meshes once, from 0")]
    LoopPairs {
        /// The number of loops on each side.
        loops: usize,
    },
    /// Several loops cannot be placed on each other without landmarks.
    #[error(
        "{loops} loops do not determine the place of the second mesh; give three landmarks or more, or leave it as it is"
    )]
    Landmarks {
        /// The number of loops on each side.
        loops: usize,
    },
    /// A landmark is not a vertex.
    #[error("a landmark names vertex {vertex} of {input}, which does not exist")]
    LandmarkOutOfRange {
        /// The surface.
        input: Input,
        /// The vertex.
        vertex: VertexId,
    },
    /// Two loops differ too much in length.
    #[error(
        "loop {pair}: one of its cuts is more than twice as long as the other ({} and {}); cut where the girths are more alike, or fit the second mesh", lengths[0], lengths[1]
    )]
    Perimeters {
        /// The index of the pair of loops.
        pair: usize,
        /// The lengths.
        lengths: [f64; 2],
    },
    /// The joined faces do not form a surface.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The seam could not be smoothed.
    #[error(transparent)]
    Blend(#[from] crate::Error),
}
