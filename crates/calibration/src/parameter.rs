//! Fitted parameters: named, bounded, searched in their logarithms.

use serde::{Deserialize, Serialize};
use thiserror::Error;

mod table;

use self::table::{ALPHA, MODULUS, Widening};
pub use self::table::{PARAMETERS, Row, Shown};
use super::observation::highest_cutoff;
use granchain_model::{
    chain::ensemble::Variation,
    scene::{DampingKind, DampingTerm, Scene},
};

/// Quantity of the scene or of the instrument that can be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// α, the factor on the drive.
    Alpha,
    /// The coefficient of the scene's damping law.
    Damping(DampingTerm),
    DampingBeside(DampingTerm),
    /// F₀, the static force through the chain.
    Precompression,
    /// The factor on the annulus' law, or the stiffness of the spring.
    SupportStiffness,
    /// Young's modulus of an elastic foundation.
    SupportModulus,
    /// The gap between the resting piston and the first bead.
    Gap,
    /// The cutoff of the recording instrument.
    Bandwidth,
    /// The modal mass of a compliant horn.
    HornMass,
    /// The viscous drag of the bead guide.
    Drag,
    /// The friction of the bead guide under a constant transverse load.
    Friction,
    /// The factor on Young's modulus of the beads.
    Modulus,
}

impl Target {
    /// Whether it is proportional to a force at a given motion (stiffness, damping, mass of the horn), so that a record determines it over the beads'
    /// mass only.
    pub fn is_force(self) -> bool {
        !matches!(self, Self::Alpha | Self::Gap | Self::Bandwidth)
    }
}

/// One fitted parameter with its bounds; its coordinate is u = ln(value/low)/ln(high/low) ∈ \[0, 1\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    pub target: Target,
    /// Name in plans and outcomes.
    pub name: String,
    pub unit: String,
    /// Lower bound, SI, positive.
    pub low: f64,
    /// Upper bound, SI, above `low`.
    pub high: f64,
    /// Limits to which a search may widen the bounds if the best runs press on them, SI; equal to bounds that the user
    /// gave.
    pub limits: (f64, f64),
}

/// Name beside other terms, unit, range alone and range beside other terms (SI) of the coefficient of a term.
const fn fitted(term: DampingTerm) -> (&'static str, &'static str, (f64, f64), (f64, f64)) {
    match term {
        DampingTerm::Linear => ("damping_linear", "N s/m", (0.03, 3.0), (0.01, 3.0)),
        DampingTerm::KuwabaraKono => ("damping_kuwabara_kono", "N s m^-3/2", (300.0, 3e4), (100.0, 3e4)),
    }
}

/// Largest factor by which a box may be widened in all.
const FARTHEST: f64 = 100.0;

/// Factor beyond the first box from which a value is unusual.
const UNUSUAL: f64 = 3.0;

/// Unit coordinate from which an answer touches a bound.
const EDGE: f64 = 0.01;

/// Factor by which a bound is moved if the best runs press on it.
const WIDENING: f64 = 4.0;

/// Why a scene does not have a parameter.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ParameterError {
    #[error("`{name}` is not a parameter; choose from: {}", Parameter::names().join(", "))]
    Unknown { name: String },
    #[error("the scene has no damping to fit; name a law with --damping linear, or leave `damping` out of --fit")]
    NoDamping,
    #[error(
        "`{name}` belongs to the damping law `linear+kuwabara-kono`, and the scene's is `{law}`: fit `damping`, its one coefficient"
    )]
    OneCoefficient { name: String, law: &'static str },
    #[error("`precompression`: at a free end nothing holds a static force; leave it out of --fit")]
    FreeEnd,
    #[error(
        "`gap` cannot be fitted together with `precompression`, nor in a precompressed chain: a static force closes all gaps; remove one of them"
    )]
    ClosedGap,
    #[error(
        "`support_stiffness` is the factor of an annulus or the stiffness of a spring, and the scene has neither: set support.kind=annulus or \
         support.kind=spring, or leave it out of --fit"
    )]
    NoStiffness,
    #[error(
        "`{name}` belongs to an elastic foundation, and the scene has none: set support.kind=foundation, or leave it out of --fit"
    )]
    NoFoundation { name: &'static str },
}

impl Parameter {
    /// Names of all parameters; `damping` stands for both coefficients of a law with two.
    pub fn names() -> Vec<&'static str> {
        let terms = DampingTerm::ALL.map(|term| fitted(term).0);
        let others = PARAMETERS.iter().map(|row| row.key).filter(|key| *key != "alpha");
        ["alpha", "damping"].into_iter().chain(terms).chain(others).collect()
    }

    /// The damping term whose coefficient has this name in a law of several terms.
    pub fn term_named(name: &str) -> Option<DampingTerm> {
        DampingTerm::ALL.into_iter().find(|term| fitted(*term).0 == name)
    }

    pub fn alpha() -> Self {
        Self::of(Target::Alpha, "alpha", "1", ALPHA, Widening::Far)
    }

    /// The factor on Young's modulus of the beads, used by the diagnosis only.
    pub(crate) fn modulus(scene: &Scene) -> Option<Self> {
        Self::of_row(&MODULUS, scene).ok()
    }

    fn of_row(row: &Row, scene: &Scene) -> Result<Self, ParameterError> {
        let (unit, low, high) = (row.bounds)(scene)?;
        Ok(Self::of(row.target, row.key, unit, (low, high), row.widening))
    }

    /// The damping coefficient of a law: c in 0.03 … 3 N·s/m, γ in 300 … 30 000 N·s·m^(-3/2); `None` for a law without
    /// a coefficient or with two.
    pub fn damping(kind: DampingKind) -> Option<Self> {
        let [term] = *kind.terms() else { return None };
        let (_, unit, alone, _) = fitted(term);
        Some(Self::of(Target::Damping(term), "damping", unit, alone, Widening::Far))
    }

    /// The parameters for `name` in `scene` with their default bounds: a row of [`PARAMETERS`], the coefficient of the
    /// damping law, or both: c in 0.01 … 3 N·s/m and γ in 100 … 30 000 N·s·m^(-3/2). Both lower bounds are so small
    /// that a record is hardly affected, since either term may be absent.
    pub fn named(name: &str, scene: &Scene) -> Result<Vec<Self>, ParameterError> {
        let kind = scene.damping.kind;
        let beside = |term: &DampingTerm| {
            let (name, unit, _, beside) = fitted(*term);
            Self::of(Target::DampingBeside(*term), name, unit, beside, Widening::Far)
        };
        if let Some(term) = Self::term_named(name) {
            return match kind.terms() {
                terms if terms.len() > 1 && terms.contains(&term) => Ok(vec![beside(&term)]),
                _ => Err(ParameterError::OneCoefficient { name: name.into(), law: kind.name() }),
            };
        }
        if name == "damping" {
            return match kind.terms() {
                several if several.len() > 1 => Ok(several.iter().map(beside).collect()),
                _ => Ok(vec![Self::damping(kind).ok_or(ParameterError::NoDamping)?]),
            };
        }
        let row = PARAMETERS.iter().find(|row| row.key == name);
        let row = row.ok_or_else(|| ParameterError::Unknown { name: name.into() })?;
        Ok(vec![Self::of_row(row, scene)?])
    }

    fn of(target: Target, name: &str, unit: &str, (low, high): (f64, f64), widening: Widening) -> Self {
        let limits = match widening {
            Widening::Far => (low / FARTHEST, FARTHEST * high),
            Widening::BothWays => (low / WIDENING, WIDENING * high),
            Widening::Up => (low, WIDENING * high),
            Widening::Not => (low, high),
        };
        Self { target, name: name.into(), unit: unit.into(), low, high, limits }
    }

    /// Its row of the table, unless it is a damping coefficient.
    fn row(&self) -> Option<&'static Row> {
        PARAMETERS.iter().chain([&MODULUS]).find(|row| row.target == self.target)
    }

    /// Which further record would determine it.
    pub(crate) fn remedy(&self) -> &'static str {
        match self.target {
            Target::DampingBeside(_) => {
                "Records at two drive levels fitted together tell the two dashpots apart: what one of them loses does not depend on the overlap, \
                 what the other loses does."
            }
            _ => self
                .row()
                .map_or("A record at a lower drive level, where the response is regular, tells it.", |row| row.remedy),
        }
    }

    /// The same with user-given bounds, which are not widened.
    #[must_use]
    pub fn between(self, low: f64, high: f64) -> Self {
        Self { low, high, limits: (low, high), ..self }
    }

    /// Whether an answer between `low` and `high` with the optimum `best` presses on the lower and the upper end of
    /// the unit coordinate.
    pub(crate) fn pressed(low: f64, best: f64, high: f64) -> (bool, bool) {
        (low < EDGE || best < EDGE, high > 1.0 - EDGE || best > 1.0 - EDGE)
    }

    /// Whether a value lies far outside the default box, and the bounds are not user-given.
    pub(crate) fn is_unusual(&self, value: f64) -> bool {
        let (low, high) = (FARTHEST * self.limits.0, self.limits.1 / FARTHEST);
        let free = matches!(self.target, Target::Alpha | Target::Damping(_) | Target::DampingBeside(_));
        free && low < high && !(low / UNUSUAL..=high * UNUSUAL).contains(&value)
    }

    /// The same with a box widened down, up or both ways; `None` if its limits do not allow it.
    pub(crate) fn widened(&self, down: bool, up: bool) -> Option<Self> {
        let low = if down { (self.low / WIDENING).max(self.limits.0) } else { self.low };
        let high = if up { (self.high * WIDENING).min(self.limits.1) } else { self.high };
        (low < self.low || high > self.high).then(|| Self { low, high, ..self.clone() })
    }

    pub fn value(&self, u: f64) -> f64 {
        self.low * (self.high / self.low).powf(u)
    }

    pub fn coordinate(&self, value: f64) -> f64 {
        (value / self.low).ln() / self.span()
    }

    /// ln(high/low): a width in u times this is a width in the logarithm of the parameter.
    pub fn span(&self) -> f64 {
        (self.high / self.low).ln()
    }

    /// Sets `value` in a scene; the bandwidth of an instrument is not part of a scene.
    pub fn set(&self, scene: &mut Scene, value: f64) {
        match (self.target, self.row()) {
            (Target::Damping(term) | Target::DampingBeside(term), _) => scene.damping.coefficients[term] = value,
            (_, row) => row.into_iter().for_each(|row| (row.set)(scene, value)),
        }
    }

    /// Its change in one run of the scene.
    pub(super) fn vary(&self, scene: &Scene, variation: &mut Variation, value: f64) {
        match (self.target, self.row()) {
            (Target::Damping(term) | Target::DampingBeside(term), _) => variation.damping[term] = value,
            (_, row) => row.into_iter().for_each(|row| (row.vary)(scene, variation, value)),
        }
    }
}

/// Parameters widened at the lower and upper ends that `ends` selects by number; `None` if none can be.
pub(crate) fn widened(parameters: &[Parameter], ends: impl Fn(usize) -> (bool, bool)) -> Option<Vec<Parameter>> {
    let widened = |(d, parameter): (usize, &Parameter)| {
        let (down, up) = ends(d);
        parameter.widened(down, up)
    };
    let widened: Vec<Option<Parameter>> = parameters.iter().enumerate().map(widened).collect();
    let moved = widened.iter().any(Option::is_some);
    let own = widened.into_iter().zip(parameters);
    moved.then(|| own.map(|(widened, own)| widened.unwrap_or_else(|| own.clone())).collect())
}

/// The scene with a variation applied; a negative gap becomes zero.
pub(super) fn varied(scene: &Scene, variation: &Variation) -> Scene {
    variation.written_into(scene, |gap| gap.max(0.0))
}

/// Reflect a coordinate at both ends of \[0, 1\].
pub(crate) fn reflect(u: f64) -> f64 {
    let folded = u.rem_euclid(2.0);
    if folded > 1.0 { 2.0 - folded } else { folded }
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::scene;

    #[test]
    fn coordinates_run_from_bound_to_bound_in_the_logarithm() {
        let alpha = Parameter::alpha();
        assert!((alpha.value(0.0) - 0.05).abs() < 1e-15 && (alpha.value(1.0) - 3.0).abs() < 1e-14);
        assert!((alpha.coordinate(alpha.value(0.37)) - 0.37).abs() < 1e-14);
    }

    #[test]
    fn reflection_keeps_every_coordinate_in_the_box() {
        for (outside, inside) in [(1.2, 0.8), (-0.3, 0.3), (2.1, 0.1), (0.4, 0.4)] {
            assert!((reflect(outside) - inside).abs() < 1e-12);
        }
    }

    #[test]
    fn a_foundation_is_asked_of_scenes_that_have_none() {
        let error = ParameterError::NoFoundation { name: "support_modulus" };
        assert_eq!(Parameter::named("support_modulus", &scene::load("annulus", &[]).unwrap()), Err(error));
    }

    #[test]
    fn every_parameter_is_set_again_by_its_scene_key() {
        for row in PARAMETERS.iter().filter(|row| row.key != "bandwidth") {
            let bench = if row.key == "support_modulus" { "impact" } else { "annulus" };
            let plain = scene::load(bench, &[]).unwrap();
            let (unit, low, _) = (row.bounds)(&plain).unwrap();
            let replayed = scene::load(bench, &[format!("{}={low}", (row.scene_key)(unit))]).unwrap();
            let mut set = plain.clone();
            (row.set)(&mut set, low);
            assert_eq!(set, replayed, "{}", row.key);
            assert_ne!(set, plain, "{}", row.key);
        }
    }

    /// All numbers of a scene.
    fn numbers(scene: &Scene) -> Vec<f64> {
        let text = format!("{scene:?}");
        text.split(|c: char| !c.is_ascii_digit() && !"+-.e".contains(c)).filter_map(|word| word.parse().ok()).collect()
    }

    #[test]
    fn a_value_varied_is_the_value_set() {
        let sets = ["damping.kind=linear+kuwabara-kono", "chain.gaps.contact1=20nm", "support.stiffness_factor=0.8"];
        let scene = scene::load("annulus", &sets.map(String::from)).unwrap();
        let others = ["damping", "bandwidth", "support_modulus"];
        for name in Parameter::names().into_iter().filter(|name| !others.contains(name)) {
            let parameter = Parameter::named(name, &scene).unwrap().remove(0);
            let value = parameter.value(0.4);
            let (mut set, mut variation) = (scene.clone(), Variation::of(&scene));
            parameter.set(&mut set, value);
            parameter.vary(&scene, &mut variation, value);
            assert_ne!(set, scene, "{name}");
            if let Target::Damping(term) | Target::DampingBeside(term) = parameter.target {
                assert_eq!(set.damping.coefficients[term], value, "{name}");
            }
            let mut made = varied(&scene, &variation);
            if name == "precompression" {
                made.chain.gaps.clone_from(&set.chain.gaps);
            }
            let [made, set] = [made, set].map(|scene| numbers(&scene));
            let alike = |(made, set): (&f64, &f64)| made == set || (made / set - 1.0).abs() < 1e-12;
            assert!(made.len() == set.len() && made.iter().zip(&set).all(alike), "{name}: {made:?} {set:?}");
        }
    }

    #[test]
    fn what_a_scene_does_not_have_is_refused() {
        let scene = scene::load("rigid", &[]).unwrap();
        let refused = |name| Parameter::named(name, &scene).unwrap_err();
        assert_eq!(refused("support_stiffness"), ParameterError::NoStiffness);
        assert_eq!(refused("colour"), ParameterError::Unknown { name: "colour".into() });
        assert!(matches!(refused("damping_linear"), ParameterError::NoDamping | ParameterError::OneCoefficient { .. }));
    }
}
