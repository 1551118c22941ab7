//! The scene that a command makes of another.

use cotan::halfedge::VertexId;
use cotan::linear::Hold;

use crate::command::{Command, Job, Record};
use crate::handle::{HandleGroup, Role, free_name};
use crate::mask::NamedMask;
use crate::model::Model;
use crate::refused::{After, Refused};
use crate::scene::{BOUNDARY, Props, Scene};
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
                let scene = self.before.with(|props| props.active = *handle);
                return Ok((scene, "Choose a handle".to_owned(), After::Nothing));
            }
            Command::Select { vertices, how } => combined(old, self.inside(vertices)?, *how),
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
        let mut settings = self.before.settings().clone();
        match *command {
            Command::SetSmooth { smooth } => settings.smooth = smooth,
            Command::SetAreas { areas } => settings.areas = areas,
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
            Command::MakeHandle { role } => {
                let selection = self.selected()?.to_vec();
                let name = free_name(self.before.handles(), *role);
                self.hold(selection, *role, name)
            }
            Command::FixTheRest => self.fix_the_rest(),
            Command::FixBoundary => self.hold(self.rim(), Role::Fixed, BOUNDARY.to_owned()),
            Command::FreeBoundary => match self.before.boundary_handle() {
                Some(handle) => self.remove(handle)?,
                None => (self.before.clone(), String::new(), After::Nothing),
            },
            Command::RenameHandle { handle, name } => {
                let old = &self.handle(*handle)?.name;
                let label = format!("Rename {old} to {name}");
                let scene = self
                    .before
                    .with(|p| p.handles[*handle].name.clone_from(name));
                (scene, label, After::Nothing)
            }
            Command::SetHold { handle, hold } => {
                let label = format!("Weight of {}", self.handle(*handle)?.name);
                if let Hold::Soft(weight) = hold {
                    finite(*weight, "the weight")?;
                }
                let scene = self.unsettled(|props| props.handles[*handle].hold = *hold);
                (scene, label, After::Settle)
            }
            Command::MoveHandle {
                handle,
                motion,
                turn,
            } => {
                let label = format!("Move {}", self.handle(*handle)?.name);
                let numbers = motion.iter().chain(turn.iter());
                numbers
                    .copied()
                    .try_for_each(|x| finite(x.abs(), "the motion").map(drop))?;
                let scene = self.unsettled(|props| {
                    props.handles[*handle].matrix = *motion;
                    props.handles[*handle].turn = *turn;
                    props.active = Some(*handle);
                });
                (scene, label, After::Settle)
            }
            Command::RemoveHandle { handle } => self.remove(*handle)?,
            Command::RemoveAllHandles => {
                let scene = self.unsettled(|props| {
                    props.handles.clear();
                    props.active = None;
                });
                (scene, "Let go of all handles".to_owned(), After::Settle)
            }
            Command::SetHandles { handles } => self.set_handles(handles)?,
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
            _ => return Err(Refused::NotRecorded),
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

    /// Holds vertices where they are, and takes them from other handles.
    fn hold(&self, vertices: Vec<VertexId>, role: Role, name: String) -> Made {
        let label = match role {
            Role::Fixed => format!("Fix a region: {name}"),
            Role::Movable => format!("Add handle {name}"),
        };
        let Scene { rest, shape, .. } = self.before;
        let scene = self.before.with(|props| {
            props.handles.iter_mut().for_each(|g| g.let_go(&vertices));
            drop_empty(props);
            props.selection.clear();
            if !vertices.is_empty() {
                let group = HandleGroup::new(name, vertices, role, rest, shape);
                props.handles.push(group);
                if role == Role::Movable {
                    props.active = Some(props.handles.len() - 1);
                }
            }
        });
        // A shape at rest that is held where it is needs no solve.
        let after = match scene.is_settled {
            true => After::Hold,
            false => After::Settle,
        };
        (scene, label, after)
    }

    fn fix_the_rest(&self) -> Made {
        let mesh = self.model.mesh();
        let mut held: Vec<VertexId> = self.before.selection().to_vec();
        let groups = self.before.handles().iter();
        held.extend(groups.flat_map(|g| g.vertices.iter().copied()));
        let touched = linked(mesh, &held);
        let rest = inverted(mesh, &touched);
        let name = free_name(self.before.handles(), Role::Fixed);
        let (scene, _, after) = self.hold(rest, Role::Fixed, name);
        let selection = self.before.selection().to_vec();
        let scene = scene.with(|props| props.selection = selection);
        (scene, "Fix the rest".to_owned(), after)
    }

    /// The vertices of the open boundary that no handle holds.
    fn rim(&self) -> Vec<VertexId> {
        let mesh = self.model.mesh();
        let held = self.before.handles();
        let is_free = |v: &VertexId| held.iter().all(|g| g.vertices.binary_search(v).is_err());
        let rim = mesh.vertices().filter(|&v| mesh.is_rim_vertex(v));
        rim.filter(is_free).collect()
    }

    fn remove(&self, handle: usize) -> Result<Made, Refused> {
        let label = format!("Let go of {}", self.handle(handle)?.name);
        let scene = self.unsettled(|props| {
            props.handles.remove(handle);
            props.active = None;
        });
        Ok((scene, label, After::Settle))
    }

    fn set_handles(&self, handles: &[HandleGroup]) -> Result<Made, Refused> {
        let n = self.model.mesh().num_vertices();
        if let Some(group) = handles.iter().find(|g| !g.fits(n)) {
            let problem = format!("the handle \"{}\" does not fit the model", group.name);
            return Err(Refused::Number(problem));
        }
        let mut scene = self.unsettled(|props| {
            props.handles = handles.to_vec();
            props.active = None;
        });
        // A shape of its own makes the solver start afresh, not from where the handles before had
        // moved it.
        scene.rest = Shape::new(scene.rest.positions().clone());
        scene.shape = scene.rest.clone();
        Ok((scene, "Load handles".to_owned(), After::Settle))
    }

    fn masks(&self, command: &Command) -> Result<Made, Refused> {
        let (label, scene) = match command {
            Command::MakeMask { name } => {
                let region = self.selected()?;
                let surface = self.model.surface(&self.before.shape);
                let border = self.model.side() * self.before.settings().border;
                let made = NamedMask::inside(name.clone(), &surface, region, border);
                let made = made.map_err(|error| Refused::Library(error.to_string()))?;
                let scene = self.before.with(|props| {
                    props.masks.push(made);
                    props.mask = Some(props.masks.len() - 1);
                    props.selection.clear();
                });
                (format!("Mask {name}"), scene)
            }
            Command::UseMask { mask } => {
                if let Some(mask) = mask {
                    self.mask(*mask)?;
                }
                let scene = self.before.with(|props| props.mask = *mask);
                ("Choose a mask".to_owned(), scene)
            }
            Command::RemoveMask { mask } => {
                let label = format!("Remove the mask {}", self.mask(*mask)?.name);
                let scene = self.before.with(|props| {
                    props.masks.remove(*mask);
                    props.mask = match props.mask {
                        Some(used) if used > *mask => Some(used - 1),
                        Some(used) if used == *mask => None,
                        used => used,
                    };
                });
                (label, scene)
            }
            _ => return Err(Refused::NotRecorded),
        };
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

/// Drops groups without vertices. The active one stays active unless it is dropped.
fn drop_empty(props: &mut Props) {
    let is_full = |group: &HandleGroup| !group.vertices.is_empty();
    props.active = props
        .active
        .filter(|&k| props.handles.get(k).is_some_and(is_full));
    props.active = props
        .active
        .map(|k| props.handles[..k].iter().filter(|g| is_full(g)).count());
    props.handles.retain(is_full);
}

fn finite(number: f64, what: &str) -> Result<f64, Refused> {
    match number.is_finite() && number >= 0.0 {
        true => Ok(number),
        false => Err(Refused::Number(format!(
            "{what} is {number}, not a number from 0 on"
        ))),
    }
}
