//! Contacts: the points at which a part touches the parts that it follows.
//!
//! For each vertex v of part p the closest point q = Σ b_k x_k on the parts placed before it, at
//! distance d_v. With d_p = min d_v and λ the bending length,
//!
//! ```text
//! f_v = (1 + ((d_v − d_p) / λ)²)⁻²,     d_v < d_p + 2λ
//! κ_v = a_v f_v · max(1/λ², κ₀ / Σ_p a f)
//! ```
//!
//! with a_v the area around v. Contacts are taken from the smaller of the two sides: where the
//! nearest part is smaller than p, its vertices look for their closest points on p.

use cotan_geometry::{Closest, ClosestTree, Marks};
use cotan_parallel as parallel;
use nalgebra::Point3;

use super::model::Model;
use super::proximity::{APART, RUN, STRETCH, Untied};

/// A point of a surface: the corners of a triangle and the share of each. A vertex is a corner of
/// share 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct ContactPoint {
    pub(crate) corners: [u32; 3],
    pub(crate) shares: [f64; 3],
}

impl ContactPoint {
    fn vertex(v: u32) -> Self {
        Self {
            corners: [v; 3],
            shares: [1.0, 0.0, 0.0],
        }
    }

    fn of(closest: &Closest) -> Self {
        Self {
            corners: closest.triangle,
            shares: closest.shares,
        }
    }

    /// The corners with a share, and their shares.
    pub(crate) fn terms(&self) -> impl Iterator<Item = (u32, f64)> + use<> {
        let terms = self.corners.into_iter().zip(self.shares);
        terms.filter(|(_, share)| *share != 0.0)
    }

    /// The point for these positions.
    pub(crate) fn at(&self, positions: &[Point3<f64>]) -> Point3<f64> {
        let terms = self.terms();
        terms.fold(Point3::origin(), |sum, (v, share)| {
            sum + positions[v as usize].coords * share
        })
    }
}

/// A point of a part and the closest point of another.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Contact {
    /// On the part that follows.
    pub(crate) own: ContactPoint,
    /// On the part that is followed.
    pub(crate) on: ContactPoint,
    /// The part that is followed.
    pub(crate) part: u32,
    /// f.
    pub(crate) nearness: f64,
    /// κ.
    pub(crate) weight: f64,
    pub(crate) distance: f64,
}

/// Finds contacts.
pub(crate) struct Contacts<'a> {
    pub(crate) model: &'a Model,
    pub(crate) tree: &'a ClosestTree,
    pub(crate) untied: &'a Untied,
    /// λ.
    pub(crate) length: f64,
    /// κ₀.
    pub(crate) least: f64,
    /// A factor on all weights.
    pub(crate) strength: f64,
}

impl Contacts<'_> {
    /// The contacts of a part with the parts whose mark is below `layer`. `near` lists those of
    /// them that may be smaller than the part.
    pub(crate) fn of(&self, part: usize, marks: &Marks, layer: u32, near: &[u32]) -> Vec<Contact> {
        let vertices = &self.model.parts[part].vertices;
        let skips = |least: u32, _| least >= layer;
        let own = self.closest(part, vertices, marks, skips);
        let Some(nearest) = nearest(&own) else {
            return Vec::new();
        };
        let is_smaller = |p: &u32| self.model.is_smaller(*p as usize, part);
        let near: Vec<u32> = near.iter().copied().filter(is_smaller).collect();
        // The nearest part may be found from its own vertices only.
        let seen_by_others = match near.is_empty() {
            true => Vec::new(),
            false => self.seen_by(part, &near),
        };
        let is_nearest_smaller = is_smaller(&nearest.label);
        let closer = |a: &[Contact], b: f64| a.iter().any(|c| c.distance < b);
        let mut contacts = if is_nearest_smaller || closer(&seen_by_others, nearest.distance) {
            seen_by_others
        } else {
            let seen = own
                .into_iter()
                .zip(vertices)
                .filter_map(|(c, v)| Some((c?, *v)));
            seen.map(|(c, v)| Contact {
                own: ContactPoint::vertex(v),
                on: ContactPoint::of(&c),
                part: c.label,
                nearness: 0.0,
                weight: self.model.areas[v as usize],
                distance: c.distance,
            })
            .collect()
        };
        self.weigh(&mut contacts);
        contacts
    }

    /// For every vertex of a part, the closest point on the parts whose mark is below `layer`, at
    /// any distance.
    pub(crate) fn everywhere(&self, part: usize, marks: &Marks, layer: u32) -> Vec<Contact> {
        let vertices = &self.model.parts[part].vertices;
        let skips = |least: u32, _| least >= layer;
        let found = self.within(part, vertices, marks, &skips, f64::INFINITY);
        let contact = |(c, v): (Option<Closest>, &u32)| {
            let c = c?;
            Some(Contact {
                own: ContactPoint::vertex(*v),
                on: ContactPoint::of(&c),
                part: c.label,
                nearness: 1.0,
                weight: self.model.areas[*v as usize],
                distance: c.distance,
            })
        };
        found
            .into_iter()
            .zip(vertices)
            .filter_map(contact)
            .collect()
    }

    /// The contacts between two parts alone, searched from the vertices of the smaller one. If
    /// these are too far from the other part, corners of the larger one find no contact either.
    pub(crate) fn between(&self, parts: [u32; 2]) -> Vec<Contact> {
        let [a, b] = parts.map(|p| p as usize);
        let smaller = if self.model.comes_first(a, b) { a } else { b };
        let other = a + b - smaller;
        let mut contacts = self.seen_by(other, &[smaller as u32]);
        self.weigh(&mut contacts);
        for contact in &mut contacts {
            std::mem::swap(&mut contact.own, &mut contact.on);
            contact.part = other as u32;
        }
        contacts
    }

    /// The contacts of the vertices of other parts with this part alone.
    fn seen_by(&self, part: usize, others: &[u32]) -> Vec<Contact> {
        let mut only = vec![APART; self.model.parts.len()];
        only[part] = 0;
        let marks = self.tree.marks(only);
        let mut contacts = Vec::new();
        for &other in others {
            let vertices = &self.model.parts[other as usize].vertices;
            let skips = |least: u32, _| least == APART;
            let found = self.closest(other as usize, vertices, &marks, skips);
            let seen = found
                .into_iter()
                .zip(vertices)
                .filter_map(|(c, v)| Some((c?, *v)));
            contacts.extend(seen.map(|(c, v)| Contact {
                own: ContactPoint::of(&c),
                on: ContactPoint::vertex(v),
                part: other,
                nearness: 0.0,
                weight: self.model.areas[v as usize],
                distance: c.distance,
            }));
        }
        contacts
    }

    /// For every vertex the closest point that is at most 2λ farther than the closest of all.
    fn closest(
        &self,
        part: usize,
        vertices: &[u32],
        marks: &Marks,
        skips: impl Fn(u32, u32) -> bool + Sync,
    ) -> Vec<Option<Closest>> {
        let stretches: Vec<&[u32]> = vertices.chunks(STRETCH).collect();
        let least = parallel::tasks(stretches, |vertices| {
            let mut reach = f64::INFINITY;
            for run in vertices.chunks(RUN) {
                let bounds = self.model.bounds(run);
                if !self.tree.may_reach(bounds, reach, marks, &skips) {
                    continue;
                }
                reach = run.iter().fold(reach, |reach, v| {
                    let closest = self.query(part, *v, marks, &skips, reach);
                    closest.map_or(reach, |c| c.distance.min(reach))
                });
            }
            reach
        });
        let least = least.into_iter().fold(f64::INFINITY, f64::min);
        if least == f64::INFINITY {
            return vec![None; vertices.len()];
        }
        self.within(part, vertices, marks, &skips, least + 2.0 * self.length)
    }

    /// For every vertex the closest point within a distance.
    fn within(
        &self,
        part: usize,
        vertices: &[u32],
        marks: &Marks,
        skips: &(impl Fn(u32, u32) -> bool + Sync),
        limit: f64,
    ) -> Vec<Option<Closest>> {
        /// Of λ: more than the rounding of a distance.
        const ROUNDING: f64 = 1e-9;
        let positions = self.model.positions.as_slice();
        let stretches: Vec<&[u32]> = vertices.chunks(STRETCH).collect();
        let found = parallel::tasks(stretches, |vertices| {
            // Vertices with adjacent indices are near each other in most files: what one of them
            // has found bounds the distance of the next.
            let mut last: Option<Point3<f64>> = None;
            let mut of_vertex = |v: &u32| {
                let point = self.model.at(*v);
                let bound = last.map_or(limit, |q| (point - q).norm() + ROUNDING * self.length);
                let closest = self.query(part, *v, marks, skips, bound.min(limit));
                if let Some(closest) = &closest {
                    last = Some(ContactPoint::of(closest).at(positions));
                }
                closest
            };
            let mut found = Vec::with_capacity(vertices.len());
            for run in vertices.chunks(RUN) {
                let bounds = self.model.bounds(run);
                match self.tree.may_reach(bounds, limit, marks, skips) {
                    true => found.extend(run.iter().map(&mut of_vertex)),
                    false => found.resize(found.len() + run.len(), None),
                }
            }
            found
        });
        found.concat()
    }

    /// The closest point to a vertex within a distance.
    fn query(
        &self,
        part: usize,
        vertex: u32,
        marks: &Marks,
        skips: &(impl Fn(u32, u32) -> bool + Sync),
        limit: f64,
    ) -> Option<Closest> {
        let counts = |label| !self.untied.contains(part as u32, label);
        let point = self.model.at(vertex);
        self.tree.closest(point, limit, marks, skips, counts)
    }

    /// Drops contacts that are too far, and turns areas into weights.
    fn weigh(&self, contacts: &mut Vec<Contact>) {
        let least = contacts
            .iter()
            .map(|c| c.distance)
            .fold(f64::INFINITY, f64::min);
        contacts.retain(|c| c.distance < least + 2.0 * self.length || c.distance == least);
        if !contacts.iter().any(|c| c.weight > 0.0) {
            contacts
                .iter_mut()
                .for_each(|c| c.weight = self.length * self.length);
        }
        let mut sum = 0.0;
        for contact in contacts.iter_mut() {
            let beyond = (contact.distance - least) / self.length;
            contact.nearness = (1.0 + beyond * beyond).powi(-2);
            sum += contact.weight * contact.nearness;
        }
        let factor = (1.0 / (self.length * self.length)).max(self.least / sum) * self.strength;
        contacts
            .iter_mut()
            .for_each(|c| c.weight *= c.nearness * factor);
    }
}

fn nearest(found: &[Option<Closest>]) -> Option<Closest> {
    let closer = |a: Closest, b: Closest| if b.distance < a.distance { b } else { a };
    found.iter().flatten().copied().reduce(closer)
}
