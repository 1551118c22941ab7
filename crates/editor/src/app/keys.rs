//! Keyboard shortcuts.

use eframe::egui::{self, Key, Modifiers};

use super::Editor;
use super::dialogs::{Purpose, Then};
use super::viewport::{GizmoTool, Tool};
use crate::scene::Role;
use crate::view::{Shading, StandardView};

/// The keys and their actions, as the help shows them.
pub(super) const HELP: &[(&str, &str)] = &[
    ("Left drag on nothing, middle drag", "turn the view"),
    ("Right drag, Shift + middle drag", "shift the view"),
    ("Wheel", "zoom to the pointer"),
    ("F · 1 3 7", "fit the view · front, right, top"),
    ("Q · B · L", "select by click · by brush · by lasso"),
    ("Shift · Ctrl while selecting", "add · take away"),
    ("[ ]", "smaller, larger brush"),
    ("H · X", "handle of the selection · fix the selection"),
    ("Drag a round mark", "move that handle"),
    ("W · E · R", "gizmo: move · rotate · scale"),
    ("Delete", "let go of the active handle"),
    ("Esc", "give up a drag, a job or the selection"),
    ("Space", "bring the shape to rest · stop it"),
    ("Z · S · N", "wireframe · flat or smooth · normals"),
    ("Ctrl Z · Ctrl Shift Z", "undo · redo"),
    ("Ctrl O · Ctrl S · Ctrl Shift S", "open · save · save as"),
    ("Ctrl + · Ctrl −", "larger, smaller text"),
    ("F1", "this help"),
];

impl Editor {
    /// Handles the keys of the whole window.
    pub(super) fn keys(&mut self, ctx: &egui::Context) {
        if self.startup.breakable {
            self.break_keys(ctx);
        }
        if self.dialogs.is_open() {
            return;
        }
        let command = |key, modifiers| ctx.input_mut(|i| i.consume_key(modifiers, key));
        let with_shift = Modifiers::COMMAND | Modifiers::SHIFT;
        if command(Key::Z, with_shift) || command(Key::Y, Modifiers::COMMAND) {
            self.redo();
        } else if command(Key::Z, Modifiers::COMMAND) {
            self.undo();
        } else if command(Key::S, with_shift) {
            self.choose(Purpose::SaveMesh);
        } else if command(Key::S, Modifiers::COMMAND) {
            self.save();
        } else if command(Key::O, Modifiers::COMMAND) {
            self.after_saving(ctx, Then::ChooseFile);
        }
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        let pressed: Vec<Key> = ctx.input(|i| {
            let keys = i.events.iter().filter_map(|event| match event {
                egui::Event::Key {
                    key,
                    pressed: true,
                    modifiers,
                    ..
                } if !modifiers.command => Some(*key),
                _ => None,
            });
            keys.collect()
        });
        for key in pressed {
            self.key(key);
        }
    }

    fn key(&mut self, key: Key) {
        match key {
            Key::Q => self.tool = Tool::Select,
            Key::B => self.tool = Tool::Brush,
            Key::L => self.tool = Tool::Lasso,
            Key::W => self.gizmo_tool = GizmoTool::Move,
            Key::E => self.gizmo_tool = GizmoTool::Rotate,
            Key::R => self.gizmo_tool = GizmoTool::Scale,
            Key::H => self.make_handle(Role::Movable),
            Key::X => self.make_handle(Role::Fixed),
            Key::OpenBracket => *self.pick.brush_radius_mut() *= 0.8,
            Key::CloseBracket => *self.pick.brush_radius_mut() *= 1.25,
            Key::F => self.fit(),
            Key::Num1 => self.camera.look_from(StandardView::Front),
            Key::Num3 => self.camera.look_from(StandardView::Right),
            Key::Num7 => self.camera.look_from(StandardView::Top),
            Key::Z => self.looks.has_wireframe = !self.looks.has_wireframe,
            Key::S => {
                self.looks.shading = match self.looks.shading {
                    Shading::Smooth => Shading::Flat,
                    Shading::Flat => Shading::Smooth,
                };
            }
            Key::N => self.looks.has_normals = !self.looks.has_normals,
            Key::F1 | Key::Questionmark => self.dialogs.has_help = true,
            Key::Delete | Key::Backspace => {
                if let Some(active) = self.active {
                    self.remove_handle(active);
                }
            }
            Key::Space => self.settle_or_stop(),
            Key::Escape => self.give_up(),
            _ => {}
        }
    }

    pub(super) fn fit(&mut self) {
        if let (Some(open), Some(shape)) = (&self.open, self.displayed()) {
            let mesh = open.mesh.processing.mesh();
            let surface = cotan::geometry::Surface::assume_checked(mesh, &shape);
            self.camera.fit(&surface.bounding_box());
        }
    }

    pub(super) fn settle_or_stop(&mut self) {
        match self.solver.state().0 {
            crate::solver::State::Running | crate::solver::State::Preparing => self.stop(),
            _ => self.settle(),
        }
    }

    fn give_up(&mut self) {
        if self.drag.is_some() {
            self.cancel_drag();
        } else if self.task.is_some() {
            self.cancel_task();
        } else {
            self.selection.clear();
            self.active = None;
        }
        self.tint();
    }

    /// Crashes the program on purpose, for tests of crash recovery.
    fn break_keys(&mut self, ctx: &egui::Context) {
        let modifiers = Modifiers::COMMAND | Modifiers::SHIFT;
        if ctx.input_mut(|i| i.consume_key(modifiers, Key::F11)) {
            self.solver.provoke_panic();
            self.settle();
        }
        assert!(
            !ctx.input_mut(|i| i.consume_key(modifiers, Key::F12)),
            "broken on purpose"
        );
    }
}
