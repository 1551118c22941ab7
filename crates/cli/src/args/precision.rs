//! The number type of a run.

use clap::ValueEnum;

/// The scalar type of the iteration.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Precision {
    /// 32-bit numbers: half the memory, about seven digits
    F32,
    /// 64-bit numbers
    F64,
}

impl Precision {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}
