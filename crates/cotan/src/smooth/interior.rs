//! Laplacian weights without the rows of boundary vertices.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{HalfedgeMap, HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{
    Copies, Cotangent, FanSums, Fans, LaplacianScheme, OneRings, Operator, RowId, SchemeError,
    Symmetry,
};
use nalgebra::Vector3;

/// The weights of a scheme without the rows of boundary vertices, where Σ_j w_ij (v_j − v_i) is not
/// a curvature and would pull the rim inwards.
///
/// Where a mesh was cut into pieces, rows with copies are left out too: where several sheets meet
/// there is no normal. Such a vertex follows its neighbours.
///
/// On a closed mesh this equals the scheme. With a boundary it is not symmetric: w_ij = 0 if i is on
/// the boundary, while w_ji is kept.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct InteriorRows<S> {
    scheme: S,
    /// General if there are rows to leave out.
    symmetry: Symmetry,
    interior: Interior,
}

/// Cotangent weights without the rows of boundary vertices.
pub type InteriorCotangent = InteriorRows<Cotangent>;

/// The vertices whose rows are kept.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Interior {
    /// Those around which the faces are one closed fan.
    Fans,
    /// Those without an edge that has a single face. For fields that are sums over faces and need
    /// no normal at the vertex.
    Faces,
}

impl Interior {
    fn contains(self, mesh: &HalfedgeMesh, vertex: VertexId) -> bool {
        match self {
            Self::Fans => mesh.is_inner_vertex(vertex),
            Self::Faces => !mesh.is_rim_vertex(vertex),
        }
    }

    /// The symmetry of weights that are symmetric until other rows are cleared.
    pub(super) fn symmetry(self, mesh: &HalfedgeMesh) -> Symmetry {
        if mesh.rows().all(|v| self.contains(mesh, v)) {
            Symmetry::Symmetric
        } else {
            Symmetry::General
        }
    }

    /// Sets w_ij = 0 for all other i.
    pub(super) fn clear_others<T: Scalar>(self, mesh: &HalfedgeMesh, weights: &mut HalfedgeMap<T>) {
        for h in mesh.halfedges() {
            if !self.contains(mesh, mesh.origin(h)) {
                weights[h] = T::zero();
            }
        }
    }
}

impl InteriorCotangent {
    /// Creates the weights for `mesh`.
    pub fn of(mesh: &HalfedgeMesh) -> Self {
        Self::of_scheme(Cotangent::default(), mesh)
    }

    /// The weights for fields that are sums over faces, which have rows with copies too.
    pub(super) fn of_faces(mesh: &HalfedgeMesh) -> Self {
        Self::within(Cotangent::default(), mesh, Interior::Faces)
    }
}

impl<S> InteriorRows<S> {
    /// Creates the weights of `scheme` for `mesh`.
    pub fn of_scheme(scheme: S, mesh: &HalfedgeMesh) -> Self {
        Self::within(scheme, mesh, Interior::Fans)
    }

    fn within(scheme: S, mesh: &HalfedgeMesh, interior: Interior) -> Self {
        Self {
            scheme,
            symmetry: interior.symmetry(mesh),
            interior,
        }
    }
}

impl<T: Scalar, S: LaplacianScheme<T>> LaplacianScheme<T> for InteriorRows<S> {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        self.scheme.weights(surface, out)?;
        if self.symmetry == Symmetry::General {
            self.interior.clear_others(surface.mesh(), out);
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        match self.symmetry {
            Symmetry::Symmetric => self.scheme.symmetry(),
            Symmetry::General => Symmetry::General,
        }
    }

    fn copies(&self) -> Copies {
        self.scheme.copies()
    }

    fn operator(
        &self,
        rings: &OneRings,
        surface: &Surface<'_, T>,
    ) -> Result<Operator<T>, SchemeError> {
        let operator = self.scheme.operator(rings, surface)?;
        if self.symmetry == Symmetry::Symmetric {
            return Ok(operator);
        }
        let mesh = surface.mesh();
        let is_kept = |i: RowId| self.interior.contains(mesh, VertexId::new(i.index()));
        operator.reweighted(self.scheme.name(), Symmetry::General, |i, _, weight| {
            if is_kept(i) { weight } else { 0.0 }
        })
    }

    fn measure(
        &self,
        surface: &Surface<'_, T>,
        fans: &Fans,
        _weights: &mut HalfedgeMap<T>,
        laplacian: &mut VertexMap<Vector3<T>>,
        sums: &mut FanSums<T>,
    ) -> Result<(), SchemeError> {
        let operator = self.operator(fans.rings(), surface)?;
        operator.apply(surface.positions(), laplacian);
        fans.areas(surface.positions(), sums);
        Ok(())
    }

    fn name(&self) -> &str {
        self.scheme.name()
    }
}

/// w_ij = 4√3 / valence(i), without rows for boundary vertices: the umbrella operator, scaled to
/// the size of the cotangent weights on a mesh of equilateral triangles.
///
/// It does not depend on the positions, so noise in them does not make the weights noisy.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct InteriorUmbrella;

impl<T: Scalar> LaplacianScheme<T> for InteriorUmbrella {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        let mesh = surface.mesh();
        for v in mesh.vertices() {
            let weight = T::of_f64(48.0_f64.sqrt() / mesh.valence(v).max(1) as f64);
            for h in mesh.outgoing_halfedges(v) {
                out[h] = weight;
            }
        }
        Interior::Fans.clear_others(mesh, out);
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::General
    }

    fn copies(&self) -> Copies {
        Copies::Sum
    }

    fn name(&self) -> &str {
        "interior umbrella"
    }
}
