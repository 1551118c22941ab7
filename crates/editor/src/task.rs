//! One longer job at a time, beside the window: it tells how far it is, and can be cancelled.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};

/// A job that runs.
#[derive(Debug)]
pub struct Task<T> {
    /// What it does, for the progress bar.
    pub name: String,
    control: Arc<Control>,
    result: mpsc::Receiver<Result<T, TaskError>>,
}

/// What a job and its window share.
#[derive(Debug, Default)]
pub struct Control {
    is_cancelled: AtomicBool,
    done: AtomicUsize,
    of: AtomicUsize,
}

/// Why a job has no result.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum TaskError {
    /// It was asked to stop.
    #[error("cancelled")]
    Cancelled,
    /// It cannot be done: why.
    #[error("{0}")]
    Failed(String),
    /// A fault of this program.
    #[error("the job broke down, which is a fault of this program; your mesh is as it was before")]
    Panicked,
}

impl Control {
    /// Tells how far the job is, and asks whether to go on.
    pub fn advance(&self, done: usize, of: usize) -> ControlFlow<()> {
        self.done.store(done, Ordering::Relaxed);
        self.of.store(of, Ordering::Relaxed);
        match self.is_cancelled.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl<T: Send + 'static> Task<T> {
    /// Starts `work` on a thread of its own; `notify` is called when it has ended.
    ///
    /// # Errors
    /// If the system has no thread for it.
    pub fn start(
        name: impl Into<String>,
        notify: impl Fn() + Send + 'static,
        work: impl FnOnce(&Control) -> Result<T, TaskError> + Send + 'static,
    ) -> std::io::Result<Self> {
        let control = Arc::new(Control::default());
        let own = Arc::clone(&control);
        let (sender, result) = mpsc::channel();
        std::thread::Builder::new()
            .name("job".to_owned())
            .spawn(move || {
                let outcome = catch_unwind(AssertUnwindSafe(|| work(&own)));
                // A window that has gone has no use for it.
                let _ = sender.send(outcome.unwrap_or(Err(TaskError::Panicked)));
                notify();
            })?;
        Ok(Self {
            name: name.into(),
            control,
            result,
        })
    }

    /// Asks the job to stop. Its result, should it have one all the same, is still to be taken.
    pub fn cancel(&self) {
        self.control.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.control.is_cancelled.load(Ordering::Relaxed)
    }

    /// Which part is done, if the job knows.
    pub fn progress(&self) -> Option<f32> {
        let of = self.control.of.load(Ordering::Relaxed);
        let done = self.control.done.load(Ordering::Relaxed);
        (of > 0).then(|| done as f32 / of as f32)
    }

    /// The result, once there is one. What was cancelled has none.
    pub fn poll(&self) -> Option<Result<T, TaskError>> {
        match self.result.try_recv() {
            Ok(_) if self.is_cancelled() => Some(Err(TaskError::Cancelled)),
            Ok(result) => Some(result),
            Err(mpsc::TryRecvError::Empty) => None,
            Err(mpsc::TryRecvError::Disconnected) => Some(Err(TaskError::Panicked)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn wait<T: Send + 'static>(task: &Task<T>) -> Result<T, TaskError> {
        loop {
            if let Some(result) = task.poll() {
                return result;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn jobs_end_are_cancelled_or_break_down() {
        let task = Task::start(
            "count",
            || {},
            |control| {
                let _ = control.advance(3, 4);
                Ok(7)
            },
        );
        let task = task.unwrap();
        assert_eq!(wait(&task), Ok(7));
        assert_eq!(task.progress(), Some(0.75));

        let task = Task::start(
            "turn",
            || {},
            |control| {
                while control.advance(0, 0).is_continue() {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Ok(1)
            },
        );
        let task = task.unwrap();
        task.cancel();
        assert_eq!(wait(&task), Err(TaskError::Cancelled));

        let task = Task::<u8>::start("break", || {}, |_| panic!("on purpose")).unwrap();
        assert_eq!(wait(&task), Err(TaskError::Panicked));
    }
}
