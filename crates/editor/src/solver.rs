//! The solver thread.
//!
//! The window posts [`Goal`]s and takes [`Update`]s. Only the newest goal counts, only the newest
//! update is kept, and neither side waits for the other.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Instant;

use cotan::flow::{Schedule, StepReport};
use cotan::geometry::{Positions, Surface};
use cotan::halfedge::{VertexId, VertexMap};
use cotan::{DeformOptions, Parts, Session};
use cotan_io::ProcessingMesh;
use cotan_tool::MemoryLimit;
use nalgebra::Vector3;

use crate::newest::{Look, Newest, lock};
use crate::scene::{HandleGroup, Scene};

/// The shape that the solver should reach.
#[derive(Clone, Debug)]
pub struct Goal {
    /// Tag of the goal, increasing with every goal and repeated in its updates.
    pub tag: u64,
    /// The mesh.
    pub mesh: Arc<ProcessingMesh>,
    /// The rest shape of the deformation.
    pub rest: Arc<Positions<f64>>,
    /// The handles and their current positions.
    pub handles: Arc<Vec<HandleGroup>>,
    /// The options of the deformation.
    pub options: DeformOptions,
    /// The shape to start from, if not the solver's own.
    pub shape: Option<Arc<Positions<f64>>>,
    /// The kind of work to do.
    pub pace: Pace,
    /// The time of the pointer event.
    pub posted: Instant,
}

/// The kind of work that a goal asks for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Pace {
    /// A handle is being dragged: full steps (an updating ratio of 1).
    Held,
    /// The handle was released: iterate to convergence with the schedule and acceleration of the
    /// options.
    Settle,
    /// No work: the shape is final until the next goal.
    Still,
}

/// A result of the solver.
#[derive(Clone, Debug)]
pub struct Update {
    /// The tag of the goal that this answers.
    pub tag: u64,
    /// The shape.
    pub shape: Arc<Positions<f64>>,
    /// The vertex normals of the shape, for rendering.
    pub normals: Arc<VertexMap<Vector3<f64>>>,
    /// The state of the solver, which says whether more updates will follow.
    pub state: State,
    /// The times when the goal was posted, when the solver took it up, and when the step was
    /// done.
    pub times: [Instant; 3],
}

/// The state of the solver.
#[derive(Clone, PartialEq, Debug)]
pub enum State {
    /// There are no handles, or there was no request.
    Idle,
    /// The system is being factorized.
    Preparing,
    /// The solver is iterating.
    Running,
    /// The shape has converged, within the tolerance or to rounding.
    Settled,
    /// The solver failed, for the given reason.
    Failed(String),
}

/// The figures of one step, for the display and the plot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample {
    /// Iterations since the handles were set up.
    pub iteration: usize,
    /// The largest displacement in this step, relative to the diagonal.
    pub change: f64,
    /// The largest displacement that a full plain step would make.
    pub residual: f64,
    /// The energy, for orientations that have one.
    pub energy: Option<f64>,
    /// Duration of the step, without the time to prepare the picture.
    pub milliseconds: f64,
}

/// The solver thread and the state it shares with the window.
#[derive(Debug)]
pub struct Solver {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    goals: Newest<Goal>,
    latest: Mutex<Option<Update>>,
    state: Mutex<(State, String)>,
    samples: Mutex<Vec<Sample>>,
    /// Tells the window that there is something new.
    notify: Box<dyn Fn() + Send + Sync>,
    /// Makes the next step panic, for tests of crash recovery.
    panics: AtomicBool,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

impl Solver {
    /// Starts the thread. `notify` is called from it whenever there is something new.
    ///
    /// # Errors
    /// Fails if the system cannot start a thread.
    pub fn start(notify: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            goals: Newest::new(),
            latest: Mutex::default(),
            state: Mutex::new((State::Idle, String::new())),
            samples: Mutex::default(),
            notify: Box::new(notify),
            panics: AtomicBool::new(false),
        });
        let own = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("solver".to_owned())
            .spawn(move || serve(&own))?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Posts a new goal, which replaces any goal not taken up yet.
    pub fn post(&self, mut goal: Goal) {
        self.shared.goals.post(|unseen| {
            if let Some(unseen) = unseen
                && goal.shape.is_none()
                && Arc::ptr_eq(&unseen.mesh, &goal.mesh)
                && Arc::ptr_eq(&unseen.rest, &goal.rest)
            {
                // A starting shape must survive being replaced by a goal without one.
                goal.shape = unseen.shape;
            }
            goal
        });
    }

    /// Takes the newest update, if it was not taken yet.
    pub fn take(&self) -> Option<Update> {
        lock(&self.shared.latest).take()
    }

    /// The state of the solver and the strategy it solves with.
    pub fn state(&self) -> (State, String) {
        lock(&self.shared.state).clone()
    }

    /// The steps since the handles last changed; see [`Self::clear_samples`].
    pub fn samples(&self) -> Vec<Sample> {
        lock(&self.shared.samples).clone()
    }

    /// Clears the recorded steps.
    pub fn clear_samples(&self) {
        lock(&self.shared.samples).clear();
    }

    /// Makes the thread panic at its next step, for tests of crash recovery.
    pub fn provoke_panic(&self) {
        self.shared.panics.store(true, Ordering::Relaxed);
    }
}

impl Drop for Solver {
    fn drop(&mut self) {
        self.shared.goals.close();
        if let Some(thread) = self.thread.take() {
            // The thread ends after the current step. A panic was already reported when it
            // happened.
            let _ = thread.join();
        }
    }
}

/// The next event for the solver thread.
enum Next {
    Goal(Box<Goal>),
    Closed,
}

fn serve(shared: &Shared) {
    let mut next = shared.wait();
    while let Next::Goal(goal) = next {
        let tag = goal.tag;
        next = match catch_unwind(AssertUnwindSafe(|| follow(shared, *goal))) {
            Ok(next) => next,
            Err(_) => {
                shared.tell(State::Failed(format!(
                    "the solver broke down at goal {tag}, which is a fault of this program; your mesh is \
                     as it was before, and the solver starts afresh with the next edit"
                )));
                shared.wait()
            }
        };
    }
}

/// Follows the goals that share one mesh and rest shape, reusing the factorization where
/// possible.
///
/// Returns the first goal that needs another one.
fn follow(shared: &Shared, first: Goal) -> Next {
    let mesh = Arc::clone(&first.mesh);
    let rest = Arc::clone(&first.rest);
    let mut goal = first;
    while goal.handles.is_empty() {
        shared.tell(State::Idle);
        match shared.wait() {
            Next::Goal(next) if next.has_system_of(&goal) => {
                let shape = next.shape.clone().or(goal.shape.take());
                goal = Goal { shape, ..*next };
            }
            other => return other,
        }
    }
    shared.tell(State::Preparing);
    let taken = Instant::now();
    let components = mesh.mesh().components();
    let jobs = |goal: &Goal| {
        let loose = match goal.options.parts {
            Parts::Still => loose_vertices(&mesh, &components, &goal.handles),
            _ => Vec::new(),
        };
        Scene::job_handles(&goal.handles, &loose)
    };
    let mut options = goal.options.clone();
    let limit = MemoryLimit::of_machine().bytes();
    options.system.max_memory.get_or_insert(limit);
    let session = Session::new(
        Surface::assume_checked(mesh.mesh(), &rest),
        &jobs(&goal),
        &options,
    );
    let mut session = match session {
        Ok(session) => session,
        Err(error) => {
            shared.tell(State::Failed(error.to_string()));
            return shared.wait();
        }
    };
    shared.describe(session.flow().system().choice().to_string());
    if goal
        .shape
        .as_ref()
        .is_some_and(|shape| Arc::ptr_eq(shape, &rest))
    {
        // From its rest shape a session starts better by itself, with the rotations of the
        // handles.
        goal.shape = None;
    }
    let mut tracker = Tracker {
        shared,
        mesh: &mesh,
        taken,
    };
    let mut is_new = true;
    loop {
        if is_new {
            is_new = false;
            if let Err(error) = take_up(&mut session, &goal) {
                shared.tell(State::Failed(error.to_string()));
                return shared.wait();
            }
        }
        let end = match goal.pace {
            Pace::Still => Some(State::Idle),
            Pace::Held | Pace::Settle => tracker.step(&mut session, &goal),
        };
        let next = match end {
            Some(state) => {
                shared.tell(state);
                Some(shared.wait())
            }
            None => shared.peek(),
        };
        match next {
            None => {}
            Some(Next::Goal(next)) if next.has_system_of(&goal) && !next.handles.is_empty() => {
                tracker.taken = Instant::now();
                if let Err(error) = session.set_handles(&jobs(&next)) {
                    shared.tell(State::Failed(error.to_string()));
                    // The current handles stay. The next goal may be valid.
                    goal.pace = Pace::Still;
                    goal.tag = next.tag;
                    continue;
                }
                shared.describe(session.flow().system().choice().to_string());
                goal = *next;
                is_new = true;
            }
            Some(other) => return other,
        }
    }
}

/// Applies the shape and schedule of a goal to a session that already has its handles.
fn take_up(session: &mut Session<f64>, goal: &Goal) -> Result<(), cotan::Error> {
    if let Some(shape) = &goal.shape {
        session.set_shape(shape)?;
    }
    session.set_schedule(match goal.pace {
        Pace::Held => Schedule::Constant(1.0),
        Pace::Settle | Pace::Still => goal.options.schedule,
    })
}

/// The vertices of the connected parts that no handle holds.
fn loose_vertices(
    mesh: &ProcessingMesh,
    components: &cotan::halfedge::Components,
    handles: &[HandleGroup],
) -> Vec<VertexId> {
    let mut is_held = vec![false; components.count()];
    for &v in handles.iter().flat_map(|group| &group.vertices) {
        is_held[components.of(v)] = true;
    }
    let all = mesh.mesh().vertices();
    all.filter(|&v| !is_held[components.of(v)]).collect()
}

impl Goal {
    /// Returns `true` if the factorization for another goal can be reused.
    fn has_system_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh)
            && Arc::ptr_eq(&self.rest, &other.rest)
            && self.options == other.options
    }
}

impl Shared {
    /// Waits for a goal.
    fn wait(&self) -> Next {
        match self.goals.wait() {
            Some(goal) => Next::Goal(Box::new(goal)),
            None => Next::Closed,
        }
    }

    /// Returns a new goal, if there is one.
    fn peek(&self) -> Option<Next> {
        match self.goals.look() {
            Look::Letter(goal) => Some(Next::Goal(Box::new(goal))),
            Look::Nothing => None,
            Look::Closed => Some(Next::Closed),
        }
    }

    fn tell(&self, state: State) {
        lock(&self.state).0 = state;
        (self.notify)();
    }

    fn describe(&self, choice: String) {
        lock(&self.state).1 = choice;
    }
}

/// Runs steps and publishes their results.
struct Tracker<'a> {
    shared: &'a Shared,
    mesh: &'a ProcessingMesh,
    /// The time when the current goal was taken up.
    taken: Instant,
}

impl Tracker<'_> {
    /// Runs one step. Returns the final state of the goal if it has ended.
    fn step(&mut self, session: &mut Session<f64>, goal: &Goal) -> Option<State> {
        assert!(
            !self.shared.panics.swap(false, Ordering::Relaxed),
            "provoked by a test"
        );
        let clock = Instant::now();
        let step = match session.step() {
            Ok(step) => step,
            Err(error) => return Some(State::Failed(error.to_string())),
        };
        let milliseconds = 1e3 * clock.elapsed().as_secs_f64();
        if !step.residual.is_finite() {
            return Some(State::Failed(
                "the shape ran away; move the handle back, or choose another orientation or scheme"
                    .to_owned(),
            ));
        }
        let state = if step.converged || step.stalled {
            State::Settled
        } else {
            State::Running
        };
        self.publish(session, goal, &state);
        let mut samples = lock(&self.shared.samples);
        if samples.len() == MOST_SAMPLES {
            samples.drain(..MOST_SAMPLES / 2);
        }
        samples.push(sample(&step, milliseconds));
        drop(samples);
        if state == State::Settled {
            return Some(state);
        }
        self.shared.tell(state);
        None
    }

    fn publish(&self, session: &Session<f64>, goal: &Goal, state: &State) {
        let shape = session.positions();
        let normals = match Surface::new(self.mesh.mesh(), &shape) {
            Ok(surface) => surface.vertex_normals(),
            // A step to an invalid shape was already reported above.
            Err(_) => return,
        };
        *lock(&self.shared.latest) = Some(Update {
            tag: goal.tag,
            shape: Arc::new(shape),
            normals: Arc::new(normals),
            state: state.clone(),
            times: [goal.posted, self.taken, Instant::now()],
        });
    }
}

/// The limit of the recorded steps. The plot shows no more, and a handle may be held for hours.
const MOST_SAMPLES: usize = 4000;

fn sample(step: &StepReport, milliseconds: f64) -> Sample {
    Sample {
        iteration: step.iteration,
        change: step.change,
        residual: step.residual,
        energy: step.energy,
        milliseconds,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cotan_io::Document;
    use nalgebra::{Matrix4, Vector3};

    use super::*;
    use crate::scene::{Role, editor_options};

    fn mesh() -> Arc<ProcessingMesh> {
        let shape = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let document = Document::from_mesh(shape.connectivity(), shape.positions()).unwrap();
        Arc::new(document.surface().unwrap())
    }

    fn goal(mesh: &Arc<ProcessingMesh>, tag: u64, lift: f64, pace: Pace) -> Goal {
        let rest = mesh.positions().clone();
        let at = |side: f64| -> Vec<VertexId> {
            let all = rest.iter().filter(|(_, p)| p.x * side > 1.99);
            all.map(|(v, _)| v).collect()
        };
        let group = |vertices, role| HandleGroup::new(String::new(), vertices, role, &rest, &rest);
        let mut moved = group(at(1.0), Role::Movable);
        moved.matrix = Matrix4::new_translation(&Vector3::new(0.0, 0.0, lift));
        Goal {
            tag,
            mesh: Arc::clone(mesh),
            rest: Arc::new(rest.clone()),
            handles: Arc::new(vec![group(at(-1.0), Role::Fixed), moved]),
            options: editor_options(),
            shape: None,
            pace,
            posted: Instant::now(),
        }
    }

    /// Waits until the solver is done with `tag` and returns its last update.
    fn settled(solver: &Solver, tag: u64) -> Update {
        let deadline = Instant::now() + Duration::from_secs(60);
        let mut last: Option<Update> = None;
        loop {
            assert!(Instant::now() < deadline, "{:?}", solver.state());
            if let Some(update) = solver.take() {
                assert!(last.is_none_or(|l| l.tag <= update.tag));
                last = Some(update);
            }
            if let Some(update) = &last
                && update.tag == tag
                && update.state == State::Settled
            {
                return update.clone();
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn the_newest_goal_wins_and_its_shape_is_that_of_a_job() {
        let mesh = mesh();
        let solver = Solver::start(|| {}).unwrap();
        let mut first = goal(&mesh, 0, 0.0, Pace::Held);
        let rest = Arc::clone(&first.rest);
        solver.post(first.clone());
        for tag in 1..=50 {
            first = goal(&mesh, tag, 0.02 * tag as f64, Pace::Held);
            first.rest = Arc::clone(&rest);
            solver.post(first.clone());
            std::thread::sleep(Duration::from_micros(300));
        }
        first.pace = Pace::Settle;
        first.tag = 51;
        solver.post(first.clone());
        let update = settled(&solver, 51);
        let handles = Scene::job_handles(&first.handles, &[]);
        let job = cotan::deform(
            Surface::assume_checked(mesh.mesh(), &rest),
            &handles,
            &first.options,
        )
        .unwrap();
        let pairs = update.shape.values().zip(job.positions.values());
        let farthest = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(farthest < 4e-6, "{farthest:e}");
        assert!(!solver.samples().is_empty());
    }

    #[test]
    fn a_still_goal_touches_nothing_and_a_panic_is_survived() {
        let mesh = mesh();
        let solver = Solver::start(|| {}).unwrap();
        solver.post(goal(&mesh, 1, 0.5, Pace::Settle));
        let _ = settled(&solver, 1);
        let still = goal(&mesh, 2, 0.1, Pace::Still);
        solver.post(still.clone());
        std::thread::sleep(Duration::from_millis(100));
        assert!(solver.take().is_none());
        solver.provoke_panic();
        solver.post(Goal {
            tag: 3,
            pace: Pace::Settle,
            ..still.clone()
        });
        let deadline = Instant::now() + Duration::from_secs(20);
        while !matches!(solver.state().0, State::Failed(_)) {
            assert!(Instant::now() < deadline);
            std::thread::sleep(Duration::from_millis(1));
        }
        solver.post(Goal {
            tag: 4,
            pace: Pace::Settle,
            ..still
        });
        let _ = settled(&solver, 4);
    }
}
