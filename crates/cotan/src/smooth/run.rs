//! One-call function for smoothing.

use std::ops::ControlFlow;

use cotan_flow::FlowError;
use cotan_geometry::{Positions, Scalar, Surface};

use super::anchored::held;
use super::decide::Decision;
use super::mask::Mask;
use super::methods::Run;
use super::noise::NoiseEstimate;
use super::options::{NewFolds, SmoothOptions, Smoother};
use super::preserve::Correction;
use super::unfold::without_new_folds;
use crate::error::Error;
use crate::handles::Handles;

/// A smoothed mesh, with details of the computation.
#[derive(Clone, PartialEq, Debug)]
pub struct Smoothed<T: Scalar> {
    /// The new positions, in the units of the input.
    pub positions: Positions<T>,
    /// The method that was used.
    pub method: Smoother,
    /// The reason for this method, if it was chosen automatically.
    pub reason: Option<String>,
    /// The number of iterations performed.
    pub iterations: usize,
    /// μ of the anchors, for methods with anchors.
    pub anchor: Option<f64>,
    /// The number of vertices kept in place because faces around them would have flipped. The
    /// methods for comparison (Taubin, implicit, the paper's) never keep any.
    pub kept_vertices: usize,
    /// The estimated noise in mean edge lengths, for methods that use it.
    pub noise: Option<NoiseEstimate>,
}

/// Smooths a mesh without shrinking it.
///
/// **Shapes**: one position per vertex. The mesh is a triangle mesh, with or without boundary, of
/// any genus and with any number of components. `handles` may hold or move additional vertices
/// and may be empty.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{NormalError, SmoothOptions, smooth, with_normal_noise};
///
/// let clean = cotan::shapes::torus::<f64>(1.0, 0.4, 60, 30);
/// let noisy = with_normal_noise(&clean.surface(), 0.02, 1);
/// let options = SmoothOptions::default();
/// let smoothed = smooth(clean.surface().with_positions(&noisy), &Handles::new(), &options)?;
///
/// let surface = clean.surface();
/// let error = |x: &Positions<f64>| {
///     NormalError::measure(&surface, &surface.with_positions(x)).mean
/// };
/// assert!(error(&smoothed.positions) < 0.3 * error(&noisy));
/// # Ok::<(), cotan::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for a mesh that is not a valid surface, handles that do not exist or contradict each
/// other, settings out of range, and a volume or area that cannot be preserved within the
/// displacement bound.
///
/// **Source**: paper, section 4.2. The paper pins one vertex, which lets the volume drift
/// without bound; here every vertex is anchored weakly.
pub fn smooth<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    options: &SmoothOptions,
) -> Result<Smoothed<T>, Error> {
    let observer = |_| ControlFlow::Continue(());
    smooth_observed(surface, handles, options, &observer)
}

/// Like [`smooth`], with an observer that receives the index of each completed iteration and may
/// stop the job.
///
/// # Errors
/// Same as [`smooth`], and [`Error::Cancelled`] if the observer stopped it.
pub fn smooth_observed<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    options: &SmoothOptions,
    observer: &(dyn Fn(usize) -> ControlFlow<()> + Sync),
) -> Result<Smoothed<T>, Error> {
    smooth_part(surface.into(), handles, None, options, observer)
}

/// Like [`smooth_observed`], for a part of the mesh. Noise is estimated, and the method chosen,
/// for the whole mesh.
///
/// # Errors
/// Same as [`smooth_observed`], and [`Error::FieldLength`] for a mask of another length.
pub fn smooth_masked<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    mask: &Mask,
    options: &SmoothOptions,
    observer: &(dyn Fn(usize) -> ControlFlow<()> + Sync),
) -> Result<Smoothed<T>, Error> {
    smooth_part(surface.into(), handles, Some(mask), options, observer)
}

fn smooth_part<T: Scalar>(
    surface: Surface<'_, T>,
    handles: &Handles<T>,
    mask: Option<&Mask>,
    options: &SmoothOptions,
    observer: &(dyn Fn(usize) -> ControlFlow<()> + Sync),
) -> Result<Smoothed<T>, Error> {
    let (mesh, positions) = (surface.mesh(), surface.positions());
    check(options)?;
    let stays = held(mesh, positions, options.boundary, handles)?;
    let mut held = stays.clone();
    if let Some(mask) = mask {
        mask.check(mesh.num_vertices())?;
        mask.hold(&mut held);
    }
    let mask = mask.map(|mask| mask.shared(mesh));
    let mask = mask.as_deref();
    let surface = Surface::new(mesh, positions)?;
    let run = Run {
        surface,
        handles,
        options,
        observer,
        held: stays,
    };
    let (method, decision) = match options.method.smoother() {
        Some(method) => (method, None),
        None => {
            let decision = Decision::for_surface(&surface);
            (decision.method, Some(decision))
        }
    };
    let noise = decision.as_ref().map(|d| d.noise);
    let is_exact = decision.as_ref().is_some_and(Decision::is_exact);
    let mut smoothed = if is_exact && !moves_any(handles, &surface)? {
        run.without_iterations(method, noise)
    } else {
        run.by(method, noise)?
    };
    smoothed.reason = decision.map(|d| d.reason);
    if smoothed.iterations > 0 {
        if let Some(mask) = mask {
            smoothed.positions = mask.blend(positions, &smoothed.positions);
        }
        let correct = |smoothed: &Positions<T>, held: &[bool]| {
            let correction = Correction {
                mesh,
                original: positions,
                held,
                preserve: options.preserve,
                bound: options.max_displacement,
                mask,
            };
            correction.apply(smoothed)
        };
        if options.folds == NewFolds::Prevent && !is_for_comparison(method) {
            (smoothed.positions, smoothed.kept_vertices) =
                without_new_folds(&surface, smoothed.positions, &held, correct)?;
        } else {
            smoothed.positions = correct(&smoothed.positions, &held)?;
        }
    }
    Ok(smoothed)
}

/// True if a handle asks for another position.
fn moves_any<T: Scalar>(handles: &Handles<T>, surface: &Surface<'_, T>) -> Result<bool, Error> {
    let positions = surface.positions();
    let targets = handles.resolve(surface.mesh(), positions)?;
    Ok(targets
        .iter()
        .any(|(h, target)| *target != positions[h.vertex]))
}

fn is_for_comparison(method: Smoother) -> bool {
    matches!(
        method,
        Smoother::Taubin | Smoother::Implicit | Smoother::Paper
    )
}

fn check(options: &SmoothOptions) -> Result<(), Error> {
    if !(options.step > 0.0 && options.step <= 1.0) {
        return Err(refuse("step", "above 0 and at most 1", options.step));
    }
    match options.anchor {
        Some(anchor) if !(anchor > 0.0 && anchor <= 1e6) => {
            Err(refuse("anchor", "above 0 and at most 1e6", anchor))
        }
        _ => check_bound(options.max_displacement),
    }
}

/// Refuses a displacement bound that is not positive.
pub(crate) fn check_bound(bound: Option<f64>) -> Result<(), Error> {
    match bound {
        Some(bound) if !(bound > 0.0 && bound.is_finite()) => {
            Err(refuse("largest displacement", "above 0", bound))
        }
        _ => Ok(()),
    }
}

/// The error for a setting out of range.
pub(crate) fn refuse(setting: &'static str, range: &'static str, value: f64) -> Error {
    Error::Flow(FlowError::Setting {
        setting,
        range,
        value,
    })
}

#[cfg(test)]
mod tests {
    use cotan_geometry::Mesh;
    use cotan_geometry::shapes::{bar, bumpy_plane, icosphere, torus};
    use cotan_halfedge::HalfedgeMesh;
    use cotan_halfedge::VertexId;
    use nalgebra::{Point3, Rotation3, Vector3};

    use super::*;
    use crate::smooth::SmoothMethod;
    use crate::smooth::{Boundary, Displacement, NormalError, Preserve, with_normal_noise};

    fn noisy(shape: &Mesh<f64>) -> Positions<f64> {
        with_normal_noise(&shape.surface(), 0.02, 3)
    }

    fn by(method: SmoothMethod) -> SmoothOptions {
        SmoothOptions {
            method,
            ..SmoothOptions::default()
        }
    }

    fn run(shape: &Mesh<f64>, x: &Positions<f64>, options: &SmoothOptions) -> Positions<f64> {
        smooth(shape.surface().with_positions(x), &Handles::new(), options)
            .unwrap()
            .positions
    }

    fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
        let pairs = a.values().zip(b.values());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn a_sphere_stays_a_sphere() {
        for level in [4, 5] {
            let shape = icosphere::<f64>(level);
            let x = run(&shape, shape.positions(), &SmoothOptions::default());
            let off = x.values().map(|p| (p.coords.norm() - 1.0).abs());
            let off = off.fold(0.0, f64::max);
            assert!(off < 1e-6, "{level}: {off:e}");
        }
    }

    #[test]
    fn a_plane_stays_a_plane() {
        let shape = bumpy_plane::<f64>([2.0, 1.0], [20, 10], 0.0);
        for method in SmoothMethod::ALL {
            let x = run(&shape, shape.positions(), &by(*method));
            assert!(x.values().all(|p| p.z.abs() < 1e-12), "{}", method.name());
        }
    }

    #[test]
    fn no_iteration_changes_nothing() {
        let shape = torus::<f64>(1.0, 0.4, 20, 12);
        for method in SmoothMethod::ALL {
            let options = SmoothOptions {
                iterations: Some(0),
                preserve: Preserve::Volume,
                ..by(*method)
            };
            assert_eq!(&run(&shape, shape.positions(), &options), shape.positions());
        }
    }

    #[test]
    fn turning_scaling_and_moving_commute_with_smoothing() {
        let shape = torus::<f64>(1.0, 0.4, 30, 16);
        let x = noisy(&shape);
        let turn = Rotation3::new(Vector3::new(0.3, -1.1, 0.7));
        let moved = |p: &Point3<f64>| turn * p * 3.5 + Vector3::new(5.0, -2.0, 1.0);
        for method in SmoothMethod::ALL {
            if *method == SmoothMethod::Paper {
                // Not a fixed-point iteration that converges: rounding errors grow in it.
                continue;
            }
            let after = run(&shape, &x, &by(*method)).map(moved);
            let before = run(&shape, &x.map(moved), &by(*method));
            let off = farthest(&after, &before);
            assert!(off < 1e-7, "{}: {off:e}", method.name());
        }
    }

    #[test]
    fn renumbering_commutes_with_smoothing() {
        let shape = torus::<f64>(1.0, 0.4, 24, 12);
        let x = noisy(&shape);
        let n = x.len();
        let number = |i: usize| (i * 7 + 3) % n;
        assert_ne!(n % 7, 0, "a permutation");
        let faces: Vec<[u32; 3]> = shape
            .connectivity()
            .faces()
            .map(|f| {
                shape
                    .connectivity()
                    .triangle(f)
                    .map(|v| number(v.index()) as u32)
            })
            .collect();
        let mesh = HalfedgeMesh::from_faces(n, &faces).unwrap();
        let mut y = x.clone();
        for (v, p) in x.iter() {
            y[VertexId::new(number(v.index()))] = *p;
        }
        for method in [
            SmoothMethod::Anchored,
            SmoothMethod::Curvature,
            SmoothMethod::Feature,
            SmoothMethod::FeatureEdges,
        ] {
            let options = by(method);
            let after = run(&shape, &x, &options);
            let other = smooth(
                Surface::assume_checked(&mesh, &y),
                &Handles::new(),
                &options,
            )
            .unwrap();
            let far = after
                .iter()
                .map(|(v, p)| (p - other.positions[VertexId::new(number(v.index()))]).norm())
                .fold(0.0, f64::max);
            assert!(far < 1e-9, "{} {far:e}", method.name());
        }
    }

    #[test]
    fn noise_goes_and_volume_stays() {
        let shape = torus::<f64>(1.0, 0.4, 60, 30);
        let x = noisy(&shape);
        let rest = shape.surface();
        let error = |x: &Positions<f64>| NormalError::measure(&rest, &rest.with_positions(x)).mean;
        for method in [SmoothMethod::Curvature, SmoothMethod::Anchored] {
            let options = SmoothOptions {
                preserve: Preserve::Volume,
                ..by(method)
            };
            let smoothed = run(&shape, &x, &options);
            assert!(error(&smoothed) < 0.4 * error(&x), "{}", method.name());
            let [before, after] = [&x, &smoothed].map(|x| rest.with_positions(x).volume());
            assert!((after / before - 1.0).abs() < 1e-9, "{}", method.name());
        }
    }

    #[test]
    fn creases_are_kept() {
        let shape = bar::<f64>([2.0, 1.0, 1.0], [40, 20, 20]);
        let x = with_normal_noise(&shape.surface(), 0.01, 5);
        let smoothed = smooth(
            shape.surface().with_positions(&x),
            &Handles::new(),
            &SmoothOptions::default(),
        )
        .unwrap();
        assert_eq!(smoothed.method, Smoother::Feature);
        let rest = shape.surface();
        let error = |x: &Positions<f64>| NormalError::measure(&rest, &rest.with_positions(x)).mean;
        assert!(error(&x) > 9.0);
        assert!(
            error(&smoothed.positions) < 1.0,
            "{}",
            error(&smoothed.positions)
        );
    }

    #[test]
    fn no_vertex_passes_the_bound_and_the_volume_is_exact_all_the_same() {
        let shape = icosphere::<f64>(3);
        let x = noisy(&shape);
        let options = SmoothOptions {
            max_displacement: Some(0.015),
            preserve: Preserve::Volume,
            ..by(SmoothMethod::Anchored)
        };
        let smoothed = run(&shape, &x, &options);
        assert!(farthest(&smoothed, &x) <= 0.015 * (1.0 + 1e-12));
        let rest = shape.surface();
        let [before, after] = [&x, &smoothed].map(|x| rest.with_positions(x).volume());
        assert!((after / before - 1.0).abs() < 1e-9);
    }

    #[test]
    fn area_is_kept_where_asked() {
        let shape = icosphere::<f64>(3);
        let options = SmoothOptions {
            preserve: Preserve::Area,
            ..by(SmoothMethod::Taubin)
        };
        let smoothed = run(&shape, shape.positions(), &options);
        let area = |x: &Positions<f64>| shape.surface().with_positions(x).area();
        assert!((area(&smoothed) / area(shape.positions()) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn rims_stay_where_they_are_or_follow() {
        let shape = bumpy_plane::<f64>([2.0, 2.0], [30, 30], 0.1);
        let x = noisy(&shape);
        let rim = |x: &Positions<f64>| -> f64 {
            let surface = shape.surface();
            let surface = surface.with_positions(x);
            let mesh = shape.connectivity();
            let side = |h: &_| mesh.is_boundary_halfedge(*h);
            mesh.halfedges()
                .filter(side)
                .map(|h| surface.halfedge_vector(h).norm())
                .sum()
        };
        let fixed = run(&shape, &x, &by(SmoothMethod::Curvature));
        assert_eq!(rim(&fixed), rim(&x));
        let options = SmoothOptions {
            boundary: Boundary::Free,
            ..by(SmoothMethod::Curvature)
        };
        let free = run(&shape, &x, &options);
        assert!((rim(&free) / rim(&x) - 1.0).abs() < 0.05);
    }

    #[test]
    fn handles_are_met() {
        let shape = icosphere::<f64>(3);
        let top = VertexId::new(0);
        let goal = shape.positions()[top] * 1.3;
        let handles = Handles::new().move_to(top, goal);
        let smoothed = smooth(shape.surface(), &handles, &by(SmoothMethod::Anchored)).unwrap();
        assert_eq!(smoothed.positions[top], goal);
    }

    #[test]
    fn single_precision_does_the_same_within_its_digits() {
        let shape = torus::<f64>(1.0, 0.4, 40, 20);
        let x = noisy(&shape);
        let single = x.map(|p| p.cast::<f32>());
        let options = by(SmoothMethod::Curvature);
        let double = run(&shape, &x, &options);
        let result = smooth(
            Surface::assume_checked(shape.connectivity(), &single),
            &Handles::new(),
            &options,
        )
        .unwrap();
        let result = result.positions.map(|p| p.cast::<f64>());
        assert!(farthest(&result, &double) < 1e-3);
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let shape = icosphere::<f64>(1);
        for options in [
            SmoothOptions {
                step: 0.0,
                ..SmoothOptions::default()
            },
            SmoothOptions {
                anchor: Some(f64::NAN),
                ..SmoothOptions::default()
            },
            SmoothOptions {
                max_displacement: Some(-1.0),
                ..SmoothOptions::default()
            },
        ] {
            assert!(smooth(shape.surface(), &Handles::new(), &options).is_err());
        }
    }

    #[test]
    fn a_displacement_is_measured_by_its_ends() {
        let shape = icosphere::<f64>(1);
        let far = shape.positions().map(|p| p + Vector3::x() * 2.0);
        let d = Displacement::measure(&shape.surface(), &shape.surface().with_positions(&far));
        assert!((d.rms - 2.0).abs() < 1e-12 && (d.max - 2.0).abs() < 1e-12);
        assert!(shape.surface().bounding_box().longest_side() > 1.0);
    }
}
