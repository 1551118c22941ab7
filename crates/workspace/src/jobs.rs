//! The jobs that run on a thread: functions of a scene, with progress and cancellation.

use std::ops::ControlFlow;

use cotan::Handles;
use cotan::geometry::{Positions, Readable, Surface};
use cotan::halfedge::VertexId;
use cotan::smooth::{
    DetailOptions, Mask, ScaledCurvature, edit_detail_masked, edit_detail_observed, smooth_masked,
    smooth_observed,
};
use cotan::sphere::{SphereOptions, SphereQuality, spherical_observed, towards_sphere};

use crate::brush::Brush;
use crate::mask::Restriction;
use crate::model::Model;
use crate::scene::Scene;
use crate::settings::Smooth;
use crate::shape::Shape;
use crate::task::{Control, TaskError};

/// The input of a job: a scene and its model, shared with the thread.
pub(crate) struct Start {
    mesh: std::sync::Arc<cotan_io::ProcessingMesh>,
    scene: Scene,
    side: f64,
}

impl Start {
    pub(crate) fn new(model: &Model, scene: &Scene) -> Self {
        Self {
            mesh: std::sync::Arc::clone(&model.file().processing),
            scene: scene.clone(),
            side: model.side(),
        }
    }

    fn surface(&self) -> Surface<'_, f64> {
        Surface::assume_checked(self.mesh.mesh(), self.scene.shape.positions())
    }

    fn restriction(&self) -> Restriction<'_> {
        self.scene.restriction(self.side)
    }

    /// The fixed vertices as handles.
    fn fixed(&self) -> Handles<f64> {
        match self.restriction().fixed() {
            fixed if fixed.is_empty() => Handles::new(),
            fixed => Handles::new().fix(fixed),
        }
    }

    /// Smooths the shape. Fixed regions stay, and a mask or a selection restricts the rest.
    pub(crate) fn smooth(
        &self,
        smooth: Smooth,
        control: &Control,
    ) -> Result<(Shape, Option<String>), TaskError> {
        let options = smooth.options();
        let of = smooth.num_iterations();
        let observer = |done| control.advance(done, of);
        let (surface, fixed) = (self.surface(), self.fixed());
        let smoothed = match self.restriction().mask(&surface).map_err(refusal)? {
            None => smooth_observed(surface, &fixed, &options, &observer),
            Some(mask) => smooth_masked(surface, &fixed, &mask, &options, &observer),
        };
        let smoothed = smoothed.map_err(refusal)?;
        let method = smoothed.method.name();
        let note = smoothed.reason.map(|reason| format!("{method}: {reason}"));
        Ok((Shape::new(smoothed.positions), note))
    }

    /// Scales the details of the shape, with the same restrictions.
    pub(crate) fn scale_details(&self, factor: f64, control: &Control) -> Result<Shape, TaskError> {
        let options = DetailOptions::default();
        let edit = ScaledCurvature::by(factor);
        let observer = |done| control.advance(done, options.iterations);
        let (surface, fixed) = (self.surface(), self.fixed());
        let edited = match self.restriction().mask(&surface).map_err(refusal)? {
            None => edit_detail_observed(surface, &fixed, &edit, &options, &observer),
            Some(mask) => edit_detail_masked(surface, &fixed, &mask, &edit, &options, &observer),
        };
        Ok(Shape::new(edited.map_err(refusal)?.positions))
    }

    /// Paints the curvature field along a stroke, with the same restrictions.
    pub(crate) fn paint(
        &self,
        brush: &Brush,
        stroke: &[VertexId],
        control: &Control,
    ) -> Result<Shape, TaskError> {
        let (surface, fixed) = (self.surface(), self.fixed());
        let allowed = self.restriction().mask(&surface).map_err(refusal)?;
        let mask = brush.mask(&surface, stroke, self.side, allowed.as_ref());
        let mask = mask.map_err(refusal)?;
        brush
            .paint(&surface, &fixed, mask, control)
            .map_err(refusal)
    }

    /// Maps the shape to the sphere.
    pub(crate) fn map(&self, control: &Control) -> Result<Morph, TaskError> {
        let options = SphereOptions::default().authalic(self.scene.settings().areas);
        let observer = |step: &cotan::flow::StepReport| {
            control.advance(step.iteration.min(options.iteration_limit), 0)
        };
        let failed = |error: String| TaskError::Failed(error);
        let surface = self.surface();
        let made = spherical_observed(surface, &options, observer);
        let made = made.map_err(|e| failed(e.to_string()))?;
        if control.advance(0, 0) == ControlFlow::Break(()) {
            return Err(TaskError::Cancelled);
        }
        let checked = Surface::new(surface.mesh(), surface.positions());
        let checked = checked.map_err(|e| failed(e.to_string()))?;
        let quality = SphereQuality::measure(&checked, &made.map);
        let report = format!(
            "no flipped triangle; angles off by {:.2}° on average, areas by a factor of {}",
            quality.angle_error_degrees.mean,
            Readable(quality.area_distortion.mean.exp())
        );
        let allowed = self.restriction().mask_with_fixed(&surface);
        let allowed = allowed.map_err(refusal)?;
        let source = self.scene.shape.clone();
        let mut morph = Morph {
            shape: source.clone(),
            source,
            map: made.map.into_positions(),
            allowed,
            share: 0.0,
            report,
        };
        morph.set_share(1.0);
        Ok(morph)
    }
}

/// A map of the shape to the sphere, and a shape between the two.
#[derive(Clone, Debug)]
pub struct Morph {
    source: Shape,
    map: Positions<f64>,
    /// The shares of the vertices in the motion; `None` if all move.
    allowed: Option<Mask>,
    share: f64,
    shape: Shape,
    report: String,
}

impl Morph {
    /// The shape that was mapped.
    pub(crate) fn source(&self) -> &Shape {
        &self.source
    }

    /// The shape between the two.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The place of that shape: 0 is the model, 1 the sphere.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// The quality of the map in words.
    pub fn report(&self) -> &str {
        &self.report
    }

    pub(crate) fn set_share(&mut self, share: f64) {
        let source = self.source.positions();
        self.share = share;
        self.shape = match share > 0.0 {
            false => self.source.clone(),
            true => {
                let moved = towards_sphere(source, &self.map, share);
                let moved = match &self.allowed {
                    Some(mask) => mask.blend(source, &moved),
                    None => moved,
                };
                Shape::new(moved)
            }
        };
    }
}

/// Turns an error of the library into that of a job.
fn refusal(error: cotan::Error) -> TaskError {
    match error {
        cotan::Error::Cancelled => TaskError::Cancelled,
        error => TaskError::Failed(error.to_string()),
    }
}
