//! What is fitted: named parameters in a box, searched in their logarithms.

use serde::{Deserialize, Serialize};

use crate::scene::{DampingKind, Scene};

/// A quantity of the scene that a fit may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// α, the factor on the drive.
    Alpha,
    /// c or γ, whichever the scene's damping law has.
    Damping,
}

/// One fitted parameter with its bounds; its coordinate is u = ln(value/low)/ln(high/low) ∈ \[0, 1\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// What it changes.
    pub target: Target,
    /// Name in plans and outcomes.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Lower bound, SI, positive.
    pub low: f64,
    /// Upper bound, SI, above `low`.
    pub high: f64,
}

impl Parameter {
    /// α between 0.2 and 2 (the source paper swept 0.3 … 1.5).
    #[must_use]
    pub fn alpha() -> Self {
        Self { target: Target::Alpha, name: "alpha".into(), unit: "1".into(), low: 0.2, high: 2.0 }
    }

    /// The damping coefficient of a law: c in 0.03 … 3 N·s/m, γ in 300 … 30 000 N·s·m^(-3/2); `None` for a law without
    /// a coefficient or with two.
    #[must_use]
    pub fn damping(kind: DampingKind) -> Option<Self> {
        let (unit, low, high) = match kind {
            DampingKind::Linear => ("N s/m", 0.03, 3.0),
            DampingKind::KuwabaraKono => ("N s m^-3/2", 300.0, 30_000.0),
            DampingKind::None | DampingKind::LinearAndKuwabaraKono => return None,
        };
        Some(Self { target: Target::Damping, name: "damping".into(), unit: unit.into(), low, high })
    }

    /// Value at coordinate `u`.
    #[must_use]
    pub fn value(&self, u: f64) -> f64 {
        self.low * (self.high / self.low).powf(u)
    }

    /// Coordinate of `value`.
    #[must_use]
    pub fn coordinate(&self, value: f64) -> f64 {
        (value / self.low).ln() / self.span()
    }

    /// ln(high/low): a width in u times this is a width in the logarithm of the parameter.
    #[must_use]
    pub fn span(&self) -> f64 {
        (self.high / self.low).ln()
    }

    /// Put `value` into a scene.
    pub fn set(&self, scene: &mut Scene, value: f64) {
        match (self.target, scene.damping.kind) {
            (Target::Alpha, _) => scene.amplitude_scale = value,
            (Target::Damping, DampingKind::KuwabaraKono) => scene.damping.kuwabara_kono = value,
            (Target::Damping, _) => scene.damping.linear = value,
        }
    }
}

/// Reflect a coordinate at both ends of \[0, 1\].
#[must_use]
pub fn reflect(u: f64) -> f64 {
    let folded = u.rem_euclid(2.0);
    if folded > 1.0 { 2.0 - folded } else { folded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_run_from_bound_to_bound_in_the_logarithm() {
        let alpha = Parameter::alpha();
        assert!((alpha.value(0.0) - 0.2).abs() < 1e-15 && (alpha.value(1.0) - 2.0).abs() < 1e-14);
        assert!((alpha.coordinate(alpha.value(0.37)) - 0.37).abs() < 1e-14);
    }

    #[test]
    fn reflection_keeps_every_coordinate_in_the_box() {
        for (outside, inside) in [(1.2, 0.8), (-0.3, 0.3), (2.1, 0.1), (0.4, 0.4)] {
            assert!((reflect(outside) - inside).abs() < 1e-12);
        }
    }
}
