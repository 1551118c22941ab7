//! The report of a sphere map, as JSON and as a table.

use cotan::flow::StopReason;
use cotan::geometry::Scalar;
use cotan::sphere::{AngleErrors, SphereOptions, SphereQuality, Spread};
use serde::Serialize;

use super::Mapped;
use crate::args::Precision;
use crate::report::{Report, Seconds, Table, counted, number};
use crate::text::Text;

/// The machine-readable report of a sphere map.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct MapReport {
    /// Vertices and faces (triangles) of the surface that was mapped.
    vertices: usize,
    faces: usize,
    method: &'static str,
    scheme: &'static str,
    authalic: f64,
    center: &'static str,
    precision: &'static str,
    iterations: usize,
    stop_reason: &'static str,
    /// `null` if there was no iteration.
    converged: Option<bool>,
    /// The largest displacement of a vertex in the last step, on the unit sphere.
    max_change: f64,
    factorizations: usize,
    /// The stages of the method, in order.
    stages: Vec<&'static str>,
    /// Flipped triangles after the iteration and after each repair.
    flips_by_round: Vec<usize>,
    /// According to exact predicates.
    flipped_triangles: usize,
    /// The maximum of | |v − c| / r − 1 | over all vertices of the document.
    sphericity_error: f64,
    /// σ1/σ2 of the map of each triangle: 1 where angles are kept.
    conformal_distortion: SpreadFields,
    angle_error_degrees: AngleFields,
    /// ln (share of the sphere / share of the area)| of each triangle: 0 where areas are kept.
    area_distortion: SpreadFields,
    /// The number of times that the triangles cover the sphere.
    degree: i64,
    /// Counts of the written sphere, if one was written.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    counts: Option<WrittenCounts>,
    /// From the start of the command to the written mesh.
    seconds: f64,
    phases: Phases,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) geometry_image: Option<GeometryImageFields>,
    /// The mesh that the shape was resampled to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) resampled: Option<Resampled>,
}

/// The result of writing a sphere.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct WrittenSphere {
    pub(crate) unused_vertices: usize,
    pub(crate) written_as_triangles: usize,
    /// Over all vertices, before they are rounded to the numbers of the format.
    pub(crate) sphericity_error: f64,
}

#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct WrittenCounts {
    /// Vertices that no face uses, which are on the sphere too.
    unused_vertices: usize,
    /// Polygons that a reader might have cut with a flip.
    written_as_triangles: usize,
}

/// The meaning of the colours of a geometry image.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct GeometryImageFields {
    /// Pixels per side.
    pub(crate) size: usize,
    /// The coordinates represented by the smallest and largest values of red, green and blue, in
    /// the unit of the file.
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
}

/// A mesh that a shape was resampled to.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct Resampled {
    pub(crate) level: u32,
    pub(crate) vertices: usize,
    pub(crate) faces: usize,
}

/// Durations of the phases, in seconds.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
struct Phases {
    /// File to document.
    load: f64,
    /// Document to half-edge mesh.
    build: f64,
    /// Mesh to checked sphere map.
    map: f64,
}

#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct SpreadFields {
    /// Weighted by the areas of the mesh.
    mean: f64,
    /// The 99th percentile.
    p99: f64,
    max: f64,
}

#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct AngleFields {
    mean: f64,
    max: f64,
}

impl From<Spread> for SpreadFields {
    fn from(Spread { mean, p99, max }: Spread) -> Self {
        Self { mean, p99, max }
    }
}

impl From<AngleErrors> for AngleFields {
    fn from(AngleErrors { mean, max }: AngleErrors) -> Self {
        Self { mean, max }
    }
}

impl MapReport {
    /// Measures the map.
    pub(crate) fn new<T: Scalar>(
        mapped: &Mapped<T>,
        options: &SphereOptions,
        precision: Precision,
    ) -> Self {
        let quality: SphereQuality = mapped.quality();
        let report = &mapped.report;
        let mesh = mapped.map.mesh();
        Self {
            vertices: mesh.num_vertices(),
            faces: mesh.num_faces(),
            method: options.method.name(),
            scheme: options.scheme.name(),
            authalic: options.authalic,
            center: options.centering.name(),
            precision: precision.name(),
            iterations: report.iterations,
            stop_reason: report.stop.map_or(NOT_ITERATED, StopReason::as_str),
            converged: report.stop.map(|stop| stop == StopReason::Converged),
            max_change: report.change,
            factorizations: report.factorizations,
            stages: report.stages.iter().map(|stage| stage.as_str()).collect(),
            flips_by_round: report.flips.clone(),
            flipped_triangles: quality.flipped_triangles,
            sphericity_error: quality.sphericity_error,
            conformal_distortion: quality.conformal_distortion.into(),
            angle_error_degrees: quality.angle_error_degrees.into(),
            area_distortion: quality.area_distortion.into(),
            degree: quality.degree,
            counts: None,
            seconds: 0.0,
            phases: Phases {
                map: mapped.seconds,
                ..Phases::default()
            },
            geometry_image: None,
            resampled: None,
        }
    }

    /// Adds the result of writing the sphere.
    pub(crate) fn written(self, written: &WrittenSphere) -> Self {
        Self {
            sphericity_error: self.sphericity_error.max(written.sphericity_error),
            counts: Some(WrittenCounts {
                unused_vertices: written.unused_vertices,
                written_as_triangles: written.written_as_triangles,
            }),
            ..self
        }
    }
}

impl Report for MapReport {
    fn set_seconds(&mut self, seconds: Seconds) {
        self.seconds = seconds.total;
        self.phases.load = seconds.load;
        self.phases.build = seconds.build;
    }

    fn table(&self) -> Text {
        let mut table = Table::default();
        let spread = |s: &SpreadFields| {
            let [mean, p99, max] = [s.mean, s.p99, s.max].map(number);
            format!("mean {mean}, 99% below {p99}, max {max}")
        };
        table.row(
            "vertices, faces",
            format!("{}, {}", self.vertices, self.faces),
        );
        table.row(
            "iterations",
            format!("{} ({})", self.iterations, self.stop_reason),
        );
        table.row("stages", self.stages.join(", "));
        table.row("flipped triangles", self.flipped_triangles);
        if let Some(counts) = &self.counts {
            if counts.written_as_triangles > 0 {
                let polygons = counted(counts.written_as_triangles, "polygon");
                table.row("written as triangles", polygons);
            }
            if counts.unused_vertices > 0 {
                table.row("vertices in no face", counts.unused_vertices);
            }
        }
        table.row("degree", self.degree);
        table.row("sphericity error", number(self.sphericity_error));
        table.row("conformal distortion", spread(&self.conformal_distortion));
        let angles = &self.angle_error_degrees;
        table.row(
            "angle error, degrees",
            format!("mean {}, max {}", number(angles.mean), number(angles.max)),
        );
        table.row("area distortion", spread(&self.area_distortion));
        if let Some(to) = &self.resampled {
            let counts = format!("{}, {} (level {})", to.vertices, to.faces, to.level);
            table.row("resampled to", counts);
        }
        let phases = &self.phases;
        table.row(
            "seconds",
            format!(
                "{:.3} (load {:.3}, build {:.3}, map {:.3})",
                self.seconds, phases.load, phases.build, phases.map
            ),
        );
        table.text
    }
}

/// The stop reason of a map that was made without iterating.
const NOT_ITERATED: &str = "not iterated";
