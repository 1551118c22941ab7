//! Tests of reading, errors and writing on generated files.

mod made;
mod materials;
mod odd;
mod reading;
mod rebuilding;
mod refusals;
mod sharing;
mod writing;
