//! The tools of the pointer, what it holds, and how it selects.

use cotan::halfedge::VertexId;
use cotan_workspace::{Combine, Command, Role};
use eframe::egui::{self, PointerButton, Pos2, Rect};

use super::Editor;
use super::drag::Drag;
use super::typing::{Axes, Hand};
use crate::view::pick::Picker;
use crate::view::select::{Reach, brush, lasso};

/// The tool of the left button.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Tool {
    /// A click selects a vertex; a drag on the background turns the view.
    Select,
    /// A drag paints a region.
    Brush,
    /// A drag draws a lasso around a region.
    Lasso,
    /// A drag paints the curvature field.
    Paint,
}

/// The mode of the gizmo.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum GizmoTool {
    Move,
    Rotate,
    Scale,
}

/// The tools of the pointer, and what it holds.
pub(super) struct Pointer {
    pub(super) tool: Tool,
    pub(super) gizmo_tool: GizmoTool,
    pub(super) gizmo: transform_gizmo_egui::Gizmo,
    /// The handle that is held.
    pub(super) drag: Option<Drag>,
    /// A transform that is typed, or follows the pointer.
    pub(super) hand: Option<Hand>,
    /// The axes along which handles are moved.
    pub(super) axes: Axes,
    /// The vertices of the stroke so far.
    pub(super) stroke: Vec<VertexId>,
    /// The polygon of the lasso so far.
    pub(super) polygon: Vec<Pos2>,
    /// `true` if a drag of the left button turns the view.
    pub(super) is_orbiting: bool,
    /// The radius of the brush in points.
    pub(super) brush_radius: f32,
    /// The place of the picture in the last frame.
    pub(super) viewport: Rect,
    /// The reach of the lasso.
    pub(super) is_through: bool,
}

impl Default for Pointer {
    fn default() -> Self {
        Self {
            tool: Tool::Select,
            gizmo_tool: GizmoTool::Move,
            gizmo: transform_gizmo_egui::Gizmo::default(),
            drag: None,
            hand: None,
            axes: Axes::default(),
            stroke: Vec::new(),
            polygon: Vec::new(),
            is_orbiting: false,
            brush_radius: 24.0,
            viewport: Rect::NOTHING,
            is_through: false,
        }
    }
}

impl Pointer {
    /// Clears the state that belongs to the previous model.
    pub(super) fn forget(&mut self) {
        self.drag = None;
        self.hand = None;
        self.polygon.clear();
        self.stroke.clear();
    }
}

impl Editor {
    /// Handles the left button.
    pub(super) fn act(&mut self, ui: &egui::Ui, response: &egui::Response, rect: Rect) {
        let (pressed, released, origin, latest, alt) = ui.input(|i| {
            let pointer = &i.pointer;
            (
                pointer.primary_pressed(),
                pointer.primary_released(),
                pointer.press_origin(),
                pointer.latest_pos(),
                i.modifiers.alt,
            )
        });
        let combine = ui.input(|i| match (i.modifiers.shift, i.modifiers.command) {
            (true, _) => Combine::Add,
            (_, true) => Combine::Subtract,
            _ => Combine::Replace,
        });
        let is_pressed = pressed && response.contains_pointer() && !alt;
        if is_pressed {
            let pos = origin.or(latest).unwrap_or_default();
            self.press(pos, rect);
        }
        let Some(pos) = latest else {
            return;
        };
        if self.pointer.drag.is_some() {
            let snap = ui.input(|i| i.modifiers.command);
            let step = self.workspace.model().map(|model| model.snap_length());
            self.drag_to(pos, rect, step.filter(|_| snap));
            if released || !ui.input(|i| i.pointer.primary_down()) {
                self.release();
            }
            return;
        }
        match self.pointer.tool {
            Tool::Select => {
                if response.clicked_by(PointerButton::Primary) && !alt {
                    self.click(pos, rect, combine);
                }
            }
            Tool::Brush => {
                let is_down =
                    response.is_pointer_button_down_on() && ui.input(|i| i.pointer.primary_down());
                // A tap may begin and end within one frame.
                if (is_down || is_pressed) && !alt && !self.pointer.is_orbiting {
                    let at = origin.filter(|_| pressed && !is_down).unwrap_or(pos);
                    self.paint_region(at, rect, combine);
                }
            }
            Tool::Paint => {
                let is_down =
                    response.is_pointer_button_down_on() && ui.input(|i| i.pointer.primary_down());
                if (is_down || is_pressed) && !alt && !self.pointer.is_orbiting {
                    let at = origin.filter(|_| pressed && !is_down).unwrap_or(pos);
                    self.paint_along(at, rect);
                }
                if !is_down && !self.pointer.stroke.is_empty() {
                    let stroke = std::mem::take(&mut self.pointer.stroke);
                    self.run(Command::Paint { stroke });
                }
            }
            Tool::Lasso => {
                if response.dragged_by(PointerButton::Primary) && !alt {
                    self.pointer.polygon.push(pos);
                } else if self.pointer.polygon.len() > 2 {
                    self.close_lasso(rect, combine);
                } else {
                    self.pointer.polygon.clear();
                }
            }
        }
        if released {
            self.pointer.is_orbiting = false;
        }
    }

    fn press(&mut self, pos: Pos2, rect: Rect) {
        self.pointer.is_orbiting = false;
        // The handle's mark takes precedence over the gizmo, whose arrows start in it.
        if let Some(handle) = self.handle_at(pos, rect) {
            self.grab(handle, pos, rect);
            return;
        }
        if self.gizmo_is_under(pos) {
            return;
        }
        self.pointer.is_orbiting = match self.pointer.tool {
            Tool::Select => true,
            // A stroke that begins on the background turns the view.
            Tool::Brush | Tool::Paint => !self.is_over_surface(pos, rect),
            Tool::Lasso => false,
        };
    }

    fn gizmo_is_under(&self, pos: Pos2) -> bool {
        self.is_gizmo_shown() && self.pointer.gizmo.pick_preview((pos.x, pos.y))
    }

    fn is_over_surface(&mut self, pos: Pos2, rect: Rect) -> bool {
        let camera = self.shown.camera.at(rect);
        let hit = self.with_picker(|picker| picker.hit(&camera.ray(pos)).is_some());
        hit.unwrap_or_default()
    }

    /// The movable handle whose mark is under the pointer.
    fn handle_at(&self, pos: Pos2, rect: Rect) -> Option<usize> {
        let scene = self.scene()?;
        if self.workspace.morph().is_some() {
            return None;
        }
        let camera = self.shown.camera.at(rect);
        let all = scene.handles().iter().enumerate();
        let near = all
            .filter(|(_, group)| group.role == Role::Movable)
            .filter_map(|(index, group)| {
                let at = camera.project(group.center(scene.rest.positions()))?;
                let distance = at.distance(pos);
                (distance <= MARK + 4.0).then_some((distance, index))
            });
        near.min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, index)| index)
    }

    /// Calls `look` with the search tree of the shape on the screen.
    fn with_picker<R>(&mut self, look: impl FnOnce(&Picker) -> R) -> Option<R> {
        let (model, shape) = self.workspace.model().zip(self.workspace.shown())?;
        Some(look(self.shown.picker(model, shape)))
    }

    fn click(&mut self, pos: Pos2, rect: Rect, how: Combine) {
        let camera = self.shown.camera.at(rect);
        let picked = self.with_picker(|picker| picker.pick_vertex(&camera, pos, PICK_RADIUS));
        self.select(picked.flatten().into_iter().collect(), how);
    }

    /// Adds what is under the brush to the selection, or takes it away.
    fn paint_region(&mut self, pos: Pos2, rect: Rect, how: Combine) {
        let camera = self.shown.camera.at(rect);
        let radius = self.pointer.brush_radius;
        let Some((model, shape)) = self.workspace.model().zip(self.workspace.shown()) else {
            return;
        };
        let picker = self.shown.picker(model, shape);
        let painted = brush(model.mesh(), picker, &camera, pos, radius);
        let how = match how {
            Combine::Subtract => Combine::Subtract,
            _ => Combine::Add,
        };
        self.select(painted, how);
    }

    /// Adds the vertex under the pointer to the stroke.
    fn paint_along(&mut self, pos: Pos2, rect: Rect) {
        let camera = self.shown.camera.at(rect);
        let hit = self.with_picker(|picker| picker.hit(&camera.ray(pos)).map(|hit| hit.vertex));
        let vertex = hit.flatten();
        if let Some(vertex) = vertex.filter(|v| !self.pointer.stroke.contains(v)) {
            self.pointer.stroke.push(vertex);
        }
    }

    /// The radius of the brush that paints, in points, where the pointer is.
    pub(super) fn paint_radius(&mut self, pos: Pos2, rect: Rect) -> Option<f32> {
        let camera = self.shown.camera.at(rect);
        let point = self.with_picker(|picker| picker.hit(&camera.ray(pos)).map(|hit| hit.point));
        let model = self.workspace.model()?;
        let radius = model.side() * model.scene().settings().brush.radius;
        Some((radius / camera.length_per_point(point??)) as f32)
    }

    fn close_lasso(&mut self, rect: Rect, how: Combine) {
        let camera = self.shown.camera.at(rect);
        let polygon = std::mem::take(&mut self.pointer.polygon);
        let reach = match self.pointer.is_through {
            true => Reach::Through,
            false => Reach::Visible,
        };
        let inside = self.with_picker(|picker| lasso(picker, &camera, &polygon, reach));
        self.select(inside.unwrap_or_default(), how);
    }

    /// Makes the vertex under the pointer the one about which handles turn and scale.
    pub(super) fn place_pivot(&mut self, ctx: &egui::Context) {
        let (pos, rect) = ctx.input(|i| (i.pointer.latest_pos(), self.pointer.viewport));
        let Some(pos) = pos.filter(|pos| rect.contains(*pos)) else {
            return;
        };
        let camera = self.shown.camera.at(rect);
        let vertex = self.with_picker(|picker| picker.pick_vertex(&camera, pos, PICK_RADIUS));
        let vertex = vertex.flatten();
        self.run(Command::SetPivot { vertex });
    }

    fn select(&mut self, vertices: Vec<VertexId>, how: Combine) {
        self.run(Command::Select { vertices, how });
    }
}

/// The radius of a handle's mark, in points.
pub(super) const MARK: f32 = 7.0;

/// The largest distance at which a click picks a vertex, in points.
const PICK_RADIUS: f32 = 12.0;
