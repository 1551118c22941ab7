//! Turns that the handles of a flow are stated to make, which may be more than half a turn.

use std::f64::consts::PI;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexId;
use nalgebra::Vector3;

use crate::error::FlowError;
use crate::flow::Flow;
use crate::rule::Rule;
use crate::start::FirstGuess;
use crate::winding::{Winding, wind, winding};
use crate::workspace::Workspace;

/// The turns of handle vertices that are stated, as rotation vectors in radians: they may be more
/// than half a turn, which positions alone cannot tell.
pub(crate) type StatedTurns = Vec<(VertexId, Vector3<f64>)>;

impl<T: Scalar> Flow<T> {
    /// States by how much the handles turn at their current targets; see
    /// [`FlowBuilder::stated_turns`]. To be called after handles have moved, so that turns of more
    /// than half a turn are held: the energy then resists the collapse of a section that is wound
    /// up, and [`Report::lost_turn`] can tell whether the turns were kept. The shape is kept and
    /// follows in the next steps, unless a turn has changed by more than half a turn, which no
    /// shape can follow: then it is wound up anew from the original.
    ///
    /// Costs a solve if two handles turn by more than half a turn relative to each other.
    ///
    /// # Errors
    /// [`FlowError::Setting`] for a turn that is not finite, and what the system reports.
    pub fn state_turns(
        &mut self,
        turns: impl IntoIterator<Item = (VertexId, Vector3<f64>)>,
    ) -> Result<(), FlowError> {
        let mut stated: StatedTurns = turns.into_iter().collect();
        check_turns(&stated)?;
        stated.sort_by_key(|(v, _)| *v);
        let has_jumped = has_jumped(&self.stated, &stated);
        if has_jumped && let Some((shape, winding)) = wind(&mut self.work, &stated)? {
            begin_wound(&mut self.work, &mut *self.rule, &shape, winding)?;
        } else {
            self.rule.wind(winding(&mut self.work, &stated)?);
        }
        self.stated = stated;
        Ok(())
    }
}

/// Refuses stated turns that are not finite.
pub(crate) fn check_turns(stated: &StatedTurns) -> Result<(), FlowError> {
    match stated.iter().find(|(_, turn)| !turn.norm().is_finite()) {
        None => Ok(()),
        Some((_, turn)) => Err(FlowError::Setting {
            setting: "stated turn",
            range: "a finite angle",
            value: turn.norm(),
        }),
    }
}

/// Starts from a shape that is wound up with its handles, without the solve that usually follows
/// the start: it would unwind the shape.
pub(crate) fn begin_wound<T: Scalar>(
    work: &mut Workspace<T>,
    rule: &mut dyn Rule<T>,
    shape: &Positions<f64>,
    winding: Winding,
) -> Result<(), FlowError> {
    *work.current.write() = shape.map(|p| p.map(T::of_f64));
    work.first_guess = Some(FirstGuess {
        rotations: winding.rotations.clone(),
        scale: 1.0,
        swelling: None,
    });
    rule.begin(work)?;
    rule.wind(Some(winding));
    rule.update(work)?;
    work.since_move = 1;
    Ok(())
}

/// Returns `true` if a handle turns by more than half a turn from one list to the next. Both are
/// in the order of their vertices.
fn has_jumped(before: &StatedTurns, after: &StatedTurns) -> bool {
    let turn_before = |vertex| {
        let at = before.binary_search_by_key(&vertex, |(v, _)| *v);
        at.map_or_else(|_| Vector3::zeros(), |at| before[at].1)
    };
    let is_far = |(v, turn): &(VertexId, Vector3<f64>)| (turn - turn_before(*v)).norm() > PI;
    after.iter().any(is_far)
}
