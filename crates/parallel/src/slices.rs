//! Slices of equal length that are iterated together.

use std::ops::Range;

/// A slice, a range of indices, or a tuple of these with equal lengths.
///
/// Implemented for `&[A]`, `&mut [A]`, `Range<usize>` and tuples of two to five of these.
pub trait Slices: Send + Sized {
    /// The entries at one index: `&A`, `&mut A`, `usize`, or a tuple of these.
    type Entry;

    /// The number of entries.
    ///
    /// # Panics
    /// If the slices of a tuple have different lengths.
    fn num_entries(&self) -> usize;

    /// Splits the slice into the entries before `middle` and the rest.
    ///
    /// # Panics
    /// If there are fewer than `middle` entries.
    fn split(self, middle: usize) -> (Self, Self);

    /// Calls `visit` with each index and entry, in order.
    fn for_each_entry(self, visit: impl FnMut(usize, Self::Entry));
}

impl<'a, A: Sync> Slices for &'a [A] {
    type Entry = &'a A;

    fn num_entries(&self) -> usize {
        self.len()
    }

    fn split(self, middle: usize) -> (Self, Self) {
        self.split_at(middle)
    }

    #[inline]
    fn for_each_entry(self, mut visit: impl FnMut(usize, Self::Entry)) {
        for (i, entry) in self.iter().enumerate() {
            visit(i, entry);
        }
    }
}

impl<'a, A: Send> Slices for &'a mut [A] {
    type Entry = &'a mut A;

    fn num_entries(&self) -> usize {
        self.len()
    }

    fn split(self, middle: usize) -> (Self, Self) {
        self.split_at_mut(middle)
    }

    #[inline]
    fn for_each_entry(self, mut visit: impl FnMut(usize, Self::Entry)) {
        for (i, entry) in self.iter_mut().enumerate() {
            visit(i, entry);
        }
    }
}

impl Slices for Range<usize> {
    type Entry = usize;

    fn num_entries(&self) -> usize {
        self.len()
    }

    fn split(self, middle: usize) -> (Self, Self) {
        assert!(middle <= self.len(), "the middle lies within the range");
        let middle = self.start + middle;
        (self.start..middle, middle..self.end)
    }

    #[inline]
    fn for_each_entry(self, mut visit: impl FnMut(usize, Self::Entry)) {
        for (i, entry) in self.enumerate() {
            visit(i, entry);
        }
    }
}

macro_rules! tuple {
    ($first:ident $($rest:ident)+) => {
        impl<$first, $($rest),+> Slices for ($first, $($rest),+)
        where
            $first: Slices + IntoIterator,
            $($rest: Slices + IntoIterator),+
        {
            type Entry = ($first::Item, $($rest::Item),+);

            fn num_entries(&self) -> usize {
                #[allow(non_snake_case)]
                let ($first, $($rest),+) = self;
                let len = $first.num_entries();
                $(assert_eq!($rest.num_entries(), len, "slices of one length");)+
                len
            }

            #[allow(non_snake_case)]
            fn split(self, middle: usize) -> (Self, Self) {
                let ($first, $($rest),+) = self;
                let $first = $first.split(middle);
                $(let $rest = $rest.split(middle);)+
                (($first.0, $($rest.0),+), ($first.1, $($rest.1),+))
            }

            #[inline]
            #[allow(non_snake_case)]
            fn for_each_entry(self, mut visit: impl FnMut(usize, Self::Entry)) {
                let ($first, $($rest),+) = self;
                let zipped = $first.into_iter()$(.zip($rest))+;
                for (i, tuple!(@nested $first $($rest)+)) in zipped.enumerate() {
                    visit(i, ($first, $($rest),+));
                }
            }
        }
    };
    (@nested $a:ident $b:ident) => { ($a, $b) };
    (@nested $a:ident $b:ident $c:ident) => { (($a, $b), $c) };
    (@nested $a:ident $b:ident $c:ident $d:ident) => { ((($a, $b), $c), $d) };
    (@nested $a:ident $b:ident $c:ident $d:ident $e:ident) => { (((($a, $b), $c), $d), $e) };
}

tuple!(A B);
tuple!(A B C);
tuple!(A B C D);
tuple!(A B C D E);
