//! The contact of the last bead with its support while the normals move.
//!
//! A step begins with the normals of its start; the contacts are solved, the normals turned to the displacements found, and so on until no
//! gap changes any more.

use super::{
    FeaError,
    arrangement::Arrangement,
    contact::{
        chain::{ContactState, RigidPrediction},
        ring::{Linearised, Ring, SETTLED},
    },
    motion::Motion,
    operator::{Interfaces, Operator},
};
use crate::scene::{ContactNormal, Scene};

const MOST_TURNS: u32 = 30;

#[derive(Debug, Clone)]
pub(super) struct Turning {
    ring: Ring,
    linearised: Linearised,
    turns: u32,
    /// Forces on, and displacements of, the interface unknowns of the last bead and of the support.
    forces: [Vec<f64>; 2],
    displacements: [Vec<f64>; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turned {
    Settled,
    Moved,
    TooOften,
}

impl Turning {
    /// Where the scene asks for it and has a ring.
    pub(crate) fn new(
        scene: &Scene,
        arrangement: &Arrangement,
        interfaces: &Interfaces,
    ) -> Result<Option<Self>, FeaError> {
        let pair = arrangement.contacts.last().map(|&pair| &arrangement.pairs[pair]);
        let (Some(ContactNormal::Moving), Some(ring)) =
            (scene.support.normal(), pair.and_then(|pair| pair.ring.clone()))
        else {
            return Ok(None);
        };
        if scene.chain.precompression > 0.0 {
            return Err(FeaError::MovingNormalPrecompressed { force: scene.chain.precompression });
        }
        let last = arrangement.beads.len();
        let blank = [last, last + 1]
            .map(|slot| vec![0.0; arrangement.kind(slot).map_or(0, |kind| interfaces.unknowns[kind].len())]);
        Ok(Some(Self { linearised: ring.at_rest(), ring, turns: 0, forces: blank.clone(), displacements: blank }))
    }

    pub(crate) fn follow(
        &mut self,
        motion: &Motion,
        interfaces: &mut Interfaces,
        arrangement: &Arrangement,
        overlaps: &[f64],
        gaps: &mut [Vec<f64>],
    ) {
        let last = arrangement.beads.len();
        for (side, values) in self.displacements.iter_mut().enumerate() {
            if let Some(kind) = arrangement.kind(last + side) {
                for (value, &unknown) in values.iter_mut().zip(&interfaces.unknowns[kind]) {
                    *value = motion.displacement(last + side, unknown);
                }
            }
        }
        self.turns = 0;
        self.linearise(interfaces, motion.rigid_displacement(last), overlaps[last], &mut gaps[last]);
    }

    #[allow(clippy::too_many_arguments, reason = "the parts of a step, borrowed apart")]
    pub(crate) fn turn(
        &mut self,
        operator: &Operator,
        motion: &Motion,
        interfaces: &mut Interfaces,
        arrangement: &Arrangement,
        contacts: &[ContactState],
        rigid: &RigidPrediction,
        overlap: f64,
        gaps: &mut [f64],
    ) -> Turned {
        let last = arrangement.beads.len();
        for side in 0..2 {
            let slot = last + side;
            let Some(free) = motion.free_interface(slot) else { continue };
            interfaces.press(slot, |contact| Some(&contacts.get(contact)?.forces), &mut self.forces[side]);
            let shift = operator.contacts.damping_shift(slot, contacts);
            let out = &mut self.displacements[side];
            operator.interface_displacement(arrangement, interfaces, slot, free, &self.forces[side], shift, out);
        }
        let (displacement, _) = operator.contacts.rigid_motion(last, rigid, contacts);
        let change = self.linearise(interfaces, displacement, overlap, gaps);
        self.turns += 1;
        match change {
            change if change <= SETTLED => Turned::Settled,
            _ if self.turns >= MOST_TURNS => Turned::TooOften,
            _ => Turned::Moved,
        }
    }

    fn linearise(&mut self, interfaces: &mut Interfaces, rigid: f64, overlap: f64, gaps: &mut [f64]) -> f64 {
        let last = interfaces.faces.len() - 1;
        let displacements = &self.displacements;
        let value = |side: usize, unknown: usize| displacements[side][unknown];
        self.ring.follow(&mut interfaces.faces[last], value, rigid, overlap, &mut self.linearised, gaps)
    }
}
