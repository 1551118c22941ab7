//! Pictures of the window's part that shows the mesh.

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;

use super::Editor;
use super::dialogs::Message;

impl Editor {
    /// Requests a screenshot of the window, which arrives in a later frame.
    pub(super) fn request_picture(&mut self, ctx: &egui::Context, path: PathBuf) {
        let data = egui::UserData::new(path);
        ctx.send_viewport_cmd(egui::ViewportCommand::Screenshot(data));
    }

    /// Writes the part of the screenshot that shows the mesh.
    pub(super) fn take_picture(&mut self, ctx: &egui::Context, rect: egui::Rect) {
        let taken = ctx.input(|i| {
            i.events.iter().find_map(|event| match event {
                egui::Event::Screenshot {
                    image, user_data, ..
                } => {
                    let path = user_data.data.as_ref()?.downcast_ref::<PathBuf>()?;
                    Some((Arc::clone(image), path.clone()))
                }
                _ => None,
            })
        });
        let Some((image, path)) = taken else {
            return;
        };
        let part = image.region(&rect, Some(ctx.pixels_per_point()));
        let written = png_of(&part)
            .map_err(|e| e.to_string())
            .and_then(|bytes| self.workspace.write_beside("the picture", &path, &bytes));
        match written {
            Ok(()) => self.dialogs.note = Some(format!("saved {}", path.display())),
            Err(problem) => self.tell(Message::error(problem)),
        }
    }
}

fn png_of(image: &egui::ColorImage) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let [width, height] = image.size.map(|s| u32::try_from(s).unwrap_or(u32::MAX));
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header()?;
    let pixels: Vec<u8> = image
        .pixels
        .iter()
        .flat_map(|p| [p.r(), p.g(), p.b()])
        .collect();
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}
