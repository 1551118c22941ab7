//! Repairs, with holes that are filled smoothly.

use cotan::halfedge::VertexId;
use cotan_io::{Cure, Document, IoError, Repair, Repaired};

/// A repaired document, and what became of the patches in it.
#[derive(Clone, Debug)]
pub struct Mended {
    /// The repair.
    pub repaired: Repaired,
    /// Why the vertices that fill holes stay in flat triangles, if so.
    pub unfair: Option<String>,
}

/// Makes the repairs, and moves the vertices that they add to holes to where the surface bends
/// least ([`cotan::fair`]).
///
/// That is done where a surface can be built of the repaired document; else the patches stay flat.
///
/// # Errors
/// As [`Repair::apply`].
pub fn mend(repair: &Repair, document: &Document) -> Result<Mended, IoError> {
    let mut repaired = repair.apply(document)?;
    let mut unfair = None;
    if !repaired.added_vertices.is_empty()
        && let Err(problem) = fair(&mut repaired)
    {
        unfair = Some(problem.to_string());
    }
    Ok(Mended { repaired, unfair })
}

/// The option of `cotan repair` that makes one repair.
pub fn option(cure: Cure) -> &'static str {
    match cure {
        Cure::Weld => "--weld",
        Cure::DropDegenerate => "--drop-degenerate",
        Cure::DropZeroArea => "--drop-zero-area",
        Cure::DropDuplicates => "--drop-duplicates",
        Cure::Orient => "--orient",
        Cure::SplitVertices => "--split-vertices",
        Cure::SplitEdges => "--split-edges",
        Cure::FillHoles => "--fill-holes",
        Cure::Compact => "--compact",
    }
}

fn fair(repaired: &mut Repaired) -> Result<(), Box<dyn std::error::Error>> {
    let processing = repaired.document.surface()?;
    let added = repaired.added_vertices.iter();
    let free: Vec<VertexId> = added.filter_map(|&v| processing.vertex(v)).collect();
    let positions = cotan::fair(processing.surface(), &free)?;
    repaired.document.set_positions(&processing, &positions)?;
    Ok(())
}
