//! DecimateAttributes that the quadrics take into account.

use cotan_geometry::Surface;
use cotan_halfedge::{FaceMap, VertexMap};

use crate::tessellation_error::TessellationError;

/// Numbers on a mesh, such as the components of a colour or texture coordinates, whose change
/// counts as a cost.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct DecimateAttributes {
    channels: Vec<Channel>,
}

#[derive(Clone, PartialEq, Debug)]
struct Channel {
    values: Values,
    weight: f64,
}

#[derive(Clone, PartialEq, Debug)]
enum Values {
    PerVertex(VertexMap<f64>),
    PerCorner(FaceMap<[f64; 3]>),
}

impl DecimateAttributes {
    /// No attributes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a number per vertex. A difference of 1 costs as much as a distance of `weight` times
    /// the longest side of the bounding box.
    #[must_use]
    pub fn with(self, values: VertexMap<f64>, weight: f64) -> Self {
        self.with_channel(Values::PerVertex(values), weight)
    }

    /// Adds a number per corner of the faces, in the order of [`HalfedgeMesh::triangle`], with a
    /// weight as in [`Self::with`].
    ///
    /// The values may jump at the edges of [`super::DecimateOptions::features`], such as texture
    /// coordinates at seams. Vertices of these lines are merged along the line only, and no other
    /// vertex is merged into them, so that values of the two sides never mix.
    ///
    /// [`HalfedgeMesh::triangle`]: cotan_halfedge::HalfedgeMesh::triangle
    #[must_use]
    pub fn with_corners(self, values: FaceMap<[f64; 3]>, weight: f64) -> Self {
        self.with_channel(Values::PerCorner(values), weight)
    }

    fn with_channel(mut self, values: Values, weight: f64) -> Self {
        self.channels.push(Channel { values, weight });
        self
    }
}

/// The attributes of a mesh, checked and scaled by their weights.
#[derive(Clone, Debug, Default)]
pub(crate) struct Channels {
    /// Per channel and corner.
    values: Vec<Vec<f64>>,
    /// Per channel and vertex: the value at one of its corners.
    own: Vec<Vec<f64>>,
    weights: Vec<f64>,
    /// Returns true if a channel may jump at kept lines.
    pub(crate) may_jump: bool,
}

impl Channels {
    pub(crate) fn new<T: cotan_geometry::Scalar>(
        attributes: &DecimateAttributes,
        surface: &Surface<'_, T>,
    ) -> Result<Self, TessellationError> {
        let mut channels = Self::default();
        if attributes.channels.is_empty() {
            return Ok(channels);
        }
        let mesh = surface.mesh();
        let vertices: Vec<usize> = mesh
            .faces()
            .flat_map(|f| mesh.triangle(f).map(|v| v.index()))
            .collect();
        for Channel { values, weight } in &attributes.channels {
            let (entries, elements) = match values {
                Values::PerVertex(values) => (values.len(), mesh.num_vertices()),
                Values::PerCorner(values) => (values.len(), mesh.num_faces()),
            };
            if entries != elements {
                return Err(TessellationError::Length {
                    name: "an attribute",
                    entries,
                    elements,
                });
            }
            if !(weight.is_finite() && *weight > 0.0) {
                return Err(TessellationError::Option {
                    option: "the weight of an attribute",
                    expected: "a finite number above 0",
                    value: *weight,
                });
            }
            let corners: Vec<f64> = match values {
                Values::PerVertex(values) => {
                    let values = values.as_slice();
                    vertices.iter().map(|&v| values[v] * weight).collect()
                }
                Values::PerCorner(values) => {
                    values.values().flatten().map(|x| x * weight).collect()
                }
            };
            if let Some(corner) = corners.iter().position(|x| !x.is_finite()) {
                let vertex = vertices[corner];
                return Err(TessellationError::Attribute { vertex });
            }
            let mut own = vec![0.0; mesh.num_vertices()];
            for (&v, &value) in vertices.iter().zip(&corners) {
                own[v] = value;
            }
            channels.may_jump |= matches!(values, Values::PerCorner(_));
            channels.values.push(corners);
            channels.own.push(own);
            channels.weights.push(*weight);
        }
        Ok(channels)
    }

    pub(crate) fn num_channels(&self) -> usize {
        self.values.len()
    }

    /// The weighted value of channel `k` at a corner.
    #[inline]
    pub(crate) fn at_corner(&self, corner: u32, k: usize) -> f64 {
        self.values[k][corner as usize]
    }

    /// The weighted value of channel `k` at a vertex, on one of its faces.
    #[inline]
    pub(crate) fn at_vertex(&self, v: u32, k: usize) -> f64 {
        self.own[k][v as usize]
    }

    /// The value of channel `k` without its weight.
    pub(crate) fn unweighted(&self, k: usize, value: f64) -> f64 {
        value / self.weights[k]
    }
}
