//! Moving, turning and scaling the active handles by the pointer without a button, or by numbers.

use cotan_workspace::{Command, Kind, Transform, Typed, Typing};
use eframe::egui::{self, Align2, Key, Pos2, Rect};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::Editor;
use super::start::bar;
use crate::view::CameraSnapshot;

/// The axes along which handles are moved.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum Axes {
    /// Those of the model.
    #[default]
    Global,
    /// Those of the active handle, which turn with it.
    Local,
    /// Right, up, and towards the viewer.
    View,
}

/// A transform that is typed, or follows the pointer.
pub(super) struct Hand {
    typed: Typed,
    /// The pointer at the beginning, and at the last frame.
    start: Pos2,
    last: Pos2,
    pivot: Point3<f64>,
    axes: Matrix3<f64>,
    /// The angle by which the pointer went around the pivot, in degrees.
    turned: f64,
    sent: Option<Transform>,
}

impl Hand {
    /// The text that is shown.
    pub(super) fn text(&self) -> String {
        self.typed.to_string()
    }
}

impl Editor {
    /// Starts a transform of the active handles.
    pub(super) fn begin_typing(&mut self, kind: Kind, ctx: &egui::Context) {
        let Some(handle) = self.scene().and_then(|scene| scene.props.active) else {
            self.dialogs.note = Some("no handle is active: choose one first".to_owned());
            return;
        };
        if self.workspace.morph().is_some() || self.pointer.drag.is_some() {
            return;
        }
        self.give_back_hand();
        self.run(Command::Grab { handle });
        let Some(pivot) = self.workspace.model().map(cotan_workspace::Model::pivot) else {
            return;
        };
        let start = ctx.input(|i| i.pointer.latest_pos()).unwrap_or_default();
        self.pointer.hand = Some(Hand {
            typed: Typed::new(kind),
            start,
            last: start,
            pivot,
            axes: self.axes(),
            turned: 0.0,
            sent: None,
        });
    }

    /// The axes that were chosen, as unit columns.
    pub(super) fn axes(&self) -> Matrix3<f64> {
        match self.pointer.axes {
            Axes::Global => Matrix3::identity(),
            Axes::Local => {
                let turn = self
                    .scene()
                    .and_then(|s| s.active())
                    .map(|group| group.turn);
                *Rotation3::new(turn.unwrap_or_default()).matrix()
            }
            Axes::View => view_axes(&self.shown.camera.at(self.pointer.viewport)),
        }
    }

    /// Ends a transform as if Esc were pressed.
    pub(super) fn give_back_hand(&mut self) {
        if self.pointer.hand.take().is_some() {
            self.run(Command::CancelDrag);
        }
    }

    /// Takes a key while a transform is typed.
    pub(super) fn type_key(&mut self, key: Key, ctx: &egui::Context) {
        let Some(hand) = &mut self.pointer.hand else {
            return;
        };
        let typing = match key {
            Key::Enter | Key::Space => {
                self.pointer.hand = None;
                self.run(Command::Drop);
                return;
            }
            Key::Escape => return self.give_back_hand(),
            Key::G => return self.begin_typing(Kind::Move, ctx),
            Key::R => return self.begin_typing(Kind::Turn, ctx),
            Key::S => return self.begin_typing(Kind::Scale, ctx),
            Key::X => Typing::Axis(0),
            Key::Y => Typing::Axis(1),
            Key::Z => Typing::Axis(2),
            Key::Period | Key::Comma => Typing::Point,
            Key::Minus => Typing::Minus,
            Key::Backspace => Typing::Back,
            key => match DIGITS.iter().position(|digit| *digit == key) {
                Some(digit) => Typing::Digit(digit as u8),
                None => return,
            },
        };
        hand.typed.input(typing);
    }

    /// Moves the handles to the numbers or to the pointer. Returns true while a transform goes on.
    pub(super) fn follow_hand(&mut self, ui: &egui::Ui, rect: Rect) -> bool {
        let camera = self.shown.camera.at(rect);
        let step = self
            .workspace
            .model()
            .map(cotan_workspace::Model::snap_length);
        let Some(hand) = &mut self.pointer.hand else {
            return false;
        };
        let (pos, does_snap, is_done, is_given_up) = ui.input(|i| {
            let pointer = &i.pointer;
            (
                pointer.latest_pos().unwrap_or(hand.last),
                i.modifiers.command,
                pointer.primary_pressed(),
                pointer.secondary_pressed(),
            )
        });
        let by_pointer = hand.by_pointer(&camera, pos, step.filter(|_| does_snap));
        let typed = match (hand.typed.kind, hand.typed.axis()) {
            (Kind::Turn, None) => hand.typed.transform(&view_axes(&camera)),
            _ => hand.typed.transform(&hand.axes),
        };
        let transform = typed.unwrap_or(by_pointer);
        let text = hand.text();
        let pivot = Some(hand.pivot.coords.into());
        if hand.sent.replace(transform) != Some(transform) {
            self.run(Command::DragBy { transform, pivot });
        }
        bar(ui, "typing", rect, Align2::CENTER_BOTTOM, |ui| {
            ui.strong(text);
            ui.weak("X Y Z and digits · Ctrl snaps · Enter · Esc");
        });
        if is_given_up {
            self.give_back_hand();
        } else if is_done {
            self.pointer.hand = None;
            self.run(Command::Drop);
        }
        true
    }
}

impl Hand {
    /// The transform that follows the pointer, rounded if there is a step to snap to.
    fn by_pointer(&mut self, camera: &CameraSnapshot, pos: Pos2, step: Option<f64>) -> Transform {
        let snap = |x: f64, to: f64| match step {
            Some(_) => (x / to).round() * to,
            None => x,
        };
        let center = camera.project(self.pivot).unwrap_or(self.start);
        let angle = |p: Pos2| {
            f64::from(center.y - p.y)
                .atan2(f64::from(p.x - center.x))
                .to_degrees()
        };
        self.turned += (angle(pos) - angle(self.last) + 180.0).rem_euclid(360.0) - 180.0;
        self.last = pos;
        let axis = self.typed.axis().map(|k| self.axes.column(k).into_owned());
        let forward = camera.forward();
        match self.typed.kind {
            Kind::Move => {
                let at = |p| camera.unproject_at_depth_of(self.pivot, p);
                let way = at(pos) - at(self.start);
                let round = step.unwrap_or(1.0);
                Transform::Move(match axis {
                    None => way.map(|x| snap(x, round)),
                    Some(axis) => {
                        // The part of the axis that is seen.
                        let seen = axis - forward * axis.dot(&forward);
                        let size = seen.norm_squared();
                        let along = if size > 1e-3 {
                            way.dot(&seen) / size
                        } else {
                            0.0
                        };
                        axis * snap(along, round)
                    }
                })
            }
            Kind::Turn => {
                let degrees = snap(self.turned, 15.0);
                Transform::Turn(match axis {
                    None => -forward * degrees,
                    Some(axis) if axis.dot(&forward) > 0.0 => -axis * degrees,
                    Some(axis) => axis * degrees,
                })
            }
            Kind::Scale => {
                let away = |p: Pos2| f64::from(p.distance(center)).max(1.0);
                let factor = snap(away(pos) / away(self.start), 0.1);
                let mut factors = Vector3::repeat(if axis.is_some() { 1.0 } else { factor });
                if let Some(k) = self.typed.axis() {
                    factors[k] = factor;
                }
                Transform::Scale {
                    axes: self.axes,
                    factors,
                }
            }
        }
    }
}

/// Right, up, and towards the viewer.
fn view_axes(camera: &CameraSnapshot) -> Matrix3<f64> {
    camera.rotation().matrix().transpose()
}

const DIGITS: [Key; 10] = [
    Key::Num0,
    Key::Num1,
    Key::Num2,
    Key::Num3,
    Key::Num4,
    Key::Num5,
    Key::Num6,
    Key::Num7,
    Key::Num8,
    Key::Num9,
];
