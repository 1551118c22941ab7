//! The least-squares problem, whatever solves it.

use std::sync::Arc;

use cotan_geometry::Scalar;
use cotan_halfedge::VertexId;
use cotan_laplacian::{Graph, Operator};
use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::components::GraphComponents;
use crate::defect::Defect;
use crate::error::LinearError;
use crate::handles::{self, Handle, Hold};
use crate::ties::{Tie, Ties};
use crate::weights::{Form, Weights};

/// A term μ x·Kx in addition to the Laplacian one, K the graph Laplacian with a stiffness per
/// edge.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Membrane<'a> {
    /// μ, no unit.
    pub weight: f64,
    /// Twice the stiffness of each pair of neighbours: one value per entry of the operator's
    /// graph, row after row. The operator's own weights make K = L/2.
    pub weights: &'a [f64],
}

/// Operator, membrane and handles.
pub(crate) struct Problem {
    pub(crate) graph: Arc<Graph>,
    pub(crate) weights: Weights,
    pub(crate) components: Arc<GraphComponents>,
    pub(crate) membrane: Option<Sheet>,
    pub(crate) ties: Arc<Ties>,
    /// Mean |L_ii|, to which the weights of soft handles are relative.
    unit: f64,
    pub(crate) held: Held,
}

/// A membrane that the system keeps.
pub(crate) struct Sheet {
    /// μ, above 0.
    pub(crate) weight: f64,
    pub(crate) stiffness: Stiffness,
}

/// The stiffness of the edges.
pub(crate) enum Stiffness {
    /// This multiple of their symmetric weights: K is that multiple of −L.
    OfWeights(f64),
    /// Any other.
    PerEntry(Vec<f64>),
}

/// The handles, and what follows from them.
pub(crate) struct Held {
    pub(crate) handles: Vec<Handle>,
    /// (k · mean |L_ii|)² of soft handles, 0 elsewhere; empty if there is none.
    springs: Vec<f64>,
    pub(crate) num_hard: usize,
}

impl Held {
    /// k² of a vertex.
    pub(crate) fn spring(&self, i: usize) -> f64 {
        self.springs.get(i).copied().unwrap_or(0.0)
    }
}

impl Problem {
    pub(crate) fn new<T: Scalar>(
        operator: &Operator<T>,
        handles: &[Handle],
        membrane: Option<Membrane<'_>>,
        ties: &[Tie],
    ) -> Result<Self, LinearError> {
        let graph = operator.graph().clone();
        let components = Arc::new(GraphComponents::new(&graph));
        let unit = operator.mean_diagonal();
        let (weights, membrane) = weigh(operator, membrane)?;
        check_ties(ties, graph.num_rows())?;
        // Without a membrane there is nothing that they could be part of.
        let ties = if membrane.is_some() { ties } else { &[] };
        let ties = Arc::new(Ties::new(graph.num_rows(), ties));
        let held = hold(handles, &components, &ties, unit)?;
        Ok(Self {
            graph,
            weights,
            components,
            membrane,
            ties,
            unit,
            held,
        })
    }

    /// The same handles on an operator of other weights.
    pub(crate) fn reweighted<T: Scalar>(
        &self,
        operator: &Operator<T>,
        membrane: Option<Membrane<'_>>,
    ) -> Result<Self, LinearError> {
        if !Arc::ptr_eq(&self.graph, operator.graph()) && *self.graph != **operator.graph() {
            return Err(LinearError::DifferentMesh);
        }
        let unit = operator.mean_diagonal();
        let (weights, membrane) = weigh(operator, membrane)?;
        Ok(Self {
            graph: self.graph.clone(),
            weights,
            components: self.components.clone(),
            membrane,
            ties: self.ties.clone(),
            unit,
            held: hold(&self.held.handles, &self.components, &self.ties, unit)?,
        })
    }

    /// Applies other handles to this problem.
    pub(crate) fn hold(&self, handles: &[Handle]) -> Result<Held, LinearError> {
        hold(handles, &self.components, &self.ties, self.unit)
    }

    pub(crate) fn num_vertices(&self) -> usize {
        self.graph.num_rows()
    }

    /// μ, 0 without a membrane.
    pub(crate) fn membrane_weight(&self) -> f64 {
        self.membrane.as_ref().map_or(0.0, |m| m.weight)
    }

    /// r_i = (Lᵀ (ℓ − Lx) + μ tension + k² (u − x))_i, whether or not i is a hard handle.
    pub(crate) fn residual_at(&self, defect: &Defect<'_>, i: usize) -> Vector3<f64> {
        let y = defect.laplacian.as_slice();
        let mut r = self.weights.transpose_product(&self.graph, i, y);
        if let Some(tension) = defect.tension {
            r += tension.as_slice()[i] * self.membrane_weight();
        }
        match (defect.pull, self.held.spring(i)) {
            (Some(pull), spring) if spring > 0.0 => r + pull.as_slice()[i] * spring,
            _ => r,
        }
    }
}

/// Refuses ties of vertices that do not exist, and weights that are no positive numbers.
fn check_ties(ties: &[Tie], num_vertices: usize) -> Result<(), LinearError> {
    for tie in ties {
        let is_known = |(v, c): &(VertexId, f64)| v.index() < num_vertices && c.is_finite();
        if !(tie.weight > 0.0 && tie.weight.is_finite() && tie.terms.iter().all(is_known)) {
            return Err(LinearError::Tie {
                weight: tie.weight,
                num_vertices,
            });
        }
    }
    Ok(())
}

fn hold(
    handles: &[Handle],
    components: &GraphComponents,
    ties: &Ties,
    unit: f64,
) -> Result<Held, LinearError> {
    handles::check(handles, components, ties)?;
    let mut springs = Vec::new();
    let mut num_hard = 0;
    for handle in handles {
        match handle.hold {
            Hold::Hard => num_hard += 1,
            Hold::Soft(k) => {
                springs.resize(components.num_vertices(), 0.0);
                springs[handle.vertex.index()] = (k * unit).powi(2);
            }
        }
    }
    Ok(Held {
        handles: handles.to_vec(),
        springs,
        num_hard,
    })
}

/// The weights, and the membrane in the form that says most about it.
fn weigh<T: Scalar>(
    operator: &Operator<T>,
    membrane: Option<Membrane<'_>>,
) -> Result<(Weights, Option<Sheet>), LinearError> {
    let weights = Weights::new(operator);
    let Some(Membrane {
        weight,
        weights: doubled,
    }) = membrane
    else {
        return Ok((weights, None));
    };
    if !(weight.is_finite() && weight >= 0.0) {
        return Err(LinearError::MembraneWeight(weight));
    }
    let tolerance = 1e3 * T::default_epsilon().as_f64();
    let sheet = (weight > 0.0).then(|| Sheet {
        weight,
        stiffness: multiple(operator.graph(), &weights, doubled, tolerance).map_or_else(
            || Stiffness::PerEntry(doubled.iter().map(|w| 0.5 * w).collect()),
            Stiffness::OfWeights,
        ),
    });
    Ok((weights, sheet))
}

/// c, if the stiffness of every edge is c > 0 times its weight, within `tolerance` of the sizes of
/// the weights around it: what is left of both where they cancel is rounding.
fn multiple(graph: &Graph, weights: &Weights, doubled: &[f64], tolerance: f64) -> Option<f64> {
    if !matches!(weights.form(), Form::Symmetric) {
        return None;
    }
    let largest = (0..graph.num_entries()).max_by(|&a, &b| {
        weights
            .outgoing(a)
            .abs()
            .total_cmp(&weights.outgoing(b).abs())
    })?;
    let c = 0.5 * doubled[largest] / weights.outgoing(largest);
    let agrees = |i: usize| {
        let size: f64 = graph.range(i).map(|k| weights.outgoing(k).abs()).sum();
        graph.range(i).all(|k| {
            let s = 0.5 * doubled[k];
            (s - c * weights.outgoing(k)).abs() <= tolerance * c * size
        })
    };
    (c.is_normal() && c > 0.0 && parallel::all(graph.num_rows(), agrees)).then_some(c)
}
