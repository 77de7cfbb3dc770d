//! The matching disc between the chain and the water.

use super::{Material, word::words};

/// Default radius and thickness of the disc, m: the paper's.
pub(crate) const DEFAULT_DISC: (f64, f64) = (1e-3, 0.25e-3);
/// Default mesh density of the disc, 1.
pub(crate) const DEFAULT_DISC_DENSITY: u32 = 6;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rim {
    /// u = 0 on the whole lateral face.
    Clamped,
    /// u_z = 0 on the whole lateral face, u_r free: a frictionless guide. (A support along one circle is no model here: in the continuum
    /// it carries no load, and on a mesh its stiffness is that of the elements beside it.)
    Supported,
    /// Not held at all: the disc drifts once it is pushed.
    Free,
}

words!(Rim { Clamped = "clamped", Supported = "supported", Free = "free" });

#[derive(Debug, Clone, PartialEq)]
pub struct DiscShape {
    pub radius: f64,
    /// Thickness h < a, m.
    pub thickness: f64,
    pub material: Material,
    pub rim: Rim,
}
