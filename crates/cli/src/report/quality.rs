//! [`Quality`] of a deformed surface as fields of a report.

use cotan::{Extent, Quality};
use serde::Serialize;

/// [`Quality`] under the names of the report.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct QualityFields {
    /// E_p and E_g of the paper.
    pub(crate) parameterization_error: f64,
    pub(crate) geometry_error: f64,
    /// E_g over the square root of the number of vertices.
    pub(crate) geometry_error_rms: f64,
    pub(crate) edge_distortion_rms: f64,
    pub(crate) area_distortion_rms: f64,
    /// `null` for an open mesh.
    pub(crate) volume_ratio: Option<f64>,
    pub(crate) flipped_faces: usize,
    pub(crate) folded_edges: usize,
    pub(crate) degenerate_faces: usize,
    pub(crate) self_intersecting_faces: usize,
    /// The largest change of an angle between neighbouring faces.
    pub(crate) max_dihedral_change_degrees: f64,
    /// σ1 of the faces.
    pub(crate) stretch: ExtentFields,
    /// 1/σ2 of the faces.
    pub(crate) compression: ExtentFields,
    pub(crate) arap_energy: f64,
}

/// [`Extent`] under the names of the report. Infinite values are `null` in JSON.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct ExtentFields {
    pub(crate) p99: f64,
    pub(crate) max: f64,
}

impl From<Extent> for ExtentFields {
    fn from(Extent { p99, max }: Extent) -> Self {
        Self { p99, max }
    }
}

impl From<&Quality> for QualityFields {
    fn from(quality: &Quality) -> Self {
        Self {
            parameterization_error: quality.errors.parameterization,
            geometry_error: quality.errors.geometry,
            geometry_error_rms: quality.errors.geometry_rms,
            edge_distortion_rms: quality.edge_distortion_rms,
            area_distortion_rms: quality.area_distortion_rms,
            volume_ratio: quality.volume_ratio,
            flipped_faces: quality.flipped_faces,
            folded_edges: quality.folded_edges,
            degenerate_faces: quality.degenerate_faces,
            self_intersecting_faces: quality.self_intersecting_faces,
            max_dihedral_change_degrees: quality.max_dihedral_change,
            stretch: quality.stretch.into(),
            compression: quality.compression.into(),
            arap_energy: quality.arap_energy,
        }
    }
}
