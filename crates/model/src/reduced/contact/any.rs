//! Contacts whose pressed set is no prefix: rings, and prefixes that failed. Every run keeps the factor of a set of its own.

use super::{Condensed, State, dot, nonzero, pressed};
use crate::{
    fea::contact::complementarity::{Compliance, MOST_SETS, Ordering, Scratch},
    number::{Mask, Number},
};

#[derive(Debug, Clone)]
pub(super) struct Single {
    scratch: Scratch,
    free: Vec<f64>,
    forces: Vec<f64>,
    gaps: Vec<f64>,
    slope: Vec<f64>,
}

impl Single {
    pub(super) fn new(points: usize, vectors: usize) -> Self {
        Self {
            scratch: Scratch::keeping(points),
            free: vec![0.0; points],
            forces: vec![0.0; points],
            gaps: vec![0.0; points],
            slope: vec![0.0; vectors * vectors],
        }
    }
}

impl Condensed {
    /// Solve the runs `todo` for sets of any kind. Forces of a set are found run by run, with the factor that each keeps of its own; gaps of all
    /// runs together.
    #[inline(always)]
    pub(super) fn solve_any<N: Number>(
        &self,
        state: &mut State<N>,
        todo: N::Mask,
        mut unsolved: impl FnMut(usize),
    ) -> u32 {
        let mut pending = self.guess(state, todo);
        let (mut settled, mut sets) = (todo & !pending, 0);
        for _ in 0..MOST_SETS {
            for place in pending.places() {
                let Single { scratch, free, forces, .. } = &mut state.single[place];
                if self.compliance.press_set(free, forces, scratch).is_err() {
                    unsolved(place);
                    pending = pending & N::Mask::but(place);
                }
                state.trial.iter_mut().zip(&*forces).for_each(|(out, force)| out.put(place, *force));
                sets += 1;
            }
            if !pending.any() {
                break;
            }
            let holds = pending & self.open_gaps(state);
            settled = settled | holds;
            pending = pending & !holds;
            for place in pending.places() {
                let Single { scratch, forces, gaps, .. } = &mut state.single[place];
                gaps.iter_mut().zip(&state.gaps).for_each(|(out, gap)| *out = gap.get(place));
                let rounding = state.rounding.get(place);
                scratch.is_the_set(forces, gaps, rounding);
            }
        }
        for place in pending.places() {
            let Single { scratch, free, forces, gaps, .. } = &mut state.single[place];
            let Ok(solved) = self.compliance.solve(free, forces, gaps, scratch) else {
                unsolved(place);
                continue;
            };
            state.trial.iter_mut().zip(&*forces).for_each(|(out, force)| out.put(place, *force));
            (settled, sets) = (settled | !N::Mask::but(place), sets + solved.iterations);
        }
        self.take_any(state, settled);
        sets
    }

    /// Begin with the sets of the runs `todo`: where any of their points is closed.
    #[inline(always)]
    fn guess<N: Number>(&self, state: &mut State<N>, todo: N::Mask) -> N::Mask {
        let State { shifted, trial, forces, rounding, single, .. } = state;
        let (mut open, mut largest) = (N::Mask::all(true), N::ZERO);
        for gap in shifted.iter() {
            open = open & N::ZERO.within(*gap);
            largest = largest.larger(gap.magnitude());
        }
        *rounding = largest * Compliance::ROUNDING;
        let pending = todo & !open;
        for place in pending.places() {
            // What an attempt at a prefix left is no worse a guess than any.
            let guess = if self.ordering == Ordering::Prefix { &*trial } else { &*forces };
            let Single { scratch, free, forces, .. } = &mut single[place];
            free.iter_mut().zip(&*shifted).for_each(|(out, gap)| *out = gap.get(place));
            forces.iter_mut().zip(guess).for_each(|(out, force)| *out = force.get(place));
            scratch.guess(free, forces);
        }
        trial.fill(N::ZERO);
        pending
    }

    /// All gaps under the forces that are tried; where none beyond the pressed points is closed, and every force presses.
    #[inline(always)]
    fn open_gaps<N: Number>(&self, state: &mut State<N>) -> N::Mask {
        let State { shifted, trial, gaps, rounding, .. } = state;
        let [first, end] = nonzero(trial);
        let mut holds = N::Mask::all(true);
        let least = N::ZERO - *rounding;
        for (i, (gap, shifted)) in gaps.iter_mut().zip(&*shifted).enumerate() {
            let own = dot(&trial[first..end], &self.compliance.row(i)[first..end]);
            *gap = *shifted + own;
            let force = trial[i];
            holds = holds & (force.above(N::ZERO) | force.equals(N::ZERO) & least.within(*gap));
        }
        holds
    }

    #[inline(always)]
    fn take_any<N: Number>(&self, state: &mut State<N>, taken: N::Mask) {
        let State { forces, trial, moments, slope, prefix, single, .. } = state;
        *prefix = N::all(f64::NAN).or_where_not(taken, *prefix);
        let [first, end] = nonzero(trial);
        for (force, trial) in forces.iter_mut().zip(&*trial) {
            *force = trial.or_where_not(taken, *force);
        }
        for (m, vector) in moments.iter_mut().zip(self.coupling.chunks_exact(self.points)) {
            *m = dot(&trial[first..end], &vector[first..end]).or_where_not(taken, *m);
        }
        for place in taken.places() {
            let own = &mut single[place];
            if (first..end).any(|i| trial[i].get(place) > 0.0) {
                own.scratch.sensitivity(&self.coupling, self.points, &mut own.slope);
                slope.iter_mut().zip(&own.slope).for_each(|(out, slope)| out.put(place, *slope));
            } else {
                slope.iter_mut().for_each(|out| out.put(place, 0.0));
            }
        }
        state.pressed = pressed(&state.forces);
    }
}
