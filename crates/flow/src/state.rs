//! What an updater and an orientation see of the current mesh.

use cotan_geometry::{
    Positions, Scalar, Surface, normals_and_areas_into, one_ring_areas_into, unit_or_zero,
    vertex_area_vectors_into, vertex_normals_into,
};
use cotan_halfedge::{HalfedgeMap, VertexMap};
use cotan_laplacian::{LaplacianScheme, apply_weights};
use nalgebra::Vector3;

use crate::error::FlowError;
use crate::rest::Rest;

/// Which quantities of the current mesh are computed in every iteration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Quantities {
    /// L(v)v with the weights of the *current* mesh.
    pub laplacian: bool,
    /// Vertex normals.
    pub normals: bool,
    /// Areas of the one-rings.
    pub areas: bool,
    /// Sums of the area vectors of the one-rings.
    pub area_vectors: bool,
}

impl Quantities {
    /// All of them.
    pub const ALL: Self = Self {
        laplacian: true,
        normals: true,
        areas: true,
        area_vectors: true,
    };
    /// None of them: positions only.
    pub const NONE: Self = Self {
        laplacian: false,
        normals: false,
        areas: false,
        area_vectors: false,
    };

    /// What either asks for.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            laplacian: self.laplacian || other.laplacian,
            normals: self.normals || other.normals,
            areas: self.areas || other.areas,
            area_vectors: self.area_vectors || other.area_vectors,
        }
    }
}

/// The current mesh, in box units. Quantities that nobody asked for hold stale values.
#[derive(Debug)]
pub struct FlowState<'a, T: Scalar> {
    rest: &'a Rest<'a, T>,
    positions: &'a Positions<T>,
    measured: &'a Measured<T>,
    iteration: usize,
}

impl<'a, T: Scalar> FlowState<'a, T> {
    pub(crate) fn new(
        rest: &'a Rest<'a, T>,
        positions: &'a Positions<T>,
        measured: &'a Measured<T>,
        iteration: usize,
    ) -> Self {
        Self {
            rest,
            positions,
            measured,
            iteration,
        }
    }

    /// The original mesh.
    pub fn rest(&self) -> &Rest<'a, T> {
        self.rest
    }

    /// How many solves went before.
    pub fn iteration(&self) -> usize {
        self.iteration
    }

    /// The current positions, in box units.
    pub fn positions(&self) -> &Positions<T> {
        self.positions
    }

    /// ℓ = L(v)v with the weights of the current mesh ([`Quantities::laplacian`]).
    pub fn laplacian(&self) -> &VertexMap<Vector3<T>> {
        &self.measured.laplacian
    }

    /// Unit vertex normals, area weighted; zero where undefined ([`Quantities::normals`]).
    pub fn normals(&self) -> &VertexMap<Vector3<T>> {
        &self.measured.normals
    }

    /// Sums of the triangle areas around each vertex ([`Quantities::areas`]).
    pub fn areas(&self) -> &VertexMap<T> {
        &self.measured.areas
    }

    /// Sums of the area vectors of the triangles around each vertex; on a closed mesh they sum to
    /// zero ([`Quantities::area_vectors`]).
    pub fn area_vectors(&self) -> &VertexMap<Vector3<T>> {
        &self.measured.area_vectors
    }
}

/// Buffers for the quantities of the current mesh.
#[derive(Debug)]
pub(crate) struct Measured<T: Scalar> {
    weights: HalfedgeMap<T>,
    laplacian: VertexMap<Vector3<T>>,
    normals: VertexMap<Vector3<T>>,
    areas: VertexMap<T>,
    area_vectors: VertexMap<Vector3<T>>,
}

impl<T: Scalar> Measured<T> {
    pub(crate) fn new(rest: &Rest<'_, T>) -> Self {
        Self {
            weights: rest.operator().weights().map(|w| T::of_f64(*w)),
            laplacian: rest.laplacian().clone(),
            normals: rest.normals().clone(),
            areas: rest.areas().clone(),
            area_vectors: VertexMap::default(),
        }
    }

    pub(crate) fn update(
        &mut self,
        rest: &Rest<'_, T>,
        scheme: &dyn LaplacianScheme<T>,
        positions: &Positions<T>,
        wanted: Quantities,
    ) -> Result<(), FlowError> {
        let surface = Surface::assume_checked(rest.mesh(), positions);
        if wanted.laplacian {
            scheme.weights(&surface, &mut self.weights)?;
            apply_weights(rest.rings(), &self.weights, positions, &mut self.laplacian);
        }
        if wanted.area_vectors {
            vertex_area_vectors_into(&surface, &mut self.area_vectors);
        }
        match (wanted.normals, wanted.areas) {
            (true, false) if wanted.area_vectors => {
                for (normal, vector) in self.normals.values_mut().zip(self.area_vectors.values()) {
                    *normal = unit_or_zero(vector);
                }
            }
            (true, true) => {
                normals_and_areas_into(&surface, &mut self.normals, &mut self.areas);
            }
            (true, false) => vertex_normals_into(&surface, &mut self.normals),
            (false, true) => one_ring_areas_into(&surface, &mut self.areas),
            (false, false) => {}
        }
        Ok(())
    }
}
