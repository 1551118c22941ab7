//! Smoothing in one call.

use cotan_flow::{FlowError, KeepMagnitude};
use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::HalfedgeMesh;

use super::anchored::{Anchored, InteriorCotangent, InteriorUmbrella, held};
use super::curvature::{AlongCurvature, Direction, Order, SmoothedCurvature};
use super::decide::Decision;
use super::feature::FeaturePreserving;
use super::filtered_normals::FilteredNormals;
use super::implicit::ImplicitFlow;
use super::noise::NoiseEstimate;
use super::normal_filter::NormalFilter;
use super::options::{SmoothMethod, SmoothOptions};
use super::preserve::Correction;
use super::taubin::Taubin;
use crate::error::Error;
use crate::handles::Handles;

/// A smoothed mesh, and how it came about.
#[derive(Clone, PartialEq, Debug)]
pub struct Smoothed<T: Scalar> {
    /// The new positions, in the units of the input.
    pub positions: Positions<T>,
    /// The method; never [`SmoothMethod::Auto`].
    pub method: SmoothMethod,
    /// Why this method, if it was not asked for by name.
    pub reason: Option<String>,
    /// How many iterations were made.
    pub iterations: usize,
    /// μ of the anchors, for methods that have them.
    pub anchor: Option<f64>,
    /// The noise that was estimated, in mean edge lengths, for methods that ask.
    pub noise: Option<NoiseEstimate>,
}

/// Smooths a mesh without shrinking it.
///
/// **Shapes**: one position a vertex. The mesh is a triangle mesh, with or without boundary, of any
/// genus and number of components. `handles` may hold further vertices, or move some; there may be
/// none.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{NormalError, SmoothOptions, smooth, with_normal_noise};
///
/// let clean = cotan::shapes::torus::<f64>(1.0, 0.4, 60, 30);
/// let noisy = with_normal_noise(&clean.surface(), 0.02, 1);
/// let smoothed = smooth(&clean.mesh, &noisy, &Handles::new(), &SmoothOptions::default())?;
///
/// let error = |x| NormalError::measure(&clean.surface(), &clean.surface().with_positions(x)).mean;
/// assert!(error(&smoothed.positions) < 0.3 * error(&noisy));
/// # Ok::<(), cotan::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for a mesh that is no surface, handles that do not exist or contradict each other,
/// settings out of range, and a volume or area that cannot be kept within the displacement bound.
///
/// **Source**: paper, section 4.2; what is different and why is in `docs/decisions`.
pub fn smooth<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<T>,
    handles: &Handles<T>,
    options: &SmoothOptions,
) -> Result<Smoothed<T>, Error> {
    check(options)?;
    let surface = Surface::new(mesh, positions)?;
    let run = Run {
        surface,
        handles,
        options,
        held: held(mesh, positions, options.boundary, handles)?,
    };
    let decision = match options.method {
        SmoothMethod::Auto => Some(Decision::for_surface(&surface)),
        _ => None,
    };
    let method = decision.as_ref().map_or(options.method, |d| d.method);
    let noise = decision.as_ref().map(|d| d.noise);
    let mut smoothed = run.by(method, noise)?;
    smoothed.reason = decision.map(|d| d.reason);
    if smoothed.iterations > 0 {
        let correction = Correction {
            mesh,
            original: positions,
            held: &run.held,
            preserve: options.preserve,
            bound: options.max_displacement,
        };
        smoothed.positions = correction.apply(&smoothed.positions)?;
    }
    Ok(smoothed)
}

fn check(options: &SmoothOptions) -> Result<(), Error> {
    let refuse = |setting, range, value| {
        Err(Error::Flow(FlowError::Setting {
            setting,
            range,
            value,
        }))
    };
    if !(options.step > 0.0 && options.step <= 1.0) {
        return refuse("step", "above 0 and at most 1", options.step);
    }
    match (options.anchor, options.max_displacement) {
        (Some(anchor), _) if !(anchor > 0.0 && anchor <= 1e6) => {
            refuse("anchor", "above 0 and at most 1e6", anchor)
        }
        (_, Some(bound)) if !(bound > 0.0 && bound.is_finite()) => {
            refuse("largest displacement", "above 0", bound)
        }
        _ => Ok(()),
    }
}

/// One job.
struct Run<'a, T: Scalar> {
    surface: Surface<'a, T>,
    handles: &'a Handles<T>,
    options: &'a SmoothOptions,
    held: Vec<bool>,
}

impl<T: Scalar> Run<'_, T> {
    fn by(&self, method: SmoothMethod, noise: Option<NoiseEstimate>) -> Result<Smoothed<T>, Error> {
        let iterations = self
            .options
            .iterations
            .unwrap_or_else(|| method.default_iterations());
        let mut smoothed = Smoothed {
            positions: self.surface.positions().clone(),
            method,
            reason: None,
            iterations,
            anchor: None,
            noise,
        };
        if iterations == 0 {
            return Ok(smoothed);
        }
        let (mesh, positions) = (self.surface.mesh(), self.surface.positions());
        match method {
            SmoothMethod::Taubin => {
                smoothed.positions = Taubin::default().run(mesh, positions, iterations, &self.held);
            }
            SmoothMethod::Implicit => {
                let flow = ImplicitFlow {
                    time: self.options.step * ImplicitFlow::default().time,
                };
                smoothed.positions = flow.run(mesh, positions, iterations, &self.held)?;
            }
            SmoothMethod::Paper => self.paper(&mut smoothed)?,
            SmoothMethod::Anchored => self.anchored(&mut smoothed)?,
            SmoothMethod::Feature => self.feature(&mut smoothed)?,
            SmoothMethod::FeatureEdges => self.feature_edges(&mut smoothed)?,
            SmoothMethod::Curvature | SmoothMethod::Auto => self.curvature(&mut smoothed)?,
        }
        Ok(smoothed)
    }

    /// The anchored system on these positions, with the anchor asked for or `anchor`, which is noted.
    fn system(&self, anchor: f64, smoothed: &mut Smoothed<T>) -> Anchored<'_, T> {
        smoothed.anchor = Some(self.options.anchor.unwrap_or(anchor));
        Anchored {
            mesh: self.surface.mesh(),
            rest: self.surface.positions(),
            data: self.surface.positions(),
            anchor: smoothed.anchor,
            boundary: self.options.boundary,
            handles: self.handles,
            iterations: smoothed.iterations,
        }
    }

    fn paper(&self, smoothed: &mut Smoothed<T>) -> Result<(), Error> {
        let mut system = self.system(1.0, smoothed);
        system.anchor = None;
        smoothed.anchor = None;
        smoothed.positions = self.first_order(&system)?;
        Ok(())
    }

    fn anchored(&self, smoothed: &mut Smoothed<T>) -> Result<(), Error> {
        smoothed.positions = self.first_order(&self.system(1.0, smoothed))?;
        Ok(())
    }

    fn first_order(&self, system: &Anchored<'_, T>) -> Result<Positions<T>, Error> {
        let direction = Direction::Whole;
        let updater = SmoothedCurvature {
            step: self.options.step,
            order: Order::First,
            direction,
        };
        let scheme = InteriorCotangent::of(self.surface.mesh());
        system.run(&scheme, updater, AlongCurvature { direction })
    }

    /// The start is smoothed lightly, so that the normals of the first step are not those of the
    /// noise; the anchors pull to the positions as they were.
    fn curvature(&self, smoothed: &mut Smoothed<T>) -> Result<(), Error> {
        let (mesh, positions) = (self.surface.mesh(), self.surface.positions());
        let noise = self.noise(smoothed);
        let pilot = Taubin::default().run(mesh, positions, PILOT_STEPS, &self.held);
        let mut system = self.system(anchor_for(&noise), smoothed);
        system.rest = &pilot;
        let updater = SmoothedCurvature {
            step: self.options.step,
            ..SmoothedCurvature::default()
        };
        smoothed.positions = system.run(&InteriorUmbrella, updater, AlongCurvature::default())?;
        Ok(())
    }

    fn feature(&self, smoothed: &mut Smoothed<T>) -> Result<(), Error> {
        let filter = NormalFilter::for_noise(self.noise(smoothed).noise);
        let scheme = InteriorCotangent::of(self.surface.mesh());
        let system = self.system(FEATURE_ANCHOR, smoothed);
        smoothed.positions = system.run(&scheme, KeepMagnitude, FilteredNormals::new(filter))?;
        Ok(())
    }

    fn feature_edges(&self, smoothed: &mut Smoothed<T>) -> Result<(), Error> {
        let scheme = InteriorCotangent::of(self.surface.mesh());
        let system = self.system(1.0, smoothed);
        smoothed.positions = system.run(&scheme, KeepMagnitude, FeaturePreserving::default())?;
        Ok(())
    }

    fn noise(&self, smoothed: &mut Smoothed<T>) -> NoiseEstimate {
        *smoothed
            .noise
            .get_or_insert_with(|| NoiseEstimate::of(&self.surface))
    }
}

/// Double steps of the pilot.
const PILOT_STEPS: usize = 5;

/// μ of the feature method: a third of the reference's, as the wanted normals are trusted.
const FEATURE_ANCHOR: f64 = 0.3;

/// μ = 6 detail / noise: the most likely surface if both are Gaussian, up to the factor, which was
/// measured.
fn anchor_for(noise: &NoiseEstimate) -> f64 {
    let ratio = 6.0 * noise.detail / noise.noise;
    // Not a number for a plane, where any anchor does.
    if ratio.is_nan() {
        FIRMEST
    } else {
        ratio.clamp(LOOSEST, FIRMEST)
    }
}

const LOOSEST: f64 = 0.3;
const FIRMEST: f64 = 100.0;
