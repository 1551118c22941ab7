//! Everything that a person can do, as values.

mod entry;

use std::path::PathBuf;

use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use nalgebra::{Matrix4, Vector3};
use serde::{Deserialize, Serialize};

use crate::brush::Brush;
use crate::handle::{HandleGroup, Role};
use crate::mirror::Mirror;
use crate::plain;
use crate::selection::Combine;
use crate::settings::{Follow, Smooth};
use crate::shape::Shape;
use crate::transform::Transform;

pub(crate) use entry::Record;

/// Something that a person does, or a result that arrives.
///
/// [`Workspace::apply`](crate::Workspace::apply) carries it out. Those that change the scene are
/// recorded: the list of them gives the history, the recovery after a crash, and scripted tests.
/// Vertices are those of the surface, handles and masks are counted in the order of their lists.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Command {
    /// Selects vertices.
    Select {
        /// The vertices, in any order.
        #[serde(with = "plain::ids")]
        vertices: Vec<VertexId>,
        /// The combination with the selection.
        how: Combine,
    },
    /// Selects all vertices.
    SelectAll,
    /// Selects the vertices that are not selected.
    InvertSelection,
    /// Adds the neighbours of the selection.
    GrowSelection,
    /// Removes the vertices at the border of the selection.
    ShrinkSelection,
    /// Selects the connected parts that the selection touches.
    SelectLinked,
    /// Selects what is near the selection along the surface.
    SelectWithin {
        /// The distance, in the units of the model.
        distance: f64,
    },
    /// Selects the vertices of a handle.
    SelectHandle {
        /// The handle.
        handle: usize,
    },
    /// Hides the selection.
    HideSelection,
    /// Hides everything but the selection.
    HideOthers,
    /// Shows what was hidden.
    ShowAll,
    /// Holds the selection as a new handle, and takes its vertices from other handles.
    MakeHandle {
        /// Fixed or movable.
        role: Role,
    },
    /// Fixes the parts of the model that have neither a handle nor a selected vertex.
    FixTheRest,
    /// Fixes the open boundary, except where another handle holds it.
    FixBoundary,
    /// Lets go of the open boundary.
    FreeBoundary,
    /// Makes a handle the active one, or none.
    Activate {
        /// The handle.
        handle: Option<usize>,
    },
    /// Adds a handle to the active ones, which move together, or takes it away.
    ActivateToo {
        /// The handle.
        handle: usize,
    },
    /// Adds the selection to a handle, and takes its vertices from other handles.
    AddToHandle {
        /// The handle.
        handle: usize,
    },
    /// Takes the selection from a handle.
    TakeFromHandle {
        /// The handle.
        handle: usize,
    },
    /// Gives a handle another name.
    RenameHandle {
        /// The handle.
        handle: usize,
        /// The name.
        name: String,
    },
    /// Holds a handle exactly, or by springs.
    SetHold {
        /// The handle.
        handle: usize,
        /// The weight of the springs, or exactly.
        #[serde(with = "plain::hold")]
        hold: Hold,
    },
    /// Moves a handle, and lets the shape come to rest.
    MoveHandle {
        /// The handle.
        handle: usize,
        /// The motion from where the handle was made.
        #[serde(with = "plain::matrix")]
        motion: Matrix4<f64>,
        /// The rotation vector of that motion in radians, which may exceed half a turn.
        #[serde(with = "plain::vector")]
        turn: Vector3<f64>,
    },
    /// Moves several handles, and lets the shape come to rest.
    MoveHandles {
        /// The motions.
        moves: Vec<Moved>,
    },
    /// Removes a handle.
    RemoveHandle {
        /// The handle.
        handle: usize,
    },
    /// Removes all handles.
    RemoveAllHandles,
    /// Replaces all handles, and starts from the rest shape.
    SetHandles {
        /// The handles.
        handles: Vec<HandleGroup>,
    },
    /// Keeps the selection as a mask that restricts jobs.
    MakeMask {
        /// The name of the mask.
        name: String,
    },
    /// Restricts jobs to a mask, or to none.
    UseMask {
        /// The mask.
        mask: Option<usize>,
    },
    /// Selects the vertices of a mask.
    SelectMask {
        /// The mask.
        mask: usize,
    },
    /// Removes a mask.
    RemoveMask {
        /// The mask.
        mask: usize,
    },
    /// Changes how the surface follows its handles.
    SetFollow {
        /// The new settings.
        follow: Follow,
    },
    /// Changes how the surface will be smoothed. This is no step of the history.
    SetSmooth {
        /// The new settings.
        smooth: Smooth,
    },
    /// Changes the brush that paints the curvature field. This is no step of the history.
    SetBrush {
        /// The new settings.
        brush: Brush,
    },
    /// Changes how a map to the sphere is made. This is no step of the history.
    SetAreas {
        /// The share of areas against angles, from 0 to 1.
        areas: f64,
    },
    /// Changes the width over which jobs fade at the border of the selection, as a share of the
    /// longest side of the model's box. This is no step of the history.
    SetBorder {
        /// The share.
        border: f64,
    },
    /// Makes a vertex the one about which handles turn and scale, or none: then they do so about
    /// their middle. This is no step of the history.
    SetPivot {
        /// The vertex.
        #[serde(with = "plain::id")]
        vertex: Option<VertexId>,
    },
    /// Mirrors selections, handles and brushes across a plane, or no longer. This is no step of the
    /// history.
    SetMirror {
        /// The plane.
        mirror: Option<Mirror>,
    },
    /// Selects the mirror images of the selection.
    MirrorSelection,
    /// Returns to the rest shape, with the handles where they are made.
    ResetShape,
    /// A job has ended.
    Finish {
        /// The job.
        job: Job,
        /// The shape that it made.
        shape: Shape,
    },
    /// The solver has come to a shape.
    Arrive {
        /// The shape.
        shape: Shape,
        /// `true` if it is at rest.
        is_settled: bool,
    },
    /// Undoes one step.
    Undo,
    /// Repeats one step that was undone.
    Redo,
    /// Goes to a step of the history list; 0 is the opened model.
    GoTo {
        /// The index of the step.
        step: usize,
    },
    /// Lets the shape come to rest with the present handles.
    Settle,
    /// Stops the solver and keeps the shape.
    Stop,
    /// Grabs a handle.
    Grab {
        /// The handle.
        handle: usize,
    },
    /// Moves the handle that was grabbed; the shape follows.
    Drag {
        /// The motion from where the handle was made.
        #[serde(with = "plain::matrix")]
        motion: Matrix4<f64>,
    },
    /// Moves the handles that were grabbed by numbers, from where they were grabbed.
    DragBy {
        /// The transform.
        transform: Transform,
        /// The point about which it turns and scales; `None` for the pivot of the scene.
        pivot: Option<[f64; 3]>,
    },
    /// Moves the active handles by numbers.
    Transform {
        /// The transform.
        transform: Transform,
        /// The point about which it turns and scales; `None` for the pivot of the scene.
        pivot: Option<[f64; 3]>,
    },
    /// Finds the plane about which the opened shape is symmetric, and mirrors across it.
    FindMirror,
    /// Lets the handle go where it is: the drag becomes a step.
    Drop,
    /// Puts the handle back to where it was grabbed.
    CancelDrag,
    /// Smooths the shape with the present settings.
    Smooth,
    /// Smooths again, in place of the last smoothing if the present step is one.
    AdjustSmooth {
        /// The new settings.
        smooth: Smooth,
    },
    /// Scales the details, in place of the last scaling if the present step is one.
    ScaleDetails {
        /// The factor: 1 changes nothing, 0 flattens, 2 doubles.
        factor: f64,
    },
    /// Paints the curvature field with the present brush.
    Paint {
        /// The vertices that the stroke goes through.
        #[serde(with = "plain::ids")]
        stroke: Vec<VertexId>,
    },
    /// Maps the shape to the sphere and shows the map.
    MapToSphere,
    /// Shows a shape between the model and its map.
    Morph {
        /// 0 is the model, 1 the sphere.
        share: f64,
    },
    /// Makes the shape between the model and its map the shape of the model.
    KeepMorph,
    /// Shows the model again.
    LeaveMorph,
    /// Stops the running job.
    CancelJob,
    /// Opens a mesh or a project.
    Open {
        /// The file.
        path: PathBuf,
    },
    /// Opens a mesh and repairs it.
    OpenRepaired {
        /// The file.
        path: PathBuf,
    },
    /// Opens the sample.
    OpenSample,
    /// Reads handles from a file for `cotan deform`.
    ImportHandles {
        /// The file.
        path: PathBuf,
    },
    /// Writes the handles to a file for `cotan deform`.
    ExportHandles {
        /// The file.
        path: PathBuf,
    },
    /// Writes to the file that is open.
    Save,
    /// Writes the model to a file, which becomes the open one: a project if its name ends in
    /// `.cotan`, or a mesh.
    SaveAs {
        /// The file.
        path: PathBuf,
        /// The files that may be replaced.
        over: Over,
    },
    /// Writes the mesh to a file, which does not become the open one.
    ExportMesh {
        /// The file.
        path: PathBuf,
        /// The files that may be replaced.
        over: Over,
    },
    /// Gives up what was not saved.
    Discard,
}

/// The motion of a handle.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Moved {
    /// The handle.
    pub handle: usize,
    /// The motion from where the handle was made.
    #[serde(with = "plain::matrix")]
    pub motion: Matrix4<f64>,
    /// The rotation vector of that motion in radians, which may exceed half a turn.
    #[serde(with = "plain::vector")]
    pub turn: Vector3<f64>,
}

/// The files that a save may replace.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Over {
    /// The open file if it is unchanged, or nothing.
    Own,
    /// Any file.
    Any,
}

/// A job that makes a new shape.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Job {
    /// Smoothing.
    Smooth(Smooth),
    /// Smoothing in place of the last one.
    SmoothAgain(Smooth),
    /// Scaling of details by a factor.
    Details(f64),
    /// A shape between the model and its map to the sphere.
    Morph(f64),
    /// A stroke of the brush.
    Paint(Brush),
}
