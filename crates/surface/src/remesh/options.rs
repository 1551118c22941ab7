//! The settings of remeshing.

use crate::features::Features;

/// The lengths of the new edges.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum EdgeLengths {
    /// The same, in the unit of the positions, wherever the surfaces stay within a fifth of it of
    /// each other. Where the original has smaller features, edges are shortened, down to a quarter.
    Uniform(f64),
    /// As long as an edge may be while its middle stays within `error` of a surface of the local
    /// curvature, and between `shortest` and `longest`; shorter where the surfaces would still be
    /// farther than `error` apart. All in the unit of the positions.
    Adaptive {
        /// The distance of an edge's middle from the curved surface.
        error: f64,
        /// The shortest length.
        shortest: f64,
        /// The longest length.
        longest: f64,
    },
}

/// The settings of [`super::remesh`].
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct RemeshOptions {
    /// The lengths of the new edges.
    pub lengths: EdgeLengths,
    /// Lines that are kept besides the boundary.
    pub features: Features,
    /// The number of rounds of splits, collapses, flips and smoothing.
    pub iterations: usize,
    /// The maximum memory that the work is predicted to take, in bytes; `None` for no limit.
    pub max_memory: Option<u64>,
}

impl RemeshOptions {
    /// Edges of the given length, creases of 45 degrees kept, ten iterations.
    pub fn uniform(length: f64) -> Self {
        Self::with_lengths(EdgeLengths::Uniform(length))
    }

    /// Edges adapted to the curvature: see [`EdgeLengths::Adaptive`].
    pub fn adaptive(error: f64, shortest: f64, longest: f64) -> Self {
        Self::with_lengths(EdgeLengths::Adaptive {
            error,
            shortest,
            longest,
        })
    }

    fn with_lengths(lengths: EdgeLengths) -> Self {
        Self {
            lengths,
            features: Features::creases(std::f64::consts::FRAC_PI_4),
            iterations: 10,
            max_memory: None,
        }
    }

    /// Sets the lines that are kept.
    #[must_use]
    pub fn features(mut self, features: Features) -> Self {
        self.features = features;
        self
    }

    /// Sets the number of iterations.
    #[must_use]
    pub fn iterations(mut self, iterations: usize) -> Self {
        self.iterations = iterations;
        self
    }

    /// Sets the maximum memory, in bytes.
    #[must_use]
    pub fn max_memory(mut self, bytes: Option<u64>) -> Self {
        self.max_memory = bytes;
        self
    }
}
