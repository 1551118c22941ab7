//! A longer job on a thread of its own, one at a time, with progress and cancellation.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};

/// A running job.
#[derive(Debug)]
pub(crate) struct Task<T> {
    /// The name shown next to the progress bar.
    pub(crate) name: String,
    control: Arc<Control>,
    result: mpsc::Receiver<Result<T, TaskError>>,
}

/// The state shared by a job and its window.
#[derive(Debug, Default)]
pub(crate) struct Control {
    is_cancelled: AtomicBool,
    done: AtomicUsize,
    of: AtomicUsize,
}

/// The reason why a job has no result.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub(crate) enum TaskError {
    /// The job was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The job failed, for the given reason.
    #[error("{0}")]
    Failed(String),
    /// The job panicked, which is a bug in this program.
    #[error("internal error: the job crashed; your mesh is unchanged; please report this")]
    Panicked,
}

impl Control {
    /// Reports progress. Returns `Break` if the job was cancelled.
    pub(crate) fn advance(&self, done: usize, of: usize) -> ControlFlow<()> {
        self.done.store(done, Ordering::Relaxed);
        self.of.store(of, Ordering::Relaxed);
        match self.is_cancelled.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl<T: Send + 'static> Task<T> {
    /// Starts `work` on a new thread and calls `notify` when it has ended.
    ///
    /// # Errors
    /// Fails if the system cannot start a thread.
    pub(crate) fn start(
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
                // If the window is gone, nobody needs the result.
                let _ = sender.send(outcome.unwrap_or(Err(TaskError::Panicked)));
                notify();
            })?;
        Ok(Self {
            name: name.into(),
            control,
            result,
        })
    }

    /// Asks the job to stop. The task must still be polled until it ends.
    pub(crate) fn cancel(&self) {
        self.control.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Returns `true` if the job was asked to stop.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.control.is_cancelled.load(Ordering::Relaxed)
    }

    /// The completed fraction, if the job reports it.
    pub(crate) fn progress(&self) -> Option<f32> {
        let of = self.control.of.load(Ordering::Relaxed);
        let done = self.control.done.load(Ordering::Relaxed);
        (of > 0).then(|| done as f32 / of as f32)
    }

    /// Returns the result once there is one. The result of a cancelled job is discarded.
    pub(crate) fn poll(&self) -> Option<Result<T, TaskError>> {
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
