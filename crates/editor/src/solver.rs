//! The thread that solves beside the drawing.
