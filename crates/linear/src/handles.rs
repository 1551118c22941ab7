//! Which vertices are held, and how firmly.

use cotan_halfedge::VertexId;

use crate::components::GraphComponents;
use crate::error::LinearError;
use crate::ties::Ties;

/// The way in which a handle vertex is held at its target.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Hold {
    /// Exactly: the vertex is eliminated from the system. The best conditioned choice.
    ///
    /// Its own row of L stays among those whose squares are summed. The sum |Lx − ℓ|² is minimised
    /// over *all* rows, with x given at hard handles, so that a field with ℓ = 0 is biharmonic
    /// around them. To meet the rows of the free vertices exactly and drop the others, take a
    /// [`LinearSystem`](crate::LinearSystem).
    #[default]
    Hard,
    /// By a spring: the term k²|x − u|² of equation 3, k relative to the mean |L_ii|.
    ///
    /// k = 1 leaves handles off by about 2e-4 of the bounding box, k = 10 by 2e-6, k = 100 by
    /// 2e-8; below 0.1 they are visibly missed.
    Soft(f64),
}

/// A vertex that is held at a target position.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Handle {
    /// The vertex.
    pub vertex: VertexId,
    /// Its constraint: exact or a spring.
    pub hold: Hold,
}

impl Handle {
    /// A handle that is met exactly.
    pub fn hard(vertex: VertexId) -> Self {
        Self {
            vertex,
            hold: Hold::Hard,
        }
    }

    /// A handle that is met in the least-squares sense; see [`Hold::Soft`].
    pub fn soft(vertex: VertexId, weight: f64) -> Self {
        Self {
            vertex,
            hold: Hold::Soft(weight),
        }
    }
}

/// Checks that the handles exist, differ, have usable weights, and hold every component, or one
/// that it is tied to.
pub(crate) fn check(
    handles: &[Handle],
    components: &GraphComponents,
    ties: &Ties,
) -> Result<(), LinearError> {
    let n = components.num_vertices();
    if handles.is_empty() {
        return Err(LinearError::NoHandles);
    }
    let mut held = vec![false; n];
    let sets = ties.join(components);
    let mut is_held = vec![false; components.len()];
    for handle in handles {
        let vertex = handle.vertex;
        let Some(seen) = held.get_mut(vertex.index()) else {
            return Err(LinearError::HandleOutOfRange {
                vertex,
                num_vertices: n,
            });
        };
        if *seen {
            return Err(LinearError::DuplicateHandle { vertex });
        }
        *seen = true;
        is_held[sets[components.of(vertex.index())]] = true;
        if let Hold::Soft(weight) = handle.hold
            && !(weight > 0.0 && weight <= HEAVIEST)
        {
            return Err(LinearError::HandleWeight { vertex, weight });
        }
    }
    match sets.iter().position(|set| !is_held[*set]) {
        None => Ok(()),
        Some(component) => {
            let members = components.members(component);
            Err(LinearError::ComponentWithoutHandle {
                vertex: VertexId::new(members[0] as usize),
                num_vertices: members.len(),
            })
        }
    }
}

/// The greatest weight of a soft handle. At 1e6 handles are met to 1e-16 of the box already; far
/// beyond it the squares would drown the rest of the system.
const HEAVIEST: f64 = 1e9;
