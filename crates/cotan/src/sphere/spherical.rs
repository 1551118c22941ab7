//! One-call function for spherical parameterization.

use std::ops::ControlFlow;
use std::sync::Arc;

use cotan_flow::{FlowError, StepReport};
use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{FaceId, HalfedgeMesh};
use cotan_linear::{LinearError, SparseError};
use nalgebra::{Point3, Vector3};

use super::cmcf;
use super::error::{SphereError, check_topology};
use super::hierarchy::embed;
use super::iterate::{self, Iterated, Observer};
use super::map::SphereMap;
use super::moebius;
use super::options::{Centering, SphereMethod, SphereOptions, SphereReport, Stage};
use super::predicate::flipped_faces;
use super::round::normalized;
use super::untangle::untangle;
use crate::options::SchemeKind;

/// A checked sphere map and the report of its computation.
#[derive(Clone, PartialEq, Debug)]
#[must_use = "the report says whether the iteration converged"]
pub struct Spherical<T: Scalar> {
    /// The map.
    pub map: SphereMap<T>,
    /// The report of the computation.
    pub report: SphereReport,
}

/// Maps a closed genus-0 triangle mesh onto the unit sphere, one-to-one.
///
/// The result is checked triangle by triangle with exact predicates ([`SphereMap::new`]). By
/// default it is conformal up to discretization; [`SphereOptions::authalic`] evens out areas. It
/// is centred so that the source areas balance on the sphere (unless rounding would flip a
/// triangle). The conformal map is unique up to a rotation. The result of the hierarchy, which is
/// used for areas or as the last resort, also depends on the position and the vertex order of the
/// mesh.
///
/// **Shapes**: one position per vertex. Zero-area faces and inside-out meshes are allowed.
///
/// # Errors
/// [`SphereError`] for a mesh that is not a closed, connected triangle mesh of genus 0, for a
/// non-finite coordinate, and if an explicitly requested method flips triangles. Reaching the
/// iteration limit is not an error: see [`SphereReport::stop`].
///
/// **Source**: paper, section 4.1; the blend towards equal areas, and the fallbacks for shapes
/// on which the flow would flip triangles, are ours.
///
/// ```
/// use cotan::sphere::{SphereOptions, spherical};
/// let shape = cotan::shapes::creature::<f64>(48);
/// let sphere = spherical(&shape, &SphereOptions::default())?;
/// assert!(sphere.map.positions().values().all(|p| (p.coords.norm() - 1.0).abs() < 1e-15));
/// # Ok::<(), cotan::sphere::SphereError>(())
/// ```
pub fn spherical<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    options: &SphereOptions,
) -> Result<Spherical<T>, SphereError> {
    spherical_observed(surface, options, |_| ControlFlow::Continue(()))
}

/// Like [`spherical`], with an observer that receives each step of an iteration and may stop it.
/// Repairs and the hierarchy ([`SphereOptions::authalic`] above 0) are not iterations.
///
/// # Errors
/// Same as [`spherical`].
pub fn spherical_observed<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    options: &SphereOptions,
    mut observer: impl FnMut(&StepReport) -> ControlFlow<()>,
) -> Result<Spherical<T>, SphereError> {
    let surface = surface.into();
    let positions = surface.positions();
    options.check()?;
    let mesh: &Arc<HalfedgeMesh> = &surface.mesh().into();
    check_topology(mesh)?;
    Surface::new(mesh, positions)?;
    // Intermediate results are in double precision, because limbs shrink exponentially.
    let source = outward(mesh, unit_sized(positions));
    let mut run = Run::new(mesh, &source, options);
    let observer = &mut observer;
    let map = match options.method {
        SphereMethod::Robust if options.authalic > 0.0 => run.embed(options.authalic)?,
        SphereMethod::Robust => match run.robust(observer) {
            Ok(conformal) => run.cured(conformal)?,
            // A surface without size or volume, or with predominantly negative weights.
            Err(
                FlowError::Collapsed
                | FlowError::NoVolume
                | FlowError::NoExtent
                | FlowError::Linear(
                    LinearError::Sparse(
                        SparseError::NotPositiveDefinite { .. }
                        | SparseError::Inaccurate { .. }
                        | SparseError::NotConverged { .. },
                    )
                    | LinearError::IllConditioned { .. },
                ),
            ) => run.embed(FALLBACK_BALANCE)?,
            Err(error) => return Err(error.into()),
        },
        SphereMethod::Paper => {
            let found = run.once(iterate::paper(mesh, &source, options, observer)?);
            run.checked(found)?
        }
        SphereMethod::Cmcf => {
            let found = run.once(cmcf::cmcf(mesh, &source, options, observer)?);
            run.checked(found)?
        }
    };
    Ok(Spherical {
        map,
        report: run.report,
    })
}

/// Scales the positions so that the largest coordinate is 1 and areas neither overflow nor
/// vanish.
pub(super) fn unit_sized<T: Scalar>(positions: &Positions<T>) -> Positions<f64> {
    let all = positions.values().map(|p| p.coords.amax().as_f64());
    let size = all.fold(0.0, f64::max);
    let size = if size > 0.0 { size } else { 1.0 };
    positions.map(|p| p.map(|x| x.as_f64() / size))
}

/// Orients the faces outwards: an inside-out mesh is reflected in the origin.
fn outward(mesh: &HalfedgeMesh, positions: Positions<f64>) -> Positions<f64> {
    if Surface::assume_checked(mesh, &positions).volume() < 0.0 {
        positions.map(|p| -p)
    } else {
        positions
    }
}

/// The state of a computation.
struct Run<'a> {
    mesh: &'a Arc<HalfedgeMesh>,
    source: &'a Positions<f64>,
    options: &'a SphereOptions,
    report: SphereReport,
}

/// Rounds of selective repair; one suffices on most meshes.
const MAX_REPAIRS: usize = 3;

/// If more than one in this many triangles is flipped, the map is considered lost.
const LOST_SHARE: usize = 10;

/// Rings around a flipped face in which weights are raised.
const REPAIR_RINGS: usize = 2;

/// With more flipped triangles than this, local repairs cannot fix the map.
const MAX_UNTANGLED: usize = 1000;

/// A compromise between angles and areas, used if the conformal map cannot be represented because
/// its limbs are too small.
const FALLBACK_BALANCE: f64 = 0.1;

impl<'a> Run<'a> {
    fn new(
        mesh: &'a Arc<HalfedgeMesh>,
        source: &'a Positions<f64>,
        options: &'a SphereOptions,
    ) -> Self {
        Self {
            mesh,
            source,
            options,
            report: SphereReport::default(),
        }
    }

    /// Adds the result of an iteration to the report and returns its positions.
    fn once(&mut self, iterated: Iterated) -> Positions<f64> {
        self.note(Stage::Iteration, &iterated);
        iterated.positions
    }

    fn note(&mut self, stage: Stage, iterated: &Iterated) {
        self.report.stages.push(stage);
        self.report.iterations += iterated.report.iterations;
        self.report.factorizations += iterated.factorizations;
        self.report.stop = Some(iterated.report.stop);
        self.report.change = iterated.report.change;
    }

    /// The robust iteration, followed by rounds with raised weights around flipped triangles.
    fn robust(&mut self, observer: Observer<'_>) -> Result<Positions<f64>, FlowError> {
        let mut marked = Vec::new();
        let mut first = None;
        let mut stage = Stage::Iteration;
        loop {
            let iterated = iterate::robust(
                self.mesh,
                self.source,
                self.options,
                &marked,
                first,
                observer,
            )?;
            self.note(stage, &iterated);
            let flipped = flipped_faces(self.mesh, &iterated.positions);
            self.report.flips.push(flipped.len());
            let is_lost = flipped.len() * LOST_SHARE > self.mesh.num_faces();
            // Weights that are never negative need not be raised: flipped are slivers of the mesh
            // that are not triangles of the scheme.
            let has_low_weights = self.options.scheme != SchemeKind::IntrinsicDelaunay;
            let is_last = self.report.flips.len() > MAX_REPAIRS || !has_low_weights;
            if flipped.is_empty() || is_lost || is_last {
                return Ok(iterated.positions);
            }
            marked.resize(self.mesh.num_vertices(), false);
            self.mark(&flipped, &mut marked);
            first = Some(iterated.positions);
            stage = Stage::SelectiveRepair;
        }
    }

    /// Marks the corners of faces and the rings around them.
    fn mark(&self, faces: &[FaceId], marked: &mut [bool]) {
        let mut front: Vec<_> = faces.iter().flat_map(|&f| self.mesh.triangle(f)).collect();
        // Each vertex once, because the ring of a vertex shared by many faces may be as large as
        // the mesh.
        front.sort_unstable();
        front.dedup();
        for ring in 0..=REPAIR_RINGS {
            front.iter().for_each(|v| marked[v.index()] = true);
            if ring < REPAIR_RINGS {
                let grown: Vec<_> = front.iter().flat_map(|&v| self.mesh.one_ring(v)).collect();
                front = grown;
                front.sort_unstable();
                front.dedup();
            }
        }
    }

    fn map<T: Scalar>(&self, positions: Positions<T>) -> Result<SphereMap<T>, SphereError> {
        SphereMap::on_sphere(Arc::clone(self.mesh), positions)
    }

    /// Centres, rounds to the scalar type `T`, and checks.
    fn checked<T: Scalar>(&self, positions: Positions<f64>) -> Result<SphereMap<T>, SphereError> {
        self.map(self.rounded(positions))
    }

    /// Centres if requested, and rounds to the scalar type `T`.
    fn rounded<T: Scalar>(&self, mut positions: Positions<f64>) -> Positions<T> {
        if self.options.centering == Centering::SourceAreas {
            self.center(&mut positions);
        }
        positions.map(|p| p.map(T::of_f64))
    }

    /// The map of the robust iteration, repaired where it is invalid.
    fn cured<T: Scalar>(&mut self, positions: Positions<f64>) -> Result<SphereMap<T>, SphereError> {
        let mut rounded: Positions<T> = self.rounded(positions);
        let flipped = match self.map(rounded.clone()) {
            Ok(map) => return Ok(map),
            Err(SphereError::Flipped { count, .. }) => count,
            // Upright triangles around a vertex can wind twice, which a patch cannot repair.
            Err(error) if error.is_no_map() => return self.embed(FALLBACK_BALANCE),
            Err(error) => return Err(error),
        };
        self.report.flips.push(flipped);
        if flipped <= MAX_UNTANGLED {
            self.report.stages.push(Stage::Untangling);
            let left = untangle(self.mesh, self.source, &mut rounded);
            self.report.flips.push(left);
            match self.map(rounded) {
                Err(error) if error.is_no_map() => {}
                outcome => return outcome,
            }
        }
        self.embed(FALLBACK_BALANCE)
    }

    /// Embeds the whole mesh anew, starting from a tetrahedron, which is always possible. Centres
    /// the result unless rounding would flip a triangle.
    fn embed<T: Scalar>(&mut self, balance: f64) -> Result<SphereMap<T>, SphereError> {
        self.report.stages.push(Stage::Hierarchy);
        let embedded: Positions<T> = embed(self.mesh, self.source, balance)?;
        self.report.flips.push(0);
        let double = embedded.map(|p| Point3::from(normalized(p.coords.map(T::as_f64))));
        match self.checked(double) {
            Ok(map) => Ok(map),
            Err(error) if error.is_no_map() => self.map(embedded),
            Err(error) => Err(error),
        }
    }

    /// Möbius-centres by the source areas.
    fn center(&self, positions: &mut Positions<f64>) {
        let surface = Surface::assume_checked(self.mesh, self.source);
        let areas = surface.one_ring_areas();
        let total: f64 = areas.values().sum();
        let weights: Vec<f64> = areas.values().map(|a| a / total).collect();
        let mut u: Vec<Vector3<f64>> = positions.values().map(|p| p.coords).collect();
        moebius::center(&mut u, &weights);
        for (p, u) in positions.values_mut().zip(u) {
            *p = Point3::from(normalized(u));
        }
    }
}
