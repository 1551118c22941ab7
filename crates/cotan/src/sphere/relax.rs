//! Improvement of a valid map, blended between angles and areas, that never flips a triangle.

use cotan_geometry::{Positions, Scalar, SurfaceError};
use cotan_halfedge::HalfedgeMesh;

use super::energy::Blend;
use super::error::{SphereError, check_topology};
use super::hierarchy::{Collapses, layout, positions_of, refine, simplify};
use super::layout::{Layout, rounded};
use super::map::SphereMap;
use super::sweep::Sweeper;

/// The number of iterations of [`relax`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct RelaxSettings {
    /// The number of times that the map is coarsened and refined again, which moves whole limbs.
    pub cycles: usize,
    /// The maximum number of final sweeps over all vertices, which even out details.
    pub sweeps: usize,
}

impl Default for RelaxSettings {
    fn default() -> Self {
        Self {
            cycles: 1,
            sweeps: 10,
        }
    }
}

/// Reduces the distortion of a valid sphere map while keeping all triangles upright.
///
/// The energy of a face is its source area times (1 − λ) ½ (σ1/σ2 + σ2/σ1) + λ ½ (r + 1/r), where
/// λ is `balance`, from 0 (angles) to 1 (areas), and r is the face's fraction of the sphere
/// divided by its fraction of the source area. A cycle removes vertices as long as the remaining
/// faces are upright, then reinserts them level by level and relaxes each level, so low
/// frequencies are handled on coarse levels where this is cheap. The energy never increases.
///
/// **Shapes**: one position per vertex, for `source` and `sphere`.
///
/// # Errors
/// [`SphereError`] if `sphere` is not a valid map of `mesh` ([`SphereMap::new`]), if `source` has
/// a different length, or if λ is not in 0 … 1. The map is unchanged in that case.
pub fn relax<T: Scalar>(
    mesh: &HalfedgeMesh,
    source: &Positions<f64>,
    sphere: &mut Positions<T>,
    balance: f64,
    settings: &RelaxSettings,
) -> Result<(), SphereError> {
    let blend = Blend::checked(balance)?;
    let mut layout = checked_layout::<T>(mesh, source, blend)?;
    SphereMap::new(mesh, sphere.clone())?;
    for (place, p) in layout.place.iter_mut().zip(sphere.values()) {
        *place = p.coords.map(T::as_f64);
    }
    for _ in 0..settings.cycles {
        cycle(&mut layout);
    }
    let all: Vec<u32> = (0..layout.table.num_vertices() as u32).collect();
    let mut sweeper = Sweeper::new(&layout, &all);
    for _ in 0..settings.sweeps {
        if sweeper.sweep(&mut layout, 1.0) == 0 {
            break;
        }
    }
    *sphere = positions_of(&layout);
    Ok(())
}

/// The layout of a mesh that is a topological sphere and has matching positions.
pub(super) fn checked_layout<T: Scalar>(
    mesh: &HalfedgeMesh,
    source: &Positions<f64>,
    blend: Blend,
) -> Result<Layout, SphereError> {
    check_topology(mesh)?;
    if source.len() != mesh.num_vertices() {
        return Err(SurfaceError::LengthMismatch {
            positions: source.len(),
            vertices: mesh.num_vertices(),
        }
        .into());
    }
    Ok(layout(mesh, source, blend, rounded::<T>))
}

/// Coarsens and refines, unless that increases the energy.
fn cycle(layout: &mut Layout) {
    let mut other = layout.clone();
    let hierarchy = simplify(&mut other, Collapses::Upright);
    if refine(&mut other, hierarchy).is_ok() && other.energy() < layout.energy() {
        *layout = other;
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{creature, icosphere};
    use cotan_geometry::testing::blobs;
    use cotan_halfedge::FaceId;
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::sphere::embed;

    /// The area-weighted mean of | ln area ratio |.
    fn log_area<T: Scalar>(
        mesh: &HalfedgeMesh,
        source: &Positions<f64>,
        sphere: &Positions<T>,
    ) -> f64 {
        let map = SphereMap::new(mesh, sphere.clone()).expect("a valid map");
        let surface = cotan_geometry::Surface::new(mesh, source).expect("a surface");
        let areas = surface.face_areas();
        let total: f64 = areas.values().sum();
        let of_face = |f: FaceId| {
            let share = areas[f] / total;
            share
                * (map.solid_angle(f) / (4.0 * std::f64::consts::PI) / share)
                    .ln()
                    .abs()
        };
        mesh.faces().map(of_face).sum()
    }

    #[test]
    fn the_slider_leads_from_angles_to_areas() {
        let shape = creature::<f64>(40);
        let (mesh, source) = (shape.connectivity(), shape.positions());
        let mut sphere = embed::<f64>(mesh, source, 0.0).expect("an embedding");
        let mut logs = vec![log_area(mesh, source, &sphere)];
        for balance in [0.5, 1.0] {
            let settings = RelaxSettings::default();
            relax(mesh, source, &mut sphere, balance, &settings).expect("a valid start");
            logs.push(log_area(mesh, source, &sphere));
        }
        assert!(
            logs[1] < 0.7 * logs[0] && logs[2] < logs[0] / 3.0,
            "{logs:?}"
        );
    }

    #[test]
    fn a_limb_that_has_all_but_vanished_gets_its_area_back() {
        let (mesh, source, mut sphere) = crate::sphere::untangle::tests::finger::<f64>(35.0);
        let before = log_area(&mesh, &source, &sphere);
        relax(&mesh, &source, &mut sphere, 1.0, &RelaxSettings::default()).expect("a valid start");
        let after = log_area(&mesh, &source, &sphere);
        assert!(before > 0.9 && after < 0.05, "{before} {after}");
    }

    #[test]
    fn a_round_sphere_stays_where_it_is() {
        let shape = icosphere::<f64>(3);
        let mut sphere = shape.positions().clone();
        relax(
            shape.connectivity(),
            shape.positions(),
            &mut sphere,
            0.5,
            &RelaxSettings::default(),
        )
        .expect("a valid start");
        let pairs = sphere.values().zip(shape.positions().values());
        let moved = pairs.map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
        assert!(moved < 0.02, "{moved}");
    }

    #[test]
    fn invalid_maps_are_refused_and_left_unchanged() {
        let shape = icosphere::<f64>(1);
        let mirrored = shape.positions().map(|p| Point3::new(-p.x, p.y, p.z));
        let mut sphere = mirrored.clone();
        let settings = RelaxSettings::default();
        let result = relax(
            shape.connectivity(),
            shape.positions(),
            &mut sphere,
            0.5,
            &settings,
        );
        assert!(matches!(result, Err(SphereError::Flipped { .. })));
        assert_eq!(sphere, mirrored);
        let mut sphere = shape.positions().clone();
        let result = relax(
            shape.connectivity(),
            shape.positions(),
            &mut sphere,
            f64::NAN,
            &settings,
        );
        assert!(matches!(result, Err(SphereError::Setting { .. })));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn relaxing_lowers_the_energy_and_flips_nothing(
            shape in blobs(),
            from in 0.0..=1.0_f64,
            to in 0.0..=1.0_f64,
        ) {
            let (mesh, source) = (shape.connectivity(), shape.positions());
            let mut sphere = embed::<f32>(mesh, source, from).expect("an embedding");
            let energy = |sphere: &Positions<f32>| {
                let mut layout = checked_layout::<f32>(mesh, source, Blend::new(to)).expect("fits");
                for (place, p) in layout.place.iter_mut().zip(sphere.values()) {
                    *place = p.coords.map(f64::from);
                }
                layout.energy()
            };
            let before = energy(&sphere);
            relax(mesh, source, &mut sphere, to, &RelaxSettings::default()).expect("valid");
            prop_assert!(energy(&sphere) <= before * (1.0 + 1e-12));
            SphereMap::new(mesh, sphere).expect("a valid map");
        }
    }
}
