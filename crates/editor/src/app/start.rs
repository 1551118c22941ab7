//! The page that is shown while no model is open, the first hints, and offers.

use cotan_workspace::Command;
use eframe::egui::{self, Align2, Rect};

use super::Editor;
use super::files::Then;

impl Editor {
    /// Recent files, *open*, and where to drop a file.
    pub(super) fn start_page(&mut self, ui: &egui::Ui, rect: Rect) {
        if self.workspace.job().is_some() {
            return;
        }
        let ctx = ui.ctx().clone();
        let recent = self.workspace.recent().files().to_vec();
        let mut then = None;
        let mut marks = Vec::new();
        let area = egui::Area::new(egui::Id::new("start"))
            .order(egui::Order::Middle)
            .constrain_to(rect)
            .anchor(
                Align2::CENTER_CENTER,
                rect.center() - ctx.content_rect().center(),
            );
        area.show(&ctx, |ui| {
            ui.set_max_width(420.0);
            ui.heading("Drop a file here");
            ui.horizontal(|ui| {
                let open = ui.button("Open…");
                marks.push(("start-open".to_owned(), open.rect));
                if open.clicked() {
                    then = Some(Then::ChooseFile);
                }
                let sample = ui.button("Open the sample");
                marks.push(("start-sample".to_owned(), sample.rect));
                if sample.clicked() {
                    then = Some(Then::OpenSample);
                }
            });
            if !recent.is_empty() {
                ui.add_space(8.0);
                ui.label("Recent files");
            }
            for (k, path) in recent.into_iter().enumerate() {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let shown = path.display().to_string();
                let link = ui.link(cotan_io::printable(&name));
                let link = link.on_hover_text(cotan_io::printable(&shown));
                marks.push((format!("recent-{k}"), link.rect));
                if link.clicked() {
                    then = Some(Then::Open(path));
                }
            }
        });
        for (name, rect) in marks {
            self.mark(&name, rect);
        }
        if let Some(then) = then {
            self.after_saving(&ctx, then);
        }
    }

    /// The files of the menu *Open recent*.
    pub(super) fn recent_menu(&mut self, ui: &mut egui::Ui, ctx: &egui::Context) {
        for path in self.workspace.recent().files().to_vec() {
            let shown = path.display().to_string();
            if ui.button(cotan_io::printable(&shown)).clicked() {
                self.after_saving(ctx, Then::Open(path));
            }
        }
    }

    /// The next of three steps, until the first handle has been dragged.
    pub(super) fn first_hint(&mut self, ui: &egui::Ui, rect: Rect) {
        let Some(scene) = self.scene().filter(|_| !self.dialogs.is_hint_closed) else {
            return;
        };
        let has_moved = scene
            .handles()
            .iter()
            .any(|g| g.matrix != nalgebra::Matrix4::identity());
        let is_movable = scene
            .handles()
            .iter()
            .any(|g| g.role == cotan_workspace::Role::Movable);
        let hint = match scene.handles().len() {
            _ if has_moved => {
                self.dialogs.is_hint_closed = true;
                return;
            }
            0 => "1 of 3: select what is to stay (click, or B and paint), and press X to fix it.",
            _ if !is_movable => "2 of 3: select what is to move, and press H to make a handle.",
            _ => "3 of 3: drag the round mark. The surface follows.",
        };
        let mut is_closed = false;
        bar(ui, "hint", rect, Align2::CENTER_BOTTOM, |ui| {
            ui.label(hint);
            is_closed = ui.small_button("✖").clicked();
        });
        self.dialogs.is_hint_closed |= is_closed;
    }

    /// A warning with its ways out.
    pub(super) fn offer(&mut self, ui: &egui::Ui, rect: Rect) {
        let Some((text, ways)) = self.dialogs.offer.take() else {
            return;
        };
        let mut answer: Option<Option<Command>> = None;
        let mut marks = Vec::new();
        bar(ui, "offer", rect, Align2::CENTER_TOP, |ui| {
            ui.label(&text);
            for (k, (name, command)) in ways.iter().enumerate() {
                let button = ui.button(*name);
                marks.push((format!("offer-{k}"), button.rect));
                if button.clicked() {
                    answer = Some(Some(command.clone()));
                }
            }
            if ui.small_button("✖").clicked() {
                answer = Some(None);
            }
        });
        for (name, rect) in marks {
            self.mark(&name, rect);
        }
        match answer {
            Some(command) => command.into_iter().for_each(|c| self.run(c)),
            None => self.dialogs.offer = Some((text, ways)),
        }
    }
}

/// A line of widgets at a side of the picture, in front of it.
pub(super) fn bar(
    ui: &egui::Ui,
    name: &str,
    rect: Rect,
    side: Align2,
    content: impl FnOnce(&mut egui::Ui),
) {
    let (at, shift) = match side {
        Align2::CENTER_BOTTOM => (rect.center_bottom(), egui::vec2(0.0, -14.0)),
        _ => (rect.center_top(), egui::vec2(0.0, 14.0)),
    };
    egui::Area::new(egui::Id::new(name))
        .order(egui::Order::Middle)
        .pivot(side)
        .fixed_pos(at + shift)
        .constrain_to(rect)
        .show(ui.ctx(), |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.horizontal(content);
            });
        });
}
