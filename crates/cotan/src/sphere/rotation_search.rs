//! Search for the rotation that best matches one function on the sphere to another.
//!
//! The mean square difference has many local minima. A grid over all rotations is therefore
//! evaluated first, using a table of the function. The best candidates that are far apart are
//! then refined by a pattern search (steps along three axes, halved when none of them helps).

use cotan_geometry::{Scalar, icosphere};
use cotan_halfedge::VertexMap;
use cotan_parallel::{self as parallel, Chunks};
use nalgebra::{Rotation3, Vector3};

use super::error::SphereError;
use super::geometry_image::{GeometryImage, nearest_pixel};
use super::interpolate::Attribute;
use super::locate::PointLocation;
use super::map::SphereMap;

/// A function on the sphere to be rotated.
pub(crate) struct Turnable<'a, T: Scalar, A> {
    location: PointLocation<'a, T>,
    attribute: &'a VertexMap<A>,
    /// The function as a table, for fast lookup.
    table: GeometryImage<A>,
}

/// The target values in some directions after the rotation.
pub(crate) struct Wanted<A> {
    directions: Vec<Vector3<f64>>,
    values: Vec<A>,
}

impl<A> Wanted<A> {
    /// The values of another function at the vertices of the icosphere of this level.
    pub(crate) fn of<T: Scalar>(
        location: &PointLocation<'_, T>,
        attribute: &VertexMap<A>,
        level: u32,
    ) -> Result<Self, SphereError>
    where
        A: Attribute<T>,
    {
        let (_, directions) = icosphere::<f64>(level).into_parts();
        let rounded = directions.map(|p| p.map(T::of_f64));
        let places = location.locate_all(&rounded)?;
        Ok(Self {
            directions: directions.values().map(|p| p.coords).collect(),
            values: location.map().interpolate_all(attribute, &places)?,
        })
    }
}

impl<'a, T: Scalar, A: Attribute<T>> Turnable<'a, T, A> {
    /// Tabulates an attribute of a map.
    pub(crate) fn new(
        map: &'a SphereMap<T>,
        attribute: &'a VertexMap<A>,
    ) -> Result<Self, SphereError> {
        map.check_attribute(attribute)?;
        let location = map.point_location();
        Ok(Self {
            table: location.tabulate(attribute, TABLE_SIZE),
            location,
            attribute,
        })
    }

    /// The mean square difference after a rotation by `rotation`.
    pub(crate) fn mean_square(&self, wanted: &Wanted<A>, rotation: &Rotation3<f64>) -> f64 {
        let (map, back) = (self.location.map(), rotation.inverse());
        let (directions, values) = (&wanted.directions, &wanted.values);
        let squares = Chunks::of(256).filled(directions.len(), |i| {
            let place = self.location.locate_unit(&(back * directions[i]));
            map.blend(self.attribute, &place)
                .distance_squared(&values[i])
        });
        squares.iter().sum::<f64>() / squares.len() as f64
    }

    /// Like [`Turnable::mean_square`], using the nearest table entries.
    fn rough_mean_square(&self, wanted: &Wanted<A>, rotation: &Rotation3<f64>) -> f64 {
        let back = rotation.inverse();
        let square = |(d, value): (&Vector3<f64>, &A)| {
            let pixel = nearest_pixel(&(back * d), TABLE_SIZE);
            self.table.values[pixel].distance_squared(value)
        };
        let pairs = wanted.directions.iter().zip(&wanted.values);
        pairs.map(square).sum::<f64>() / wanted.values.len() as f64
    }

    /// Finds the rotation with the least mean square difference: a search with `coarse`, refined
    /// with `fine`.
    pub(crate) fn search(&self, coarse: &Wanted<A>, fine: &Wanted<A>) -> Rotation3<f64> {
        let grid = rotation_grid();
        let mut costs = Chunks::of(16).filled(grid.len(), |i| {
            (self.rough_mean_square(coarse, &grid[i]), grid[i])
        });
        // The sort is stable, so the first of equal candidates wins.
        costs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rough = |r: &Rotation3<f64>| self.mean_square(coarse, r);
        let refined = parallel::tasks(apart(&costs), |start| {
            refine(start, GRID_STEP, COARSE_STEP, rough)
        });
        let best = refined.iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let start = best.map_or(Rotation3::identity(), |&(_, rotation)| rotation);
        refine(start, COARSE_STEP, FINE_STEP, |r| self.mean_square(fine, r)).1
    }
}

/// The first few rotations of a sorted list that are not close to each other.
fn apart(sorted: &[(f64, Rotation3<f64>)]) -> Vec<Rotation3<f64>> {
    let mut chosen: Vec<Rotation3<f64>> = Vec::with_capacity(CANDIDATES);
    for (_, rotation) in sorted {
        if chosen
            .iter()
            .all(|c| c.angle_to(rotation) > 2.0 * GRID_STEP)
        {
            chosen.push(*rotation);
            if chosen.len() == CANDIDATES {
                break;
            }
        }
    }
    chosen
}

/// Moves to better neighbours at distance `step`, which is reduced until it is below `last`.
fn refine(
    start: Rotation3<f64>,
    first: f64,
    last: f64,
    cost: impl Fn(&Rotation3<f64>) -> f64,
) -> (f64, Rotation3<f64>) {
    let mut best = (cost(&start), start);
    let mut step = first;
    while step >= last {
        let mut is_better = false;
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            for direction in [step, -step] {
                let turned = Rotation3::new(axis * direction) * best.1;
                let found = cost(&turned);
                if found < best.0 {
                    best = (found, turned);
                    is_better = true;
                }
            }
        }
        if !is_better {
            step *= 0.5;
        }
    }
    best
}

/// 642 · 40 rotations: each direction of an icosphere as the pole, with 40 rotations about each.
fn rotation_grid() -> Vec<Rotation3<f64>> {
    let (_, poles) = icosphere::<f64>(3).into_parts();
    let turns = (0..40).map(|k| f64::from(k) * GRID_STEP);
    let turns: Vec<Rotation3<f64>> = turns
        .map(|angle| Rotation3::new(Vector3::z() * angle))
        .collect();
    let to_pole = |d: &Vector3<f64>| {
        let half_turn = Rotation3::new(Vector3::x() * std::f64::consts::PI);
        Rotation3::rotation_between(&Vector3::z(), d).unwrap_or(half_turn)
    };
    let rotations = poles.values().flat_map(|p| {
        let tilt = to_pole(&p.coords);
        turns.iter().map(move |turn| tilt * turn)
    });
    rotations.collect()
}

/// Pixels across the table: each direction lies within 4° of its pixel.
const TABLE_SIZE: usize = 65;
/// 9°, about the vertex distance of an icosphere with 642 vertices.
const GRID_STEP: f64 = std::f64::consts::TAU / 40.0;
/// Half a degree; below this the finer samples are used.
const COARSE_STEP: f64 = 0.5 * std::f64::consts::PI / 180.0;
const FINE_STEP: f64 = 1e-5;
/// The number of candidates that are refined.
const CANDIDATES: usize = 12;

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::rotations;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_rotation_is_far_from_the_grid(turn in rotations()) {
            let nearest = rotation_grid()
                .iter()
                .map(|r| r.angle_to(&turn))
                .fold(f64::INFINITY, f64::min);
            prop_assert!(nearest < GRID_STEP, "{}", nearest.to_degrees());
        }
    }

    #[test]
    fn the_pattern_search_ends_at_a_minimum() {
        let aim = Rotation3::new(Vector3::new(0.05, -0.1, 0.02));
        let (cost, found) = refine(Rotation3::identity(), 0.1, 1e-7, |r| r.angle_to(&aim));
        assert!(cost < 1e-6 && found.angle_to(&aim) < 1e-6);
    }
}
