//! Frictionless unilateral contact, by Lagrange multipliers at all surface nodes.

pub mod chain;
pub mod complementarity;
pub mod face;
pub mod pair;
pub mod ring;
