//! Settings of a flow.

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{Cotangent, LaplacianScheme, Operator};
use cotan_linear::{Handle, Membrane, PreparedSystem, SystemOptions};
use nalgebra::Point3;

use crate::error::FlowError;
use crate::flow::{Flow, Frame, check_target};
use crate::orientation::{Hybrid, Orientation};
use crate::projection::Projection;
use crate::rest::Rest;
use crate::schedule::Schedule;
use crate::updater::{KeepMagnitude, ScalarFieldUpdater};

/// The longest move at which a run counts as converged, over the bounding box's diagonal.
pub const DEFAULT_TOLERANCE: f64 = 1e-4;

/// The most iterations of a run.
pub const DEFAULT_ITERATION_LIMIT: usize = 200;

/// What the Laplacian coordinates of the first solve are.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Start {
    /// Those of the original mesh (the paper's default, section 3.4).
    Original,
    /// Those of the original mesh, turned by the rotations of the handle regions: each connected
    /// region of at least three handle vertices gives the rotation that fits its move best, and
    /// rotation vectors are interpolated over the mesh by the flow's own system. A handle without
    /// a rotation of its own counts as not turned. One more solve, when the flow is built; handles
    /// that move later are followed from the shape at hand.
    #[default]
    HandleRotations,
    /// Those that updater and orientation make of the first shape, for scalar fields that do not
    /// start from the original's.
    Updated,
    /// Zero: the shape must come from the two scalar fields alone (paper, section 3.4, figure 8).
    Zero,
}

/// Whether and how the iteration is accelerated.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Acceleration {
    /// Plain steps.
    Off,
    /// From the last `memory` steps: L-BFGS where the orientation has an energy, Anderson's method
    /// elsewhere. Only in effect while the updating ratio is 1.
    Memory(usize),
}

impl Default for Acceleration {
    fn default() -> Self {
        // Between 5 and 20 steps were found alike, and every one is read in every iteration.
        Self::Memory(5)
    }
}

/// Collects the settings of a [`Flow`]. Every setting has a default but the handles.
pub struct FlowBuilder<'m, T: Scalar> {
    mesh: &'m HalfedgeMesh,
    positions: &'m Positions<T>,
    scheme: Box<dyn LaplacianScheme<T> + 'm>,
    updater: Box<dyn ScalarFieldUpdater<T> + 'm>,
    orientation: Box<dyn Orientation<T> + 'm>,
    projection: Option<Box<dyn Projection<T> + 'm>>,
    first_shape: Option<Positions<T>>,
    handles: Vec<(Handle, Point3<T>)>,
    region: Option<Vec<VertexId>>,
    system: SystemOptions,
    pub(crate) settings: Settings<T>,
}

/// The settings that are plain values.
#[derive(Clone, Debug)]
pub(crate) struct Settings<T> {
    pub(crate) start: Start,
    pub(crate) acceleration: Acceleration,
    pub(crate) schedule: Schedule,
    pub(crate) ratios: Option<VertexMap<T>>,
    pub(crate) tolerance: f64,
    pub(crate) iteration_limit: usize,
}

impl<T: Scalar> Default for Settings<T> {
    fn default() -> Self {
        Self {
            start: Start::default(),
            acceleration: Acceleration::default(),
            schedule: Schedule::default(),
            ratios: None,
            tolerance: DEFAULT_TOLERANCE,
            iteration_limit: DEFAULT_ITERATION_LIMIT,
        }
    }
}

impl<T: Scalar> std::fmt::Debug for FlowBuilder<'_, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FlowBuilder")
            .field("scheme", &self.scheme.name())
            .field("handles", &self.handles.len())
            .field("settings", &self.settings)
            .finish_non_exhaustive()
    }
}

impl<'m, T: Scalar> FlowBuilder<'m, T> {
    pub(crate) fn new(mesh: &'m HalfedgeMesh, positions: &'m Positions<T>) -> Self {
        Self {
            mesh,
            positions,
            scheme: Box::new(Cotangent::default()),
            updater: Box::new(KeepMagnitude),
            orientation: Box::new(Hybrid::default()),
            projection: None,
            first_shape: None,
            handles: Vec::new(),
            region: None,
            system: SystemOptions::default(),
            settings: Settings::default(),
        }
    }

    /// Who chooses the weights. Default: [`Cotangent`].
    ///
    /// The membrane of the default orientation is weighted by cotangents whatever the scheme; a
    /// scheme that is to rule alone wants another orientation, such as [`crate::BestRotation`].
    #[must_use]
    pub fn scheme(mut self, scheme: impl LaplacianScheme<T> + 'm) -> Self {
        self.scheme = Box::new(scheme);
        self
    }

    /// Who prescribes the scalar field. Default: [`KeepMagnitude`].
    #[must_use]
    pub fn updater(mut self, updater: impl ScalarFieldUpdater<T> + 'm) -> Self {
        self.updater = Box::new(updater);
        self
    }

    /// Who turns the Laplacian coordinates. Default: [`Hybrid`].
    #[must_use]
    pub fn orientation(mut self, orientation: impl Orientation<T> + 'm) -> Self {
        self.orientation = Box::new(orientation);
        self
    }

    /// What every step is carried back to. Default: nothing.
    #[must_use]
    pub fn projection(mut self, projection: impl Projection<T> + 'm) -> Self {
        self.projection = Some(Box::new(projection));
        self
    }

    /// Another shape to start from than the original one, in box units or those of the projection.
    #[must_use]
    pub fn first_shape(mut self, positions: Positions<T>) -> Self {
        self.first_shape = Some(positions);
        self
    }

    /// The handle vertices and where they are to be.
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

    /// How the system is solved, and what memory it may take. Default: [`SystemOptions::default`].
    #[must_use]
    pub fn system(mut self, options: SystemOptions) -> Self {
        self.system = options;
        self
    }

    /// The Laplacian coordinates of the first solve.
    #[must_use]
    pub fn start(mut self, start: Start) -> Self {
        self.settings.start = start;
        self
    }

    /// Whether and how to accelerate.
    #[must_use]
    pub fn acceleration(mut self, acceleration: Acceleration) -> Self {
        self.settings.acceleration = acceleration;
        self
    }

    /// The updating ratio over the iterations. Default: full steps.
    #[must_use]
    pub fn schedule(mut self, schedule: Schedule) -> Self {
        self.settings.schedule = schedule;
        self
    }

    /// A factor on the updating ratio, vertex by vertex, each in [0, 1].
    #[must_use]
    pub fn vertex_ratios(mut self, ratios: VertexMap<T>) -> Self {
        self.settings.ratios = Some(ratios);
        self
    }

    /// Stop when no vertex moves by more than this ratio of the bounding box's diagonal.
    /// Default: [`DEFAULT_TOLERANCE`]. With 0 a run ends at the iteration limit, or where an
    /// orientation with an energy finds no lower one.
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

    /// Measures the original mesh, assembles and factorizes the system.
    ///
    /// # Errors
    /// [`FlowError`] for a mesh that is no surface, handles that cannot hold it, or a setting out
    /// of range.
    pub fn build(mut self) -> Result<Flow<'m, T>, FlowError> {
        self.check()?;
        let frame = Frame::new(&Surface::new(self.mesh, self.positions)?)?;
        for (handle, target) in &self.handles {
            check_target(&frame, handle.vertex, target)?;
        }
        let region = self.region.map(|vertices| is_within(self.mesh, &vertices));
        let region = region.transpose()?;
        let positions = frame.to_box_all(self.positions);
        let operator = Operator::assemble(&*self.scheme, &Surface::new(self.mesh, &positions)?)?;
        let rest = Rest::new(self.mesh, positions, operator, frame.diagonal())?;
        let handles: Vec<Handle> = self.handles.iter().map(|(handle, _)| *handle).collect();
        let weight = self.orientation.prepare(&rest);
        let membrane = (weight != 0.0).then_some(Membrane {
            weight,
            stiffness: rest.stiffness(),
        });
        let held = with_outside(&handles, region.as_ref());
        let system = PreparedSystem::prepare_with(rest.operator(), &held, membrane, &self.system)?;
        let user_targets: Vec<_> = self.handles.iter().map(|(_, target)| *target).collect();
        let targets = user_targets
            .iter()
            .map(|target| frame.to_box(*target))
            .collect();
        let mut flow = Flow::assemble(
            crate::flow::Parts {
                original: self.positions,
                frame,
                rest,
                scheme: self.scheme,
                updater: self.updater,
                orientation: self.orientation,
                projection: self.projection,
                system,
                has_membrane: weight != 0.0,
                region,
                handles,
                user_targets,
                targets,
            },
            self.settings,
        );
        flow.begin(self.first_shape)?;
        Ok(flow)
    }

    fn check(&self) -> Result<(), FlowError> {
        let settings = &self.settings;
        settings.schedule.check()?;
        self.orientation.check()?;
        if !(settings.tolerance >= 0.0) {
            return Err(FlowError::Setting {
                setting: "tolerance",
                range: "at least 0",
                value: settings.tolerance,
            });
        }
        if let Some(shape) = &self.first_shape {
            Surface::new(self.mesh, shape)?;
        }
        if let Some(ratios) = &settings.ratios {
            if ratios.len() != self.mesh.num_vertices() {
                return Err(FlowError::Setting {
                    setting: "number of vertex ratios",
                    range: "one a vertex",
                    value: ratios.len() as f64,
                });
            }
            if let Some(bad) = ratios
                .values()
                .find(|r| !(**r >= T::zero() && **r <= T::one()))
            {
                return Err(FlowError::Setting {
                    setting: "updating ratio of a vertex",
                    range: "between 0 and 1",
                    value: bad.as_f64(),
                });
            }
        }
        Ok(())
    }
}

/// Whether each vertex is one of these.
fn is_within(mesh: &HalfedgeMesh, vertices: &[VertexId]) -> Result<VertexMap<bool>, FlowError> {
    let num_vertices = mesh.num_vertices();
    let mut is_inside = VertexMap::filled(num_vertices, false);
    for &vertex in vertices {
        if vertex.index() >= num_vertices {
            return Err(FlowError::RegionOutOfRange {
                vertex,
                num_vertices,
            });
        }
        is_inside[vertex] = true;
    }
    Ok(is_inside)
}

/// The handles, and hard ones at all other vertices outside of the region.
pub(crate) fn with_outside(handles: &[Handle], region: Option<&VertexMap<bool>>) -> Vec<Handle> {
    let mut held = handles.to_vec();
    if let Some(region) = region {
        let mut is_free = region.clone();
        for handle in handles {
            // One that does not exist is refused by the system.
            if let Some(free) = is_free.as_mut_slice().get_mut(handle.vertex.index()) {
                *free = true;
            }
        }
        let outside = is_free.iter().filter(|(_, free)| !**free);
        held.extend(outside.map(|(vertex, _)| Handle::hard(vertex)));
    }
    held
}
