//! What is made while bodies are made ready, counted where it is made.
//!
//! Factors, modes and kernels are made deep inside, by functions that have no other reason to know of one another. Each adds itself to the
//! tally of its thread, and [`during`] reads what was added in between. Nothing that steps through time counts here: a step has counts of
//! its own ([`crate::response::SolverWork`]).

use std::cell::Cell;

use crate::response::Preparation;

thread_local! {
    static TALLY: Cell<Preparation> = Cell::new(Preparation::default());
}

pub(crate) fn add(count: impl FnOnce(&mut Preparation)) {
    TALLY.with(|tally| {
        let mut sum = tally.get();
        count(&mut sum);
        tally.set(sum);
    });
}

/// What a computation on this thread returns, and what was made in it.
pub(crate) fn during<T>(make: impl FnOnce() -> T) -> (T, Preparation) {
    let before = TALLY.with(Cell::get);
    let made = make();
    let after = TALLY.with(Cell::get);
    let difference = Preparation {
        bodies: after.bodies - before.bodies,
        factorisations: after.factorisations - before.factorisations,
        modes: after.modes - before.modes,
        fitted_laws: after.fitted_laws - before.fitted_laws,
        water_meshes: after.water_meshes - before.water_meshes,
        kernels: after.kernels - before.kernels,
        recorded_steps: after.recorded_steps - before.recorded_steps,
    };
    (made, difference)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inner_count_is_part_of_the_outer_one() {
        let ((_, inner), outer) = during(|| {
            add(|tally| tally.kernels += 2);
            during(|| add(|tally| tally.modes += 3))
        });
        assert_eq!(inner, Preparation { modes: 3, ..Preparation::default() });
        assert_eq!(outer, Preparation { modes: 3, kernels: 2, ..Preparation::default() });
    }
}
