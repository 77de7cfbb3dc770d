//! An analysis saved, to be taken up again.

use super::Simulation;
use crate::{
    fea::{
        FeaError,
        contact::chain::ContactState,
        control::{Complementarity, Cut},
        energy::EnergyTerms,
        motion::Saved,
        trace::Trace,
    },
    horn::HornMotion,
};

#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Snapshot {
    /// What the state belongs to: a text that differs when anything that matters differs.
    pub identity: String,
    taken: usize,
    travel: f64,
    motion: Saved,
    contacts: Vec<ContactState>,
    trace: Trace,
    #[serde(rename = "ledger")]
    balance: EnergyTerms,
    complementarity: Complementarity,
    cuts: Vec<Cut>,
    /// None where the horn does not give way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    horn: Option<HornMotion<f64>>,
}

impl Simulation<'_> {
    /// Save everything that is needed to go on later; `identity` says what the state belongs to.
    pub fn snapshot(&self, identity: &str) -> Snapshot {
        Snapshot {
            identity: identity.into(),
            taken: self.taken,
            travel: self.travel,
            motion: self.motion.save(),
            contacts: self.contacts.clone(),
            trace: self.trace.clone(),
            balance: self.balance,
            complementarity: self.complementarity,
            cuts: self.cuts.clone(),
            horn: self.horn,
        }
    }

    /// Go on from a saved state: the run then ends in the same bytes as if it had never stopped.
    ///
    /// # Errors
    /// [`FeaError::OtherState`] when the state is of another analysis, [`FeaError::ImpossibleState`] when it can be of none.
    pub fn restore(&mut self, snapshot: Snapshot, identity: &str) -> Result<(), FeaError> {
        if self.wet.is_some() {
            return Err(FeaError::WaterNotKept);
        }
        let points =
            |contacts: &[ContactState]| contacts.iter().map(|contact| contact.forces.len()).collect::<Vec<_>>();
        let fits = snapshot.identity == identity
            && points(&snapshot.contacts) == points(&self.contacts)
            && snapshot.horn.is_some() == self.horn.is_some();
        let whole = |contact: &ContactState| contact.gaps.len() == contact.forces.len();
        if fits
            && (snapshot.taken > self.sampling.steps()
                || !snapshot.trace.is_of(&self.trace, snapshot.taken)
                || !snapshot.contacts.iter().all(whole)
                || snapshot.balance.balance.channels.is_some() != self.balance.balance.channels.is_some())
        {
            return Err(FeaError::ImpossibleState);
        }
        if !fits || !self.motion.restore(&snapshot.motion) {
            return Err(FeaError::OtherState { expected: identity.into(), found: snapshot.identity });
        }
        let Snapshot { taken, travel, contacts, trace, balance, complementarity, cuts, .. } = snapshot;
        // The factors that the saved run had made: levels are made in order, one factor a kind of body.
        let made = balance.work.factorisations as usize / self.arrangement.kinds.len().max(1);
        for level in 1..made.min(self.operators.len()) {
            self.factor(level as u32)?;
        }
        (self.taken, self.travel, self.contacts, self.trace) = (taken, travel, contacts, trace);
        (self.balance, self.complementarity, self.cuts) = (balance, complementarity, cuts);
        self.before.clone_from(&self.contacts);
        self.horn = snapshot.horn;
        self.driven = self.drive.at(self.time()).0;
        self.piston = self.horn.map_or(self.driven, |horn| self.driven + horn.displacement);
        self.motion.move_piston(self.piston);
        Ok(())
    }
}
