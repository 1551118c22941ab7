//! The treatment of commands by the history.

use super::Command;

/// The treatment of a command by the history.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Record {
    /// A new step.
    Step,
    /// A new step, or a part of the present one if that is a selection too.
    Selection,
    /// A change of the present step.
    InPlace,
    /// A move in the history.
    Travel,
    /// Not recorded: it leads to other commands, or to no change.
    Nothing,
}

impl Command {
    /// The entry of the command in the history.
    pub(crate) fn record(&self) -> Record {
        match self {
            Self::Select { .. }
            | Self::SelectAll
            | Self::InvertSelection
            | Self::GrowSelection
            | Self::ShrinkSelection
            | Self::SelectLinked
            | Self::SelectWithin { .. }
            | Self::SelectHandle { .. }
            | Self::SelectMask { .. }
            | Self::MirrorSelection
            | Self::Activate { .. }
            | Self::ActivateToo { .. } => Record::Selection,
            Self::HideSelection
            | Self::HideOthers
            | Self::ShowAll
            | Self::MakeHandle { .. }
            | Self::FixTheRest
            | Self::FixBoundary
            | Self::FreeBoundary
            | Self::RenameHandle { .. }
            | Self::SetHold { .. }
            | Self::AddToHandle { .. }
            | Self::TakeFromHandle { .. }
            | Self::MoveHandle { .. }
            | Self::MoveHandles { .. }
            | Self::RemoveHandle { .. }
            | Self::RemoveAllHandles
            | Self::SetHandles { .. }
            | Self::MakeMask { .. }
            | Self::UseMask { .. }
            | Self::RemoveMask { .. }
            | Self::SetFollow { .. }
            | Self::ResetShape
            | Self::Finish { .. } => Record::Step,
            Self::SetSmooth { .. }
            | Self::SetBrush { .. }
            | Self::SetAreas { .. }
            | Self::SetBorder { .. }
            | Self::SetPivot { .. }
            | Self::SetMirror { .. }
            | Self::Arrive { .. } => Record::InPlace,
            Self::Undo | Self::Redo | Self::GoTo { .. } => Record::Travel,
            Self::Settle
            | Self::Stop
            | Self::Grab { .. }
            | Self::Drag { .. }
            | Self::DragBy { .. }
            | Self::Transform { .. }
            | Self::FindMirror
            | Self::Drop
            | Self::CancelDrag
            | Self::Smooth
            | Self::AdjustSmooth { .. }
            | Self::ScaleDetails { .. }
            | Self::Paint { .. }
            | Self::MapToSphere
            | Self::Morph { .. }
            | Self::KeepMorph
            | Self::LeaveMorph
            | Self::CancelJob
            | Self::Open { .. }
            | Self::OpenRepaired { .. }
            | Self::OpenSample
            | Self::ImportHandles { .. }
            | Self::ExportHandles { .. }
            | Self::Save
            | Self::SaveAs { .. }
            | Self::ExportMesh { .. }
            | Self::Discard => Record::Nothing,
        }
    }
}
