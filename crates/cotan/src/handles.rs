//! What a person holds: groups of vertices and where they go.

use cotan_geometry::{Positions, Scalar, scalar};
use cotan_halfedge::VertexId;
use cotan_linear::{Handle, Hold};
use nalgebra::{Matrix4, Point3};

use crate::error::Error;

/// Where the vertices of a handle go.
#[derive(Clone, PartialEq, Debug)]
pub enum Motion<T: Scalar> {
    /// Nowhere: they stay.
    Stay,
    /// Each to its own position, in the order of the vertices.
    To(Vec<Point3<T>>),
    /// All by one transform (a 4 × 4 matrix acting on columns (x, y, z, 1)).
    Transform(Matrix4<T>),
}

impl<T: Scalar> Motion<T> {
    /// Where this motion takes the vertices.
    pub(crate) fn targets(
        &self,
        group: usize,
        vertices: &[VertexId],
        positions: &Positions<T>,
    ) -> Result<Vec<Point3<T>>, Error> {
        let at = |v: &VertexId| positions[*v];
        match self {
            Self::Stay => Ok(vertices.iter().map(at).collect()),
            Self::To(targets) if targets.len() == vertices.len() => Ok(targets.clone()),
            Self::To(targets) => Err(Error::TargetCount {
                group,
                vertices: vertices.len(),
                targets: targets.len(),
            }),
            Self::Transform(matrix) => {
                Ok(vertices.iter().map(|v| transform(matrix, at(v))).collect())
            }
        }
    }
}

fn transform<T: Scalar>(matrix: &Matrix4<T>, p: Point3<T>) -> Point3<T> {
    let image = matrix * p.to_homogeneous();
    // A projective last row is honoured; a zero there shows up as a target that is not finite.
    Point3::from(image.xyz() / image.w)
}

fn firmness(hold: Hold) -> f64 {
    match hold {
        Hold::Hard => f64::INFINITY,
        Hold::Soft(weight) => weight,
    }
}

/// The largest coordinate.
fn extent<T: Scalar>(positions: &Positions<T>) -> T {
    positions
        .values()
        .map(|p| p.coords.amax())
        .fold(T::zero(), |a, b| a.max(b))
}

/// One group of vertices with its motion.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Group<T: Scalar> {
    pub(crate) vertices: Vec<VertexId>,
    pub(crate) motion: Motion<T>,
    pub(crate) hold: Hold,
}

/// The handles of a deformation: groups of vertices, each fixed, moved vertex by vertex, or moved
/// by one transform; met exactly or by springs.
///
/// A vertex may be in two groups if both want it at the same place; the firmer of them holds it.
///
/// ```
/// use cotan::prelude::*;
/// let handles = Handles::<f64>::new()
///     .fix([VertexId::new(0), VertexId::new(1)])
///     .move_to(VertexId::new(7), Point3::new(0.0, 0.0, 2.0))
///     .soft(100.0);
/// assert_eq!(handles.len(), 2);
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Handles<T: Scalar> {
    pub(crate) groups: Vec<Group<T>>,
}

impl<T: Scalar> Default for Handles<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> Handles<T> {
    /// No handles.
    pub fn new() -> Self {
        Self { groups: Vec::new() }
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.groups.len()
    }

    /// Whether there is no group.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Adds vertices that stay where they are.
    #[must_use]
    pub fn fix(self, vertices: impl IntoIterator<Item = VertexId>) -> Self {
        self.add(vertices, Motion::Stay)
    }

    /// Adds one vertex that goes to `target`.
    #[must_use]
    pub fn move_to(self, vertex: VertexId, target: Point3<T>) -> Self {
        self.add([vertex], Motion::To(vec![target]))
    }

    /// Adds vertices that a 4 × 4 matrix moves together.
    #[must_use]
    pub fn transform(
        self,
        vertices: impl IntoIterator<Item = VertexId>,
        matrix: Matrix4<T>,
    ) -> Self {
        self.add(vertices, Motion::Transform(matrix))
    }

    /// Adds a group with any motion, met exactly.
    #[must_use]
    pub fn add(mut self, vertices: impl IntoIterator<Item = VertexId>, motion: Motion<T>) -> Self {
        let vertices = vertices.into_iter().collect();
        self.groups.push(Group {
            vertices,
            motion,
            hold: Hold::Hard,
        });
        self
    }

    /// Makes the group added last a soft one: a spring of weight `weight`, relative to the mean
    /// |L_ii| (see [`Hold::Soft`]). Nothing happens if there is no group.
    #[must_use]
    pub fn soft(mut self, weight: f64) -> Self {
        if let Some(group) = self.groups.last_mut() {
            group.hold = Hold::Soft(weight);
        }
        self
    }

    /// Makes all groups added so far that are met exactly be held by `hold` instead.
    #[must_use]
    pub fn all_held(mut self, hold: Hold) -> Self {
        for group in self.groups.iter_mut().filter(|g| g.hold == Hold::Hard) {
            group.hold = hold;
        }
        self
    }

    /// The vertices of every group, in the order of the groups.
    pub fn vertices(&self) -> impl Iterator<Item = &[VertexId]> {
        self.groups.iter().map(|g| g.vertices.as_slice())
    }

    /// One handle a vertex, ascending, with its target: what a [`cotan_flow::FlowBuilder`] takes.
    ///
    /// # Errors
    /// [`Error`] for a group without vertices, a vertex that does not exist, a motion that does not
    /// fit its group, and two groups that want a vertex at two places.
    pub fn resolve(&self, positions: &Positions<T>) -> Result<Vec<(Handle, Point3<T>)>, Error> {
        let mut all = Vec::new();
        for (index, group) in self.groups.iter().enumerate() {
            if group.vertices.is_empty() {
                return Err(Error::EmptyHandle { group: index });
            }
            if let Some(&vertex) = group.vertices.iter().find(|v| v.index() >= positions.len()) {
                return Err(Error::HandleOutOfRange {
                    group: index,
                    vertex,
                    num_vertices: positions.len(),
                });
            }
            let targets = group.motion.targets(index, &group.vertices, positions)?;
            all.extend(group.vertices.iter().zip(targets).map(|(&vertex, target)| {
                (
                    Handle {
                        vertex,
                        hold: group.hold,
                    },
                    target,
                    index,
                )
            }));
        }
        all.sort_by_key(|(handle, _, index)| (handle.vertex, *index));
        // Transforms that agree differ by rounding.
        let rounding = extent(positions) * scalar::<T>(1e3) * T::default_epsilon();
        let contradict = |a: &Point3<T>, b: &Point3<T>| !((a - b).amax() <= rounding);
        if let Some(pair) = all.windows(2).find(|w| {
            let is_finite = |k: usize| w[k].1.iter().all(|x| x.is_finite());
            w[0].0.vertex == w[1].0.vertex
                && is_finite(0)
                && is_finite(1)
                && contradict(&w[0].1, &w[1].1)
        }) {
            return Err(Error::Contradiction {
                groups: [pair[0].2, pair[1].2],
                vertex: pair[0].0.vertex,
            });
        }
        // Of groups that agree about a vertex the firmest holds it.
        all.dedup_by(|later, kept| {
            let is_same = later.0.vertex == kept.0.vertex;
            if is_same && firmness(later.0.hold) > firmness(kept.0.hold) {
                kept.0.hold = later.0.hold;
            }
            is_same
        });
        Ok(all
            .into_iter()
            .map(|(handle, target, _)| (handle, target))
            .collect())
    }
}
