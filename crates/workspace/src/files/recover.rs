//! The model that a journal leads to.

use super::{LeftBehind, open, open_project, open_repaired};
use crate::effect::{Effect, Notice};
use crate::files::is_project;
use crate::model::Model;

/// Reads the mesh of a journal that was left behind, and carries out its commands.
///
/// # Errors
/// One sentence: the journal or its mesh cannot be read, or the two do not fit together.
pub(crate) fn recovered(left: &LeftBehind) -> Result<(Model, Vec<Effect>), String> {
    let found = left.read().map_err(|e| e.to_string())?;
    let model = match is_project(&left.mesh) {
        true => open_project(&left.mesh).map_err(|e| e.to_string())?,
        false => {
            let opened = match found.is_repaired {
                true => open_repaired(&left.mesh),
                false => open(&left.mesh),
            };
            Model::new(opened.map_err(|e| e.to_string())?)
        }
    };
    let mut model = match found.has_file {
        true => model,
        false => model.without_file(),
    };
    let scene = found.scene.scene(&model);
    let scene = scene.map_err(|problem| {
        let mesh = left.mesh.display();
        format!("{mesh}: the journal does not belong to this mesh: {problem}")
    })?;
    model.push_recovered(scene);
    let mut effects = Vec::new();
    let is_stale = found.has_file && !left.is_current();
    let mut told = Vec::new();
    if is_stale {
        told.push(format!(
            "{}: the file has changed since the crash; check it before you overwrite it.",
            left.mesh.display()
        ));
    }
    let refused = found.commands.iter().find_map(|c| model.record(c).err());
    if let Some(refused) = refused {
        told.push(format!(
            "the journal was followed up to a command that fails: {refused}"
        ));
    } else if found.is_cut {
        told.push("the last command was not written in full, and is missing".to_owned());
    }
    if !told.is_empty() {
        effects.push(Effect::Told(Notice::Note(told.join("\n"))));
    }
    Ok((model, effects))
}
