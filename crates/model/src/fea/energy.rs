//! The energy balance of a run: where the work of the piston went.

use crate::response::{EnergyBalance, EnergySums, SolverWork};

/// Share of the energy put in above which energy from nowhere ends a run, 1: it grows from there on.
pub(crate) const LARGEST_GAIN: f64 = 0.1;

#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct EnergyTerms {
    #[serde(flatten)]
    pub(crate) balance: EnergySums,
    least_scale: f64,
    /// Energy that contacts made (> 0) or lost by opening and closing within steps, J: part of the residual, known exactly.
    contact_energy: f64,
    /// Sum of the amounts of the piston's work, J: a scale that never falls.
    worked: f64,
    /// Largest residual of all samples, J.
    largest_residual: f64,
    pub work: SolverWork,
}

impl EnergyTerms {
    /// An empty balance; errors of a step are relative to at least `least_scale` (J).
    pub(crate) fn new(least_scale: f64, work: SolverWork) -> Self {
        Self { least_scale, work, ..Self::default() }
    }

    /// The state at the start, (kinetic, stored) in J.
    pub(crate) fn begin(&mut self, energy: (f64, f64)) {
        self.balance = EnergySums::starting(energy, self.balance.channels);
    }

    /// Works of one step, J.
    pub(crate) fn step(&mut self, piston_work: f64, dissipated: f64, contact_energy: f64) {
        self.balance.step(piston_work, dissipated);
        self.worked += piston_work.abs();
        self.contact_energy += contact_energy;
    }

    /// Energy against which an error of one step is held, J.
    pub(crate) fn scale(&self) -> f64 {
        (self.balance.initial + self.worked).max(self.least_scale)
    }

    /// The state at a sample, (kinetic, stored) in J.
    pub(crate) fn sample(&mut self, energy: (f64, f64)) {
        self.balance.hold(energy);
        self.balance.largest = self.balance.largest.max(energy.0 + energy.1);
        self.largest_residual = self.largest_residual.max(self.balance.residual().abs());
    }

    /// Energy from nowhere at the last sample, J, and all that was put in, if it is more than [`LARGEST_GAIN`] of that.
    pub(crate) fn made(&self) -> Option<(f64, f64)> {
        let (made, given) = (-self.balance.residual(), self.scale());
        (made > LARGEST_GAIN * given).then_some((made, given))
    }

    /// Largest residual of all samples over the largest energy, 1.
    pub fn balance(&self) -> f64 {
        if self.balance.largest > 0.0 { self.largest_residual / self.balance.largest } else { 0.0 }
    }

    /// Energy that contacts made or lost within steps, J.
    pub fn contact_energy(&self) -> f64 {
        self.contact_energy
    }

    pub(crate) fn energy_balance(&self) -> EnergyBalance {
        self.balance.balance()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_energy_balance_has_no_residual_and_others_show_it_over_the_largest_energy() {
        let mut balance = EnergyTerms::new(1.0, SolverWork::default());
        balance.begin((1.0, 2.0));
        balance.step(5.0, 0.5, 0.0);
        balance.sample((4.0, 3.5));
        assert_eq!((balance.balance(), balance.energy_balance().residual_j), (0.0, 0.0));
        balance.step(-1.0, 0.0, 0.25);
        balance.sample((3.0, 3.0));
        // 3 + 4 − 6 − 0.5 over 7.5; and it stays the largest once the books meet again.
        assert!((balance.balance() - 0.5 / 7.5).abs() < 1e-15);
        assert!(balance.made().is_none());
        balance.step(0.0, 0.5, 0.0);
        balance.sample((3.0, 3.0));
        assert_eq!(balance.energy_balance().residual_j, 0.0);
        assert!((balance.balance() - 0.5 / 7.5).abs() < 1e-15);
        assert_eq!((balance.energy_balance().dissipated_j, balance.contact_energy()), (1.0, 0.25));
        // Of 3 J at the start and 6 J of work either way: a tenth may come from nowhere, no more.
        balance.sample((3.0, 3.8));
        assert!(balance.made().is_none());
        balance.sample((3.0, 4.0));
        assert!(balance.made().is_some_and(|(made, given)| (made - 1.0).abs() < 1e-12 && given == 9.0));
    }

    #[test]
    fn the_scale_of_errors_never_falls_below_its_least_nor_with_work_given_back() {
        let mut balance = EnergyTerms::new(2.0, SolverWork::default());
        balance.begin((0.0, 0.0));
        assert_eq!(balance.scale(), 2.0);
        balance.step(3.0, 0.0, 0.0);
        balance.step(-3.0, 0.0, 0.0);
        assert_eq!(balance.scale(), 6.0);
        assert_eq!(EnergyTerms::new(1.0, SolverWork::default()).balance(), 0.0);
    }
}
