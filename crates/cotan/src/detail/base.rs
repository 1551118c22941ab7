//! A surface without its details: a screened low-pass of the positions.

use std::f64::consts::TAU;
use std::sync::Arc;

use cotan_flow::BoxUnits;
use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexMap};
use cotan_linear::{Bilaplacian, BilaplacianSystem, SystemOptions};
use nalgebra::Vector3;

use super::error::DetailError;
use super::options::{BaseOptions, Wavelength};
use crate::error::Error;
use crate::outward::inside_out;
use crate::smooth::{RestSurface, refuse, rows_without_curvature};

/// A surface with its base, the shape that is left without details.
///
/// ```text
/// (m + ℓ⁴ S m⁻¹ S) x̄ = m x        ℓ = wavelength / 2π
/// ```
///
/// with the mollified cotangent stiffness S and the areas m. A wave of length w keeps the share
/// 1 / (1 + (wavelength / w)⁴). Boundaries, and vertices at which several pieces of a mesh meet,
/// stay in place, so that they have no details.
///
/// The factorization is kept for the heights of the details.
pub struct BaseSurface<T: Scalar> {
    mesh: Arc<HalfedgeMesh>,
    original: Positions<T>,
    rest: RestSurface,
    /// The longest side of the box in the units of the mesh, which is the unit of `rest`.
    size: f64,
    /// √area in box units, the unit of heights.
    unit: f64,
    /// In box units.
    wavelength: f64,
    max_memory: Option<u64>,
    low_pass: LowPass,
    base: Positions<f64>,
    normals: VertexMap<Vector3<f64>>,
    /// x − x̄ of each row in box units.
    offsets: Vec<Vector3<f64>>,
}

impl<T: Scalar> std::fmt::Debug for BaseSurface<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BaseSurface")
            .field("vertices", &self.original.len())
            .field("wavelength", &self.wavelength())
            .finish_non_exhaustive()
    }
}

impl<T: Scalar> BaseSurface<T> {
    /// Filters a surface. It may be open, have any genus, and several components.
    ///
    /// # Errors
    /// [`DetailError`]: a surface that is not valid or has no area, a wavelength that is not
    /// above 0, and more memory than is allowed.
    pub fn new<'m>(
        surface: impl Into<Surface<'m, T>>,
        options: &BaseOptions,
    ) -> Result<Self, DetailError> {
        let surface = surface.into();
        let surface = Surface::new(surface.mesh(), surface.positions()).map_err(Error::from)?;
        let units = BoxUnits::of(&surface).map_err(Error::from)?;
        let rest = RestSurface::new(&surface, &units)?;
        let size = units.size().as_f64();
        let mesh = surface.mesh();
        let in_box = Surface::assume_checked(mesh, &rest.positions);
        let unit = match mesh.has_copies() {
            false => in_box.area().sqrt(),
            true => {
                let of_vertices = mesh.to_vertices(rest.positions.clone());
                in_box.with_positions(&of_vertices).area().sqrt()
            }
        };
        if !(unit > 0.0) {
            return Err(DetailError::NoArea);
        }
        let wavelength = match options.wavelength {
            Wavelength::Share(share) => share * unit,
            Wavelength::Length(length) => length / size,
        };
        if !(wavelength > 0.0 && wavelength.is_finite()) {
            return Err(refuse("wavelength", "above 0", wavelength / unit).into());
        }
        let low_pass = LowPass::new(mesh, &rest, wavelength, options.max_memory)?;
        let points: Vec<_> = rest.positions.values().map(|p| p.coords).collect();
        let offsets = low_pass.removed(&points)?;
        let corner = units.corner().map(T::as_f64);
        let base = points
            .iter()
            .zip(&offsets)
            .map(|(p, off)| corner + (p - off) * size);
        let base = mesh.to_vertices(base.collect());
        let mut normals = Surface::new(mesh, &base)
            .map_err(Error::from)?
            .vertex_normals();
        // Heights are measured outwards, however the faces of a closed surface are oriented.
        for (v, is_inside_out) in inside_out(&surface).iter() {
            if *is_inside_out {
                normals[v] = -normals[v];
            }
        }
        Ok(Self {
            mesh: Arc::new(mesh.clone()),
            original: surface.positions().clone(),
            rest,
            size,
            unit,
            wavelength,
            max_memory: options.max_memory,
            low_pass,
            base,
            normals,
            offsets,
        })
    }

    /// The surface itself.
    pub fn surface(&self) -> Surface<'_, T> {
        Surface::assume_checked(&self.mesh, &self.original)
    }

    /// The surface without its details, in the units of the mesh.
    pub fn base(&self) -> Surface<'_, f64> {
        Surface::assume_checked(&self.mesh, &self.base)
    }

    /// The unit normals of the base, outwards for closed surfaces.
    pub fn normals(&self) -> &VertexMap<Vector3<f64>> {
        &self.normals
    }

    /// The border between shape and detail as a share. With it the base of another surface has
    /// the same details relative to its size.
    pub fn wavelength(&self) -> Wavelength {
        Wavelength::Share(self.share())
    }

    /// The wavelength as a share of [`Self::unit`].
    pub(super) fn share(&self) -> f64 {
        self.wavelength / self.unit
    }

    /// The square root of the area in the units of the mesh: the unit of heights.
    pub fn unit(&self) -> f64 {
        self.unit * self.size
    }

    /// The mean length of the edges, as a share of [`Self::unit`].
    pub(super) fn mean_edge(&self) -> f64 {
        self.surface().mean_edge_length().as_f64() / self.unit()
    }

    /// The areas of the rows, in box units.
    pub(super) fn masses(&self) -> &[f64] {
        &self.rest.masses
    }

    /// The offsets from the base along its normals, without what the low-pass shrinks: high-passed
    /// once more. One per vertex, in shares of [`Self::unit`].
    pub(super) fn heights(&self) -> Result<VertexMap<f64>, DetailError> {
        let along = self
            .mesh
            .rows()
            .map(|v| match self.mesh.is_inner_vertex(v) {
                true => self.offsets[v.index()].dot(&self.normals[v]) / self.unit,
                false => 0.0,
            });
        let heights = self.low_pass.removed(&columns(along))?;
        Ok(self.to_vertices(&heights))
    }

    /// A field without its waves below a length, which is a share of [`Self::unit`].
    pub(super) fn smoothed(
        &self,
        field: &VertexMap<f64>,
        wavelength: f64,
    ) -> Result<VertexMap<f64>, DetailError> {
        let wavelength = wavelength * self.unit;
        let low_pass = LowPass::new(&self.mesh, &self.rest, wavelength, self.max_memory)?;
        let rows = self.mesh.to_rows(field);
        let mut smoothed = columns(rows.values().copied());
        let removed = low_pass.removed(&smoothed)?;
        smoothed
            .iter_mut()
            .zip(removed)
            .for_each(|(x, off)| *x -= off);
        Ok(self.to_vertices(&smoothed))
    }

    fn to_vertices(&self, rows: &[Vector3<f64>]) -> VertexMap<f64> {
        self.mesh.to_vertices(rows.iter().map(|x| x.x).collect())
    }
}

fn columns(field: impl Iterator<Item = f64>) -> Vec<Vector3<f64>> {
    field.map(|x| Vector3::new(x, 0.0, 0.0)).collect()
}

/// A factorized low-pass.
struct LowPass {
    system: BilaplacianSystem,
}

impl LowPass {
    fn new(
        mesh: &HalfedgeMesh,
        rest: &RestSurface,
        wavelength: f64,
        max_memory: Option<u64>,
    ) -> Result<Self, DetailError> {
        // The weights of the operator carry no ½, hence 4 = 2².
        let screen = 4.0 * (TAU / wavelength).powi(4);
        let diagonal: Vec<f64> = rest.masses.iter().map(|m| screen * m).collect();
        let still = rows_without_curvature(mesh);
        let fixed: Vec<_> = mesh.rows().filter(|v| still[v.index()]).collect();
        let equation = Bilaplacian {
            operator: &rest.operator,
            masses: &rest.masses,
            without_row: &still,
            diagonal: &diagonal,
            fixed: &fixed,
        };
        let mut options = SystemOptions::new();
        options.max_memory = max_memory;
        let system = BilaplacianSystem::prepare(&equation, options).map_err(Error::from)?;
        Ok(Self { system })
    }

    /// The part of a field that the filter removes, x − x̄.
    ///
    /// Solved for directly, so that it is exactly 0 for a field that the filter leaves alone, and
    /// otherwise accurate relative to itself.
    fn removed(&self, field: &[Vector3<f64>]) -> Result<Vec<Vector3<f64>>, DetailError> {
        let mut bend = vec![Vector3::zeros(); field.len()];
        self.system.laplacian(field, &mut bend);
        let mut rhs = bend.clone();
        self.system.right_hand_side(&bend, &mut rhs);
        let mut removed = vec![Vector3::zeros(); field.len()];
        let solved = self.system.solve(&rhs, &mut removed, TOLERANCE);
        solved.map_err(Error::from)?;
        Ok(removed)
    }
}

/// Relative to the energy norm of the removed part.
const TOLERANCE: f64 = 1e-6;
