//! What is fitted to hits: a range, uniform in the logarithm, and where its value stands in a scene.

use granchain_calibration::parameter::{Parameter as Driven, Target as OfDriven};
use granchain_model::scene::{DampingTerm, Scene, Support};

use crate::ImpactError;

/// Parameters that hits tell of.
pub const NAMES: [&str; 4] = ["support_modulus", "support_loss", "alpha", "damping"];

/// Loss times from what takes no measurable part of an impulse, s; the law holds to first order in it.
const LOSS: (f64, f64) = (1e-6, 3e-4);

/// Thicknesses of a plate, m.
const PLATE: (f64, f64) = (1e-4, 2e-2);

/// Unit coordinate from which an answer touches an end of the range, and the factor by which the end is moved then.
const EDGE: f64 = 0.01;
const WIDENING: f64 = 4.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Target {
    /// The factor on the striker's velocity.
    Alpha,
    Damping(DampingTerm),
    /// Young's modulus of the foundation.
    Modulus,
    /// Time constant of its loss.
    Loss,
    /// Thickness of a plate on it, tried as a cause only.
    Plate,
}

/// One fitted parameter, SI; its coordinate is u = ln(value/low)/ln(high/low).
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub(crate) target: Target,
    pub name: String,
    pub unit: String,
    pub low: f64,
    pub high: f64,
    /// To which the ends may be moved.
    limits: (f64, f64),
}

impl Parameter {
    /// The parameters for a name with the ranges of a scene; of a damping law with two coefficients two.
    ///
    /// # Errors
    /// A name that hits do not tell of, or of something that the scene lacks.
    pub fn named(name: &str, scene: &Scene) -> Result<Vec<Self>, ImpactError> {
        if !NAMES.contains(&name) {
            return Err(ImpactError::Parameter { name: name.into() });
        }
        if name == "support_loss" {
            return match scene.support {
                Support::Foundation { .. } => Ok(vec![Self::fixed(Target::Loss, name, "s", LOSS)]),
                _ => Err(ImpactError::NoFoundation),
            };
        }
        let of = |Driven { target, name, unit, low, high, limits }| {
            let target = match target {
                OfDriven::Damping(term) | OfDriven::DampingBeside(term) => Target::Damping(term),
                OfDriven::SupportModulus => Target::Modulus,
                _ => Target::Alpha,
            };
            Self { target, name, unit, low, high, limits }
        };
        Ok(Driven::named(name, scene)?.into_iter().map(of).collect())
    }

    pub(crate) fn plate() -> Self {
        Self::fixed(Target::Plate, "plate_thickness", "m", PLATE)
    }

    fn fixed(target: Target, name: &str, unit: &str, (low, high): (f64, f64)) -> Self {
        Self { target, name: name.into(), unit: unit.into(), low, high, limits: (low, high) }
    }

    /// The same within stated ends, which are not moved.
    #[must_use]
    pub fn between(self, low: f64, high: f64) -> Self {
        Self { low, high, limits: (low, high), ..self }
    }

    pub(crate) fn value(&self, u: f64) -> f64 {
        self.low * (self.high / self.low).powf(u)
    }

    pub(crate) fn coordinate(&self, value: f64) -> f64 {
        (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// Whether an answer between `low` and `high`, most likely at `best`, touches the lower and the upper end; unit coordinates.
    pub(crate) fn pressed(low: f64, best: f64, high: f64) -> [bool; 2] {
        [low < EDGE || best < EDGE, high > 1.0 - EDGE || best > 1.0 - EDGE]
    }

    /// The same with the lower and the upper end moved outwards, as far as may be; `None` if neither can be.
    pub(crate) fn widened(&self, [down, up]: [bool; 2]) -> Option<Self> {
        let low = if down { (self.low / WIDENING).max(self.limits.0) } else { self.low };
        let high = if up { (self.high * WIDENING).min(self.limits.1) } else { self.high };
        (low < self.low || high > self.high).then(|| Self { low, high, ..self.clone() })
    }

    pub(crate) fn set(&self, scene: &mut Scene, value: f64) {
        match (self.target, &mut scene.support) {
            (Target::Alpha, _) => scene.amplitude_scale = value,
            (Target::Damping(term), _) => scene.damping.coefficients[term] = value,
            (Target::Modulus, Support::Foundation { youngs_modulus, .. }) => *youngs_modulus = value,
            (Target::Loss, Support::Foundation { loss_time, .. }) => *loss_time = value,
            (Target::Plate, Support::Foundation { plate: Some(plate), .. }) => plate.thickness = value,
            _ => {}
        }
    }
}
