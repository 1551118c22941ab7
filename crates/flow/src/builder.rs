//! Settings of a flow.
//!
//! One concept with `flow`: a [`Flow`] is made here, and checks other handles as the builder does.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{Cotangent, LaplacianScheme};
use cotan_linear::{Handle, Membrane, PreparedSystem, SystemOptions};
use nalgebra::{Point3, Vector3};

use crate::current::Current;
use crate::energy::{Hybrid, LocalGlobal};
use crate::error::FlowError;
use crate::flow::Flow;
use crate::orientation::Orientation;
use crate::projection::Projection;
use crate::rest::Rest;
use crate::rule::{Descent, FixedPoint, Projected, Rule};
use crate::schedule::Schedule;

use crate::point_tie::PointTie;
use crate::stated_turns::{StatedTurns, check_turns};
use crate::targets::Targets;
use crate::ties::in_system;
use crate::updater::{KeepMagnitude, ScalarFieldUpdater};
use crate::workspace::{Settings, Terms, Workspace};

/// The longest move at which a run counts as converged, over the bounding box's diagonal.
pub const DEFAULT_TOLERANCE: f64 = 1e-4;

/// The most iterations of a run.
pub const DEFAULT_ITERATION_LIMIT: usize = 200;

/// The Laplacian coordinates of the first solve.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Start {
    /// Those of the original mesh (the paper's default, section 3.4).
    Original,
    /// Those of the original mesh, turned by the rotations of the handle regions: the rotation
    /// that fits the move of all handles best, and the deviation of each connected region from it,
    /// which is interpolated over the mesh by the flow's own system. A region of fewer than three
    /// vertices, or of vertices on a line, follows the rotation of all handles, or that of the
    /// regions around it. One more solve, when the flow is built; handles that move later are
    /// followed from the current shape.
    #[default]
    HandleRotations,
    /// Those that updater and orientation (or energy) make of the first shape, for scalar fields
    /// that do not start from the original's.
    Updated,
    /// Zero: the shape must come from the two scalar fields alone (paper, section 3.4, figure 8).
    Zero,
}

/// The acceleration of the iteration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Acceleration {
    /// Plain steps.
    Off,
    /// From the last `memory` steps: L-BFGS for an energy, Anderson's method for an orientation.
    /// Only in effect while the updating ratio is 1; flows with a projection take plain steps.
    Memory(usize),
}

impl Default for Acceleration {
    fn default() -> Self {
        // 5 to 20 steps work equally well, and each of them is read in every iteration.
        Self::Memory(5)
    }
}

/// Collects the settings of a [`Flow`]. All settings except the handles have defaults.
pub struct FlowBuilder<T: Scalar> {
    source: Source<T>,
    updater: Option<Box<dyn ScalarFieldUpdater<T>>>,
    stepping: Stepping<T>,
    first_shape: Option<Positions<T>>,
    handles: Vec<(Handle, Point3<T>)>,
    region: Option<Vec<VertexId>>,
    ties: Vec<PointTie>,
    system: SystemOptions,
    start: Start,
    stated_turns: StatedTurns,
    acceleration: Acceleration,
    settings: Settings<T>,
}

/// The source of the rest shape.
enum Source<T: Scalar> {
    Measured(Arc<Rest<T>>),
    Mesh {
        mesh: Arc<HalfedgeMesh>,
        positions: Arc<Positions<T>>,
        scheme: Arc<dyn LaplacianScheme<T>>,
    },
}

impl<T: Scalar> Source<T> {
    fn num_vertices(&self) -> usize {
        match self {
            Self::Measured(rest) => rest.mesh().num_rows(),
            Self::Mesh { mesh, .. } => mesh.num_rows(),
        }
    }
}

/// Whether the points of a tie are on a mesh of so many vertices.
fn is_on(tie: &PointTie, num_vertices: usize) -> bool {
    let corners = || tie.own.iter().chain(&tie.on);
    corners().all(|(v, share)| v.index() < num_vertices && share.is_finite())
}

/// The rule that was chosen.
enum Stepping<T: Scalar> {
    /// None: the descent of [`Hybrid`].
    Default,
    Descent(Box<dyn LocalGlobal<T>>),
    FixedPoint(Box<dyn Orientation<T>>),
    Projected(Box<dyn Orientation<T>>, Box<dyn Projection<T>>),
}

impl<T: Scalar> std::fmt::Debug for FlowBuilder<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let stepping = match self.stepping {
            Stepping::Default => "descent of the default energy",
            Stepping::Descent(_) => "descent",
            Stepping::FixedPoint(_) => "fixed point",
            Stepping::Projected(..) => "projected",
        };
        f.debug_struct("FlowBuilder")
            .field("rule", &stepping)
            .field("handles", &self.handles.len())
            .field("settings", &self.settings)
            .finish_non_exhaustive()
    }
}

impl<T: Scalar> FlowBuilder<T> {
    pub(crate) fn new(mesh: Arc<HalfedgeMesh>, positions: Arc<Positions<T>>) -> Self {
        Self::from_source(Source::Mesh {
            mesh,
            positions,
            scheme: Arc::new(Cotangent::default()),
        })
    }

    pub(crate) fn on(rest: Arc<Rest<T>>) -> Self {
        Self::from_source(Source::Measured(rest))
    }

    fn from_source(source: Source<T>) -> Self {
        Self {
            source,
            updater: None,
            stepping: Stepping::Default,
            first_shape: None,
            handles: Vec::new(),
            region: None,
            ties: Vec::new(),
            system: SystemOptions::default(),
            start: Start::default(),
            stated_turns: Vec::new(),
            acceleration: Acceleration::default(),
            settings: Settings {
                schedule: Schedule::default(),
                ratios: None,
                tolerance: DEFAULT_TOLERANCE,
                iteration_limit: DEFAULT_ITERATION_LIMIT,
            },
        }
    }

    /// Weights of the Laplacian. Default: [`Cotangent`]. A rest shape that was measured by another
    /// scheme is measured again.
    ///
    /// The membrane of the default energy is weighted by cotangents whatever the scheme; a
    /// scheme that is to determine the result alone needs an orientation, such as
    /// [`crate::BestRotation`].
    #[must_use]
    pub fn scheme(mut self, scheme: impl LaplacianScheme<T> + 'static) -> Self {
        let scheme: Arc<dyn LaplacianScheme<T>> = Arc::new(scheme);
        self.source = match self.source {
            Source::Measured(rest) => Source::Mesh {
                mesh: rest.shared_mesh().clone(),
                positions: rest.original_positions().clone(),
                scheme,
            },
            Source::Mesh {
                mesh, positions, ..
            } => Source::Mesh {
                mesh,
                positions,
                scheme,
            },
        };
        self
    }

    /// Prescribes the scalar field. Default: [`KeepMagnitude`].
    ///
    /// The membrane of the default energy knows the original edges and pulls against a field that
    /// wants another shape. With an updater the flow therefore asks for a choice:
    /// [`Self::orientation`], or [`Self::energy`] if the field is to be weighed against an energy.
    #[must_use]
    pub fn updater(mut self, updater: impl ScalarFieldUpdater<T> + 'static) -> Self {
        self.updater = Some(Box::new(updater));
        self
    }

    /// Steps to a fixed point of this orientation, in the place of [`Self::energy`] and
    /// [`Self::projected`].
    #[must_use]
    pub fn orientation(mut self, orientation: impl Orientation<T> + 'static) -> Self {
        self.stepping = Stepping::FixedPoint(Box::new(orientation));
        self
    }

    /// Descends this energy, in the place of [`Self::orientation`] and [`Self::projected`].
    /// Default: [`Hybrid`].
    #[must_use]
    pub fn energy(mut self, energy: impl LocalGlobal<T> + 'static) -> Self {
        self.stepping = Stepping::Descent(Box::new(energy));
        self
    }

    /// Takes plain steps with this orientation and carries every one of them back by a projection,
    /// in the place of [`Self::orientation`] and [`Self::energy`].
    #[must_use]
    pub fn projected(
        mut self,
        orientation: impl Orientation<T> + 'static,
        projection: impl Projection<T> + 'static,
    ) -> Self {
        self.stepping = Stepping::Projected(Box::new(orientation), Box::new(projection));
        self
    }

    /// The shape to start from instead of the original one, in box units or those of the
    /// projection.
    #[must_use]
    pub fn first_shape(mut self, positions: Positions<T>) -> Self {
        self.first_shape = Some(positions);
        self
    }

    /// The handle vertices and their targets.
    #[must_use]
    pub fn handles(mut self, handles: impl IntoIterator<Item = (Handle, Point3<T>)>) -> Self {
        self.handles = handles.into_iter().collect();
        self
    }

    /// Edits these vertices only: all others stay where they are, and only these are factorized.
    /// Handles may be inside and outside; a component without a vertex of the region needs none.
    /// Default: the whole mesh.
    #[must_use]
    pub fn region(mut self, vertices: impl IntoIterator<Item = VertexId>) -> Self {
        self.region = Some(vertices.into_iter().collect());
        self
    }

    /// Ties points of the surface to others that no edge joins them to, for the descent of
    /// [`Hybrid`]: other rules take no notice. A component of the mesh without a handle is held by
    /// its ties. A rest shape that was measured already is measured again.
    #[must_use]
    pub fn ties(mut self, ties: impl IntoIterator<Item = PointTie>) -> Self {
        self.ties = ties.into_iter().collect();
        match self.source {
            Source::Measured(rest) if !self.ties.is_empty() => {
                self.source = Source::Mesh {
                    mesh: rest.shared_mesh().clone(),
                    positions: rest.original_positions().clone(),
                    scheme: rest.shared_scheme().clone(),
                };
            }
            _ => {}
        }
        self
    }

    /// The strategy and the memory limit for the system. Default: [`SystemOptions::default`].
    #[must_use]
    pub fn system(mut self, options: SystemOptions) -> Self {
        self.system = options;
        self
    }

    /// The Laplacian coordinates of the first solve.
    #[must_use]
    pub fn start(mut self, start: Start) -> Self {
        self.start = start;
        self
    }

    /// States by how much handle vertices turn, as rotation vectors (an axis times an angle in
    /// radians), which may be more than half a turn: positions alone cannot tell. The turn of a
    /// region is that of its first vertex in the list of handles. Used by
    /// [`Start::HandleRotations`] where two regions turn by more than half a turn relative to
    /// each other; a turn that the targets contradict is ignored.
    #[must_use]
    pub fn stated_turns(
        mut self,
        turns: impl IntoIterator<Item = (VertexId, Vector3<f64>)>,
    ) -> Self {
        self.stated_turns = turns.into_iter().collect();
        self
    }

    /// The acceleration of the iteration. Default: [`Acceleration::Memory`] of five steps.
    #[must_use]
    pub fn acceleration(mut self, acceleration: Acceleration) -> Self {
        self.acceleration = acceleration;
        self
    }

    /// The updating ratio over the iterations. Default: full steps.
    #[must_use]
    pub fn schedule(mut self, schedule: Schedule) -> Self {
        self.settings.schedule = schedule;
        self
    }

    /// A factor on the updating ratio per vertex, each in [0, 1].
    #[must_use]
    pub fn vertex_ratios(mut self, ratios: VertexMap<T>) -> Self {
        self.settings.ratios = Some(ratios);
        self
    }

    /// Stop when no vertex moves by more than this ratio of the bounding box's diagonal. Default:
    /// [`DEFAULT_TOLERANCE`]. With 0 a run ends at the iteration limit, or where a descent finds
    /// no lower energy.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.settings.tolerance = tolerance;
        self
    }

    /// The most iterations of a run. Default: [`DEFAULT_ITERATION_LIMIT`].
    #[must_use]
    pub fn iteration_limit(mut self, limit: usize) -> Self {
        self.settings.iteration_limit = limit;
        self
    }

    /// The connectivity.
    pub fn mesh(&self) -> &Arc<HalfedgeMesh> {
        match &self.source {
            Source::Measured(rest) => rest.shared_mesh(),
            Source::Mesh { mesh, .. } => mesh,
        }
    }

    /// The original positions, one per vertex or one per row.
    pub fn original_positions(&self) -> &Positions<T> {
        match &self.source {
            Source::Measured(rest) => rest.original_positions(),
            Source::Mesh { positions, .. } => positions,
        }
    }

    /// Returns `true` if the iteration starts from the original shape, and not from zero vectors
    /// or another one.
    pub fn starts_from_original(&self) -> bool {
        self.start != Start::Zero && self.first_shape.is_none()
    }

    /// Measures the original mesh, assembles and factorizes the system.
    ///
    /// # Errors
    /// [`FlowError`] for a mesh that is no surface, handles that cannot hold it, a setting out of
    /// range, and an updater without an orientation or energy ([`FlowError::MutedUpdater`]).
    pub fn build(self) -> Result<Flow<T>, FlowError> {
        self.check()?;
        if let Some(tie) = self
            .ties
            .iter()
            .find(|tie| !is_on(tie, self.source.num_vertices()))
        {
            return Err(FlowError::Custom(format!(
                "a tie names vertex {} or {}, which the mesh does not have",
                tie.own[0].0, tie.on[0].0
            )));
        }
        let rest = match self.source {
            Source::Measured(rest) => rest,
            Source::Mesh {
                mesh,
                positions,
                scheme,
            } => Arc::new(Rest::measure(mesh, positions, scheme)?.tied(self.ties)),
        };
        let first = self.first_shape.map(|shape| rest.rows_of(&shape));
        let first = first.transpose()?;
        let mut settings = self.settings;
        if let Some(ratios) = &mut settings.ratios {
            check_ratios(rest.mesh(), ratios)?;
            *ratios = rest.mesh().to_rows(ratios);
        }
        let region = self.region.as_deref();
        let targets = Targets::new(*rest.box_units(), rest.mesh(), &self.handles, region)?;
        let memory = match self.acceleration {
            // Steps with a ratio per vertex cannot be extrapolated.
            Acceleration::Memory(memory) if settings.ratios.is_none() => memory,
            Acceleration::Memory(_) | Acceleration::Off => 0,
        };
        let updater = self.updater.unwrap_or_else(|| Box::new(KeepMagnitude));
        let (mut membrane_weight, mut point_radius) = (0.0, 0.0);
        let mut descend = |mut energy: Box<dyn LocalGlobal<T>>, updater| {
            membrane_weight = energy.begin(&rest)?;
            point_radius = energy.point_radius(&rest);
            Ok::<_, FlowError>(Box::new(Descent::new(updater, energy, memory)))
        };
        let rule: Box<dyn Rule<T>> = match self.stepping {
            Stepping::Default => descend(Box::<Hybrid>::default(), updater)?,
            Stepping::Descent(energy) => descend(energy, updater)?,
            Stepping::FixedPoint(orientation) => {
                Box::new(FixedPoint::new(updater, orientation, memory))
            }
            Stepping::Projected(orientation, projection) => {
                Box::new(Projected::new(updater, orientation, projection))
            }
        };
        let membrane = membrane(&rest, membrane_weight);
        let operator = rest.operator();
        let ties = in_system(rest.ties());
        let system =
            PreparedSystem::prepare_tied(operator, &targets.held(), membrane, &ties, &self.system)?;
        let mut work = Workspace {
            current: Current::new(first.unwrap_or_else(|| rest.positions().clone())),
            start: rest.positions().clone(),
            field: rest.magnitudes().clone(),
            laplacian: rest.laplacian().clone(),
            terms: Terms::new(rest.positions().len()),
            settings,
            iteration: 0,
            since_move: 0,
            point_handles: None,
            point_radius,
            scale: 1.0,
            first_guess: None,
            rest,
            targets,
            system,
            membrane_weight,
        };
        work.find_point_handles();
        let mut stated = self.stated_turns;
        stated.sort_by_key(|(v, _)| *v);
        Flow::begin(work, rule, self.start, stated)
    }

    /// The checks that need no rest shape.
    fn check(&self) -> Result<(), FlowError> {
        self.settings.schedule.check()?;
        if !(self.settings.tolerance >= 0.0) {
            return Err(FlowError::Setting {
                setting: "tolerance",
                range: "at least 0",
                value: self.settings.tolerance,
            });
        }
        check_turns(&self.stated_turns)?;
        if self.updater.is_some() && matches!(self.stepping, Stepping::Default) {
            return Err(FlowError::MutedUpdater);
        }
        Ok(())
    }
}

/// The membrane with this weight, if it has any.
pub(crate) fn membrane<T: Scalar>(rest: &Rest<T>, weight: f64) -> Option<Membrane<'_>> {
    (weight != 0.0).then(|| Membrane {
        weight,
        weights: rest.membrane_weights(),
    })
}

/// Refuses ratios outside [0, 1].
fn check_ratios<T: Scalar>(mesh: &HalfedgeMesh, ratios: &VertexMap<T>) -> Result<(), FlowError> {
    if ratios.len() != mesh.num_rows() && ratios.len() != mesh.num_vertices() {
        return Err(FlowError::Setting {
            setting: "number of vertex ratios",
            range: "one per vertex",
            value: ratios.len() as f64,
        });
    }
    let is_ratio = |r: &&T| **r >= T::zero() && **r <= T::one();
    match ratios.values().find(|r| !is_ratio(r)) {
        None => Ok(()),
        Some(bad) => Err(FlowError::Setting {
            setting: "updating ratio of a vertex",
            range: "between 0 and 1",
            value: bad.as_f64(),
        }),
    }
}
