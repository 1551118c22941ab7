//! Acceleration of an iteration beyond its plain steps.

mod anderson;
mod coarse;
mod lbfgs;

pub(crate) use anderson::{Anderson, Proposal};
pub(crate) use coarse::Coarse;
pub(crate) use lbfgs::{Lbfgs, Restricted};
