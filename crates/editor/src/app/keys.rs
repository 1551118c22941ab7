//! Keyboard shortcuts.

use eframe::egui::{self, Key, Modifiers};

use cotan_workspace::solver::State;
use cotan_workspace::{Combine, Command, Kind, Role};

use super::Editor;
use super::dialogs::Purpose;
use super::files::Then;
use super::palette::Palette;
use super::pointer::{GizmoTool, Tool};
use crate::view::{Shading, StandardView};

/// The keys and their actions, as the help shows them.
pub(super) const HELP: &[(&str, &str)] = &[
    ("Left drag on nothing, middle drag", "turn the view"),
    ("Right drag, Shift + middle drag", "shift the view"),
    ("Wheel", "zoom to the pointer"),
    (
        "F · 1 3 7 · with Shift · 0",
        "fit the view · front, right, top · back, left, below · oblique",
    ),
    ("Q · B · L", "select by click · by brush · by lasso"),
    ("Shift · Ctrl while selecting", "add · take away"),
    ("[ ]", "smaller, larger brush"),
    ("H · X", "handle of the selection · fix the selection"),
    ("Drag a round mark", "move that handle"),
    ("W · E · T", "gizmo: move · rotate · scale"),
    (
        "G · R · S, X Y Z, digits, Enter",
        "move · turn · scale by the pointer or by numbers",
    ),
    ("Ctrl while dragging", "snap to steps"),
    ("P · M", "pivot under the pointer · mirror on and off"),
    ("Delete", "let go of the active handles"),
    ("+ −", "grow, shrink the selection"),
    (
        "Ctrl A · Ctrl I · Ctrl L",
        "select all · invert · all that is linked",
    ),
    ("Esc", "give up a drag, a job, the map or the selection"),
    ("Space", "settle the shape · stop it"),
    (
        "Ctrl H · Shift H · Ctrl Shift H",
        "hide · isolate · show everything",
    ),
    (
        "Z · V · N · J",
        "wireframe · flat or smooth · normals · light",
    ),
    ("C", "the shape as it was opened, and back"),
    ("Ctrl Z · Ctrl Shift Z", "undo · redo"),
    ("Ctrl O · Ctrl S · Ctrl Shift S", "open · save · save as"),
    ("Ctrl + · Ctrl −", "larger, smaller text"),
    ("Ctrl P", "search for an action"),
    ("F1", "this help"),
];

impl StandardView {
    /// The view of a key, which Shift turns to the opposite one.
    fn of(key: Key, with_shift: bool) -> Option<Self> {
        Some(match (key, with_shift) {
            (Key::Num1, false) => Self::Front,
            (Key::Num1, true) => Self::Back,
            (Key::Num3, false) => Self::Right,
            (Key::Num3, true) => Self::Left,
            (Key::Num7, false) => Self::Top,
            (Key::Num7, true) => Self::Bottom,
            (Key::Num0, _) => Self::Oblique,
            _ => return None,
        })
    }
}

impl Editor {
    /// Handles the keys of the whole window.
    pub(super) fn keys(&mut self, ctx: &egui::Context) {
        if self.startup.breakable {
            self.break_keys(ctx);
        }
        if self.dialogs.is_open() || egui::Popup::is_any_open(ctx) {
            return;
        }
        let command = |key, modifiers| ctx.input_mut(|i| i.consume_key(modifiers, key));
        let with_shift = Modifiers::COMMAND | Modifiers::SHIFT;
        if command(Key::Z, with_shift) || command(Key::Y, Modifiers::COMMAND) {
            self.travel(Command::Redo);
        } else if command(Key::Z, Modifiers::COMMAND) {
            self.travel(Command::Undo);
        } else if command(Key::S, with_shift) {
            self.choose(Purpose::SaveModel);
        } else if command(Key::S, Modifiers::COMMAND) {
            self.run(Command::Save);
        } else if command(Key::P, Modifiers::COMMAND) {
            self.dialogs.palette = Some(Palette::default());
        } else if command(Key::O, Modifiers::COMMAND) {
            self.after_saving(ctx, Then::ChooseFile);
        }
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        if command(Key::A, Modifiers::COMMAND) {
            self.run(Command::SelectAll);
        } else if command(Key::I, Modifiers::COMMAND) {
            self.run(Command::InvertSelection);
        } else if command(Key::L, Modifiers::COMMAND) {
            self.run(Command::SelectLinked);
        } else if command(Key::H, with_shift) {
            self.run(Command::ShowAll);
        } else if command(Key::H, Modifiers::COMMAND) {
            self.run(Command::HideSelection);
        } else if command(Key::H, Modifiers::SHIFT) {
            self.run(Command::HideOthers);
        }
        let with_shift = ctx.input(|i| i.modifiers.shift);
        let pressed: Vec<Key> = ctx.input(|i| {
            let keys = i.events.iter().filter_map(|event| match event {
                egui::Event::Key {
                    key,
                    pressed: true,
                    modifiers,
                    ..
                } if !(modifiers.command || modifiers.shift && *key == Key::H) => Some(*key),
                _ => None,
            });
            keys.collect()
        });
        for key in pressed {
            if self.pointer.hand.is_some() {
                self.type_key(key, ctx);
                continue;
            }
            match StandardView::of(key, with_shift) {
                Some(view) => self.shown.camera.look_from(view),
                None => self.key(key, ctx),
            }
        }
    }

    fn key(&mut self, key: Key, ctx: &egui::Context) {
        match key {
            Key::G => self.begin_typing(Kind::Move, ctx),
            Key::R => self.begin_typing(Kind::Turn, ctx),
            Key::S => self.begin_typing(Kind::Scale, ctx),
            Key::P => self.place_pivot(ctx),
            Key::M => self.switch_mirror(),
            Key::Q => self.pointer.tool = Tool::Select,
            Key::B => self.pointer.tool = Tool::Brush,
            Key::L => self.pointer.tool = Tool::Lasso,
            Key::W => self.pointer.gizmo_tool = GizmoTool::Move,
            Key::E => self.pointer.gizmo_tool = GizmoTool::Rotate,
            Key::T => self.pointer.gizmo_tool = GizmoTool::Scale,
            Key::H => self.make_handle(Role::Movable),
            Key::Plus | Key::Equals => self.run(Command::GrowSelection),
            Key::Minus => self.run(Command::ShrinkSelection),
            Key::X => self.make_handle(Role::Fixed),
            Key::OpenBracket => self.pointer.brush_radius *= 0.8,
            Key::CloseBracket => self.pointer.brush_radius *= 1.25,
            Key::F => self.fit(),
            Key::C => self.shown.looks.is_before = !self.shown.looks.is_before,
            Key::Z => self.shown.looks.has_wireframe = !self.shown.looks.has_wireframe,
            Key::V => {
                self.shown.looks.shading = match self.shown.looks.shading {
                    Shading::Smooth => Shading::Flat,
                    Shading::Flat => Shading::Smooth,
                };
            }
            Key::J => self.shown.looks.light = self.shown.looks.light.next(),
            Key::N => self.shown.looks.has_normals = !self.shown.looks.has_normals,
            Key::F1 | Key::Questionmark => self.dialogs.has_help = true,
            Key::Delete | Key::Backspace => self.remove_active(),
            Key::Space => self.settle_or_stop(),
            Key::Escape => self.give_up(),
            _ => {}
        }
    }

    /// Makes a handle of the selection.
    pub(super) fn make_handle(&mut self, role: Role) {
        self.run(Command::MakeHandle { role });
    }

    /// Lets go of the active handles.
    pub(super) fn remove_active(&mut self) {
        let active = self.scene().map(|scene| scene.props.active_handles());
        let mut active: Vec<usize> = active.into_iter().flatten().collect();
        active.sort_unstable();
        for handle in active.into_iter().rev() {
            self.run(Command::RemoveHandle { handle });
        }
    }

    pub(super) fn switch_mirror(&mut self) {
        let is_on = self.scene().is_some_and(|s| s.props.mirror.is_some());
        self.run(match is_on {
            true => Command::SetMirror { mirror: None },
            false => Command::FindMirror,
        });
    }

    /// Moves in the history, with nothing held.
    pub(super) fn travel(&mut self, command: Command) {
        self.pointer.drag = None;
        self.pointer.hand = None;
        self.pages.forget();
        self.run(command);
    }

    pub(super) fn fit(&mut self) {
        if let (Some(model), Some(shape)) = (self.workspace.model(), self.workspace.shown()) {
            let bounds = model.surface(shape).bounding_box();
            self.shown.fit(&bounds);
        }
    }

    pub(super) fn settle_or_stop(&mut self) {
        self.run(match self.workspace.solver().state().0 {
            State::Running | State::Preparing => Command::Stop,
            _ => Command::Settle,
        });
    }

    /// Gives up the innermost of what is going on.
    fn give_up(&mut self) {
        let is_selected = self.scene().is_some_and(|s| !s.selection().is_empty());
        if self.pointer.drag.is_some() {
            self.cancel_drag();
        } else if self.workspace.job().is_some() {
            self.run(Command::CancelJob);
        } else if self.workspace.morph().is_some() {
            self.run(Command::LeaveMorph);
        } else if is_selected {
            self.run(Command::Select {
                vertices: Vec::new(),
                how: Combine::Replace,
            });
        } else {
            self.run(Command::Activate { handle: None });
        }
    }

    /// Crashes the program on purpose, for tests of crash recovery.
    fn break_keys(&mut self, ctx: &egui::Context) {
        let modifiers = Modifiers::COMMAND | Modifiers::SHIFT;
        if ctx.input_mut(|i| i.consume_key(modifiers, Key::F11)) {
            self.workspace.solver().provoke_panic();
            self.run(Command::Settle);
        }
        assert!(
            !ctx.input_mut(|i| i.consume_key(modifiers, Key::F12)),
            "broken on purpose"
        );
    }
}
