//! Models of several parts: those with handles drive, the others follow.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod cases;
mod models;
mod ogre;
mod theorems;
