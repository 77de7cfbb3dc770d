//! Which law each contact of a chain has.

use super::finite_body::FiniteBodyLaws;
use crate::{
    ModelError,
    contact_law::{
        Annulus, Hertz, Law, Spring, bead_face_stiffness, bead_flat_stiffness, bead_pair_stiffness, foundation,
    },
    scene::{FlatContact, Scene, Support},
};

/// Elastic laws of the N + 1 contacts, and how they feel one another.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ContactLaws {
    pub laws: Vec<Law>,
    /// Coupling through each of the N beads, m/N; none with the law of Hertz.
    pub couplings: Option<Vec<f64>>,
}

impl ContactLaws {
    /// Those the scene asks for; `fitted` are the laws of its bodies where they are known already.
    pub(crate) fn of(scene: &Scene, fitted: Option<&FiniteBodyLaws>) -> Result<Self, ModelError> {
        match fitted {
            _ if !scene.has_fitted_laws() => Self::hertz(scene),
            Some(fitted) => fitted.contact_laws(scene),
            None => FiniteBodyLaws::fit(scene)?.contact_laws(scene),
        }
    }

    /// The law of Hertz for all but annulus and spring; the annulus is the paper's.
    pub(crate) fn hertz(scene: &Scene) -> Result<Self, ModelError> {
        let beads = &scene.chain.beads;
        let hertz = |stiffness| Law::Hertz(Hertz { stiffness });
        let mut laws = vec![hertz(bead_face_stiffness(&beads[0], scene.piston_face()))];
        laws.extend(beads.windows(2).map(|pair| hertz(bead_pair_stiffness(&pair[0], &pair[1]))));
        need_law(&scene.support)?;
        let last = &beads[beads.len() - 1];
        laws.push(match scene.support {
            Support::Annulus { stiffness_factor, .. } => Law::Annulus(Annulus::new(stiffness_factor)),
            Support::Spring { stiffness } => Law::Spring(Spring { stiffness }),
            ref other if let Some((law, _)) = foundation(last, other) => law,
            ref other => hertz(bead_flat_stiffness(last, other.flat().unwrap_or(FlatContact::Rigid))),
        });
        Ok(Self { laws, couplings: None })
    }
}

/// Refuse a support without a force law.
pub(super) fn need_law(support: &Support) -> Result<(), ModelError> {
    let reason = match support {
        Support::Disc { .. } => {
            "a disc moves and has no force law: its scene is run by `model::prepare`, one run at a time".into()
        }
        _ => return Ok(()),
    };
    Err(ModelError::Unsupported { model: "chain", reason })
}
