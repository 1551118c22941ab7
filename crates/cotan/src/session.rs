//! A deformation that is kept while its handles move.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use cotan_flow::{Flow, FlowBuilder, Report, Schedule, StepReport, StopReason};
use cotan_geometry::{Positions, Scalar, Surface, SurfaceError};
use cotan_halfedge::{HalfedgeMesh, VertexId};
use cotan_linear::{Handle, Hold};
use nalgebra::{Matrix4, Point3, Vector3};

use crate::error::Error;
use crate::handle_id::HandleId;
use crate::handles::{Handles, Motion};
use crate::options::DeformOptions;
use crate::parts::{Effort, Following, PartReport, turns_in_flow};
use crate::unmoved::Unmoved;

/// A mesh held by its handles: factorized once, then moved and stepped any number of times.
/// Handles can be added and removed along the way.
///
/// A session owns its data and is `Send + 'static`, so it can be stored in a struct and sent to a
/// thread. Schemes, updaters and orientations passed to its flow are not accessible from outside;
/// share their state through an `Arc` if necessary.
///
/// ```
/// use cotan::prelude::*;
///
/// let shape = cotan::shapes::icosphere::<f64>(2);
/// let (bottom, top) = (VertexId::new(0), VertexId::new(3));
/// let handles = Handles::new().fix([bottom]).move_to(top, shape.positions()[top]);
/// let mut session =
///     Session::new(&shape, &handles, &DeformOptions::default())?;
/// for frame in 1..=5 {
///     let pulled = shape.positions()[top] * (1.0 + 0.1 * f64::from(frame));
///     session.move_handle(1, &Motion::To(vec![pulled]))?;
///     session.step()?;
/// }
/// let report = session.run()?;
/// assert_eq!(report.stop, StopReason::Converged);
/// assert_eq!(session.positions()[top], shape.positions()[top] * 1.5);
/// # Ok::<(), cotan::Error>(())
/// ```
#[derive(Debug)]
pub struct Session<T: Scalar> {
    flow: Flow<T>,
    handles: Handles<T>,
    /// Finds the components that have not moved. `None` for a run that does not start from the
    /// original.
    unmoved: Option<Unmoved<T>>,
    /// The parts of the mesh that follow those with handles; `None` for a single part, and where
    /// none is to follow.
    following: Option<Box<Following<T>>>,
}

/// Handles with their targets.
type Held<T> = Vec<(Handle, Point3<T>)>;

impl<T: Scalar> Session<T> {
    /// Assembles and factorizes the system of a surface with `handles`. The session owns a copy
    /// of mesh and positions; to share them, pass their `Arc`s to a flow and use
    /// [`Self::from_flow`].
    ///
    /// Components of the mesh without handles follow the others, as [`DeformOptions::parts`] says.
    /// Those with handles are solved as if they were alone.
    ///
    /// # Errors
    /// [`Error`] for a mesh that is not a valid surface, and for handles that do not exist,
    /// contradict each other or, with [`Parts::Still`](crate::Parts::Still), leave a component of
    /// the mesh free.
    pub fn new<'m>(
        surface: impl Into<Surface<'m, T>>,
        handles: &Handles<T>,
        options: &DeformOptions,
    ) -> Result<Self, Error> {
        let surface = surface.into();
        let held = handles.resolve(surface.mesh(), surface.positions())?;
        match Following::new(&surface, options, &held)? {
            Some(following) => Self::with_parts(following, &held, handles),
            None => Self::from_flow(options.flow(surface), handles),
        }
    }

    /// Solves the parts that drive; the others follow.
    fn with_parts(
        following: Following<T>,
        held: &Held<T>,
        handles: &Handles<T>,
    ) -> Result<Self, Error> {
        let stated = turns_in_flow(&following, handles.stated_turns(following.mesh()));
        let held = following.handles_in_flow(held);
        let session = Self::solve(following.flow(), held, stated, handles);
        let mut session = session.map_err(|error| following.in_whole(error))?;
        session.following = Some(Box::new(following));
        Ok(session)
    }

    /// Creates a session from a flow with any scheme, updater, orientation or energy, including
    /// custom ones. `handles` replace those of the flow. No part of the mesh follows another.
    ///
    /// ```
    /// use cotan::prelude::*;
    ///
    /// let shape = cotan::shapes::icosphere::<f64>(2);
    /// let handles = Handles::new().fix([VertexId::new(0)]);
    /// // The paper's settings, but for the weights.
    /// let flow = DeformOptions::paper().flow(&shape);
    /// let mut session = Session::from_flow(flow.scheme(Tutte), &handles)?;
    /// session.step()?;
    /// # Ok::<(), cotan::Error>(())
    /// ```
    ///
    /// # Errors
    /// Same as [`Self::new`], an error for a component without a handle, and one for an updater
    /// that the energy of the flow would not use ([`cotan_flow::FlowError::MutedUpdater`]).
    pub fn from_flow(flow: FlowBuilder<T>, handles: &Handles<T>) -> Result<Self, Error> {
        let held = handles.resolve(flow.mesh(), flow.original_positions())?;
        let stated = handles.stated_turns(flow.mesh());
        Self::solve(flow, held, stated, handles)
    }

    fn solve(
        flow: FlowBuilder<T>,
        held: Held<T>,
        stated: Vec<(VertexId, Vector3<f64>)>,
        handles: &Handles<T>,
    ) -> Result<Self, Error> {
        let is_wound = stated.iter().any(|(_, turn)| turn.norm() > PI);
        let starts_from_original = flow.starts_from_original() && !is_wound;
        let flow = flow.handles(held).stated_turns(stated).build()?;
        Ok(Self {
            unmoved: starts_from_original.then(|| Unmoved::new(flow.rest().mesh(), flow.size())),
            flow,
            handles: handles.clone(),
            following: None,
        })
    }

    fn original(&self) -> &Positions<T> {
        match &self.following {
            Some(following) => following.original(),
            None => self.flow.rest().original_positions(),
        }
    }

    /// The whole mesh.
    fn mesh(&self) -> &HalfedgeMesh {
        match &self.following {
            Some(following) => following.mesh(),
            None => self.flow.rest().mesh(),
        }
    }

    /// An error of the flow, with the vertices of the whole mesh.
    fn in_whole(&self, error: impl Into<Error>) -> Error {
        match &self.following {
            Some(following) => following.in_whole(error.into()),
            None => error.into(),
        }
    }

    /// The handles, with their motions and firmness.
    pub fn handles(&self) -> &Handles<T> {
        &self.handles
    }

    /// Moves a handle to the image of its *original* positions under `motion`. The shape follows
    /// in the next steps. A handle given as a number is the one that was added after that many
    /// others.
    ///
    /// A handle that is turned on and on keeps its winding: of the turns that the motion can mean,
    /// the one that differs least from the turn before is taken. Turned by 90° four times it is
    /// turned by 360°, as [`Handles::turned`] states it; [`HandleGroup::turn`] of
    /// [`Self::handles`] is its turn.
    ///
    /// [`HandleGroup::turn`]: crate::HandleGroup::turn
    ///
    /// # Errors
    /// [`Error`] if there is no such handle, the motion does not match it, or a vertex shared
    /// with another handle would have two targets. Nothing has moved in that case.
    pub fn move_handle(
        &mut self,
        handle: impl Into<HandleId>,
        motion: &Motion<T>,
    ) -> Result<(), Error> {
        self.move_handles(&[(handle.into(), motion.clone())])
    }

    /// Moves several handles at once. They may share vertices if they agree about them.
    ///
    /// # Errors
    /// Same as [`Self::move_handle`].
    pub fn move_handles<H: Copy + Into<HandleId>>(
        &mut self,
        moves: &[(H, Motion<T>)],
    ) -> Result<(), Error> {
        let mut handles = self.handles.clone();
        for (handle, motion) in moves {
            let handle = (*handle).into();
            if handles.set_motion(handle, motion.clone()).is_none() {
                return Err(self.no_such(handle));
            }
            handles.turn_on(handle, &self.handles, self.original());
        }
        let targets: Vec<Point3<T>> = handles
            .resolve(self.mesh(), self.original())?
            .into_iter()
            .map(|(_, target)| target)
            .collect();
        let moved = self.flow.set_targets(&targets);
        moved.map_err(|error| self.in_whole(error))?;
        self.take(handles)
    }

    /// Keeps the handles that were moved, and has the flow hold their turns.
    fn take(&mut self, handles: Handles<T>) -> Result<(), Error> {
        self.handles = handles;
        let stated = self.handles.stated_turns(self.mesh());
        let stated = match &self.following {
            Some(following) => turns_in_flow(following, stated),
            None => stated,
        };
        let taken = self.flow.state_turns(stated);
        taken.map_err(|error| self.in_whole(error))
    }

    fn no_such(&self, handle: HandleId) -> Error {
        Error::NoSuchHandle {
            handle,
            num_handles: self.handles.len(),
        }
    }

    /// Moves a handle by a transform of its original positions.
    ///
    /// # Errors
    /// Same as [`Self::move_handle`].
    pub fn transform_handle(
        &mut self,
        handle: impl Into<HandleId>,
        matrix: Matrix4<T>,
    ) -> Result<(), Error> {
        self.move_handle(handle, &Motion::Transform(matrix))
    }

    /// Replaces all current handles. The shape is kept and follows in the next steps. The ids are
    /// those of `handles`: to keep the ids of the session, modify a clone of [`Self::handles`].
    ///
    /// With few handles on a mesh whose system is solved by columns
    /// ([`cotan_linear::Strategy::Columns`]), this costs a solve or two for every three new
    /// vertices, and vertices that are already held cost nothing. Otherwise the system is
    /// factorized again. It is factorized anew, too, if a part of the mesh gets its first handle or
    /// loses its last one: the first is solved from here on, and the other follows.
    ///
    /// # Errors
    /// Same as [`Self::new`]. Nothing has changed in that case.
    pub fn set_handles(&mut self, handles: &Handles<T>) -> Result<(), Error> {
        let held = handles.resolve(self.mesh(), self.original())?;
        match &self.following {
            Some(following) if !following.is_for(&held) => {
                return self.change_drivers(following.with_handles(&held), &held, handles);
            }
            Some(following) => {
                let changed = self.flow.set_handles(&following.handles_in_flow(&held));
                changed.map_err(|error| self.in_whole(error))?;
            }
            None => self.flow.set_handles(&held)?,
        }
        self.take(handles.clone())
    }

    /// Other parts drive from here on. The shape is kept.
    fn change_drivers(
        &mut self,
        following: Following<T>,
        held: &Held<T>,
        handles: &Handles<T>,
    ) -> Result<(), Error> {
        let shape = self.positions();
        let mut session = Self::with_parts(following, held, handles)?;
        session.set_shape(&shape)?;
        *self = session;
        Ok(())
    }

    /// Adds a group of vertices with its motion, held exactly, and returns its id, which stays
    /// valid when others are removed. To hold vertices at their current positions, use
    /// [`Motion::To`] with [`Self::positions`]; [`Motion::Stay`] means their original positions.
    /// For a soft group, see [`Handles::push`] and [`Self::set_handles`].
    ///
    /// # Errors
    /// Same as [`Self::set_handles`].
    pub fn add_handle(
        &mut self,
        vertices: impl IntoIterator<Item = VertexId>,
        motion: Motion<T>,
    ) -> Result<HandleId, Error> {
        let mut handles = self.handles.clone();
        let handle = handles.push(vertices, motion, Hold::Hard);
        self.set_handles(&handles)?;
        Ok(handle)
    }

    /// Removes a handle. The others keep their ids.
    ///
    /// # Errors
    /// [`Error`] if there is no such handle, or if a component of the mesh would be left free.
    /// Nothing has changed in that case.
    pub fn remove_handle(&mut self, handle: impl Into<HandleId>) -> Result<(), Error> {
        let handle = handle.into();
        let mut handles = self.handles.clone();
        match handles.remove(handle) {
            Some(_) => self.set_handles(&handles),
            None => Err(self.no_such(handle)),
        }
    }

    /// Replaces the current shape (one position per vertex), for example with an earlier one after
    /// an undo. Hard handles stay at their targets. Nothing is factorized.
    ///
    /// # Errors
    /// [`Error`] for a shape of another mesh or with a non-finite position.
    pub fn set_shape(&mut self, shape: &Positions<T>) -> Result<(), Error> {
        let Some(following) = &mut self.following else {
            return Ok(self.flow.set_shape(shape)?);
        };
        let Some(of_flow) = following.in_flow_shape(shape) else {
            let (positions, vertices) = (shape.len(), following.original().len());
            let error = SurfaceError::LengthMismatch {
                positions,
                vertices,
            };
            return Err(error.into());
        };
        self.flow
            .set_shape(&of_flow)
            .map_err(|error| following.in_whole(error.into()))?;
        following.set_shape(shape);
        Ok(())
    }

    /// Changes the schedule for the following steps; see [`Flow::set_schedule`].
    ///
    /// # Errors
    /// [`Error`] if a ratio is out of range.
    pub fn set_schedule(&mut self, schedule: Schedule) -> Result<(), Error> {
        Ok(self.flow.set_schedule(schedule)?)
    }

    /// Performs one iteration; the parts that follow are placed by it.
    ///
    /// # Errors
    /// Errors of the flow.
    pub fn step(&mut self) -> Result<StepReport, Error> {
        let step = self.flow.step();
        let step = step.map_err(|error| self.in_whole(error))?;
        self.place(Effort::Step)?;
        Ok(step)
    }

    /// Iterates until convergence or the iteration limit.
    ///
    /// # Errors
    /// Errors of the flow.
    pub fn run(&mut self) -> Result<Report, Error> {
        self.run_observed(|_, _| ControlFlow::Continue(()))
    }

    /// Like [`Self::run`], with an observer that is called after each step and may stop the run.
    ///
    /// The observer sees the flow of the parts with handles. The others follow when it has ended.
    ///
    /// # Errors
    /// Errors of the flow.
    pub fn run_observed(
        &mut self,
        observer: impl FnMut(&Flow<T>, &StepReport) -> ControlFlow<()>,
    ) -> Result<Report, Error> {
        let report = self.flow.run(observer);
        let report = report.map_err(|error| self.in_whole(error))?;
        self.place(match report.stop {
            StopReason::Cancelled => Effort::Step,
            _ => Effort::Run,
        })?;
        Ok(report)
    }

    fn place(&mut self, effort: Effort) -> Result<(), Error> {
        let positions = match &self.following {
            Some(_) => self.positions_of_flow(),
            None => return Ok(()),
        };
        match &mut self.following {
            Some(following) => following.place(&positions, effort),
            None => Ok(()),
        }
    }

    /// The current positions, in the units of the input, one per vertex. Copies of a vertex, in a
    /// mesh that was cut into pieces, are all at one point.
    ///
    /// A component whose handles are all at their original positions has exactly its original
    /// positions, unless it was left far from them. See [`Flow::positions`] for other vertices
    /// that have not moved. Components that are tied to others ([`DeformOptions::parts`]) move with
    /// them even if their own handles stay. Parts that follow are where the last step or run
    /// placed them.
    pub fn positions(&self) -> Positions<T> {
        let positions = self.positions_of_flow();
        let rows = match &self.following {
            Some(following) => following.whole(&positions),
            None => positions,
        };
        self.mesh().to_vertices(rows)
    }

    /// The current positions of the flow, one per row, with components at rest put back.
    fn positions_of_flow(&self) -> Positions<T> {
        let mut positions = self.flow.positions();
        if let Some(unmoved) = &self.unmoved {
            unmoved.put_back(&self.flow, &mut positions);
        }
        positions
    }

    /// The roles of the parts of the mesh and how well they follow, numbered by their first
    /// vertices; empty for a mesh of one part, and where none is to follow.
    pub fn parts(&self) -> Vec<PartReport> {
        match &self.following {
            Some(following) => following.report(&self.positions_of_flow()),
            None => Vec::new(),
        }
    }

    /// The vertices of [`Self::flow`], in its order, as the mesh numbers them.
    pub fn flow_vertices(&self) -> Vec<VertexId> {
        match &self.following {
            Some(following) => following.flow_vertices(),
            None => self.flow.rest().mesh().rows().collect(),
        }
    }

    /// The underlying flow. If parts of the mesh follow others, it is that of the parts with
    /// handles alone, with their vertices in the order of the mesh.
    pub fn flow(&self) -> &Flow<T> {
        &self.flow
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::bar;
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    /// After returning to an earlier shape and its handles, a session converges to the same
    /// result as before.
    #[test]
    fn an_earlier_shape_is_taken_up_again() {
        let shape = bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let left = shape.surface().vertices_where(|p| p.x < -1.99);
        let right = shape.surface().vertices_where(|p| p.x > 1.99);
        let turned = |angle: f64| {
            let motion = Isometry3::new(Vector3::new(0.0, 0.5, 0.0), Vector3::z() * angle);
            motion.to_homogeneous()
        };
        let handles = Handles::new().fix(left).transform(right, turned(0.3));
        let options = DeformOptions {
            tolerance: 1e-8,
            ..DeformOptions::default()
        };
        let mut session = Session::new(shape.surface(), &handles, &options).expect("a session");
        let _ = session.run().expect("a run");
        let first = session.positions();

        session.transform_handle(1, turned(1.2)).expect("a move");
        let _ = session.run().expect("a run");
        session.transform_handle(1, turned(0.3)).expect("a move");
        session.set_shape(&first).expect("the shape");
        let farthest = |a: &Positions<f64>| {
            let pairs = a.values().zip(first.values());
            pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
        };
        assert!(farthest(&session.positions()) < 1e-14);
        let report = session.run().expect("a run");
        assert_eq!(report.stop, cotan_flow::StopReason::Converged);
        assert!(report.iterations < 10, "{}", report.iterations);
        assert!(farthest(&session.positions()) < 1e-6);

        let short: Positions<f64> = first.values().copied().take(3).collect();
        assert!(session.set_shape(&short).is_err());
    }
}
