//! A part that follows: the targets of its contacts, and its placement by them.
//!
//! The target of a contact is g = q + R_q (v⁰ − q⁰), with q the point that it touches and R_q the
//! rotation of the surface there. Small parts are placed as rigid bodies by a weighted fit of
//! v⁰ ↦ g; parts that lie on their surface like a decal take g itself; large ones are deformed by
//! the hybrid energy, in the frame of that rigid motion, with soft handles at g.

use cotan_flow::{Flow, StopReason, nearest_rotation};
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexId;
use cotan_linear::Handle;
use cotan_parallel as parallel;
use nalgebra::{Matrix3, Point3, Vector3};

use super::contacts::Contact;
use super::extract::Extract;
use super::model::Model;
use super::plan::{Manner, Seat};
use super::turns::{covariance, rotation};
use super::workshop::Workshop;
use crate::error::Error;

/// A part that follows others.
#[derive(Debug)]
pub(crate) struct Passenger<T: Scalar> {
    pub(crate) part: usize,
    pub(crate) layer: u32,
    pub(crate) contacts: Vec<Contact>,
    /// The corners that the contacts touch, each once, with its part and the weight that it bears.
    below: Vec<Corner>,
    /// Per contact: the indices of its corners in `below`.
    touched: Vec<[u32; 3]>,
    /// The vertices whose positions place the part: the triangles around `below`.
    around: Vec<u32>,
    pub(crate) kind: Kind<T>,
    pub(crate) state: State,
}

/// The place of a part that follows, with respect to the parts below it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum State {
    /// Its original place, and what it touches is at its own.
    AtRest,
    /// Where it stays as long as what it touches does.
    Settled,
    /// Somewhere else: it is to be placed, or to be moved on.
    Underway,
}

/// A vertex that a part touches.
#[derive(Clone, Copy, Debug)]
struct Corner {
    vertex: u32,
    part: u32,
    weight: f64,
}

/// The placement of a part.
#[derive(Debug)]
pub(crate) enum Kind<T: Scalar> {
    /// As a rigid body.
    Rigid,
    /// Every vertex with its own point of the surface below: one contact per vertex.
    Decal,
    /// By a flow of its own.
    Flowing(Box<Flowing<T>>),
    /// By a flow of its own, which is built when what it touches moves.
    Waiting,
}

/// A part with a flow of its own.
#[derive(Debug)]
pub(crate) struct Flowing<T: Scalar> {
    pub(crate) extract: Extract<T>,
    pub(crate) flow: Flow<T>,
    pub(crate) pulls: Vec<Pull>,
}

/// A soft handle of a part with a flow of its own.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Pull {
    /// The vertex of the flow.
    vertex: VertexId,
    /// κ.
    weight: f64,
    /// The contacts that pull at it, with shares that add up to 1.
    contacts: Vec<(u32, f64)>,
}

/// A rotation and the two points that it takes onto each other.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Rigid {
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) from: Point3<f64>,
    pub(crate) to: Point3<f64>,
}

impl Rigid {
    pub(crate) fn apply(&self, p: Point3<f64>) -> Point3<f64> {
        self.to + self.rotation * (p - self.from)
    }

    fn undo(&self, p: Point3<f64>) -> Point3<f64> {
        self.from + self.rotation.transpose() * (p - self.to)
    }
}

/// The state from which passengers are placed.
pub(crate) struct Scene<'a> {
    pub(crate) model: &'a Model,
    /// λ.
    pub(crate) length: f64,
    /// Current positions of all parts placed so far.
    pub(crate) now: &'a [Point3<f64>],
    /// Per vertex of the parts placed so far: true if it has another position than last time.
    pub(crate) has_moved: &'a [bool],
    /// The motion of the parts that are placed as rigid bodies.
    pub(crate) motions: &'a [Option<Rigid>],
}

/// The length of the run of a flow when its part is placed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Effort {
    /// One step.
    Step,
    /// To convergence.
    Run,
}

/// The place of a part.
pub(crate) struct Placed {
    /// In the order of its vertices.
    pub(crate) positions: Vec<Point3<f64>>,
    /// Its motion if it moved as a rigid body.
    pub(crate) motion: Option<Rigid>,
}

impl<T: Scalar> Passenger<T> {
    /// A part at rest.
    pub(crate) fn new(model: &Model, seat: Seat) -> Self {
        let Seat {
            part,
            layer,
            manner,
            contacts,
        } = seat;
        let corners = contacts.iter().flat_map(|contact| {
            contact.on.terms().map(|(vertex, share)| Corner {
                vertex,
                part: contact.part,
                weight: contact.weight * share,
            })
        });
        let mut below: Vec<Corner> = corners.collect();
        below.sort_by_key(|corner| corner.vertex);
        below.dedup_by(|later, kept| {
            let is_same = later.vertex == kept.vertex;
            if is_same {
                kept.weight += later.weight;
            }
            is_same
        });
        // Corners without a share are not found.
        let index = |v: u32| below.binary_search_by_key(&v, |corner| corner.vertex);
        let touched = contacts
            .iter()
            .map(|contact| contact.on.corners.map(|v| index(v).unwrap_or(0) as u32))
            .collect();
        let fans = below.iter().flat_map(|corner| model.fan(corner.vertex));
        let corners = below.iter().map(|corner| corner.vertex);
        let mut around: Vec<u32> = fans.flatten().copied().chain(corners).collect();
        around.sort_unstable();
        around.dedup();
        Self {
            part,
            layer,
            contacts,
            below,
            touched,
            around,
            kind: match manner {
                Manner::Rigid => Kind::Rigid,
                Manner::Decal => Kind::Decal,
                Manner::Flowing => Kind::Waiting,
            },
            state: State::AtRest,
        }
    }

    /// Per corner below: the covariance of the surface there with that at rest.
    fn covariances(&self, scene: &Scene<'_>) -> Vec<Matrix3<f64>> {
        parallel::filled(self.below.len(), |k| {
            let corner = &self.below[k];
            match &scene.motions[corner.part as usize] {
                Some(motion) => motion.rotation / 3.0,
                None => covariance(scene.model, scene.now, corner.vertex),
            }
        })
    }

    /// The rotation nearest to the weighted mean of those below the contacts.
    pub(crate) fn mean_rotation(&self, scene: &Scene<'_>) -> Matrix3<f64> {
        self.mean_of(&self.covariances(scene))
    }

    fn mean_of(&self, covariances: &[Matrix3<f64>]) -> Matrix3<f64> {
        let pairs = self.below.iter().zip(covariances);
        rotation(&pairs.fold(Matrix3::zeros(), |sum, (corner, covariance)| {
            sum + covariance * corner.weight
        }))
    }

    /// The rotation of the surface below each contact: the nearest one to the mean of those at its
    /// corners.
    fn rotations(&self, scene: &Scene<'_>, covariances: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
        let at_corners = parallel::filled(covariances.len(), |k| rotation(&covariances[k]));
        parallel::filled(self.contacts.len(), |k| {
            let contact = &self.contacts[k];
            if let Some(motion) = &scene.motions[contact.part as usize] {
                return motion.rotation;
            }
            let corners = self.touched[k].iter().zip(contact.on.shares);
            rotation(&corners.fold(Matrix3::zeros(), |sum, (corner, share)| {
                sum + at_corners[*corner as usize] * share
            }))
        })
    }

    /// Places the part by the current positions of the parts below it; `None` if it stays where
    /// it is.
    ///
    /// # Errors
    /// [`Error`] of the flow of a large part.
    pub(crate) fn place(
        &mut self,
        scene: &Scene<'_>,
        workshop: &Workshop<'_, T>,
        effort: Effort,
    ) -> Result<Option<Placed>, Error> {
        let rest = scene.model.positions.as_slice();
        let all = |holds: &dyn Fn(usize) -> bool| self.around.iter().all(|v| holds(*v as usize));
        if all(&|v| scene.now[v] == rest[v]) {
            return match self.state {
                State::AtRest => Ok(None),
                _ => self.go_back(scene).map(Some),
            };
        }
        if self.state == State::Settled && all(&|v| !scene.has_moved[v]) {
            return Ok(None);
        }
        self.state = State::Underway;
        if let Kind::Waiting = self.kind {
            self.kind = workshop.kind(self.part, &self.contacts);
        }
        let (placed, state) = self.follow(scene, effort)?;
        self.state = state;
        Ok(Some(placed))
    }

    /// Goes back to the original place.
    fn go_back(&mut self, scene: &Scene<'_>) -> Result<Placed, Error> {
        if let Kind::Flowing(flowing) = &mut self.kind {
            let positions = flowing.extract.positions.clone();
            flowing.flow.set_shape(&positions)?;
        }
        self.state = State::AtRest;
        let vertices = scene.model.parts[self.part].vertices.iter();
        Ok(Placed {
            positions: vertices.map(|v| scene.model.at(*v)).collect(),
            motion: None,
        })
    }

    fn follow(&mut self, scene: &Scene<'_>, effort: Effort) -> Result<(Placed, State), Error> {
        let covariances = self.covariances(scene);
        let mean = self.mean_of(&covariances);
        let (contacts, vertices) = (&self.contacts, &scene.model.parts[self.part].vertices);
        if let Kind::Rigid = self.kind {
            let targets = contacts.iter().map(|c| target(scene, c, &mean));
            let targets: Vec<Point3<f64>> = targets.collect();
            let motion = fit(scene, contacts, &targets, &mean);
            let moved = |k: usize| motion.apply(scene.model.at(vertices[k]));
            let placed = Placed {
                positions: parallel::filled(vertices.len(), moved),
                motion: Some(motion),
            };
            return Ok((placed, State::Settled));
        }
        let rotations = self.rotations(scene, &covariances);
        let targets = parallel::filled(contacts.len(), |k| {
            target(scene, &contacts[k], &rotations[k])
        });
        let Kind::Flowing(flowing) = &mut self.kind else {
            // A decal has one contact per vertex.
            let placed = Placed {
                positions: targets,
                motion: None,
            };
            return Ok((placed, State::Settled));
        };
        let motion = fit(scene, contacts, &targets, &mean);
        flowing.follow(scene, contacts, &targets, &rotations, &motion)?;
        let has_arrived = match effort {
            Effort::Step => flowing.flow.step()?.converged,
            Effort::Run => flowing.flow.run_to_end()?.stop != StopReason::IterationLimit,
        };
        let positions = flowing.flow.positions();
        let moved = |k: usize| motion.apply(positions.as_slice()[k].map(T::as_f64));
        let placed = Placed {
            positions: parallel::filled(positions.len(), moved),
            motion: None,
        };
        let state = match has_arrived {
            true => State::Settled,
            false => State::Underway,
        };
        Ok((placed, state))
    }
}

impl<T: Scalar> Flowing<T> {
    /// Moves the soft handles to the targets, in the frame of the rigid motion.
    fn follow(
        &mut self,
        scene: &Scene<'_>,
        contacts: &[Contact],
        targets: &[Point3<f64>],
        rotations: &[Matrix3<f64>],
        motion: &Rigid,
    ) -> Result<(), Error> {
        // The image of a point p near contact k is shifts[k] + rotations[k] p.
        let rest = scene.model.positions.as_slice();
        let shifts = parallel::filled(contacts.len(), |k| {
            targets[k].coords - rotations[k] * contacts[k].own.at(rest).coords
        });
        let goals = parallel::filled(self.pulls.len(), |k| {
            let pull = &self.pulls[k];
            let from = scene.model.at(self.extract.in_whole(pull.vertex)).coords;
            let images = pull.contacts.iter().map(|(k, share)| {
                let k = *k as usize;
                (shifts[k] + rotations[k] * from) * *share
            });
            let goal = motion.undo(Point3::from(images.sum::<Vector3<f64>>()));
            (pull.vertex, goal.map(T::of_f64))
        });
        Ok(self.flow.move_handles(&goals)?)
    }

    /// The soft handles of a part with these contacts.
    ///
    /// The neighbours of a vertex with a contact are pulled as well, as if they were firmly joined
    /// to it, where no contact of their own pulls as much: the surface leaves its contacts in the
    /// direction that these have.
    pub(crate) fn pulls(contacts: &[Contact], extract: &Extract<T>) -> Vec<Pull> {
        let mesh = &extract.mesh;
        let mut all: Vec<(VertexId, u32, f64)> = Vec::new();
        let mut own = vec![0.0; extract.vertices().len()];
        for (k, contact) in contacts.iter().enumerate() {
            for (v, share) in contact.own.terms() {
                if let Some(vertex) = extract.in_extract(v)
                    && share > 0.0
                {
                    all.push((vertex, k as u32, share * contact.weight));
                    own[vertex.index()] += share * contact.weight;
                }
            }
        }
        for i in 0..all.len() {
            let (vertex, k, weight) = all[i];
            for h in mesh.outgoing_halfedges(vertex) {
                let neighbour = mesh.row_of(mesh.target(h));
                if own[neighbour.index()] < NEXT * own[vertex.index()] {
                    all.push((neighbour, k, NEXT * weight));
                }
            }
        }
        all.sort_by_key(|(vertex, k, _)| (*vertex, *k));
        let runs = all.chunk_by(|a, b| a.0 == b.0);
        let pull = |run: &[(VertexId, u32, f64)]| {
            let weight: f64 = run.iter().map(|(.., w)| w).sum();
            (weight > 0.0).then(|| Pull {
                vertex: run[0].0,
                weight,
                contacts: run.iter().map(|(_, k, w)| (*k, w / weight)).collect(),
            })
        };
        runs.filter_map(pull).collect()
    }

    /// The soft handles at rest: springs of stiffness μκ, with k² the given factor times κ.
    pub(crate) fn handles(
        pulls: &[Pull],
        factor: f64,
        extract: &Extract<T>,
    ) -> Vec<(Handle, Point3<T>)> {
        let handle = |pull: &Pull| {
            let spring = (factor * pull.weight).sqrt().clamp(LIGHTEST, HEAVIEST);
            let target = extract.positions[pull.vertex];
            (Handle::soft(pull.vertex, spring), target)
        };
        pulls.iter().map(handle).collect()
    }
}

/// The share of a contact's weight by which it pulls at the neighbours of its vertex.
const NEXT: f64 = 1.0;

/// Bounds of the springs, relative to the system.
const LIGHTEST: f64 = 1e-9;
const HEAVIEST: f64 = 1e6;

/// The target of a contact's point on the part that follows.
fn target(scene: &Scene<'_>, contact: &Contact, rotation: &Matrix3<f64>) -> Point3<f64> {
    let rest = scene.model.positions.as_slice();
    let arm = contact.own.at(rest) - contact.on.at(rest);
    contact.on.at(scene.now) + rotation * arm
}

/// The rigid motion that takes the contacts closest to their targets. The mean rotation of the
/// surface below counts as much as an arm of √.5 λ, and decides alone where there is one contact.
fn fit(
    scene: &Scene<'_>,
    contacts: &[Contact],
    targets: &[Point3<f64>],
    mean: &Matrix3<f64>,
) -> Rigid {
    /// Of λ².
    const TURN: f64 = 0.5;
    let rest = scene.model.positions.as_slice();
    let total: f64 = contacts.iter().map(|c| c.weight).sum();
    let (mut from, mut to) = (Vector3::zeros(), Vector3::zeros());
    for (contact, target) in contacts.iter().zip(targets) {
        let share = contact.weight / total;
        from += contact.own.at(rest).coords * share;
        to += target.coords * share;
    }
    let mut covariance = mean * (TURN * scene.length * scene.length);
    for (contact, target) in contacts.iter().zip(targets) {
        let (a, b) = (contact.own.at(rest).coords - from, target.coords - to);
        covariance += b * a.transpose() * (contact.weight / total);
    }
    Rigid {
        rotation: nearest_rotation(&covariance),
        from: Point3::from(from),
        to: Point3::from(to),
    }
}

/// The positions of a part as the whole mesh stores them.
pub(crate) fn put<T: Scalar>(
    model: &Model,
    part: usize,
    original: &Positions<T>,
    placed: &[Point3<f64>],
    out: &mut Positions<T>,
) {
    let vertices = &model.parts[part].vertices;
    for (v, p) in vertices.iter().zip(placed) {
        let v = *v as usize;
        // A vertex that has not moved keeps its bytes.
        let rest = model.positions.as_slice()[v];
        out.as_mut_slice()[v] = match *p == rest {
            true => original.as_slice()[v],
            false => p.map(T::of_f64),
        };
    }
}
