//! Which effects an accuracy target needs.

use serde::Serialize;

use super::{Belongs, Marginal};

/// What a target asks for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// Largest change that may be left out, 1.
    pub target: f64,
    /// Effects of the model that the scene has and needs.
    pub needed: Vec<Advised>,
    /// Effects of the model that the scene has and could do without, all of them together.
    pub dispensable: Vec<Advised>,
    /// Effects of the model that the scene leaves out and should have.
    pub missing: Vec<Advised>,
    /// Effects of the model that the scene leaves out rightly.
    pub rightly_off: Vec<Advised>,
}

/// An effect, its weight, and the key that switches it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advised {
    pub name: &'static str,
    /// The keys that take it out, or put it in.
    pub key: String,
    /// What it changes: [`super::Change::size`], 1.
    pub change: f64,
    /// Time of a run with it over that without, 1.
    pub factor: f64,
}

/// Which effects of the model a target (relative change, 1) needs, from what was measured of a scene.
///
/// What stands on the bench is never left out: that would be another experiment. Of the rest, the smallest changes are given up first, as
/// long as their sum stays within the target, and only where a run becomes cheaper by it.
#[must_use]
pub fn advise(effects: &[Marginal], target: f64) -> Advice {
    let mut advice =
        Advice { target, needed: Vec::new(), dispensable: Vec::new(), missing: Vec::new(), rightly_off: Vec::new() };
    let mut own: Vec<(bool, Advised)> = effects
        .iter()
        .filter(|row| row.belongs == Belongs::Model)
        .filter_map(|row| {
            let measured = row.measured?;
            let (change, factor) = (measured.change.size(), measured.factor());
            Some((row.on, Advised { name: row.name, key: row.key.clone(), change, factor }))
        })
        .collect();
    own.sort_by(|a, b| a.1.change.total_cmp(&b.1.change));
    let mut given_up = 0.0;
    for (on, effect) in own {
        let is_small = effect.change <= target;
        match (on, is_small) {
            (true, true) if effect.factor > 1.0 && given_up + effect.change <= target => {
                given_up += effect.change;
                advice.dispensable.push(effect);
            }
            (true, _) => advice.needed.push(effect),
            (false, true) => advice.rightly_off.push(effect),
            (false, false) => advice.missing.push(effect),
        }
    }
    advice
}
