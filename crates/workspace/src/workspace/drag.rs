//! Dragging handles: the shape follows, and the whole drag becomes one step.

use cotan::nearest_turn;
use nalgebra::{Matrix4, Point3, Vector3};

use super::Workspace;
use crate::command::{Command, Moved};
use crate::effect::Effect;
use crate::handle::{HandleGroup, Role};
use crate::mirror::{Mirror, images_of};
use crate::model::Model;
use crate::refused::Refused;
use crate::scene::Scene;
use crate::settings::{Follow, Others};
use crate::solver::Pace;
use crate::transform::Transform;

/// A handle that was grabbed, and those that move with it.
pub(super) struct Grip {
    handle: usize,
    companions: Vec<Companion>,
    /// The scene before.
    before: Scene,
    has_moved: bool,
}

/// A handle that moves with another one.
#[derive(Clone, Copy)]
struct Companion {
    handle: usize,
    /// The plane across which it moves; `None` if it moves in the same way.
    mirror: Option<Mirror>,
}

impl Grip {
    pub(super) fn handle(&self) -> usize {
        self.handle
    }

    /// Moves all handles: `step` is the motion since the grip, `turn` its rotation vector if it is
    /// stated.
    fn move_all(
        &self,
        scene: &Scene,
        step: &Matrix4<f64>,
        turn: Option<Vector3<f64>>,
    ) -> Option<Scene> {
        let mut moves = vec![(self.handle, *step, turn)];
        for companion in &self.companions {
            let of = match &companion.mirror {
                None => (companion.handle, *step, turn),
                Some(mirror) => {
                    let across = mirror.reflection();
                    let step = across * step * across;
                    (companion.handle, step, turn.map(|turn| mirror.turn(&turn)))
                }
            };
            moves.push(of);
        }
        let before = self.before.handles();
        let is_there = |k: usize| k < before.len() && k < scene.handles().len();
        if !moves.iter().all(|(k, ..)| is_there(*k)) {
            return None;
        }
        let mut moved = scene.with(|props| {
            for (k, step, turn) in moves {
                let (group, before) = (&mut props.handles[k], &before[k]);
                let matrix = step * before.matrix;
                match turn {
                    Some(turn) => {
                        group.turn = nearest_turn(&matrix, &(before.turn + turn));
                        group.matrix = matrix;
                    }
                    None => group.move_to(matrix),
                }
            }
        });
        moved.is_settled = false;
        Some(moved)
    }
}

impl Workspace {
    pub(super) fn grab(&mut self, handle: usize, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let scene = self.scene().ok_or(Refused::NoModel)?;
        if scene.handles().get(handle).is_none() {
            return Err(Refused::NoHandle(handle));
        }
        if !scene.props.is_active(handle) {
            let handle = Some(handle);
            self.record(&Command::Activate { handle }, effects)?;
        }
        let model = self.model.as_mut().ok_or(Refused::NoModel)?;
        model.find_images();
        self.drag = Some(Grip {
            handle,
            companions: companions(model, handle),
            before: model.scene().clone(),
            has_moved: false,
        });
        self.solver.clear_samples();
        self.warn_of_parts_left_behind(effects);
        Ok(())
    }

    /// Warns once of parts that would stay where they are, until that changes.
    fn warn_of_parts_left_behind(&mut self, effects: &mut Vec<Effect>) {
        let Some(model) = &self.model else {
            return;
        };
        let num_left = model.num_left_behind();
        let is_known = std::mem::replace(&mut self.num_left_behind, num_left) == num_left;
        if num_left == 0 || is_known {
            return;
        }
        let follow = Follow {
            influence: None,
            others: Others::Follow,
            ..model.scene().settings().follow
        };
        effects.push(Effect::Offered {
            text: format!(
                "{num_left} {} without handles will stay where {}.",
                if num_left == 1 { "part" } else { "parts" },
                if num_left == 1 { "it is" } else { "they are" }
            ),
            ways: vec![
                ("Let all parts follow", Command::SetFollow { follow }),
                ("Fix the other parts", Command::FixTheRest),
            ],
        });
    }

    pub(super) fn drag(&mut self, motion: Matrix4<f64>) {
        let step = self.drag.as_ref().and_then(|grip| {
            let before = grip.before.handles().get(grip.handle)?;
            Some(motion * before.matrix.try_inverse()?)
        });
        if let Some(step) = step {
            self.drag_by(&step, None);
        }
    }

    /// Moves the handles that were grabbed by a transform of where they were then.
    pub(super) fn drag_in_numbers(&mut self, transform: &Transform, pivot: Option<Point3<f64>>) {
        let pivot = pivot.or_else(|| Some(self.model()?.pivot()));
        let step = transform.matrix(&pivot.unwrap_or_else(Point3::origin));
        self.drag_by(&step, Some(transform.turn()));
    }

    fn drag_by(&mut self, step: &Matrix4<f64>, turn: Option<Vector3<f64>>) {
        let (Some(grip), Some(model)) = (&mut self.drag, &mut self.model) else {
            return;
        };
        let is_finite = step.iter().all(|x| x.is_finite());
        let Some(moved) = grip
            .move_all(model.scene(), step, turn)
            .filter(|_| is_finite)
        else {
            return;
        };
        if moved.handles() == model.scene().handles() {
            return;
        }
        grip.has_moved = true;
        *model.history_mut().scene_mut() = moved;
        self.solver.follow(model, model.scene(), Pace::Held);
    }

    /// Moves the active handles by a transform, as one step.
    pub(super) fn transform(
        &mut self,
        transform: &Transform,
        pivot: Option<Point3<f64>>,
        effects: &mut Vec<Effect>,
    ) -> Result<(), Refused> {
        let active = self.scene().ok_or(Refused::NoModel)?.props.active;
        let handle = active.ok_or(Refused::NoActiveHandle)?;
        self.cancel_drag(effects);
        self.grab(handle, effects)?;
        self.drag_in_numbers(transform, pivot);
        self.release(effects)
    }

    /// Ends the drag: it becomes a step, and the shape comes to rest.
    pub(super) fn release(&mut self, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let Some(grip) = self.drag.take().filter(|grip| grip.has_moved) else {
            return Ok(());
        };
        let model = self.model.as_mut().ok_or(Refused::NoModel)?;
        let shape = model.scene().shape.clone();
        let all = grip.companions.iter().map(|c| c.handle);
        let mut moves = Vec::new();
        for handle in std::iter::once(grip.handle).chain(all) {
            let group = model.scene().handles().get(handle);
            let group = group.ok_or(Refused::NoHandle(handle))?;
            moves.push(Moved {
                handle,
                motion: group.matrix,
                turn: group.turn,
            });
        }
        *model.history_mut().scene_mut() = grip.before;
        let command = match moves.as_slice() {
            [one] => Command::MoveHandle {
                handle: one.handle,
                motion: one.motion,
                turn: one.turn,
            },
            _ => Command::MoveHandles { moves },
        };
        self.write(&command, effects)?;
        // The step begins with the shape that the drag has come to, from which the solver goes on.
        let is_settled = false;
        self.write(&Command::Arrive { shape, is_settled }, effects)?;
        self.settle();
        Ok(())
    }

    /// Puts the handles back to where they were grabbed.
    pub(super) fn cancel_drag(&mut self, effects: &mut Vec<Effect>) {
        let (Some(grip), Some(model)) = (self.drag.take(), &mut self.model) else {
            return;
        };
        *model.history_mut().scene_mut() = grip.before;
        effects.push(Effect::Marked);
        self.show();
    }
}

/// The handles that move with one: the other active ones and, where the mirror is on, their images.
fn companions(model: &Model, handle: usize) -> Vec<Companion> {
    let props = &model.scene().props;
    let is_movable = |k: &usize| props.handles[*k].role == Role::Movable;
    let others = props.active_handles().filter(|k| *k != handle);
    let same: Vec<usize> = others.filter(is_movable).collect();
    let mut companions: Vec<Companion> = same
        .iter()
        .map(|&handle| Companion {
            handle,
            mirror: None,
        })
        .collect();
    let (Some(mirror), Some(images)) = (props.mirror, model.images()) else {
        return companions;
    };
    for of in std::iter::once(handle).chain(same) {
        let image = images_of(&props.handles[of].vertices, images);
        let shared = |group: &HandleGroup| {
            let is_image = |v: &&_| image.binary_search(v).is_ok();
            group.vertices.iter().filter(is_image).count()
        };
        // The handle that holds most of the image, if that is most of the handle as well.
        let best = (0..props.handles.len())
            .filter(is_movable)
            .map(|k| (shared(&props.handles[k]), std::cmp::Reverse(k)))
            .max();
        let Some((count, std::cmp::Reverse(partner))) = best else {
            continue;
        };
        let is_known = partner == handle || companions.iter().any(|c| c.handle == partner);
        if !is_known && 2 * count > props.handles[partner].vertices.len().max(image.len()) {
            companions.push(Companion {
                handle: partner,
                mirror: Some(mirror),
            });
        }
    }
    companions
}
