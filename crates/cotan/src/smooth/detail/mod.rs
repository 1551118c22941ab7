//! Editing the curvature field: details exaggerated, faded, mixed, painted.
//!
//! A [`CurvatureEdit`] maps the field of mean curvatures of the original mesh to the one wanted; edits
//! compose ([`Sum`], [`Blend`], [`Sequence`]). [`CurvatureUpdater`] makes one a
//! [`ScalarFieldUpdater`], and [`edit_detail`] rebuilds the surface from it in the anchored system.

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
pub use run::{DetailOptions, edit_detail, edit_detail_observed};
pub use scaled::ScaledCurvature;
pub use target::TargetCurvature;
pub use transferred::TransferredCurvature;

use super::curvature::{Curvature, Direction, roughness};
use super::parallel::filled;
use crate::error::Error;

/// The mean curvatures of a mesh, and what an edit needs to know of it.
#[derive(Clone, Debug)]
pub struct CurvatureField<'a> {
    /// H = ½ (κ₁ + κ₂) of every vertex, one over box units (the mesh's longest side is 1); positive
    /// where convex, 0 on the boundary.
    pub values: VertexMap<f64>,
    rings: &'a OneRings,
    is_inner: &'a VertexMap<bool>,
}

impl CurvatureField<'_> {
    /// Another field on the same mesh.
    #[must_use]
    pub fn with_values(&self, values: VertexMap<f64>) -> Self {
        Self {
            values,
            ..self.clone()
        }
    }

    /// The field after `passes` half steps of the umbrella, κ ← κ + ½ (mean of the neighbours − κ):
    /// its coarse part. Boundary vertices are left out.
    #[must_use]
    pub fn smoothed(&self, passes: usize) -> Self {
        let mut values = self.values.clone();
        for _ in 0..passes {
            let bend = roughness(self.rings, &values, |v| self.is_inner[v]);
            for (value, bend) in values.values_mut().zip(bend.values()) {
                *value -= 0.5 * bend;
            }
        }
        self.with_values(values)
    }
}

/// Says what becomes of a mesh's curvature.
///
/// Dyn-compatible, and forwarded through `Box<E>` and `&E`.
pub trait CurvatureEdit: Send + Sync {
    /// The wanted field.
    ///
    /// **Shapes**: one value a vertex. **Units**: one over box units.
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64>;

    /// Whether the edit suits a mesh of so many vertices.
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

/// A [`CurvatureEdit`] as a [`ScalarFieldUpdater`]: d = −4 A⁰ H*, with the *input's* areas, since with
/// the current ones the scale runs away. Constant once computed.
///
/// The orientation to go with it is [`super::AlongCurvature`] with the same direction.
#[derive(Clone, PartialEq, Debug)]
pub struct CurvatureUpdater<E> {
    /// The edit.
    pub edit: E,
    /// What the field is the size of.
    pub direction: Direction,
}

impl<E: CurvatureEdit> CurvatureUpdater<E> {
    /// With the default direction.
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
    let is_inner = VertexMap::from_fn(mesh.num_vertices(), |v| !mesh.is_boundary_vertex(v));
    let Curvature { values, areas } = Curvature::of_rest(rest, direction);
    let original = CurvatureField {
        values,
        rings: rest.rings(),
        is_inner: &is_inner,
    };
    let wanted = edit.edit(&original);
    filled(mesh.num_vertices(), |v: VertexId| {
        if is_inner[v] {
            T::of_f64(-4.0 * areas[v] * wanted[v])
        } else {
            T::zero()
        }
    })
}

/// A field must have one value per vertex.
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
