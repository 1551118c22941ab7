//! The report of `merge`.

use cotan::merge::{Merged, SeamReport};
use serde::Serialize;

use crate::report::{Report, Seconds, Table, number};
use crate::text::Text;

/// The JSON of `--report`. Angles in degrees.
#[derive(Debug, Serialize)]
pub(crate) struct MergeReport {
    vertices: usize,
    faces: usize,
    loops: usize,
    seam_faces: usize,
    seam_vertices: usize,
    /// Selected faces that were dropped: they touch the kept part only at a corner, or lie apart.
    dropped_faces: [usize; 2],
    moved_vertices: usize,
    euler_characteristic: i64,
    boundary_loops: usize,
    /// 95 % quantile and largest.
    seam_dihedral: [f64; 2],
    other_dihedral: [f64; 2],
    smallest_angle_in_band: f64,
    smallest_angle_of_inputs: f64,
    self_intersecting_faces: usize,
    self_intersecting_faces_of_inputs: usize,
    /// The motion of B.
    scale: f64,
    /// Row by row.
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
    /// The losses of the written file, one sentence each.
    losses: Vec<String>,
    seconds: f64,
}

impl MergeReport {
    pub(crate) fn new(merged: &Merged<f64>, losses: Vec<String>) -> Self {
        let SeamReport {
            loops,
            faces,
            vertices,
            dropped,
            moved,
            dihedral,
            dihedral_elsewhere,
            smallest_angle,
            self_intersections,
            ..
        } = merged.report.clone();
        let mesh = merged.mesh.connectivity();
        let rotation = merged.placed.rotation.matrix();
        Self {
            vertices: mesh.num_vertices(),
            faces: mesh.num_faces(),
            loops,
            seam_faces: faces,
            seam_vertices: vertices,
            dropped_faces: dropped,
            moved_vertices: moved,
            euler_characteristic: mesh.euler_characteristic(),
            boundary_loops: mesh.boundary_loops().len(),
            seam_dihedral: dihedral,
            other_dihedral: dihedral_elsewhere,
            smallest_angle_in_band: smallest_angle[0],
            smallest_angle_of_inputs: smallest_angle[1],
            self_intersecting_faces: self_intersections[0],
            self_intersecting_faces_of_inputs: self_intersections[1],
            scale: merged.placed.scale,
            rotation: [0, 1, 2].map(|r| [0, 1, 2].map(|c| rotation[(r, c)])),
            translation: merged.placed.translation.into(),
            losses,
            seconds: 0.0,
        }
    }
}

impl Report for MergeReport {
    fn set_seconds(&mut self, seconds: Seconds) {
        self.seconds = seconds.total;
    }

    fn table(&self) -> Text {
        let mut table = Table::default();
        table.row(
            "vertices, faces",
            format!("{}, {}", self.vertices, self.faces),
        );
        table.row("cuts joined", self.loops);
        let seam = format!("{} faces, {} vertices", self.seam_faces, self.seam_vertices);
        table.row("seam", seam);
        table.row("vertices moved", self.moved_vertices);
        let [at_seam, elsewhere] = [self.seam_dihedral, self.other_dihedral].map(|d| number(d[0]));
        let bend = format!("{at_seam}° at the seam, {elsewhere}° elsewhere");
        table.row("dihedral angle, 95 %", bend);
        let (now, before) = (self.smallest_angle_in_band, self.smallest_angle_of_inputs);
        let angle = format!("{}° in the band, {}° before", number(now), number(before));
        table.row("smallest angle", angle);
        let (now, before) = (
            self.self_intersecting_faces,
            self.self_intersecting_faces_of_inputs,
        );
        table.row("intersecting faces", format!("{now}, {before} before"));
        table.row("boundary loops", self.boundary_loops);
        table.row("seconds", number(self.seconds));
        table.text
    }
}
