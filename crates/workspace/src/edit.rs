//! The scene that a command makes of another.

mod handles;
mod masks;

use cotan::halfedge::VertexId;

use crate::command::{Command, Job, Record};
use crate::handle::HandleGroup;
use crate::mask::NamedMask;
use crate::mirror::images_of;
use crate::model::Model;
use crate::refused::{After, Refused};
use crate::scene::{Props, Scene};
use crate::selection::{Combine, combined, grown, inverted, linked, shrunk, within};
use crate::settings::Settings;
use crate::shape::Shape;

/// The scene that a command has made.
pub(crate) struct Edited {
    pub(crate) scene: Scene,
    pub(crate) label: String,
    pub(crate) after: After,
    /// True if the step takes the place of the present one, because it does the same job again.
    pub(crate) is_again: bool,
}

/// The scene that a recorded command makes, or `None` if it changes nothing.
pub(crate) fn edited(model: &Model, command: &Command) -> Result<Option<Edited>, Refused> {
    let before = model.scene();
    let edit = Edit { model, before };
    let (mut scene, label, after) = match command.record() {
        Record::Selection => edit.selection(command)?,
        Record::InPlace => edit.in_place(command)?,
        Record::Step => edit.step(command)?,
        Record::Travel | Record::Nothing => return Err(Refused::NotRecorded),
    };
    let is_again = edit.is_again(command);
    if model.mesh().has_copies() {
        scene = scene.with(|props| *props = std::mem::take(props).with_copies(model.mesh()));
    }
    let has_changed = !scene.shape.is(&before.shape)
        || !scene.rest.is(&before.rest)
        || scene.is_settled != before.is_settled
        || scene.props != before.props;
    let is_over = command.record() != Record::InPlace && !edit.scales_details(command);
    if is_over && scene.settings().detail != 1.0 {
        // The next edit of details starts from here.
        scene = scene.with(|props| props.settings.detail = 1.0);
    }
    Ok(has_changed.then_some(Edited {
        scene,
        label,
        after,
        is_again,
    }))
}

type Made = (Scene, String, After);

struct Edit<'a> {
    model: &'a Model,
    before: &'a Scene,
}

impl Edit<'_> {
    fn selection(&self, command: &Command) -> Result<Made, Refused> {
        let (mesh, old) = (self.model.mesh(), self.before.selection());
        let selected = match command {
            Command::Activate { handle } => {
                if let Some(handle) = handle {
                    self.handle(*handle)?;
                }
                let scene = self.before.with(|props| props.activate(*handle));
                return Ok((scene, "Choose a handle".to_owned(), After::Nothing));
            }
            Command::ActivateToo { handle } => {
                self.handle(*handle)?;
                let scene = self.before.with(|props| props.activate_too(*handle));
                return Ok((scene, "Choose handles".to_owned(), After::Nothing));
            }
            Command::Select { vertices, how } => {
                combined(old, &self.mirrored(self.inside(vertices)?), *how)
            }
            Command::MirrorSelection => match self.model.images() {
                Some(images) => images_of(old, images),
                None => return Err(Refused::NoMirror),
            },
            Command::SelectAll => mesh.vertices().collect(),
            Command::InvertSelection => inverted(mesh, old),
            Command::GrowSelection => grown(mesh, old),
            Command::ShrinkSelection => shrunk(mesh, old),
            Command::SelectLinked => linked(mesh, old),
            Command::SelectWithin { distance } => {
                let far = finite(*distance, "the distance")?;
                within(&self.model.surface(&self.before.shape), old, far)
            }
            Command::SelectHandle { handle } => self.handle(*handle)?.vertices.clone(),
            Command::SelectMask { mask } => self.mask(*mask)?.vertices.clone(),
            _ => return Err(Refused::NotRecorded),
        };
        let selected = combined(&selected, self.before.hidden(), Combine::Subtract);
        let label = match selected.len() {
            0 => "Select nothing".to_owned(),
            1 => "Select a vertex".to_owned(),
            n => format!("Select {n} vertices"),
        };
        let scene = self.before.with(|props| props.selection = selected);
        Ok((scene, label, After::Nothing))
    }

    /// Changes of the present step.
    fn in_place(&self, command: &Command) -> Result<Made, Refused> {
        if let Command::Arrive { shape, is_settled } = command {
            let mut scene = self.before.clone();
            scene.shape = self.own(shape)?;
            scene.is_settled = *is_settled;
            return Ok((scene, String::new(), After::Nothing));
        }
        match *command {
            Command::SetMirror { mirror } if mirror.is_some_and(|m| !m.is_valid()) => {
                let problem = "the normal of the mirror has no direction".to_owned();
                return Err(Refused::Number(problem));
            }
            Command::SetMirror { mirror } => {
                let scene = self.before.with(|props| props.mirror = mirror);
                return Ok((scene, String::new(), After::Nothing));
            }
            Command::SetPivot { vertex } => {
                self.inside(vertex.as_slice())?;
                let scene = self.before.with(|props| props.pivot = vertex);
                return Ok((scene, String::new(), After::Nothing));
            }
            _ => {}
        }
        let mut settings = self.before.settings().clone();
        match *command {
            Command::SetSmooth { smooth } => settings.smooth = smooth,
            Command::SetAreas { areas } => settings.areas = areas,
            Command::SetBrush { brush } => settings.brush = brush,
            Command::SetBorder { border } => settings.border = border,
            _ => return Err(Refused::NotRecorded),
        }
        let scene = self.set(settings)?;
        Ok((scene, String::new(), After::Nothing))
    }

    fn step(&self, command: &Command) -> Result<Made, Refused> {
        Ok(match command {
            Command::HideSelection | Command::HideOthers | Command::ShowAll => {
                self.visibility(command)?
            }
            Command::MakeMask { .. } | Command::UseMask { .. } | Command::RemoveMask { .. } => {
                self.masks(command)?
            }
            Command::SetFollow { follow } => {
                let mut settings = self.before.settings().clone();
                settings.follow = *follow;
                let mut scene = self.set(settings)?;
                scene.is_settled &= scene.handles().is_empty();
                (scene, "Change how it follows".to_owned(), After::Settle)
            }
            Command::ResetShape => {
                let scene = self.before.on(&self.before.rest);
                (scene, "Back to the rest shape".to_owned(), After::Show)
            }
            Command::Finish { job, shape } => self.finish(*job, &self.own(shape)?)?,
            handles => self.handles(handles)?,
        })
    }

    fn visibility(&self, command: &Command) -> Result<Made, Refused> {
        let hidden = match command {
            Command::HideSelection => {
                combined(self.before.hidden(), self.selected()?, Combine::Add)
            }
            Command::HideOthers => inverted(self.model.mesh(), self.selected()?),
            _ => Vec::new(),
        };
        let label = match (command, hidden.len()) {
            (Command::ShowAll, _) => "Show everything".to_owned(),
            (_, n) => format!("Hide {n} vertices"),
        };
        let scene = self.before.with(|props| {
            props.selection = combined(&props.selection, &hidden, Combine::Subtract);
            props.hidden = hidden;
        });
        Ok((scene, label, After::Nothing))
    }

    fn finish(&self, job: Job, shape: &Shape) -> Result<Made, Refused> {
        let mut scene = self.before.on(shape);
        let mut settings = scene.settings().clone();
        let label = match job {
            Job::Smooth(smooth) | Job::SmoothAgain(smooth) => {
                settings.smooth = smooth;
                "Smooth".to_owned()
            }
            Job::Details(factor) => {
                settings.detail = factor;
                format!("Details × {factor:.2}")
            }
            Job::Paint(brush) => {
                settings.brush = brush;
                format!("Brush: {}", brush.paint.name().to_lowercase())
            }
            Job::Morph(share) => format!("Morph {:.0} % to the sphere", 100.0 * share),
        };
        if let Some(problem) = settings.problem() {
            return Err(Refused::Number(problem.to_owned()));
        }
        scene = scene.with(|props| props.settings = settings);
        Ok((scene, label, After::Show))
    }

    /// Returns true if a command does the job of the present step again, in its place.
    fn is_again(&self, command: &Command) -> bool {
        let present = self.model.history().present().command.as_ref();
        let job = |command: &Command| match command {
            Command::Finish { job, .. } => Some(*job),
            _ => None,
        };
        match job(command) {
            Some(Job::SmoothAgain(_)) => matches!(
                present.and_then(job),
                Some(Job::Smooth(_) | Job::SmoothAgain(_))
            ),
            Some(Job::Details(_)) => matches!(present.and_then(job), Some(Job::Details(_))),
            _ => false,
        }
    }

    fn scales_details(&self, command: &Command) -> bool {
        let Command::Finish { job, .. } = command else {
            return false;
        };
        matches!(job, Job::Details(_))
    }

    /// The scene with other properties, whose shape has to come to rest.
    fn unsettled(&self, edit: impl FnOnce(&mut Props)) -> Scene {
        let mut scene = self.before.with(edit);
        scene.is_settled = scene.handles().is_empty();
        scene
    }

    fn set(&self, settings: Settings) -> Result<Scene, Refused> {
        match settings.problem() {
            Some(problem) => Err(Refused::Number(problem.to_owned())),
            None => Ok(self.before.with(|props| props.settings = settings)),
        }
    }

    fn selected(&self) -> Result<&[VertexId], Refused> {
        match self.before.selection() {
            [] => Err(Refused::NothingSelected),
            selection => Ok(selection),
        }
    }

    fn handle(&self, index: usize) -> Result<&HandleGroup, Refused> {
        let handle = self.before.handles().get(index);
        handle.ok_or(Refused::NoHandle(index))
    }

    fn mask(&self, index: usize) -> Result<&NamedMask, Refused> {
        let mask = self.before.props.masks.get(index);
        mask.ok_or(Refused::NoMask(index))
    }

    fn inside<'v>(&self, vertices: &'v [VertexId]) -> Result<&'v [VertexId], Refused> {
        let n = self.model.mesh().num_vertices();
        match vertices.iter().find(|v| v.index() >= n) {
            Some(v) => Err(Refused::NoVertex(v.index())),
            None => Ok(vertices),
        }
    }

    /// A shape that comes from elsewhere, checked to be one of the model.
    fn own(&self, shape: &Shape) -> Result<Shape, Refused> {
        let is_finite = |p: &nalgebra::Point3<f64>| p.iter().all(|x| x.is_finite());
        let is_ours = shape.len() == self.model.mesh().num_vertices();
        match is_ours && shape.values().all(is_finite) {
            true => Ok(shape.clone()),
            false => Err(Refused::OtherShape),
        }
    }
}

fn finite(number: f64, what: &str) -> Result<f64, Refused> {
    match number.is_finite() && number >= 0.0 {
        true => Ok(number),
        false => Err(Refused::Number(format!(
            "{what} is {number}, but must not be negative or infinite"
        ))),
    }
}
