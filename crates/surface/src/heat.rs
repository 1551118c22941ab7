//! Geodesic distances by the heat method.
//!
//! ```text
//! 1. heat      (M + t K) u = δ          δ: a unit of heat at the sources
//! 2. direction X = −∇u / |∇u|
//! 3. distance  K φ = −div X             and φ = 0 at the sources
//! ```
//!
//! with the masses M and the stiffness K of the intrinsic Delaunay triangulation. K is an M-matrix
//! there: no solve subtracts, so the heat far away from the sources is right to its last digit even
//! where it is 10⁻²⁰⁰ of that at the sources.
//!
//! **Source**: Crane, Weischedel, Wardetzky 2013, Geodesics in heat: a new approach to computing
//! distance based on heat flow; on the intrinsic Delaunay triangulation as in Sharp and Crane 2020,
//! A Laplacian for nonmanifold triangle meshes.

use cotan_geometry::{Scalar, Surface, SurfaceError, SurfacePoint};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{
    IntrinsicDelaunay, IntrinsicTriangle, IntrinsicTriangulation, Operator, SchemeError,
};
use cotan_linear::{LinearError, LinearSystem};
use cotan_parallel::Chunks;
use nalgebra::{Point3, Vector2};
use thiserror::Error;

use crate::edge_paths::EdgePaths;

/// The reason why distances could not be computed.
#[derive(Clone, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum DistanceError {
    /// The positions do not form a surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// There is no source.
    #[error("there is no source; give one or more vertices or points")]
    NoSource,
    /// A source is no vertex of the mesh.
    #[error(
        "source vertex {vertex} does not exist; the mesh has {num_vertices} vertices, counted from 0"
    )]
    NoSuchVertex {
        /// The vertex.
        vertex: usize,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// A source lies on no face of the mesh.
    #[error("source face {face} does not exist; the mesh has {num_faces} faces, counted from 0")]
    NoSuchFace {
        /// The face.
        face: usize,
        /// The number of faces.
        num_faces: usize,
    },
    /// The weights of a source are not barycentric coordinates.
    #[error(
        "the weights of the source on face {face} are no barycentric coordinates; they are at least 0 and add up to 1"
    )]
    NotBarycentric {
        /// The face.
        face: usize,
    },
    /// No operator could be assembled.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// A system could not be solved.
    #[error(transparent)]
    Linear(#[from] LinearError),
}

/// Settings of [`GeodesicDistances`].
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct HeatOptions {
    /// The time for which heat flows, in squared mean edge lengths. The more, the less the lattice
    /// of the triangles shows, and the rounder the distances become where ways from several
    /// directions meet. Crane et al. recommend 1. The default of 4 halves the error on a sphere
    /// of ten thousand vertices, from 0.7 to 0.33 %.
    pub time: f64,
    /// The triangulation.
    pub scheme: IntrinsicDelaunay,
    /// The memory that each of the two factorizations may take, in bytes.
    pub max_memory: Option<u64>,
}

impl Default for HeatOptions {
    fn default() -> Self {
        Self {
            time: 4.0,
            scheme: IntrinsicDelaunay::default(),
            max_memory: None,
        }
    }
}

impl HeatOptions {
    /// These settings with another [`time`](Self#structfield.time).
    #[must_use]
    pub fn time(mut self, time: f64) -> Self {
        self.time = time;
        self
    }

    /// These settings with another [`scheme`](Self#structfield.scheme).
    #[must_use]
    pub fn scheme(mut self, scheme: IntrinsicDelaunay) -> Self {
        self.scheme = scheme;
        self
    }

    /// These settings with another [`max_memory`](Self#structfield.max_memory).
    #[must_use]
    pub fn max_memory(mut self, max_memory: impl Into<Option<u64>>) -> Self {
        self.max_memory = max_memory.into();
        self
    }
}

/// Distances along a surface: prepared once, solved for any number of sources.
///
/// ```
/// use cotan_geometry::icosphere;
/// use cotan_halfedge::VertexId;
/// use cotan_surface::GeodesicDistances;
///
/// let ball = icosphere::<f64>(3);
/// let distances = GeodesicDistances::new(&ball)?.from_vertices(&[VertexId::new(0)])?;
/// let farthest = distances.values().fold(0.0_f64, |m, d| m.max(*d));
/// assert!((farthest - std::f64::consts::PI).abs() < 0.05);
/// # Ok::<(), cotan_surface::DistanceError>(())
/// ```
///
/// Distances are measured in the units of the positions. They are approximate: on a sphere of ten
/// thousand vertices within 1 % of the true ones. Sources in several components give the distances
/// in each; in a component without a source they are infinite. A boundary reflects.
#[derive(Debug)]
pub struct GeodesicDistances {
    triangulation: IntrinsicTriangulation,
    heat: LinearSystem,
    poisson: LinearSystem,
    num_flips: usize,
    time: f64,
    components: VertexMap<u32>,
    num_components: usize,
    corners: Vec<[VertexId; 3]>,
    positions: Vec<Point3<f64>>,
}

impl GeodesicDistances {
    /// Triangulates the surface and factorizes the two systems.
    ///
    /// # Errors
    /// [`DistanceError`] for positions that are not finite, or if a factorization fails.
    pub fn new<'m, T: Scalar>(surface: impl Into<Surface<'m, T>>) -> Result<Self, DistanceError> {
        Self::with_options(surface, &HeatOptions::default())
    }

    /// As [`Self::new`], with other settings.
    ///
    /// # Errors
    /// As [`Self::new`], and [`LinearError::MemoryLimit`] before anything is factorized.
    pub fn with_options<'m, T: Scalar>(
        surface: impl Into<Surface<'m, T>>,
        options: &HeatOptions,
    ) -> Result<Self, DistanceError> {
        let surface = surface.into();
        let mesh = surface.mesh();
        let surface = Surface::new(mesh, surface.positions())?;
        if mesh.has_copies() {
            return Err(DistanceError::Scheme(SchemeError::Copies {
                scheme: "intrinsic Delaunay".into(),
            }));
        }
        let components = mesh.components();
        let pins = first_of_each(mesh, components.of_vertices(), components.count());
        let mut triangulation = IntrinsicTriangulation::new(&surface, options.scheme.mollification);
        let num_flips = triangulation.flip_to_delaunay();
        let operator: Operator<f64> = triangulation.operator()?;

        let length = triangulation.mean_length();
        let time = options.time * length * length;
        let time = time.max((diameter(&surface, &pins) / MAX_DECAY).powi(2));
        // The operator's weights carry no ½, so the masses are doubled.
        let masses = masses(&triangulation).map(|area| 2.0 * area / time);
        let within = options.max_memory;
        Ok(Self {
            heat: LinearSystem::screened_within(&operator, masses.as_slice(), &[], within)?,
            poisson: LinearSystem::screened_within(&operator, &zeros(masses.len()), &pins, within)?,
            triangulation,
            num_flips,
            time,
            num_components: components.count(),
            components: components.of_vertices().clone(),
            corners: mesh.faces().map(|f| mesh.triangle(f)).collect(),
            positions: surface
                .positions()
                .values()
                .map(|p| p.map(T::as_f64))
                .collect(),
        })
    }

    /// The triangulation on which the systems live.
    pub fn triangulation(&self) -> &IntrinsicTriangulation {
        &self.triangulation
    }

    /// The number of edges that were flipped to make the triangulation Delaunay.
    pub fn num_flips(&self) -> usize {
        self.num_flips
    }

    /// The time for which heat flows, a squared length.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The distances from some vertices.
    ///
    /// **Shapes**: one entry per vertex. **Units**: length.
    ///
    /// # Errors
    /// [`DistanceError::NoSource`], [`DistanceError::NoSuchVertex`].
    pub fn from_vertices(&self, sources: &[VertexId]) -> Result<VertexMap<f64>, DistanceError> {
        let num_vertices = self.positions.len();
        let mut feet = Vec::with_capacity(sources.len());
        for v in sources {
            if v.index() >= num_vertices {
                return Err(DistanceError::NoSuchVertex {
                    vertex: v.index(),
                    num_vertices,
                });
            }
            feet.push(Source {
                corners: [*v; 3],
                weights: [1.0, 0.0, 0.0],
                lengths: [0.0; 3],
            });
        }
        self.solve(&feet)
    }

    /// The distances from some points on the surface, anywhere on its faces.
    ///
    /// **Shapes**: one entry per vertex. **Units**: length.
    ///
    /// # Errors
    /// [`DistanceError::NoSource`], [`DistanceError::NoSuchFace`],
    /// [`DistanceError::NotBarycentric`].
    pub fn from_points(&self, sources: &[SurfacePoint]) -> Result<VertexMap<f64>, DistanceError> {
        let feet: Result<Vec<Source>, DistanceError> =
            sources.iter().map(|source| self.source(source)).collect();
        self.solve(&feet?)
    }

    fn source(&self, point: &SurfacePoint) -> Result<Source, DistanceError> {
        let face = point.face.index();
        let Some(&corners) = self.corners.get(face) else {
            return Err(DistanceError::NoSuchFace {
                face,
                num_faces: self.corners.len(),
            });
        };
        let weights = point.barycentric;
        let is_sound =
            weights.iter().all(|w| *w >= -1e-9) && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-6;
        if !is_sound {
            return Err(DistanceError::NotBarycentric { face });
        }
        let weights = weights.map(|w| w.max(0.0));
        let at = corners.map(|v| self.positions[v.index()]);
        let mut place = at[0].coords * weights[0];
        place += at[1].coords * weights[1] + at[2].coords * weights[2];
        Ok(Source {
            corners,
            weights,
            lengths: at.map(|p| (p.coords - place).norm()),
        })
    }

    fn solve(&self, sources: &[Source]) -> Result<VertexMap<f64>, DistanceError> {
        if sources.is_empty() {
            return Err(DistanceError::NoSource);
        }
        let n = self.positions.len();
        let mut heat = VertexMap::filled(n, 0.0);
        for source in sources {
            for (v, weight) in source.corners.iter().zip(source.weights) {
                heat[*v] += weight;
            }
        }
        let heat = self.heat.solve(&heat);
        let mut given = self.flux(&heat).map(|d| -2.0 * d);
        self.poisson.fixed().iter().for_each(|v| given[*v] = 0.0);
        let mut distances = self.poisson.solve(&given);
        let shifts = self.shifts(sources, &distances);
        for (v, distance) in distances.iter_mut() {
            *distance = match shifts[self.components[v] as usize] {
                Some(shift) => (*distance - shift).max(0.0),
                None => f64::INFINITY,
            };
        }
        Ok(distances)
    }

    /// The integrated divergence of the directions in which heat flows.
    fn flux(&self, heat: &VertexMap<f64>) -> VertexMap<f64> {
        let of_triangles = CHUNKS.filled(self.triangulation.num_triangles(), |t| {
            let triangle = self.triangulation.triangle(t);
            let values = triangle.vertices.map(|v| heat[v]);
            fluxes(&triangle, values).map(|d| d * self.triangulation.share(t))
        });
        let mut flux = VertexMap::filled(heat.len(), 0.0);
        for (t, of_triangle) in of_triangles.iter().enumerate() {
            let vertices = self.triangulation.triangle(t).vertices;
            for (v, d) in vertices.into_iter().zip(of_triangle) {
                flux[v] += d;
            }
        }
        flux
    }

    /// For each component by how much the distances at its sources are too large on average.
    fn shifts(&self, sources: &[Source], distances: &VertexMap<f64>) -> Vec<Option<f64>> {
        let mut sums = vec![(0.0, 0.0); self.num_components];
        for source in sources {
            let sum = &mut sums[self.components[source.corners[0]] as usize];
            for k in 0..3 {
                sum.0 += source.weights[k] * (distances[source.corners[k]] - source.lengths[k]);
                sum.1 += source.weights[k];
            }
        }
        let mean = |(sum, weight): (f64, f64)| (weight > 0.0).then(|| sum / weight);
        sums.into_iter().map(mean).collect()
    }
}

/// A source: weights of three vertices, and its distances from them.
struct Source {
    corners: [VertexId; 3],
    weights: [f64; 3],
    lengths: [f64; 3],
}

/// A ∇φ_k · X of the three corners, negated: the parts of a triangle in the divergence.
fn fluxes(triangle: &IntrinsicTriangle, heat: [f64; 3]) -> [f64; 3] {
    // Far from the sources the heat is so small that its squares would be zero.
    let largest = heat.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    if !(largest > 0.0) {
        return [0.0; 3];
    }
    let corners = triangle.unfolded();
    // A ∇φ_k: half the opposite side, turned inwards.
    let hats = [0, 1, 2].map(|k| {
        let side = corners[(k + 2) % 3] - corners[(k + 1) % 3];
        Vector2::new(-side.y, side.x) * 0.5
    });
    let slope = (hats[1] * (heat[1] - heat[0]) + hats[2] * (heat[2] - heat[0])) / largest;
    let steepness = slope.norm();
    // Where heat from all sides balances, only rounding errors have a direction.
    if !(steepness > MIN_SLOPE * triangle.area().sqrt()) {
        return [0.0; 3];
    }
    let away = slope / -steepness;
    hats.map(|hat| -hat.dot(&away))
}

/// A third of the triangles around each vertex.
fn masses(triangulation: &IntrinsicTriangulation) -> VertexMap<f64> {
    let mut masses = VertexMap::filled(triangulation.num_vertices(), 0.0);
    for t in 0..triangulation.num_triangles() {
        let triangle = triangulation.triangle(t);
        let third = triangulation.share(t) * triangle.area() / 3.0;
        triangle.vertices.iter().for_each(|v| masses[*v] += third);
    }
    // A vertex of triangles without area takes part all the same.
    let least = 1e-12 * masses.values().sum::<f64>() / masses.len().max(1) as f64;
    masses.map(|m| m.max(least))
}

/// The first vertex of each component.
fn first_of_each(mesh: &HalfedgeMesh, components: &VertexMap<u32>, count: usize) -> Vec<VertexId> {
    let mut is_new = vec![true; count];
    let is_first = |v: &VertexId| std::mem::take(&mut is_new[components[*v] as usize]);
    mesh.vertices().filter(is_first).collect()
}

/// A bound of the diameter: twice the length of the longest of the shortest paths along edges.
fn diameter<T: Scalar>(surface: &Surface<'_, T>, pins: &[VertexId]) -> f64 {
    let paths = EdgePaths::from(surface, pins);
    2.0 * paths.distances().values().fold(0.0_f64, |m, d| m.max(*d))
}

fn zeros(len: usize) -> Vec<f64> {
    vec![0.0; len]
}

/// Heat falls by e per √t of distance. Below e⁻⁷⁰⁰ it would be lost.
const MAX_DECAY: f64 = 600.0;

/// The least change of heat across a triangle, relative to its heat, that has a direction.
const MIN_SLOPE: f64 = 1e-8;

/// Triangles per task.
const CHUNKS: Chunks = Chunks::of(2048);

#[cfg(test)]
mod tests {
    use cotan_geometry::Mesh;
    use cotan_geometry::shapes::{bumpy_plane, icosphere};
    use cotan_geometry::testing::{rigid_motions, surfaces};
    use cotan_halfedge::FaceId;
    use cotan_parallel::on_threads;
    use proptest::prelude::*;

    use super::*;

    /// Root mean square of the error relative to that of the great-circle distance.
    fn error_on_sphere(subdivisions: u32) -> f64 {
        let shape = icosphere::<f64>(subdivisions);
        let source = VertexId::new(17);
        let prepared = GeodesicDistances::new(&shape).unwrap();
        let distances = prepared.from_vertices(&[source]).unwrap();
        assert_eq!(distances[source], 0.0);
        let pole = shape.positions()[source].coords;
        let (mut missed, mut total) = (0.0, 0.0);
        for (v, p) in shape.positions().iter() {
            let exact = p.coords.angle(&pole);
            missed += (distances[v] - exact).powi(2);
            total += exact.powi(2);
        }
        (missed / total).sqrt()
    }

    #[test]
    fn distances_on_a_sphere_are_great_circles() {
        let errors = [3, 4, 5].map(error_on_sphere);
        assert!(errors[2] < 0.01, "{errors:?}");
        assert!(
            errors[1] < 0.7 * errors[0] && errors[2] < 0.7 * errors[1],
            "{errors:?}"
        );
    }

    #[test]
    fn points_inside_faces_are_sources_too() {
        let shape = icosphere::<f64>(4);
        let prepared = GeodesicDistances::new(&shape).unwrap();
        let source = SurfacePoint {
            face: FaceId::new(123),
            barycentric: [0.2, 0.5, 0.3],
        };
        let pole = source.position(&shape.surface()).coords;
        let distances = prepared.from_points(&[source]).unwrap();
        for (v, p) in shape.positions().iter() {
            assert!((distances[v] - p.coords.angle(&pole)).abs() < 0.05);
        }
        let wrong = SurfacePoint {
            barycentric: [0.5, 0.6, 0.3],
            ..source
        };
        assert_eq!(
            prepared.from_points(&[wrong]),
            Err(DistanceError::NotBarycentric { face: 123 })
        );
        assert_eq!(prepared.from_points(&[]), Err(DistanceError::NoSource));
        let beyond = prepared.from_vertices(&[VertexId::new(5000)]).unwrap_err();
        assert!(beyond.to_string().contains("5000"), "{beyond}");
    }

    #[test]
    fn a_component_without_a_source_is_infinitely_far() {
        let one = icosphere::<f64>(2);
        let n = one.num_vertices();
        let mut positions = one.to_positions::<f64>();
        positions.extend(
            one.to_positions::<f64>()
                .into_iter()
                .map(|[x, y, z]| [x + 5.0, y, z]),
        );
        let mut corners = one.to_triangles();
        corners.extend(one.to_triangles().into_iter().map(|v| v + n as u32));
        let two = Mesh::<f64>::from_triangles(&positions, &corners).unwrap();
        let prepared = GeodesicDistances::new(&two).unwrap();
        let distances = prepared.from_vertices(&[VertexId::new(3)]).unwrap();
        for (v, d) in distances.iter() {
            assert_eq!(d.is_infinite(), v.index() >= n);
        }
        let both = prepared
            .from_vertices(&[VertexId::new(3), VertexId::new(n + 3)])
            .unwrap();
        for v in 0..n {
            let [a, b] = [v, v + n].map(|v| both[VertexId::new(v)]);
            assert!((a - b).abs() < 1e-9 && (a - distances[VertexId::new(v)]).abs() < 1e-9);
        }
    }

    #[test]
    fn a_long_strip_keeps_its_far_end() {
        // Two thousand edges long: with the usual time the heat would be e⁻²⁰⁰⁰ there.
        let shape = bumpy_plane::<f64>([2000.0, 1.0], [2000, 1], 0.0);
        let prepared = GeodesicDistances::new(&shape).unwrap();
        let distances = prepared.from_vertices(&[VertexId::new(0)]).unwrap();
        let from = shape.positions()[VertexId::new(0)];
        for (v, p) in shape.positions().iter() {
            let exact = (p - from).norm();
            assert!(
                (distances[v] - exact).abs() < 0.01 * exact + 2.0,
                "{} {exact}",
                distances[v]
            );
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn motions_and_scales_commute_and_threads_do_not_matter(
            shape in surfaces(),
            motion in rigid_motions(),
            scale in 0.1..10.0_f64,
            source in any::<prop::sample::Index>(),
        ) {
            let source = [VertexId::new(source.index(shape.num_vertices()))];
            let solve = |shape: &Mesh<f64>| {
                GeodesicDistances::new(shape).unwrap().from_vertices(&source).unwrap()
            };
            let before = solve(&shape);
            prop_assert!(before.values().all(|d| d.is_finite()));
            prop_assert_eq!(&on_threads(1, || solve(&shape)).unwrap(), &before);
            let go = |p: &Point3<f64>| motion * Point3::from(p.coords * scale);
            let moved = shape.with_positions(shape.positions().map(go))?;
            let after = solve(&moved);
            let size = before.values().fold(0.0_f64, |m, d| m.max(*d));
            for (v, d) in before.iter() {
                prop_assert!((after[v] - scale * d).abs() < 1e-4 * scale * size);
            }
        }
    }
}
