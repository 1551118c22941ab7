//! A box of letters that holds one: what is put in takes the place of what was not taken yet.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Between a window that asks and a thread that works.
#[derive(Debug)]
pub(crate) struct Newest<T> {
    inside: Mutex<Inside<T>>,
    wake: Condvar,
}

#[derive(Debug)]
struct Inside<T> {
    letter: Option<T>,
    is_closed: bool,
}

/// What is in the box right now.
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
            }),
            wake: Condvar::new(),
        }
    }

    /// Puts in what `make` makes of the letter that was not taken yet, if there is one.
    pub(crate) fn post(&self, make: impl FnOnce(Option<T>) -> T) {
        let mut inside = lock(&self.inside);
        let unseen = inside.letter.take();
        inside.letter = Some(make(unseen));
        drop(inside);
        self.wake.notify_one();
    }

    /// There will be no more.
    pub(crate) fn close(&self) {
        lock(&self.inside).is_closed = true;
        self.wake.notify_one();
    }

    /// Waits for a letter; `None` when the box is closed.
    pub(crate) fn wait(&self) -> Option<T> {
        let mut inside = lock(&self.inside);
        loop {
            if inside.is_closed {
                return None;
            }
            if let Some(letter) = inside.letter.take() {
                return Some(letter);
            }
            inside = self
                .wake
                .wait(inside)
                .unwrap_or_else(PoisonError::into_inner);
        }
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

/// The data behind a lock, also after a thread has panicked: every value is whole at all times.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
