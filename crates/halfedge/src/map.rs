//! Dense maps from ids to values: data lives beside the connectivity, never in it.

use std::marker::PhantomData;
use std::ops::{Index, IndexMut};
use std::sync::Arc;

use crate::ids::{EdgeId, FaceId, HalfedgeId, Id, VertexId};

/// A value for every element of one kind, stored contiguously in the order of the ids.
///
/// Entry `i` belongs to the element with number `i`, so the slice of a
/// [`VertexMap`] is also the column of a matrix whose rows are vertices.
///
/// ```
/// use cotan_halfedge::{VertexId, VertexMap};
/// let mut height = VertexMap::filled(3, 0.0);
/// height[VertexId::new(1)] = 2.5;
/// assert_eq!(height.as_slice(), [0.0, 2.5, 0.0]);
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DenseMap<I, T> {
    values: Vec<T>,
    kind: PhantomData<fn(I) -> I>,
}

/// A value per vertex.
pub type VertexMap<T> = DenseMap<VertexId, T>;
/// A value per halfedge.
pub type HalfedgeMap<T> = DenseMap<HalfedgeId, T>;
/// A value per edge.
pub type EdgeMap<T> = DenseMap<EdgeId, T>;
/// A value per face.
pub type FaceMap<T> = DenseMap<FaceId, T>;

impl<I: Id, T> DenseMap<I, T> {
    /// A map whose entry `i` is `values[i]`.
    pub fn from_vec(values: Vec<T>) -> Self {
        Self {
            values,
            kind: PhantomData,
        }
    }

    /// A map of `len` entries, each a clone of `value`.
    pub fn filled(len: usize, value: T) -> Self
    where
        T: Clone,
    {
        Self::from_vec(vec![value; len])
    }

    /// A map of `len` entries computed from their ids.
    pub fn from_fn(len: usize, mut value: impl FnMut(I) -> T) -> Self {
        Self::from_vec((0..len).map(|i| value(I::new(i))).collect())
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The entry of `id`, or `None` if the map is too short.
    pub fn get(&self, id: I) -> Option<&T> {
        self.values.get(id.index())
    }

    /// All entries in the order of the ids.
    pub fn as_slice(&self) -> &[T] {
        &self.values
    }

    /// All entries in the order of the ids, to change.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// The entries as a vector, in the order of the ids.
    pub fn into_vec(self) -> Vec<T> {
        self.values
    }

    /// The values in the order of the ids.
    pub fn values(&self) -> std::slice::Iter<'_, T> {
        self.values.iter()
    }

    /// The values in the order of the ids, to change.
    pub fn values_mut(&mut self) -> std::slice::IterMut<'_, T> {
        self.values.iter_mut()
    }

    /// Pairs of id and value, in the order of the ids.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (I, &T)> + DoubleEndedIterator {
        self.values
            .iter()
            .enumerate()
            .map(|(i, value)| (I::new(i), value))
    }

    /// A map of the same length whose values are computed from this one's.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> DenseMap<I, U> {
        DenseMap::from_vec(self.values.iter().map(f).collect())
    }

    /// Appends the value of the next id and returns that id (after an edit that adds elements).
    pub fn push(&mut self, value: T) -> I {
        self.values.push(value);
        I::new(self.values.len() - 1)
    }

    /// Drops the entries from number `len` on.
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

/// A copy that can be shared: for what takes `impl Into<Arc<…>>`.
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
