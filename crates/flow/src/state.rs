//! What an updater and an orientation see of the current mesh.

use cotan_geometry::{Positions, Scalar, Surface, scalar};
use cotan_halfedge::{HalfedgeMap, VertexMap};
use cotan_laplacian::{LaplacianScheme, apply_weights};
use nalgebra::Vector3;

use crate::error::FlowError;
use crate::fans::Output;
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
    /// Of schemes that have to be asked.
    weights: HalfedgeMap<T>,
    laplacian: VertexMap<Vector3<T>>,
    normals: VertexMap<Vector3<T>>,
    areas: VertexMap<T>,
    area_vectors: VertexMap<Vector3<T>>,
}

impl<T: Scalar> Measured<T> {
    pub(crate) fn new(rest: &Rest<'_, T>) -> Self {
        Self {
            weights: HalfedgeMap::default(),
            laplacian: rest.laplacian().clone(),
            normals: rest.normals().clone(),
            areas: rest.areas().clone(),
            area_vectors: VertexMap::filled(rest.positions().len(), Vector3::zeros()),
        }
    }

    pub(crate) fn update(
        &mut self,
        rest: &Rest<'_, T>,
        scheme: &dyn LaplacianScheme<T>,
        positions: &Positions<T>,
        wanted: Quantities,
    ) -> Result<(), FlowError> {
        let floor = scheme.cotangent_floor();
        if wanted.laplacian && floor.is_none() {
            let surface = Surface::assume_checked(rest.mesh(), positions);
            if self.weights.is_empty() {
                self.weights = HalfedgeMap::filled(rest.mesh().num_halfedges(), T::zero());
            }
            scheme.weights(&surface, &mut self.weights)?;
            apply_weights(rest.rings(), &self.weights, positions, &mut self.laplacian);
        }
        let wanted = Quantities {
            laplacian: wanted.laplacian && floor.is_some(),
            ..wanted
        };
        if wanted != Quantities::NONE {
            rest.fans().measure(
                rest.rings(),
                positions,
                wanted,
                scalar(floor.unwrap_or(0.0)),
                Output {
                    laplacian: &mut self.laplacian,
                    normals: &mut self.normals,
                    areas: &mut self.areas,
                    area_vectors: &mut self.area_vectors,
                },
            );
        }
        Ok(())
    }
}
