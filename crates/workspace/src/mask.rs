//! Named masks, and the part of the model that an edit may move.

use cotan::geometry::Surface;
use cotan::halfedge::{VertexId, VertexMap};
use cotan::smooth::Mask;
use serde::{Deserialize, Serialize};

use crate::handle::{HandleGroup, Role};
use crate::plain;

/// A mask with a name: how much each vertex takes part in the edits that it restricts.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct NamedMask {
    /// The name in the list.
    pub name: String,
    /// The vertices that take part, sorted and without duplicates.
    #[serde(with = "plain::ids")]
    pub vertices: Vec<VertexId>,
    /// The share of each of them, above 0 and at most 1.
    pub weights: Vec<f64>,
}

impl NamedMask {
    /// Makes a mask of a region whose weights fall to 0 over a length inside its border.
    ///
    /// # Errors
    /// The error of [`Mask::inside`].
    pub fn inside(
        name: String,
        surface: &Surface<'_, f64>,
        region: &[VertexId],
        falloff: f64,
    ) -> Result<Self, cotan::Error> {
        let mask = Mask::inside(surface, region, falloff)?;
        let inside = mask.weights().iter().filter(|(_, w)| **w > 0.0);
        let (vertices, weights) = inside.map(|(v, w)| (v, *w)).unzip();
        Ok(Self {
            name,
            vertices,
            weights,
        })
    }

    /// The weight of each vertex.
    pub fn dense(&self, num_vertices: usize) -> VertexMap<f64> {
        let mut dense = VertexMap::filled(num_vertices, 0.0);
        for (v, weight) in self.vertices.iter().zip(&self.weights) {
            if let Some(at) = dense.get_mut(*v) {
                *at = *weight;
            }
        }
        dense
    }

    /// Returns `true` if the mask is one of a mesh of so many vertices.
    pub(crate) fn fits(&self, num_vertices: usize) -> bool {
        self.vertices.len() == self.weights.len()
            && self.vertices.is_sorted_by(|a, b| a < b)
            && self
                .vertices
                .last()
                .is_none_or(|v| v.index() < num_vertices)
            && self.weights.iter().all(|w| *w > 0.0 && *w <= 1.0)
    }
}

/// The restriction of an edit to a part of the model.
pub(crate) struct Restriction<'a> {
    /// The mask that is in use.
    pub(crate) mask: Option<&'a NamedMask>,
    /// The selection; empty if it does not restrict the edit.
    pub(crate) selection: &'a [VertexId],
    /// The handles, of which the fixed ones do not move.
    pub(crate) handles: &'a [HandleGroup],
    /// The length over which the edit fades at the border of the selection.
    pub(crate) border: f64,
}

impl Restriction<'_> {
    /// The vertices of the fixed groups, sorted.
    pub(crate) fn fixed(&self) -> Vec<VertexId> {
        let fixed = self.handles.iter().filter(|g| g.role == Role::Fixed);
        let mut all: Vec<VertexId> = fixed.flat_map(|g| g.vertices.iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The share of each vertex by mask and selection; `None` if neither restricts the edit.
    pub(crate) fn mask(&self, surface: &Surface<'_, f64>) -> Result<Option<Mask>, cotan::Error> {
        let n = surface.mesh().num_vertices();
        let selected = match self.selection {
            [] => None,
            region => Some(Mask::inside(surface, region, self.border)?),
        };
        match (self.mask, selected) {
            (None, selected) => Ok(selected),
            (Some(mask), None) => Mask::new(mask.dense(n)).map(Some),
            (Some(mask), Some(selected)) => {
                let both = mask.dense(n);
                let pairs = both.values().zip(selected.weights().values());
                Mask::new(pairs.map(|(a, b)| a * b).collect()).map(Some)
            }
        }
    }

    /// The mask, in which the fixed vertices have no share; `None` if nothing is restricted.
    pub(crate) fn mask_with_fixed(
        &self,
        surface: &Surface<'_, f64>,
    ) -> Result<Option<Mask>, cotan::Error> {
        let (mask, fixed) = (self.mask(surface)?, self.fixed());
        if fixed.is_empty() {
            return Ok(mask);
        }
        let mut weights = match mask {
            Some(mask) => mask.weights().clone(),
            None => VertexMap::filled(surface.mesh().num_vertices(), 1.0),
        };
        for v in fixed {
            weights[v] = 0.0;
        }
        Mask::new(weights).map(Some)
    }
}
