//! Restores the original positions of faces that smoothing would flip.

use cotan_geometry::{Positions, Scalar, Surface, folded_faces};

use crate::error::Error;

/// Corrects smoothed positions. Then moves the vertices of faces that point against their
/// neighbours, and did not before, back to their original positions, from the second round on
/// together with their neighbours, until no such face is left. After ten rounds, the whole
/// component of such a face is moved back.
///
/// This happens at needles, whose cotangents are huge and whose normals are arbitrary. `correct`
/// receives the positions and the vertices that it must not move: held vertices, which stay at
/// their targets, and those that were moved back. Returns the positions and the number of
/// vertices that were moved back.
pub(crate) fn without_new_folds<T: Scalar>(
    surface: &Surface<'_, T>,
    mut moved: Positions<T>,
    held: &[bool],
    correct: impl Fn(&Positions<T>, &[bool]) -> Result<Positions<T>, Error>,
) -> Result<(Positions<T>, usize), Error> {
    let mesh = surface.mesh();
    let mut still = held.to_vec();
    let mut is_back = vec![false; moved.len()];
    let mut corrected = correct(&moved, &still)?;
    for round in 0..=MAX_ROUNDS {
        let folded = folded_faces(surface, &corrected)?;
        if folded.is_empty() {
            break;
        }
        // Each vertex once, because the ring of a vertex shared by many faces may be as large as
        // the mesh.
        let mut corners: Vec<_> = folded.iter().flat_map(|&f| mesh.triangle(f)).collect();
        corners.sort_unstable();
        corners.dedup();
        for v in corners {
            is_back[v.index()] = true;
            if round > 0 {
                mesh.one_ring(v).for_each(|j| is_back[j.index()] = true);
            }
        }
        if round == MAX_ROUNDS {
            let components = mesh.components();
            let mut is_whole = vec![false; components.count()];
            for &f in &folded {
                is_whole[components.of(mesh.triangle(f)[0])] = true;
            }
            for v in mesh.vertices() {
                is_back[v.index()] |= is_whole[components.of(v)];
            }
        }
        // All copies of a vertex, if any is.
        for (copy, row) in mesh.copies() {
            is_back[row.index()] |= is_back[copy.index()];
        }
        for v in mesh.vertices() {
            let row = mesh.row_of(v).index();
            if is_back[row] && !held[row] {
                moved[v] = surface.position(v);
                still[row] = true;
            }
        }
        corrected = correct(&moved, &still)?;
    }
    let is_back = &is_back[..mesh.num_rows()];
    let count = is_back.iter().filter(|is_back| **is_back).count();
    Ok((corrected, count))
}

/// Each round extends the region by a ring; ten rings around a needle contain its effects.
const MAX_ROUNDS: usize = 10;
