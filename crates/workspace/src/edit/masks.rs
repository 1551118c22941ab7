//! Edits of masks.

use super::{Edit, Made};
use crate::command::Command;
use crate::mask::NamedMask;
use crate::refused::{After, Refused};

impl Edit<'_> {
    pub(super) fn masks(&self, command: &Command) -> Result<Made, Refused> {
        let (label, scene) = match command {
            Command::MakeMask { name } => {
                let region = self.selected()?;
                let surface = self.model.surface(&self.before.shape);
                let border = self.model.side() * self.before.settings().border;
                let made = NamedMask::inside(name.clone(), &surface, region, border);
                let made = made.map_err(|error| Refused::Library(error.to_string()))?;
                let scene = self.before.with(|props| {
                    props.masks.push(made);
                    props.mask = Some(props.masks.len() - 1);
                    props.selection.clear();
                });
                (format!("Mask {name}"), scene)
            }
            Command::UseMask { mask } => {
                if let Some(mask) = mask {
                    self.mask(*mask)?;
                }
                let scene = self.before.with(|props| props.mask = *mask);
                ("Choose a mask".to_owned(), scene)
            }
            Command::RemoveMask { mask } => {
                let label = format!("Remove the mask {}", self.mask(*mask)?.name);
                let scene = self.before.with(|props| {
                    props.masks.remove(*mask);
                    props.mask = match props.mask {
                        Some(used) if used > *mask => Some(used - 1),
                        Some(used) if used == *mask => None,
                        used => used,
                    };
                });
                (label, scene)
            }
            _ => return Err(Refused::NotRecorded),
        };
        Ok((scene, label, After::Nothing))
    }
}
