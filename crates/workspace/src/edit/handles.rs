//! Edits of handles.

use cotan::halfedge::VertexId;
use cotan::linear::Hold;

use super::{Edit, Made, finite};
use crate::command::{Command, Moved};
use crate::handle::{HandleGroup, Origin, Role, free_name};
use crate::mirror::images_of;
use crate::refused::{After, Refused};
use crate::scene::{BOUNDARY, Props, Scene};
use crate::selection::{Combine, combined, inverted, linked};
use crate::shape::Shape;

impl Edit<'_> {
    pub(super) fn handles(&self, command: &Command) -> Result<Made, Refused> {
        Ok(match command {
            Command::MakeHandle { role } => self.make(*role)?,
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
            Command::AddToHandle { handle } => self.add_to(*handle)?,
            Command::TakeFromHandle { handle } => self.take_from(*handle)?,
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
                let (handle, motion, turn) = (*handle, *motion, *turn);
                let moved = Moved {
                    handle,
                    motion,
                    turn,
                };
                let (scene, label, after) = self.move_all(&[moved])?;
                (
                    scene.with(|props| props.activate(Some(handle))),
                    label,
                    after,
                )
            }
            Command::MoveHandles { moves } => self.move_all(moves)?,
            Command::RemoveHandle { handle } => self.remove(*handle)?,
            Command::RemoveAllHandles => {
                let scene = self.unsettled(|props| {
                    props.handles.clear();
                    props.activate(None);
                });
                (scene, "Let go of all handles".to_owned(), After::Settle)
            }
            Command::SetHandles { handles } => self.set_handles(handles)?,
            _ => return Err(Refused::NotRecorded),
        })
    }

    /// Holds the selection. Where the mirror is on and the selection has two sides, each side is a
    /// handle of its own if it is to be moved.
    fn make(&self, role: Role) -> Result<Made, Refused> {
        let selection = self.selected()?.to_vec();
        let name = free_name(self.before.handles(), role);
        let Some(first) = self
            .first_side(&selection)
            .filter(|_| role == Role::Movable)
        else {
            return Ok(self.hold(selection, role, name));
        };
        let second = combined(&selection, &first, Combine::Subtract);
        let (scene, label, after) = self.hold(first, role, name);
        let before = &scene;
        let name = free_name(before.handles(), role);
        let label = format!("{label} and {name}");
        let edit = Edit {
            model: self.model,
            before,
        };
        let (scene, _, _) = edit.hold(second, role, name);
        Ok((scene, label, after))
    }

    /// The vertices of one side of the mirror, if there are some on both and none in between.
    fn first_side(&self, selection: &[VertexId]) -> Option<Vec<VertexId>> {
        let mirror = self.before.props.mirror.as_ref()?;
        let images = self.model.images()?;
        let original = self.model.original();
        let side = |v: &VertexId| mirror.normal.dot(&(original[*v].coords - mirror.point));
        let is_between =
            |v: &VertexId| images[*v].is_none_or(|image| side(&image) * side(v) >= 0.0);
        if selection.iter().any(is_between) {
            return None;
        }
        let first = selection.iter().filter(|v| side(v) > 0.0).copied();
        let first: Vec<VertexId> = first.collect();
        (!first.is_empty() && first.len() < selection.len()).then_some(first)
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
                    props.activate(Some(props.handles.len() - 1));
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

    /// Adds the selection to a handle, where it is, and takes it from the others.
    fn add_to(&self, handle: usize) -> Result<Made, Refused> {
        let added = self.selected()?;
        let group = self.handle(handle)?;
        let Some(back) = group.matrix.try_inverse() else {
            let problem = format!("{} is flattened: move it back first", group.name);
            return Err(Refused::Number(problem));
        };
        let (rest, shape) = (&self.before.rest, &self.before.shape);
        let mut places: Vec<_> = match &group.origin {
            Origin::Rest => group.vertices.iter().map(|v| (*v, rest[*v])).collect(),
            Origin::Places(at) => group
                .vertices
                .iter()
                .copied()
                .zip(at.iter().copied())
                .collect(),
        };
        let is_new = |v: &&VertexId| group.vertices.binary_search(v).is_err();
        let new = added.iter().filter(is_new);
        places.extend(new.map(|v| (*v, back.transform_point(&shape[*v]))));
        places.sort_by_key(|(v, _)| *v);
        let is_at_rest = places.iter().all(|(v, p)| rest[*v] == *p);
        let label = format!("Add to {}", group.name);
        let scene = self.unsettled(|props| {
            let others = props.handles.iter_mut().enumerate();
            others
                .filter(|(k, _)| *k != handle)
                .for_each(|(_, g)| g.let_go(added));
            let (vertices, at) = places.into_iter().unzip();
            let group = &mut props.handles[handle];
            group.vertices = vertices;
            group.origin = match is_at_rest {
                true => Origin::Rest,
                false => Origin::Places(at),
            };
            drop_empty(props);
            props.selection.clear();
        });
        Ok((scene, label, After::Settle))
    }

    /// Takes the selection from a handle, which goes if nothing is left of it.
    fn take_from(&self, handle: usize) -> Result<Made, Refused> {
        let taken = self.selected()?;
        let label = format!("Take from {}", self.handle(handle)?.name);
        let scene = self.unsettled(|props| {
            props.handles[handle].let_go(taken);
            drop_empty(props);
            props.selection.clear();
        });
        Ok((scene, label, After::Settle))
    }

    fn move_all(&self, moves: &[Moved]) -> Result<Made, Refused> {
        let mut names = Vec::new();
        for moved in moves {
            names.push(self.handle(moved.handle)?.name.as_str());
            let mut numbers = moved.motion.iter().chain(moved.turn.iter());
            numbers.try_for_each(|x| finite(x.abs(), "the motion").map(drop))?;
        }
        let label = format!("Move {}", names.join(", "));
        let scene = self.unsettled(|props| {
            for moved in moves {
                let group = &mut props.handles[moved.handle];
                group.matrix = moved.motion;
                group.turn = moved.turn;
            }
        });
        Ok((scene, label, After::Settle))
    }

    fn remove(&self, handle: usize) -> Result<Made, Refused> {
        let label = format!("Let go of {}", self.handle(handle)?.name);
        let scene = self.unsettled(|props| {
            props.handles.remove(handle);
            props.activate(None);
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
            props.activate(None);
        });
        // A shape of its own makes the solver start afresh, not from where the handles before had
        // moved it.
        scene.rest = Shape::new(scene.rest.positions().clone());
        scene.shape = scene.rest.clone();
        Ok((scene, "Load handles".to_owned(), After::Settle))
    }

    /// The vertices and, where the mirror is on, their images.
    pub(super) fn mirrored(&self, vertices: &[VertexId]) -> Vec<VertexId> {
        match self.model.images() {
            Some(images) => combined(vertices, &images_of(vertices, images), Combine::Add),
            None => vertices.to_vec(),
        }
    }
}

/// Drops groups without vertices. The active ones stay active unless they are dropped.
fn drop_empty(props: &mut Props) {
    let is_full = |group: &HandleGroup| !group.vertices.is_empty();
    let kept: Vec<bool> = props.handles.iter().map(is_full).collect();
    let moved = |k: usize| {
        let before = kept.get(..k)?.iter().filter(|is_kept| **is_kept).count();
        kept.get(k)?.then_some(before)
    };
    props.active = props.active.and_then(moved);
    let also = props.also_active.iter();
    props.also_active = also.filter_map(|k| moved(*k)).collect();
    props.handles.retain(is_full);
}
