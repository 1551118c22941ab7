//! Parts of the creature that can serve as handles.

use cotan_halfedge::VertexId;
use nalgebra::Point3;

use super::parts::Ball;
use crate::scalar::Scalar;
use crate::surface::Positions;

/// A ball in model coordinates that marks a named part.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Region<T: Scalar> {
    /// The name of the part.
    pub name: &'static str,
    /// The centre of the ball.
    pub center: Point3<T>,
    /// The radius of the ball.
    pub radius: T,
}

impl<T: Scalar> Region<T> {
    /// Returns true if `point` lies in the ball or on its border.
    pub fn contains(&self, point: &Point3<T>) -> bool {
        (point - self.center).norm() <= self.radius
    }

    /// The vertices in the ball, in ascending order.
    #[must_use]
    pub fn vertices(&self, positions: &Positions<T>) -> Vec<VertexId> {
        positions
            .iter()
            .filter(|(_, p)| self.contains(p))
            .map(|(v, _)| v)
            .collect()
    }
}

/// Balls around parts of the creature, in its coordinates, used as handles in demonstrations.
///
/// The names are `head`, `tail tip`, `front left foot`, `front right foot`, `hind left foot`,
/// `hind right foot` (left and right from the creature's point of view) and `chest`.
#[must_use]
pub fn creature_regions<T: Scalar>() -> Vec<Region<T>> {
    let region = |(name, (center, radius)): (&'static str, Ball)| Region {
        name,
        center: Point3::from(center.map(T::of_f64)),
        radius: T::of_f64(radius),
    };
    REGIONS.into_iter().map(region).collect()
}

const REGIONS: [(&str, Ball); 7] = [
    ("head", ([0.86, 1.58, 0.0], 0.42)),
    ("tail tip", ([-1.44, 1.12, 0.20], 0.21)),
    ("front left foot", ([0.42, 0.08, -0.24], 0.20)),
    ("front right foot", ([0.42, 0.08, 0.24], 0.20)),
    ("hind left foot", ([-0.34, 0.08, -0.26], 0.20)),
    ("hind right foot", ([-0.34, 0.08, 0.26], 0.20)),
    ("chest", ([0.34, 0.84, 0.0], 0.34)),
];

#[cfg(test)]
mod tests {
    use super::super::{CREATURE_RESOLUTION, creature};
    use super::*;

    #[test]
    fn regions_are_disjoint_connected_parts() {
        let shape = creature::<f64>(CREATURE_RESOLUTION);
        let mut owner = vec![None; shape.num_vertices()];
        for region in creature_regions::<f64>() {
            let part = region.vertices(shape.positions());
            assert!(part.len() > 100, "{}: {}", region.name, part.len());
            for v in &part {
                let before = owner[v.index()].replace(region.name);
                assert_eq!(before, None, "{v} is in {}, too", region.name);
            }
            let mut stack = vec![part[0]];
            let mut reached = std::collections::BTreeSet::new();
            while let Some(v) = stack.pop() {
                if owner[v.index()] == Some(region.name) && reached.insert(v) {
                    stack.extend(shape.connectivity().one_ring(v));
                }
            }
            assert_eq!(reached.len(), part.len(), "{} is in pieces", region.name);
        }
    }
}
