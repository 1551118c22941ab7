//! The plan of a deformation of several parts: which parts drive, which follow, and by which
//! contacts.

use cotan_geometry::{ClosestTree, Marks, Scalar, Surface};
use cotan_parallel as parallel;

use super::contacts::{Contact, Contacts};
use super::model::Model;
use super::proximity::{Link, Untied, links, tree};
use super::roles::{Role, Roles};
use crate::error::Error;
use crate::options::{DeformOptions, OrientationKind};
use crate::part_options::{Parts, Ties};

/// The planned placement of a passenger.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Manner {
    Rigid,
    Decal,
    Flowing,
}

/// The contacts of a passenger.
#[derive(Debug)]
pub(crate) struct Seat {
    pub(crate) part: usize,
    pub(crate) layer: u32,
    pub(crate) manner: Manner,
    pub(crate) contacts: Vec<Contact>,
}

/// A model, and the parts that are close to each other. Independent of handles.
#[derive(Debug)]
pub(crate) struct Neighbourhood {
    pub(crate) model: Model,
    tree: ClosestTree,
    counts: Vec<bool>,
    untied: Untied,
    /// λ.
    pub(crate) length: f64,
    strength: f64,
    /// True if the energy of the drivers has terms for ties.
    can_tie: bool,
}

/// The roles of the parts of a model with handles.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) roles: Roles,
    /// Contacts between parts that drive.
    pub(crate) ties: Vec<Contact>,
    has_handle: Vec<bool>,
    /// Ordered by layer, then by part.
    pub(crate) seats: Vec<Seat>,
}

impl Neighbourhood {
    /// Finds the parts of a surface and those that are close to each other; `None` for a single
    /// part, and if parts are still.
    ///
    /// # Errors
    /// [`Error`] for a part that does not exist, and a strength out of range.
    pub(crate) fn new<T: Scalar>(
        surface: &Surface<'_, T>,
        options: &DeformOptions,
    ) -> Result<Option<Self>, Error> {
        if options.parts == Parts::Still {
            return Ok(None);
        }
        let components = surface.mesh().components();
        let n = components.count();
        check(options, n)?;
        // Nothing is measured on a single surface.
        if n < 2 || Surface::new(surface.mesh(), surface.positions()).is_err() {
            return Ok(None);
        }
        let model = Model::new(surface, &components);
        let length = options.bending_length * model.extent;
        if !(length > 0.0 && length.is_finite()) {
            return Ok(None);
        }
        let mut counts = match &options.parts {
            Parts::Only(parts) => {
                let mut counts = vec![false; n];
                parts.iter().for_each(|p| counts[*p] = true);
                counts
            }
            _ => vec![true; n],
        };
        options.ties.free.iter().for_each(|p| counts[*p] = false);
        let untied = Untied::new(&options.ties.untied);
        let tree = tree(&model);
        Ok(Some(Self {
            tree,
            model,
            counts,
            untied,
            length,
            strength: options.ties.strength,
            can_tie: options.orientation == OrientationKind::Hybrid,
        }))
    }

    /// Decides which parts drive and which follow, given the parts with handles.
    pub(crate) fn plan(&self, has_handle: Vec<bool>) -> Plan {
        let either = |(counts, has): (&bool, &bool)| *counts || *has;
        let counts: Vec<bool> = self.counts.iter().zip(&has_handle).map(either).collect();
        let links = links(&self.model, &self.tree, &counts, &self.untied, self.length);
        let longest = match self.can_tie {
            true => LONGEST * self.length,
            false => -1.0,
        };
        let roles = Roles::new(&has_handle, &counts, &links, longest);
        Plan {
            ties: self.ties(&roles, &links, longest),
            seats: self.seats(&roles, &links),
            roles,
            has_handle,
        }
    }

    /// The contacts between parts that drive and are near enough.
    fn ties(&self, roles: &Roles, links: &[Link], longest: f64) -> Vec<Contact> {
        let drives = |p: &u32| roles.layers[*p as usize] == 0;
        let near = |link: &&Link| link.distance <= longest && link.parts.iter().all(drives);
        let pairs: Vec<[u32; 2]> = links.iter().filter(near).map(|link| link.parts).collect();
        let finder = self.finder(DRIVERS);
        let contacts = parallel::tasks(pairs, |pair| finder.between(pair));
        contacts.into_iter().flatten().collect()
    }

    fn finder(&self, least: f64) -> Contacts<'_> {
        Contacts {
            model: &self.model,
            tree: &self.tree,
            untied: &self.untied,
            length: self.length,
            least,
            strength: self.strength,
        }
    }

    fn seats(&self, roles: &Roles, links: &[Link]) -> Vec<Seat> {
        let marks = self.tree.marks(roles.layers.clone());
        let mut near = vec![Vec::new(); self.model.parts.len()];
        for link in links {
            let [a, b] = link.parts;
            near[a as usize].push(b);
            near[b as usize].push(a);
        }
        let mut followers: Vec<usize> = roles.with(Role::Follows).collect();
        followers.sort_by_key(|p| (roles.layers[*p], *p));
        let seats = parallel::tasks(followers, |part| {
            let layer = roles.layers[part];
            let placed = near[part].iter().copied();
            let placed: Vec<u32> = placed
                .filter(|q| roles.layers[*q as usize] < layer)
                .collect();
            self.seat(part, layer, &marks, &placed)
        });
        seats.into_iter().flatten().collect()
    }

    fn seat(&self, part: usize, layer: u32, marks: &Marks, near: &[u32]) -> Option<Seat> {
        let finder = self.finder(1.0);
        let contacts = finder.of(part, marks, layer, near);
        if contacts.is_empty() {
            return None;
        }
        let size = self.model.parts[part].size;
        let is_degenerate = self.model.is_degenerate(part);
        let (manner, contacts) = if size >= self.length && self.lies_flat(part, &contacts) {
            (Manner::Decal, finder.everywhere(part, marks, layer))
        } else if is_degenerate || size < RIGID * self.length {
            (Manner::Rigid, contacts)
        } else {
            (Manner::Flowing, contacts)
        };
        Some(Seat {
            part,
            layer,
            manner,
            contacts,
        })
    }

    /// Returns true if a part lies on the surface below it like a decal.
    fn lies_flat(&self, part: usize, contacts: &[Contact]) -> bool {
        /// Of λ, and of the area.
        const GAP: f64 = 0.1;
        const AREA: f64 = 0.9;
        let mut lying = 0.0;
        let mut own = 0.0;
        let model = &self.model;
        for contact in contacts {
            if contact.own.shares == [1.0, 0.0, 0.0] && contact.distance < GAP * self.length {
                lying += model.areas[contact.own.corners[0] as usize];
            }
        }
        for v in &model.parts[part].vertices {
            own += model.areas[*v as usize];
        }
        own > 0.0 && lying >= AREA * own
    }
}

/// Parts smaller than this many λ are rigid.
const RIGID: f64 = 10.0;

/// κ₀ among parts that drive; it is 1 for those that follow.
const DRIVERS: f64 = 30.0;

/// Parts that are farther apart than this many λ are not tied and solved together. A part
/// between them is placed by the nearest one.
const LONGEST: f64 = 4.0;

fn check(options: &DeformOptions, num_parts: usize) -> Result<(), Error> {
    let Ties {
        strength,
        free,
        untied,
    } = &options.ties;
    let only: &[usize] = match &options.parts {
        Parts::Only(parts) => parts,
        _ => &[],
    };
    let mut all = only.iter().chain(free).chain(untied.iter().flatten());
    if let Some(&part) = all.find(|p| **p >= num_parts) {
        return Err(Error::NoSuchPart { part, num_parts });
    }
    if !(*strength > 0.0 && *strength <= 1e6) {
        return Err(Error::TieStrength(*strength));
    }
    Ok(())
}

impl Plan {
    /// Returns true if every part is solved.
    pub(crate) fn drives_all(&self) -> bool {
        self.roles.layers.iter().all(|layer| *layer == 0)
    }

    /// Returns true if it was made for handles in these parts.
    pub(crate) fn is_for(&self, has_handle: &[bool]) -> bool {
        self.has_handle == has_handle
    }
}
