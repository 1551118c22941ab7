//! The limits of every command: on memory, and on the size of files.

use clap::Args;
use cotan_io::Limits;
use cotan_tool::MemoryLimit;

use super::values;

const LIMITS: &str = "Limits";

/// The limits above which a run is refused with exit code 1.
#[derive(Clone, Debug, Args)]
pub(crate) struct LimitArgs {
    /// Refuse work that is predicted to take more memory than this, in bytes or with a suffix K, M
    /// or G [default: 80 % of the available memory]
    #[arg(long, global = true, value_name = "SIZE", value_parser = values::bytes,
        help_heading = LIMITS)]
    max_memory: Option<u64>,
    /// Refuse a file with more bytes than this, uncompressed [default: 2 GiB]
    #[arg(long, global = true, value_name = "SIZE", value_parser = values::bytes,
        hide_short_help = true, help_heading = LIMITS)]
    limit_file: Option<u64>,
    /// Refuse a mesh file that would take more memory than this [default: 16 GiB]
    #[arg(long, global = true, value_name = "SIZE", value_parser = values::bytes,
        hide_short_help = true, help_heading = LIMITS)]
    limit_memory: Option<u64>,
    /// Refuse a mesh file with more vertices [default: 2^28]
    #[arg(long, global = true, value_name = "N", hide_short_help = true, help_heading = LIMITS)]
    limit_vertices: Option<usize>,
    /// Refuse a mesh file with more faces [default: 2^29]
    #[arg(long, global = true, value_name = "N", hide_short_help = true, help_heading = LIMITS)]
    limit_faces: Option<usize>,
    /// Refuse a mesh file with more corners of faces in all [default: 2^31 - 2]
    #[arg(long, global = true, value_name = "N", hide_short_help = true, help_heading = LIMITS)]
    limit_corners: Option<usize>,
    /// Refuse a face with more corners [default: 2^20]
    #[arg(long, global = true, value_name = "N", hide_short_help = true, help_heading = LIMITS)]
    limit_degree: Option<usize>,
    /// Refuse JSON, and nodes of a glTF, that are nested deeper [default: 128]
    #[arg(long, global = true, value_name = "N", hide_short_help = true, help_heading = LIMITS)]
    limit_depth: Option<usize>,
    /// Refuse a text with a longer line [default: 64 MiB]
    #[arg(long, global = true, value_name = "SIZE", value_parser = values::length,
        hide_short_help = true, help_heading = LIMITS)]
    limit_line: Option<usize>,
}

impl LimitArgs {
    /// The memory that the run may use.
    pub(crate) fn memory(&self) -> MemoryLimit {
        match self.max_memory {
            Some(bytes) => MemoryLimit::new(bytes).within_address_space(),
            None => MemoryLimit::of_machine(),
        }
    }

    /// The limits for reading, within this memory.
    pub(crate) fn reading(&self, memory: MemoryLimit) -> Limits {
        let default = Limits::default();
        memory.reading(Limits {
            max_bytes: self.limit_file.unwrap_or(default.max_bytes),
            max_vertices: self.limit_vertices.unwrap_or(default.max_vertices),
            max_faces: self.limit_faces.unwrap_or(default.max_faces),
            max_corners: self.limit_corners.unwrap_or(default.max_corners),
            max_degree: self.limit_degree.unwrap_or(default.max_degree),
            max_depth: self.limit_depth.unwrap_or(default.max_depth),
            max_line: self.limit_line.unwrap_or(default.max_line),
            max_memory: self.limit_memory.unwrap_or(default.max_memory),
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::command_line::Arguments;

    fn limits(words: &[&str]) -> Limits {
        let words = ["cotan", "info", "a.obj"].iter().chain(words);
        let arguments = Arguments::try_parse_from(words).unwrap();
        arguments.limits.reading(MemoryLimit::new(u64::MAX))
    }

    #[test]
    fn the_defaults_are_the_librarys() {
        assert_eq!(limits(&[]), Limits::default());
    }

    #[test]
    fn every_limit_of_the_library_can_be_set() {
        let words = [
            "--limit-file=1K",
            "--limit-memory=2M",
            "--limit-vertices=3",
            "--limit-faces=4",
            "--limit-corners=5",
            "--limit-degree=6",
            "--limit-depth=7",
            "--limit-line=8K",
        ];
        let expected = Limits {
            max_bytes: 1_000,
            max_memory: 2_000_000,
            max_vertices: 3,
            max_faces: 4,
            max_corners: 5,
            max_degree: 6,
            max_depth: 7,
            max_line: 8_000,
        };
        assert_eq!(limits(&words), expected);
    }

    #[test]
    fn the_help_names_the_defaults() {
        let default = Limits::default();
        assert_eq!(
            (default.max_bytes, default.max_memory, default.max_line),
            (2 << 30, 16 << 30, 64 << 20)
        );
        assert_eq!(
            (default.max_vertices, default.max_faces, default.max_corners),
            (1 << 28, 1 << 29, (1 << 31) - 2)
        );
        assert_eq!((default.max_degree, default.max_depth), (1 << 20, 128));
    }
}
