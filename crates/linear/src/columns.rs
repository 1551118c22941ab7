//! One factorization for every set of handles.
//!
//! With M = LᵀL + μK, which knows no handles, E the selector of the handle vertices and C that of
//! the components, the correction is
//!
//! ```text
//! δ = δ₀ − Qλ + C c,      δ₀ = M⁺(Lᵀ mismatch + μ tension),      Q = M⁺E
//! ```
//!
//! with forces λ that hold the handles: δ_h = 0 at hard ones, λ_h = k²(δ_h − pull_h) at soft ones,
//! and no force in sum on any component. A handle costs a column of Q when it is added; an
//! iteration costs the solve for δ₀ and one pass over the columns. M⁺ takes factors of matrices
//! with the pattern of L only (see [`crate::pseudo_inverse`]): a third to a quarter of the entries
//! of LᵀL's, and half of the digits that its condition number would cost are saved.
//!
//! A handle that is alone on its component needs no force and no column, only the constant.

use cotan_halfedge::VertexId;
use nalgebra::{DMatrix, Vector3};

use crate::column_store::{ColumnStore, LANES, Slot};
use crate::defect::Defect;
use crate::error::LinearError;
use crate::handles::{Handle, Hold};
use crate::multipliers::Multipliers;
use crate::problem::{Held, Problem};
use crate::pseudo_inverse::{Means, PseudoInverse};

pub(crate) struct Columns {
    inverse: PseudoInverse,
    store: ColumnStore,
    /// The existing columns, ascending by vertex.
    slots: Vec<(VertexId, Slot)>,
    holding: Holding,
}

/// The action of the handles on the columns.
struct Holding {
    /// Handles that need a force, each with its column and component.
    pulling: Vec<Pulling>,
    multipliers: Multipliers,
    /// Handles that are alone on their component.
    lone: Vec<(usize, Handle)>,
    /// The components of the groups of `multipliers`.
    groups: Vec<usize>,
    /// c of every component.
    constants: Vec<Vector3<f64>>,
}

struct Pulling {
    handle: Handle,
    slot: Slot,
}

impl Columns {
    pub(crate) fn factor(problem: &Problem, means: &Means) -> Result<Self, LinearError> {
        Self::with_columns(PseudoInverse::factor(problem, means)?, problem)
    }

    /// For other weights and the same handles: the analysis is shared.
    pub(crate) fn refactor(&self, problem: &Problem) -> Result<Self, LinearError> {
        Self::with_columns(self.inverse.refactor(problem)?, problem)
    }

    fn with_columns(inverse: PseudoInverse, problem: &Problem) -> Result<Self, LinearError> {
        let mut columns = Self {
            inverse,
            store: ColumnStore::default(),
            slots: Vec::new(),
            holding: Holding::none(problem)?,
        };
        columns.set_handles(problem, &problem.held)?;
        Ok(columns)
    }

    pub(crate) fn num_entries(&self) -> usize {
        self.inverse.num_entries()
    }

    /// The number of columns that these handles need and that do not exist yet.
    pub(crate) fn num_missing(&self, problem: &Problem, held: &Held) -> usize {
        pulling(problem, held)
            .filter(|handle| self.slot(handle.vertex).is_none())
            .count()
    }

    /// Takes other handles: columns are solved for where there are none, and dropped where no
    /// handle is left. After an error nothing has changed.
    pub(crate) fn set_handles(
        &mut self,
        problem: &Problem,
        held: &Held,
    ) -> Result<(), LinearError> {
        let mut missing: Vec<VertexId> = pulling(problem, held)
            .map(|handle| handle.vertex)
            .filter(|&vertex| self.slot(vertex).is_none())
            .collect();
        missing.sort_unstable();
        let n = problem.num_vertices();
        let solved = self.add_columns(&missing, n);
        match solved.and_then(|()| self.hold(problem, held)) {
            Ok(holding) => {
                self.holding = holding;
                let mut is_held = vec![false; problem.num_vertices()];
                pulling(problem, held).for_each(|h| is_held[h.vertex.index()] = true);
                self.keep(|vertex| is_held[vertex.index()]);
                Ok(())
            }
            Err(error) => {
                self.keep(|vertex| missing.binary_search(&vertex).is_err());
                Err(error)
            }
        }
    }

    /// Solves for the columns of some vertices, as many of them as succeed.
    fn add_columns(&mut self, vertices: &[VertexId], n: usize) -> Result<(), LinearError> {
        let (mut work, mut number) = (Vec::new(), Vec::new());
        for vertices in vertices.chunks(LANES) {
            if let [vertex] = *vertices {
                number.resize(n, 0.0);
                self.inverse.column(vertex.index(), &mut number)?;
                self.slots.push((vertex, self.store.insert_one(&number)));
                continue;
            }
            work.resize(n, Vector3::zeros());
            let rows: Vec<usize> = vertices.iter().map(|v| v.index()).collect();
            self.inverse.columns(&rows, &mut work)?;
            let slots = self.store.insert(&work, vertices.len());
            self.slots.extend(vertices.iter().copied().zip(slots));
        }
        self.slots.sort_unstable_by_key(|(vertex, _)| *vertex);
        Ok(())
    }

    /// The correction.
    pub(crate) fn correct(
        &mut self,
        defect: &Defect<'_>,
        problem: &Problem,
        correction: &mut [Vector3<f64>],
    ) -> Result<(), LinearError> {
        let tension = defect
            .tension
            .map(|t| (problem.membrane_weight(), t.as_slice()));
        let mismatch = defect.laplacian.as_slice();
        self.inverse
            .free_correction(mismatch, tension, correction)?;
        let Self { store, holding, .. } = self;
        let wanted = |handle: &Handle| match handle.hold {
            Hold::Hard => Vector3::zeros(),
            Hold::Soft(_) => defect
                .pull
                .map_or_else(Vector3::zeros, |pull| pull[handle.vertex]),
        };
        let Holding {
            pulling,
            multipliers,
            lone,
            groups,
            constants,
        } = holding;
        let x = &*correction;
        multipliers.solve(|i| {
            let handle = &pulling[i].handle;
            x[handle.vertex.index()] - wanted(handle)
        });
        for (i, at) in pulling.iter().enumerate() {
            store.set_force(at.slot, multipliers.force(i));
        }
        for (group, &component) in groups.iter().enumerate() {
            constants[component] = multipliers.constant(group);
        }
        for (component, handle) in lone {
            constants[*component] = wanted(handle) - x[handle.vertex.index()];
        }
        let (components, constants) = (&problem.components, &*constants);
        store.subtract_from(correction, |i| constants[components.of(i)]);
        for handle in &problem.held.handles {
            if handle.hold == Hold::Hard {
                correction[handle.vertex.index()] = Vector3::zeros();
            }
        }
        Ok(())
    }

    fn slot(&self, vertex: VertexId) -> Option<Slot> {
        let found = self.slots.binary_search_by_key(&vertex, |(v, _)| *v);
        found.ok().map(|k| self.slots[k].1)
    }

    /// Gives up the columns of all other vertices.
    fn keep(&mut self, is_kept: impl Fn(VertexId) -> bool) {
        let (kept, dropped): (Vec<_>, Vec<_>) =
            self.slots.iter().partition(|(vertex, _)| is_kept(*vertex));
        self.slots = kept;
        self.store.remove(dropped.into_iter().map(|(_, slot)| slot));
        // The contents of a vacant slot have no effect.
        self.store.clear_forces();
    }

    /// The small system of the existing columns.
    fn hold(&self, problem: &Problem, held: &Held) -> Result<Holding, LinearError> {
        let components = &problem.components;
        let mut holding = Holding::none(problem)?;
        let counts = handle_counts(problem, held);
        let mut group_of = vec![usize::MAX; components.len()];
        let mut groups = Vec::new();
        for &handle in &held.handles {
            let component = components.of(handle.vertex.index());
            match self.slot(handle.vertex) {
                Some(slot) if counts[component] > 1 => {
                    if group_of[component] == usize::MAX {
                        group_of[component] = holding.groups.len();
                        holding.groups.push(component);
                    }
                    groups.push(group_of[component]);
                    holding.pulling.push(Pulling { handle, slot });
                }
                _ => holding.lone.push((component, handle)),
            }
        }
        let entry = |i: usize, j: usize| {
            let (row, column) = (&holding.pulling[i], &holding.pulling[j]);
            self.store.entry(column.slot, row.handle.vertex.index())
        };
        let m = groups.len();
        // Symmetric but for rounding, of which the mean is taken.
        let mut matrix = DMatrix::from_fn(m, m, |i, j| 0.5 * (entry(i, j) + entry(j, i)));
        for (i, at) in holding.pulling.iter().enumerate() {
            if at.handle.hold != Hold::Hard {
                matrix[(i, i)] += 1.0 / held.spring(at.handle.vertex.index());
            }
        }
        holding.multipliers = Multipliers::factor(matrix, groups, holding.groups.len())?;
        Ok(holding)
    }
}

impl Holding {
    fn none(problem: &Problem) -> Result<Self, LinearError> {
        Ok(Self {
            pulling: Vec::new(),
            multipliers: Multipliers::factor(DMatrix::zeros(0, 0), Vec::new(), 0)?,
            lone: Vec::new(),
            groups: Vec::new(),
            constants: vec![Vector3::zeros(); problem.components.len()],
        })
    }
}

/// The number of columns that the handles need.
pub(crate) fn num_columns(problem: &Problem, held: &Held) -> usize {
    pulling(problem, held).count()
}

/// The handles that share their component with another.
fn pulling<'a>(problem: &'a Problem, held: &'a Held) -> impl Iterator<Item = Handle> + 'a {
    let counts = handle_counts(problem, held);
    held.handles
        .iter()
        .copied()
        .filter(move |h| counts[problem.components.of(h.vertex.index())] > 1)
}

fn handle_counts(problem: &Problem, held: &Held) -> Vec<usize> {
    let mut counts = vec![0; problem.components.len()];
    for handle in &held.handles {
        counts[problem.components.of(handle.vertex.index())] += 1;
    }
    counts
}
