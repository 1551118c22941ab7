//! Reinsertion of the vertices of a coarse level, one by one.

use crate::sphere::corners::face_of;
use crate::sphere::energy::{Blend, Wedge};
use crate::sphere::error::SphereError;
use crate::sphere::kernel::kernel_points;
use crate::sphere::layout::{Layout, energy, is_valid, step};
use crate::sphere::map::solid_angle;
use crate::sphere::sweep::Sweeper;
use cotan_halfedge::FaceId;
use nalgebra::Vector3;

use super::simplify::Hierarchy;

impl Hierarchy {
    /// Reinserts the vertex removed by the collapse of `halfedge`, at the position of least
    /// energy inside the kernel of its ring. If the kernel is too small for the available
    /// precision, an increasingly large neighbourhood is evened out.
    ///
    /// # Errors
    /// If there is still not enough room.
    pub(in crate::sphere) fn insert(
        &mut self,
        layout: &mut Layout,
        halfedge: u32,
    ) -> Result<(), SphereError> {
        for rings in 0..=MAX_RINGS {
            if rings > 0 {
                make_room(layout, halfedge, rings);
            }
            self.put_back(layout, halfedge);
            let v = layout.table.origin(halfedge);
            if let Some(place) = first_place(layout, halfedge) {
                layout.place[v as usize] = place;
                self.left.push(v);
                return Ok(());
            }
            self.take_out(layout, halfedge);
            for f in target_faces(layout, halfedge) {
                layout.reshape(f);
            }
        }
        Err(SphereError::Flipped {
            count: 1,
            first: FaceId::new(face_of(halfedge)),
        })
    }

    /// Undoes a collapse: connectivity, weights and shapes.
    fn put_back(&mut self, layout: &mut Layout, halfedge: u32) {
        layout.table.undo(halfedge);
        let lost = layout.table.lost_faces(halfedge);
        let star: Vec<usize> = layout.table.outgoing_from(halfedge).map(face_of).collect();
        for &face in star.iter().rev().filter(|f| !lost.contains(f)) {
            if let Some(weight) = self.weights.pop() {
                layout.rest[face].weight = weight;
            }
        }
        for face in star {
            layout.reshape(face);
        }
    }
}

/// The faces around the target of a collapsed halfedge.
fn target_faces(layout: &Layout, halfedge: u32) -> Vec<usize> {
    layout
        .table
        .outgoing(layout.table.target(halfedge))
        .map(face_of)
        .collect()
}

/// A position in the kernel of the ring for the origin of `halfedge`, a few descent steps from
/// the best candidate. Returns `None` if no candidate is valid.
fn first_place(layout: &Layout, halfedge: u32) -> Option<Vector3<f64>> {
    let (v, u) = (layout.table.origin(halfedge), layout.table.target(halfedge));
    let mut star: Vec<Wedge> = Vec::new();
    layout.star(v, &mut star);
    let points = kernel_points(&star, &layout.place[u as usize]);
    // The position before the removal may still be valid.
    let before = std::iter::once(layout.place[v as usize]);
    let places = before.chain(points.iter().map(|p| (layout.round)(p)));
    let valid = places.filter(|p| is_valid(&star, p));
    let mut place = valid
        .min_by(|p, q| energy(&star, p, layout.blend).total_cmp(&energy(&star, q, layout.blend)))?;
    for _ in 0..STEPS {
        match step(&star, &place, 1.0, layout.blend, layout.round) {
            Some(better) => place = better,
            None => break,
        }
    }
    Some(place)
}

/// Evens out the faces within some rings around the target of a collapse, as if they were
/// equilateral and of equal size.
fn make_room(layout: &mut Layout, halfedge: u32, rings: usize) {
    let mut patch = vec![layout.table.target(halfedge)];
    let mut is_in_patch = vec![false; layout.table.num_vertices()];
    is_in_patch[patch[0] as usize] = true;
    let mut start = 0;
    for _ in 0..rings {
        let end = patch.len();
        for i in start..end {
            for w in layout.table.ring(patch[i]) {
                if !std::mem::replace(&mut is_in_patch[w as usize], true) {
                    patch.push(w);
                }
            }
        }
        start = end;
    }
    let mut faces: Vec<usize> = patch
        .iter()
        .flat_map(|&v| layout.table.outgoing(v).map(face_of))
        .collect();
    faces.sort_unstable();
    faces.dedup();
    let kept: Vec<_> = faces.iter().map(|&f| layout.rest[f]).collect();
    // The part of the sphere that the faces cover, divided evenly.
    let covered = |&f: &usize| {
        let [a, b, c] = layout.table.triangle(f).map(|v| layout.place[v as usize]);
        solid_angle(&a, &b, &c).abs() / (4.0 * std::f64::consts::PI)
    };
    let mean = faces.iter().map(covered).sum::<f64>() / faces.len() as f64;
    let blend = std::mem::replace(&mut layout.blend, Blend::new(0.5));
    for &f in &faces {
        layout.rest[f].weight = mean;
        layout.rest[f].cot = [1.0 / 3.0_f64.sqrt(); 3];
    }
    let mut sweeper = Sweeper::new(layout, &patch);
    for _ in 0..ROOM_SWEEPS * rings {
        if sweeper.sweep(layout, 1.0) == 0 {
            break;
        }
    }
    layout.blend = blend;
    for (&f, rest) in faces.iter().zip(kept) {
        layout.rest[f] = rest;
    }
}

/// The corners opposite the vertex do not change while it moves, so a few steps suffice.
const STEPS: usize = 4;
/// The maximum radius, in rings, of the neighbourhood that is evened out.
const MAX_RINGS: usize = 12;
/// Sweeps to even out a neighbourhood, per ring.
const ROOM_SWEEPS: usize = 30;
