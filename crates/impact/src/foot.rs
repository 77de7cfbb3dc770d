//! What the ground under the last bead bears: Hertz's law, and so the fit, holds as long as it does not give way.

use std::f64::consts::PI;

use granchain_model::scene::{Bead, Scene, Support};
use granchain_signal::number::{engineering, significant};
use serde::{Deserialize, Serialize};

use crate::run;

/// Largest pressure of a Hertz contact over the strength of the softer body from which it gives way (Johnson 1985, Contact Mechanics, 6.2).
const PLASTIC: f64 = 1.6;

/// Strength of a foam over its modulus, of any density: its cells collapse at a strain of 5 % (Gibson and Ashby 1997, Cellular Solids, 5.3). Soils give way
/// at less.
const COLLAPSE: f64 = 0.05;

/// The contact of the last bead with the ground at the answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Foot {
    /// Largest pressure of a hit, Pa.
    pub pressure: f64,
    /// The same of the resting column, Pa.
    pub resting_pressure: f64,
    /// Strength of the ground, as stated or 5 % of its modulus, Pa.
    pub strength: f64,
    pub is_strength_stated: bool,
}

impl Foot {
    /// Of a scene at the answer; none without a foundation, under a plate, or where it cannot be run.
    pub(crate) fn of(scene: &Scene, stated: Option<f64>) -> Option<Self> {
        let Support::Foundation { youngs_modulus, poissons_ratio, plate: None, .. } = scene.support else {
            return None;
        };
        let bead = scene.chain.beads.last()?;
        let force = run::foot(scene).ok()?;
        let pressure = |force: f64| hertz_pressure(force, bead, youngs_modulus, poissons_ratio);
        Some(Self {
            pressure: pressure(force.values.iter().copied().fold(0.0, f64::max)),
            resting_pressure: pressure(force.values[0]),
            strength: stated.unwrap_or(COLLAPSE * youngs_modulus),
            is_strength_stated: stated.is_some(),
        })
    }

    pub(crate) fn gives_way(&self) -> bool {
        self.pressure > PLASTIC * self.strength
    }

    /// What follows where the ground gives way.
    pub(crate) fn warning(&self) -> Option<String> {
        let pascals = |value: f64| engineering(value, "Pa", 2);
        let (limit, share) = (pascals(PLASTIC * self.strength), significant(100.0 * COLLAPSE, 1));
        let strength = if self.is_strength_stated {
            format!("of the stated strength of {}", pascals(self.strength))
        } else {
            format!(
                "of {}, {share} % of its modulus, the strain at which foams collapse (soils at less); state its strength with --strength",
                pascals(self.strength)
            )
        };
        self.gives_way().then(|| {
            format!(
                "the ground gives way under the last bead: the pressure there reaches {} in a hit and is {} at rest; Hertz's law holds up to {limit}, \
                 {PLASTIC} times its strength {strength}. In a crater the foot is stiffer: the modulus is too large",
                pascals(self.pressure),
                pascals(self.resting_pressure)
            )
        })
    }
}

/// Largest pressure of a bead pressed on a half-space, Pa.
fn hertz_pressure(force: f64, bead: &Bead, youngs_modulus: f64, poissons_ratio: f64) -> f64 {
    let compliance = |modulus: f64, ratio: f64| (1.0 - ratio * ratio) / modulus;
    let of_bead = compliance(bead.material.youngs_modulus, bead.material.poissons_ratio);
    let modulus = 1.0 / (compliance(youngs_modulus, poissons_ratio) + of_bead);
    (6.0 * force.max(0.0) * modulus * modulus / (PI.powi(3) * bead.radius * bead.radius)).cbrt()
}

#[cfg(test)]
mod tests {
    use granchain_model::scene;

    use super::*;

    #[test]
    fn a_column_at_rest_presses_with_its_weight() {
        let scene = scene::load("impact", &[]).unwrap();
        let foot = Foot::of(&scene, None).unwrap();
        let weight: f64 = scene.chain.beads.iter().map(|bead| 9.81 * bead.mass()).sum();
        let (bead, modulus) = (&scene.chain.beads[0], 60e6 / (1.0 - 0.3 * 0.3));
        let radius = (3.0 * weight * bead.radius / (4.0 * modulus)).cbrt();
        let pressure = 3.0 * weight / (2.0 * PI * radius * radius);
        assert!((foot.resting_pressure / pressure - 1.0).abs() < 2e-3, "{foot:?} {pressure:e}");
    }

    #[test]
    fn soft_ground_gives_way_stiff_ground_and_what_is_stated_to_be_strong_do_not() {
        let foot = |modulus: &str, strength| {
            let set = [format!("support.youngs_modulus={modulus}"), "duration=5 ms".into()];
            Foot::of(&scene::load("impact", &set).unwrap(), strength).unwrap()
        };
        assert!(foot("16 MPa", None).gives_way() && !foot("400 MPa", None).gives_way());
        assert!(!foot("16 MPa", Some(5e6)).gives_way() && foot("400 MPa", Some(5e6)).gives_way());
    }
}
