use cotan_geometry::{bumpy_plane, icosphere, torus};
use proptest::prelude::*;

use super::*;

proptest! {
    // Any sequence of allowed edits keeps every invariant.
    #[test]
    fn edits_keep_the_structure_valid(
        shape in 0..3_usize,
        edits in proptest::collection::vec((0..3_u8, any::<u32>()), 1..60),
    ) {
        let mesh = match shape {
            0 => icosphere::<f64>(1),
            1 => torus(1.0, 0.4, 5, 4),
            _ => bumpy_plane([1.0, 1.0], [3, 3], 0.1),
        };
        let mut triangles = Triangles::new(&mesh.surface()).map_err(|e| TestCaseError::fail(e.to_string()))?;
        triangles.check();
        for (edit, choice) in edits {
            let h = choice % triangles.origin.len() as u32;
            if !triangles.is_alive(h) {
                continue;
            }
            match edit {
                0 if triangles.can_collapse(h) => triangles.collapse(h),
                1 if triangles.can_flip(h) => triangles.flip(h),
                2 => {
                    let middle = (triangles.point(triangles.origin(h)) + triangles.point(triangles.target(h))) / 2.0;
                    triangles.split(h, middle);
                }
                _ => {}
            }
            triangles.check();
        }
        let alive = triangles.origin.iter().filter(|&&v| v != NONE).count();
        prop_assert_eq!(alive, 3 * triangles.num_faces);
    }
}
