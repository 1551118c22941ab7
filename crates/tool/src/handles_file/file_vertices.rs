//! Vertices of a file that was repaired when it was read.

/// Where the vertices of a file are in the document that was repaired from it.
#[derive(Clone, Debug)]
pub struct FileVertices {
    num_vertices: usize,
    /// The vertex of the file for each vertex of the document.
    sources: Vec<usize>,
    /// Vertices of the file with those of the document that come from them, in order.
    copies: Vec<(usize, usize)>,
}

impl FileVertices {
    /// `num_vertices` is the file's; `sources` gives the file's vertex for each vertex of the
    /// document.
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

    /// The same without vertices of the document that are no copies of what they come from, as
    /// those that fill holes.
    #[must_use]
    pub fn without(mut self, added: &[usize]) -> Self {
        self.copies.retain(|(_, v)| added.binary_search(v).is_err());
        self
    }

    /// The vertex of the file that a vertex of the document comes from.
    pub fn vertex(&self, vertex: usize) -> usize {
        self.sources.get(vertex).copied().unwrap_or(vertex)
    }

    /// Number of vertices of the file.
    pub fn num_vertices(&self) -> usize {
        self.num_vertices
    }

    /// The vertices of the document that come from a vertex of the file.
    pub fn in_document(&self, vertex: usize) -> impl Iterator<Item = usize> {
        self.copies(vertex).iter().map(|&(_, v)| v)
    }

    pub(super) fn copies(&self, vertex: usize) -> &[(usize, usize)] {
        let start = self.copies.partition_point(|&(file, _)| file < vertex);
        let end = self.copies.partition_point(|&(file, _)| file <= vertex);
        &self.copies[start..end]
    }
}
