//! The solver thread.
//!
//! The caller posts goals (a scene and a [`Pace`]) and takes [`Update`]s. Only the newest goal
//! counts, only the newest update is kept, and neither side waits for the other.

mod goal;
mod prepared;
mod tracker;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Instant;

use cotan::Session;
use cotan::flow::Schedule;
use cotan::halfedge::VertexMap;
use nalgebra::Vector3;

use crate::model::Model;
use crate::newest::{Look, Newest, lock};
use crate::scene::Scene;
use crate::shape::Shape;

use goal::Goal;
use prepared::Prepared;
use tracker::Tracker;

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
    pub shape: Shape,
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
    /// The tag of the last goal.
    tag: u64,
    /// The first goal whose updates are still wanted.
    wanted_from: u64,
    /// The last shape that came from the solver or was sent to it.
    known: Option<Shape>,
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
            tag: 0,
            wanted_from: 0,
            known: None,
        })
    }

    /// Lets the solver follow the handles of a scene that continues the one before.
    pub fn follow(&mut self, model: &Model, scene: &Scene, pace: Pace) {
        if matches!(self.state().0, State::Failed(_)) {
            // The solver starts afresh and needs a shape to start from.
            self.known = None;
        }
        self.tag += 1;
        let is_known = self.known.as_ref().is_some_and(|s| s.is(&scene.shape));
        self.known = Some(scene.shape.clone());
        self.post(Goal {
            tag: self.tag,
            mesh: Arc::clone(&model.file().processing),
            rest: scene.rest.clone(),
            props: Arc::clone(&scene.props),
            shape: (!is_known).then(|| scene.shape.clone()),
            pace,
            posted: Instant::now(),
        });
    }

    /// Tells the solver of a scene that does not continue the one before. No update for an earlier
    /// goal arrives any more.
    pub fn show(&mut self, model: &Model, scene: &Scene) {
        self.follow(model, scene, Pace::Still);
        self.wanted_from = self.tag;
        self.clear_samples();
    }

    /// The tag of the last goal.
    pub fn tag(&self) -> u64 {
        self.tag
    }

    /// Posts a new goal, which replaces any goal not taken up yet.
    fn post(&self, mut goal: Goal) {
        self.shared.goals.post(|unseen| {
            if let Some(unseen) = unseen
                && goal.shape.is_none()
                && unseen.rest.is(&goal.rest)
            {
                // A starting shape must survive being replaced by a goal without one.
                goal.shape = unseen.shape;
            }
            goal
        });
    }

    /// Takes the newest update, if it was not taken yet and is still wanted.
    pub fn take(&mut self) -> Option<Update> {
        let update = lock(&self.shared.latest).take()?;
        if update.tag < self.wanted_from {
            return None;
        }
        self.known = Some(update.shape.clone());
        Some(update)
    }

    /// Returns `true` if the solver is at work, or an update was not taken yet.
    pub fn is_busy(&self) -> bool {
        !self.shared.goals.is_idle() || lock(&self.shared.latest).is_some()
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
                    "internal error: the solver crashed (goal {tag}). Your mesh is unchanged, and the solver \
                     restarts with the next edit; please report this"
                )));
                shared.wait()
            }
        };
    }
}

/// Follows the goals that share one rest shape, reusing the factorization where possible.
///
/// Returns the first goal that needs another one.
fn follow(shared: &Shared, first: Goal) -> Next {
    let mut goal = first;
    while goal.handles().is_empty() {
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
    let mesh = Arc::clone(&goal.mesh);
    let mut prepared = match Prepared::new(&mesh, &goal) {
        Ok(prepared) => prepared,
        Err(error) => {
            shared.tell(State::Failed(error.to_string()));
            return shared.wait();
        }
    };
    shared.describe(prepared.session.flow().system().choice().to_string());
    if goal
        .shape
        .as_ref()
        .is_some_and(|shape| shape.is(&goal.rest))
    {
        // From its rest shape a session starts better by itself, with the rotations of the
        // handles.
        goal.shape = None;
    }
    let mut tracker = Tracker { shared, taken };
    let mut is_new = true;
    loop {
        if is_new {
            is_new = false;
            if let Err(error) = take_up(&mut prepared.session, &goal) {
                shared.tell(State::Failed(error.to_string()));
                return shared.wait();
            }
        }
        let end = match goal.pace {
            Pace::Still => Some(State::Idle),
            Pace::Held | Pace::Settle => tracker.step(&mut prepared, &goal),
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
            Some(Next::Goal(next)) if next.has_system_of(&goal) && !next.handles().is_empty() => {
                tracker.taken = Instant::now();
                let handles = prepared.handles(&next);
                if let Err(error) = prepared.session.set_handles(&handles) {
                    shared.tell(State::Failed(error.to_string()));
                    // The current handles stay. The next goal may be valid.
                    goal.pace = Pace::Still;
                    goal.tag = next.tag;
                    continue;
                }
                shared.describe(prepared.session.flow().system().choice().to_string());
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
        session.set_shape(shape.positions())?;
    }
    session.set_schedule(match goal.pace {
        Pace::Held => Schedule::Constant(1.0),
        Pace::Settle | Pace::Still => goal.props.settings.follow.options().schedule,
    })
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

#[cfg(test)]
mod tests;
