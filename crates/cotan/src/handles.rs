//! Handles: groups of vertices and their target positions.

use cotan_geometry::{Positions, Scalar, scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId};
use cotan_linear::{Handle, Hold};
use nalgebra::{Matrix4, Point3, Vector3};

use crate::error::Error;
use crate::handle_id::HandleId;

/// The motion of the vertices of a handle.
#[derive(Clone, PartialEq, Debug)]
pub enum Motion<T: Scalar> {
    /// The vertices stay at their original positions. To hold vertices of a running session at
    /// their current positions, use [`Self::To`] with these.
    Stay,
    /// Each vertex moves to its own position, in the order of the vertices.
    To(Vec<Point3<T>>),
    /// All vertices move by one transform (a 4 × 4 matrix acting on columns (x, y, z, 1)).
    Transform(Matrix4<T>),
}

impl<T: Scalar> Motion<T> {
    /// The target positions of the vertices.
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
    // A projective last row is respected; a zero weight results in a non-finite target.
    Point3::from(image.xyz() / image.w)
}

fn firmness(hold: Hold) -> f64 {
    match hold {
        Hold::Hard => f64::INFINITY,
        Hold::Soft(weight) => weight,
    }
}

/// The largest absolute coordinate.
fn extent<T: Scalar>(positions: &Positions<T>) -> T {
    positions
        .values()
        .map(|p| p.coords.amax())
        .fold(T::zero(), |a, b| a.max(b))
}

/// A group of vertices with its motion.
#[derive(Clone, PartialEq, Debug)]
pub struct HandleGroup<T: Scalar> {
    id: HandleId,
    vertices: Vec<VertexId>,
    pub(crate) motion: Motion<T>,
    hold: Hold,
    turn: Option<Vector3<T>>,
}

impl<T: Scalar> HandleGroup<T> {
    /// The id of the handle.
    pub fn id(&self) -> HandleId {
        self.id
    }

    /// The vertices of the handle, in the order in which they were given.
    pub fn vertices(&self) -> &[VertexId] {
        &self.vertices
    }

    /// The motion of the vertices.
    pub fn motion(&self) -> &Motion<T> {
        &self.motion
    }

    /// The rotation vector of the motion, if it was stated: see [`Handles::turned`].
    pub fn turn(&self) -> Option<Vector3<T>> {
        self.turn
    }

    /// The firmness with which the vertices are held.
    pub fn hold(&self) -> Hold {
        self.hold
    }
}

/// The handles of a deformation: groups of vertices, each of which is fixed, moved vertex by
/// vertex, or moved by one transform, and met exactly or by springs. Groups have stable ids, see
/// [`HandleId`].
///
/// A vertex may be in two groups if both require the same position; the firmer group holds it.
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
    /// In ascending order of their ids.
    groups: Vec<HandleGroup<T>>,
    next: usize,
}

impl<T: Scalar> Default for Handles<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a, T: Scalar> IntoIterator for &'a Handles<T> {
    type Item = &'a HandleGroup<T>;
    type IntoIter = std::slice::Iter<'a, HandleGroup<T>>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<T: Scalar> Handles<T> {
    /// Creates an empty set of handles.
    pub fn new() -> Self {
        Self {
            groups: Vec::new(),
            next: 0,
        }
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.groups.len()
    }

    /// Returns true if there are no groups.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Adds vertices that stay at their original positions.
    #[must_use]
    pub fn fix(self, vertices: impl IntoIterator<Item = VertexId>) -> Self {
        self.add(vertices, Motion::Stay)
    }

    /// Adds a vertex that moves to `target`.
    #[must_use]
    pub fn move_to(self, vertex: VertexId, target: Point3<T>) -> Self {
        self.add([vertex], Motion::To(vec![target]))
    }

    /// Adds vertices that are moved together by a 4 × 4 matrix.
    #[must_use]
    pub fn transform(
        self,
        vertices: impl IntoIterator<Item = VertexId>,
        matrix: Matrix4<T>,
    ) -> Self {
        self.add(vertices, Motion::Transform(matrix))
    }

    /// Adds a group with any motion, which is met exactly.
    #[must_use]
    pub fn add(mut self, vertices: impl IntoIterator<Item = VertexId>, motion: Motion<T>) -> Self {
        self.push(vertices, motion, Hold::Hard);
        self
    }

    /// Adds a group in place and returns its id.
    pub fn push(
        &mut self,
        vertices: impl IntoIterator<Item = VertexId>,
        motion: Motion<T>,
        hold: Hold,
    ) -> HandleId {
        let id = HandleId::new(self.next);
        self.next += 1;
        self.groups.push(HandleGroup {
            id,
            vertices: vertices.into_iter().collect(),
            motion,
            hold,
            turn: None,
        });
        id
    }

    /// Removes and returns a group. The others keep their ids.
    pub fn remove(&mut self, id: HandleId) -> Option<HandleGroup<T>> {
        let at = self.place(id)?;
        Some(self.groups.remove(at))
    }

    /// The group with this id.
    pub fn get(&self, id: HandleId) -> Option<&HandleGroup<T>> {
        self.place(id).map(|at| &self.groups[at])
    }

    /// Replaces the motion of a group and returns the previous one.
    pub fn set_motion(&mut self, id: HandleId, motion: Motion<T>) -> Option<Motion<T>> {
        let at = self.place(id)?;
        Some(std::mem::replace(&mut self.groups[at].motion, motion))
    }

    /// States the rotation of a group, see [`Self::turned`], or that it is not stated. Returns
    /// the previous one; `None` also if there is no such group.
    pub fn set_turn(&mut self, id: HandleId, turn: Option<Vector3<T>>) -> Option<Vector3<T>> {
        let at = self.place(id)?;
        std::mem::replace(&mut self.groups[at].turn, turn)
    }

    fn place(&self, id: HandleId) -> Option<usize> {
        self.groups.binary_search_by_key(&id, |group| group.id).ok()
    }

    /// The groups in the order in which they were added.
    pub fn iter(&self) -> std::slice::Iter<'_, HandleGroup<T>> {
        self.groups.iter()
    }

    /// Makes the most recently added group soft: a spring of weight `weight`, relative to the
    /// mean |L_ii| (see [`Hold::Soft`]). Does nothing if there is no group.
    #[must_use]
    pub fn soft(mut self, weight: f64) -> Self {
        if let Some(group) = self.groups.last_mut() {
            group.hold = Hold::Soft(weight);
        }
        self
    }

    /// States the rotation of the most recently added group: an axis times an angle in radians,
    /// which may exceed half a turn. Positions alone cannot distinguish 270° from −90°. A body
    /// holds about 80° of twist per diameter of distance between the handles, and 140° more. A
    /// twist that it does not hold is reported in [`cotan_flow::Report::lost_turn`], with the
    /// angle that this shape holds.
    ///
    /// ```
    /// use cotan::prelude::*;
    ///
    /// let shape = cotan::shapes::bar::<f64>([6.0, 1.0, 1.0], [36, 6, 6]);
    /// let left = shape.surface().vertices_where(|p| p.x < -2.99);
    /// let right = shape.surface().vertices_where(|p| p.x > 2.99);
    /// let turn = Vector3::x() * f64::to_radians(270.0);
    /// let handles = Handles::new()
    ///     .fix(left)
    ///     .transform(right, Rotation3::new(turn).to_homogeneous())
    ///     .turned(turn);
    /// let deformed = deform(&shape, &handles, &DeformOptions::default())?;
    /// assert_eq!(deformed.report.lost_turn, None);
    /// # Ok::<(), cotan::Error>(())
    /// ```
    #[must_use]
    pub fn turned(mut self, turn: Vector3<T>) -> Self {
        if let Some(group) = self.groups.last_mut() {
            group.turn = Some(turn);
        }
        self
    }

    /// The stated rotations, per row.
    pub(crate) fn stated_turns(&self, mesh: &HalfedgeMesh) -> Vec<(VertexId, Vector3<f64>)> {
        let of_group = |group: &HandleGroup<T>| {
            let turn = group.turn.map(|turn| turn.map(T::as_f64));
            let vertices = group.vertices.iter().map(|v| mesh.row_of(*v));
            let stated = turn.map(|turn| vertices.map(move |v| (v, turn)));
            stated.into_iter().flatten().collect::<Vec<_>>()
        };
        self.groups.iter().flat_map(of_group).collect()
    }

    /// Changes all groups added so far that are met exactly to `hold`.
    #[must_use]
    pub fn all_held(mut self, hold: Hold) -> Self {
        for group in self.groups.iter_mut().filter(|g| g.hold == Hold::Hard) {
            group.hold = hold;
        }
        self
    }

    /// The vertices of each group, in the order of the groups.
    pub fn vertices(&self) -> impl Iterator<Item = &[VertexId]> {
        self.groups.iter().map(HandleGroup::vertices)
    }

    /// Resolves the groups to one handle per row of `mesh` in ascending order, with its target, as
    /// required by [`cotan_flow::FlowBuilder`]. A row is a vertex, or all copies of a vertex if the
    /// mesh was cut into pieces ([`HalfedgeMesh::row_of`]).
    ///
    /// **Shapes**: one position per vertex, or one per row.
    ///
    /// # Errors
    /// [`Error`] for a group without vertices, a vertex that does not exist, a motion that does
    /// not match its group, and two groups that require different positions of a vertex.
    ///
    /// # Panics
    /// If there are fewer positions than rows.
    pub fn resolve(
        &self,
        mesh: &HalfedgeMesh,
        positions: &Positions<T>,
    ) -> Result<Vec<(Handle, Point3<T>)>, Error> {
        let num_vertices = mesh.num_vertices();
        let mut all = Vec::new();
        for group in &self.groups {
            let index = group.id.index();
            if group.vertices.is_empty() {
                return Err(Error::EmptyHandle { group: index });
            }
            if let Some(&vertex) = group.vertices.iter().find(|v| v.index() >= num_vertices) {
                return Err(Error::HandleOutOfRange {
                    group: index,
                    vertex,
                    num_vertices,
                });
            }
            let rows: Vec<VertexId> = group.vertices.iter().map(|v| mesh.row_of(*v)).collect();
            let targets = group.motion.targets(index, &rows, positions)?;
            all.extend(rows.into_iter().zip(targets).map(|(vertex, target)| {
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
        // Transforms that agree may differ by rounding.
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
        // Among groups that agree about a vertex, the firmest one holds it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_when_a_group_goes() {
        let [a, b, c] = [0, 1, 2].map(VertexId::new);
        let mut handles = Handles::<f64>::new().fix([a]).fix([b]).soft(2.0);
        let third = handles.push([c], Motion::Stay, Hold::Hard);
        assert_eq!(third, HandleId::new(2));
        let gone = handles.remove(HandleId::new(0)).unwrap();
        assert_eq!((gone.vertices(), gone.hold()), (&[a][..], Hold::Hard));
        assert_eq!(handles.remove(gone.id()), None);
        assert_eq!(
            handles.get(HandleId::new(1)).unwrap().hold(),
            Hold::Soft(2.0)
        );
        assert_eq!(handles.get(third).unwrap().vertices(), [c]);
        assert_eq!(
            handles.push([a], Motion::Stay, Hold::Hard),
            HandleId::new(3)
        );
        let ids: Vec<usize> = handles.iter().map(|group| group.id().index()).collect();
        assert_eq!(ids, [1, 2, 3]);
        let motion = Motion::To(vec![Point3::origin()]);
        assert_eq!(
            handles.set_motion(third, motion.clone()),
            Some(Motion::Stay)
        );
        assert_eq!(handles.get(third).unwrap().motion(), &motion);
        assert_eq!(handles.set_motion(gone.id(), motion), None);
    }
}
