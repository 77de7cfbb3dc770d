//! The chain at rest under its precompression.
//!
//! Every contact carries the same axial force F₀; with the whole static flexibility of the bodies, the approach d of each is found for which
//! it does, its neighbours' forces given, until none changes any more.

use super::{
    contact::{State, dot},
    mechanics::{Flexibility, Mechanics},
    reduction::Reduction,
};
use crate::{
    fea::{
        FeaError,
        equilibrium::{force_at, held, settle},
    },
    scene::Scene,
};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Equilibrium {
    /// Forces of the points of every contact, N.
    pub(super) forces: Vec<Vec<f64>>,
    /// Gap of every contact's points at zero displacement, m.
    pub(super) gaps: Vec<Vec<f64>>,
    /// Overlap of the rigid motions at every contact at zero displacement, m.
    pub(super) overlaps: Vec<f64>,
    /// Sweeps over all contacts that the equilibrium took; 0 without a precompression.
    pub(super) sweeps: u32,
}

impl Equilibrium {
    /// Of a scene with these bodies; nothing is solved without a precompression.
    pub(super) fn new(reduction: &Reduction, scene: &Scene) -> Result<Self, FeaError> {
        let (force, chain) = (scene.chain.precompression, &scene.chain);
        let geometries = || reduction.contacts.iter().map(|&geometry| &reduction.geometries[geometry]);
        let mut forces: Vec<Vec<f64>> = geometries().map(|geometry| vec![0.0; geometry.gaps.len()]).collect();
        let (mut approaches, mut sweeps) = (vec![0.0; forces.len()], 0);
        let mut disc = None;
        if force > 0.0 {
            if let Some((contact, gap)) = chain.first_open_gap() {
                return Err(FeaError::OpenGapUnderPrecompression { force, contact, gap });
            }
            disc = held(reduction.front.as_ref(), force)?;
            let further = disc.as_ref().map_or(&[][..], |disc| &disc.points);
            let statics = Mechanics::new(reduction, scene, Flexibility::Static, further)?;
            sweeps = press(reduction, &statics, force, &mut forces, &mut approaches)?;
        }
        let mut overlaps: Vec<f64> =
            approaches.iter().zip(scene.gaps()).map(|(approach, gap)| approach - gap).collect();
        let gaps = geometries().zip(&overlaps).map(|(geometry, overlap)| {
            geometry.gaps.iter().zip(&geometry.axial).map(|(gap, axial)| gap - axial * overlap).collect()
        });
        let mut gaps: Vec<Vec<f64>> = gaps.collect();
        if let (Some(disc), [.., gaps], [.., forces], [.., overlap]) =
            (disc, &mut gaps[..], &forces[..], &mut overlaps[..])
        {
            // The motion of a disc on water is counted from here.
            let (points, modes) = disc.under(forces);
            gaps.iter_mut().zip(points).for_each(|(gap, retreat)| *gap += retreat);
            *overlap -= modes;
        }
        Ok(Self { gaps, forces, overlaps, sweeps })
    }
}

/// Approaches of all contacts under the axial force F₀ (N), and the forces of their points; returns the sweeps over all contacts.
fn press(
    reduction: &Reduction,
    statics: &Mechanics,
    force: f64,
    forces: &mut [Vec<f64>],
    approaches: &mut [f64],
) -> Result<u32, FeaError> {
    let own = |contact: usize| &statics.condensed[statics.of_contact[contact]];
    let mut moments: Vec<Vec<f64>> = (0..forces.len()).map(|contact| State::<f64>::new(own(contact)).moments).collect();
    settle(force, approaches, |contact, guess| {
        let (condensed, geometry) = (own(contact), &reduction.geometries[reduction.contacts[contact]]);
        let mut free = geometry.gaps.clone();
        let before = condensed.before();
        for (a, vector) in condensed.vectors().enumerate() {
            let shift = if a < before {
                moments[contact - 1][own(contact - 1).before() + a]
            } else {
                moments[contact + 1][a - before]
            };
            free.iter_mut().zip(vector).for_each(|(gap, u)| *gap += u * shift);
        }
        let found = force_at(condensed.compliance(), &geometry.axial, &free, force, guess, &mut forces[contact])
            .map_err(|iterations| FeaError::NoEquilibrium { force, contact: contact + 1, iterations })?;
        for (moment, vector) in moments[contact].iter_mut().zip(condensed.vectors()) {
            *moment = dot(&forces[contact], vector);
        }
        Ok(found)
    })
}
