//! Experiments on a bench, as recorded, or planned; and fits on a wrong bench.

use serde::{Deserialize, Serialize};

use crate::Problem;
use granchain_model::scene::{DampingKind, Support};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    pub name: String,
    /// Factor on the horn's motion.
    pub level: f64,
    /// Overrides of the scene, of truth and fit alike.
    pub set: Vec<String>,
    /// Further overrides of the fit alone, and what is wrong with them.
    pub misstated: Vec<String>,
    pub wrong: Option<String>,
    /// Whether it is fitted together with a record of the bench as it was recorded.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub added: bool,
}

/// What is to be made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnPlan {
    pub experiments: Vec<Experiment>,
    /// Records of each experiment.
    pub count: u64,
    pub seed: u64,
    /// Whether every record is fitted; else widths are those of the bound.
    pub fits: bool,
    /// Factor by which the intervals of the fits are widened.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub widen: Option<f64>,
}

impl OwnPlan {
    #[must_use]
    pub fn total(&self) -> usize {
        self.experiments.len() * self.count as usize
    }

    /// Number and experiment of a point, and its number in it.
    pub(super) fn experiment(&self, point: usize) -> (usize, &Experiment, u64) {
        let index = point / self.count as usize;
        (index, &self.experiments[index], point as u64 % self.count)
    }
}

impl Experiment {
    pub const AS_RECORDED: &'static str = "as recorded";

    #[must_use]
    pub fn as_recorded() -> Self {
        let name = Self::AS_RECORDED.into();
        Self { name, level: 1.0, set: vec![], misstated: vec![], wrong: None, added: false }
    }

    /// The same besides the record that there is.
    #[must_use]
    pub fn in_addition(self) -> Self {
        Self { name: format!("{} + {}", Self::AS_RECORDED, self.name), added: true, ..self }
    }

    /// The same with what is often wrong in the bench of the fit: support stiffness ±30 %, a bead, the damping law, a first gap of 20 nm, bead radius ±5 %; as
    /// far as the bench can have it and the fit does not look for it.
    #[must_use]
    pub fn with_wrong_benches(&self, problem: &Problem) -> Vec<Self> {
        let (bench, candidates) = (&problem.lead().bench, &problem.candidates);
        let Ok(scene) = bench.scene_with(&self.set) else { return vec![] };
        let (chain, beads) = (&scene.chain, scene.chain.beads.len());
        let radius = chain.beads[0].radius;
        let fitted = |name: &str| candidates[0].parameters.iter().any(|parameter| parameter.name == name);
        let key = if matches!(scene.support, Support::Annulus { .. }) { "stiffness_factor" } else { "stiffness" };
        let softer = |factor: f64| {
            let stiffness = scene.support.stiffness().filter(|_| !fitted("support_stiffness"));
            stiffness.map(|own| format!("support.{key}={}", factor * own))
        };
        let law = match scene.damping.kind {
            DampingKind::Linear if candidates.len() == 1 => Some("kuwabara-kono"),
            DampingKind::KuwabaraKono if candidates.len() == 1 => Some("linear"),
            _ => None,
        };
        let first = |(contact, gap): (usize, &f64)| (if contact == 0 { gap + 20e-9 } else { *gap }).to_string();
        let gaps: Vec<String> = chain.gaps.iter().enumerate().map(first).collect();
        let open = chain.precompression == 0.0 && !fitted("gap") && !fitted("precompression");
        let all = [
            ("support 30 % softer", softer(0.7)),
            ("support 30 % stiffer", softer(1.3)),
            ("one bead fewer", Some(format!("chain.beads={}", beads - 1))),
            ("one bead more", Some(format!("chain.beads={}", beads + 1))),
            ("the other damping law", law.map(|law| format!("damping.kind={law}"))),
            ("first gap 20 nm wider", open.then(|| format!("chain.gaps=[{}]", gaps.join(",")))),
            ("beads 5 % smaller", Some(format!("chain.radius={}", 0.95 * radius))),
            ("beads 5 % larger", Some(format!("chain.radius={}", 1.05 * radius))),
        ];
        let possible = |set: &String| bench.scene_with(&[&self.set[..], std::slice::from_ref(set)].concat()).is_ok();
        let misstated = |(words, set): (&str, Option<String>)| {
            Some(Self { misstated: vec![set.filter(possible)?], wrong: Some(words.into()), ..self.clone() })
        };
        all.into_iter().filter_map(misstated).collect()
    }
}
