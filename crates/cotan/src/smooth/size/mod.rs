//! Smoothing by size: every bump smaller than a size goes, larger ones stay.
//!
//! With s the width of a bump (half of its wavelength), S the cotangent stiffness and m the areas,
//!
//! ```text
//! A = S m⁻¹ S + μ² m        μ = (π/s)² / 1.55
//! h = μ² A⁻¹ q              q = S x⁰ · n⁰                       (filter of the curvature)
//! A x = S m⁻¹ (a h n(x)) + μ² m x⁰                              (surface rebuilt from it)
//! ```
//!
//! The curvature keeps the share 1 − B of each wave, and the surface the share T = 1 − B², with
//! B = λ² / (λ² + μ²): 0.98 of a wave of width 2s, 0.50 at s, 0.05 at s/2. The anchor μ, from
//! which B results, also keeps pose and girth.
//!
//! **Source**: paper, section 4.2 (filter the curvature field, rebuild the surface from it), with
//! an implicit filter instead of explicit steps, and with the anchor that belongs to it.

mod field;
mod options;
mod rebuild;
mod rest;
mod rim;

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use cotan_flow::BoxUnits;
use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId};
use cotan_linear::{Bilaplacian, BilaplacianSystem, Choice, SystemOptions};
use nalgebra::Vector3;

pub use options::{BumpSize, BySizeOptions};

use self::field::filtered_curvature;
use self::rebuild::Rebuild;
pub(crate) use self::rest::{RestSurface, boundary};
use self::rim::smoothed_rims;
use super::anchored::{Boundary, Observer};
use super::mask::Mask;
use super::options::NewFolds;
use super::preserve::Correction;
use super::run::check_bound;
use super::unfold::without_new_folds;
use crate::error::Error;
use crate::handles::Handles;

/// A mesh smoothed by size, with details of the computation.
#[derive(Clone, PartialEq, Debug)]
pub struct SmoothedBySize<T: Scalar> {
    /// The new positions, in the units of the input.
    pub positions: Positions<T>,
    /// The number of solves for positions.
    pub solves: usize,
    /// The number of vertices kept in place because faces around them would have flipped.
    pub kept_vertices: usize,
    /// The strategy of the linear system; `None` for a size of 0, which needs none.
    pub strategy: Option<Choice>,
}

/// A mesh that is prepared for smoothing by size, and then smoothed by any number of sizes.
///
/// Weights, areas, normals, curvatures and the analysis of the matrix are computed once. Another
/// size needs a new factorization of the same pattern: of the one-ring matrix for large meshes,
/// which takes about as long as a few solves.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{BumpSize, BySizeOptions, SmoothBySize};
///
/// let shape = cotan::shapes::torus::<f64>(1.0, 0.4, 60, 30);
/// let mut job = SmoothBySize::new(&shape, &Handles::new(), &BySizeOptions::default())?;
/// for percent in [1.0, 2.0, 5.0] {
///     let smoothed = job.smooth(&BumpSize::Share(0.01 * percent))?;
///     assert_eq!(smoothed.kept_vertices, 0);
/// }
/// # Ok::<(), cotan::Error>(())
/// ```
pub struct SmoothBySize<T: Scalar> {
    mesh: Arc<HalfedgeMesh>,
    original: Positions<T>,
    units: BoxUnits<T>,
    rest: RestSurface,
    options: BySizeOptions,
    /// Rows at given places: the boundary, vertices at which pieces of the mesh meet, and the
    /// handles.
    is_fixed: Vec<bool>,
    /// Displacements of handles in box units.
    given: Vec<(VertexId, Vector3<f64>)>,
    mask: Option<Mask>,
    system: Option<BilaplacianSystem>,
}

impl<T: Scalar> std::fmt::Debug for SmoothBySize<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SmoothBySize")
            .field("vertices", &self.original.len())
            .field("system", &self.system)
            .finish_non_exhaustive()
    }
}

/// Removes the bumps of a mesh that are smaller than `size`.
///
/// **Shapes**: one position per vertex. The mesh is a triangle mesh, with or without boundary, of
/// any genus and with any number of components. Where it was cut into pieces, vertices at which
/// these meet stay in place. `handles` hold or move vertices exactly, also
/// those that are springs elsewhere.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{BumpSize, BySizeOptions, smooth_by_size};
///
/// let shape = cotan::shapes::icosphere::<f64>(4);
/// let options = BySizeOptions::default();
/// let smoothed = smooth_by_size(&shape, &Handles::new(), &BumpSize::Share(0.05), &options)?;
/// // A sphere has no bumps.
/// assert!(smoothed.positions.values().all(|p| (p.coords.norm() - 1.0).abs() < 1e-3));
/// # Ok::<(), cotan::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for a mesh that is not a valid surface, handles that do not exist or contradict each
/// other, a size that is negative or not finite, and a volume or area that cannot be preserved
/// within the displacement bound.
pub fn smooth_by_size<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    size: &BumpSize,
    options: &BySizeOptions,
) -> Result<SmoothedBySize<T>, Error> {
    SmoothBySize::new(surface, handles, options)?.smooth(size)
}

impl<T: Scalar> SmoothBySize<T> {
    /// Measures a surface. Nothing is factorized yet.
    ///
    /// # Errors
    /// [`Error`] for a mesh that is not a valid surface, handles that do not exist or contradict
    /// each other, and a bound that is not positive.
    pub fn new<'m>(
        surface: impl Into<Surface<'m, T>>,
        handles: &Handles<T>,
        options: &BySizeOptions,
    ) -> Result<Self, Error> {
        let surface = surface.into();
        check_bound(options.max_displacement)?;
        let surface = Surface::new(surface.mesh(), surface.positions())?;
        let units = BoxUnits::of(&surface)?;
        let mesh = surface.mesh();
        // A free rim is smoothed first, and then prescribed to the surface.
        let mut is_fixed = boundary(mesh);
        let mut given = Vec::new();
        let size = units.size().as_f64();
        for (handle, target) in handles.resolve(mesh, surface.positions())? {
            let way = target.map(T::as_f64) - surface.position(handle.vertex).map(T::as_f64);
            is_fixed[handle.vertex.index()] = true;
            given.push((handle.vertex, way / size));
        }
        Ok(Self {
            mesh: Arc::new(mesh.clone()),
            original: surface.positions().clone(),
            rest: RestSurface::new(&surface, &units)?,
            units,
            options: *options,
            is_fixed,
            given,
            mask: None,
            system: None,
        })
    }

    /// Limits the following calls to a part of the mesh; `None` is the whole mesh. Nothing needs
    /// to be computed again.
    ///
    /// # Errors
    /// [`Error::FieldLength`] for a mask of another length.
    pub fn set_mask(&mut self, mask: impl Into<Option<Mask>>) -> Result<(), Error> {
        let mask = mask.into();
        if let Some(mask) = &mask {
            mask.check(self.original.len())?;
        }
        self.mask = mask.map(|mask| mask.shared(&self.mesh).into_owned());
        Ok(())
    }

    /// Removes the bumps that are smaller than `size`.
    ///
    /// # Errors
    /// As [`smooth_by_size`].
    pub fn smooth(&mut self, size: &BumpSize) -> Result<SmoothedBySize<T>, Error> {
        self.smooth_observed(size, &|_| ControlFlow::Continue(()))
    }

    /// Like [`Self::smooth`], with an observer that receives the index of each completed solve
    /// and may stop the job.
    ///
    /// # Errors
    /// As [`Self::smooth`], and [`Error::Cancelled`] if the observer stopped it. The next call
    /// starts anew.
    pub fn smooth_observed(
        &mut self,
        size: &BumpSize,
        observer: Observer<'_>,
    ) -> Result<SmoothedBySize<T>, Error> {
        let mut sizes = size.in_box(self.original.len(), self.units.size())?;
        sizes.truncate(self.mesh.num_rows());
        if sizes.iter().all(|s| *s == 0.0) {
            return Ok(SmoothedBySize {
                positions: self.original.clone(),
                solves: 0,
                kept_vertices: 0,
                strategy: None,
            });
        }
        let (moves, solves) = self.moves(&sizes, observer)?;
        let (positions, kept_vertices) = self.corrected(&moves)?;
        Ok(SmoothedBySize {
            positions,
            solves,
            kept_vertices,
            strategy: self.system.as_ref().map(BilaplacianSystem::choice),
        })
    }

    /// The displacements in box units, and the number of solves.
    fn moves(
        &mut self,
        sizes: &[f64],
        observer: Observer<'_>,
    ) -> Result<(Vec<Vector3<f64>>, usize), Error> {
        let pairs = self.rest.masses.iter().zip(sizes);
        // Twice μ, because the weights of the operator carry no ½.
        let diagonal: Vec<f64> = pairs.map(|(m, s)| (2.0 * screen(*s)).powi(2) * m).collect();
        let mut u = match self.options.boundary {
            Boundary::Free => smoothed_rims(&self.mesh, &self.rest.positions, sizes)?,
            Boundary::Fixed => vec![Vector3::zeros(); sizes.len()],
        };
        for (v, way) in &self.given {
            u[v.index()] = *way;
        }
        self.prepare(&diagonal)?;
        let Some(system) = &self.system else {
            return Ok((u, 0));
        };
        let mut done = 0;
        let mut proceed = || {
            done += 1;
            match observer(done) {
                ControlFlow::Continue(()) => Ok(()),
                ControlFlow::Break(()) => Err(Error::Cancelled),
            }
        };
        let curvature = filtered_curvature(&self.rest, &diagonal, &self.is_fixed, system)?;
        proceed()?;
        let rebuild = Rebuild {
            mesh: &self.mesh,
            rest: &self.rest,
            curvature: &curvature,
            system,
        };
        let solves = rebuild.run(&mut u, proceed)?;
        Ok((u, solves))
    }

    /// Factorizes for these anchors.
    fn prepare(&mut self, diagonal: &[f64]) -> Result<(), Error> {
        if let Some(system) = &mut self.system {
            return Ok(system.set_diagonal(diagonal)?);
        }
        let fixed = self.mesh.rows().filter(|v| self.is_fixed[v.index()]);
        let equation = Bilaplacian {
            operator: &self.rest.operator,
            masses: &self.rest.masses,
            without_row: &boundary(&self.mesh),
            diagonal,
            fixed: &fixed.collect::<Vec<_>>(),
        };
        let mut options = SystemOptions::new().strategy(self.options.strategy);
        options.max_memory = self.options.max_memory;
        self.system = Some(BilaplacianSystem::prepare(&equation, options)?);
        Ok(())
    }

    /// The moved positions, without new folds and with the quantities that are preserved.
    fn corrected(&self, moves: &[Vector3<f64>]) -> Result<(Positions<T>, usize), Error> {
        let size = self.units.size().as_f64();
        let moved = self.original.iter().map(|(v, p)| {
            let way = moves[self.mesh.row_of(v).index()];
            match way.amax() > MIN_MOVE {
                true => (p.map(T::as_f64) + way * size).map(T::of_f64),
                false => *p,
            }
        });
        let mut moved: Positions<T> = moved.collect();
        let mut held = self.held();
        if let Some(mask) = &self.mask {
            moved = mask.blend(&self.original, &moved);
            mask.hold(&mut held);
        }
        let correct = |smoothed: &Positions<T>, held: &[bool]| {
            let correction = Correction {
                mesh: &self.mesh,
                original: &self.original,
                held,
                preserve: self.options.preserve,
                bound: self.options.max_displacement,
                mask: self.mask.as_ref(),
            };
            correction.apply(smoothed)
        };
        match self.options.folds {
            NewFolds::Allow => Ok((correct(&moved, &held)?, 0)),
            NewFolds::Prevent => {
                let surface = Surface::assume_checked(&self.mesh, &self.original);
                without_new_folds(&surface, moved, &held, correct)
            }
        }
    }

    /// The vertices that no correction may move.
    fn held(&self) -> Vec<bool> {
        let mut held = match self.options.boundary {
            Boundary::Fixed => boundary(&self.mesh),
            Boundary::Free => vec![false; self.mesh.num_rows()],
        };
        self.given.iter().for_each(|(v, _)| held[v.index()] = true);
        held
    }
}

/// μ for bumps of this width: a wave of wavelength 2s has λ = (π/s)² and keeps half of its height
/// for λ = 1.55 μ.
fn screen(size: f64) -> f64 {
    (PI / size.clamp(MIN_SIZE, LARGEST_SIZE)).powi(2) / HALF_HEIGHT
}

/// 1 / √(√2 − 1) = 1.5538: the root of 1 − (λ²/(λ² + 1))² = ½.
const HALF_HEIGHT: f64 = 1.55;

/// In box units. Smaller sizes remove nothing from any mesh, and larger ones everything.
const MIN_SIZE: f64 = 1e-6;
const LARGEST_SIZE: f64 = 100.0;

/// In box units: the rounding error of a solve.
const MIN_MOVE: f64 = 1e-13;

#[cfg(test)]
mod tests;
