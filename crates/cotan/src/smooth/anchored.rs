//! The anchored system, in which each vertex is held weakly at its original position.

use std::ops::ControlFlow;
use std::sync::Arc;

use cotan_flow::{Acceleration, Flow, Orientation, Rest, ScalarFieldUpdater, Start, StopReason};
use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::HalfedgeMesh;
use cotan_laplacian::{LaplacianScheme, Operator};
use cotan_linear::{Handle, Hold, SystemOptions};
use nalgebra::Point3;

use crate::error::Error;
use crate::handles::Handles;

/// The treatment of the boundary of an open mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Boundary {
    /// Boundary vertices stay exactly where they are. Noise on the rim remains as well.
    #[default]
    Fixed,
    /// Boundary vertices are anchored like all others and follow the adjacent surface.
    Free,
}

/// A run of the flow in which a spring holds each vertex, or each row if the mesh was cut into
/// pieces: copies of a vertex move as one. All methods in this module use it.
pub(crate) struct Anchored<'a, T: Scalar> {
    pub(crate) mesh: &'a HalfedgeMesh,
    /// The positions at which the operator is measured and the flow starts.
    pub(crate) rest: &'a Positions<T>,
    /// The positions to which the springs pull.
    pub(crate) data: &'a Positions<T>,
    /// μ of (LᵀL + μ² I) x = Lᵀℓ + μ² x⁰. If it is `None`, only the first vertex of each
    /// component is pinned, as in the paper.
    pub(crate) anchor: Option<f64>,
    pub(crate) boundary: Boundary,
    pub(crate) handles: &'a Handles<T>,
    pub(crate) iterations: usize,
    /// The memory limit of the factorization in bytes.
    pub(crate) max_memory: Option<u64>,
    pub(crate) observer: Observer<'a>,
}

/// A callback that receives the index of each completed iteration and may stop the job.
pub(crate) type Observer<'a> = &'a (dyn Fn(usize) -> ControlFlow<()> + Sync);

impl<T: Scalar> Anchored<'_, T> {
    /// Measures the rest shape with the weights of `scheme`.
    pub(crate) fn rest(
        &self,
        scheme: impl LaplacianScheme<T> + 'static,
    ) -> Result<Arc<Rest<T>>, Error> {
        Ok(Arc::new(Rest::new(self.mesh, self.rest, scheme)?))
    }

    /// Runs `iterations` updates with one solve each, and returns the positions in the units of
    /// the input. `rest` is the result of [`Self::rest`].
    pub(crate) fn run(
        &self,
        rest: Arc<Rest<T>>,
        updater: impl ScalarFieldUpdater<T> + 'static,
        orientation: impl Orientation<T> + 'static,
    ) -> Result<Positions<T>, Error> {
        let handles = self.anchors(rest.scheme())?;
        let mut system = SystemOptions::new();
        system.max_memory = self.max_memory;
        let mut flow = Flow::on(rest)
            .system(system)
            .updater(updater)
            .orientation(orientation)
            .handles(handles)
            .start(Start::Original)
            .acceleration(Acceleration::Off)
            .tolerance(0.0)
            // The first solve of a flow only locates its original mesh.
            .iteration_limit(self.iterations + 1)
            .build()?;
        let report = flow.run(|_, step| (self.observer)(step.iteration.saturating_sub(1)))?;
        if report.stop == StopReason::Cancelled {
            return Err(Error::Cancelled);
        }
        if report.residual.is_finite() {
            Ok(self.mesh.to_vertices(flow.positions()))
        } else {
            Err(Error::SmoothingDiverged {
                iterations: report.iterations,
            })
        }
    }

    /// The user's handles, hard handles for fixed boundaries, and the anchors.
    fn anchors(&self, scheme: &dyn LaplacianScheme<T>) -> Result<Vec<(Handle, Point3<T>)>, Error> {
        let mesh = self.mesh;
        let mut holds: Vec<Option<Hold>> = match self.anchor {
            Some(anchor) => {
                let weight = anchor / self.spring_unit(scheme)?;
                vec![Some(Hold::Soft(weight)); mesh.num_rows()]
            }
            None => first_of_components(mesh),
        };
        if self.boundary == Boundary::Fixed {
            for v in mesh.rows().filter(|&v| mesh.is_rim_vertex(v)) {
                holds[v.index()] = Some(Hold::Hard);
            }
        }
        let mut targets = self.data.clone();
        for (handle, target) in self.handles.resolve(self.mesh, self.data)? {
            holds[handle.vertex.index()] = Some(handle.hold);
            targets[handle.vertex] = target;
        }
        let held = mesh.rows().zip(holds);
        Ok(held
            .filter_map(|(vertex, hold)| {
                Some((
                    Handle {
                        vertex,
                        hold: hold?,
                    },
                    targets[vertex],
                ))
            })
            .collect())
    }

    /// The springs of the flow are relative to the mean diagonal of L: k = μ / mean |L_ii|.
    fn spring_unit(&self, scheme: &dyn LaplacianScheme<T>) -> Result<f64, Error> {
        let surface = Surface::new(self.mesh, self.rest)?;
        let unit = Operator::assemble(scheme, &surface)?.mean_diagonal();
        // A mesh without inner vertices has no rows, so springs of any weight hold it.
        Ok(if unit > 0.0 { unit } else { 1.0 })
    }
}

/// Pins the lowest vertex of each component.
fn first_of_components(mesh: &HalfedgeMesh) -> Vec<Option<Hold>> {
    let components = mesh.components();
    let mut is_new = vec![true; components.count()];
    mesh.rows()
        .map(|v| {
            let is_first = std::mem::take(&mut is_new[components.of(v)]);
            is_first.then_some(Hold::Hard)
        })
        .collect()
}

/// The rows that must stay in place: fixed boundaries and hard handles.
pub(crate) fn held<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<T>,
    boundary: Boundary,
    handles: &Handles<T>,
) -> Result<Vec<bool>, Error> {
    let is_rim = |v| boundary == Boundary::Fixed && mesh.is_rim_vertex(v);
    let mut held: Vec<bool> = mesh.rows().map(is_rim).collect();
    for (handle, _) in handles.resolve(mesh, positions)? {
        held[handle.vertex.index()] |= handle.hold == Hold::Hard;
    }
    Ok(held)
}
