//! Rows of vertices of high valence, cut into pieces that are linked.
//!
//! A row r of L with m entries puts m² entries into LᵀL: a vertex with 20,000 neighbours 200 million of
//! them. Such a row is cut into pieces, r = Σ_b p_b, and unknowns s_b link each piece to the next:
//!
//! ```text
//! (r·x)² = min_s  B Σ_b (p_b·x + s_{b−1} − s_b)²        b = 1 … B,   s_0 = s_B = 0
//! ```
//!
//! since the sum of the brackets is r·x, and B numbers of a given sum have the least squares when they are
//! equal. The links therefore have the Schur complement rᵀr: a system with them and zeros in their
//! right-hand side has the same x, and m · (length of a piece) entries.
//!
//! A piece is Σ_j w_ij (x_j − x_i) over some of the neighbours j, so that it vanishes on constants as its
//! row does.
//!
//! **Source**: row stretching as in Grcar, "Matrix stretching for linear equations", 1990; the weight B,
//! which makes it exact for least squares, follows from the formula above.

use cotan_laplacian::OneRings;

use crate::weights::Weights;

/// Valence above which a row is cut. Meshes made by any usual tool stay below it, and are assembled
/// exactly as their formula says.
pub(crate) const HIGH_VALENCE: usize = 128;

/// Neighbours of a piece. Longer ones take more entries, shorter ones more links.
const PIECE: usize = 16;

/// The rows that are cut.
pub(crate) struct Stretched {
    /// Vertices of high valence, ascending, with the number of their first link.
    hubs: Vec<(usize, usize)>,
    num_links: usize,
}

/// One piece of the row of a hub.
pub(crate) struct Piece {
    /// The vertex whose row it is.
    pub(crate) hub: usize,
    /// Its neighbours, as entries of the rings.
    pub(crate) range: std::ops::Range<usize>,
    /// B.
    pub(crate) weight: f64,
    /// Coefficient of the hub itself.
    pub(crate) own: f64,
    /// The links to the pieces before and behind, with their coefficients; none at the ends.
    pub(crate) links: [Option<(usize, f64)>; 2],
}

impl Stretched {
    pub(crate) fn new(rings: &OneRings) -> Self {
        let mut hubs = Vec::new();
        let mut num_links = 0;
        for i in 0..rings.num_vertices() {
            let valence = rings.range(i).len();
            if valence > HIGH_VALENCE {
                hubs.push((i, num_links));
                num_links += valence.div_ceil(PIECE) - 1;
            }
        }
        Self { hubs, num_links }
    }

    /// Number of unknowns that are added.
    pub(crate) fn num_links(&self) -> usize {
        self.num_links
    }

    /// Whether the row of vertex `i` is cut.
    pub(crate) fn is_cut(&self, i: usize) -> bool {
        !self.hubs.is_empty() && self.first_link(i).is_some()
    }

    fn first_link(&self, i: usize) -> Option<usize> {
        let found = self.hubs.binary_search_by_key(&i, |&(hub, _)| hub);
        found.ok().map(|k| self.hubs[k].1)
    }

    /// The pieces of the row of a hub.
    pub(crate) fn pieces<'a>(
        &'a self,
        rings: &'a OneRings,
        weights: &'a Weights,
        hub: usize,
    ) -> impl Iterator<Item = Piece> + 'a {
        let count = rings.range(hub).len().div_ceil(PIECE);
        (0..count).filter_map(move |b| self.piece(rings, weights, hub, b))
    }

    /// The piece in which the row of a hub has its neighbour `i`.
    pub(crate) fn piece_with(
        &self,
        rings: &OneRings,
        weights: &Weights,
        hub: usize,
        i: usize,
    ) -> Option<Piece> {
        let ring = &rings.neighbours()[rings.range(hub)];
        let place = ring.binary_search_by_key(&i, |j| j.index()).ok()?;
        self.piece(rings, weights, hub, place / PIECE)
    }

    fn piece(&self, rings: &OneRings, weights: &Weights, hub: usize, b: usize) -> Option<Piece> {
        let first = self.first_link(hub)?;
        let row = rings.range(hub);
        let count = row.len().div_ceil(PIECE);
        let start = row.start + b * PIECE;
        let range = start..row.end.min(start + PIECE);
        let own = -range.clone().map(|k| weights.outgoing(k)).sum::<f64>();
        let unit = link_unit(weights, row);
        let before = (b > 0).then(|| (first + b - 1, unit));
        let behind = (b + 1 < count).then(|| (first + b, -unit));
        Some(Piece {
            hub,
            range,
            weight: count as f64,
            own,
            links: [before, behind],
        })
    }

    /// The lower triangle of the links' own block: for every link its diagonal entry, and the entry
    /// below it if the next link belongs to the same row.
    pub(crate) fn link_columns(
        &self,
        rings: &OneRings,
        weights: &Weights,
    ) -> impl Iterator<Item = (f64, Option<f64>)> {
        let mut columns = Vec::with_capacity(self.num_links);
        for &(hub, _) in &self.hubs {
            let row = rings.range(hub);
            let count = row.len().div_ceil(PIECE);
            let entry = count as f64 * link_unit(weights, row).powi(2);
            for link in 1..count {
                columns.push((2.0 * entry, (link + 1 < count).then_some(-entry)));
            }
        }
        columns.into_iter()
    }

    /// No fewer entries than the lower triangle of LᵀL with its links has.
    pub(crate) fn bound_of_product(&self, rings: &OneRings) -> u64 {
        let square = |len: usize| (len as u64 + 1) * (len as u64 + 2) / 2;
        let rows = (0..rings.num_vertices()).map(|i| match rings.range(i).len() {
            len if len > HIGH_VALENCE => len.div_ceil(PIECE) as u64 * square(PIECE + 2),
            len => square(len),
        });
        rows.sum()
    }
}

/// Coefficient of the links of a row: of the size of its weights.
fn link_unit(weights: &Weights, row: std::ops::Range<usize>) -> f64 {
    let len = row.len() as f64;
    let mean = row.map(|k| weights.outgoing(k).abs()).sum::<f64>() / len;
    if mean.is_normal() { mean } else { 1.0 }
}
