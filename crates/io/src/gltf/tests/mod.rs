//! Files made by code: what is read, what is refused, what a write changes.

mod made;
mod materials;
mod odd;
mod reading;
mod rebuilding;
mod refusals;
mod sharing;
mod writing;
