//! The goals of the solver.

use std::sync::Arc;
use std::time::Instant;

use cotan_io::ProcessingMesh;

use super::Pace;
use crate::handle::HandleGroup;
use crate::scene::Props;
use crate::shape::Shape;

/// The shape that the solver should reach.
#[derive(Clone, Debug)]
pub(super) struct Goal {
    /// Increases with every goal, and is repeated in its updates.
    pub(super) tag: u64,
    pub(super) mesh: Arc<ProcessingMesh>,
    /// The rest shape of the deformation. No two models share one.
    pub(super) rest: Shape,
    /// The handles and the settings.
    pub(super) props: Arc<Props>,
    /// The shape to start from, if not the solver's own.
    pub(super) shape: Option<Shape>,
    pub(super) pace: Pace,
    /// The time of the pointer event.
    pub(super) posted: Instant,
}

impl Goal {
    pub(super) fn handles(&self) -> &[HandleGroup] {
        &self.props.handles
    }

    /// Returns `true` if the factorization for another goal can be reused.
    pub(super) fn has_system_of(&self, other: &Self) -> bool {
        let follow = &self.props.settings.follow;
        let has_same_region = || {
            let held = |goal: &Self| -> Vec<_> {
                let groups = goal.handles().iter();
                groups.map(|g| (g.role, g.vertices.clone())).collect()
            };
            follow.influence.is_none() || held(self) == held(other)
        };
        self.rest.is(&other.rest) && *follow == other.props.settings.follow && has_same_region()
    }
}
