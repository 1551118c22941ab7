//! The paper's two errors for comparing many shapes with one original.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{HalfedgeMap, HalfedgeMesh, VertexMap};
use cotan_laplacian::{Cotangent, LaplacianScheme, OneRings, apply_weights};
use nalgebra::Vector3;

use crate::error::Error;

/// The paper's two errors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ShapeErrors {
    /// E_p = √((1/n) Σ_i Σ_j (w⁰_ij − w_ij)²), with both directions of each edge. Dimensionless.
    pub parameterization: f64,
    /// E_g = √(Σ_i (|ℓ⁰_i| − |ℓ_i|)²), with the original mesh scaled to a box with longest
    /// side 1.
    pub geometry: f64,
    /// Root mean square of | |ℓ⁰_i| − |ℓ_i| |: E_g / √n.
    pub geometry_rms: f64,
}

/// A mesh to compare shapes with. Its own measurements are made once and reused by all
/// comparisons.
///
/// **Source**: paper, section 3.5.
#[derive(Clone, Debug)]
pub struct ShapeComparison<'m, T: Scalar> {
    mesh: &'m HalfedgeMesh,
    rings: Arc<OneRings>,
    weights: HalfedgeMap<T>,
    laplacian: VertexMap<Vector3<T>>,
    /// The areas around the vertices.
    areas: VertexMap<T>,
    /// The longest side of the original's bounding box.
    size: f64,
}

/// The contribution of each vertex to the two errors; see [`ShapeErrors`].
#[derive(Clone, PartialEq, Debug)]
pub struct ErrorFields {
    /// √(Σ_j (w⁰_ij − w_ij)²), whose root mean square is E_p. Dimensionless.
    pub parameterization: VertexMap<f64>,
    /// | |ℓ⁰_i| − |ℓ_i| |, the root of whose sum of squares is E_g, with the original mesh scaled
    /// so that the longest side of its box is 1.
    pub geometry: VertexMap<f64>,
}

impl<'m, T: Scalar> ShapeComparison<'m, T> {
    /// Measures the original.
    ///
    /// # Errors
    /// [`Error`] if its weights cannot be computed.
    pub fn new(original: &Surface<'m, T>) -> Result<Self, Error> {
        let mesh = original.mesh();
        let rings = Arc::new(OneRings::new(mesh));
        let (weights, laplacian) = measure(original, &rings)?;
        let size = original.bounding_box().longest_side().as_f64();
        Ok(Self {
            mesh,
            rings,
            weights,
            laplacian,
            areas: original.dual_areas(),
            // A mesh collapsed to a point has zero Laplacian coordinates, so any size works.
            size: if size > 0.0 { size } else { 1.0 },
        })
    }

    /// Computes the contribution of each vertex to the errors of another shape of the mesh.
    ///
    /// # Errors
    /// [`Error`] if the positions do not match the mesh or are not finite.
    pub fn fields(&self, positions: &Positions<T>) -> Result<ErrorFields, Error> {
        let rows = self.of_rows(positions)?;
        Ok(ErrorFields {
            parameterization: self.mesh.to_vertices(rows.parameterization),
            geometry: self.mesh.to_vertices(rows.geometry),
        })
    }

    /// The contribution of each row: all copies of a vertex count once.
    fn of_rows(&self, positions: &Positions<T>) -> Result<ErrorFields, Error> {
        let surface = Surface::new(self.mesh, positions)?;
        let (weights, laplacian) = measure(&surface, &self.rings)?;
        let squares = |i: usize| -> f64 {
            let ring = self.rings.ring(i);
            let weight = |w: &HalfedgeMap<T>, k| -> f64 {
                let halfedges = self.rings.halfedges_of(k).iter();
                halfedges.map(|h| w[*h].as_f64()).sum()
            };
            ring.map(|(_, k)| (weight(&self.weights, k) - weight(&weights, k)).powi(2))
                .sum()
        };
        let pairs = self.laplacian.values().zip(laplacian.values());
        Ok(ErrorFields {
            parameterization: (0..self.rings.num_rows())
                .map(|i| squares(i).sqrt())
                .collect(),
            geometry: pairs
                .map(|(a, b)| (a.norm() - b.norm()).as_f64().abs() / self.size)
                .collect(),
        })
    }

    /// Computes the errors of another shape of the mesh.
    ///
    /// # Errors
    /// Same as [`Self::fields`].
    pub fn errors(&self, positions: &Positions<T>) -> Result<ShapeErrors, Error> {
        Ok(self.of_rows(positions)?.errors())
    }

    /// Computes ln (area / original area) around each vertex of another shape of the mesh.
    /// Positive where the area has grown; 0 where there is no area.
    ///
    /// # Errors
    /// Same as [`Self::fields`].
    pub fn area_log_ratios(&self, positions: &Positions<T>) -> Result<VertexMap<f64>, Error> {
        let areas = Surface::new(self.mesh, positions)?.dual_areas();
        let ratios = areas
            .values()
            .zip(self.areas.values())
            .map(|(now, before)| {
                let ratio = (now.as_f64() / before.as_f64()).ln();
                if ratio.is_finite() { ratio } else { 0.0 }
            });
        Ok(ratios.collect())
    }
}

impl ErrorFields {
    /// The errors of the whole shape.
    pub fn errors(&self) -> ShapeErrors {
        let n = self.geometry.len() as f64;
        let squares = |field: &VertexMap<f64>| field.values().map(|e| e * e).sum::<f64>();
        let geometry = squares(&self.geometry);
        ShapeErrors {
            parameterization: (squares(&self.parameterization) / n).sqrt(),
            geometry: geometry.sqrt(),
            geometry_rms: (geometry / n).sqrt(),
        }
    }
}

type Measured<T> = (HalfedgeMap<T>, VertexMap<Vector3<T>>);

fn measure<T: Scalar>(
    surface: &Surface<'_, T>,
    rings: &Arc<OneRings>,
) -> Result<Measured<T>, Error> {
    let mesh = surface.mesh();
    let mut weights = HalfedgeMap::filled(mesh.num_halfedges(), T::zero());
    let scheme = Cotangent::default();
    scheme.weights(surface, &mut weights)?;
    let mut laplacian = VertexMap::filled(mesh.num_rows(), Vector3::zeros());
    apply_weights(
        rings,
        &scheme,
        &weights,
        surface.positions(),
        &mut laplacian,
    )?;
    Ok((weights, laplacian))
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::bar;
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn a_moved_mesh_has_no_errors_and_a_dent_has_them_where_it_is() {
        let shape = bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let comparison = ShapeComparison::new(&shape.surface()).unwrap();
        let shifted = shape.positions().map(|p| p + Vector3::new(1.0, 2.0, 3.0));
        let same = comparison.fields(&shifted).unwrap().errors();
        assert!(
            same.parameterization < 1e-10 && same.geometry < 1e-12,
            "{same:?}"
        );

        let dent = cotan_halfedge::VertexId::new(40);
        let mut dented = shape.positions().clone();
        dented[dent] += Vector3::new(0.1, 0.05, 0.02);
        let fields = comparison.fields(&dented).unwrap();
        for v in shape.connectivity().vertices() {
            let is_near = v == dent
                || shape
                    .connectivity()
                    .outgoing_halfedges(v)
                    .any(|h| shape.connectivity().target(h) == dent);
            assert_eq!(fields.geometry[v] > 0.0, is_near, "{v}");
        }
        let whole =
            ShapeErrors::measure(&shape.surface(), &shape.surface().with_positions(&dented));
        assert_eq!(fields.errors(), whole.unwrap());
    }
}
