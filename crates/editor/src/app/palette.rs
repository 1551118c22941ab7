//! The palette: every action, found by typing a part of its name.

use eframe::egui::{self, Key};

use super::Editor;
use super::actions::found;

/// The open palette.
#[derive(Default)]
pub(super) struct Palette {
    query: String,
    /// The index of the chosen line.
    chosen: usize,
}

impl Editor {
    pub(super) fn show_palette(&mut self, ctx: &egui::Context) {
        let Some(mut palette) = self.dialogs.palette.take() else {
            return;
        };
        let (up, down, enter) = ctx.input(|i| {
            let pressed = |key| i.key_pressed(key);
            (
                pressed(Key::ArrowUp),
                pressed(Key::ArrowDown),
                pressed(Key::Enter),
            )
        });
        let actions = found(&palette.query);
        let last = actions.len().saturating_sub(1);
        palette.chosen = match (up, down) {
            (true, _) => palette.chosen.saturating_sub(1),
            (_, true) => palette.chosen + 1,
            _ => palette.chosen,
        }
        .min(last);
        let mut run = actions.get(palette.chosen).filter(|_| enter).copied();
        let modal = egui::Modal::new(egui::Id::new("palette")).show(ctx, |ui| {
            ui.set_width(360.0);
            let field = egui::TextEdit::singleline(&mut palette.query).hint_text("What to do?");
            let field = ui.add(field.desired_width(f32::INFINITY));
            field.request_focus();
            if field.changed() {
                palette.chosen = 0;
            }
            egui::ScrollArea::vertical()
                .max_height(320.0)
                .show(ui, |ui| {
                    for (line, action) in actions.iter().enumerate() {
                        let button = egui::Button::new(action.name)
                            .shortcut_text(action.keys)
                            .selected(line == palette.chosen)
                            .min_size(egui::vec2(340.0, 0.0));
                        let button = ui.add(button);
                        if line == palette.chosen && (up || down) {
                            button.scroll_to_me(None);
                        }
                        if button.clicked() {
                            run = Some(*action);
                        }
                    }
                });
        });
        match run {
            Some(action) => action.run(self, ctx),
            None if modal.should_close() => {}
            None => self.dialogs.palette = Some(palette),
        }
    }
}
