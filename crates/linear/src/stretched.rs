//! Rows of vertices of high valence, cut into pieces that are linked.
//!
//! A row r of L with m entries puts m² entries into LᵀL: 400 million for a vertex with 20,000
//! neighbours, half of them in its lower triangle. Such a row is cut into pieces, r = Σ_b p_b, and
//! unknowns s_b link each piece to the next:
//!
//! ```text
//! (r·x)² = min_s  B Σ_b (p_b·x + s_{b−1} − s_b)²        b = 1 … B,   s_0 = s_B = 0
//! ```
//!
//! since the sum of the brackets is r·x, and the squares of B numbers of a given sum are least if
//! the numbers are equal. The links therefore have the Schur complement rᵀr: a system with them
//! and zeros in their right-hand side has the same x, and m · (length of a piece) entries.
//!
//! A piece is Σ_j w_ij (x_j − x_i) over some of the neighbours j, so that it vanishes on
//! constants as its row does.
//!
//! **Source**: row stretching as in Grcar, "Matrix stretching for linear equations", 1990; the
//! weight B, which makes it exact for least squares, follows from the formula above.

use cotan_laplacian::Graph;

use crate::weights::Weights;

/// Valence above which a row is cut. Meshes made by any usual tool stay below it, and are
/// assembled exactly as their formula says.
pub(crate) const HIGH_VALENCE: usize = 128;

/// Neighbours of a piece. Longer ones take more entries, shorter ones more links.
const PIECE: usize = 16;

/// The rows that are cut.
pub(crate) struct Stretched {
    /// Vertices of high valence, ascending.
    hubs: Vec<Hub>,
    num_links: usize,
}

/// A vertex of high valence.
struct Hub {
    vertex: usize,
    first_link: usize,
    /// The entries of its row, from neighbour to neighbour around it.
    entries: Vec<u32>,
    /// The place of each entry of the row among these.
    places: Vec<u32>,
}

/// One piece of the row of a hub.
pub(crate) struct Piece<'a> {
    /// The vertex whose row it is.
    pub(crate) hub: usize,
    /// Its neighbours, as entries of the graph.
    pub(crate) entries: &'a [u32],
    /// B.
    pub(crate) weight: f64,
    /// Coefficient of the hub itself.
    pub(crate) own: f64,
    /// The links to the pieces before and behind, with their coefficients; none at the ends.
    pub(crate) links: [Option<(usize, f64)>; 2],
}

impl Stretched {
    pub(crate) fn new(graph: &Graph) -> Self {
        let mut hubs = Vec::new();
        let mut num_links = 0;
        for i in 0..graph.num_rows() {
            let valence = graph.range(i).len();
            if valence > HIGH_VALENCE {
                hubs.push(Hub::new(graph, i, num_links));
                num_links += valence.div_ceil(PIECE) - 1;
            }
        }
        Self { hubs, num_links }
    }

    /// The number of unknowns that are added.
    pub(crate) fn num_links(&self) -> usize {
        self.num_links
    }

    /// Returns `true` if the row of vertex `i` is cut.
    pub(crate) fn is_cut(&self, i: usize) -> bool {
        !self.hubs.is_empty() && self.hub(i).is_some()
    }

    fn hub(&self, i: usize) -> Option<&Hub> {
        let found = self.hubs.binary_search_by_key(&i, |hub| hub.vertex);
        found.ok().map(|k| &self.hubs[k])
    }

    /// The pieces of the row of a hub.
    pub(crate) fn pieces<'a>(
        &'a self,
        weights: &'a Weights,
        hub: usize,
    ) -> impl Iterator<Item = Piece<'a>> + 'a {
        let hub = self.hub(hub).into_iter();
        hub.flat_map(move |hub| (0..hub.num_pieces()).map(move |b| hub.piece(weights, b)))
    }

    /// The piece in which the row of a hub has its neighbour `i`.
    pub(crate) fn piece_with(
        &self,
        graph: &Graph,
        weights: &Weights,
        hub: usize,
        i: usize,
    ) -> Option<Piece<'_>> {
        let ring = &graph.neighbours()[graph.range(hub)];
        let entry = ring.binary_search_by_key(&i, |j| j.index()).ok()?;
        let hub = self.hub(hub)?;
        Some(hub.piece(weights, hub.places[entry] as usize / PIECE))
    }

    /// The lower triangle of the links' own block: for every link its diagonal entry, and the
    /// entry below it if the next link belongs to the same row.
    pub(crate) fn link_columns(
        &self,
        weights: &Weights,
    ) -> impl Iterator<Item = (f64, Option<f64>)> {
        let mut columns = Vec::with_capacity(self.num_links);
        for hub in &self.hubs {
            let count = hub.num_pieces();
            let entry = count as f64 * hub.link_unit(weights).powi(2);
            for link in 1..count {
                columns.push((2.0 * entry, (link + 1 < count).then_some(-entry)));
            }
        }
        columns.into_iter()
    }

    /// No fewer entries than the lower triangle of LᵀL with its links has.
    pub(crate) fn bound_of_product(&self, graph: &Graph) -> u64 {
        let square = |len: usize| (len as u64 + 1) * (len as u64 + 2) / 2;
        let rows = (0..graph.num_rows()).map(|i| match graph.range(i).len() {
            len if len > HIGH_VALENCE => len.div_ceil(PIECE) as u64 * square(PIECE + 2),
            len => square(len),
        });
        rows.sum()
    }
}

impl Hub {
    fn new(graph: &Graph, vertex: usize, first_link: usize) -> Self {
        let row = graph.range(vertex);
        let entries = around(graph, vertex);
        let mut places = vec![0; entries.len()];
        for (place, &entry) in entries.iter().enumerate() {
            places[entry as usize - row.start] = place as u32;
        }
        Self {
            vertex,
            first_link,
            entries,
            places,
        }
    }

    fn num_pieces(&self) -> usize {
        self.entries.len().div_ceil(PIECE)
    }

    fn piece(&self, weights: &Weights, b: usize) -> Piece<'_> {
        let (count, start) = (self.num_pieces(), b * PIECE);
        let entries = &self.entries[start..self.entries.len().min(start + PIECE)];
        let sum: f64 = entries.iter().map(|&k| weights.outgoing(k as usize)).sum();
        let unit = self.link_unit(weights);
        let before = (b > 0).then(|| (self.first_link + b - 1, unit));
        let behind = (b + 1 < count).then(|| (self.first_link + b, -unit));
        Piece {
            hub: self.vertex,
            entries,
            weight: count as f64,
            own: -sum,
            links: [before, behind],
        }
    }

    /// Coefficient of the links: of the size of the weights.
    fn link_unit(&self, weights: &Weights) -> f64 {
        // Of some of them: each piece asks.
        let some = &self.entries[..PIECE];
        let mean = some
            .iter()
            .map(|&k| weights.outgoing(k as usize).abs())
            .sum::<f64>()
            / PIECE as f64;
        if mean.is_normal() { mean } else { 1.0 }
    }
}

/// The entries of a row, ordered so that adjacent neighbours follow each other: the vertices of a
/// piece are then close together on the mesh and fill in little, whatever their indices.
fn around(graph: &Graph, vertex: usize) -> Vec<u32> {
    let row = graph.range(vertex);
    let ring = &graph.neighbours()[row.clone()];
    let mut is_taken = vec![false; ring.len()];
    let mut entries = Vec::with_capacity(ring.len());
    for start in 0..ring.len() {
        let mut next = Some(start);
        while let Some(at) = next.filter(|&at| !is_taken[at]) {
            is_taken[at] = true;
            entries.push((row.start + at) as u32);
            // Not through all neighbours of another hub.
            let around = graph.range(ring[at].index()).take(HIGH_VALENCE);
            next = around
                .filter_map(|k| ring.binary_search(&graph.neighbours()[k]).ok())
                .find(|&at| !is_taken[at]);
        }
    }
    entries
}
