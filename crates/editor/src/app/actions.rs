//! The actions of the menus and of the palette: a name, its keys, and what it does.

use cotan_workspace::{Combine, Command, Kind, Role};
use eframe::egui;

use super::Editor;
use super::dialogs::Purpose;
use super::files::Then;
use super::pointer::{GizmoTool, Tool};
use crate::view::{Shading, StandardView, UpAxis};

/// An action of a menu, which the palette lists as well.
#[derive(Clone, Copy)]
pub(super) struct Action {
    pub(super) name: &'static str,
    /// The shortcut, or nothing.
    pub(super) keys: &'static str,
    run: fn(&mut Editor, &egui::Context),
}

const fn action(
    name: &'static str,
    keys: &'static str,
    run: fn(&mut Editor, &egui::Context),
) -> Action {
    Action { name, keys, run }
}

impl Action {
    pub(super) fn run(&self, editor: &mut Editor, ctx: &egui::Context) {
        (self.run)(editor, ctx);
    }

    /// Returns true if every word of a query is in the name, in any case and order.
    fn matches(&self, query: &str) -> bool {
        let name = self.name.to_lowercase();
        let mut words = query.split_whitespace();
        words.all(|word| name.contains(&word.to_lowercase()))
    }
}

/// The actions whose names contain the words of a query, in the order of the menus.
pub(super) fn found(query: &str) -> Vec<Action> {
    let all = [FILE, EDIT, SELECT, HIDE, VIEW, TOOLS].concat();
    all.into_iter().filter(|a| a.matches(query)).collect()
}

pub(super) const FILE: &[Action] = &[
    action("Open…", "Ctrl O", |e, ctx| {
        e.after_saving(ctx, Then::ChooseFile)
    }),
    action("Open the sample", "", |e, ctx| {
        e.after_saving(ctx, Then::OpenSample)
    }),
    action("Open again, repaired", "", |e, ctx| {
        e.after_saving(ctx, Then::OpenRepaired)
    }),
    action("Save", "Ctrl S", |e, _| e.run(Command::Save)),
    action("Save as…", "Ctrl Shift S", |e, _| {
        e.choose(Purpose::SaveModel)
    }),
    action("Export the mesh…", "", |e, _| {
        e.choose(Purpose::ExportMesh)
    }),
    action("Save the picture…", "", |e, _| {
        e.choose(Purpose::SavePicture)
    }),
    action("Load handles…", "", |e, _| e.choose(Purpose::OpenHandles)),
    action("Save handles…", "", |e, _| e.choose(Purpose::SaveHandles)),
    action("Quit", "", |e, ctx| e.after_saving(ctx, Then::Close)),
];

pub(super) const EDIT: &[Action] = &[
    action("Undo", "Ctrl Z", |e, _| e.travel(Command::Undo)),
    action("Redo", "Ctrl Shift Z", |e, _| e.travel(Command::Redo)),
    action("Make a handle of the selection", "H", |e, _| {
        e.make_handle(Role::Movable)
    }),
    action("Fix the selection", "X", |e, _| e.make_handle(Role::Fixed)),
    action("Fix the other parts", "", |e, _| e.run(Command::FixTheRest)),
    action("Fix the open boundary", "", |e, _| {
        e.run(Command::FixBoundary)
    }),
    action("Let go of the open boundary", "", |e, _| {
        e.run(Command::FreeBoundary)
    }),
    action("Let go of the active handles", "Delete", |e, _| {
        e.remove_active()
    }),
    action("Let go of all handles", "", |e, _| {
        e.run(Command::RemoveAllHandles)
    }),
    action("Settle or stop", "Space", |e, _| e.settle_or_stop()),
    action("Back to the rest shape", "", |e, _| {
        e.run(Command::ResetShape)
    }),
];

pub(super) const SELECT: &[Action] = &[
    action("Select all", "Ctrl A", |e, _| e.run(Command::SelectAll)),
    action("Select nothing", "Esc", |e, _| {
        e.run(Command::Select {
            vertices: Vec::new(),
            how: Combine::Replace,
        });
    }),
    action("Invert the selection", "Ctrl I", |e, _| {
        e.run(Command::InvertSelection)
    }),
    action("Grow the selection", "+", |e, _| {
        e.run(Command::GrowSelection)
    }),
    action("Shrink the selection", "−", |e, _| {
        e.run(Command::ShrinkSelection)
    }),
    action("Select the mirror image", "", |e, _| {
        e.run(Command::MirrorSelection)
    }),
    action("Select all that is linked", "Ctrl L", |e, _| {
        e.run(Command::SelectLinked)
    }),
];

pub(super) const HIDE: &[Action] = &[
    action("Hide the selection", "Ctrl H", |e, _| {
        e.run(Command::HideSelection)
    }),
    action("Isolate the selection", "Shift H", |e, _| {
        e.run(Command::HideOthers)
    }),
    action("Show everything", "Ctrl Shift H", |e, _| {
        e.run(Command::ShowAll)
    }),
];

pub(super) const VIEW: &[Action] = &[
    action("Fit the view", "F", |e, _| e.fit()),
    action("View from the front", "1", |e, _| {
        e.shown.camera.look_from(StandardView::Front)
    }),
    action("View from the back", "Shift 1", |e, _| {
        e.shown.camera.look_from(StandardView::Back)
    }),
    action("View from the right", "3", |e, _| {
        e.shown.camera.look_from(StandardView::Right)
    }),
    action("View from the left", "Shift 3", |e, _| {
        e.shown.camera.look_from(StandardView::Left)
    }),
    action("View from the top", "7", |e, _| {
        e.shown.camera.look_from(StandardView::Top)
    }),
    action("View from below", "Shift 7", |e, _| {
        e.shown.camera.look_from(StandardView::Bottom)
    }),
    action("View obliquely", "0", |e, _| {
        e.shown.camera.look_from(StandardView::Oblique)
    }),
    action("Y is up", "", |e, _| e.shown.camera.set_up(UpAxis::Y)),
    action("Z is up", "", |e, _| e.shown.camera.set_up(UpAxis::Z)),
    action("Show the shape as it was opened", "C", |e, _| {
        e.shown.looks.is_before = !e.shown.looks.is_before;
    }),
    action("Wireframe", "Z", |e, _| {
        e.shown.looks.has_wireframe = !e.shown.looks.has_wireframe;
    }),
    action("Flat or smooth shading", "V", |e, _| {
        e.shown.looks.shading = match e.shown.looks.shading {
            Shading::Smooth => Shading::Flat,
            Shading::Flat => Shading::Smooth,
        };
    }),
    action("Next light: studio, at the eye, clay", "J", |e, _| {
        e.shown.looks.light = e.shown.looks.light.next();
    }),
    action("Normals", "N", |e, _| {
        e.shown.looks.has_normals = !e.shown.looks.has_normals;
    }),
    action("Keys and pointer", "F1", |e, _| e.dialogs.has_help = true),
];

pub(super) const TOOLS: &[Action] = &[
    action("Select by click", "Q", |e, _| e.pointer.tool = Tool::Select),
    action("Select by brush", "B", |e, _| e.pointer.tool = Tool::Brush),
    action("Select by lasso", "L", |e, _| e.pointer.tool = Tool::Lasso),
    action("Move by numbers", "G", |e, ctx| {
        e.begin_typing(Kind::Move, ctx)
    }),
    action("Turn by numbers", "R", |e, ctx| {
        e.begin_typing(Kind::Turn, ctx)
    }),
    action("Scale by numbers", "S", |e, ctx| {
        e.begin_typing(Kind::Scale, ctx)
    }),
    action("Mirror on or off", "M", |e, _| e.switch_mirror()),
    action("Pivot in the middle of the handle", "", |e, _| {
        e.run(Command::SetPivot { vertex: None });
    }),
    action("Gizmo moves", "W", |e, _| {
        e.pointer.gizmo_tool = GizmoTool::Move
    }),
    action("Gizmo rotates", "E", |e, _| {
        e.pointer.gizmo_tool = GizmoTool::Rotate
    }),
    action("Gizmo scales", "T", |e, _| {
        e.pointer.gizmo_tool = GizmoTool::Scale
    }),
    action("Smooth", "", |e, _| e.run(Command::Smooth)),
    action("Map to the sphere", "", |e, _| e.run(Command::MapToSphere)),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn actions_are_found_by_words_in_any_order_and_names_and_keys_are_unique() {
        let names: Vec<&str> = found("SELECTION the").iter().map(|a| a.name).collect();
        assert!(names.contains(&"Hide the selection") && names.contains(&"Fix the selection"));
        assert!(!names.contains(&"Undo"));
        assert!(found("no such action").is_empty());
        let all = found("");
        let names: BTreeSet<&str> = all.iter().map(|a| a.name).collect();
        assert_eq!(names.len(), all.len());
        let keys: Vec<&str> = all
            .iter()
            .map(|a| a.keys)
            .filter(|k| !k.is_empty())
            .collect();
        assert_eq!(keys.iter().collect::<BTreeSet<_>>().len(), keys.len());
    }
}
