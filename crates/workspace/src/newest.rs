//! A channel that keeps only the latest value: a new one replaces the one not yet received.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// A channel between the caller and a worker thread.
#[derive(Debug)]
pub(crate) struct Newest<T> {
    inside: Mutex<Inside<T>>,
    wake: Condvar,
}

#[derive(Debug)]
struct Inside<T> {
    letter: Option<T>,
    is_closed: bool,
    /// `true` while the receiver waits for a value.
    is_awaited: bool,
}

/// The content of the channel at one moment.
pub(crate) enum Look<T> {
    Letter(T),
    Nothing,
    Closed,
}

impl<T> Newest<T> {
    pub(crate) fn new() -> Self {
        Self {
            inside: Mutex::new(Inside {
                letter: None,
                is_closed: false,
                is_awaited: false,
            }),
            wake: Condvar::new(),
        }
    }

    /// Stores the value that `make` returns, given the value that was not received yet, if any.
    pub(crate) fn post(&self, make: impl FnOnce(Option<T>) -> T) {
        let mut inside = lock(&self.inside);
        let unseen = inside.letter.take();
        inside.letter = Some(make(unseen));
        drop(inside);
        self.wake.notify_one();
    }

    /// Closes the channel.
    pub(crate) fn close(&self) {
        lock(&self.inside).is_closed = true;
        self.wake.notify_one();
    }

    /// Waits for a value. Returns `None` once the channel is closed.
    pub(crate) fn wait(&self) -> Option<T> {
        let mut inside = lock(&self.inside);
        loop {
            if inside.is_closed {
                return None;
            }
            if let Some(letter) = inside.letter.take() {
                inside.is_awaited = false;
                return Some(letter);
            }
            inside.is_awaited = true;
            inside = self
                .wake
                .wait(inside)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Returns `true` if the receiver has nothing to do: it waits, and there is no value.
    pub(crate) fn is_idle(&self) -> bool {
        let inside = lock(&self.inside);
        inside.is_awaited && inside.letter.is_none()
    }

    /// Looks without waiting.
    pub(crate) fn look(&self) -> Look<T> {
        let mut inside = lock(&self.inside);
        match inside.letter.take() {
            _ if inside.is_closed => Look::Closed,
            Some(letter) => Look::Letter(letter),
            None => Look::Nothing,
        }
    }
}

/// Locks a mutex even if a thread panicked while holding it. The data is consistent at all times.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
