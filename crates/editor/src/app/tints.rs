//! Tints of the vertices that are selected or held.

use cotan_workspace::Role;

use super::Editor;

impl Editor {
    /// Colours the selected and held vertices in the picture.
    pub(super) fn tint(&mut self) {
        let Some(model) = self.workspace.model() else {
            return;
        };
        let scene = model.scene();
        self.shown.hide(model, scene.hidden());
        let mut tints = vec![0_u8; model.mesh().num_vertices()];
        for (index, group) in scene.handles().iter().enumerate() {
            let tint = match group.role {
                _ if scene.props.is_active(index) => ACTIVE,
                Role::Fixed => FIXED,
                Role::Movable => MOVABLE,
            };
            group.vertices.iter().for_each(|v| tints[v.index()] = tint);
        }
        let selection = scene.selection().iter();
        selection.for_each(|v| tints[v.index()] = SELECTED);
        self.shown.renderer().set_tints(&tints);
    }
}

// Indices into the style's palette.
pub(super) const SELECTED: u8 = 1;
pub(super) const FIXED: u8 = 5;
pub(super) const MOVABLE: u8 = 3;
pub(super) const ACTIVE: u8 = 6;
