//! Tables of a report: lines with a name and a value.

use cotan::geometry::Readable;

use super::QualityFields;
use crate::text::Text;

/// Lines with a name and a value.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    pub(crate) text: Text,
}

impl Table {
    pub(crate) fn row(&mut self, name: &str, value: impl std::fmt::Display) {
        self.text.line(format_args!("{name:<23} {value}"));
    }

    pub(crate) fn quality(&mut self, quality: &QualityFields) {
        self.row(
            "E_p (parameterization)",
            number(quality.parameterization_error),
        );
        self.row("E_g (geometry)", number(quality.geometry_error));
        self.row("edge distortion, rms", number(quality.edge_distortion_rms));
        self.row("area distortion, rms", number(quality.area_distortion_rms));
        match quality.volume_ratio {
            Some(ratio) => self.row("volume ratio", number(ratio)),
            None => self.row("volume ratio", "none (the mesh is open)"),
        }
        self.row("flipped faces", quality.flipped_faces);
        self.row("folded edges", quality.folded_edges);
        self.row("degenerate faces", quality.degenerate_faces);
        self.row("intersecting faces", quality.self_intersecting_faces);
        self.row(
            "dihedral change, max",
            format!("{}°", number(quality.max_dihedral_change_degrees)),
        );
        for (name, extent) in [
            ("stretch σ1", quality.stretch),
            ("compression 1/σ2", quality.compression),
        ] {
            let [p99, max] = [extent.p99, extent.max].map(number);
            self.row(name, format!("99 % below {p99}, max {max}"));
        }
        self.row("ARAP energy", number(quality.arap_energy));
    }
}

/// A count with its noun.
pub(crate) fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// A number for a table.
pub(crate) fn number(x: f64) -> String {
    Readable(x).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_thing_has_no_plural() {
        assert_eq!(counted(1, "face"), "1 face");
        assert_eq!(counted(0, "face"), "0 faces");
    }
}
