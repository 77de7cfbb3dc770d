//! The books of a run: where the work of the piston went.

use crate::response::{Channels, EnergyLedger, SolverWork};

/// Share of the energy put in above which energy from nowhere ends a run, 1: it grows from there on.
pub(crate) const LARGEST_GAIN: f64 = 0.1;

#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Ledger {
    least_scale: f64,
    initial: f64,
    piston_work: f64,
    dissipated: f64,
    /// Energy that contacts made (> 0) or lost by opening and closing within steps, J: part of the residual, known exactly.
    contact_energy: f64,
    /// Sum of the amounts of the piston's work, J: a scale that never falls.
    worked: f64,
    kinetic: f64,
    stored: f64,
    largest: f64,
    /// Largest residual of all samples, J.
    largest_residual: f64,
    /// What went elsewhere; none where the scene has nothing of the kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) channels: Option<Channels>,
    pub work: SolverWork,
}

impl Ledger {
    /// Empty books; errors of a step are held against at least `least_scale` (J).
    pub(crate) fn new(least_scale: f64) -> Self {
        Self { least_scale, ..Self::default() }
    }

    /// Empty books of a run that has done this work so far.
    pub(crate) fn of(work: SolverWork) -> Self {
        Self { work, ..Self::default() }
    }

    /// The state at the start, (kinetic, stored) in J.
    pub(crate) fn begin(&mut self, energy: (f64, f64)) {
        (self.kinetic, self.stored) = energy;
        self.initial = self.kinetic + self.stored;
        self.largest = self.initial;
    }

    /// Works of one step, J.
    pub(crate) fn step(&mut self, piston_work: f64, dissipated: f64, contact_energy: f64) {
        self.piston_work += piston_work;
        self.worked += piston_work.abs();
        self.dissipated += dissipated;
        self.contact_energy += contact_energy;
    }

    /// Energy against which an error of one step is held, J.
    pub(crate) fn scale(&self) -> f64 {
        (self.initial + self.worked).max(self.least_scale)
    }

    /// The state at a sample, (kinetic, stored) in J.
    pub(crate) fn sample(&mut self, energy: (f64, f64)) {
        (self.kinetic, self.stored) = energy;
        self.largest = self.largest.max(self.kinetic + self.stored);
        self.largest_residual = self.largest_residual.max(self.residual().abs());
    }

    fn residual(&self) -> f64 {
        let lost = self.channels.map_or(0.0, |channels| channels.lost());
        self.initial + self.piston_work - self.kinetic - self.stored - self.dissipated - lost
    }

    /// Energy from nowhere at the last sample, J, and all that was put in, if it is more than [`LARGEST_GAIN`] of that.
    pub(crate) fn made(&self) -> Option<(f64, f64)> {
        let (made, given) = (-self.residual(), self.scale());
        (made > LARGEST_GAIN * given).then_some((made, given))
    }

    /// Largest residual of all samples over the largest energy, 1.
    pub fn balance(&self) -> f64 {
        if self.largest > 0.0 { self.largest_residual / self.largest } else { 0.0 }
    }

    /// Energy that contacts made or lost within steps, J.
    pub fn contact_energy(&self) -> f64 {
        self.contact_energy
    }

    pub(crate) fn books(&self) -> EnergyLedger {
        EnergyLedger {
            initial_j: self.initial,
            piston_work_j: self.piston_work,
            kinetic_j: self.kinetic,
            stored_j: self.stored,
            dissipated_j: self.dissipated,
            disc_j: None,
            channels: self.channels,
            water_j: None,
            residual_j: self.residual(),
            largest_j: self.largest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn books_that_add_up_leave_no_residual_and_others_show_it_over_the_largest_energy() {
        let mut ledger = Ledger::new(1.0);
        ledger.begin((1.0, 2.0));
        ledger.step(5.0, 0.5, 0.0);
        ledger.sample((4.0, 3.5));
        assert_eq!((ledger.balance(), ledger.books().residual_j), (0.0, 0.0));
        ledger.step(-1.0, 0.0, 0.25);
        ledger.sample((3.0, 3.0));
        // 3 + 4 − 6 − 0.5 over 7.5; and it stays the largest once the books meet again.
        assert!((ledger.balance() - 0.5 / 7.5).abs() < 1e-15);
        assert!(ledger.made().is_none());
        ledger.step(0.0, 0.5, 0.0);
        ledger.sample((3.0, 3.0));
        assert_eq!(ledger.books().residual_j, 0.0);
        assert!((ledger.balance() - 0.5 / 7.5).abs() < 1e-15);
        assert_eq!((ledger.books().dissipated_j, ledger.contact_energy()), (1.0, 0.25));
        // Of 3 J at the start and 6 J of work either way: a tenth may come from nowhere, no more.
        ledger.sample((3.0, 3.8));
        assert!(ledger.made().is_none());
        ledger.sample((3.0, 4.0));
        assert!(ledger.made().is_some_and(|(made, given)| (made - 1.0).abs() < 1e-12 && given == 9.0));
    }

    #[test]
    fn the_scale_of_errors_never_falls_below_its_least_nor_with_work_given_back() {
        let mut ledger = Ledger::new(2.0);
        ledger.begin((0.0, 0.0));
        assert_eq!(ledger.scale(), 2.0);
        ledger.step(3.0, 0.0, 0.0);
        ledger.step(-3.0, 0.0, 0.0);
        assert_eq!(ledger.scale(), 6.0);
        assert_eq!(Ledger::new(1.0).balance(), 0.0);
    }
}
