//! The current positions and the quantities measured on them.

use std::borrow::Cow;
use std::sync::{Mutex, OnceLock, PoisonError};

use cotan_geometry::{Positions, Scalar, Surface, unit_or_zero};
use cotan_halfedge::{HalfedgeMap, VertexMap};
use cotan_laplacian::FanSums;
use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::error::FlowError;
use crate::rest::Rest;

/// Positions with the quantities that were computed since they were last written. Writing
/// positions forgets all of them, so that none can be read that belongs to another shape.
#[derive(Debug)]
pub(crate) struct Current<T: Scalar> {
    positions: Positions<T>,
    rest_laplacian: Cached<VertexMap<Vector3<f64>>>,
    laplacian: Cached<VertexMap<Vector3<T>>>,
    sums: Cached<FanSums<T>>,
    normals: Cached<VertexMap<Vector3<T>>>,
    /// Room for the weights of schemes that write them down.
    weights: Mutex<HalfedgeMap<T>>,
}

impl<T: Scalar> Current<T> {
    pub(crate) fn new(positions: Positions<T>) -> Self {
        Self {
            positions,
            rest_laplacian: Cached::new(),
            laplacian: Cached::new(),
            sums: Cached::new(),
            normals: Cached::new(),
            weights: Mutex::default(),
        }
    }

    pub(crate) fn positions(&self) -> &Positions<T> {
        &self.positions
    }

    /// The positions per vertex: the same, unless vertices have copies.
    pub(crate) fn of_vertices(&self, rest: &Rest<T>) -> Cow<'_, Positions<T>> {
        match rest.mesh().has_copies() {
            false => Cow::Borrowed(&self.positions),
            true => Cow::Owned(rest.mesh().to_vertices(self.positions.clone())),
        }
    }

    /// The positions, to be written.
    pub(crate) fn write(&mut self) -> &mut Positions<T> {
        self.rest_laplacian.clear();
        self.laplacian.clear();
        self.sums.clear();
        self.normals.clear();
        &mut self.positions
    }

    /// ℓ with the scheme's weights of the current mesh.
    pub(crate) fn laplacian(&self, rest: &Rest<T>) -> Result<&VertexMap<Vector3<T>>, FlowError> {
        self.laplacian.get_or_try(|out| {
            resize(out, self.positions.len());
            let mut weights = std::mem::take(&mut *lock(&self.weights));
            let mut sums = self.sums.room();
            let of_vertices = self.of_vertices(rest);
            let surface = Surface::assume_checked(rest.mesh(), &of_vertices);
            let scheme = rest.scheme();
            let measured = scheme.measure(&surface, rest.fans(), &mut weights, out, &mut sums);
            *lock(&self.weights) = weights;
            measured?;
            // The areas came along.
            self.sums.put(sums);
            Ok(())
        })
    }

    /// Areas and area vectors.
    pub(crate) fn sums(&self, rest: &Rest<T>) -> &FanSums<T> {
        self.sums
            .get_or(|sums| rest.fans().areas(&self.positions, sums))
    }

    /// Unit normals.
    pub(crate) fn normals(&self, rest: &Rest<T>) -> &VertexMap<Vector3<T>> {
        self.normals.get_or(|normals| {
            let vectors = self.sums(rest).area_vectors.as_slice();
            resize(normals, vectors.len());
            parallel::fill(normals.as_mut_slice(), |i| unit_or_zero(&vectors[i]));
        })
    }

    /// L⁰x.
    pub(crate) fn rest_laplacian(&self, rest: &Rest<T>) -> &VertexMap<Vector3<f64>> {
        self.rest_laplacian.get_or(|out| {
            resize(out, self.positions.len());
            let operator = rest.operator();
            parallel::fill(out.as_mut_slice(), |i| {
                operator.apply_at(&self.positions, i)
            });
        })
    }

    /// L⁰x, if it was computed.
    pub(crate) fn known_rest_laplacian(&self) -> Option<&VertexMap<Vector3<f64>>> {
        self.rest_laplacian.value.get()
    }

    /// Runs a pass that also computes L⁰x, so that it is not computed again.
    pub(crate) fn fuse_rest_laplacian<R>(&self, pass: impl FnOnce(&mut [Vector3<f64>]) -> R) -> R {
        let mut room = self.rest_laplacian.room();
        resize(&mut room, self.positions.len());
        let result = pass(room.as_mut_slice());
        self.rest_laplacian.put(room);
        result
    }
}

/// A value that is computed at most once between two calls of [`Self::clear`], in memory that is
/// used again.
#[derive(Debug)]
struct Cached<V> {
    value: OnceLock<V>,
    spare: Mutex<Option<V>>,
}

impl<V: Default> Cached<V> {
    fn new() -> Self {
        Self {
            value: OnceLock::new(),
            spare: Mutex::new(None),
        }
    }

    fn get_or(&self, compute: impl FnOnce(&mut V)) -> &V {
        if let Some(value) = self.value.get() {
            return value;
        }
        let mut room = self.room();
        compute(&mut room);
        self.put(room)
    }

    fn get_or_try(
        &self,
        compute: impl FnOnce(&mut V) -> Result<(), FlowError>,
    ) -> Result<&V, FlowError> {
        if let Some(value) = self.value.get() {
            return Ok(value);
        }
        // No lock is held while this computes: its threads may ask for the same value. Two that
        // compute it at the same time compute the same.
        let mut room = self.room();
        compute(&mut room)?;
        Ok(self.put(room))
    }

    fn room(&self) -> V {
        lock(&self.spare).take().unwrap_or_default()
    }

    fn put(&self, value: V) -> &V {
        self.value.get_or_init(|| value)
    }

    fn clear(&mut self) {
        if let Some(value) = self.value.take() {
            *lock(&self.spare) = Some(value);
        }
    }
}

fn resize<U: Scalar>(map: &mut VertexMap<Vector3<U>>, num_vertices: usize) {
    if map.len() != num_vertices {
        *map = VertexMap::filled(num_vertices, Vector3::zeros());
    }
}

/// A panic in another thread leaves no half-written value behind these locks.
fn lock<V>(mutex: &Mutex<V>) -> std::sync::MutexGuard<'_, V> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
