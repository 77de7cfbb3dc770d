//! What a user may have wrong of a bench: the truth has it, the fit does not know.

use serde::{Deserialize, Serialize};

use granchain_calibration::{
    parameter::{Parameter, Target},
    synthetic::{EQUIVALENT, with_other_law},
};
use granchain_model::scene::{DampingKind, DampingTerm, Scene};

/// First gap that is not expected, m.
const FIRST_GAP: f64 = 20e-9;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WrongBench {
    SofterSupport,
    StifferSupport,
    BeadFewer,
    BeadMore,
    OtherLaw,
    FirstGap,
    SmallerBeads,
    LargerBeads,
}

impl WrongBench {
    pub const ALL: [Self; 8] = [
        Self::SofterSupport,
        Self::StifferSupport,
        Self::BeadFewer,
        Self::BeadMore,
        Self::OtherLaw,
        Self::FirstGap,
        Self::SmallerBeads,
        Self::LargerBeads,
    ];

    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::SofterSupport => "support 30 % softer",
            Self::StifferSupport => "support 30 % stiffer",
            Self::BeadFewer => "one bead fewer",
            Self::BeadMore => "one bead more",
            Self::OtherLaw => "the other damping law",
            Self::FirstGap => "first gap 20 nm wider",
            Self::SmallerBeads => "beads 5 % smaller",
            Self::LargerBeads => "beads 5 % larger",
        }
    }

    /// Overrides that a true bench has besides those of `scene`.
    pub(super) fn overrides(self, scene: &Scene) -> Vec<String> {
        let (count, radius) = (scene.chain.beads.len(), scene.chain.beads.first().map_or(0.0, |bead| bead.radius));
        match self {
            Self::BeadFewer => vec![format!("chain.beads={}", count - 1)],
            Self::BeadMore => vec![format!("chain.beads={}", count + 1)],
            Self::SmallerBeads => vec![format!("chain.radius={}", 0.95 * radius)],
            Self::LargerBeads => vec![format!("chain.radius={}", 1.05 * radius)],
            _ => vec![],
        }
    }

    /// The rest, written into that bench with its parameters set; false where the bench cannot have it or the fit would find it.
    pub(super) fn write_into(self, scene: &mut Scene, fitted: &[Parameter]) -> bool {
        let fits = |target| fitted.iter().any(|parameter| parameter.target == target);
        match self {
            Self::SofterSupport | Self::StifferSupport => {
                let factor = if self == Self::SofterSupport { 0.7 } else { 1.3 };
                let stiffness = scene.support.stiffness_mut().filter(|_| !fits(Target::SupportStiffness));
                stiffness.map(|stiffness| *stiffness *= factor).is_some()
            }
            Self::OtherLaw => {
                let own = scene.damping.coefficients;
                let law = scene.damping.kind;
                *scene = with_other_law(scene);
                let other = &mut scene.damping.coefficients;
                other[DampingTerm::Linear] = own[DampingTerm::KuwabaraKono] / EQUIVALENT;
                other[DampingTerm::KuwabaraKono] = own[DampingTerm::Linear] * EQUIVALENT;
                matches!(law, DampingKind::Linear | DampingKind::KuwabaraKono)
            }
            Self::FirstGap => {
                scene.chain.gaps[0] += FIRST_GAP;
                scene.chain.precompression == 0.0 && !fits(Target::Gap) && !fits(Target::Precompression)
            }
            Self::BeadFewer | Self::BeadMore | Self::SmallerBeads | Self::LargerBeads => true,
        }
    }
}
