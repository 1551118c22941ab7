//! Room for what a file decides the size of: asked for before it is filled, so that a refusal of
//! the system is an error and not the end of the program.

use std::collections::TryReserveError;

use crate::error::IoError;

/// Makes room for so many more elements. Few or many at a time: the room grows as that of a
/// vector does.
#[inline]
pub(crate) fn reserve<T>(list: &mut Vec<T>, more: usize) -> Result<(), IoError> {
    if list.capacity() - list.len() >= more {
        return Ok(());
    }
    let grown = list.try_reserve(more);
    // Twice as much as there is may be too much where what is asked for is not.
    grown
        .or_else(|_| list.try_reserve_exact(more))
        .and_then(|()| leave_margin(list))
        .map_err(|_| missing::<T>(list.len().saturating_add(more)))
}

/// As [`reserve`], with no room to spare.
pub(crate) fn reserve_exact<T>(list: &mut Vec<T>, more: usize) -> Result<(), IoError> {
    list.try_reserve_exact(more)
        .and_then(|()| leave_margin(list))
        .map_err(|_| missing::<T>(list.len().saturating_add(more)))
}

/// Makes room for so many more elements if the system has it and has a margin left; a refusal
/// only means that the list grows as it fills.
pub(crate) fn reserve_if_there<T>(list: &mut Vec<T>, more: usize) {
    if reserve(list, more).is_err() {
        list.shrink_to_fit();
    }
}

/// Room for the small allocations of the program, such as the pieces of a text that threads parse
/// at the same time, beside those that are asked for.
pub(crate) const MARGIN: usize = 32 << 20;

/// Whether the system has something left to give after a large list got its room: a list must not
/// take the last bytes, without which not even the refusal could be told.
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

/// Whether the system has so many bytes to give. Nothing is written to them, so that it costs
/// addresses only.
pub(crate) fn check(bytes: u64) -> Result<(), IoError> {
    let room = usize::try_from(bytes).unwrap_or(usize::MAX);
    reserve_exact(&mut Vec::<u8>::new(), room)
}

/// The error of a refusal of room for so many elements.
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
                text.starts_with("not enough memory: 9223372036854775"),
                "{text}"
            );
        }
        push(&mut list, 7).unwrap();
        assert_eq!(list, [0, 7]);
        check(1).unwrap();
    }
}
