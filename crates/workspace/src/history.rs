//! The steps in the order in which they were made, and the one that is shown.

use nalgebra::Point3;

use crate::command::{Command, Record};
use crate::scene::Scene;

/// One step of the history.
#[derive(Clone, PartialEq, Debug)]
pub struct Step {
    /// The command that led here, or `None` if the step is the beginning.
    pub command: Option<Command>,
    /// The command in words, which names undo and redo.
    pub label: String,
    /// The scene.
    pub scene: Scene,
}

/// The steps in the order in which they were made, and the one that is shown.
#[derive(Clone, PartialEq, Debug)]
pub struct History {
    past: Vec<Step>,
    present: Step,
    future: Vec<Step>,
}

impl History {
    /// Starts a history with one scene.
    pub fn new(label: impl Into<String>, scene: Scene) -> Self {
        Self {
            past: Vec::new(),
            present: Step {
                command: None,
                label: label.into(),
                scene,
            },
            future: Vec::new(),
        }
    }

    /// The step that is shown.
    pub fn present(&self) -> &Step {
        &self.present
    }

    /// The scene that is shown.
    pub fn scene(&self) -> &Scene {
        &self.present.scene
    }

    /// The scene that is shown, to be changed without a step.
    pub(crate) fn scene_mut(&mut self) -> &mut Scene {
        &mut self.present.scene
    }

    /// The step before the one that is shown.
    pub(crate) fn before(&self) -> Option<&Step> {
        self.past.last()
    }

    /// The index of the step that is shown, which is the number of steps that can be undone.
    pub fn index(&self) -> usize {
        self.past.len()
    }

    /// The labels of all steps, those that were undone included.
    pub fn labels(&self) -> impl Iterator<Item = &str> {
        let after = self.future.iter().rev();
        let all = self.past.iter().chain([&self.present]).chain(after);
        all.map(|step| step.label.as_str())
    }

    /// Adds a step.
    ///
    /// Drops the steps that were undone, and the oldest ones beyond the limit.
    pub(crate) fn push(&mut self, step: Step) {
        self.future.clear();
        self.past.push(std::mem::replace(&mut self.present, step));
        let forgotten = self.past.len().saturating_sub(self.most_past());
        self.past.drain(..forgotten);
    }

    /// Puts a step in place of the present one.
    pub(crate) fn replace(&mut self, step: Step) {
        self.future.clear();
        self.present = step;
    }

    /// Returns `true` if the present step is a selection, which the next one continues.
    pub(crate) fn is_selection(&self) -> bool {
        let command = self.present.command.as_ref();
        command.is_some_and(|c| c.record() == Record::Selection)
    }

    /// The label of the step that undo would revert, if any.
    pub fn undo_label(&self) -> Option<&str> {
        (!self.past.is_empty()).then_some(self.present.label.as_str())
    }

    /// The label of the step that redo would repeat, if any.
    pub fn redo_label(&self) -> Option<&str> {
        self.future.last().map(|step| step.label.as_str())
    }

    /// Goes back by one step. Returns `false` if there is none.
    pub(crate) fn undo(&mut self) -> bool {
        let Some(step) = self.past.pop() else {
            return false;
        };
        self.future.push(std::mem::replace(&mut self.present, step));
        true
    }

    /// Repeats one step that was undone. Returns `false` if there is none.
    pub(crate) fn redo(&mut self) -> bool {
        let Some(step) = self.future.pop() else {
            return false;
        };
        self.past.push(std::mem::replace(&mut self.present, step));
        true
    }

    /// Goes to the step with an index. Returns `false` if it is shown already, or there is none.
    pub(crate) fn go_to(&mut self, index: usize) -> bool {
        let last = self.past.len() + self.future.len();
        let is_elsewhere = index != self.index() && index <= last;
        while is_elsewhere && index < self.index() && self.undo() {}
        while is_elsewhere && index > self.index() && self.redo() {}
        is_elsewhere
    }

    /// The number of past steps that fit in the memory reserved for them.
    fn most_past(&self) -> usize {
        let bytes = self.present.scene.shape.len().max(1) * size_of::<Point3<f64>>();
        (MOST_BYTES / bytes).clamp(20, 1000)
    }
}

/// Memory for the positions of past steps, which mostly differ.
const MOST_BYTES: usize = 512 << 20;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;

    fn step(x: f64) -> Step {
        Step {
            command: Some(Command::ResetShape),
            label: format!("{x}"),
            scene: Scene::new(Shape::new([Point3::new(x, 0.0, 0.0)].into_iter().collect())),
        }
    }

    #[test]
    fn undo_and_redo_give_back_the_very_scenes() {
        let mut history = History::new("0", step(0.0).scene);
        (1..=3).for_each(|x| history.push(step(f64::from(x))));
        let last = history.scene().shape.clone();
        assert!(history.undo() && history.undo());
        assert_eq!(history.present().label, "1");
        assert_eq!(
            (history.undo_label(), history.redo_label()),
            (Some("1"), Some("2"))
        );
        assert!(history.redo() && history.redo() && !history.redo());
        assert!(last.is(&history.scene().shape));
        assert!(history.go_to(1) && !history.go_to(1) && !history.go_to(9));
        assert_eq!(history.labels().collect::<Vec<_>>(), ["0", "1", "2", "3"]);
        history.push(step(9.0));
        assert!(!history.redo() && history.index() == 2);
    }

    #[test]
    fn the_past_is_bounded() {
        let mut history = History::new("0", step(0.0).scene);
        (0..3000).for_each(|x| history.push(step(f64::from(x))));
        let mut count = 0;
        while history.undo() {
            count += 1;
        }
        assert_eq!(count, 1000);
    }
}
