//! A deformation that is kept while its handles move.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use cotan_flow::{Flow, FlowBuilder, Report, Schedule, StepReport};
use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::VertexId;
use cotan_linear::Hold;
use nalgebra::{Matrix4, Point3};

use crate::error::Error;
use crate::handles::{HandleId, Handles, Motion};
use crate::options::DeformOptions;
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
}

impl<T: Scalar> Session<T> {
    /// Assembles and factorizes the system of a surface with `handles`. The session owns a copy
    /// of mesh and positions; to share them, pass their `Arc`s to a flow and use
    /// [`Self::from_flow`].
    ///
    /// # Errors
    /// [`Error`] for a mesh that is not a valid surface, and for handles that do not exist,
    /// contradict each other or leave a component of the mesh free.
    pub fn new<'m>(
        surface: impl Into<Surface<'m, T>>,
        handles: &Handles<T>,
        options: &DeformOptions,
    ) -> Result<Self, Error> {
        Self::from_flow(options.flow(surface), handles)
    }

    /// Creates a session from a flow with any scheme, updater, orientation or energy, including
    /// custom ones. `handles` replace those of the flow.
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
    /// Same as [`Self::new`], and an error for an updater that the energy of the flow would not
    /// use ([`cotan_flow::FlowError::MutedUpdater`]).
    pub fn from_flow(flow: FlowBuilder<T>, handles: &Handles<T>) -> Result<Self, Error> {
        let resolved = handles.resolve(flow.mesh(), flow.original_positions())?;
        let stated = handles.stated_turns(flow.mesh());
        let is_wound = stated.iter().any(|(_, turn)| turn.norm() > PI);
        let starts_from_original = flow.starts_from_original() && !is_wound;
        let flow = flow.handles(resolved).stated_turns(stated).build()?;
        Ok(Self {
            unmoved: starts_from_original.then(|| Unmoved::new(flow.rest().mesh(), flow.size())),
            flow,
            handles: handles.clone(),
        })
    }

    fn original(&self) -> &Positions<T> {
        self.flow.rest().original_positions()
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
            .resolve(self.flow.rest().mesh(), self.original())?
            .into_iter()
            .map(|(_, target)| target)
            .collect();
        self.flow.set_targets(&targets)?;
        self.take(handles)
    }

    /// Keeps the handles that were moved, and has the flow hold their turns.
    fn take(&mut self, handles: Handles<T>) -> Result<(), Error> {
        self.handles = handles;
        let stated = self.handles.stated_turns(self.flow.rest().mesh());
        Ok(self.flow.state_turns(stated)?)
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
    /// factorized again.
    ///
    /// # Errors
    /// Same as [`Self::new`]. Nothing has changed in that case.
    pub fn set_handles(&mut self, handles: &Handles<T>) -> Result<(), Error> {
        let resolved = handles.resolve(self.flow.rest().mesh(), self.original())?;
        self.flow.set_handles(&resolved)?;
        self.take(handles.clone())
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

    /// Replaces the current shape (one position per vertex), for example with an earlier one after an undo. Hard handles
    /// stay at their targets. Nothing is factorized.
    ///
    /// # Errors
    /// [`Error`] for a shape of another mesh or with a non-finite position.
    pub fn set_shape(&mut self, shape: &Positions<T>) -> Result<(), Error> {
        Ok(self.flow.set_shape(shape)?)
    }

    /// Changes the schedule for the following steps; see [`Flow::set_schedule`].
    ///
    /// # Errors
    /// [`Error`] if a ratio is out of range.
    pub fn set_schedule(&mut self, schedule: Schedule) -> Result<(), Error> {
        Ok(self.flow.set_schedule(schedule)?)
    }

    /// Performs one iteration.
    ///
    /// # Errors
    /// Errors of the flow.
    pub fn step(&mut self) -> Result<StepReport, Error> {
        Ok(self.flow.step()?)
    }

    /// Iterates until convergence or the iteration limit.
    ///
    /// # Errors
    /// Errors of the flow.
    pub fn run(&mut self) -> Result<Report, Error> {
        Ok(self.flow.run_to_end()?)
    }

    /// Like [`Self::run`], with an observer that is called after each step and may stop the run.
    ///
    /// # Errors
    /// Errors of the flow.
    pub fn run_observed(
        &mut self,
        observer: impl FnMut(&Flow<T>, &StepReport) -> ControlFlow<()>,
    ) -> Result<Report, Error> {
        Ok(self.flow.run(observer)?)
    }

    /// The current positions, in the units of the input, one per vertex. Copies of a vertex, in a
    /// mesh that was cut into pieces, are all at one point.
    ///
    /// A component whose handles are all at their original positions has exactly its original
    /// positions, unless it was left far from them. See [`Flow::positions`] for other vertices
    /// that have not moved.
    pub fn positions(&self) -> Positions<T> {
        let mut positions = self.flow.positions();
        if let Some(unmoved) = &self.unmoved {
            unmoved.put_back(&self.flow, &mut positions);
        }
        self.flow.rest().mesh().to_vertices(positions)
    }

    /// The underlying flow.
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
