//! The part of the window that shows the mesh: navigation, marks and the gizmo.

use std::sync::Arc;

use cotan_workspace::{Role, lock};
use eframe::egui::{self, Color32, PointerButton, Pos2, Rect, Sense, Stroke, StrokeKind};
use eframe::egui_glow;
use transform_gizmo_egui::{EnumSet, GizmoConfig, GizmoInteraction, GizmoMode, GizmoOrientation};

use super::Editor;
use super::pointer::{GizmoTool, MARK, Tool};
use super::tints::{ACTIVE, FIXED, MOVABLE, SELECTED};
use crate::view::{CameraSnapshot, Style};

impl Editor {
    pub(super) fn viewport(&mut self, ui: &mut egui::Ui) {
        egui::CentralPanel::no_frame().show_inside(ui, |ui| {
            let (rect, response) =
                ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
            if rect.width() < 2.0 || rect.height() < 2.0 {
                return;
            }
            let seconds = f64::from(ui.input(|i| i.stable_dt));
            if self.shown.camera.advance(seconds.min(0.1)) {
                ui.ctx().request_repaint();
            }
            if self.workspace.model().is_some() && !self.dialogs.is_open() {
                self.navigate(ui, &response, rect);
                if !self.follow_hand(ui, rect) && !self.shown.looks.is_before {
                    self.act(ui, &response, rect);
                }
            }
            self.pointer.viewport = rect;
            self.paint(ui, rect);
            if self.workspace.model().is_some() {
                self.gizmo_and_marks(ui, &response, rect);
                self.overlays(ui, rect);
                self.first_hint(ui, rect);
                self.offer(ui, rect);
            } else {
                self.start_page(ui, rect);
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
            self.shown.camera.pan(delta, rect);
        } else if is_middle || (is_left && (alt || self.pointer.is_orbiting)) {
            self.shown.camera.orbit(delta);
        }
        if let Some(pos) = response.hover_pos() {
            let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta.y, i.zoom_delta()));
            let factor = f64::from(scroll / 200.0).exp() * f64::from(pinch);
            if (factor - 1.0).abs() > 1e-6 {
                self.shown.camera.zoom(factor, pos, rect);
                ui.ctx().request_repaint();
            }
        }
    }

    /// Draws the mesh.
    fn paint(&mut self, ui: &egui::Ui, rect: Rect) {
        let style = self.style(ui);
        if let (Some(model), Some(shape)) = (self.workspace.model(), self.workspace.shown()) {
            let bounds = model.surface(shape).bounding_box();
            self.shown.camera.set_scene(&bounds);
        }
        let camera: CameraSnapshot = self.shown.camera.at(rect);
        let renderer = self.shown.shared_renderer();
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
        style.shading = self.shown.looks.shading;
        style.light = self.shown.looks.light;
        style.wireframe = self.shown.looks.has_wireframe.then_some(line);
        style.normals = self.shown.looks.has_normals.then_some([0, 114, 178]);
        style
    }

    pub(super) fn is_gizmo_shown(&self) -> bool {
        let is_free = matches!(&self.pointer.drag, Some(drag) if !drag.is_by_gizmo());
        let active = self.scene().and_then(|scene| scene.active());
        self.workspace.morph().is_none()
            && !self.shown.looks.is_before
            && self.pointer.hand.is_none()
            && !is_free
            && active.is_some_and(|group| group.role == Role::Movable)
    }

    fn gizmo_and_marks(&mut self, ui: &egui::Ui, response: &egui::Response, rect: Rect) {
        self.marks(ui, rect);
        if !self.is_gizmo_shown() {
            return;
        }
        let Some(transform) = self.gizmo_transform() else {
            return;
        };
        let does_snap = ui.input(|i| i.modifiers.command);
        let step = self.workspace.model().map_or(0.1, |m| m.snap_length());
        let config = GizmoConfig {
            modes: self.gizmo_modes(),
            // The axes are those of the transform.
            orientation: GizmoOrientation::Local,
            snapping: does_snap,
            snap_angle: 15_f32.to_radians(),
            snap_distance: step as f32,
            snap_scale: 0.1,
            ..self
                .shown
                .camera
                .gizmo_config(rect, ui.ctx().pixels_per_point())
        };
        self.pointer.gizmo.update_config(config);
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
        let result = self.pointer.gizmo.update(interaction, &[transform]);
        if let Some((_, transforms)) = result
            && let Some(new) = transforms.first()
            && down
        {
            if self.pointer.drag.is_none()
                && let Some(active) = self.scene().and_then(|scene| scene.props.active)
            {
                self.grab_gizmo(active);
            }
            self.gizmo_to(*new);
        }
        self.draw_gizmo(ui, rect);
    }

    fn gizmo_modes(&self) -> EnumSet<GizmoMode> {
        match self.pointer.gizmo_tool {
            GizmoTool::Move => GizmoMode::all_translate(),
            GizmoTool::Rotate => GizmoMode::all_rotate(),
            GizmoTool::Scale => GizmoMode::all_scale(),
        }
    }

    fn draw_gizmo(&self, ui: &egui::Ui, rect: Rect) {
        let drawn = self.pointer.gizmo.draw();
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
        let (Some(scene), Some(shape)) = (self.scene(), self.workspace.shown()) else {
            return;
        };
        if self.workspace.morph().is_some() || self.shown.looks.is_before {
            return;
        }
        let camera = self.shown.camera.at(rect);
        let painter = ui.painter_at(rect);
        let palette = Style::dark().palette;
        let color = |tint: u8| {
            let [r, g, b] = palette[usize::from(tint) - 1];
            Color32::from_rgb(r, g, b)
        };
        for (index, group) in scene.handles().iter().enumerate() {
            let Some(at) = camera.project(group.center(scene.rest.positions())) else {
                continue;
            };
            let fill = match group.role {
                _ if scene.props.is_active(index) => color(ACTIVE),
                Role::Fixed => color(FIXED),
                Role::Movable => color(MOVABLE),
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
        if let Some(at) = (scene.props.pivot)
            .and_then(|v| shape.get(v))
            .and_then(|p| camera.project(*p))
        {
            let line = Stroke::new(1.5, color(ACTIVE));
            painter.circle_stroke(at, MARK, line);
            painter.hline(at.x - 12.0..=at.x + 12.0, at.y, line);
            painter.vline(at.x, at.y - 12.0..=at.y + 12.0, line);
        }
        if let [vertex] = scene.selection()
            && let Some(at) = shape.get(*vertex).and_then(|p| camera.project(*p))
        {
            painter.circle(at, 5.0, color(SELECTED), Stroke::new(1.0, Color32::BLACK));
        }
    }

    /// Draws the lasso, the brush, the colour bar, and information about the job.
    fn overlays(&mut self, ui: &egui::Ui, rect: Rect) {
        let painter = ui.painter_at(rect);
        let line = Stroke::new(1.5, ui.visuals().strong_text_color());
        if self.pointer.polygon.len() > 1 {
            let points = self.pointer.polygon.clone();
            painter.add(egui::Shape::closed_line(points, line));
        }
        let pointer = ui.input(|i| i.pointer.latest_pos());
        if let (Tool::Brush, Some(pos)) = (self.pointer.tool, pointer.filter(|p| rect.contains(*p)))
        {
            painter.circle_stroke(pos, self.pointer.brush_radius, line);
        }
        if let (Tool::Paint, Some(pos)) = (self.pointer.tool, pointer.filter(|p| rect.contains(*p)))
            && let Some(radius) = self.paint_radius(pos, rect)
        {
            painter.circle_stroke(pos, radius, line);
        }
        if let Some((_, scale, _)) = self.shown.reading().and_then(|r| r.colors.as_ref()) {
            color_bar(ui, rect, scale);
        }
        if let Some((name, _)) = self.workspace.job() {
            let text = format!("{name}…");
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
