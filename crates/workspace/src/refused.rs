//! The outcome of a command apart from its scene: a refusal, or what the solver is to do.

use thiserror::Error;

/// The reason why a command was not carried out.
#[derive(Clone, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum Refused {
    /// No model is open.
    #[error("open a model first")]
    NoModel,
    /// Nothing is selected.
    #[error("nothing is selected: select a region first")]
    NothingSelected,
    /// There is no handle of this index.
    #[error("there is no handle {0}")]
    NoHandle(usize),
    /// No handle is active.
    #[error("no handle is active: choose one first")]
    NoActiveHandle,
    /// The mirror is off.
    #[error("the mirror is off: switch it on first")]
    NoMirror,
    /// There is no mask of this index.
    #[error("there is no mask {0}")]
    NoMask(usize),
    /// There is no vertex of this index.
    #[error("there is no vertex {0}")]
    NoVertex(usize),
    /// A number is out of its range.
    #[error("{0}")]
    Number(String),
    /// The shape has another number of vertices than the model, or is not finite.
    #[error("the shape is not one of this model")]
    OtherShape,
    /// The library refuses.
    #[error("{0}")]
    Library(String),
    /// The command is not one that is recorded.
    #[error("this command is no step of the history")]
    NotRecorded,
}

/// The task of the solver after a command.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum After {
    /// Nothing.
    Nothing,
    /// Take up the new handles, which hold a shape that is at rest already.
    Hold,
    /// Let the shape come to rest.
    Settle,
    /// Show the shape, which does not continue the one before.
    Show,
}
