//! The flow: a rest shape, targets, the current positions, and one rule that makes the steps.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId};
use cotan_linear::{Handle, Membrane, PreparedSystem};
use nalgebra::Point3;

use crate::builder::{FlowBuilder, Start, membrane};
use crate::error::FlowError;
use crate::rest::Rest;
use crate::rule::Rule;
use crate::schedule::Schedule;
use crate::start::first_guess;
use crate::stated_turns::begin_wound;
use crate::targets::Changed;
use crate::winding::{StatedTurns, wind};
use crate::workspace::Workspace;

/// The iteration of curvature-flow Laplacian editing on one mesh with one set of handles.
///
/// Built by [`Flow::builder`]; then stepped ([`Flow::step`]) or run ([`Flow::run`]). It can be
/// kept and fed new handle positions ([`Flow::set_targets`]), frame after frame: nothing is
/// factorized again. It owns all that it needs, and can be sent to a thread.
///
/// If a mesh was cut into pieces, handles, targets and positions are those of the rows, which
/// are the first vertices: see [`Rest`].
pub struct Flow<T: Scalar> {
    pub(crate) work: Workspace<T>,
    pub(crate) rule: Box<dyn Rule<T>>,
    /// The turns that were stated last.
    pub(crate) stated: StatedTurns,
}

impl<T: Scalar> std::fmt::Debug for Flow<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Flow")
            .field("rest", &self.work.rest)
            .field("handles", &self.handles().len())
            .field("iteration", &self.work.iteration)
            .field("settings", &self.work.settings)
            .finish_non_exhaustive()
    }
}

impl<T: Scalar> Flow<T> {
    /// Starts to describe a flow on `mesh` with its original `positions`.
    ///
    /// An `Arc` of either is shared; a value is taken, and a reference copied.
    pub fn builder(
        mesh: impl Into<Arc<HalfedgeMesh>>,
        positions: impl Into<Arc<Positions<T>>>,
    ) -> FlowBuilder<T> {
        FlowBuilder::new(mesh.into(), positions.into())
    }

    /// Starts to describe a flow on a rest shape that is measured already.
    pub fn on(rest: impl Into<Arc<Rest<T>>>) -> FlowBuilder<T> {
        FlowBuilder::on(rest.into())
    }

    /// Puts positions, Laplacian coordinates and handles where the first solve starts.
    pub(crate) fn begin(
        mut work: Workspace<T>,
        mut rule: Box<dyn Rule<T>>,
        start: Start,
        stated: StatedTurns,
    ) -> Result<Self, FlowError> {
        match start {
            Start::Original | Start::Updated => {}
            Start::HandleRotations => match wind(&mut work, &stated)? {
                Some((shape, winding)) => {
                    begin_wound(&mut work, &mut *rule, &shape, winding)?;
                    return Ok(Self { work, rule, stated });
                }
                None => {
                    work.first_guess = first_guess(&mut work)?;
                    if let Some(guess) = &work.first_guess {
                        let turned = work.laplacian.values_mut().zip(guess.rotations.values());
                        for (ell, rotation) in turned {
                            *ell = (rotation * ell.map(T::as_f64)).map(T::of_f64);
                        }
                    }
                }
            },
            Start::Zero => {
                let zero = |ell: &mut nalgebra::Vector3<T>| ell.fill(T::zero());
                work.laplacian.values_mut().for_each(zero);
            }
        }
        rule.begin(&mut work)?;
        if start == Start::Updated {
            rule.update(&mut work)?;
        }
        Ok(Self { work, rule, stated })
    }

    #[cfg(test)]
    pub(crate) fn into_parts(self) -> (Workspace<T>, Box<dyn Rule<T>>) {
        (self.work, self.rule)
    }

    /// The original mesh, in box units.
    pub fn rest(&self) -> &Arc<Rest<T>> {
        &self.work.rest
    }

    /// The handles, in the order of their targets.
    pub fn handles(&self) -> &[Handle] {
        self.work.targets.handles()
    }

    /// The system that the iterations solve.
    pub fn system(&self) -> &PreparedSystem {
        &self.work.system
    }

    /// The membrane of that system, if the energy that the flow descends has one.
    pub fn membrane(&self) -> Option<Membrane<'_>> {
        membrane(&self.work.rest, self.work.membrane_weight)
    }

    /// Iterations since the flow was built.
    pub fn iteration(&self) -> usize {
        self.work.iteration
    }

    /// The energy of the current shape, for a flow that descends one: after the first step since
    /// the flow was built or a handle moved.
    pub fn energy(&self) -> Option<f64> {
        self.rule.energy()
    }

    /// The targets of the handles, in their order and in the units of the input.
    pub fn handle_targets(&self) -> &[Point3<T>] {
        self.work.targets.in_input()
    }

    /// The longest side of the original mesh's bounding box, in the units of the input.
    pub fn size(&self) -> T {
        self.work.rest.box_units().size()
    }

    /// The current positions, in the units of the input, one per row: see [`Rest`]. Hard handles
    /// are exactly at their targets (unless something projects the flow), and a vertex that has
    /// not moved has exactly its original position.
    ///
    /// Positions are computed in box units, as numbers up to 1, and each step rounds them to the
    /// spacing ε of such numbers: a vertex within 4 ε of its original place in each coordinate has
    /// not moved.
    pub fn positions(&self) -> Positions<T> {
        let rest = &self.work.rest;
        let units = rest.box_units();
        let rounding = T::default_epsilon() * T::of_f64(UNMOVED);
        let mut positions: Positions<T> = rest
            .original_positions()
            .values()
            .zip(rest.positions().values())
            .zip(self.box_positions().values())
            .map(|((original, rest), now)| {
                let way = now - rest;
                match way.iter().all(|x| x.abs() <= rounding) {
                    true => *original,
                    false => original + units.vector_from_box(way),
                }
            })
            .collect();
        if let Some(points) = &self.work.point_handles {
            points.bump(&self.work.targets, self.box_positions(), |i, by| {
                positions.as_mut_slice()[i as usize] += units.vector_from_box(by);
            });
        }
        if self.rule.pins_handles() {
            self.work.targets.pin_in_input(&mut positions);
        }
        positions
    }

    /// The current positions, in box units, or in those of the projection.
    pub fn box_positions(&self) -> &Positions<T> {
        self.work.current.positions()
    }

    /// Moves all handles to new targets, in the order of [`Self::handles`]. The shape is kept and
    /// follows in the next steps; the schedule and the acceleration start over, so that a flow
    /// whose handles move before every step takes plain steps. Targets that are the same change
    /// nothing.
    ///
    /// # Errors
    /// [`FlowError`] if there are too few or too many targets, or one is not finite.
    pub fn set_targets(&mut self, targets: &[Point3<T>]) -> Result<(), FlowError> {
        let changed = self.work.targets.move_all(targets)?;
        self.follow(changed);
        Ok(())
    }

    /// Moves some handles to new targets; the others stay where they are.
    ///
    /// # Errors
    /// [`FlowError`] if a vertex is not a handle or a target is not finite; nothing has moved
    /// then.
    pub fn move_handles(&mut self, moves: &[(VertexId, Point3<T>)]) -> Result<(), FlowError> {
        let changed = self.work.targets.move_some(moves)?;
        self.follow(changed);
        Ok(())
    }

    /// Replaces all handles by others, each with its target. The shape is kept and follows in the
    /// next steps; schedule and acceleration start over. A vertex that is no longer a hard handle
    /// is released where it is.
    ///
    /// Some strategies factorize again: see [`cotan_linear::Strategy`].
    ///
    /// # Errors
    /// [`FlowError`] as from [`FlowBuilder::build`]; nothing has changed then.
    pub fn set_handles(&mut self, handles: &[(Handle, Point3<T>)]) -> Result<(), FlowError> {
        let work = &mut self.work;
        let changed = work.targets.replace(handles, &mut work.system)?;
        if changed == Changed::Yes {
            work.find_point_handles();
        }
        self.follow(changed);
        Ok(())
    }

    /// Changes the schedule of the steps from here on: 1 while a handle is held, say, and a
    /// falling one when it is released.
    ///
    /// # Errors
    /// [`FlowError`] for ratios out of range.
    pub fn set_schedule(&mut self, schedule: Schedule) -> Result<(), FlowError> {
        schedule.check()?;
        if self.work.settings.schedule != schedule {
            self.work.settings.schedule = schedule;
            // The next step takes its first ratio. A move of the handles that no step has followed
            // yet still counts as one.
            self.work.since_move = self.work.since_move.min(1);
        }
        Ok(())
    }

    /// Replaces the current shape by another one, in the units of the input; hard handles stay at
    /// their targets. The next steps start from it; schedule and acceleration start over.
    ///
    /// **Shapes**: one position per vertex, or one per row.
    ///
    /// # Errors
    /// [`FlowError`] for a shape of another mesh or with a position that is not finite (nothing
    /// has changed then), and what updater and orientation report.
    pub fn set_shape(&mut self, shape: &Positions<T>) -> Result<(), FlowError> {
        let rest = &self.work.rest;
        let rows = rest.rows_of(shape)?;
        *self.work.current.write() = rest.box_units().to_box_all(&rows);
        self.follow(Changed::Yes);
        self.rule.update(&mut self.work)
    }

    fn follow(&mut self, changed: Changed) {
        if changed == Changed::Yes {
            self.work.since_move = 0;
            self.rule.restart(&mut self.work);
        }
    }
}

/// A displacement of at most this many ε of the size is the rounding of a step or two.
const UNMOVED: f64 = 4.0;

#[cfg(test)]
pub(crate) mod tests {
    use std::ops::ControlFlow;

    use cotan_geometry::shapes::icosphere;
    use cotan_geometry::{Mesh, volume};
    use cotan_halfedge::VertexMap;
    use nalgebra::Vector3;

    use super::*;
    use crate::{Acceleration, FlowState, Limited, ScalarFieldUpdater, StopReason};

    /// The lowest vertices held, the highest pulled by half a radius.
    pub(crate) fn handles(shape: &Mesh<f64>) -> Vec<(Handle, Point3<f64>)> {
        let surface = shape.surface();
        let low = surface.vertices_where(|p| p.z < -0.8);
        let high = surface.vertices_where(|p| p.z > 0.9);
        let hard = |v: &VertexId, lift| {
            (
                Handle::hard(*v),
                shape.positions()[*v] + Vector3::new(0.0, 0.0, lift),
            )
        };
        low.iter()
            .map(|v| hard(v, 0.0))
            .chain(high.iter().map(|v| hard(v, 0.5)))
            .collect()
    }

    pub(crate) fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
        cotan_parallel::max(a.len(), |i| (a.as_slice()[i] - b.as_slice()[i]).norm())
    }

    pub(crate) fn build(shape: &Mesh<f64>) -> FlowBuilder<f64> {
        Flow::builder(shape.connectivity(), shape.positions()).handles(handles(shape))
    }

    #[test]
    fn a_vertex_with_ratio_zero_stays() {
        let shape = icosphere::<f64>(2);
        let still = shape.surface().vertices_where(|p| p.z.abs() < 0.05);
        let mut ratios = VertexMap::filled(shape.positions().len(), 1.0);
        still.iter().for_each(|v| ratios[*v] = 0.0);
        let mut flow = build(&shape)
            .orientation(Limited::new())
            .vertex_ratios(ratios)
            .build()
            .unwrap();
        let report = flow.run_to_end().unwrap();
        assert_eq!(report.stop, StopReason::Converged);
        let now = flow.positions();
        assert!(still.iter().all(|v| now[*v] == shape.positions()[*v]));
        assert!(farthest(&now, shape.positions()) > 0.1);
    }

    #[test]
    fn damped_steps_are_shorter_and_reported() {
        let shape = icosphere::<f64>(2);
        let mut flow = build(&shape)
            .orientation(Limited::new())
            .acceleration(Acceleration::Off)
            .schedule(Schedule::Constant(0.25))
            .build()
            .unwrap();
        for _ in 0..4 {
            let step = flow.step().unwrap();
            assert!((step.change - 0.25 * step.residual).abs() < 1e-12);
        }
    }

    #[test]
    fn a_moved_handle_is_followed_without_factorizing_again() {
        let shape = icosphere::<f64>(2);
        let mut flow = build(&shape).build().unwrap();
        let _ = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        let entries = flow.system().factor_entries();
        let original: Vec<Point3<f64>> = flow
            .handles()
            .iter()
            .map(|h| shape.positions()[h.vertex])
            .collect();
        flow.set_targets(&original).unwrap();
        let report = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(report.stop, StopReason::Converged);
        assert_eq!(flow.system().factor_entries(), entries);
        assert!(farthest(&flow.positions(), shape.positions()) < 5e-3);

        let free = shape.surface().vertices_where(|p| p.z.abs() < 0.05)[0];
        let error = flow.move_handles(&[(free, Point3::origin())]).unwrap_err();
        assert_eq!(error, FlowError::NotAHandle { vertex: free });
        let error = flow.set_targets(&original[1..]).unwrap_err();
        assert!(matches!(error, FlowError::TargetCount { .. }));
    }

    /// A shape from its scalar fields alone: zero vectors first.
    #[test]
    fn zero_vectors_come_back_to_the_original() {
        let shape = icosphere::<f64>(2);
        let corners = [0, 1, 2, 5].map(|i| {
            let v = VertexId::new(i);
            (Handle::hard(v), shape.positions()[v])
        });
        let mut flow = Flow::builder(shape.connectivity(), shape.positions())
            .handles(corners)
            .start(Start::Zero)
            .orientation(crate::ReflectFirst::new(10))
            .tolerance(1e-7)
            .build()
            .unwrap();
        let first = flow.step().unwrap();
        assert!(first.change > 0.05, "the first solve collapses the shape");
        let report = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(report.stop, StopReason::Converged);
        assert!(farthest(&flow.positions(), shape.positions()) < 1e-4);
    }

    /// The default energy would pull against the field of an updater, so the caller has to choose.
    #[test]
    fn an_updater_that_the_default_energy_would_mute_is_refused() {
        let shape = icosphere::<f64>(2);
        let error = build(&shape).updater(crate::RescaleByArea).build();
        assert_eq!(error.unwrap_err(), FlowError::MutedUpdater);
        let chosen = [
            build(&shape)
                .updater(crate::RescaleByArea)
                .energy(crate::Hybrid::default()),
            build(&shape)
                .updater(crate::RescaleByArea)
                .orientation(Limited::new()),
        ];
        assert!(chosen.into_iter().all(|builder| builder.build().is_ok()));
    }

    /// One rest shape, measured once, serves several flows.
    #[test]
    fn flows_share_a_rest_shape_and_can_be_sent_to_threads() {
        fn is_static<F: Send + Sync + 'static>(_: &F) {}
        let shape = icosphere::<f64>(2);
        let rest = Arc::new(
            Rest::new(
                shape.connectivity(),
                shape.positions(),
                cotan_laplacian::Cotangent::default(),
            )
            .unwrap(),
        );
        let run = |mut flow: Flow<f64>| {
            is_static(&flow);
            std::thread::spawn(move || {
                let _ = flow.run_to_end().unwrap();
                flow.positions()
            })
            .join()
            .unwrap()
        };
        let shared = run(Flow::on(rest.clone())
            .handles(handles(&shape))
            .build()
            .unwrap());
        let again = run(Flow::on(rest).handles(handles(&shape)).build().unwrap());
        let own = run(build(&shape).build().unwrap());
        assert_eq!(shared, own);
        assert_eq!(shared, again);
    }

    /// A wrapped rule gives the same result.
    #[test]
    fn wrapped_orientations_and_energies_change_nothing() {
        let shape = icosphere::<f64>(2);
        let run = |builder: FlowBuilder<f64>| {
            let mut flow = builder.iteration_limit(5).tolerance(0.0).build().unwrap();
            let _ = flow.run_to_end().unwrap();
            flow.positions()
        };
        let hybrid: Box<dyn crate::LocalGlobal<f64>> = Box::new(crate::Hybrid::default());
        assert_eq!(
            run(build(&shape)),
            run(build(&shape).energy(Box::new(hybrid)))
        );
        let limited: Box<dyn crate::Orientation<f64>> = Box::new(Limited::new());
        assert_eq!(
            run(build(&shape).orientation(Limited::new())),
            run(build(&shape).orientation(Box::new(limited)))
        );
    }

    /// A field that differs from that of the original is followed.
    #[test]
    fn a_smaller_scalar_field_flattens_the_shape() {
        struct Halve;
        impl ScalarFieldUpdater<f64> for Halve {
            fn update(
                &mut self,
                state: &FlowState<'_, f64>,
                field: &mut VertexMap<f64>,
            ) -> Result<(), FlowError> {
                for (v, magnitude) in state.rest().magnitudes().iter() {
                    field[v] = 0.5 * magnitude;
                }
                Ok(())
            }
        }
        let shape = icosphere::<f64>(2);
        let held = shape.surface().vertices_where(|p| p.z < 0.0);
        let held: Vec<_> = held
            .into_iter()
            .map(|v| (Handle::hard(v), shape.positions()[v]))
            .collect();
        let mut flow = Flow::builder(shape.connectivity(), shape.positions())
            .handles(held)
            .updater(Halve)
            .orientation(Limited::new())
            .build()
            .unwrap();
        let _ = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        let now = flow.positions();
        assert!(volume(&shape.surface().with_positions(&now)) < 0.95 * volume(&shape.surface()));
    }
}
