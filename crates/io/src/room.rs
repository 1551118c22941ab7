//! Fallible allocation for sizes determined by a file.
//!
//! Memory is requested before it is filled, so that an allocation failure is an error and does
//! not abort the program.

use std::collections::TryReserveError;

use crate::error::IoError;

/// Reserves capacity for `more` additional elements, with the amortized growth of a vector.
#[inline]
pub(crate) fn reserve<T>(list: &mut Vec<T>, more: usize) -> Result<(), IoError> {
    if list.capacity() - list.len() >= more {
        return Ok(());
    }
    let grown = list.try_reserve(more);
    // Doubling may be too much even if the requested amount is not.
    grown
        .or_else(|_| list.try_reserve_exact(more))
        .and_then(|()| leave_margin(list))
        .map_err(|_| missing::<T>(list.len().saturating_add(more)))
}

/// Like [`reserve`], without spare capacity.
pub(crate) fn reserve_exact<T>(list: &mut Vec<T>, more: usize) -> Result<(), IoError> {
    list.try_reserve_exact(more)
        .and_then(|()| leave_margin(list))
        .map_err(|_| missing::<T>(list.len().saturating_add(more)))
}

/// Reserves capacity for `more` additional elements if the system can provide it with a margin to
/// spare.
///
/// On failure the list simply grows as it is filled.
pub(crate) fn reserve_if_there<T>(list: &mut Vec<T>, more: usize) {
    if reserve(list, more).is_err() {
        list.shrink_to_fit();
    }
}

/// Memory kept free for small allocations of the program, such as the pieces of a text that
/// threads parse at the same time.
pub(crate) const MARGIN: usize = 32 << 20;

/// Checks that the system can still provide memory after a large list was allocated. A list must
/// not take the last bytes, without which not even the error could be reported.
fn leave_margin<T>(list: &Vec<T>) -> Result<(), TryReserveError> {
    const LARGE: usize = 1 << 20;
    match list.capacity().saturating_mul(size_of::<T>()) {
        0..LARGE => Ok(()),
        _ => Vec::<u8>::new().try_reserve_exact(MARGIN),
    }
}

/// Appends an element.
#[inline]
pub(crate) fn push<T>(list: &mut Vec<T>, element: T) -> Result<(), IoError> {
    reserve(list, 1)?;
    list.push(element);
    Ok(())
}

/// Checks that the system can provide `bytes`.
///
/// Nothing is written to them, so only address space is used.
pub(crate) fn check(bytes: u64) -> Result<(), IoError> {
    let room = usize::try_from(bytes).unwrap_or(usize::MAX);
    reserve_exact(&mut Vec::<u8>::new(), room)
}

/// The error for a failed allocation of `count` elements.
#[cold]
pub(crate) fn missing<T>(count: usize) -> IoError {
    IoError::OutOfMemory {
        bytes: (count as u64).saturating_mul(size_of::<T>() as u64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_system_has_is_an_error_with_its_bytes() {
        let mut list = vec![0u64];
        for refused in [
            reserve(&mut list, usize::MAX / 16),
            reserve_exact(&mut list, usize::MAX / 16),
            check(u64::MAX / 2),
        ] {
            let text = refused.unwrap_err().to_string();
            assert!(
                text.starts_with("out of memory: this file needs 9223372036854775"),
                "{text}"
            );
        }
        push(&mut list, 7).unwrap();
        assert_eq!(list, [0, 7]);
        check(1).unwrap();
    }
}
