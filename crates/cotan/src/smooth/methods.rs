//! The smoothing methods, each with settings adapted to the noise.

use std::ops::ControlFlow;

use cotan_flow::KeepMagnitude;
use cotan_geometry::{Positions, Scalar, Surface};

use super::anchored::{Anchored, Observer};
use super::curvature::{AlongCurvature, Direction, Order, SmoothedCurvature};
use super::feature::FeaturePreserving;
use super::filtered_normals::FilteredNormals;
use super::implicit::ImplicitFlow;
use super::interior::{InteriorCotangent, InteriorRows, InteriorUmbrella};
use super::noise::NoiseEstimate;
use super::normal_filter::NormalFilter;
use super::options::{SmoothOptions, Smoother};
use super::run::Smoothed;
use super::taubin::Taubin;
use crate::error::Error;
use crate::handles::Handles;

/// A smoothing job.
pub(super) struct Run<'a, T: Scalar> {
    pub(super) surface: Surface<'a, T>,
    pub(super) handles: &'a Handles<T>,
    pub(super) options: &'a SmoothOptions,
    pub(super) observer: Observer<'a>,
    pub(super) held: Vec<bool>,
}

impl<T: Scalar> Run<'_, T> {
    /// Smooths with one method. `noise` is the estimate if it is already available.
    pub(super) fn by(
        &self,
        method: Smoother,
        noise: Option<NoiseEstimate>,
    ) -> Result<Smoothed<T>, Error> {
        let iterations = self
            .options
            .iterations
            .unwrap_or_else(|| method.default_iterations());
        let mut smoothed = self.without_iterations(method, noise);
        if iterations == 0 {
            return Ok(smoothed);
        }
        smoothed.iterations = iterations;
        let (mesh, positions) = (self.surface.mesh(), self.surface.positions());
        match method {
            Smoother::Taubin => {
                smoothed.positions = Taubin::default().run(mesh, positions, iterations, &self.held);
                self.observe(iterations)?;
            }
            Smoother::Implicit => {
                let flow = ImplicitFlow {
                    time: self.options.step * ImplicitFlow::default().time,
                };
                let scheme = self.options.scheme.symmetric_scheme();
                let mut x = positions.clone();
                for iteration in 1..=iterations {
                    x = flow.run(mesh, &x, &*scheme, &self.held)?;
                    self.observe(iteration)?;
                }
                smoothed.positions = x;
            }
            Smoother::Paper => self.paper(&mut smoothed)?,
            Smoother::Anchored => self.anchored(&mut smoothed)?,
            Smoother::Feature => self.feature(&mut smoothed)?,
            Smoother::FeatureEdges => self.feature_edges(&mut smoothed)?,
            Smoother::Curvature => self.curvature(&mut smoothed)?,
        }
        Ok(smoothed)
    }

    /// The mesh as it is.
    pub(super) fn without_iterations(
        &self,
        method: Smoother,
        noise: Option<NoiseEstimate>,
    ) -> Smoothed<T> {
        Smoothed {
            positions: self.surface.positions().clone(),
            method,
            reason: None,
            iterations: 0,
            anchor: None,
            kept_vertices: 0,
            noise,
        }
    }

    fn observe(&self, iteration: usize) -> Result<(), Error> {
        match (self.observer)(iteration) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Cancelled),
        }
    }

    /// The anchored system for these positions, with the requested anchor or else `anchor`, which
    /// is recorded in `smoothed`.
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
            max_memory: self.options.max_memory,
            observer: self.observer,
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
        let scheme = self.options.scheme.symmetric_scheme();
        let scheme = InteriorRows::of_scheme(scheme, self.surface.mesh());
        system.run(system.rest(scheme)?, updater, AlongCurvature { direction })
    }

    /// If there is noise, the start is smoothed lightly, so that the normals of the first step
    /// are not dominated by it. The anchors pull to the original positions.
    fn curvature(&self, smoothed: &mut Smoothed<T>) -> Result<(), Error> {
        let (mesh, positions) = (self.surface.mesh(), self.surface.positions());
        let noise = self.noise(smoothed);
        let steps = if noise.noise > PILOT_FROM {
            PILOT_STEPS
        } else {
            0
        };
        let pilot = Taubin::default().run(mesh, positions, steps, &self.held);
        let mut system = self.system(anchor_for(&noise), smoothed);
        system.rest = &pilot;
        let updater = SmoothedCurvature {
            step: self.options.step,
            ..SmoothedCurvature::default()
        };
        let rest = system.rest(InteriorUmbrella)?;
        smoothed.positions = system.run(rest, updater, AlongCurvature::default())?;
        Ok(())
    }

    fn feature(&self, smoothed: &mut Smoothed<T>) -> Result<(), Error> {
        let filter = NormalFilter::for_noise(self.noise(smoothed).noise);
        let scheme = InteriorCotangent::of_faces(self.surface.mesh());
        let system = self.system(FEATURE_ANCHOR, smoothed);
        let rest = system.rest(scheme)?;
        smoothed.positions = system.run(rest, KeepMagnitude, FilteredNormals::new(filter))?;
        Ok(())
    }

    fn feature_edges(&self, smoothed: &mut Smoothed<T>) -> Result<(), Error> {
        let scheme = InteriorCotangent::of(self.surface.mesh());
        let system = self.system(1.0, smoothed);
        let rest = system.rest(scheme)?;
        smoothed.positions = system.run(rest, KeepMagnitude, FeaturePreserving::default())?;
        Ok(())
    }

    fn noise(&self, smoothed: &mut Smoothed<T>) -> NoiseEstimate {
        *smoothed
            .noise
            .get_or_insert_with(|| NoiseEstimate::of(&self.surface))
    }
}

/// The number of double steps of the pilot smoothing.
const PILOT_STEPS: usize = 5;

/// The noise above which there is a pilot, in mean edge lengths. Below it, normals are wrong by
/// only a few degrees.
const PILOT_FROM: f64 = 0.05;

/// μ of the feature method: a third of the reference value, because the target normals are
/// reliable.
const FEATURE_ANCHOR: f64 = 0.3;

/// μ = 5.5 detail / noise: the most likely surface if both are Gaussian, up to the factor, which
/// was determined by measurement.
fn anchor_for(noise: &NoiseEstimate) -> f64 {
    let ratio = ANCHOR_FACTOR * noise.detail / noise.noise;
    // NaN for a plane, for which any anchor works.
    if ratio.is_nan() {
        FIRMEST
    } else {
        ratio.clamp(LOOSEST, FIRMEST)
    }
}

const ANCHOR_FACTOR: f64 = 5.5;
const LOOSEST: f64 = 0.3;
const FIRMEST: f64 = 100.0;
