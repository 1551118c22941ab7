//! The discs at which handles of a single vertex pull, and the bumps that bring those vertices to
//! their targets.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexId;
use cotan_linear::Hold;
use nalgebra::Vector3;

use crate::net::{Distances, Net};
use crate::rest::Rest;
use crate::targets::Targets;

/// The vertices that a point handle pulls.
#[derive(Debug)]
pub(crate) struct Disc {
    /// The handle.
    pub(crate) vertex: VertexId,
    /// Its index among the handles.
    pub(super) handle: usize,
    /// The distance along the edges within which vertices are pulled.
    pub(crate) radius: f64,
    /// ω, ascending by vertex.
    pub(crate) weights: Vec<(u32, f64)>,
    /// The part of the handle's displacement that each vertex around it takes.
    pub(super) bump: Vec<(u32, f64)>,
    /// c.
    pub(super) compliance: f64,
    /// o.
    pub(super) offset: Vector3<f64>,
}

impl Disc {
    /// x_h − Σ ω_j x_j.
    pub(super) fn offset_in<T: Scalar>(&self, positions: &Positions<T>) -> Vector3<f64> {
        let x = positions.as_slice();
        let vertex = positions[self.vertex];
        let ways = self.weights.iter();
        ways.map(|(i, w)| (vertex - x[*i as usize]).map(T::as_f64) * *w)
            .sum()
    }

    /// The gap at these positions.
    pub(super) fn gap<T: Scalar>(
        &self,
        targets: &Targets<T>,
        positions: &Positions<T>,
    ) -> Vector3<f64> {
        let way = targets.in_box()[self.handle] - positions[self.vertex];
        // Exactly zero for a shape at rest.
        way.map(T::as_f64) + (self.offset_in(positions) - self.offset)
    }
}

/// The largest number of point handles that pull at discs. More of them hold the mesh so closely
/// that cones are small, and their columns would take more memory than the factorization.
pub(crate) const MAX_POINTS: usize = 24;

/// The discs of the hard handles that no other handle touches. A disc ends before the next handle,
/// and halfway to the next point handle.
pub(super) fn discs<T: Scalar>(rest: &Rest<T>, targets: &Targets<T>, radius: f64) -> Vec<Disc> {
    let n = rest.positions().len();
    let mut is_held = vec![false; n];
    let held = targets.held();
    held.iter().for_each(|h| is_held[h.vertex.index()] = true);
    let net = Net::new(rest);
    let is_point = |v: usize| is_held[v] && net.neighbours(v).all(|j| !is_held[j]);
    let components = rest.mesh().components();
    let mut num_held = vec![0; components.count()];
    held.iter()
        .for_each(|h| num_held[components.of(h.vertex)] += 1);
    let single = |(index, handle): (usize, &cotan_linear::Handle)| {
        let is_single = handle.hold == Hold::Hard
            && is_point(handle.vertex.index())
            && num_held[components.of(handle.vertex)] >= FEWEST_HELD;
        is_single.then_some((index, handle.vertex))
    };
    let single: Vec<(usize, VertexId)> = targets
        .handles()
        .iter()
        .enumerate()
        .filter_map(single)
        .collect();
    if single.len() > MAX_POINTS {
        return Vec::new();
    }
    let areas = rest.areas();
    let mut distances = Distances::within(n, radius);
    let mut discs = Vec::new();
    for (handle, vertex) in single {
        distances.clear();
        distances.spread(&net, [vertex.index()]);
        let mut reach = radius;
        for (i, distance) in distances.reached() {
            let i = i as usize;
            if is_held[i] && i != vertex.index() {
                reach = reach.min(if is_point(i) {
                    0.5 * distance
                } else {
                    distance
                });
            }
        }
        let weight = |(i, distance): (u32, f64)| {
            let t = distance / reach;
            let area = areas.as_slice()[i as usize].as_f64();
            (t < 1.0).then(|| (i, area * (1.0 - t).powi(2) * (1.0 + 2.0 * t)))
        };
        let mut weights: Vec<(u32, f64)> = distances.reached().filter_map(weight).collect();
        weights.sort_unstable_by_key(|(i, _)| *i);
        let sum: f64 = weights.iter().map(|(_, w)| w).sum();
        if weights.len() < 2 || !(sum > 0.0) {
            continue;
        }
        weights.iter_mut().for_each(|(_, w)| *w /= sum);
        let bump = bump(&net, vertex.index(), BUMP * radius, &is_held);
        discs.push(Disc {
            vertex,
            bump,
            handle,
            radius: reach,
            weights,
            compliance: 0.0,
            offset: Vector3::zeros(),
        });
    }
    discs
}

/// The radius of a bump over that of a disc.
const BUMP: f64 = 1.5;

/// The part of a handle's displacement that the vertices around it take: 1 at the handle, 0 at
/// `radius` and at other handles. Of the profiles that start and end level it bends least.
fn bump(net: &Net<'_>, center: usize, radius: f64, is_held: &[bool]) -> Vec<(u32, f64)> {
    let mut is_seen = vec![false; is_held.len()];
    let mut open = vec![center];
    let mut reach = radius;
    let mut around = Vec::new();
    is_seen[center] = true;
    while let Some(i) = open.pop() {
        let distance = net.length(center, i);
        around.push((i as u32, distance));
        if is_held[i] && i != center {
            reach = reach.min(distance);
        }
        for j in net.neighbours(i) {
            if !is_seen[j] && net.length(center, j) < radius {
                is_seen[j] = true;
                open.push(j);
            }
        }
    }
    around.retain(|(_, distance)| *distance < reach);
    let profile = |t: f64| match t < 0.5 {
        true => 1.0 - 2.0 * t * t,
        false => 2.0 * (1.0 - t).powi(2),
    };
    let part = |(i, distance): (u32, f64)| (i, profile(distance / reach));
    around.into_iter().map(part).collect()
}

/// A component that fewer vertices hold can turn about them, which springs would hinder.
const FEWEST_HELD: usize = 3;

#[cfg(test)]
mod tests {
    use crate::point_handles::tests::work;

    #[test]
    fn discs_end_before_other_handles_and_their_weights_add_up_to_one() {
        let work = work();
        let points = work.point_handles.as_ref().unwrap();
        let held = work.targets.handles();
        for disc in points.discs() {
            let sum: f64 = disc.weights.iter().map(|(_, w)| w).sum();
            assert!((sum - 1.0).abs() < 1e-12);
            for handle in held.iter().filter(|h| h.vertex != disc.vertex) {
                let at = handle.vertex.index() as u32;
                assert!(disc.weights.iter().all(|(i, _)| *i != at));
                assert!(disc.bump.iter().all(|(i, _)| *i != at));
            }
        }
    }
}
