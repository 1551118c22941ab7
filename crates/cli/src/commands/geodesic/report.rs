//! The report of `geodesic`.

use cotan::halfedge::VertexMap;
use serde::Serialize;

use crate::prepare::Prepared;
use crate::report::{Report, Seconds, Table, number};
use crate::text::Text;

/// Lengths are in the unit of the mesh.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct GeodesicReport {
    vertices: usize,
    faces: usize,
    sources: usize,
    /// The vertex of the file that is farthest from the sources, and its distance.
    farthest_vertex: Option<usize>,
    greatest_distance: f64,
    mean_distance: f64,
    /// Vertices in components without a source.
    unreached_vertices: usize,
    /// Edges flipped for the intrinsic Delaunay triangulation.
    flips: usize,
    load_seconds: f64,
    build_seconds: f64,
    total_seconds: f64,
}

impl GeodesicReport {
    pub(super) fn new(
        mesh: &Prepared,
        sources: usize,
        flips: usize,
        distances: &VertexMap<f64>,
    ) -> Self {
        let reached = || distances.iter().filter(|(_, d)| d.is_finite());
        let farthest = reached().fold(None, |best: Option<(_, f64)>, (v, &d)| match best {
            Some((_, greatest)) if greatest >= d => best,
            _ => Some((v, d)),
        });
        let count = reached().count();
        Self {
            vertices: distances.len(),
            faces: mesh.processing.mesh().num_faces(),
            sources,
            farthest_vertex: farthest.map(|(v, _)| {
                let vertex = mesh.processing.document_vertex(v);
                let of_file = mesh.file_vertices.as_ref();
                of_file.map_or(vertex, |file| file.vertex(vertex))
            }),
            greatest_distance: farthest.map_or(0.0, |(_, d)| d),
            mean_distance: reached().map(|(_, d)| d).sum::<f64>() / count.max(1) as f64,
            unreached_vertices: distances.len() - count,
            flips,
            load_seconds: 0.0,
            build_seconds: 0.0,
            total_seconds: 0.0,
        }
    }
}

impl Report for GeodesicReport {
    fn set_seconds(&mut self, seconds: Seconds) {
        self.load_seconds = seconds.load;
        self.build_seconds = seconds.build;
        self.total_seconds = seconds.total;
    }

    fn table(&self) -> Text {
        let mut table = Table::default();
        table.row(
            "vertices, faces",
            format!("{}, {}", self.vertices, self.faces),
        );
        table.row("sources", self.sources);
        let farthest = match self.farthest_vertex {
            Some(vertex) => format!("{} (vertex {vertex})", number(self.greatest_distance)),
            None => "none".to_owned(),
        };
        table.row("greatest distance", farthest);
        table.row("mean distance", number(self.mean_distance));
        if self.unreached_vertices > 0 {
            table.row("unreached vertices", self.unreached_vertices);
        }
        table.row("seconds", number(self.total_seconds));
        table.text
    }
}
