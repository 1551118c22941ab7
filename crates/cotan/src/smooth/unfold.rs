//! Smoothed faces that would turn over are left as they were.

use cotan_geometry::{Positions, Scalar, Surface, folded_faces};

use crate::error::Error;

/// Corrects smoothed positions, and puts the vertices of faces that then point against their
/// neighbours, and did not before, back to where they were; from the second round on with their
/// neighbours, until no such face is left; after ten rounds with all of the component that it is
/// in.
///
/// Needles are where this happens: their cotangents are huge and their normals chance. `correct`
/// gets the positions and the vertices that it must leave alone: held ones, which stay at their
/// targets, and those that were put back. Returns the positions, and how many vertices were put
/// back.
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
    for round in 0..=MOST_ROUNDS {
        let folded = folded_faces(surface, &corrected)?;
        if folded.is_empty() {
            break;
        }
        // Each vertex once: the ring of one that many faces share may be as large as the mesh.
        let mut corners: Vec<_> = folded.iter().flat_map(|&f| mesh.triangle(f)).collect();
        corners.sort_unstable();
        corners.dedup();
        for v in corners {
            is_back[v.index()] = true;
            if round > 0 {
                mesh.one_ring(v).for_each(|j| is_back[j.index()] = true);
            }
        }
        if round == MOST_ROUNDS {
            let components = mesh.components();
            let mut is_whole = vec![false; components.count()];
            for &f in &folded {
                is_whole[components.of(mesh.triangle(f)[0])] = true;
            }
            for v in mesh.vertices() {
                is_back[v.index()] |= is_whole[components.of(v)];
            }
        }
        for v in mesh.vertices() {
            if is_back[v.index()] && !held[v.index()] {
                moved[v] = surface.position(v);
                still[v.index()] = true;
            }
        }
        corrected = correct(&moved, &still)?;
    }
    let count = is_back.iter().filter(|is_back| **is_back).count();
    Ok((corrected, count))
}

/// Each round takes in a ring more; ten rings around a needle hold whatever it did.
const MOST_ROUNDS: usize = 10;
