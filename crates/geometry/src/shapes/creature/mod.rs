//! The creature: a small dragon made of round cones, used in place of a scanned model.

mod field;
mod flips;
mod nets;
mod parts;
mod regions;
mod relax;

use cotan_halfedge::{HalfedgeMesh, VertexId};
use nalgebra::Point3;

use super::connect;
use crate::mesh::Mesh;
use crate::scalar::Scalar;
use field::Field;
use flips::{Goal, flip_edges, remove_valence_three};

pub use regions::{Region, creature_regions};

/// The resolution used for demonstrations: 11,919 vertices. Of the grids of about this density it
/// gives the best triangles (all angles at least 28.7°).
pub const CREATURE_RESOLUTION: usize = 95;

/// A small dragon with a body, four legs, a neck, a head with horns, ears and eyes, a tail, and a
/// row of plates along its back. The surface is closed and connected, of genus 0.
///
/// It stands on the plane y = 0, faces +x, and is about 2.6 long and 2 high. `resolution` is the
/// number of grid cells along its length, clamped to 64 (5,400 vertices) … 256 (87,000).
/// [`creature_regions`] names parts of it that can serve as handles.
///
/// At the default resolution angles are at least 28° and valences are 4 to 7. The surface is the
/// zero set of a smooth union of round cones, polygonized by surface nets, then relaxed along the
/// surface and improved by edge flips. Building it takes about half a second.
///
/// The bytes are the same in every run: positions are computed with additions, multiplications,
/// divisions and square roots only, in an order that does not depend on the number of threads.
///
/// ```
/// use cotan_geometry::{creature, creature_regions};
/// let shape = creature::<f32>(64);
/// let head = creature_regions::<f32>().into_iter().find(|region| region.name == "head");
/// let handle = head.map(|region| region.vertices(shape.positions())).unwrap_or_default();
/// assert!(handle.len() > 100);
/// ```
#[must_use]
pub fn creature<T: Scalar>(resolution: usize) -> Mesh<T> {
    let field = Field::new(parts::cones());
    let mut resolution = resolution.clamp(MIN_RESOLUTION, MAX_RESOLUTION);
    // Every grid in this range succeeds at the first attempt. If the parts are changed, a gap may
    // close on some grid; the next finer grid opens it.
    loop {
        if let Some((points, faces)) = polygonize(&field, resolution) {
            return connect(&points, &faces);
        }
        resolution += 1;
    }
}

/// Vertices, and faces that are counter-clockwise as seen from the outside.
type Triangles = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// Builds the creature on one grid. Returns `None` if the result is not a connected surface of
/// genus 0.
fn polygonize(field: &Field, resolution: usize) -> Option<Triangles> {
    let mut net = nets::surface_net(field, resolution);
    let by_quads = relax::Neighbours::new(net.points.len(), &net.quads);
    relax::relax(&mut net.points, &by_quads, field, QUAD_ROUNDS);
    let mut faces = relax::triangulate(&net);
    let mesh = HalfedgeMesh::from_faces(net.points.len(), &faces).ok()?;
    let is_sphere = mesh.num_vertices() + mesh.num_faces() == mesh.num_edges() + 2;
    if !is_sphere || !is_connected(&mesh) {
        return None;
    }
    for goal in FLIPS {
        flip_edges(&net.points, &mut faces, goal)?;
        remove_valence_three(&mut net.points, &mut faces)?;
        let by_triangles = relax::Neighbours::new(net.points.len(), &faces);
        relax::relax(&mut net.points, &by_triangles, field, TRIANGLE_ROUNDS);
    }
    relax::project(&mut net.points, field);
    flip_edges(&net.points, &mut faces, Goal::Angle)?;
    Some((net.points, faces))
}

fn is_connected(mesh: &HalfedgeMesh) -> bool {
    let mut seen = vec![false; mesh.num_vertices()];
    let mut stack: Vec<VertexId> = mesh.vertices().take(1).collect();
    let mut num_seen = 0;
    while let Some(v) = stack.pop() {
        if !std::mem::replace(&mut seen[v.index()], true) {
            num_seen += 1;
            stack.extend(mesh.one_ring(v));
        }
    }
    num_seen == mesh.num_vertices()
}

/// Below this the horns are thinner than a cell.
const MIN_RESOLUTION: usize = 64;

/// Gives 87,000 vertices; the grid takes 50 megabytes.
const MAX_RESOLUTION: usize = 256;

/// Rounds of relaxation along the sides of the quads. More rounds change little.
const QUAD_ROUNDS: usize = 6;

/// Flips and relaxation alternate, first for the valences and then for the angles.
const FLIPS: [Goal; 5] = [
    Goal::Valence,
    Goal::Valence,
    Goal::Valence,
    Goal::Angle,
    Goal::Angle,
];

/// Rounds of relaxation along the triangle edges after each pass of flips.
const TRIANGLE_ROUNDS: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::negative_cotangent_share;

    #[test]
    fn the_default_is_a_sphere_with_good_triangles() {
        let shape = creature::<f64>(CREATURE_RESOLUTION);
        let (mesh, surface) = (shape.connectivity(), shape.surface());
        assert!((8_000..15_000).contains(&mesh.num_vertices()));
        assert_eq!(mesh.num_vertices() + mesh.num_faces(), mesh.num_edges() + 2);
        assert!(is_connected(mesh));
        assert!(!mesh.halfedges().any(|h| mesh.is_boundary_halfedge(h)));
        let angles = surface.angle_statistics();
        assert!(
            angles.min > 28_f64.to_radians(),
            "{}",
            angles.min.to_degrees()
        );
        assert!(angles.mean_smallest > 50_f64.to_radians());
        assert!(negative_cotangent_share(&surface) < 1e-3);
        assert!(mesh.vertices().all(|v| (4..=7).contains(&mesh.valence(v))));
        assert!(surface.volume() > 0.5);
        let bounds = surface.bounding_box();
        assert!(bounds.min.y.abs() < 0.02);
        assert!(
            (bounds.longest_side() - 2.7).abs() < 0.1,
            "{}",
            bounds.longest_side()
        );
    }

    #[test]
    fn every_vertex_lies_on_the_surface() {
        let field = Field::new(parts::cones());
        let cell = 2.7 / MIN_RESOLUTION as f64;
        for p in creature::<f64>(MIN_RESOLUTION).positions().values() {
            assert!(
                field.value(p).abs() < 0.01 * cell,
                "{p}: {}",
                field.value(p)
            );
        }
    }

    #[test]
    fn same_bytes_whatever_the_number_of_threads() {
        let build = |threads| {
            cotan_parallel::on_threads(threads, || creature::<f64>(MIN_RESOLUTION)).unwrap()
        };
        assert_eq!(build(1), build(3));
    }

    #[test]
    fn finer_grids_converge_to_the_same_body() {
        let [coarse, fine] = [64, 128].map(|r| creature::<f32>(r).surface().volume());
        assert!((coarse / fine - 1.0).abs() < 0.02, "{coarse} {fine}");
    }
}
