//! Attributes per vertex that the quadrics take into account.

use cotan_halfedge::VertexMap;

use crate::tessellation_error::TessellationError;

/// Numbers per vertex, such as the components of a colour or texture coordinates, whose change
/// counts as a cost.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct VertexAttributes {
    channels: Vec<(VertexMap<f64>, f64)>,
}

impl VertexAttributes {
    /// No attributes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a number per vertex. A difference of 1 costs as much as a distance of `weight` times
    /// the longest side of the bounding box.
    #[must_use]
    pub fn with(mut self, values: VertexMap<f64>, weight: f64) -> Self {
        self.channels.push((values, weight));
        self
    }
}

/// The attributes of a mesh, checked and scaled by their weights.
#[derive(Clone, Debug, Default)]
pub(crate) struct Channels {
    values: Vec<Vec<f64>>,
    weights: Vec<f64>,
}

impl Channels {
    pub(crate) fn new(
        attributes: &VertexAttributes,
        num_vertices: usize,
    ) -> Result<Self, TessellationError> {
        let mut channels = Self::default();
        for (values, weight) in &attributes.channels {
            if values.len() != num_vertices {
                return Err(TessellationError::Length {
                    name: "an attribute",
                    entries: values.len(),
                    elements: num_vertices,
                });
            }
            if !(weight.is_finite() && *weight > 0.0) {
                return Err(TessellationError::Option {
                    option: "the weight of an attribute",
                    expected: "a finite number above 0",
                    value: *weight,
                });
            }
            if let Some(vertex) = values.values().position(|x| !(x * weight).is_finite()) {
                return Err(TessellationError::Attribute { vertex });
            }
            channels
                .values
                .push(values.values().map(|x| x * weight).collect());
            channels.weights.push(*weight);
        }
        Ok(channels)
    }

    pub(crate) fn num_channels(&self) -> usize {
        self.values.len()
    }

    /// The weighted value of channel `k`.
    #[inline]
    pub(crate) fn value(&self, v: u32, k: usize) -> f64 {
        self.values[k][v as usize]
    }

    /// The value of channel `k` without its weight.
    pub(crate) fn unweighted(&self, k: usize, value: f64) -> f64 {
        value / self.weights[k]
    }
}
