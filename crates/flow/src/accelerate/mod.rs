//! Acceleration of an iteration beyond its plain steps.

mod anderson;
mod lbfgs;

pub(crate) use anderson::{Anderson, Proposal};
pub(crate) use lbfgs::Lbfgs;
