//! The vertices of a file that was repaired when it was read.

/// The mapping between the vertices of a file and of the document repaired from it.
#[derive(Clone, Debug)]
pub struct FileVertices {
    num_vertices: usize,
    /// The file vertex of each document vertex.
    sources: Vec<usize>,
    /// Pairs of a file vertex and a document vertex derived from it, in order.
    copies: Vec<(usize, usize)>,
}

impl FileVertices {
    /// Creates the mapping.
    ///
    /// `num_vertices` is the number of file vertices; `sources` gives the file vertex of each
    /// document vertex.
    pub fn new(num_vertices: usize, sources: Vec<usize>) -> Self {
        let mut copies: Vec<_> = sources
            .iter()
            .enumerate()
            .map(|(v, &file)| (file, v))
            .collect();
        copies.sort_unstable();
        Self {
            num_vertices,
            sources,
            copies,
        }
    }

    /// Removes document vertices that are not copies of their source, such as those that fill
    /// holes.
    #[must_use]
    pub fn without(mut self, added: &[usize]) -> Self {
        self.copies.retain(|(_, v)| added.binary_search(v).is_err());
        self
    }

    /// The file vertex from which a document vertex is derived.
    pub fn vertex(&self, vertex: usize) -> usize {
        self.sources.get(vertex).copied().unwrap_or(vertex)
    }

    /// Number of vertices in the file.
    pub fn num_vertices(&self) -> usize {
        self.num_vertices
    }

    /// The document vertices derived from a file vertex.
    pub fn in_document(&self, vertex: usize) -> impl Iterator<Item = usize> {
        self.copies(vertex).iter().map(|&(_, v)| v)
    }

    pub(super) fn copies(&self, vertex: usize) -> &[(usize, usize)] {
        let start = self.copies.partition_point(|&(file, _)| file < vertex);
        let end = self.copies.partition_point(|&(file, _)| file <= vertex);
        &self.copies[start..end]
    }
}
