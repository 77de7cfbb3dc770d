//! What the first and the last bead touch.

/// Material of a flat that a bead touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlatContact {
    /// A rigid, frictionless flat: Hertz stiffness (4/3) E/(1 − ν²) √a.
    Rigid,
    /// A half-space of the touching bead's own material: Hertz stiffness (2/3) E/(1 − ν²) √a.
    Steel,
}

/// The far end of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support {
    /// A flat.
    Flat(FlatContact),
    /// The resin annulus by its static force law.
    Annulus {
        /// Factor on the force of the law, 1.
        stiffness_factor: f64,
    },
    /// A massless one-sided linear spring.
    Spring {
        /// Stiffness, N/m.
        stiffness: f64,
    },
}
