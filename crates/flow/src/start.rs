//! The first guess of all rotations: one rotation of all handles, and the deviation of each handle
//! from it, spread over the mesh.

use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use cotan_linear::{Defect, Handle};
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use crate::error::FlowError;
use crate::fit::{Fit, Pair};
use crate::rest::Rest;
use crate::targets::Targets;
use crate::ties::{add_pull, joined_components};
use crate::vectors::add_scaled;
use crate::workspace::Workspace;

/// A first guess of how the mesh is turned, from its handles.
///
/// **Shapes**: one entry per vertex.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FirstGuess {
    /// The rotation of every vertex.
    pub rotations: VertexMap<Matrix3<f64>>,
    /// The scale of the one similarity that moves all handles: the original counts as scaled by it
    /// from here on. 1 where there is no such similarity.
    pub scale: f64,
    /// The factor by which handle regions that are scaled swell the body around them; `None` where
    /// no region is scaled by itself.
    pub swelling: Option<VertexMap<f64>>,
}

/// The guess that the handles give; `None` if they turn nothing.
pub(crate) fn first_guess<T: Scalar>(
    work: &mut Workspace<T>,
) -> Result<Option<FirstGuess>, FlowError> {
    let groups = Groups::new(&work.rest, work.targets.handles(), work.targets.in_box());
    let common = groups.common();
    let turns = groups.turns(&common);
    let is_turned = turns.iter().any(|w| w.norm() >= MIN_TURN);
    let is_away = |r: &Matrix3<f64>| (r - Matrix3::identity()).norm() >= MIN_TURN;
    let is_common = common.rotations.iter().any(is_away);
    let swelling = match groups.swelling() {
        Some(logarithms) if common.scale == 1.0 => {
            let at_handles = groups.at_handles(work, &logarithms);
            Some(spread(work, at_handles)?.map(|s| s.x.exp()))
        }
        _ => None,
    };
    if !is_turned && !is_common && common.scale == 1.0 && swelling.is_none() {
        return Ok(None);
    }
    let of_vertex = |i: usize| common.rotations[groups.component_of(i)];
    let n = work.rest.positions().len();
    let rotations = if is_turned {
        let at_handles = groups.at_handles(work, &turns);
        let turns = spread(work, at_handles)?;
        let turned = |v: VertexId| Rotation3::new(turns[v]).into_inner() * of_vertex(v.index());
        VertexMap::from_fn(n, turned)
    } else {
        VertexMap::from_fn(n, |v: VertexId| of_vertex(v.index()))
    };
    Ok(Some(FirstGuess {
        rotations,
        scale: common.scale,
        swelling,
    }))
}

/// The rotation of every handle: that of its group, derived from the targets.
pub(crate) fn handle_rotations<T: Scalar>(
    rest: &Rest<T>,
    targets: &Targets<T>,
) -> Vec<Matrix3<f64>> {
    let groups = Groups::new(rest, targets.handles(), targets.in_box());
    let common = groups.common();
    let turns = groups.turns(&common);
    let mut rotations = vec![Matrix3::identity(); targets.handles().len()];
    for (g, (members, turn)) in groups.members.iter().zip(&turns).enumerate() {
        let common = common.rotations[groups.components[g]];
        let rotation = if turn.norm() < MIN_TURN {
            common
        } else {
            Rotation3::new(*turn).into_inner() * common
        };
        members.iter().for_each(|&k| rotations[k] = rotation);
    }
    rotations
}

/// A smaller turn, in radians, is rounding.
const MIN_TURN: f64 = 1e-12;

/// The smoothest field with the values of `field` at the handles, which is zero elsewhere, by the
/// flow's own system: mismatch 0 − Lω, tension Σ s (ω_j − ω_i).
pub(crate) fn spread<T: Scalar>(
    work: &mut Workspace<T>,
    mut field: VertexMap<Vector3<f64>>,
) -> Result<VertexMap<Vector3<f64>>, FlowError> {
    let rest = &*work.rest;
    let terms = &mut work.terms;
    let n = field.len();
    let mut membrane = VertexMap::filled(n, Vector3::zeros());
    for i in 0..n {
        let (mut ell, mut tension) = (Vector3::zeros(), Vector3::zeros());
        let at = field.as_slice();
        for (j, k) in rest.graph().row(i) {
            let step = at[j.index()] - at[i];
            ell -= step * rest.operator().weights()[k];
            tension += step * (0.5 * rest.membrane_weights()[k]);
        }
        terms.mismatch.as_mut_slice()[i] = ell;
        membrane.as_mut_slice()[i] = tension;
    }
    add_pull(rest, field.as_slice(), &mut membrane);
    let defect = Defect::of_laplacian(&terms.mismatch).with_tension(&membrane);
    work.system.correct(&defect, &mut terms.correction)?;
    add_scaled(field.as_mut_slice(), 1.0, terms.correction.as_slice());
    Ok(field)
}

/// The handles in their groups: those that are connected through handles.
pub(crate) struct Groups {
    /// Original and target of every handle.
    pub(crate) pairs: Vec<Pair>,
    pub(crate) members: Vec<Vec<usize>>,
    pub(crate) centers: Vec<Pair>,
    /// The component of every group.
    components: Vec<usize>,
    of_vertex: Vec<usize>,
    num_components: usize,
}

/// One motion of all handles of each component.
struct Common {
    /// By component; the identity where a component has no handles.
    rotations: Vec<Matrix3<f64>>,
    /// Of the similarity that moves the handles of all components, if there is one.
    scale: f64,
}

impl Groups {
    pub(crate) fn new<T: Scalar>(
        rest: &Rest<T>,
        handles: &[Handle],
        targets: &[Point3<T>],
    ) -> Self {
        let pair = |(handle, target): (&Handle, &Point3<T>)| Pair {
            before: rest.positions()[handle.vertex].map(T::as_f64).coords,
            after: target.map(T::as_f64).coords,
            weight: 1.0,
        };
        let pairs: Vec<Pair> = handles.iter().zip(targets).map(pair).collect();
        let mut handle_of = vec![None; rest.positions().len()];
        for (index, handle) in handles.iter().enumerate() {
            handle_of[handle.vertex.index()] = Some(index);
        }
        let mut members = Vec::new();
        let mut is_done = vec![false; handles.len()];
        for start in 0..handles.len() {
            if !is_done[start] {
                members.push(group(rest, handles, &handle_of, start, &mut is_done));
            }
        }
        let (of_vertex, num_components) = joined_components(rest.mesh(), rest.ties());
        let center = |group: &Vec<usize>| Pair::center(group.iter().map(|&k| pairs[k]));
        Self {
            centers: members.iter().map(center).collect(),
            components: members
                .iter()
                .map(|group| of_vertex[handles[group[0]].vertex.index()])
                .collect(),
            of_vertex,
            num_components,
            pairs,
            members,
        }
    }

    fn component_of(&self, vertex: usize) -> usize {
        self.of_vertex[vertex]
    }

    /// The rotation that moves the handles of each component best, each group counting as the root
    /// of its size; and the scale of the similarity that moves all handles, 1 unless it does so
    /// exactly.
    fn common(&self) -> Common {
        let num_components = self.num_components;
        let mut rotations = vec![Matrix3::identity(); num_components];
        let all = self.weighted(|_| true);
        let whole = Fit::new(&all);
        if rests(&all) {
            // No rotation, not even one by rounding.
        } else if num_components == 1 {
            rotations[0] = common_rotation(&whole);
        } else {
            let mut seen = vec![false; num_components];
            for &component in &self.components {
                if !std::mem::replace(&mut seen[component], true) {
                    let own = self.weighted(|g| self.components[g] == component);
                    if !rests(&own) {
                        rotations[component] = common_rotation(&Fit::new(&own));
                    }
                }
            }
        }
        Common {
            rotations,
            scale: common_scale(&whole),
        }
    }

    /// The handles of some groups, each group counting as the root of its size.
    fn weighted(&self, counts: impl Fn(usize) -> bool) -> Vec<Pair> {
        let mut weighted = Vec::new();
        for (_, group) in self.members.iter().enumerate().filter(|(g, _)| counts(*g)) {
            let weight = 1.0 / (group.len() as f64).sqrt();
            weighted.extend(group.iter().map(|&k| Pair {
                weight,
                ..self.pairs[k]
            }));
        }
        weighted
    }

    /// A field that has a value of its own at the handles of every group, and is zero elsewhere.
    pub(crate) fn at_handles<T: Scalar>(
        &self,
        work: &Workspace<T>,
        values: &[Vector3<f64>],
    ) -> VertexMap<Vector3<f64>> {
        let mut field = VertexMap::filled(work.rest.positions().len(), Vector3::zeros());
        for (group, value) in self.members.iter().zip(values) {
            for &k in group {
                field[work.targets.handles()[k].vertex] = *value;
            }
        }
        field
    }

    /// The logarithm of every group's scale, in the first coordinate; `None` if none is scaled.
    fn swelling(&self) -> Option<Vec<Vector3<f64>>> {
        /// A smaller logarithm is not an intended scale.
        const LEAST: f64 = 1e-3;
        let logarithm = |group: &Vec<usize>| {
            let own: Vec<Pair> = group.iter().map(|&k| self.pairs[k]).collect();
            let fit = Fit::new(&own);
            match fit.determines_rotation(own.len()) {
                true => Vector3::new(fit.scale.ln(), 0.0, 0.0),
                false => Vector3::zeros(),
            }
        };
        let logarithms: Vec<_> = self.members.iter().map(logarithm).collect();
        logarithms
            .iter()
            .any(|l| l.x.abs() > LEAST)
            .then_some(logarithms)
    }

    /// The rotation vector of every group beyond the common rotation.
    fn turns(&self, common: &Common) -> Vec<Vector3<f64>> {
        // By a quaternion: the angle of a matrix near the identity is lost in its trace.
        let beyond = |g: usize, r: Matrix3<f64>| {
            let common = common.rotations[self.components[g]];
            let rotation = Rotation3::from_matrix_unchecked(r * common.transpose());
            UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis()
        };
        let turn = |(g, group): (usize, &Vec<usize>)| {
            let own: Vec<Pair> = group.iter().map(|&k| self.pairs[k]).collect();
            let fit = Fit::new(&own);
            if fit.determines_rotation(own.len()) {
                return beyond(g, fit.rotation);
            }
            self.turn_among_others(g)
                .map_or(Vector3::zeros(), |r| beyond(g, r))
        };
        self.members.iter().enumerate().map(turn).collect()
    }

    /// The rotation of the groups around group `g`, by their centres; `None` if these do not
    /// determine one.
    fn turn_among_others(&self, g: usize) -> Option<Matrix3<f64>> {
        /// With more groups than this no neighbours are searched: they hold the mesh by
        /// themselves.
        const MAX_GROUPS: usize = 4000;
        /// The nearest groups count; the weights of others are some 1e-4.
        const MAX_MATES: usize = 64;
        if self.centers.len() > MAX_GROUPS {
            return None;
        }
        let mut mates: Vec<&Pair> = self
            .centers
            .iter()
            .zip(&self.components)
            .filter(|(_, component)| **component == self.components[g])
            .map(|(center, _)| center)
            .collect();
        if mates.len() < 4 {
            return None;
        }
        let squared = |c: &Pair| (c.before - self.centers[g].before).norm_squared();
        if mates.len() > MAX_MATES {
            let nearer = |a: &&Pair, b: &&Pair| squared(a).total_cmp(&squared(b));
            mates.select_nth_unstable_by(MAX_MATES, nearer);
            mates.truncate(MAX_MATES);
        }
        let mut sorted: Vec<f64> = mates.iter().map(|c| squared(c)).collect();
        sorted.sort_by(f64::total_cmp);
        let near = 0.25 * sorted[3];
        if !(near > 0.0) {
            return None;
        }
        let weighted: Vec<Pair> = mates
            .iter()
            .map(|c| Pair {
                weight: (near / (squared(c) + near)).powi(2),
                ..**c
            })
            .collect();
        let fit = Fit::new(&weighted);
        let [first, second, third] = fit.singular_values;
        (second + third.min(0.0) > 0.02 * first).then_some(fit.rotation)
    }
}

/// Returns `true` if all points stay where they are, to the bit.
fn rests(pairs: &[Pair]) -> bool {
    pairs.iter().all(|pair| pair.before == pair.after)
}

/// The rotation of a fit, as far as the points determine it.
fn common_rotation(fit: &Fit) -> Matrix3<f64> {
    let [first, second, third] = fit.singular_values;
    let flat = second + third;
    // Of points on a line the turn about it is rounding.
    let is_off_line = flat > 1e-6 * first && flat > 25.0 * fit.residual_squared;
    if first <= f64::EPSILON * fit.spread {
        Matrix3::identity()
    } else if flat > 0.01 * first || is_off_line {
        fit.rotation
    } else {
        fit.least_turn
    }
}

/// The scale of a fit that carries points off a line onto their images exactly; 1 for any other.
fn common_scale(fit: &Fit) -> f64 {
    /// The residual, over the extent, of handles that one similarity moves.
    const EXACT: f64 = 1e-6;
    let [first, second, _] = fit.singular_values;
    let is_exact = fit.residual_squared <= EXACT.powi(2) * fit.spread;
    let is_scaled = (fit.scale - 1.0).abs() > EXACT;
    if second > 0.01 * first && is_exact && is_scaled {
        fit.scale
    } else {
        1.0
    }
}

/// The handles that are connected to handle `start` through handles.
fn group<T: Scalar>(
    rest: &Rest<T>,
    handles: &[Handle],
    handle_of: &[Option<usize>],
    start: usize,
    is_done: &mut [bool],
) -> Vec<usize> {
    let mut group = vec![start];
    is_done[start] = true;
    let mut next = 0;
    while next < group.len() {
        let vertex = handles[group[next]].vertex;
        next += 1;
        for (j, _) in rest.graph().row(vertex.index()) {
            if let Some(index) = handle_of[j.index()]
                && !std::mem::replace(&mut is_done[index], true)
            {
                group.push(index);
            }
        }
    }
    group
}
