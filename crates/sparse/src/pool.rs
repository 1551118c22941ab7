//! Memory that solves take and give back.

use std::sync::{Mutex, PoisonError};

/// Values that are made when they are needed and kept for the next user.
///
/// There are never more of them than there were users at the same time.
pub(crate) struct Pool<W>(Mutex<Vec<W>>);

impl<W> Pool<W> {
    pub(crate) fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// Runs `user` with a value of the pool, or with a new one if all are in use.
    pub(crate) fn with<R>(&self, new: impl FnOnce() -> W, user: impl FnOnce(&mut W) -> R) -> R {
        let kept = self.lock(Vec::pop);
        let mut value = kept.unwrap_or_else(new);
        let result = user(&mut value);
        self.lock(|values| values.push(value));
        result
    }

    /// A user that panics keeps its value, so that those in the pool are whole.
    fn lock<R>(&self, change: impl FnOnce(&mut Vec<W>) -> R) -> R {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_used_again_and_two_users_get_two() {
        let pool = Pool::new();
        let mut made = 0;
        let mut new = || {
            made += 1;
            made
        };
        pool.with(&mut new, |_| ());
        pool.with(&mut new, |first| {
            assert_eq!(*first, 1);
            pool.with(|| 2, |second| assert_eq!(*second, 2));
        });
        assert_eq!(made, 1);
    }
}
