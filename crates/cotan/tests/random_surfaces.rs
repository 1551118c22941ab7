//! Property tests with the strategies of the feature `testing`, using only this crate.

use cotan::prelude::*;
use cotan::testing::{closed_surfaces, rigid_motions, rounded, surfaces};
use proptest::prelude::*;

/// Deforms with the first vertex held in place and the last one moved by `step`.
fn pulled<T: Scalar>(mesh: &Mesh<T>, step: Vector3<T>) -> Positions<T> {
    let [first, last] = [0, mesh.num_vertices() - 1].map(VertexId::new);
    let positions = mesh.positions();
    let handles = Handles::new()
        .move_to(first, positions[first])
        .move_to(last, positions[last] + step);
    let options = DeformOptions::default();
    deform(mesh, &handles, &options)
        .expect("two handles")
        .positions
}

/// Handles that stay in place leave the mesh exactly unchanged.
fn check_rest<T: Scalar>(mesh: &Mesh<T>) -> Result<(), TestCaseError> {
    prop_assert_eq!(&pulled(mesh, Vector3::zeros()), mesh.positions());
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn handles_that_stay_move_nothing(mesh in surfaces()) {
        check_rest(&mesh)?;
    }

    #[test]
    fn handles_that_stay_move_nothing_in_single_precision(mesh in rounded::<f32>(surfaces())) {
        check_rest(&mesh)?;
    }

    #[test]
    fn rigid_motions_keep_the_volume(mesh in closed_surfaces(), motion in rigid_motions()) {
        let surface = mesh.surface();
        let moved = mesh.positions().map(|p| motion * p);
        let after = surface.with_positions(&moved).volume();
        prop_assert!((after / surface.volume() - 1.0).abs() < 1e-9);
    }
}
