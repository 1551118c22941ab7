//! The signed mean curvature as a scalar field that is smoothed step by step.

use cotan_flow::{FlowError, FlowState, Orientation, Rest, ScalarFieldUpdater};
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::OneRings;
use nalgebra::Vector3;

use super::mollified::with_floor;
use super::parallel::{fill_each, filled};

/// The part of a Laplacian coordinate whose size is the scalar field, and its direction.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Direction {
    /// The component along the vertex normal; the tangential part of ℓ is kept. Areas are ⅛ Σ_j
    /// w_ij |e_ij|², for which the field of a mesh inscribed in a sphere is constant, 1/r, with
    /// any scheme.
    #[default]
    Normal,
    /// The whole vector, whose direction is kept up to the sign. Areas are sums of triangle
    /// areas. Used by the paper.
    Whole,
    /// The size of the whole vector, applied entirely along the normal. Areas are sums of
    /// triangle areas.
    NormalAlone,
}

/// The filter that is applied to the curvature in each step.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Order {
    /// κ ← κ − s Uκ with Uκ_i = κ_i minus the mean of its neighbours (paper, section 4.2).
    First,
    /// κ ← κ − s/2 U(Uκ), which affects already smooth parts less.
    #[default]
    Second,
}

/// Smooths the mean curvature and rebuilds the surface from it in each step.
///
/// The field is d_i = ℓ_i·n_i (signed along the normal: negative where convex), where ℓ is
/// computed with the *original* operator at the current positions. It is divided by the area,
/// smoothed over the vertices, and multiplied by the area again. The matching orientation is
/// [`AlongCurvature`] with the same direction. At boundary vertices, whose ℓ is not a curvature,
/// the field is 0, and they do not count as neighbours. The same holds for vertices with copies
/// (rows of a mesh that was cut into pieces), which have no normal.
///
/// **Shapes**: one value per vertex. **Units**: d is a length, in box units.
///
/// **Source**: paper, section 4.2, with corrected signs and a corrected factor 4, and with the
/// row-normalized umbrella operator instead of the raw cotangent sum, which diverges.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SmoothedCurvature {
    /// The step s, in 0 … 1.
    pub step: f64,
    /// The smoothing filter.
    pub order: Order,
    /// The quantity that is smoothed.
    pub direction: Direction,
}

impl Default for SmoothedCurvature {
    fn default() -> Self {
        Self {
            step: 1.0,
            order: Order::default(),
            direction: Direction::default(),
        }
    }
}

impl<T: Scalar> ScalarFieldUpdater<T> for SmoothedCurvature {
    fn update(
        &mut self,
        state: &FlowState<'_, T>,
        field: &mut VertexMap<T>,
    ) -> Result<(), FlowError> {
        let Curvature { values, areas, .. } = Curvature::of(state, self.direction);
        let is_inner = |v| state.rest().mesh().is_inner_vertex(v);
        let mut bend = roughness(state.rest().rings(), &values, is_inner);
        let mut step = self.step;
        if self.order == Order::Second {
            bend = roughness(state.rest().rings(), &bend, is_inner);
            step *= 0.5;
        }
        fill_each(field, |v| {
            T::of_f64(-4.0 * areas[v] * (values[v] - step * bend[v]))
        });
        Ok(())
    }
}

/// ℓ along the direction given by the current surface, with the signed size d of the field.
///
/// [`Direction::Whole`] gives d sgn(ℓ·n) ℓ/|ℓ|, and d n where ℓ = 0; [`Direction::Normal`] gives
/// d n plus the tangential part of ℓ; [`Direction::NormalAlone`] gives d n. ℓ is computed with
/// the *original* operator at the current positions.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct AlongCurvature {
    /// The quantity described by the field.
    pub direction: Direction,
}

impl<T: Scalar> Orientation<T> for AlongCurvature {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let (direction, normals) = (self.direction, state.normals());
        fill_each(out, |v| {
            let ell = state
                .rest()
                .operator()
                .apply_at(state.positions(), v.index());
            let normal = normals[v].map(T::as_f64);
            let size = field[v].as_f64();
            let along = ell.dot(&normal);
            let turned = match direction {
                Direction::Normal => ell + normal * (size - along),
                Direction::Whole if ell.norm() > 0.0 => ell * (size * sign(along) / ell.norm()),
                Direction::Whole | Direction::NormalAlone => normal * size,
            };
            turned.map(T::of_f64)
        });
        Ok(())
    }
}

/// H with ℓ·n = −4 A H: positive where convex.
pub(crate) struct Curvature {
    /// H_i, or 0 at boundary vertices and where there is no area. In inverse box units.
    pub(crate) values: VertexMap<f64>,
    /// A_i, in box units squared.
    pub(crate) areas: VertexMap<f64>,
    /// The signed size of ℓ_i: −4 A H, or 0 where H is 0.
    pub(crate) sizes: VertexMap<f64>,
}

impl Curvature {
    /// The curvature of the current surface.
    pub(crate) fn of<T: Scalar>(state: &FlowState<'_, T>, direction: Direction) -> Self {
        Self::at(
            state.rest(),
            state.positions(),
            state.normals(),
            state.areas(),
            direction,
        )
    }

    /// The curvature of the original mesh.
    pub(crate) fn of_rest<T: Scalar>(rest: &Rest<T>, direction: Direction) -> Self {
        Self::at(
            rest,
            rest.positions(),
            rest.normals(),
            rest.areas(),
            direction,
        )
    }

    /// Replaces the areas by ones with a lower bound and keeps the sizes: see [`with_floor`].
    pub(crate) fn with_floor(self, mesh: &HalfedgeMesh) -> Self {
        let areas = with_floor(mesh, &self.areas);
        let share = |v: VertexId| match self.areas[v] < areas[v] {
            true => -self.sizes[v] / (4.0 * areas[v]),
            false => self.values[v],
        };
        Self {
            values: filled(areas.len(), share),
            areas,
            sizes: self.sizes,
        }
    }

    fn at<T: Scalar>(
        rest: &Rest<T>,
        positions: &Positions<T>,
        normals: &VertexMap<Vector3<T>>,
        triangles: &VertexMap<T>,
        direction: Direction,
    ) -> Self {
        let mesh = rest.mesh();
        let n = mesh.num_rows();
        let areas = filled(n, |v: VertexId| match direction {
            Direction::Normal => cell(rest, positions, v),
            Direction::Whole | Direction::NormalAlone => triangles[v].as_f64(),
        });
        let sizes = filled(n, |v: VertexId| {
            if !mesh.is_inner_vertex(v) || !(areas[v] > 0.0) {
                return 0.0;
            }
            let ell = rest.operator().apply_at(positions, v.index());
            let along = ell.dot(&normals[v].map(T::as_f64));
            match direction {
                Direction::Normal => along,
                Direction::Whole | Direction::NormalAlone => sign(along) * ell.norm(),
            }
        });
        let values = filled(n, |v: VertexId| match areas[v] > 0.0 {
            true => -sizes[v] / (4.0 * areas[v]),
            false => 0.0,
        });
        Self {
            values,
            areas,
            sizes,
        }
    }
}

/// ⅛ Σ_j w_ij |e_ij|².
///
/// This can be small or negative where triangles are obtuse. The result is at least half of what
/// it would be if all weights had the same sign.
fn cell<T: Scalar>(rest: &Rest<T>, x: &Positions<T>, v: VertexId) -> f64 {
    let weights = rest.operator().weights();
    let (mut sum, mut size) = (0.0, 0.0);
    for (j, k) in rest.graph().row(v.index()) {
        let term = weights[k]
            * (x.as_slice()[j.index()] - x[v])
                .map(T::as_f64)
                .norm_squared();
        sum += term;
        size += term.abs();
    }
    0.125 * f64::max(sum, 0.5 * size)
}

/// Uκ_i = κ_i minus the mean over its inner neighbours; 0 at vertices that are not inner.
pub(crate) fn roughness(
    rings: &OneRings,
    field: &VertexMap<f64>,
    is_inner: impl Fn(VertexId) -> bool + Sync,
) -> VertexMap<f64> {
    filled(field.len(), |v: VertexId| {
        let (mut sum, mut count) = (0.0, 0.0);
        for (j, _) in rings.ring(v.index()) {
            if is_inner(j) {
                // Summed as differences, so a constant field has exactly zero roughness.
                sum += field[v] - field[j];
                count += 1.0;
            }
        }
        if count > 0.0 && is_inner(v) {
            sum / count
        } else {
            0.0
        }
    })
}

/// The sign of `x`, or 1 if it is 0.
fn sign(x: f64) -> f64 {
    if x < 0.0 { -1.0 } else { 1.0 }
}
