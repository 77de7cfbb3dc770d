//! What may have been at work besides, or instead of, the printed dashpots.

use serde::Serialize;

use crate::paper::{LAWS, Law};
use granchain_model::scene::{self, Scene, SceneError};

/// Dashpots of a candidate: the paper's, or none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Base {
    pub name: &'static str,
    /// The law, as it was printed.
    #[serde(skip)]
    pub law: Option<Law>,
}

/// The paper's two laws as they are printed, and no dashpots.
pub const BASES: [Base; 3] = [
    Base { name: LAWS[0].name, law: Some(LAWS[0]) },
    Base { name: LAWS[1].name, law: Some(LAWS[1]) },
    Base { name: "no", law: None },
];

impl Base {
    /// The annulus scene with these dashpots; `more` overrides come last.
    ///
    /// # Errors
    /// [`SceneError`] for an override that no such scene may have.
    pub fn scene(&self, more: &[String]) -> Result<Scene, SceneError> {
        match self.law {
            Some(law) => law.scene(more),
            None => {
                let none = ["damping.kind=none".to_owned()];
                scene::load("annulus", &none.iter().chain(more).cloned().collect::<Vec<_>>())
            }
        }
    }
}

/// Something that the paper names or leaves out, with a strength of its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Effect {
    pub name: &'static str,
    pub key: &'static str,
    /// Unit of the strength, SI without prefix.
    pub unit: &'static str,
    /// Strengths, from hardly anything to much, SI.
    pub strengths: [f64; 5],
    /// What is set beside it, our choice.
    pub beside: &'static [&'static str],
}

/// All of them, in the order of the pairs.
pub const EFFECTS: [Effect; 8] = [
    Effect {
        name: "precompression",
        key: "chain.precompression",
        unit: "N",
        strengths: [1e-3, 3e-3, 1e-2, 3e-2, 0.1],
        beside: &[],
    },
    Effect {
        name: "loaded horn",
        key: "horn.mass",
        unit: "kg",
        // Down to the mass of a bead.
        strengths: [3e-4, 1e-4, 3e-5, 1e-5, 4e-6],
        beside: &["horn.quality=100"],
    },
    Effect {
        name: "friction",
        key: "holder.friction_force",
        unit: "N",
        strengths: [3e-4, 1e-3, 3e-3, 1e-2, 3e-2],
        beside: &[],
    },
    Effect {
        name: "friction by clearance",
        key: "holder.clearance",
        unit: "m",
        strengths: [1e-5, 2e-5, 5e-5, 1e-4, 2e-4],
        beside: &["holder.friction_coefficient=0.2"],
    },
    Effect { name: "drag", key: "holder.drag", unit: "N·s/m", strengths: [1e-3, 3e-3, 1e-2, 3e-2, 0.1], beside: &[] },
    Effect {
        name: "yielding contacts",
        key: "contact.yield_strength",
        unit: "Pa",
        strengths: [3e9, 2e9, 1.2e9, 0.7e9, 0.4e9],
        beside: &[],
    },
    Effect {
        name: "relaxing annulus",
        key: "loss.relaxation",
        unit: "1",
        strengths: [0.03, 0.1, 0.3, 1.0, 3.0],
        // 1/ω of the drive, where a relaxation loses most.
        beside: &["loss.relaxation_time=2.2us"],
    },
    Effect {
        name: "loss in the annulus",
        key: "loss.support",
        unit: "1",
        strengths: [0.03, 0.1, 0.3, 0.6, 1.0],
        beside: &[],
    },
];

impl Effect {
    /// `count` of its strengths, both ends among them.
    #[must_use]
    pub fn spread(&self, count: usize) -> Vec<f64> {
        let last = self.strengths.len() - 1;
        (0..count).map(|index| self.strengths[index * last / (count - 1)]).collect()
    }

    /// The overrides of a strength.
    #[must_use]
    pub fn overrides(&self, strength: f64) -> Vec<String> {
        let beside = self.beside.iter().map(|set| (*set).to_owned());
        beside.chain([format!("{}={strength:e}", self.key)]).collect()
    }
}

/// Dashpots with none, one or two effects.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    pub base: Base,
    pub effects: Vec<Effect>,
}

impl Candidate {
    /// Whether another has the same dashpots and all of its effects.
    #[must_use]
    pub fn is_part_of(&self, other: &Self) -> bool {
        self.base == other.base && self.effects.iter().all(|effect| other.effects.contains(effect))
    }

    /// In words: `linear dampers, friction and drag`.
    #[must_use]
    pub fn name(&self) -> String {
        let effects: Vec<&str> = self.effects.iter().map(|effect| effect.name).collect();
        let besides = if effects.is_empty() { String::new() } else { format!(", {}", effects.join(" and ")) };
        format!("{} dampers{besides}", self.base.name)
    }

    /// Its scene at these strengths, one an effect; `given` overrides come first.
    ///
    /// # Errors
    /// [`SceneError`] for an effect that no such scene may have.
    pub fn scene(&self, given: &[String], strengths: &[f64]) -> Result<Scene, SceneError> {
        let own = self.effects.iter().zip(strengths).flat_map(|(effect, strength)| effect.overrides(*strength));
        self.base.scene(&given.iter().cloned().chain(own).collect::<Vec<_>>())
    }
}

/// Each base alone, with each effect, with each pair of effects.
#[must_use]
pub fn candidates(effects: &[Effect]) -> Vec<Candidate> {
    let none = std::iter::once(Vec::new());
    let alone = effects.iter().map(|effect| vec![*effect]);
    let pair = |first: usize| effects[first + 1..].iter().map(move |second| vec![effects[first], *second]);
    let sets: Vec<Vec<Effect>> = none.chain(alone).chain((0..effects.len()).flat_map(pair)).collect();
    BASES.iter().flat_map(|base| sets.iter().map(|set| Candidate { base: *base, effects: set.clone() })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_law_stands_alone_with_each_effect_and_with_each_pair() {
        let all = candidates(&EFFECTS);
        assert_eq!(all.len(), 3 * (1 + 8 + 28));
        assert!(all.iter().enumerate().all(|(index, own)| !all[..index].contains(own)));
        assert_eq!(all[0].name(), "linear dampers");
        assert_eq!(all[9].name(), "linear dampers, precompression and loaded horn");
    }

    #[test]
    fn a_strength_is_what_the_scene_has_and_an_effect_that_a_model_has_not_is_refused_in_words() {
        let on = |model: &str, effect: &Effect| {
            let candidate = Candidate { base: BASES[2], effects: vec![*effect] };
            candidate.scene(&[format!("model.kind={model}")], &[effect.strengths[2]])
        };
        let by_name = |name: &str| EFFECTS.iter().find(|effect| effect.name == name).unwrap();
        let scene = on("chain", by_name("loaded horn")).unwrap();
        assert_eq!(scene.horn.map(|horn| (horn.mass, horn.quality)), Some((3e-5, 100.0)));
        assert_eq!(on("chain", by_name("relaxing annulus")).unwrap().loss.relaxation.unwrap().time, 2.2e-6);
        assert_eq!(on("chain", by_name("drag")).unwrap().holder.unwrap().drag, 1e-2);
        assert!(on("chain", by_name("loss in the annulus")).unwrap_err().to_string().contains("loss.support"));
        assert!(
            on("reduced", by_name("yielding contacts")).unwrap_err().to_string().contains("contact.yield_strength")
        );
        assert_eq!(by_name("drag").spread(3), [1e-3, 1e-2, 0.1]);
        assert_eq!(by_name("drag").spread(2), [1e-3, 0.1]);
    }
}
