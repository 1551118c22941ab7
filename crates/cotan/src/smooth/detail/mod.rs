//! Editing of the curvature field: details exaggerated, faded, mixed or painted.
//!
//! A [`CurvatureEdit`] maps the mean curvature field of the original mesh to the target field.
//! Edits can be composed ([`Sum`], [`Blend`], [`Sequence`]). [`CurvatureUpdater`] turns an edit
//! into a [`ScalarFieldUpdater`], and [`edit_detail`] rebuilds the surface from it with the
//! anchored system.

mod band_pass;
mod compose;
mod run;
mod scaled;
mod target;
mod transferred;

use cotan_flow::{FlowError, FlowState, Rest, ScalarFieldUpdater};
use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use cotan_laplacian::OneRings;

pub use band_pass::BandPass;
pub use compose::{Blend, Sequence, Sum};
pub use run::{DetailOptions, Detailed, edit_detail, edit_detail_masked, edit_detail_observed};
pub use scaled::ScaledCurvature;
pub use target::TargetCurvature;
pub use transferred::TransferredCurvature;

use super::curvature::{Curvature, Direction};
use super::parallel::filled;
use crate::error::Error;

/// The mean curvatures of a mesh, and the data that an edit needs about the mesh.
#[derive(Clone, Debug)]
pub struct CurvatureField<'a> {
    /// H = ½ (κ₁ + κ₂) of each vertex in inverse box units (the longest side of the mesh is 1).
    /// Positive where convex, 0 on the boundary and at vertices with copies. One per row.
    pub values: VertexMap<f64>,
    rings: &'a OneRings,
    is_inner: &'a VertexMap<bool>,
    areas: &'a VertexMap<f64>,
}

impl CurvatureField<'_> {
    /// Another field on the same mesh.
    #[must_use]
    pub fn with_values(&self, mut values: VertexMap<f64>) -> Self {
        // An edit may give values for copies of vertices, which have those of their row.
        if values.len() > self.rings.num_rows() {
            values = values
                .into_iter()
                .map(|(_, h)| h)
                .take(self.rings.num_rows())
                .collect();
        }
        Self {
            values,
            ..self.clone()
        }
    }

    /// The coarse part of the field: the result of `passes` half steps of the umbrella operator,
    /// κ ← κ + ½ (mean of the neighbours − κ). Boundary vertices are excluded.
    ///
    /// A neighbour j with less than half of the area of vertex i is weighted by 2 A_j / A_i.
    /// Between slivers, curvatures are large and areas small, and such a curvature over the area
    /// of a large neighbour would be a bend that does not exist on the mesh.
    #[must_use]
    pub fn smoothed(&self, passes: usize) -> Self {
        let mut values = self.values.clone();
        for _ in 0..passes {
            let bend = self.bend(&values);
            for (value, bend) in values.values_mut().zip(bend.values()) {
                *value -= 0.5 * bend;
            }
        }
        self.with_values(values)
    }

    /// The difference between the field and the mean of its neighbours.
    fn bend(&self, values: &VertexMap<f64>) -> VertexMap<f64> {
        filled(values.len(), |v: VertexId| {
            let (mut sum, mut count) = (0.0, 0.0);
            if self.is_inner[v] {
                for (j, _) in self.rings.ring(v.index()) {
                    if self.is_inner[j] {
                        // If both areas are 0 the ratio is NaN, and `min` yields a share of 1.
                        let share = (LARGEST_RATIO * self.areas[j] / self.areas[v]).min(1.0);
                        // Summed as differences, so a constant field has exactly zero bend.
                        sum += share * (values[v] - values[j]);
                        count += 1.0;
                    }
                }
            }
            if count > 0.0 { sum / count } else { 0.0 }
        })
    }
}

/// The largest ratio of an area to that of a neighbour at which the neighbour still counts fully.
/// On meshes without slivers this changes results by about 1e-4 of the size; on CAD models it
/// makes displacements 5 to 20 times smaller.
const LARGEST_RATIO: f64 = 2.0;

/// An edit of the curvature of a mesh.
///
/// The trait is dyn-compatible and implemented for `Box<E>` and `&E`.
pub trait CurvatureEdit: Send + Sync {
    /// Computes the target field.
    ///
    /// **Shapes**: one value per row ([`cotan_halfedge::HalfedgeMesh::row_of`]), or more; others
    /// are ignored. **Units**: inverse box units.
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64>;

    /// Checks that the edit fits a mesh with this number of vertices.
    ///
    /// # Errors
    /// [`Error::FieldLength`] for a field of another length.
    fn check(&self, _num_vertices: usize) -> Result<(), Error> {
        Ok(())
    }
}

impl<E: CurvatureEdit + ?Sized> CurvatureEdit for Box<E> {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        (**self).edit(field)
    }

    fn check(&self, num_vertices: usize) -> Result<(), Error> {
        (**self).check(num_vertices)
    }
}

impl<E: CurvatureEdit + ?Sized> CurvatureEdit for &E {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        (**self).edit(field)
    }

    fn check(&self, num_vertices: usize) -> Result<(), Error> {
        (**self).check(num_vertices)
    }
}

/// A [`CurvatureEdit`] as a [`ScalarFieldUpdater`]: d = −4 A⁰ H*, with the areas of the *input*,
/// because the scale diverges with the current areas. Constant once computed.
///
/// The matching orientation is [`super::AlongCurvature`] with the same direction.
#[derive(Clone, PartialEq, Debug)]
pub struct CurvatureUpdater<E> {
    /// The edit.
    pub edit: E,
    /// The quantity described by the field.
    pub direction: Direction,
}

impl<E: CurvatureEdit> CurvatureUpdater<E> {
    /// Creates the updater with the default direction.
    pub fn new(edit: E) -> Self {
        Self {
            edit,
            direction: Direction::default(),
        }
    }
}

impl<T: Scalar, E: CurvatureEdit> ScalarFieldUpdater<T> for CurvatureUpdater<E> {
    fn update(
        &mut self,
        state: &FlowState<'_, T>,
        field: &mut VertexMap<T>,
    ) -> Result<(), FlowError> {
        *field = wanted_field(state.rest(), &self.edit, self.direction);
        Ok(())
    }

    fn is_constant(&self) -> bool {
        true
    }
}

/// d = −4 A⁰ H*, 0 on the boundary, in box units.
pub(crate) fn wanted_field<T: Scalar>(
    rest: &Rest<T>,
    edit: &(impl CurvatureEdit + ?Sized),
    direction: Direction,
) -> VertexMap<T> {
    let mesh = rest.mesh();
    let is_inner = VertexMap::from_fn(mesh.num_rows(), |v| mesh.is_inner_vertex(v));
    let Curvature {
        values,
        areas,
        sizes,
    } = Curvature::of_rest(rest, direction).with_floor(mesh);
    let original = CurvatureField {
        values,
        rings: rest.rings(),
        is_inner: &is_inner,
        areas: &areas,
    };
    let wanted = edit.edit(&original);
    filled(mesh.num_rows(), |v: VertexId| {
        if is_inner[v] {
            // Computed as a difference, so that the field is exactly that of the input where
            // nothing changes.
            let change = wanted[v] - original.values[v];
            T::of_f64(sizes[v] - 4.0 * areas[v] * change)
        } else {
            T::zero()
        }
    })
}

/// Checks that a field has one value per vertex.
fn check_length(what: &'static str, len: usize, num_vertices: usize) -> Result<(), Error> {
    if len == num_vertices {
        Ok(())
    } else {
        Err(Error::FieldLength {
            what,
            len,
            num_vertices,
        })
    }
}
