//! Least misfit of the mean trace to the records.

use argmin::{
    core::{CostFunction, Error, Executor, Gradient, Hessian, State},
    solver::trustregion::{Steihaug, TrustRegion},
};

use super::regression::Misfit;

/// Largest distance of an answer from the centre of the runs, in their standard deviations.
const REACH: f64 = 4.0;

/// ½ φ' M φ as a problem of argmin.
struct Cost<'a>(&'a Misfit);

impl CostFunction for Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, z: &Vec<f64>) -> Result<f64, Error> {
        Ok(0.5 * self.0.squares(z))
    }
}

impl Gradient for Cost<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, z: &Vec<f64>) -> Result<Vec<f64>, Error> {
        Ok(self.0.gradient(z))
    }
}

impl Hessian for Cost<'_> {
    type Param = Vec<f64>;
    type Hessian = Vec<Vec<f64>>;

    fn hessian(&self, z: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        Ok(self.0.information(z))
    }
}

/// The most likely z: Gauss–Newton steps in a trust region.
pub(super) fn minimum(misfit: &Misfit) -> Vec<f64> {
    let start = vec![0.0; misfit.dimension];
    let solver = TrustRegion::new(Steihaug::new()).with_max_radius(REACH);
    let Ok(solver) = solver.and_then(|solver| solver.with_radius(1.0)) else { return start };
    let run = Executor::new(Cost(misfit), solver)
        .configure(|state| state.param(start.clone()).max_iters(30))
        .ctrlc(false)
        .timer(false)
        .run();
    let found = run.ok().and_then(|run| run.state.get_best_param().cloned()).unwrap_or(start);
    found.into_iter().map(|z| z.clamp(-REACH, REACH)).collect()
}
