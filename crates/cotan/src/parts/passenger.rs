//! A part that follows: the targets of its contacts, and its placement by them.
//!
//! The target of a contact is g = q + R_q (v⁰ − q⁰), with q the point that it touches and R_q the
//! rotation of the surface there. Small parts are placed as rigid bodies by a weighted fit of
//! v⁰ ↦ g; parts that lie on their surface like a decal take g itself; large ones are deformed by
//! the hybrid energy, in the frame of that rigid motion, with soft handles at g.

use cotan_flow::{Flow, nearest_rotation};
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexId;
use cotan_linear::Handle;
use cotan_parallel as parallel;
use nalgebra::{Matrix3, Point3, Vector3};

use super::contacts::Contact;
use super::extract::Extract;
use super::model::Model;
use super::turns::{covariance, covariance_at, rotation};
use crate::error::Error;

/// A part that follows others.
#[derive(Debug)]
pub(crate) struct Passenger<T: Scalar> {
    pub(crate) part: usize,
    pub(crate) layer: u32,
    pub(crate) contacts: Vec<Contact>,
    /// The corners that the contacts touch, each once, with its part and the weight that it bears.
    below: Vec<Corner>,
    pub(crate) kind: Kind<T>,
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
    /// A part with these contacts.
    pub(crate) fn new(part: usize, layer: u32, contacts: Vec<Contact>, kind: Kind<T>) -> Self {
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
        Self {
            part,
            layer,
            contacts,
            below,
            kind,
        }
    }

    /// The rotation nearest to the weighted mean of those below the contacts.
    pub(crate) fn mean_rotation(&self, scene: &Scene<'_>) -> Matrix3<f64> {
        let sum = self.below.iter().fold(Matrix3::zeros(), |sum, corner| {
            let covariance = match &scene.motions[corner.part as usize] {
                Some(motion) => motion.rotation / 3.0,
                None => covariance(scene.model, scene.now, corner.vertex),
            };
            sum + covariance * corner.weight
        });
        rotation(&sum)
    }

    /// Places the part by the current positions of the parts below it.
    pub(crate) fn place(&mut self, scene: &Scene<'_>, effort: Effort) -> Result<Placed, Error> {
        let vertices = &scene.model.parts[self.part].vertices;
        if let Kind::Decal = self.kind {
            let positions = parallel::filled(vertices.len(), |k| {
                let contact = &self.contacts[k];
                target(scene, contact, &rotation_at(scene, contact))
            });
            return Ok(Placed {
                positions,
                motion: None,
            });
        }
        let mean = self.mean_rotation(scene);
        let Kind::Flowing(flowing) = &mut self.kind else {
            let targets: Vec<Point3<f64>> = self
                .contacts
                .iter()
                .map(|c| target(scene, c, &mean))
                .collect();
            let motion = fit(scene, &self.contacts, &targets, &mean);
            return Ok(Placed {
                positions: vertices
                    .iter()
                    .map(|v| motion.apply(scene.model.at(*v)))
                    .collect(),
                motion: Some(motion),
            });
        };
        let contacts = &self.contacts;
        let rotations = parallel::filled(contacts.len(), |k| rotation_at(scene, &contacts[k]));
        let targets = parallel::filled(contacts.len(), |k| {
            target(scene, &contacts[k], &rotations[k])
        });
        let motion = fit(scene, contacts, &targets, &mean);
        flowing.follow(scene, contacts, &targets, &rotations, &motion)?;
        match effort {
            Effort::Step => {
                flowing.flow.step()?;
            }
            Effort::Run => {
                let _ = flowing.flow.run_to_end()?;
            }
        }
        let positions = flowing.flow.positions();
        let moved = positions.values().map(|p| motion.apply(p.map(T::as_f64)));
        Ok(Placed {
            positions: moved.collect(),
            motion: None,
        })
    }
}

impl<T: Scalar> Passenger<T> {
    /// The original place of the part.
    pub(crate) fn at_rest(&mut self, scene: &Scene<'_>) -> Placed {
        let vertices = scene.model.parts[self.part].vertices.iter();
        Placed {
            positions: vertices.map(|v| scene.model.at(*v)).collect(),
            motion: None,
        }
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
        let goal = |pull: &Pull| {
            let rest = scene.model.at(self.extract.in_whole(pull.vertex));
            let sum = pull.contacts.iter().map(|(k, share)| {
                let contact = &contacts[*k as usize];
                let own = contact.own.at(scene.model.positions.as_slice());
                let goal = targets[*k as usize] + rotations[*k as usize] * (rest - own);
                motion.undo(goal).coords * *share
            });
            let sum: Vector3<f64> = sum.sum();
            (pull.vertex, Point3::from(sum.map(T::of_f64)))
        };
        let goals: Vec<(VertexId, Point3<T>)> = self.pulls.iter().map(goal).collect();
        Ok(self.flow.move_handles(&goals)?)
    }

    /// The soft handles of a part with these contacts.
    pub(crate) fn pulls(contacts: &[Contact], extract: &Extract<T>) -> Vec<Pull> {
        let mut all: Vec<(VertexId, u32, f64)> = Vec::new();
        for (k, contact) in contacts.iter().enumerate() {
            for (v, share) in contact.own.terms() {
                if let Some(vertex) = extract.in_extract(v)
                    && share > 0.0
                {
                    all.push((vertex, k as u32, share * contact.weight));
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

/// Bounds of the springs, relative to the system.
const LIGHTEST: f64 = 1e-9;
const HEAVIEST: f64 = 1e6;

/// The target of a contact's point on the part that follows.
fn target(scene: &Scene<'_>, contact: &Contact, rotation: &Matrix3<f64>) -> Point3<f64> {
    let rest = scene.model.positions.as_slice();
    let arm = contact.own.at(rest) - contact.on.at(rest);
    contact.on.at(scene.now) + rotation * arm
}

/// The rotation of the surface below a contact.
fn rotation_at(scene: &Scene<'_>, contact: &Contact) -> Matrix3<f64> {
    match &scene.motions[contact.part as usize] {
        Some(motion) => motion.rotation,
        None => rotation(&covariance_at(scene.model, scene.now, &contact.on)),
    }
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
