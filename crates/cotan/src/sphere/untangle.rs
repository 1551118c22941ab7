//! Local repair of flipped triangles of a sphere map. The rest of the map is left unchanged.
//!
//! Vertices at flipped faces are removed until all remaining faces are upright. They are then
//! reinserted in reverse order, each at a position from which its ring is visible, and the patch
//! is relaxed for its angles. Target face areas are taken from the surrounding map, because the
//! faces of a conformal map differ by many orders of magnitude.

use super::corners::face_of;
use super::energy::Blend;
use super::hierarchy::{Hierarchy, cost, flips_after, positions_of};
use super::layout::Layout;
use super::map::solid_angle;
use super::predicate::flipped_faces;
use super::relax::checked_layout;
use super::sweep::Sweeper;
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::HalfedgeMesh;

/// Repairs the flipped triangles of a sphere map and returns the number of those that are left.
///
/// The map must be close to one without flipped triangles: it covers the sphere once and has
/// small patches of flipped faces. Vertices farther than a few rings from a flipped face are not
/// moved. If there is no repair, the map is unchanged. The same holds for a mesh that is not a
/// topological sphere and for positions that do not match it.
///
/// **Shapes**: one position per vertex, for `source` and `sphere`.
pub fn untangle<T: Scalar>(
    mesh: &HalfedgeMesh,
    source: &Positions<f64>,
    sphere: &mut Positions<T>,
) -> usize {
    let before = flipped_faces(mesh, sphere);
    if before.is_empty() || sphere.len() != mesh.num_vertices() {
        return before.len();
    }
    let Ok(mut layout) = checked_layout::<T>(mesh, source, Blend::new(BALANCE)) else {
        return before.len();
    };
    for (place, p) in layout.place.iter_mut().zip(sphere.values()) {
        *place = p.coords.map(T::as_f64);
    }
    let least = 4.0 * T::default_epsilon().as_f64();
    adopt_scale(&mut layout, least * least);
    let flipped = before.iter().map(|f| f.index()).collect();
    let Some((hierarchy, taken)) = take_out_flipped(&mut layout, flipped) else {
        return before.len();
    };
    if put_back(&mut layout, hierarchy, &taken).is_none() {
        return before.len();
    }
    let repaired = positions_of(&layout);
    let after = flipped_faces(mesh, &repaired).len();
    if after < before.len() {
        *sphere = repaired;
    }
    after.min(before.len())
}

/// Scales the weight of each face to the area that the map gives its surroundings, at least
/// `least`.
fn adopt_scale(layout: &mut Layout, least: f64) {
    let faces = 0..layout.table.num_faces();
    let solid = faces.clone().map(|f| {
        let [a, b, c] = layout.table.triangle(f).map(|v| layout.place[v as usize]);
        solid_angle(&a, &b, &c).abs() / (4.0 * std::f64::consts::PI)
    });
    let mut wanted: Vec<f64> = solid.collect();
    for _ in 0..SMOOTHINGS {
        let ratio: Vec<f64> = (0..layout.table.num_vertices() as u32)
            .map(|v| {
                let star = || layout.table.outgoing(v).map(face_of);
                let given: f64 = star().map(|f| wanted[f]).sum();
                given / star().map(|f| layout.rest[f].weight).sum::<f64>()
            })
            .collect();
        for f in faces.clone() {
            let corners = layout.table.triangle(f).map(|v| ratio[v as usize]);
            wanted[f] = layout.rest[f].weight * corners.iter().sum::<f64>() / 3.0;
        }
    }
    for (rest, wanted) in layout.rest.iter_mut().zip(wanted) {
        rest.weight = wanted.max(least);
    }
}

/// Removes vertices until all faces are upright. Returns `None` if that would remove the whole
/// mesh, otherwise the hierarchy and the removed vertices with their rings.
fn take_out_flipped(layout: &mut Layout, mut flipped: Vec<usize>) -> Option<(Hierarchy, Vec<u32>)> {
    let mut hierarchy = Hierarchy::default();
    let mut gone = vec![false; layout.table.num_faces()];
    let (mut collapsed, mut touched) = (Vec::new(), Vec::new());
    while let Some(face) = flipped.pop() {
        if gone[face] || layout.is_upright(face) {
            continue;
        }
        let halfedge = best_rescue(layout, face)?;
        if collapsed.len() + 8 > layout.table.num_vertices() {
            return None;
        }
        for f in layout.table.lost_faces(halfedge) {
            gone[f] = true;
        }
        let (v, u) = (layout.table.origin(halfedge), layout.table.target(halfedge));
        touched.push(v);
        touched.extend(layout.table.ring(v));
        hierarchy.take_out(layout, halfedge);
        // The best collapse may have repaired a face other than this one.
        flipped.push(face);
        let changed: Vec<usize> = layout.table.outgoing(u).map(face_of).collect();
        for f in changed {
            layout.reshape(f);
            // The other faces are examined again when they change again.
            if !layout.is_upright(f) {
                flipped.push(f);
            }
        }
        collapsed.push(halfedge);
    }
    hierarchy.levels.push(collapsed);
    touched.sort_unstable();
    touched.dedup();
    Some((hierarchy, touched))
}

/// The collapse of a corner of a flipped face, or of a neighbour of one, that repairs the most
/// faces.
fn best_rescue(layout: &Layout, face: usize) -> Option<u32> {
    let corners = layout.table.triangle(face);
    let few = |v: &u32| layout.table.valence(*v) <= MAX_VALENCE;
    let mut candidates: Vec<u32> = corners.to_vec();
    candidates.extend(corners.iter().flat_map(|&v| layout.table.ring(v).take(64)));
    candidates.sort_unstable();
    candidates.dedup();
    let halfedges = candidates
        .into_iter()
        .filter(few)
        .flat_map(|v| layout.table.outgoing(v));
    let legal = halfedges.filter(|&h| layout.table.may_collapse(h));
    let rated = legal.filter_map(|h| {
        let v = layout.table.origin(h);
        let star = layout.table.outgoing(v).map(face_of);
        let before = star.filter(|&f| !layout.is_upright(f)).count();
        // A collapse elsewhere that repairs nothing could repeat forever.
        let mends = before as i64 - flips_after(layout, h) as i64;
        (mends > 0 || corners.contains(&v)).then(|| (mends, cost(layout, h), h))
    });
    rated
        .min_by(|a, b| b.0.cmp(&a.0).then(a.1.total_cmp(&b.1)))
        .map(|(_, _, halfedge)| halfedge)
}

/// Reinserts the vertices and relaxes the patch.
fn put_back(layout: &mut Layout, mut hierarchy: Hierarchy, touched: &[u32]) -> Option<()> {
    let level = hierarchy.levels.pop()?;
    let mut star = Vec::new();
    for &halfedge in level.iter().rev() {
        hierarchy.insert(layout, halfedge).ok()?;
        let v = layout.table.origin(halfedge);
        let ring: Vec<u32> = layout.table.ring(v).collect();
        for w in ring.into_iter().chain([v]) {
            if let Some(place) = layout.better_place(w, 1.0, &mut star) {
                layout.place[w as usize] = place;
            }
        }
    }
    let mut sweeper = Sweeper::new(layout, touched);
    for _ in 0..SWEEPS {
        if sweeper.sweep(layout, 1.5) == 0 {
            break;
        }
    }
    Some(())
}

/// Mostly angles, because the repaired part belongs to a conformal map.
const BALANCE: f64 = 0.05;
/// The number of times that the scale of the map is averaged over neighbours.
const SMOOTHINGS: usize = 3;
/// Sweeps over a repaired patch.
const SWEEPS: usize = 60;
/// A hub is not removed, but its neighbours are.
const MAX_VALENCE: u32 = 64;

#[cfg(test)]
pub(super) mod tests {
    use cotan_geometry::shapes::icosphere;
    use cotan_halfedge::VertexId;
    use nalgebra::Vector3;

    use super::*;
    use crate::sphere::SphereMap;

    /// A finger: a cap of an icosphere whose rings shrink by e^(−`steepness`) per radian.
    pub(in crate::sphere) fn finger<T: Scalar>(
        steepness: f64,
    ) -> (HalfedgeMesh, Positions<f64>, Positions<T>) {
        const CAP: f64 = 0.6;
        let shape = icosphere::<f64>(5);
        let pole = shape.positions()[VertexId::new(0)].coords;
        let sphere = shape.positions().map(|p| {
            let angle = (p.coords - pole).norm().min(2.0) / 2.0;
            let angle = 2.0 * angle.asin();
            if !(angle < CAP) || angle == 0.0 {
                return rounded_point(&p.coords);
            }
            let shrunk = CAP * (steepness * (angle - CAP)).exp();
            let sideways = p.coords - pole * p.coords.dot(&pole);
            rounded_point(&(pole + sideways.normalize() * shrunk.tan()))
        });
        let (mesh, positions) = shape.into_parts();
        (mesh, positions, sphere)
    }

    /// Swaps vertices near the tip of the finger with a neighbour.
    fn tangle<T: Scalar>(mesh: &HalfedgeMesh, source: &Positions<f64>, sphere: &mut Positions<T>) {
        let tip = VertexId::new(0);
        let near = |v: &VertexId| (source[*v] - source[tip]).norm() < 0.3;
        for v in mesh.vertices().filter(near).step_by(40) {
            let w = mesh.one_ring(v).next().expect("a neighbour");
            let (a, b) = (sphere[v], sphere[w]);
            sphere[v] = b;
            sphere[w] = a;
        }
    }

    fn rounded_point<T: Scalar>(v: &Vector3<f64>) -> nalgebra::Point3<T> {
        v.normalize().map(T::of_f64).into()
    }

    #[test]
    fn swapped_neighbours_are_disentangled_and_the_rest_stays() {
        let (mesh, source, _) = finger::<f64>(0.0);
        let mut sphere = source.map(|p| rounded_point::<f64>(&p.coords));
        tangle(&mesh, &source, &mut sphere);
        let before = sphere.clone();
        assert!(flipped_faces(&mesh, &sphere).len() > 10);
        assert_eq!(untangle(&mesh, &source, &mut sphere), 0);
        let moved = mesh.vertices().filter(|&v| sphere[v] != before[v]).count();
        assert!(moved < 250, "{moved} of {} moved", mesh.num_vertices());
        SphereMap::new(&mesh, sphere).expect("a valid map");
    }

    #[test]
    fn a_tiny_patch_is_repaired_at_its_own_scale() {
        let (mesh, source, mut sphere) = finger::<f64>(35.0);
        let size = |s: &Positions<f64>| {
            let tip = VertexId::new(0);
            mesh.one_ring(tip)
                .map(|w| (s[w] - s[tip]).norm())
                .fold(0.0, f64::max)
        };
        assert!(size(&sphere) < 1e-8, "{}", size(&sphere));
        tangle(&mesh, &source, &mut sphere);
        assert_eq!(untangle(&mesh, &source, &mut sphere), 0);
        assert!(size(&sphere) < 1e-7, "{}", size(&sphere));
        SphereMap::new(&mesh, sphere).expect("a valid map");
    }

    /// Dozens of rings within a few units in the last place are too many for a local repair and
    /// require a new embedding. The repair is rejected, and the map is unchanged.
    #[test]
    fn irreparable_flips_are_left_unchanged() {
        let (mesh, source, mut sphere) = finger::<f32>(35.0);
        let before = sphere.clone();
        let flipped = flipped_faces(&mesh, &sphere).len();
        let left = untangle(&mesh, &source, &mut sphere);
        assert!(left <= flipped && flipped > 10, "{left} of {flipped}");
        assert!(left == 0 || sphere == before);
        let again = crate::sphere::embed::<f32>(&mesh, &source, 0.0).expect("an embedding");
        SphereMap::new(&mesh, again).expect("a valid map");
    }
}
