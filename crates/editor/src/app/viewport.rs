//! The part of the window that shows the mesh, and its pointer interaction.

use std::sync::Arc;

use cotan::geometry::{Positions, Surface};
use cotan::halfedge::VertexId;
use eframe::egui::{self, Color32, PointerButton, Pos2, Rect, Sense, Stroke, StrokeKind};
use eframe::egui_glow;
use transform_gizmo_egui::{EnumSet, GizmoConfig, GizmoInteraction, GizmoMode};

use super::Editor;
use crate::newest::lock;
use crate::scene::Role;
use crate::view::pick::Picker;
use crate::view::select::{Reach, brush, lasso};
use crate::view::{CameraSnapshot, Style};

/// The tool of the left button.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Tool {
    /// A click selects a vertex; a drag on the background turns the view.
    Select,
    /// A drag paints a region.
    Brush,
    /// A drag draws a lasso around a region.
    Lasso,
}

/// The mode of the gizmo.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum GizmoTool {
    Move,
    Rotate,
    Scale,
}

/// The state of selection between frames.
#[derive(Default)]
pub(super) struct PickState {
    picker: Option<(Arc<Positions<f64>>, Picker)>,
    /// The polygon of the lasso so far.
    polygon: Vec<Pos2>,
    /// `true` if a drag of the left button turns the view.
    is_orbiting: bool,
    brush_radius: f32,
    pub(super) is_through: bool,
}

impl PickState {
    /// Clears the state that belongs to the previous mesh.
    pub(super) fn forget(&mut self) {
        self.picker = None;
        self.polygon.clear();
    }

    /// Stores a picker that a background task has prepared.
    pub(super) fn know(&mut self, shape: Arc<Positions<f64>>, picker: Picker) {
        self.picker = Some((shape, picker));
    }

    /// The radius of the brush in points.
    pub(super) fn brush_radius_mut(&mut self) -> &mut f32 {
        if self.brush_radius == 0.0 {
            self.brush_radius = 24.0;
        }
        &mut self.brush_radius
    }
}

/// The way in which a new selection is combined with the current one.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Combine {
    Replace,
    Add,
    Subtract,
}

impl Editor {
    pub(super) fn viewport(&mut self, ui: &mut egui::Ui) {
        egui::CentralPanel::no_frame().show_inside(ui, |ui| {
            let (rect, response) =
                ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
            if rect.width() < 2.0 || rect.height() < 2.0 {
                return;
            }
            let seconds = f64::from(ui.input(|i| i.stable_dt));
            if self.camera.advance(seconds.min(0.1)) {
                ui.ctx().request_repaint();
            }
            if self.open.is_some() && !self.dialogs.is_open() {
                self.navigate(ui, &response, rect);
                self.act(ui, &response, rect);
            }
            self.paint(ui, rect);
            if self.open.is_some() {
                self.gizmo_and_marks(ui, &response, rect);
                self.overlays(ui, rect);
            }
            self.mark("viewport", rect);
            let ctx = ui.ctx().clone();
            self.take_picture(&ctx, rect);
        });
    }

    /// Orbits, pans and zooms.
    fn navigate(&mut self, ui: &egui::Ui, response: &egui::Response, rect: Rect) {
        let delta = response.drag_delta();
        let (shift, alt) = ui.input(|i| (i.modifiers.shift, i.modifiers.alt));
        let is_left = response.dragged_by(PointerButton::Primary);
        let is_middle = response.dragged_by(PointerButton::Middle);
        let is_right = response.dragged_by(PointerButton::Secondary);
        if is_right || (is_middle && shift) {
            self.camera.pan(delta, rect);
        } else if is_middle || (is_left && (alt || self.pick.is_orbiting)) {
            self.camera.orbit(delta);
        }
        if let Some(pos) = response.hover_pos() {
            let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta.y, i.zoom_delta()));
            let factor = f64::from(scroll / 200.0).exp() * f64::from(pinch);
            if (factor - 1.0).abs() > 1e-6 {
                self.camera.zoom(factor, pos, rect);
                ui.ctx().request_repaint();
            }
        }
    }

    /// Handles the left button.
    fn act(&mut self, ui: &egui::Ui, response: &egui::Response, rect: Rect) {
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
        let is_ours = response.contains_pointer();
        if pressed && is_ours && !alt {
            let pos = origin.or(latest).unwrap_or_default();
            self.press(pos, rect, combine);
        }
        let Some(pos) = latest else {
            return;
        };
        if self.drag.is_some() {
            self.drag_to(pos, rect);
            if released || !ui.input(|i| i.pointer.primary_down()) {
                self.release();
            }
            return;
        }
        match self.tool {
            Tool::Select => {
                if response.clicked_by(PointerButton::Primary) && !alt {
                    self.click(pos, rect, combine);
                }
            }
            Tool::Brush => {
                let is_down =
                    response.is_pointer_button_down_on() && ui.input(|i| i.pointer.primary_down());
                if is_down && !alt {
                    self.paint_region(pos, rect, combine);
                }
            }
            Tool::Lasso => {
                if response.dragged_by(PointerButton::Primary) && !alt {
                    self.pick.polygon.push(pos);
                } else if self.pick.polygon.len() > 2 {
                    self.close_lasso(rect, combine);
                } else {
                    self.pick.polygon.clear();
                }
            }
        }
        if released {
            self.pick.is_orbiting = false;
        }
    }

    fn press(&mut self, pos: Pos2, rect: Rect, combine: Combine) {
        self.pick.is_orbiting = false;
        // The handle's mark takes precedence over the gizmo, whose arrows start in it.
        if let Some(handle) = self.handle_at(pos, rect) {
            self.grab(handle, pos, rect);
            self.tint();
            return;
        }
        if self.gizmo_is_under(pos) {
            return;
        }
        if combine == Combine::Replace && self.tool == Tool::Brush {
            self.selection.clear();
        }
        self.pick.is_orbiting = self.tool == Tool::Select;
    }

    fn gizmo_is_under(&self, pos: Pos2) -> bool {
        self.is_gizmo_shown() && self.gizmo.pick_preview((pos.x, pos.y))
    }

    /// The movable handle whose mark is under the pointer.
    fn handle_at(&self, pos: Pos2, rect: Rect) -> Option<usize> {
        let scene = self.scene()?;
        if self.jobs.map.is_some() {
            return None;
        }
        let camera = self.camera.at(rect);
        let all = scene.handles.iter().enumerate();
        let near = all
            .filter(|(_, group)| group.role == Role::Movable)
            .filter_map(|(index, group)| {
                let at = camera.project(group.center(&scene.rest))?;
                let distance = at.distance(pos);
                (distance <= MARK + 4.0).then_some((distance, index))
            });
        near.min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, index)| index)
    }

    /// Calls `look` with the picker of the shape on the screen, which is built on first use.
    fn with_picker<R>(&mut self, look: impl FnOnce(&Picker, &Editor) -> R) -> Option<R> {
        let shape = self.displayed()?;
        let open = self.open.as_ref()?;
        let picker = match self.pick.picker.take() {
            Some((of, picker)) if Arc::ptr_eq(&of, &shape) => picker,
            Some((_, mut picker)) if picker.positions().len() == shape.len() => {
                picker.refit(&shape);
                picker
            }
            _ => Picker::new(open.mesh.processing.mesh(), &shape),
        };
        let seen = look(&picker, self);
        self.pick.picker = Some((shape, picker));
        Some(seen)
    }

    fn click(&mut self, pos: Pos2, rect: Rect, combine: Combine) {
        let camera = self.camera.at(rect);
        let picked = self.with_picker(|picker, _| picker.pick_vertex(&camera, pos, PICK_RADIUS));
        self.combine(picked.flatten().into_iter().collect(), combine);
    }

    fn paint_region(&mut self, pos: Pos2, rect: Rect, combine: Combine) {
        let camera = self.camera.at(rect);
        let radius = *self.pick.brush_radius_mut();
        let painted = self.with_picker(|picker, editor| {
            let mesh = editor.open.as_ref().map(|open| open.mesh.processing.mesh());
            mesh.map(|mesh| brush(mesh, picker, &camera, pos, radius))
        });
        let combine = match combine {
            Combine::Subtract => Combine::Subtract,
            _ => Combine::Add,
        };
        self.combine(painted.flatten().unwrap_or_default(), combine);
    }

    fn close_lasso(&mut self, rect: Rect, combine: Combine) {
        let camera = self.camera.at(rect);
        let polygon = std::mem::take(&mut self.pick.polygon);
        let reach = match self.pick.is_through {
            true => Reach::Through,
            false => Reach::Visible,
        };
        let inside = self.with_picker(|picker, _| lasso(picker, &camera, &polygon, reach));
        self.combine(inside.unwrap_or_default(), combine);
    }

    /// Updates the selection with the found vertices. Both lists are sorted.
    fn combine(&mut self, found: Vec<VertexId>, combine: Combine) {
        match combine {
            Combine::Replace => self.selection = found,
            Combine::Add => {
                self.selection.extend(found);
                self.selection.sort_unstable();
                self.selection.dedup();
            }
            Combine::Subtract => {
                self.selection.retain(|v| found.binary_search(v).is_err());
            }
        }
        self.tint();
    }

    /// Draws the mesh.
    fn paint(&mut self, ui: &egui::Ui, rect: Rect) {
        let style = self.style(ui);
        if let Some(open) = &self.open
            && let Some(shape) = self.displayed()
        {
            let surface = Surface::assume_checked(open.mesh.processing.mesh(), &shape);
            self.camera.set_scene(&surface.bounding_box());
        }
        let camera: CameraSnapshot = self.camera.at(rect);
        let renderer = Arc::clone(&self.renderer);
        let callback = egui_glow::CallbackFn::new(move |info, _painter| {
            lock(&renderer).draw(&info, &camera, &style);
        });
        ui.painter().add(egui::PaintCallback {
            rect,
            callback: Arc::new(callback),
        });
    }

    fn style(&self, ui: &egui::Ui) -> Style {
        let (mut style, line) = match ui.visuals().dark_mode {
            true => (Style::dark(), [20, 22, 26]),
            false => (Style::light(), [70, 74, 82]),
        };
        style.shading = self.looks.shading;
        style.wireframe = self.looks.has_wireframe.then_some(line);
        style.normals = self.looks.has_normals.then_some([0, 114, 178]);
        style
    }

    fn is_gizmo_shown(&self) -> bool {
        let is_free = matches!(&self.drag, Some(drag) if !drag.is_by_gizmo());
        self.jobs.map.is_none()
            && !is_free
            && self.active.is_some_and(|active| {
                let group = self.scene().and_then(|s| s.handles.get(active));
                group.is_some_and(|group| group.role == Role::Movable)
            })
    }

    fn gizmo_and_marks(&mut self, ui: &egui::Ui, response: &egui::Response, rect: Rect) {
        self.marks(ui, rect);
        if !self.is_gizmo_shown() {
            return;
        }
        let Some(transform) = self.gizmo_transform() else {
            return;
        };
        let config = GizmoConfig {
            modes: self.gizmo_modes(),
            ..self.camera.gizmo_config(rect, ui.ctx().pixels_per_point())
        };
        self.gizmo.update_config(config);
        let (pressed, down) = ui.input(|i| (i.pointer.primary_pressed(), i.pointer.primary_down()));
        // In a slow frame the pointer may have moved since the press. The press itself decides
        // what is grabbed.
        let origin = ui.input(|i| i.pointer.press_origin().filter(|_| pressed));
        let latest = ui.input(|i| i.pointer.latest_pos());
        if origin.is_some() && origin != latest {
            ui.ctx().request_repaint();
        }
        let cursor = origin.or(latest).unwrap_or_default();
        let is_open = self.dialogs.is_open();
        let interaction = GizmoInteraction {
            cursor_pos: (cursor.x, cursor.y),
            hovered: response.contains_pointer() && !is_open,
            drag_started: pressed && response.contains_pointer() && !is_open,
            dragging: down && !is_open,
        };
        let result = self.gizmo.update(interaction, &[transform]);
        if let Some((_, transforms)) = result
            && let Some(new) = transforms.first()
            && down
        {
            if self.drag.is_none()
                && let Some(active) = self.active
            {
                self.grab_gizmo(active);
            }
            self.gizmo_to(*new);
        }
        self.draw_gizmo(ui, rect);
    }

    fn gizmo_modes(&self) -> EnumSet<GizmoMode> {
        match self.gizmo_tool {
            GizmoTool::Move => GizmoMode::all_translate(),
            GizmoTool::Rotate => GizmoMode::all_rotate(),
            GizmoTool::Scale => GizmoMode::all_scale(),
        }
    }

    fn draw_gizmo(&self, ui: &egui::Ui, rect: Rect) {
        let drawn = self.gizmo.draw();
        let vertices = drawn.vertices.into_iter().zip(drawn.colors);
        let mesh = egui::Mesh {
            indices: drawn.indices,
            vertices: vertices
                .map(|(pos, [r, g, b, a])| egui::epaint::Vertex {
                    pos: pos.into(),
                    uv: Pos2::default(),
                    color: egui::Rgba::from_rgba_premultiplied(r, g, b, a).into(),
                })
                .collect(),
            ..egui::Mesh::default()
        };
        ui.painter_at(rect).add(mesh);
    }

    /// Draws a disc for each handle, and one for a selected vertex.
    fn marks(&self, ui: &egui::Ui, rect: Rect) {
        let (Some(scene), Some(shape)) = (self.scene(), self.displayed()) else {
            return;
        };
        if self.jobs.map.is_some() {
            return;
        }
        let camera = self.camera.at(rect);
        let painter = ui.painter_at(rect);
        let palette = Style::dark().palette;
        let color = |tint: usize| {
            let [r, g, b] = palette[tint - 1];
            Color32::from_rgb(r, g, b)
        };
        for (index, group) in scene.handles.iter().enumerate() {
            let Some(at) = camera.project(group.center(&scene.rest)) else {
                continue;
            };
            let fill = match group.role {
                _ if self.active == Some(index) => color(6),
                Role::Fixed => color(5),
                Role::Movable => color(3),
            };
            match group.role {
                Role::Movable => {
                    painter.circle(at, MARK, fill, Stroke::new(1.5, Color32::WHITE));
                }
                Role::Fixed => {
                    let square = Rect::from_center_size(at, egui::Vec2::splat(1.6 * MARK));
                    let white = Stroke::new(1.5, Color32::WHITE);
                    painter.rect(square, 1.0, fill, white, StrokeKind::Middle);
                }
            }
        }
        if let [vertex] = self.selection.as_slice()
            && let Some(at) = shape.get(*vertex).and_then(|p| camera.project(*p))
        {
            painter.circle(at, 5.0, color(1), Stroke::new(1.0, Color32::BLACK));
        }
    }

    /// Draws the lasso, the brush, the colour bar, and information about the job.
    fn overlays(&mut self, ui: &egui::Ui, rect: Rect) {
        let painter = ui.painter_at(rect);
        let line = Stroke::new(1.5, ui.visuals().strong_text_color());
        if self.pick.polygon.len() > 1 {
            let points = self.pick.polygon.clone();
            painter.add(egui::Shape::closed_line(points, line));
        }
        let pointer = ui.input(|i| i.pointer.latest_pos());
        if let (Tool::Brush, Some(pos)) = (self.tool, pointer.filter(|p| rect.contains(*p))) {
            painter.circle_stroke(pos, *self.pick.brush_radius_mut(), line);
        }
        if let Some((_, scale, _)) = self.reading.as_ref().and_then(|r| r.colors.as_ref()) {
            color_bar(ui, rect, scale);
        }
        if let Some(task) = &self.task {
            let text = format!("{}…", task.name);
            let font = egui::FontId::proportional(18.0);
            let at = rect.center_top() + egui::vec2(0.0, 14.0);
            painter.text(at, egui::Align2::CENTER_TOP, text, font, line.color);
        }
    }
}

/// Draws a colour bar with rounded labels.
fn color_bar(ui: &egui::Ui, rect: Rect, scale: &cotan_tool::ColorScale) {
    let painter = ui.painter_at(rect);
    let height = (0.5 * rect.height()).clamp(80.0, 320.0);
    let corner = rect.right_bottom() - egui::vec2(96.0, height + 24.0);
    let bar = Rect::from_min_size(corner, egui::vec2(16.0, height));
    let text = ui.visuals().strong_text_color();
    let back = ui.visuals().panel_fill.gamma_multiply(0.85);
    let board = Rect::from_min_max(bar.min - egui::vec2(80.0, 30.0), rect.right_bottom());
    painter.rect_filled(board, 4.0, back);
    const STEPS: usize = 64;
    let slice = height / STEPS as f32;
    for k in 0..STEPS {
        let [r, g, b] = scale.color_at((k as f64 + 0.5) / STEPS as f64);
        let top = bar.bottom() - (k + 1) as f32 * slice;
        let part = Rect::from_min_size(egui::pos2(bar.left(), top), egui::vec2(16.0, slice + 0.5));
        painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    let font = egui::FontId::proportional(12.0);
    for (value, label) in scale.ticks() {
        if let Some(share) = scale.share(value) {
            let at = egui::pos2(bar.right() + 6.0, bar.bottom() - share as f32 * height);
            painter.text(at, egui::Align2::LEFT_CENTER, label, font.clone(), text);
        }
    }
    let at = egui::pos2(rect.right() - 8.0, bar.top() - 10.0);
    painter.text(at, egui::Align2::RIGHT_BOTTOM, scale.title(), font, text);
}

/// The radius of a handle's mark, in points.
const MARK: f32 = 7.0;

/// The largest distance at which a click picks a vertex, in points.
const PICK_RADIUS: f32 = 12.0;
