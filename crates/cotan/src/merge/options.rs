//! The settings of merging.

use cotan_halfedge::VertexId;

use crate::named::setters;

/// The place of the second surface.
#[derive(Clone, PartialEq, Debug, Default)]
#[non_exhaustive]
pub enum Placement {
    /// In its own coordinates.
    #[default]
    AsIs,
    /// Scaled, turned and moved onto the cut of the first surface: equal areas of the cuts, one
    /// edge apart. With three landmarks or more, by these.
    Fit,
}

/// The settings of [`merge`](super::merge).
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct MergeOptions {
    /// The place of the second surface.
    pub placement: Placement,
    /// Vertices of the first surface and the corresponding ones of the second. They determine
    /// which loops belong together and, with [`Placement::Fit`], the motion.
    pub landmarks: Vec<[VertexId; 2]>,
    /// Which loop of the first surface is joined to which of the second; loops are ordered by
    /// their lowest vertex. If empty, landmarks decide, or else the shortest distances.
    pub loops: Vec<[usize; 2]>,
    /// Number of rings of vertices on either side of the seam that may move when it is blended.
    /// 0 moves only the vertices of the seam.
    pub band: usize,
    /// Number of steps of the flow that blends the seam. With 0 the two cuts are joined as they
    /// are, and no vertex of either surface moves.
    pub iterations: usize,
    /// The memory limit of the factorization in bytes; see [`cotan_linear::SystemOptions`].
    pub max_memory: Option<u64>,
}

setters!(MergeOptions {
    placement: Placement,
    landmarks: Vec<[VertexId; 2]>,
    loops: Vec<[usize; 2]>,
    band: usize,
    iterations: usize,
    max_memory: impl Into<Option<u64>>,
});

impl Default for MergeOptions {
    fn default() -> Self {
        Self {
            placement: Placement::default(),
            landmarks: Vec::new(),
            loops: Vec::new(),
            band: 4,
            iterations: 12,
            max_memory: None,
        }
    }
}
