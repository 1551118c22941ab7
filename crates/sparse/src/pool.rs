//! Pooled memory for solves.

use std::sync::{Mutex, PoisonError};

/// Values that are created on demand and kept for the next user.
///
/// There are never more of them than there were simultaneous users.
pub(crate) struct Pool<W>(Mutex<Vec<W>>);

impl<W> Pool<W> {
    pub(crate) fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// Runs `user` with a value from the pool, or with a new one if all are in use.
    pub(crate) fn with<R>(&self, new: impl FnOnce() -> W, user: impl FnOnce(&mut W) -> R) -> R {
        let kept = self.lock(Vec::pop);
        let mut value = kept.unwrap_or_else(new);
        let result = user(&mut value);
        self.lock(|values| values.push(value));
        result
    }

    /// A panicking user does not return its value, so the pooled values are never corrupt.
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
