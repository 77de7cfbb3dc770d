//! Frictionless unilateral contact, by Lagrange multipliers at all surface nodes.

pub(crate) mod chain;
pub(crate) mod complementarity;
pub(crate) mod face;
pub(crate) mod pair;
