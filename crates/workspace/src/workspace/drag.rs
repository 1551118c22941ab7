//! Dragging a handle: the shape follows, and the whole drag becomes one step.

use nalgebra::Matrix4;

use super::Workspace;
use crate::command::Command;
use crate::effect::Effect;
use crate::handle::HandleGroup;
use crate::refused::Refused;
use crate::scene::Scene;
use crate::settings::{Follow, Others};
use crate::solver::Pace;

/// A handle that was grabbed.
pub(super) struct Grip {
    handle: usize,
    /// The scene before.
    before: Scene,
    has_moved: bool,
}

impl Grip {
    pub(super) fn handle(&self) -> usize {
        self.handle
    }
}

impl Workspace {
    pub(super) fn grab(&mut self, handle: usize, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let scene = self.scene().ok_or(Refused::NoModel)?;
        if scene.handles().get(handle).is_none() {
            return Err(Refused::NoHandle(handle));
        }
        let handle = Some(handle);
        if scene.props.active != handle {
            self.record(&Command::Activate { handle }, effects)?;
        }
        let before = self.scene().ok_or(Refused::NoModel)?.clone();
        self.drag = handle.map(|handle| Grip {
            handle,
            before,
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
        let (Some(grip), Some(model)) = (&mut self.drag, &mut self.model) else {
            return;
        };
        let scene = model.scene();
        let is_new = |group: &&HandleGroup| group.matrix != motion;
        let is_finite = motion.iter().all(|x| x.is_finite());
        if !is_finite || scene.handles().get(grip.handle).filter(is_new).is_none() {
            return;
        }
        grip.has_moved = true;
        let mut moved = scene.with(|props| props.handles[grip.handle].move_to(motion));
        moved.is_settled = false;
        *model.history_mut().scene_mut() = moved;
        self.solver.follow(model, model.scene(), Pace::Held);
    }

    /// Ends the drag: it becomes a step, and the shape comes to rest.
    pub(super) fn release(&mut self, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let Some(grip) = self.drag.take().filter(|grip| grip.has_moved) else {
            return Ok(());
        };
        let model = self.model.as_mut().ok_or(Refused::NoModel)?;
        let handle = grip.handle;
        let (shape, group) = {
            let scene = model.scene();
            let group = scene.handles().get(handle);
            (scene.shape.clone(), group.cloned())
        };
        let group = group.ok_or(Refused::NoHandle(handle))?;
        *model.history_mut().scene_mut() = grip.before;
        let (motion, turn) = (group.matrix, group.turn);
        let command = Command::MoveHandle {
            handle,
            motion,
            turn,
        };
        self.write(&command, effects)?;
        // The step begins with the shape that the drag has come to, from which the solver goes on.
        let is_settled = false;
        self.write(&Command::Arrive { shape, is_settled }, effects)?;
        self.settle();
        Ok(())
    }

    /// Puts the handle back to where it was grabbed.
    pub(super) fn cancel_drag(&mut self, effects: &mut Vec<Effect>) {
        let (Some(grip), Some(model)) = (self.drag.take(), &mut self.model) else {
            return;
        };
        *model.history_mut().scene_mut() = grip.before;
        effects.push(Effect::Marked);
        self.show();
    }
}
