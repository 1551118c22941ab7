//! The report of `smooth`, `denoise` and `detail`, as JSON and as a table.

use cotan::geometry::{Positions, Surface, folded_faces};
use cotan::smooth::{Displacement, NormalError, mean_curvature_rms};
use serde::Serialize;

use crate::report::{Report, Seconds, Table, number};
use crate::text::Text;

/// The machine-readable report of smoothing.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct SmoothReport {
    pub(crate) vertices: usize,
    pub(crate) faces: usize,
    pub(crate) method: &'static str,
    /// The reason for the method, if it was chosen automatically.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<String>,
    /// The width of the smallest bump that is kept, in the unit of the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) size: Option<f64>,
    pub(crate) iterations: usize,
    pub(crate) anchor: Option<f64>,
    /// Estimated standard deviation along the normals, in mean edge lengths.
    pub(crate) noise: Option<f64>,
    /// `null` for an open mesh.
    pub(crate) volume_before: Option<f64>,
    pub(crate) volume_after: Option<f64>,
    pub(crate) area_before: f64,
    pub(crate) area_after: f64,
    pub(crate) rms_displacement: f64,
    pub(crate) max_displacement: f64,
    pub(crate) mean_curvature_rms: Pair,
    pub(crate) flipped_faces: usize,
    /// Vertices left in place because faces around them would have flipped.
    pub(crate) kept_vertices: usize,
    /// Details that came from another mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) transfer: Option<TransferReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) normal_error_degrees: Option<Pair>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) rms_distance_to_truth: Option<Pair>,
    pub(crate) seconds: SmoothSeconds,
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Pair {
    before: f64,
    after: f64,
}

/// Measures of details that came from another mesh.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TransferReport {
    pub(crate) map: &'static str,
    /// The border between shape and detail, in the unit of the target and of the source.
    pub(crate) wavelength: f64,
    pub(crate) wavelength_in_source: f64,
    /// The share of the target's area that has a counterpart.
    pub(crate) coverage: f64,
    /// Of the map from the target to the source: the median and the 95 % quantile.
    pub(crate) stretch_median: f64,
    pub(crate) stretch_95: f64,
    /// The root mean square of the heights that was left after damping.
    pub(crate) kept_share: f64,
    pub(crate) damped_vertices: usize,
    pub(crate) damping_rounds: usize,
    pub(crate) self_intersecting_before: usize,
    pub(crate) self_intersecting_after: usize,
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct SmoothSeconds {
    load: f64,
    build: f64,
    pub(crate) smooth: f64,
    total: f64,
}

impl SmoothReport {
    /// Measures `after` against the original surface, and both against the truth.
    pub(crate) fn measure(
        &mut self,
        surface: &Surface<'_, f64>,
        after: &Positions<f64>,
        truth: Option<&Positions<f64>>,
    ) -> Result<(), cotan::Error> {
        let smoothed = surface.with_positions(after);
        let is_closed = surface.mesh().is_closed();
        let moves = Displacement::measure(surface, &smoothed);
        self.vertices = surface.mesh().num_vertices();
        self.faces = surface.mesh().num_faces();
        self.volume_before = is_closed.then(|| surface.volume());
        self.volume_after = is_closed.then(|| smoothed.volume());
        self.area_before = surface.area();
        self.area_after = smoothed.area();
        self.rms_displacement = moves.rms;
        self.max_displacement = moves.max;
        self.mean_curvature_rms = Pair {
            before: mean_curvature_rms(surface),
            after: mean_curvature_rms(&smoothed),
        };
        self.flipped_faces = folded_faces(surface, after)?.len();
        if let Some(truth) = truth {
            let truth = surface.with_positions(truth);
            let compare = |measure: &dyn Fn(&Surface<'_, f64>) -> f64| Pair {
                before: measure(surface),
                after: measure(&smoothed),
            };
            self.normal_error_degrees = Some(compare(&|s| NormalError::measure(&truth, s).mean));
            self.rms_distance_to_truth = Some(compare(&|s| Displacement::measure(&truth, s).rms));
        }
        Ok(())
    }
}

impl Report for SmoothReport {
    fn set_seconds(&mut self, seconds: Seconds) {
        self.seconds.load = seconds.load;
        self.seconds.build = seconds.build;
        self.seconds.total = seconds.total;
    }

    fn table(&self) -> Text {
        let mut table = Table::default();
        if let Some(reason) = &self.reason {
            table
                .text
                .line(format_args!("method {}: {reason}", self.method));
        }
        table.row(
            "vertices, faces",
            format!("{}, {}", self.vertices, self.faces),
        );
        table.row("method", self.method);
        if let Some(size) = self.size {
            table.row("size", number(size));
        }
        table.row("iterations", self.iterations);
        if let Some(noise) = self.noise {
            table.row("noise", format!("{} mean edge lengths", number(noise)));
        }
        let pair = |pair: &Pair| format!("{} -> {}", number(pair.before), number(pair.after));
        if let (Some(before), Some(after)) = (self.volume_before, self.volume_after) {
            let change = 100.0 * (after / before - 1.0);
            let volumes = pair(&Pair { before, after });
            let sign = if change > 0.0 { "+" } else { "" };
            table.row("volume", format!("{volumes} ({sign}{} %)", number(change)));
        }
        let area = Pair {
            before: self.area_before,
            after: self.area_after,
        };
        table.row("area", pair(&area));
        table.row("mean curvature, rms", pair(&self.mean_curvature_rms));
        table.row("move, rms", number(self.rms_displacement));
        table.row("longest move", number(self.max_displacement));
        if let Some(transfer) = &self.transfer {
            transfer.rows(&mut table);
        }
        if let Some(error) = &self.normal_error_degrees {
            table.row("normal error, degrees", pair(error));
        }
        if let Some(distance) = &self.rms_distance_to_truth {
            table.row("distance to truth, rms", pair(distance));
        }
        table.row("seconds", number(self.seconds.total));
        table.text
    }
}

impl TransferReport {
    fn rows(&self, table: &mut Table) {
        let (here, there) = (self.wavelength, self.wavelength_in_source);
        let wavelength = format!("{} ({} of the source)", number(here), number(there));
        table.row("wavelength", wavelength);
        table.row(
            "area covered",
            format!("{} %", number(100.0 * self.coverage)),
        );
        let stretch = [self.stretch_median, self.stretch_95].map(number);
        let [median, most] = stretch;
        table.row("stretch", format!("{median} in the median, {most} at 95 %"));
        table.row(
            "details kept",
            format!("{} %", number(100.0 * self.kept_share)),
        );
        let (before, after) = (self.self_intersecting_before, self.self_intersecting_after);
        table.row("intersecting faces", format!("{before} -> {after}"));
    }
}
