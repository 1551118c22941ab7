//! Jobs on a thread, and their results.

use cotan::halfedge::VertexId;

use super::Workspace;
use crate::command::{Command, Job};
use crate::effect::{Effect, Notice};
use crate::jobs::{Morph, Start};
use crate::mirror::{Images, Mirror, images_of};
use crate::model::Model;
use crate::refused::Refused;
use crate::scene::Scene;
use crate::shape::Shape;
use crate::task::{Control, Task, TaskError};

/// The result of a job.
pub(super) enum Outcome {
    /// A model was read, or not.
    Opened(super::files::Opened),
    /// A shape was made.
    Reshaped(Reshaped),
    /// The shape was mapped to the sphere.
    Mapped(Box<Morph>),
    /// A plane of symmetry was found, or not.
    Mirrored(Option<(Mirror, Images)>),
}

/// A shape that a job has made.
pub(super) struct Reshaped {
    job: Job,
    /// The shape of the scene when the job was started.
    shown: Shape,
    shape: Shape,
    note: Option<String>,
}

impl Workspace {
    pub(super) fn cancel_job(&mut self) {
        if let Some(task) = &self.task {
            task.cancel();
        }
    }

    pub(super) fn start_task(
        &mut self,
        name: &str,
        effects: &mut Vec<Effect>,
        work: impl FnOnce(&Control) -> Result<Outcome, TaskError> + Send + 'static,
    ) {
        self.cancel_job();
        let notify = std::sync::Arc::clone(&self.notify);
        match Task::start(name, move || notify(), work) {
            Ok(task) => self.task = Some(task),
            Err(error) => {
                let problem = format!("cannot start a thread: {error}");
                effects.push(Effect::Told(Notice::Error(problem)));
            }
        }
    }

    /// Starts to smooth or to scale details.
    pub(super) fn start_reshaping(
        &mut self,
        command: Command,
        effects: &mut Vec<Effect>,
    ) -> Result<(), Refused> {
        let model = self.model.as_ref().ok_or(Refused::NoModel)?;
        let settings = model.scene().settings();
        let (name, job) = match command {
            Command::AdjustSmooth { smooth } => match present_job(model) {
                Some(Job::Smooth(_) | Job::SmoothAgain(_)) => {
                    ("Smoothing", Job::SmoothAgain(smooth))
                }
                _ => ("Smoothing", Job::Smooth(smooth)),
            },
            Command::ScaleDetails { factor } => ("Scaling details", Job::Details(factor)),
            _ => ("Smoothing", Job::Smooth(settings.smooth)),
        };
        let mut changed = settings.clone();
        match job {
            Job::Smooth(smooth) | Job::SmoothAgain(smooth) => changed.smooth = smooth,
            Job::Details(factor) => changed.detail = factor,
            Job::Morph(_) | Job::Paint(_) => {}
        }
        if let Some(problem) = changed.problem() {
            return Err(Refused::Number(problem.to_owned()));
        }
        let start = Start::new(model, base_of(model, &job));
        let shown = model.scene().shape.clone();
        self.start_task(name, effects, move |control| {
            let (shape, note) = match job {
                Job::Smooth(smooth) | Job::SmoothAgain(smooth) => start.smooth(smooth, control)?,
                Job::Details(factor) => (start.scale_details(factor, control)?, None),
                Job::Morph(_) | Job::Paint(_) => return Err(TaskError::Cancelled),
            };
            Ok(Outcome::Reshaped(Reshaped {
                job,
                shown,
                shape,
                note,
            }))
        });
        Ok(())
    }

    /// Starts to paint the curvature field.
    pub(super) fn start_painting(
        &mut self,
        stroke: &[VertexId],
        effects: &mut Vec<Effect>,
    ) -> Result<(), Refused> {
        let model = self.model.as_mut().ok_or(Refused::NoModel)?;
        model.find_images();
        let n = model.mesh().num_vertices();
        if let Some(v) = stroke.iter().find(|v| v.index() >= n) {
            return Err(Refused::NoVertex(v.index()));
        }
        if stroke.is_empty() {
            return Ok(());
        }
        let mut stroke = stroke.to_vec();
        if let Some(images) = model.images() {
            stroke.extend(images_of(&stroke, images));
        }
        let brush = model.scene().settings().brush;
        let start = Start::new(model, model.scene());
        let shown = model.scene().shape.clone();
        self.start_task("Painting", effects, move |control| {
            Ok(Outcome::Reshaped(Reshaped {
                job: Job::Paint(brush),
                shown,
                shape: start.paint(&brush, &stroke, control)?,
                note: None,
            }))
        });
        Ok(())
    }

    pub(super) fn start_mapping(&mut self, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let model = self.model.as_ref().ok_or(Refused::NoModel)?;
        let start = Start::new(model, model.scene());
        self.start_task("Mapping to the sphere", effects, move |control| {
            Ok(Outcome::Mapped(Box::new(start.map(control)?)))
        });
        Ok(())
    }

    pub(super) fn start_mirroring(&mut self, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let model = self.model.as_ref().ok_or(Refused::NoModel)?;
        let processing = std::sync::Arc::clone(&model.file().processing);
        let side = model.side();
        self.start_task("Finding the mirror plane", effects, move |_| {
            let surface = processing.surface();
            let found = Mirror::of(&surface);
            let found = found.map(|mirror| (mirror, mirror.images(&surface, side)));
            Ok(Outcome::Mirrored(found))
        });
        Ok(())
    }

    pub(super) fn keep_morph(&mut self, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let Some(morph) = self.morph.take() else {
            return Ok(());
        };
        let (job, shape) = (Job::Morph(morph.share()), morph.shape().clone());
        self.record(&Command::Finish { job, shape }, effects)
    }

    /// Takes the result of the job that has ended.
    pub(super) fn take_result(
        &mut self,
        result: Result<Outcome, TaskError>,
        effects: &mut Vec<Effect>,
    ) {
        match result {
            Err(TaskError::Cancelled) => {}
            Err(error) => effects.push(Effect::Told(Notice::Error(error.to_string()))),
            Ok(Outcome::Opened(opened)) => self.take_opened(opened, effects),
            Ok(Outcome::Reshaped(made)) => {
                let is_current = self.scene().is_some_and(|s| s.shape.is(&made.shown));
                if !is_current {
                    let text = "the shape was changed meanwhile: the job's result is dropped";
                    effects.push(Effect::Mentioned(text.to_owned()));
                    return;
                }
                let (job, shape) = (made.job, made.shape);
                if let Err(refused) = self.record(&Command::Finish { job, shape }, effects) {
                    effects.push(Effect::Told(Notice::Error(refused.to_string())));
                }
                effects.extend(made.note.map(Effect::Mentioned));
            }
            Ok(Outcome::Mirrored(None)) => {
                let text = "the model is not symmetric: there is no mirror plane to be found";
                effects.push(Effect::Mentioned(text.to_owned()));
            }
            Ok(Outcome::Mirrored(Some((mirror, images)))) => {
                if let Some(model) = &mut self.model {
                    model.set_images(mirror, images);
                }
                let mirror = Some(mirror);
                if let Err(refused) = self.record(&Command::SetMirror { mirror }, effects) {
                    effects.push(Effect::Mentioned(refused.to_string()));
                }
            }
            Ok(Outcome::Mapped(morph)) => {
                if self.scene().is_some_and(|s| s.shape.is(morph.source())) {
                    self.morph = Some(*morph);
                } else {
                    let text = "the shape was changed since it was mapped: map it again";
                    effects.push(Effect::Mentioned(text.to_owned()));
                }
            }
        }
    }
}

/// The job that the present step is the result of.
fn present_job(model: &Model) -> Option<Job> {
    match model.history().present().command {
        Some(Command::Finish { job, .. }) => Some(job),
        _ => None,
    }
}

/// The scene that a job starts from: the one before the present step, if the job repeats that.
fn base_of<'m>(model: &'m Model, job: &Job) -> &'m Scene {
    let is_again = match job {
        Job::SmoothAgain(_) => true,
        Job::Details(_) => matches!(present_job(model), Some(Job::Details(_))),
        Job::Smooth(_) | Job::Morph(_) | Job::Paint(_) => false,
    };
    match model.history().before().filter(|_| is_again) {
        Some(step) => &step.scene,
        None => model.scene(),
    }
}
