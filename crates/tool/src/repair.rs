//! Repairs in which filled holes are faired.

use cotan::halfedge::VertexId;
use cotan_io::{Cure, Document, IoError, Repair, Repaired, Weld};

/// A repaired document, and the outcome of fairing its patches.
#[derive(Clone, Debug)]
pub struct Mended {
    /// The repair.
    pub repaired: Repaired,
    /// The reason why the patches were left flat, if they were.
    pub unfair: Option<String>,
}

/// Applies the repairs, and moves the vertices added to holes so that the surface bends as little
/// as possible ([`cotan::fair`]).
///
/// Fairing requires that the repaired document has a surface; otherwise the patches stay flat.
///
/// # Errors
/// As for [`Repair::apply`].
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

/// The `cotan repair` option that makes a given repair.
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

/// The option of `cotan repair` for this welding; `None` if there is none.
pub fn weld_option(weld: Weld) -> Option<String> {
    match weld {
        Weld::Exact => Some("--weld exact".to_owned()),
        // All digits, so that the option can be pasted.
        Weld::Within(distance) => Some(format!("--weld {distance:?}")),
        Weld::AsFormat | Weld::Off => None,
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
