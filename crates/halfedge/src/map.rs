//! Dense maps from ids to values: data is stored separately from the connectivity.

use std::iter::{Enumerate, FusedIterator};
use std::marker::PhantomData;
use std::ops::{Index, IndexMut};
use std::sync::Arc;

use crate::ids::{EdgeId, FaceId, HalfedgeId, Id, VertexId};

/// A value for each element of one kind, stored contiguously in id order.
///
/// Entry `i` belongs to the element with index `i`, so the slice of a [`VertexMap`] is also a
/// matrix column whose rows are vertices.
///
/// ```
/// use cotan_halfedge::{VertexId, VertexMap};
/// let mut height = VertexMap::filled(3, 0.0);
/// height[VertexId::new(1)] = 2.5;
/// assert_eq!(height.as_slice(), [0.0, 2.5, 0.0]);
/// for (v, h) in &mut height {
///     *h += v.index() as f64;
/// }
/// assert_eq!(height.as_slice(), [0.0, 3.5, 2.0]);
/// ```
///
/// Iterating over a map yields pairs of id and value, like [`DenseMap::iter`]. Collecting and
/// extending take values only; each gets the next id.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DenseMap<I, T> {
    values: Vec<T>,
    kind: PhantomData<fn(I) -> I>,
}

/// One value per vertex.
pub type VertexMap<T> = DenseMap<VertexId, T>;
/// One value per halfedge.
pub type HalfedgeMap<T> = DenseMap<HalfedgeId, T>;
/// One value per edge.
pub type EdgeMap<T> = DenseMap<EdgeId, T>;
/// One value per face.
pub type FaceMap<T> = DenseMap<FaceId, T>;

impl<I: Id, T> DenseMap<I, T> {
    /// Creates a map whose entry `i` is `values[i]`.
    pub fn from_vec(values: Vec<T>) -> Self {
        Self {
            values,
            kind: PhantomData,
        }
    }

    /// Creates a map of `len` entries, each a clone of `value`.
    pub fn filled(len: usize, value: T) -> Self
    where
        T: Clone,
    {
        Self::from_vec(vec![value; len])
    }

    /// Creates a map of `len` entries computed from their ids.
    pub fn from_fn(len: usize, mut value: impl FnMut(I) -> T) -> Self {
        Self::from_vec((0..len).map(|i| value(I::new(i))).collect())
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns true if there are no entries.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The entry of `id`, or `None` if the map is too short.
    pub fn get(&self, id: I) -> Option<&T> {
        self.values.get(id.index())
    }

    /// A mutable reference to the entry of `id`, or `None` if the map is too short.
    pub fn get_mut(&mut self, id: I) -> Option<&mut T> {
        self.values.get_mut(id.index())
    }

    /// All entries in id order.
    pub fn as_slice(&self) -> &[T] {
        &self.values
    }

    /// All entries in id order, mutable.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Converts the map into a vector in id order.
    pub fn into_vec(self) -> Vec<T> {
        self.values
    }

    /// The values in id order.
    pub fn values(&self) -> std::slice::Iter<'_, T> {
        self.values.iter()
    }

    /// The values in id order, mutable.
    pub fn values_mut(&mut self) -> std::slice::IterMut<'_, T> {
        self.values.iter_mut()
    }

    /// Pairs of id and value in id order.
    pub fn iter(&self) -> Pairs<I, std::slice::Iter<'_, T>> {
        Pairs::new(self.values.iter())
    }

    /// Pairs of id and mutable value in id order.
    pub fn iter_mut(&mut self) -> Pairs<I, std::slice::IterMut<'_, T>> {
        Pairs::new(self.values.iter_mut())
    }

    /// Creates a map of the same length by applying `f` to each value.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> DenseMap<I, U> {
        DenseMap::from_vec(self.values.iter().map(f).collect())
    }

    /// Appends the value of the next id and returns that id. Used after an edit that adds
    /// elements.
    pub fn push(&mut self, value: T) -> I {
        self.values.push(value);
        I::new(self.values.len() - 1)
    }

    /// Drops the entries from index `len` onwards.
    pub(crate) fn truncate(&mut self, len: usize) {
        self.values.truncate(len);
    }
}

impl<I, T> Default for DenseMap<I, T> {
    fn default() -> Self {
        Self {
            values: Vec::new(),
            kind: PhantomData,
        }
    }
}

/// Clones the map into an `Arc`, for functions that take `impl Into<Arc<…>>`.
impl<I: Clone, T: Clone> From<&DenseMap<I, T>> for Arc<DenseMap<I, T>> {
    fn from(map: &DenseMap<I, T>) -> Self {
        Self::new(map.clone())
    }
}

impl<I: Id, T> Index<I> for DenseMap<I, T> {
    type Output = T;

    #[inline]
    fn index(&self, id: I) -> &T {
        &self.values[id.index()]
    }
}

impl<I: Id, T> IndexMut<I> for DenseMap<I, T> {
    #[inline]
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.values[id.index()]
    }
}

impl<I: Id, T> FromIterator<T> for DenseMap<I, T> {
    fn from_iter<S: IntoIterator<Item = T>>(values: S) -> Self {
        Self::from_vec(values.into_iter().collect())
    }
}

impl<I: Id, T> Extend<T> for DenseMap<I, T> {
    fn extend<S: IntoIterator<Item = T>>(&mut self, values: S) {
        self.values.extend(values);
    }
}

impl<'a, I: Id, T> IntoIterator for &'a DenseMap<I, T> {
    type Item = (I, &'a T);
    type IntoIter = Pairs<I, std::slice::Iter<'a, T>>;

    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, I: Id, T> IntoIterator for &'a mut DenseMap<I, T> {
    type Item = (I, &'a mut T);
    type IntoIter = Pairs<I, std::slice::IterMut<'a, T>>;

    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<I: Id, T> IntoIterator for DenseMap<I, T> {
    type Item = (I, T);
    type IntoIter = Pairs<I, std::vec::IntoIter<T>>;

    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        Pairs::new(self.values.into_iter())
    }
}

/// Iterator over the entries of a [`DenseMap`]: pairs of id and value in id order.
///
/// `V` iterates over the values: by reference, by mutable reference, or by value.
#[derive(Clone, Debug)]
#[must_use = "an iterator does nothing unless it is consumed"]
pub struct Pairs<I, V> {
    values: Enumerate<V>,
    kind: PhantomData<fn(I) -> I>,
}

impl<I: Id, V: Iterator> Pairs<I, V> {
    #[inline]
    fn new(values: V) -> Self {
        Self {
            values: values.enumerate(),
            kind: PhantomData,
        }
    }
}

impl<I: Id, V: Iterator> Iterator for Pairs<I, V> {
    type Item = (I, V::Item);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        self.values.next().map(|(i, value)| (I::new(i), value))
    }

    #[inline]
    fn size_hint(&self) -> (usize, Option<usize>) {
        self.values.size_hint()
    }

    #[inline]
    fn nth(&mut self, n: usize) -> Option<Self::Item> {
        self.values.nth(n).map(|(i, value)| (I::new(i), value))
    }

    #[inline]
    fn fold<B, F: FnMut(B, Self::Item) -> B>(self, start: B, mut f: F) -> B {
        self.values
            .fold(start, |sum, (i, value)| f(sum, (I::new(i), value)))
    }
}

impl<I: Id, V: ExactSizeIterator + DoubleEndedIterator> DoubleEndedIterator for Pairs<I, V> {
    #[inline]
    fn next_back(&mut self) -> Option<Self::Item> {
        self.values.next_back().map(|(i, value)| (I::new(i), value))
    }
}

impl<I: Id, V: ExactSizeIterator> ExactSizeIterator for Pairs<I, V> {}

impl<I: Id, V: FusedIterator> FusedIterator for Pairs<I, V> {}

#[cfg(test)]
mod tests {
    use super::*;

    fn letters() -> VertexMap<char> {
        "abcd".chars().collect()
    }

    #[test]
    fn loops_give_ids_with_values() {
        let mut map = letters();
        for (v, letter) in &mut map {
            if v.index() > 1 {
                letter.make_ascii_uppercase();
            }
        }
        let pairs: Vec<(usize, char)> = (&map).into_iter().map(|(v, &c)| (v.index(), c)).collect();
        assert_eq!(pairs, [(0, 'a'), (1, 'b'), (2, 'C'), (3, 'D')]);
        let owned: Vec<(VertexId, char)> = map.clone().into_iter().collect();
        assert!(owned.iter().all(|&(v, letter)| map[v] == letter));
    }

    #[test]
    fn iterators_know_their_length_and_run_backwards() {
        let map = letters();
        let mut iter = map.iter();
        assert_eq!(iter.len(), 4);
        assert_eq!(iter.next_back(), Some((VertexId::new(3), &'d')));
        assert_eq!(iter.nth(1), Some((VertexId::new(1), &'b')));
        assert_eq!(iter.len(), 1);
        assert_eq!(iter.next(), Some((VertexId::new(2), &'c')));
        assert_eq!((iter.next(), iter.next_back()), (None, None));
        let sum = map.iter().fold(0, |sum, (v, _)| sum + v.index());
        assert_eq!(sum, 6);
    }

    #[test]
    fn access_beyond_the_end_is_none() {
        let mut map = letters();
        let beyond = VertexId::new(4);
        assert_eq!(map.get(beyond), None);
        assert_eq!(map.get_mut(beyond), None);
        map.extend(['e', 'f']);
        assert_eq!(map.get(beyond), Some(&'e'));
        if let Some(letter) = map.get_mut(beyond) {
            *letter = 'x';
        }
        assert_eq!(map.as_slice(), ['a', 'b', 'c', 'd', 'x', 'f']);
    }
}
